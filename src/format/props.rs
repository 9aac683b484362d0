//! Typed access to the parameters of an object. Defaults come from the table of plugins; what is
//! read is marked, so that [`SceneDesc::check_all_read`] finds what nothing asked for.

use super::desc::{Child, Given, Object, ObjectId, SceneDesc, Value};
use super::error::{Place, SceneError};
use super::plugins::{Category, Default, Kind, Param, Plugin, Role};
use super::spectrum_plugins;
use crate::bsdf::iors;
use crate::math::{DVec3, Motion, Rgb, Transform};
use std::path::Path;

/// A colour that is the same everywhere, or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RgbOrTexture {
    Rgb(Rgb),
    Texture(ObjectId),
}

/// A number that is the same everywhere, or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatOrTexture {
    Float(f64),
    Texture(ObjectId),
}

/// The parameters and children of one object.
///
/// Every getter returns the value of the file or else the default of the table, which is in the
/// range that the table states. Asking for a name or type that the table does not have is a mistake
/// of the caller and returned as an error at the object.
#[derive(Clone, Copy, Debug)]
pub struct Props<'a> {
    desc: &'a SceneDesc,
    id: ObjectId,
}

impl<'a> Props<'a> {
    pub(super) fn new(desc: &'a SceneDesc, id: ObjectId) -> Props<'a> {
        let props = Props { desc, id };
        props.object().visited.set();
        props
    }

    pub(super) fn object(&self) -> &'a Object {
        &self.desc.objects[self.id.index()]
    }

    /// The description this object belongs to.
    pub fn desc(&self) -> &'a SceneDesc {
        self.desc
    }

    pub fn object_id(&self) -> ObjectId {
        self.id
    }

    pub fn category(&self) -> Category {
        self.object().plugin.category
    }

    /// Name of the plugin, such as "diffuse".
    pub fn plugin(&self) -> &'static str {
        self.object().plugin.name
    }

    /// The row of the table.
    pub fn row(&self) -> &'static Plugin {
        self.object().plugin
    }

    /// The `id` attribute.
    pub fn id(&self) -> Option<&'a str> {
        self.object().id.as_deref()
    }

    /// Where the object stands.
    pub fn place(&self) -> Place {
        self.desc.place(self.object().at)
    }

    /// An error about the object as a whole.
    pub fn error(&self, what: impl Into<String>) -> SceneError {
        SceneError::new(self.place(), what)
    }

    /// An error about the value of a parameter, at its value where the file gives one.
    pub fn error_at(&self, name: &str, what: impl Into<String>) -> SceneError {
        let at = match (self.given(name), self.named_child(name)) {
            (Some(given), _) => given.value_at,
            (None, Some(child)) => child.at,
            (None, None) => self.object().at,
        };
        SceneError::new(self.desc.place(at), what)
    }

    /// True when the file gives this parameter. Does not count as reading it.
    pub fn is_given(&self, name: &str) -> bool {
        self.given(name).is_some() || self.named_child(name).is_some()
    }

    /// Marks parameters as read that have no effect in luxel by design.
    pub fn ignore(&self, names: &[&str]) {
        for given in &self.object().params {
            if names.contains(&given.name.as_str()) {
                given.read.set();
            }
        }
    }

    /// Marks everything in this object as read: it is left out as a whole.
    pub fn ignore_all(&self) {
        for given in &self.object().params {
            given.read.set();
        }
        for child in &self.object().children {
            child.read.set();
        }
    }

    pub fn float(&self, name: &str) -> Result<f64, SceneError> {
        self.opt_float(name)?.ok_or_else(|| self.missing(name))
    }

    /// `None` when neither file nor table gives a value.
    pub fn opt_float(&self, name: &str) -> Result<Option<f64>, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Float(x)), _) => Ok(Some(*x)),
            (None, Default::Float(x)) => Ok(Some(x)),
            (Some(Value::Int(i)), _) => Ok(Some(*i as f64)),
            (None, Default::Absent) => Ok(None),
            _ => Err(self.mistyped(name, "a float")),
        }
    }

    pub fn int(&self, name: &str) -> Result<i64, SceneError> {
        self.opt_int(name)?.ok_or_else(|| self.missing(name))
    }

    /// `None` when neither file nor table gives a value.
    pub fn opt_int(&self, name: &str) -> Result<Option<i64>, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Int(i)), _) => Ok(Some(*i)),
            (None, Default::Int(i)) => Ok(Some(i)),
            (None, Default::Absent) => Ok(None),
            _ => Err(self.mistyped(name, "an integer")),
        }
    }

    pub fn bool(&self, name: &str) -> Result<bool, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Bool(b)), _) => Ok(*b),
            (None, Default::Bool(b)) => Ok(b),
            _ => Err(self.mistyped(name, "a boolean")),
        }
    }

    pub fn string(&self, name: &str) -> Result<&'a str, SceneError> {
        self.opt_string(name)?.ok_or_else(|| self.missing(name))
    }

    /// `None` when neither file nor table gives a value.
    pub fn opt_string(&self, name: &str) -> Result<Option<&'a str>, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Text(text)), _) => Ok(Some(text)),
            (None, Default::Text(text)) => Ok(Some(text)),
            (None, Default::Absent) => Ok(None),
            _ => Err(self.mistyped(name, "a string")),
        }
    }

    /// The word of a choice, spelled as in the table.
    pub fn choice(&self, name: &str) -> Result<&'static str, SceneError> {
        let (param, _) = self.lookup(name)?;
        let Kind::Choice(words) = param.kind else {
            return Err(self.mistyped(name, "a choice"));
        };
        let found = self.string(name)?;
        words
            .iter()
            .find(|word| word.eq_ignore_ascii_case(found))
            .copied()
            .ok_or_else(|| self.mistyped(name, "a choice"))
    }

    /// Path of a file that existed when the scene was loaded.
    pub fn file(&self, name: &str) -> Result<&'a Path, SceneError> {
        match self.lookup(name)?.1.map(|g| &g.value) {
            Some(Value::File(path)) => Ok(path),
            _ => Err(self.missing(name)),
        }
    }

    /// A point or a vector.
    pub fn vec3(&self, name: &str) -> Result<DVec3, SceneError> {
        self.opt_vec3(name)?.ok_or_else(|| self.missing(name))
    }

    /// `None` when neither file nor table gives a value.
    pub fn opt_vec3(&self, name: &str) -> Result<Option<DVec3>, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Vector(v)), _) => Ok(Some(*v)),
            (None, Default::Point(p)) => Ok(Some(DVec3::from_array(p))),
            (None, Default::Absent) => Ok(None),
            _ => Err(self.mistyped(name, "a point or vector")),
        }
    }

    /// The identity where the file gives none.
    pub fn transform(&self, name: &str) -> Result<Transform, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Transform(t)), _) => Ok(**t),
            (None, Default::Identity) => Ok(Transform::IDENTITY),
            _ => Err(self.mistyped(name, "a transform")),
        }
    }

    /// All the transforms that a moving one goes through, or the one that does not move.
    pub fn keyframes(&self, name: &str) -> Result<Vec<Transform>, SceneError> {
        let (_, given) = self.lookup(name)?;
        Ok(match given.map(|g| &g.value) {
            Some(Value::Transform(t)) => vec![**t],
            Some(Value::Animation(keys)) => keys.iter().map(|key| key.1).collect(),
            _ => vec![Transform::IDENTITY],
        })
    }

    /// A transform that may move while the shutter is open, from `shutter[0]` to `shutter[1]` of the
    /// scene's time; the identity where the file gives none.
    pub fn motion(&self, name: &str, shutter: [f64; 2]) -> Result<Motion, SceneError> {
        let (param, given) = self.lookup(name)?;
        match (given.map(|g| &g.value), param.default) {
            (Some(Value::Transform(t)), _) => Ok(Motion::still(**t)),
            (Some(Value::Animation(keys)), _) => Motion::new(keys, shutter).ok_or_else(|| {
                let what = "the animation goes through a transform that is singular";
                self.error_at(name, what)
                    .with_help("mirror all of its transforms or none, and flatten none of them")
            }),
            (None, Default::Identity) => Ok(Motion::still(Transform::IDENTITY)),
            _ => Err(self.mistyped(name, "a transform or an animation")),
        }
    }

    /// The index of refraction, also where the file names a medium.
    pub fn ior(&self, name: &str) -> Result<f64, SceneError> {
        let (param, given) = self.lookup(name)?;
        let medium = match (given.map(|g| &g.value), param.default) {
            (Some(Value::Float(x)), _) => return Ok(*x),
            (Some(Value::Text(medium)), _) => medium.as_str(),
            (None, Default::Text(medium)) => medium,
            _ => return Err(self.mistyped(name, "an index of refraction")),
        };
        iors::lookup(medium).ok_or_else(|| self.mistyped(name, "an index of refraction"))
    }

    pub fn rgb_or_texture(&self, name: &str) -> Result<RgbOrTexture, SceneError> {
        self.opt_rgb_or_texture(name)?
            .ok_or_else(|| self.missing(name))
    }

    /// `None` when neither file nor table gives a value.
    pub fn opt_rgb_or_texture(&self, name: &str) -> Result<Option<RgbOrTexture>, SceneError> {
        let (param, given) = self.lookup(name)?;
        let Kind::Color(role) = param.kind else {
            return Err(self.mistyped(name, "a colour"));
        };
        if let Some(child) = self.named_child(name) {
            child.read.set();
            let value = Props::new(self.desc, child.object);
            return spectrum_plugins::resolve(&value, role).map(Some);
        }
        let rgb = match (given.map(|g| &g.value), param.default) {
            (Some(value), _) => {
                rgb_of(value, role).ok_or_else(|| self.mistyped(name, "a colour"))?
            }
            (None, Default::Float(x)) => Rgb::splat(x as f32),
            (None, Default::Absent) => return Ok(None),
            _ => return Err(self.mistyped(name, "a colour")),
        };
        Ok(Some(RgbOrTexture::Rgb(rgb)))
    }

    /// A colour where a texture makes no sense; a texture is an error.
    pub fn rgb(&self, name: &str) -> Result<Rgb, SceneError> {
        self.opt_rgb(name)?.ok_or_else(|| self.missing(name))
    }

    /// As [`Props::rgb`]; `None` when neither file nor table gives a value.
    pub fn opt_rgb(&self, name: &str) -> Result<Option<Rgb>, SceneError> {
        match self.opt_rgb_or_texture(name)? {
            Some(RgbOrTexture::Rgb(rgb)) => Ok(Some(rgb)),
            None => Ok(None),
            Some(RgbOrTexture::Texture(_)) => {
                let plugin = self.row();
                Err(self.error_at(name, format!("\"{name}\" of {plugin} cannot be a texture")))
            }
        }
    }

    pub fn float_or_texture(&self, name: &str) -> Result<FloatOrTexture, SceneError> {
        self.opt_float_or_texture(name)?
            .ok_or_else(|| self.missing(name))
    }

    /// `None` when neither file nor table gives a value.
    pub fn opt_float_or_texture(&self, name: &str) -> Result<Option<FloatOrTexture>, SceneError> {
        let (param, given) = self.lookup(name)?;
        if let (Kind::FloatTexture(range), Some(child)) = (param.kind, self.named_child(name)) {
            child.read.set();
            let value = Props::new(self.desc, child.object);
            return match spectrum_plugins::number(&value) {
                None => Ok(Some(FloatOrTexture::Texture(child.object))),
                Some(x) => match x? {
                    x if range.contains(x) => Ok(Some(FloatOrTexture::Float(x))),
                    _ => Err(self.mistyped(name, &range.to_string())),
                },
            };
        }
        match (given.map(|g| &g.value), param.default) {
            (Some(value), _) => float_of(value)
                .map(|x| Some(FloatOrTexture::Float(x)))
                .ok_or_else(|| self.mistyped(name, "a number")),
            (None, Default::Float(x)) => Ok(Some(FloatOrTexture::Float(x))),
            (None, Default::Absent) => Ok(None),
            _ => Err(self.mistyped(name, "a number")),
        }
    }

    /// Every nested object, textures that are values of parameters too. Reads none of them.
    pub(super) fn all_children(&self) -> impl Iterator<Item = Props<'a>> {
        let (desc, object) = (self.desc, self.object());
        object.children.iter().map(|c| Props { desc, id: c.object })
    }

    /// Nested objects and references of a category, in file order, with the names given to them.
    /// Textures that are the value of a parameter are not among them.
    pub fn named_children(&self, category: Category) -> Vec<(Option<&'a str>, Props<'a>)> {
        let plugin = self.object().plugin;
        let desc = self.desc;
        self.object()
            .children
            .iter()
            .filter(|c| desc.objects[c.object.index()].plugin.category == category)
            .filter(|c| !is_parameter(plugin, category, c.name.as_deref()))
            .map(|c| {
                c.read.set();
                (c.name.as_deref(), Props::new(desc, c.object))
            })
            .collect()
    }

    /// As [`Props::named_children`], without the names.
    pub fn children(&self, category: Category) -> Vec<Props<'a>> {
        let named = self.named_children(category);
        named.into_iter().map(|(_, child)| child).collect()
    }

    /// The first child of a category, for those of which the table allows one.
    pub fn child(&self, category: Category) -> Option<Props<'a>> {
        self.children(category).into_iter().next()
    }

    fn given(&self, name: &str) -> Option<&'a Given> {
        self.object().params.iter().find(|p| p.name == name)
    }

    fn named_child(&self, name: &str) -> Option<&'a Child> {
        let children = &self.object().children;
        children.iter().find(|c| c.name.as_deref() == Some(name))
    }

    fn lookup(&self, name: &str) -> Result<(&'static Param, Option<&'a Given>), SceneError> {
        let param = self.object().plugin.param(name).ok_or_else(|| {
            let plugin = self.row();
            self.error(format!("{plugin} has no parameter \"{name}\""))
        })?;
        let given = self.given(name);
        if let Some(given) = given {
            given.read.set();
        }
        Ok((param, given))
    }

    fn missing(&self, name: &str) -> SceneError {
        missing_parameter(self.object().plugin, name, self.place())
    }

    fn mistyped(&self, name: &str, expected: &str) -> SceneError {
        self.error_at(name, format!("\"{name}\" is not {expected}"))
    }
}

/// The error for a required parameter that is not there.
pub(super) fn missing_parameter(plugin: &Plugin, name: &str, at: Place) -> SceneError {
    let what = format!("{plugin} needs the parameter \"{name}\"");
    let help = plugin.param(name).map(|p| {
        let tag = p.kind.tag();
        format!("add <{tag} name=\"{name}\" .../>: {}", p.doc)
    });
    SceneError::new(at, what).with_help_opt(help)
}

/// True when a nested object of this name is the value of a parameter.
pub(super) fn is_parameter(plugin: &Plugin, category: Category, name: Option<&str>) -> bool {
    category == Category::Texture
        && name
            .and_then(|name| plugin.param(name))
            .is_some_and(|p| matches!(p.kind, Kind::Color(_) | Kind::FloatTexture(_)))
}

fn rgb_of(value: &Value, role: Role) -> Option<Rgb> {
    match value {
        Value::Rgb(rgb) => Some(Rgb::from_array(rgb.map(|c| c as f32))),
        Value::Float(x) => Some(Rgb::splat(*x as f32)),
        Value::Int(i) => Some(Rgb::splat(*i as f32)),
        Value::Spectrum(spectrum) => Some(spectrum.to_rgb(role)),
        _ => None,
    }
}

/// The number that a value means where one number is wanted: of a colour the mean, as in Mitsuba.
pub(super) fn float_of(value: &Value) -> Option<f64> {
    use super::spectrum::Spectrum;
    match value {
        Value::Float(x) => Some(*x),
        Value::Int(i) => Some(*i as f64),
        Value::Rgb([r, g, b]) if r == g && g == b => Some(*r),
        Value::Rgb([r, g, b]) => Some((r + g + b) / 3.0),
        Value::Spectrum(Spectrum::Uniform(x)) => Some(*x),
        _ => None,
    }
}
