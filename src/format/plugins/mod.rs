//! The one table of plugins and their parameters: names, types, ranges, defaults and what each means.
//!
//! It drives the checks of a scene description (unknown plugin, unknown parameter, wrong type, value
//! out of range), the defaults that the getters of [`Props`](super::Props) return, and the text of
//! `luxel info --plugins`. Names, types and defaults are those of Mitsuba 3.9. To add a plugin, add
//! its row to the file of its category and take it out of [`unsupported`].

mod bsdfs;
mod cameras;
mod integrators;
mod lights;
mod principled;
mod reference;
mod sensors;
mod shapes;
mod spectra;
mod unsupported;

pub use reference::reference;
pub use unsupported::why_unsupported;

use std::fmt;

/// What kind of thing a plugin is. Spelled as the tag that makes one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Category {
    Scene,
    Integrator,
    Sensor,
    Film,
    Rfilter,
    Sampler,
    Shape,
    Bsdf,
    Emitter,
    /// Textures, and spectra that are written as plugins.
    Texture,
    Medium,
    Volume,
    Phase,
}

impl Category {
    pub const ALL: [Category; 13] = [
        Category::Scene,
        Category::Integrator,
        Category::Sensor,
        Category::Film,
        Category::Rfilter,
        Category::Sampler,
        Category::Shape,
        Category::Bsdf,
        Category::Emitter,
        Category::Texture,
        Category::Medium,
        Category::Volume,
        Category::Phase,
    ];

    /// The tag of this category.
    pub fn tag(self) -> &'static str {
        match self {
            Category::Scene => "scene",
            Category::Integrator => "integrator",
            Category::Sensor => "sensor",
            Category::Film => "film",
            Category::Rfilter => "rfilter",
            Category::Sampler => "sampler",
            Category::Shape => "shape",
            Category::Bsdf => "bsdf",
            Category::Emitter => "emitter",
            Category::Texture => "texture",
            Category::Medium => "medium",
            Category::Volume => "volume",
            Category::Phase => "phase",
        }
    }

    pub fn from_tag(tag: &str) -> Option<Category> {
        Category::ALL.into_iter().find(|c| c.tag() == tag)
    }
}

impl fmt::Display for Category {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.tag())
    }
}

/// Numbers that a parameter accepts. All are finite before this is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    Any,
    /// > 0
    Positive,
    /// >= 0
    NonNegative,
    /// Both ends included.
    Closed(f64, f64),
    /// Both ends excluded.
    Open(f64, f64),
}

impl Range {
    pub fn contains(self, x: f64) -> bool {
        match self {
            Range::Any => true,
            Range::Positive => x > 0.0,
            Range::NonNegative => x >= 0.0,
            Range::Closed(a, b) => a <= x && x <= b,
            Range::Open(a, b) => a < x && x < b,
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Range::Any => write!(f, "a number"),
            Range::Positive => write!(f, "a number above 0"),
            Range::NonNegative => write!(f, "a number of at least 0"),
            Range::Closed(a, b) => write!(f, "a number from {a} to {b}"),
            Range::Open(a, b) => write!(f, "a number above {a} and below {b}"),
        }
    }
}

/// What a colour means, which decides how a spectrum becomes RGB and which values are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A share of light, 0 to 1; a spectrum is seen under D65.
    Reflectance,
    /// A quantity per wavelength that is at least 0 but not bounded (index of refraction, extinction).
    Unbounded,
    /// Emitted light, at least 0; a spectrum is the emission itself.
    Emission,
}

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Both ends included.
    Int(i64, i64),
    Float(Range),
    Bool,
    Text,
    /// One of these words, in any case.
    Choice(&'static [&'static str]),
    /// A file to read, looked for beside the scene and in the `<path>` folders.
    File,
    Point,
    Vector,
    /// An affine map of space.
    Transform,
    /// An affine map of space that may change over time.
    Motion,
    /// A colour, or a texture of colours.
    Color(Role),
    /// A number, or a texture of numbers.
    FloatTexture(Range),
    /// An index of refraction, as number or as name of a medium.
    Ior,
}

impl Kind {
    /// The type as a reader of messages and of the reference knows it.
    pub fn describe(self) -> String {
        match self {
            // What stands for "no limit".
            Kind::Int(low, high) if high >= i64::from(i32::MAX) => {
                format!("an integer of at least {low}")
            }
            Kind::Int(low, high) => format!("an integer from {low} to {high}"),
            Kind::Float(range) => range.to_string(),
            Kind::Bool => "true or false".into(),
            Kind::Text => "a string".into(),
            Kind::Choice(words) => format!("one of \"{}\"", words.join("\", \"")),
            Kind::File => "the name of a file".into(),
            Kind::Point => "a point".into(),
            Kind::Vector => "a vector".into(),
            Kind::Transform => "a transform".into(),
            Kind::Motion => "a transform or an animation".into(),
            Kind::Color(Role::Reflectance) => "a colour or texture within 0 to 1".into(),
            Kind::Color(_) => "a colour or texture".into(),
            Kind::FloatTexture(range) => format!("{range}, or a texture"),
            Kind::Ior => "an index of refraction or the name of a medium".into(),
        }
    }

    /// The tag that writes a value of this type.
    pub fn tag(self) -> &'static str {
        match self {
            Kind::Int(..) => "integer",
            Kind::Float(_) | Kind::FloatTexture(_) | Kind::Ior => "float",
            Kind::Bool => "boolean",
            Kind::Text | Kind::Choice(_) | Kind::File => "string",
            Kind::Point => "point",
            Kind::Vector => "vector",
            Kind::Transform | Kind::Motion => "transform",
            Kind::Color(_) => "rgb",
        }
    }
}

/// The value of a parameter that the file does not give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// It must be given.
    Required,
    /// None: the plugin does something else without it, as its doc says.
    Absent,
    Int(i64),
    /// For colours: the same number in all channels.
    Float(f64),
    Bool(bool),
    Text(&'static str),
    Point([f64; 3]),
    Identity,
}

/// A parameter of a plugin.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    pub name: &'static str,
    pub kind: Kind,
    pub default: Default,
    pub doc: &'static str,
}

impl Param {
    pub(super) const fn int(
        name: &'static str,
        (low, high): (i64, i64),
        default: i64,
        doc: &'static str,
    ) -> Param {
        Param {
            name,
            kind: Kind::Int(low, high),
            default: Default::Int(default),
            doc,
        }
    }

    pub(super) const fn float(
        name: &'static str,
        range: Range,
        default: f64,
        doc: &'static str,
    ) -> Param {
        Param {
            name,
            kind: Kind::Float(range),
            default: Default::Float(default),
            doc,
        }
    }

    pub(super) const fn bool(name: &'static str, default: bool, doc: &'static str) -> Param {
        Param {
            name,
            kind: Kind::Bool,
            default: Default::Bool(default),
            doc,
        }
    }

    pub(super) const fn choice(
        name: &'static str,
        words: &'static [&'static str],
        default: &'static str,
        doc: &'static str,
    ) -> Param {
        Param {
            name,
            kind: Kind::Choice(words),
            default: Default::Text(default),
            doc,
        }
    }

    pub(super) const fn color(
        name: &'static str,
        role: Role,
        default: f64,
        doc: &'static str,
    ) -> Param {
        Param {
            name,
            kind: Kind::Color(role),
            default: Default::Float(default),
            doc,
        }
    }

    pub(super) const fn ior(name: &'static str, medium: &'static str, doc: &'static str) -> Param {
        Param {
            name,
            kind: Kind::Ior,
            default: Default::Text(medium),
            doc,
        }
    }

    pub(super) const fn point(name: &'static str, default: [f64; 3], doc: &'static str) -> Param {
        Param {
            name,
            kind: Kind::Point,
            default: Default::Point(default),
            doc,
        }
    }

    pub(super) const fn transform(name: &'static str, doc: &'static str) -> Param {
        Param {
            name,
            kind: Kind::Transform,
            default: Default::Identity,
            doc,
        }
    }

    /// A transform that an `<animation>` may move.
    pub(super) const fn motion(name: &'static str, doc: &'static str) -> Param {
        Param {
            name,
            kind: Kind::Motion,
            default: Default::Identity,
            doc,
        }
    }

    pub(super) const fn file(name: &'static str, doc: &'static str) -> Param {
        Param {
            name,
            kind: Kind::File,
            default: Default::Required,
            doc,
        }
    }

    /// A parameter without default.
    pub(super) const fn optional(name: &'static str, kind: Kind, doc: &'static str) -> Param {
        Param {
            name,
            kind,
            default: Default::Absent,
            doc,
        }
    }
}

/// Nested objects that a plugin takes, under any name.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    pub category: Category,
    pub min: usize,
    pub max: usize,
}

impl Slot {
    pub(super) const fn new(category: Category, min: usize, max: usize) -> Slot {
        Slot { category, min, max }
    }
}

/// One row of the table.
#[derive(Debug)]
pub struct Plugin {
    pub category: Category,
    pub name: &'static str,
    pub doc: &'static str,
    pub params: &'static [Param],
    pub slots: &'static [Slot],
    /// Pairs of parameters of which a file may give one.
    pub exclusive: &'static [(&'static str, &'static str)],
}

impl Plugin {
    /// A row whose plugin takes neither children nor has clashing parameters.
    pub(super) const fn new(
        category: Category,
        name: &'static str,
        params: &'static [Param],
        doc: &'static str,
    ) -> Plugin {
        Plugin {
            category,
            name,
            doc,
            params,
            slots: &[],
            exclusive: &[],
        }
    }

    pub fn param(&self, name: &str) -> Option<&'static Param> {
        self.params.iter().find(|p| p.name == name)
    }

    pub fn slot(&self, category: Category) -> Option<&'static Slot> {
        self.slots.iter().find(|s| s.category == category)
    }
}

/// As messages name it: `bsdf "diffuse"`.
impl fmt::Display for Plugin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.category {
            Category::Scene => write!(f, "the scene"),
            category => write!(f, "{category} \"{}\"", self.name),
        }
    }
}

/// All rows, by category.
pub fn all() -> impl Iterator<Item = &'static Plugin> {
    [
        integrators::PLUGINS,
        cameras::PLUGINS,
        sensors::PLUGINS,
        shapes::PLUGINS,
        bsdfs::PLUGINS,
        principled::PLUGINS,
        lights::PLUGINS,
        spectra::PLUGINS,
    ]
    .into_iter()
    .flatten()
}

pub fn find(category: Category, name: &str) -> Option<&'static Plugin> {
    all().find(|p| p.category == category && p.name == name)
}

/// The scene itself: a plugin without parameters.
pub fn scene() -> &'static Plugin {
    &cameras::SCENE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::iors;

    #[test]
    fn defaults_are_values_of_their_type() {
        for (plugin, p) in all().flat_map(|plugin| plugin.params.iter().map(move |p| (plugin, p))) {
            let good = match (p.kind, p.default) {
                (_, Default::Required | Default::Absent) => true,
                (Kind::Int(low, high), Default::Int(i)) => low <= i && i <= high,
                (Kind::Float(range) | Kind::FloatTexture(range), Default::Float(x)) => {
                    range.contains(x)
                }
                (Kind::Color(Role::Reflectance), Default::Float(x)) => (0.0..=1.0).contains(&x),
                (Kind::Color(_), Default::Float(x)) => x >= 0.0,
                (Kind::Bool, Default::Bool(_)) => true,
                (Kind::Choice(words), Default::Text(word)) => words.contains(&word),
                (Kind::Text, Default::Text(_)) => true,
                (Kind::Ior, Default::Text(medium)) => iors::lookup(medium).is_some(),
                (Kind::Point | Kind::Vector, Default::Point(_)) => true,
                (Kind::Transform | Kind::Motion, Default::Identity) => true,
                _ => false,
            };
            assert!(good, "{} {}: {}", plugin.category, plugin.name, p.name);
            assert!(p.doc.ends_with('.'), "{} {}", plugin.name, p.name);
        }
    }

    #[test]
    fn names_are_unique_and_clashes_name_parameters() {
        for (i, plugin) in all().enumerate() {
            let same = |q: &Plugin| q.category == plugin.category && q.name == plugin.name;
            assert!(!all().skip(i + 1).any(same), "{}", plugin.name);
            assert!(
                why_unsupported(plugin.category, plugin.name).is_none(),
                "{} is both",
                plugin.name
            );
            for (k, p) in plugin.params.iter().enumerate() {
                assert!(!plugin.params[k + 1..].iter().any(|q| q.name == p.name));
            }
            for (a, b) in plugin.exclusive {
                assert!(plugin.param(a).is_some() && plugin.param(b).is_some());
            }
        }
    }
}
