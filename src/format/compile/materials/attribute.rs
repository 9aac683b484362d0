//! The texture `mesh_attribute`: looked up in the mesh of the shape that is being compiled.

use std::sync::Arc;

use super::{Materials, suggest};
use crate::format::{ObjectId, Props, SceneError};
use crate::texture::{MeshAttribute, Texture};

impl<'a> Materials<'a> {
    pub(super) fn mesh_attribute(&mut self, p: &Props<'a>) -> Result<Texture, SceneError> {
        self.per_shape = true;
        let name = p.string("name")?;
        let scale = p.float("scale")? as f32;
        if !(name.starts_with("vertex_") || name.starts_with("face_")) {
            let error = p.error_at("name", format!("\"{name}\" is no name of an attribute"));
            return Err(error.with_help("it must begin with vertex_ or face_"));
        }
        let mesh = self.shape.and_then(|shape| self.attributes.of(shape));
        let Some(mesh) = mesh else {
            let error = p.error("\"mesh_attribute\" stands on something that is no mesh of a file");
            return Err(error.with_help("attributes come from PLY files"));
        };
        let Some((size, values)) = mesh.kept.get(name) else {
            let error = p.error_at("name", format!("the mesh has no attribute \"{name}\""));
            let help = match &mesh.names[..] {
                [] => "it has none at all: attributes come from PLY files".to_string(),
                names => suggest(name, names.iter().map(String::as_str).collect::<Vec<_>>()),
            };
            return Err(error.with_help(help));
        };
        if ![1, 3].contains(size) {
            let what = format!("the attribute \"{name}\" has {size} numbers, not 1 or 3");
            return Err(p.error_at("name", what));
        }
        let values = Arc::clone(values);
        Ok(Texture::MeshAttribute(MeshAttribute { values, scale }).folded())
    }

    /// Refuses a colour of a mesh where one number is wanted: Mitsuba has none to offer either.
    pub(super) fn check_scalar(&self, texture: ObjectId) -> Result<(), SceneError> {
        let p = self.desc.object(texture);
        if p.plugin() != "mesh_attribute" {
            return Ok(());
        }
        let name = p.string("name")?;
        let mesh = self.shape.and_then(|shape| self.attributes.of(shape));
        match mesh.and_then(|mesh| mesh.kept.get(name)) {
            Some((3, _)) => Err(p.error_at(
                "name",
                format!("the attribute \"{name}\" has 3 numbers, but one is wanted here"),
            )),
            _ => Ok(()),
        }
    }

    /// A share of light: values above 1 are cut to 1, and the user is told.
    pub(super) fn share(&mut self, p: &Props<'a>, name: &str, a: MeshAttribute) -> MeshAttribute {
        if a.values.max() * a.scale <= 1.0 {
            return a;
        }
        let at = p.error_at(name, "").at;
        let place = format!("{}:{}:{}", at.file.display(), at.line, at.column);
        let warning =
            format!("{place}: the mesh has values above 1, which as \"{name}\" are cut to 1");
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
        let cut = a.values.map(|c| c.map(|v| (v * a.scale).min(1.0)));
        MeshAttribute {
            values: Arc::new(cut),
            scale: 1.0,
        }
    }
}
