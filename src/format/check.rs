//! Checks an object of a description against the table of plugins.

use super::desc::{Child, Given, Object, Value};
use super::error::{Place, SceneError, Span, did_you_mean, list, shown_number};
use super::plugins::{self, Category, Default, Kind, Param, Plugin, Role};
use super::props::{float_of, is_parameter, missing_parameter};
use super::spectrum::Spectrum;
use crate::bsdf::iors;
use std::path::PathBuf;

/// The row of a plugin, or what is wrong with its name.
pub fn plugin(
    category: Category,
    name: &str,
    at: impl Fn() -> Place,
) -> Result<&'static Plugin, SceneError> {
    if let Some(plugin) = plugins::find(category, name) {
        return Ok(plugin);
    }
    if let Some(help) = plugins::why_unsupported(category, name) {
        let what = format!("{category} \"{name}\" is not supported");
        return Err(SceneError::new(at(), what).with_help(help));
    }
    let error = SceneError::new(at(), format!("unknown {category} \"{name}\""));
    let of_category = || plugins::all().filter(|p| p.category == category);
    let elsewhere = plugins::all().find(|p| p.name == name);
    let help = did_you_mean(name, of_category().map(|p| p.name))
        .or_else(|| elsewhere.map(|p| format!("\"{name}\" is a <{}>", p.category)))
        .unwrap_or_else(|| format!("luxel has {}", list(of_category().map(|p| p.name))));
    Err(error.with_help(help))
}

/// Checks names, types and ranges of the parameters, and replaces names of files by their paths.
///
/// `place` tells where a span is, `find` looks for a file.
pub fn params(
    plugin: &'static Plugin,
    params: &mut [Given],
    place: &dyn Fn(Span) -> Place,
    find: &dyn Fn(&str) -> Result<PathBuf, Wrong>,
) -> Result<(), SceneError> {
    for i in 0..params.len() {
        let (before, rest) = params.split_at_mut(i);
        let given = &mut rest[0];
        if let Some(first) = before.iter().find(|p| p.name == given.name) {
            return Err(twice(&given.name, given.name_at, first.name_at, place));
        }
        let param = plugin
            .param(&given.name)
            .ok_or_else(|| unknown(plugin, &given.name, place(given.name_at)))?;
        if let Some(clash) = before
            .iter()
            .find(|p| excludes(plugin, &p.name, &given.name))
        {
            return Err(clashing(plugin, &clash.name, given, clash.name_at, place));
        }
        let wrong = |what: String| SceneError::new(place(given.value_at), what);
        if let (Kind::File, Value::Text(name)) = (param.kind, &given.value) {
            let path = find(name).map_err(|(what, help)| wrong(what).with_help_opt(help))?;
            given.value = Value::File(path);
        } else if let Err((what, help)) = value(plugin, param, &given.value) {
            return Err(wrong(what).with_help_opt(help));
        }
    }
    Ok(())
}

/// Checks the children of an object and that nothing required is missing, once references are known.
pub fn children(
    objects: &[Object],
    object: &Object,
    place: &dyn Fn(Span) -> Place,
) -> Result<(), SceneError> {
    let plugin = object.plugin;
    for (i, child) in object.children.iter().enumerate() {
        let kind = objects[child.object.index()].plugin;
        let before = &object.children[..i];
        if is_parameter(plugin, kind.category, child.name.as_deref()) {
            texture_parameter(object, before, child, place)?;
            continue;
        }
        let Some(slot) = plugin.slot(kind.category) else {
            return Err(unwanted(plugin, kind.category, child, place));
        };
        let same = |c: &&Child| {
            let category = objects[c.object.index()].plugin.category;
            category == kind.category && !is_parameter(plugin, category, c.name.as_deref())
        };
        // Counting only where it is limited keeps a scene of many shapes linear.
        if slot.max < usize::MAX && before.iter().filter(same).count() >= slot.max {
            let first = before.iter().find(same).map_or(child.at, |c| c.at);
            let count = if slot.max == 1 {
                format!("one {}", kind.category)
            } else {
                format!("{} {}s", slot.max, kind.category)
            };
            let what = format!(
                "{plugin} takes at most {count}; the first is at {}",
                place(first)
            );
            return Err(SceneError::new(place(child.at), what));
        }
    }
    for slot in plugin.slots {
        let count = object
            .children
            .iter()
            .filter(|c| objects[c.object.index()].plugin.category == slot.category)
            .count();
        if count < slot.min {
            let what = match slot.min {
                1 => format!("{plugin} needs a <{}> inside", slot.category),
                n => format!("{plugin} needs {n} of <{}> inside", slot.category),
            };
            return Err(SceneError::new(place(object.at), what));
        }
    }
    let given = |name: &str| {
        let nested = |c: &Child| c.name.as_deref() == Some(name);
        object.params.iter().any(|p| p.name == name) || object.children.iter().any(nested)
    };
    match plugin
        .params
        .iter()
        .find(|p| p.default == Default::Required && !given(p.name))
    {
        Some(param) => Err(missing_parameter(plugin, param.name, place(object.at))),
        None => Ok(()),
    }
}

/// A texture as value of a parameter clashes with another value of the same or of an exclusive one.
fn texture_parameter(
    object: &Object,
    before: &[Child],
    child: &Child,
    place: &dyn Fn(Span) -> Place,
) -> Result<(), SceneError> {
    let name = child.name.as_deref().unwrap_or_default();
    let plain = object.params.iter().map(|p| (p.name.as_str(), p.name_at));
    let nested = before
        .iter()
        .filter_map(|c| c.name.as_deref().map(|n| (n, c.at)));
    for (other, at) in plain.chain(nested) {
        if other == name {
            return Err(twice(name, child.at, at, place));
        }
        if excludes(object.plugin, other, name) {
            let what = clash_text(object.plugin, other, name, at, place);
            return Err(SceneError::new(place(child.at), what));
        }
    }
    Ok(())
}

/// What is wrong with a value and what may help.
type Wrong = (String, Option<String>);

fn value(plugin: &Plugin, param: &Param, value: &Value) -> Result<(), Wrong> {
    let name = param.name;
    let mistyped = || {
        let what = format!(
            "\"{name}\" of {plugin} must be {}, not {}",
            param.kind.describe(),
            value.describe()
        );
        let tag = param.kind.tag();
        (what, Some(format!("write <{tag} name=\"{name}\" .../>")))
    };
    let outside = |found: String| {
        let kind = param.kind.describe();
        (format!("\"{name}\" must be {kind}, not {found}"), None)
    };
    match (param.kind, value) {
        (Kind::Int(low, high), Value::Int(i)) => (low..=high)
            .contains(i)
            .then_some(())
            .ok_or_else(|| outside(i.to_string())),
        (Kind::Float(range), Value::Float(_) | Value::Int(_)) => {
            let x = float_of(value).unwrap_or_default();
            let good = range.contains(x);
            good.then_some(()).ok_or_else(|| outside(shown_number(x)))
        }
        (Kind::FloatTexture(range), _) => {
            let x = float_of(value).ok_or_else(mistyped)?;
            let good = range.contains(x);
            good.then_some(()).ok_or_else(|| outside(shown_number(x)))
        }
        (Kind::Bool, Value::Bool(_))
        | (Kind::Text, Value::Text(_))
        | (Kind::Point | Kind::Vector, Value::Vector(_))
        | (Kind::Transform | Kind::Motion, Value::Transform(_))
        | (Kind::Motion, Value::Animation(_)) => Ok(()),
        (Kind::Transform, Value::Animation(_)) => Err((
            format!("\"{name}\" of {plugin} cannot move"),
            Some(format!("write <transform name=\"{name}\">")),
        )),
        (Kind::Choice(words), Value::Text(text)) => {
            if words.iter().any(|word| word.eq_ignore_ascii_case(text)) {
                return Ok(());
            }
            let help = did_you_mean(text, words.iter().copied());
            Err((outside(format!("\"{text}\"")).0, help))
        }
        (Kind::Ior, Value::Float(x)) if *x > 0.0 => Ok(()),
        (Kind::Ior, Value::Float(x)) => Err((
            format!(
                "\"{name}\" must be a number above 0, not {}",
                shown_number(*x)
            ),
            None,
        )),
        (Kind::Ior, Value::Text(medium)) => iors::lookup(medium).map(|_| ()).ok_or_else(|| {
            let help = did_you_mean(medium, iors::names())
                .unwrap_or_else(|| format!("known are {}", list(iors::names())));
            (format!("unknown medium \"{medium}\""), Some(help))
        }),
        (Kind::Color(role), _) => color(role, value).ok_or_else(mistyped)?.map_err(|found| {
            (
                format!("\"{name}\" must be {}, not {found}", bounds(role)),
                None,
            )
        }),
        _ => Err(mistyped()),
    }
}

fn bounds(role: Role) -> &'static str {
    match role {
        Role::Reflectance => "from 0 to 1 in each channel",
        Role::Unbounded | Role::Emission => "at least 0 in each channel",
    }
}

/// `None` for a value that is no colour, the offending value for one that is out of bounds.
fn color(role: Role, value: &Value) -> Option<Result<(), String>> {
    let top = match role {
        Role::Reflectance => 1.0,
        Role::Unbounded | Role::Emission => f64::INFINITY,
    };
    let good = |x: f64| (0.0..=top).contains(&x);
    Some(match value {
        Value::Rgb(rgb) => match rgb.iter().all(|&c| good(c)) {
            true => Ok(()),
            false => Err(rgb.map(shown_number).join(", ")),
        },
        Value::Float(_) | Value::Int(_) | Value::Spectrum(Spectrum::Uniform(_)) => {
            let x = float_of(value)?;
            good(x).then_some(()).ok_or_else(|| shown_number(x))
        }
        // What a measured spectrum has above 1 is cut off with its colour.
        Value::Spectrum(Spectrum::Sampled(samples)) => match samples.iter().find(|s| s.1 < 0.0) {
            None => Ok(()),
            Some((nm, x)) => Err(format!("{} at {nm} nm", shown_number(*x))),
        },
        _ => return None,
    })
}

fn unknown(plugin: &Plugin, name: &str, at: Place) -> SceneError {
    let what = format!("unknown parameter \"{name}\" of {plugin}");
    let names = || plugin.params.iter().map(|p| p.name);
    let help = did_you_mean(name, names()).unwrap_or_else(|| match plugin.params {
        [] => format!("{plugin} has no parameters"),
        _ => format!("known are {}", list(names())),
    });
    SceneError::new(at, what).with_help(help)
}

/// A child that its parent has no place for.
fn unwanted(
    plugin: &Plugin,
    category: Category,
    child: &Child,
    place: &dyn Fn(Span) -> Place,
) -> SceneError {
    if let (Category::Texture, Some(name)) = (category, &child.name) {
        if plugin.param(name).is_none() {
            return unknown(plugin, name, place(child.at));
        }
        let what = format!("\"{name}\" of {plugin} cannot be a texture");
        return SceneError::new(place(child.at), what);
    }
    let what = format!("a <{category}> has no place in {plugin}");
    let textured: Vec<_> = plugin
        .params
        .iter()
        .filter(|p| is_parameter(plugin, category, Some(p.name)))
        .map(|p| p.name)
        .collect();
    let help = (!textured.is_empty())
        .then(|| format!("give it the name of a parameter: {}", list(textured)));
    SceneError::new(place(child.at), what).with_help_opt(help)
}

fn excludes(plugin: &Plugin, a: &str, b: &str) -> bool {
    plugin
        .exclusive
        .iter()
        .any(|&(x, y)| (x, y) == (a, b) || (y, x) == (a, b))
}

fn twice(name: &str, at: Span, first: Span, place: &dyn Fn(Span) -> Place) -> SceneError {
    let what = format!(
        "\"{name}\" is given twice; the first is at {}",
        place(first)
    );
    SceneError::new(place(at), what)
}

fn clashing(
    plugin: &Plugin,
    first: &str,
    second: &Given,
    first_at: Span,
    place: &dyn Fn(Span) -> Place,
) -> SceneError {
    let what = clash_text(plugin, first, &second.name, first_at, place);
    SceneError::new(place(second.name_at), what)
}

fn clash_text(
    plugin: &Plugin,
    first: &str,
    second: &str,
    first_at: Span,
    place: &dyn Fn(Span) -> Place,
) -> String {
    format!(
        "{plugin} takes either \"{first}\" or \"{second}\", not both; \"{first}\" is at {}",
        place(first_at)
    )
}
