//! Numbers that a PLY file gives its vertices and faces beside their geometry.
//!
//! Scalar properties that share the part of their name before the last `_` make one attribute: `heat_1`,
//! or `foo_x`, `foo_y`, `foo_z`. `r`, `g`, `b` and `red`, `green`, `blue` make the attribute `color`. An
//! attribute is called after its element: `vertex_color`, `face_heat`. This is how Mitsuba 3.9 names them.

use super::ply_header::Element;

/// Numbers for each vertex or each triangle of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Such as `vertex_color` or `face_heat`.
    pub name: String,
    /// How many numbers each has in the file.
    pub size: usize,
    /// The first three, or a single one three times; finite.
    pub values: Vec<[f32; 3]>,
}

/// Where the properties of an element go.
#[derive(Default)]
pub struct Columns {
    pub attributes: Vec<Attribute>,
    /// For each property of the element, which attribute and which of its numbers it is.
    targets: Vec<Option<(usize, usize)>>,
    /// The numbers of the current vertex or face.
    row: Vec<[f32; 3]>,
}

impl Columns {
    /// The attributes of `element` that `wanted` names, and the names of all that it has.
    pub fn new(
        element: &Element,
        is_geometry: impl Fn(&str) -> bool,
        wanted: &[String],
    ) -> (Columns, Vec<String>) {
        let mut columns = Columns::default();
        let mut names: Vec<String> = Vec::new();
        for property in &element.properties {
            let plain = property.length.is_none() && !is_geometry(&property.name);
            let name = group(&property.name).filter(|_| plain);
            let name = name.map(|name| format!("{}_{name}", element.name));
            if let Some(name) = name.clone().filter(|name| !names.contains(name)) {
                names.push(name);
            }
            let target = name.filter(|name| wanted.contains(name));
            columns
                .targets
                .push(target.map(|name| target_in(&mut columns.attributes, name)));
        }
        columns.row = vec![[0.0; 3]; columns.attributes.len()];
        (columns, names)
    }

    /// Takes the number `x` of a property.
    pub fn set(&mut self, property: usize, x: f64) {
        if let Some(Some((attribute, i))) = self.targets.get(property) {
            match (self.attributes[*attribute].size, i) {
                (1, _) => self.row[*attribute] = [x as f32; 3],
                (_, i) if *i < 3 => self.row[*attribute][*i] = x as f32,
                _ => {}
            }
        }
    }

    /// Keeps what was set, `times` over; false where it is not finite.
    pub fn finish_row(&mut self, times: usize) -> bool {
        for (attribute, row) in self.attributes.iter_mut().zip(&self.row) {
            attribute.values.extend(std::iter::repeat_n(*row, times));
        }
        self.row.as_flattened().iter().all(|x| x.is_finite())
    }
}

fn target_in(attributes: &mut Vec<Attribute>, name: String) -> (usize, usize) {
    let at = attributes.iter().position(|a| a.name == name);
    let at = at.unwrap_or_else(|| {
        attributes.push(Attribute {
            name,
            size: 0,
            values: Vec::new(),
        });
        attributes.len() - 1
    });
    attributes[at].size += 1;
    (at, attributes[at].size - 1)
}

/// The attribute that a property belongs to.
fn group(property: &str) -> Option<String> {
    let (prefix, last) = match property.rsplit_once('_') {
        Some((prefix, last)) => (Some(prefix), last),
        None => (None, property),
    };
    let is_color = matches!(
        last,
        "r" | "g" | "b" | "a" | "red" | "green" | "blue" | "alpha"
    );
    match (prefix, is_color) {
        (Some(prefix), true) => Some(format!("{prefix}_color")),
        (None, true) => Some("color".into()),
        (prefix, false) => prefix.map(str::to_string),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MeshData, ply};

    const TEXT: &str = "ply\nformat ascii 1.0\nelement vertex 4\n\
        property float x\nproperty float y\nproperty float z\nproperty float heat_1\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float a_b_x\n\
        property float a_b_y\nproperty float lonely\nproperty float u\nproperty float v\n\
        element face 2\nproperty list uchar int vertex_indices\n\
        property float r\nproperty float g\nproperty float b\nproperty float a\nend_header\n\
        0 0 0 0.1 255 0 7 1 2 9 0 0\n1 0 0 0.2 1 2 3 1 2 9 0 0\n1 1 0 0.3 4 5 6 1 2 9 0 0\n\
        0 1 0 0.4 7 8 9 1 2 9 0 0\n4 0 1 2 3 0.5 0.6 0.7 1\n3 0 1 2 0.25 0.125 0 1\n";

    fn read(wanted: &[&str]) -> MeshData {
        let wanted: Vec<String> = wanted.iter().map(|w| w.to_string()).collect();
        ply::parse(TEXT.as_bytes(), &wanted).unwrap()
    }

    #[test]
    fn what_is_asked_for_is_kept() {
        let names = ["vertex_heat", "vertex_color", "vertex_a_b", "face_color"];
        let none = read(&[]);
        assert_eq!(
            (none.attributes.len(), &none.attribute_names[..]),
            (0, &names.map(String::from)[..])
        );
        let mesh = read(&["face_color", "vertex_heat", "vertex_lonely"]);
        let [heat, color] = &mesh.attributes[..] else {
            panic!("{:?}", mesh.attributes);
        };
        assert_eq!((heat.name.as_str(), heat.size), ("vertex_heat", 1));
        assert_eq!(heat.values, [0.1, 0.2, 0.3, 0.4].map(|x| [x; 3]));
        // A square is two triangles.
        assert_eq!((color.name.as_str(), color.size), ("face_color", 4));
        let (square, triangle) = ([0.5, 0.6, 0.7], [0.25, 0.125, 0.0]);
        assert_eq!(color.values, [square, square, triangle]);
        let bytes = &read(&["vertex_color"]).attributes[0];
        assert_eq!((bytes.size, bytes.values[0]), (3, [255.0, 0.0, 7.0]));
    }

    #[test]
    fn values_must_be_finite() {
        let text = TEXT.replace("0.125 0 1", "1e39 0 1");
        let read = |wanted: &str| ply::parse(text.as_bytes(), &[wanted.to_string()]);
        assert!(read("vertex_color").is_ok());
        let what = "an attribute of face 1 is not finite".to_string();
        assert_eq!(read("face_color"), Err((Some(28), what)));
    }
}
