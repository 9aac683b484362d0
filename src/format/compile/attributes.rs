//! What meshes carry beside their geometry, for the texture `mesh_attribute`.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::format::mesh_io::{Attribute, MeshData};
use crate::format::{ObjectId, Props};
use crate::math::Rgb;
use crate::texture::AttributeValues;

/// The attributes of the meshes of a scene that some texture shows.
#[derive(Default)]
pub struct Attributes(HashMap<ObjectId, MeshAttributes>);

/// The attributes of one mesh.
#[derive(Default)]
pub struct MeshAttributes {
    /// Those that were asked for, with how many numbers each value has.
    pub kept: HashMap<String, (usize, Arc<AttributeValues>)>,
    /// The names of all.
    pub names: Vec<String>,
}

impl Attributes {
    /// Takes the attributes out of the mesh of a shape.
    pub fn take(&mut self, shape: &Props, data: &mut MeshData) {
        let attributes = std::mem::take(&mut data.attributes);
        let kept = attributes.into_iter().map(|a| {
            let name = a.name.clone();
            (name, (a.size, Arc::new(values(a, data))))
        });
        let mesh = MeshAttributes {
            kept: kept.collect(),
            names: std::mem::take(&mut data.attribute_names),
        };
        self.0.insert(shape.object_id(), mesh);
    }

    pub fn of(&self, shape: ObjectId) -> Option<&MeshAttributes> {
        self.0.get(&shape)
    }
}

/// Values below zero, which no texture means, are taken for zero.
fn values(attribute: Attribute, data: &MeshData) -> AttributeValues {
    let values = attribute.values.iter();
    let values = values
        .map(|v| Rgb::from_array(v.map(|x| x.max(0.0))))
        .collect();
    match attribute.name.starts_with("face_") {
        true => AttributeValues::Face(values),
        false => AttributeValues::Vertex {
            values,
            indices: data.indices.clone(),
        },
    }
}

/// The names of the attributes that textures on a shape show.
pub fn wanted(shape: &Props) -> Vec<String> {
    let (mut names, mut seen) = (Vec::new(), HashSet::new());
    let mut todo = vec![*shape];
    while let Some(p) = todo.pop() {
        if !seen.insert(p.object_id()) {
            continue;
        }
        if p.plugin() == "mesh_attribute"
            && let Ok(name) = p.string("name")
        {
            names.push(name.to_string());
        }
        todo.extend(p.all_children());
    }
    names
}
