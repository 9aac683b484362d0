//! The scene as written: a tree of objects with their parameters and where each stands in the file.
//!
//! Names and types have been checked against the table of plugins; nothing is defaulted, converted
//! or built. References are resolved: an object that is named in many places is one [`ObjectId`].

use super::error::{Place, SceneError, Source, Span};
use super::plugins::{Category, Plugin};
use super::props::Props;
use super::spectrum::Spectrum;
use crate::math::{DVec3, Transform};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Names an object of one [`SceneDesc`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub(super) u32);

impl ObjectId {
    /// Position among the objects of the description, below [`SceneDesc::object_count`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A checked description of a scene.
#[derive(Debug)]
pub struct SceneDesc {
    pub(super) sources: Vec<Source>,
    pub(super) objects: Vec<Object>,
    pub(super) root: ObjectId,
}

/// A plugin with what it was given.
#[derive(Debug)]
pub(super) struct Object {
    pub plugin: &'static Plugin,
    pub id: Option<String>,
    /// The `type` attribute, or the tag of the scene.
    pub at: Span,
    pub params: Vec<Given>,
    pub children: Vec<Child>,
    pub visited: Mark,
}

/// A parameter with a plain value.
#[derive(Debug)]
pub(super) struct Given {
    pub name: String,
    pub value: Value,
    pub name_at: Span,
    pub value_at: Span,
    pub read: Mark,
}

/// A nested object, or a reference to one.
#[derive(Debug)]
pub(super) struct Child {
    pub name: Option<String>,
    pub object: ObjectId,
    /// The name attribute if there is one, else what stands for the object.
    pub at: Span,
    pub read: Mark,
}

/// A value as the file gives it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Int(i64),
    Float(f64),
    Bool(bool),
    Text(String),
    /// A file that exists: its name as written is in the source, its path is here.
    File(PathBuf),
    Rgb([f64; 3]),
    Spectrum(Spectrum),
    /// A point or a vector: Mitsuba takes either for the other.
    Vector(DVec3),
    Transform(Box<Transform>),
    /// Keyframes at increasing times; at least one.
    Animation(Vec<(f64, Transform)>),
}

impl Value {
    /// For "expected this, found that".
    pub fn describe(&self) -> &'static str {
        match self {
            Value::Int(_) => "an integer",
            Value::Float(_) => "a float",
            Value::Bool(_) => "a boolean",
            Value::Text(_) | Value::File(_) => "a string",
            Value::Rgb(_) => "an rgb colour",
            Value::Spectrum(_) => "a spectrum",
            Value::Vector(_) => "a point or vector",
            Value::Transform(_) => "a transform",
            Value::Animation(_) => "an animation",
        }
    }
}

/// Set once when something is read; shared by threads that read a scene together.
#[derive(Debug, Default)]
pub(super) struct Mark(AtomicBool);

impl Mark {
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl SceneDesc {
    /// The scene itself; its children are the objects of the file.
    pub fn scene(&self) -> Props<'_> {
        self.object(self.root)
    }

    /// Parameters and children of an object of this description.
    pub fn object(&self, id: ObjectId) -> Props<'_> {
        Props::new(self, id)
    }

    pub fn object_count(&self) -> usize {
        self.objects.len()
    }

    /// The XML files that were read, the scene itself first. A file included twice appears twice.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.sources.iter().map(|s| s.name.as_path())
    }

    /// Hash of everything the description says, after substitution, as 16 hexadecimal digits. The
    /// contents of mesh and image files are not in it, only their names.
    pub fn hash(&self) -> String {
        // FNV-1a: stable over versions and platforms, which the standard hasher does not promise.
        let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
        let mut add = |text: &str| {
            for byte in text.bytes().chain([0]) {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for object in &self.objects {
            add(object.plugin.name);
            for p in &object.params {
                add(&p.name);
                add(&format!("{:?}", p.value));
            }
            for c in &object.children {
                add(c.name.as_deref().unwrap_or_default());
                add(&c.object.0.to_string());
            }
        }
        format!("{hash:016x}")
    }

    pub(super) fn place(&self, at: Span) -> Place {
        place(&self.sources, at)
    }

    /// An error for the first parameter or child of a visited object that nothing has read.
    ///
    /// Definitions at the top of the scene that nothing refers to are no errors.
    pub fn check_all_read(&self) -> Result<(), SceneError> {
        for object in self.objects.iter().filter(|o| o.visited.is_set()) {
            let owner = object.plugin;
            if let Some(unread) = object.params.iter().find(|p| !p.read.is_set()) {
                let what = format!(
                    "parameter \"{}\" of {owner} has no effect here",
                    unread.name
                );
                return Err(SceneError::new(self.place(unread.name_at), what));
            }
            let unread = |c: &&Child| !c.read.is_set() && !self.is_definition(owner.category, c);
            if let Some(unread) = object.children.iter().find(unread) {
                let child = self.objects[unread.object.index()].plugin;
                let what = format!("{child} in {owner} has no effect here");
                return Err(SceneError::new(self.place(unread.at), what));
            }
        }
        Ok(())
    }

    /// True for what stands at the top of a scene only to be referred to.
    fn is_definition(&self, owner: Category, child: &Child) -> bool {
        let category = self.objects[child.object.index()].plugin.category;
        owner == Category::Scene
            && !matches!(
                category,
                Category::Integrator | Category::Sensor | Category::Shape | Category::Emitter
            )
    }
}

pub(super) fn place(sources: &[Source], at: Span) -> Place {
    sources[at.source as usize].place(at.offset as usize)
}

/// Meshes are read by several threads from one description.
const _: () = {
    const fn shared_by_threads<T: Send + Sync>() {}
    shared_by_threads::<SceneDesc>();
};
