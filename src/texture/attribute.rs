//! Colours that a mesh carries at its vertices or triangles.

use std::sync::Arc;

use super::At;
use crate::math::Rgb;

/// The values of one attribute of one mesh, shared by the textures that show it.
#[derive(Clone, Debug, PartialEq)]
pub enum AttributeValues {
    /// One per vertex, interpolated; with the corners of each triangle.
    Vertex {
        values: Vec<Rgb>,
        indices: Vec<[u32; 3]>,
    },
    /// One per triangle.
    Face(Vec<Rgb>),
}

/// An attribute of the mesh that the texture is on; black on any other.
#[derive(Clone, Debug)]
pub struct MeshAttribute {
    pub values: Arc<AttributeValues>,
    /// Factor on the values.
    pub scale: f32,
}

impl MeshAttribute {
    pub(super) fn eval(&self, at: &At) -> Rgb {
        self.value(at).unwrap_or(Rgb::BLACK) * self.scale
    }

    fn value(&self, at: &At) -> Option<Rgb> {
        match &*self.values {
            AttributeValues::Face(values) => values.get(at.prim as usize).copied(),
            AttributeValues::Vertex { values, indices } => {
                let [a, b, c] = *indices.get(at.prim as usize)?;
                let value = |i: u32| values.get(i as usize).copied();
                let first = value(a)? * (1.0 - at.bary.x - at.bary.y);
                Some(first + value(b)? * at.bary.x + value(c)? * at.bary.y)
            }
        }
    }

    /// The colour that all values have, if they do.
    pub(super) fn single_color(&self) -> Option<Rgb> {
        let (AttributeValues::Face(values) | AttributeValues::Vertex { values, .. }) =
            &*self.values;
        let same = values.windows(2).all(|w| w[0] == w[1]);
        values.first().filter(|_| same).map(|c| *c * self.scale)
    }
}

impl AttributeValues {
    /// The same values, each changed by `f`.
    pub fn map(&self, f: impl Fn(Rgb) -> Rgb) -> AttributeValues {
        let changed = |values: &[Rgb]| values.iter().map(|c| f(*c)).collect();
        match self {
            AttributeValues::Face(values) => AttributeValues::Face(changed(values)),
            AttributeValues::Vertex { values, indices } => AttributeValues::Vertex {
                values: changed(values),
                indices: indices.clone(),
            },
        }
    }

    /// Largest number among all values; 0 without any.
    pub fn max(&self) -> f32 {
        let (AttributeValues::Face(values) | AttributeValues::Vertex { values, .. }) = self;
        values.iter().flat_map(|c| c.to_array()).fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;

    #[test]
    fn vertices_are_interpolated_and_faces_are_not() {
        let colors = [
            (1.0, 0.0, 0.0),
            (0.0, 1.0, 0.0),
            (0.0, 0.0, 1.0),
            (0.2, 0.4, 0.6),
        ];
        let values = colors.map(|(r, g, b)| Rgb::new(r, g, b)).to_vec();
        let vertex = MeshAttribute {
            values: Arc::new(AttributeValues::Vertex {
                values: values.clone(),
                indices: vec![[0, 1, 2], [0, 2, 3]],
            }),
            scale: 0.5,
        };
        let face = MeshAttribute {
            values: Arc::new(AttributeValues::Face(values)),
            scale: 1.0,
        };
        let at = |prim, u, v| At {
            prim,
            bary: Vec2::new(u, v),
            ..At::default()
        };
        let close = |a: Rgb, b: [f32; 3]| {
            a.to_array()
                .iter()
                .zip(b)
                .all(|(a, b)| (a - b).abs() < 1e-6)
        };
        // Measured with Mitsuba 3.9.1 at these places of the same square.
        assert!(close(vertex.eval(&at(0, 0.5, 0.4)), [0.05, 0.25, 0.2]));
        assert!(close(vertex.eval(&at(1, 0.3, 0.4)), [0.19, 0.08, 0.27]));
        assert!(close(face.eval(&at(1, 0.3, 0.4)), [0.0, 1.0, 0.0]));
        // No triangle of this mesh.
        assert_eq!(face.eval(&at(9, 0.3, 0.4)), Rgb::BLACK);
        assert_eq!(vertex.eval(&at(9, 0.3, 0.4)), Rgb::BLACK);
        assert_eq!(vertex.single_color(), None);
    }
}
