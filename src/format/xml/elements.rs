//! Elements that give a parameter its value.

use super::super::desc::{Given, Mark, Value};
use super::super::error::{SceneError, Span};
use super::attributes::{Attribute, STEP_TAGS, current_name, tag_span};
use super::loader::{File, Loader};
use super::{help_among, read_text, values};
use crate::math::{DVec3, Transform};
use roxmltree::Node;

impl Loader {
    /// An element that gives a parameter.
    pub(super) fn value(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
    ) -> Result<Given, SceneError> {
        let tag = node.tag_name().name();
        let name = self.required(file, node, "name")?;
        let mut value_at = tag_span(file.index, node);
        let value = match tag {
            "transform" => Value::Transform(Box::new(self.transform(file, node, "name")?)),
            "animation" => Value::Animation(self.animation(file, node)?),
            "point" | "vector" => {
                self.leaf(file, node, &["name", "value", "x", "y", "z"])?;
                let (v, at) = self.xyz(file, node, None)?;
                value_at = at;
                Value::Vector(v)
            }
            "spectrum" if node.has_attribute("filename") => {
                self.leaf(file, node, &["name", "filename"])?;
                let name = self.required(file, node, "filename")?;
                value_at = name.at;
                self.spectrum_file(file, &name)?
            }
            _ => {
                self.leaf(file, node, &["name", "value"])?;
                let value = self.required(file, node, "value")?;
                value_at = value.at;
                let text = &value.text;
                let parsed = match tag {
                    "integer" => values::int(text).map(Value::Int),
                    "float" => values::float(text).map(Value::Float),
                    "boolean" => values::bool(text).map(Value::Bool),
                    "rgb" => values::rgb(text).map(Value::Rgb),
                    "spectrum" => values::spectrum(text).map(Value::Spectrum),
                    _ => Ok(Value::Text(text.clone())),
                };
                parsed.map_err(|wrong| self.wrong(value.at, wrong))?
            }
        };
        Ok(Given {
            name: current_name(file, name.text),
            value,
            name_at: name.at,
            value_at,
            read: Mark::default(),
        })
    }

    fn spectrum_file(&self, file: File<'_>, name: &Attribute) -> Result<Value, SceneError> {
        let failed = |what: String| self.error(name.at, format!("\"{}\": {what}", name.text));
        let path = self
            .find_file(&name.text, file.folder)
            .map_err(|wrong| self.wrong(name.at, wrong))?;
        let text = read_text(&path).map_err(failed)?;
        values::spectrum_file(&text)
            .map(Value::Spectrum)
            .map_err(|(line, what)| match line {
                0 => failed(what),
                line => failed(format!("line {line}: {what}")),
            })
    }

    /// Transforms at increasing times.
    fn animation(
        &mut self,
        file: File<'_>,
        parent: Node<'_, '_>,
    ) -> Result<Vec<(f64, Transform)>, SceneError> {
        self.check_attributes(file, parent, &["name"])?;
        let mut keys: Vec<(f64, Transform)> = Vec::new();
        for node in parent.children() {
            if node.is_text() {
                self.check_text(file, node)?;
            }
            if !node.is_element() {
                continue;
            }
            let tag = node.tag_name().name();
            if tag != "transform" {
                let what = format!("unknown element <{tag}> in <animation>");
                return Err(self
                    .error(tag_span(file.index, node), what)
                    .with_help("an animation is made of <transform time=\"...\">"));
            }
            let transform = self.transform(file, node, "time")?;
            let at = self.required(file, node, "time")?;
            let time = values::float(&at.text).map_err(|wrong| self.wrong(at.at, wrong))?;
            if let Some((before, _)) = keys.last().filter(|key| key.0 >= time) {
                let what = format!("times must increase, but {time} follows {before}");
                return Err(self.error(at.at, what));
            }
            keys.push((time, transform));
        }
        if keys.is_empty() {
            let what = "an <animation> needs at least one <transform time=\"...\">";
            return Err(self.error(tag_span(file.index, parent), what));
        }
        Ok(keys)
    }

    /// The steps of a transform; each acts after those before it. `attribute` is the one it may have.
    fn transform(
        &mut self,
        file: File<'_>,
        parent: Node<'_, '_>,
        attribute: &str,
    ) -> Result<Transform, SceneError> {
        self.check_attributes(file, parent, &[attribute])?;
        let mut transform = Transform::IDENTITY;
        for node in parent.children() {
            if node.is_text() {
                self.check_text(file, node)?;
            }
            if !node.is_element() {
                continue;
            }
            let step = self.step(file, node)?;
            transform = step * transform;
            // Steps may each be sound and their product still leave the numbers of f64.
            if Transform::new(transform.matrix()).is_none() {
                let what = "the transform up to here is singular or overflows";
                return Err(self.error(tag_span(file.index, node), what));
            }
        }
        Ok(transform)
    }

    fn step(&mut self, file: File<'_>, node: Node<'_, '_>) -> Result<Transform, SceneError> {
        const XYZ: [&str; 4] = ["value", "x", "y", "z"];
        let tag = node.tag_name().name();
        let (step, at) = match tag {
            "translate" => {
                self.leaf(file, node, &XYZ)?;
                let (v, at) = self.xyz(file, node, Some(0.0))?;
                (Ok(Transform::translate(v)), at)
            }
            "scale" => {
                self.leaf(file, node, &XYZ)?;
                let (v, at) = self.xyz(file, node, Some(1.0))?;
                (values::scale(v), at)
            }
            "rotate" => {
                self.leaf(file, node, &["value", "x", "y", "z", "angle"])?;
                let (axis, at) = self.xyz(file, node, Some(0.0))?;
                let angle = self.required(file, node, "angle")?;
                let degrees =
                    values::float(&angle.text).map_err(|wrong| self.wrong(angle.at, wrong))?;
                (values::rotate(axis, degrees), at)
            }
            "lookat" => {
                self.leaf(file, node, &["origin", "target", "up"])?;
                let origin = self.required(file, node, "origin")?;
                let target = self.required(file, node, "target")?;
                let up = self.attribute(file, node, "up")?;
                let at = tag_span(file.index, node);
                let up = up.map(|up| self.vector(&up)).transpose()?;
                let (origin, target) = (self.vector(&origin)?, self.vector(&target)?);
                (values::look_at(origin, target, up), at)
            }
            "matrix" => {
                self.leaf(file, node, &["value"])?;
                let value = self.required(file, node, "value")?;
                (values::matrix(&value.text), value.at)
            }
            _ => {
                let what = format!("unknown element <{tag}> in <transform>");
                let help = help_among(tag, STEP_TAGS, "a transform is made of");
                let at = tag_span(file.index, node);
                return Err(self.error(at, what).with_help(help));
            }
        };
        step.map_err(|wrong| self.wrong(at, wrong))
    }

    fn vector(&self, attribute: &Attribute) -> Result<DVec3, SceneError> {
        values::triple(&attribute.text)
            .map(DVec3::from_array)
            .map_err(|wrong| self.wrong(attribute.at, wrong))
    }

    /// `value="x, y, z"` or `x= y= z=`, the latter with a default for what is missing.
    fn xyz(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
        default: Option<f64>,
    ) -> Result<(DVec3, Span), SceneError> {
        let value = self.attribute(file, node, "value")?;
        let mut v = [default.unwrap_or(0.0); 3];
        let mut first = None;
        for (name, slot) in ["x", "y", "z"].into_iter().zip(&mut v) {
            match self.attribute(file, node, name)? {
                Some(axis) if value.is_some() => {
                    let what = "\"value\" cannot stand beside \"x\", \"y\", \"z\"";
                    return Err(self.error(axis.at, what));
                }
                Some(axis) => {
                    *slot =
                        values::float(&axis.text).map_err(|wrong| self.wrong(axis.at, wrong))?;
                    first.get_or_insert(axis.at);
                }
                None if default.is_none() && value.is_none() => {
                    return Err(self.missing(file, node, name));
                }
                None => {}
            }
        }
        match value {
            Some(value) => Ok((self.vector(&value)?, value.at)),
            None => {
                let at = first.unwrap_or_else(|| tag_span(file.index, node));
                Ok((DVec3::from_array(v), at))
            }
        }
    }
}
