//! References become objects; cycles and chains too deep to follow are refused.

use super::super::desc::{Child, Mark, Object, ObjectId, place};
use super::super::error::{SceneError, Source, Span, did_you_mean};
use super::super::limits;
use std::collections::HashMap;

/// A child as met in the file: an object, or the id of one that may come later.
pub struct RawChild {
    pub name: Option<String>,
    pub target: Target,
    pub at: Span,
}

pub enum Target {
    Object(ObjectId),
    Id(String, Span),
}

/// Ids and aliases with where they were defined.
pub type Ids = HashMap<String, (ObjectId, Span)>;

/// Fills in the children of all objects.
pub fn references(
    objects: &mut [Object],
    raw: Vec<Vec<RawChild>>,
    ids: &Ids,
    sources: &[Source],
) -> Result<(), SceneError> {
    for (object, children) in objects.iter_mut().zip(raw) {
        for child in children {
            let target = match &child.target {
                Target::Object(id) => *id,
                Target::Id(id, at) => match ids.get(id) {
                    Some((target, _)) => *target,
                    None => return Err(dangling(id, *at, ids, sources)),
                },
            };
            object.children.push(Child {
                name: child.name,
                object: target,
                at: child.at,
                read: Mark::default(),
            });
        }
    }
    Ok(())
}

fn dangling(id: &str, at: Span, ids: &Ids, sources: &[Source]) -> SceneError {
    // Sorted, so that the suggestion does not depend on the order of the map.
    let mut known: Vec<&str> = ids.keys().map(String::as_str).collect();
    known.sort_unstable();
    SceneError::new(place(sources, at), format!("no object has the id \"{id}\""))
        .with_help_opt(did_you_mean(id, known))
}

/// Refuses references in a circle, and objects in objects deeper than a reader may recurse.
pub fn check_depth(objects: &[Object], sources: &[Source]) -> Result<(), SceneError> {
    let mut state = vec![State::New; objects.len()];
    for start in 0..objects.len() {
        visit(objects, sources, start, 0, &mut state)?;
    }
    Ok(())
}

#[derive(Clone, Copy)]
enum State {
    New,
    Open,
    /// Height above the deepest child.
    Done(usize),
}

/// The recursion ends at the limit that it checks.
fn visit(
    objects: &[Object],
    sources: &[Source],
    i: usize,
    depth: usize,
    state: &mut [State],
) -> Result<usize, SceneError> {
    if let State::Done(height) = state[i] {
        return Ok(height);
    }
    state[i] = State::Open;
    let mut height = 0;
    for child in &objects[i].children {
        let k = child.object.index();
        let at = || place(sources, child.at);
        if let State::Open = state[k] {
            let name = objects[k].id.as_deref().unwrap_or("");
            let what = format!(
                "\"{name}\" contains itself; it is defined at {}",
                place(sources, objects[k].at)
            );
            return Err(SceneError::new(at(), what));
        }
        let too_deep = || {
            let what = format!("objects nested more than {} deep", limits::XML_NESTING);
            SceneError::new(at(), what)
        };
        if depth >= limits::XML_NESTING {
            return Err(too_deep());
        }
        height = height.max(1 + visit(objects, sources, k, depth + 1, state)?);
        if depth + height > limits::XML_NESTING {
            return Err(too_deep());
        }
    }
    state[i] = State::Done(height);
    Ok(height)
}
