//! What is wrong with mesh files of the newer kinds, grids of distances, and attributes of meshes.

use super::*;

const SENSOR: &str = "<sensor type='perspective'/>\n";

/// The error of a shape beside a sensor; the shape is on line 3.
fn shape_in(dir: &Path, shape: &str) -> String {
    building_in(dir, &format!("{SENSOR}{shape}"), &Overrides::default())
}

#[test]
fn serialized_meshes() {
    let dir = folder("serialized");
    fs::write(dir.join("a.bin"), b"\x1c\x04\x05\x00").unwrap();
    says(
        shape_in(
            &dir,
            "<shape type='serialized'><string name='filename' value='a.bin'/></shape>",
        ),
        r#"
a.xml:3:50: DIR/a.bin: version 5 is not supported: it must be 3 or 4
  <shape type='serialized'><string name='filename' value='a.bin'/></shape>
                                                   ^"#,
    );
    says(
        inside("<shape type='serialized'><integer name='shape_index' value='-1'/></shape>"),
        r#"
a.xml:2:54: "shape_index" must be an integer of at least 0, not -1
  <shape type='serialized'><integer name='shape_index' value='-1'/></shape>
                                                       ^"#,
    );
    says(
        inside("<shape type='serialized'><boolean name='flip_tex_coords' value='true'/></shape>"),
        r#"
a.xml:2:35: unknown parameter "flip_tex_coords" of shape "serialized"
  <shape type='serialized'><boolean name='flip_tex_coords' value='true'/></shape>
                                    ^
  help: known are "filename", "shape_index", "face_normals", "flip_normals", "to_world" and "silhouette_sampling_weight""#,
    );
}

#[test]
fn grids_of_distances() {
    let dir = folder("sdfgrid");
    let grid = |value: f32| {
        let words = [1u32, 2, 2, 2, 1].map(u32::to_le_bytes);
        let values = value.to_le_bytes().repeat(8);
        [b"VOL\x03", words.as_flattened(), &[0; 24], &values].concat()
    };
    fs::write(dir.join("a.vol"), grid(1.0)).unwrap();
    fs::write(dir.join("b.vol"), &grid(1.0)[..60]).unwrap();
    let shape = |file: &str, inside: &str| {
        let text = format!(
            "<shape type='sdfgrid'>{inside}<string name='filename' value='{file}'/></shape>"
        );
        shape_in(&dir, &text)
    };
    says(
        shape("a.vol", ""),
        r#"
a.xml:3:47: DIR/a.vol: the grid holds no surface: its values have all one sign
  <shape type='sdfgrid'><string name='filename' value='a.vol'/></shape>
                                                ^"#,
    );
    says(
        shape("b.vol", ""),
        r#"
a.xml:3:47: DIR/b.vol: the file is truncated: 2 x 2 x 2 numbers do not fit into the 12 bytes after the header
  <shape type='sdfgrid'><string name='filename' value='b.vol'/></shape>
                                                ^"#,
    );
    says(
        shape("a.vol", "<emitter type='area'/>"),
        r#"
a.xml:3:32: a "sdfgrid" cannot be an emitter
  <shape type='sdfgrid'><emitter type='area'/><string name='filename' value='a.vol'/></shape>
                                 ^
  help: use a mesh of the shape"#,
    );
}

#[test]
fn attributes_of_meshes() {
    let dir = folder("attributes");
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float r\nproperty float g\nproperty float b\nproperty float a\n\
        property float heat_1\nelement face 1\nproperty list uchar int vertex_indices\n\
        property float r\nproperty float g\nproperty float b\nend_header\n\
        0 0 0 1 1 1 1 0\n1 0 0 1 1 1 1 0\n0 1 0 1 1 1 1 0\n3 0 1 2 0 0.5 1\n";
    fs::write(dir.join("a.ply"), ply).unwrap();
    fs::write(dir.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    const PLY: &str = "type='ply'><string name='filename' value='a.ply'/";
    const OBJ: &str = "type='obj'><string name='filename' value='a.obj'/";
    // The texture is on line 4.
    let on = |shape: &str, bsdf: &str, parameter: &str, name: &str| {
        let shape = format!(
            "<shape {shape}><bsdf type='{bsdf}'>\n<texture name='{parameter}' type='mesh_attribute'><string name='name' value='{name}'/></texture>\n</bsdf></shape>"
        );
        shape_in(&dir, &shape)
    };
    says(
        on(PLY, "diffuse", "reflectance", "vertex_haet"),
        r#"
a.xml:4:71: the mesh has no attribute "vertex_haet"
  <texture name='reflectance' type='mesh_attribute'><string name='name' value='vertex_haet'/></texture>
                                                                        ^
  help: did you mean "vertex_heat"?"#,
    );
    says(
        on(OBJ, "diffuse", "reflectance", "vertex_color"),
        r#"
a.xml:4:71: the mesh has no attribute "vertex_color"
  <texture name='reflectance' type='mesh_attribute'><string name='name' value='vertex_color'/></texture>
                                                                        ^
  help: it has none at all: attributes come from PLY files"#,
    );
    says(
        on("type='sphere'", "diffuse", "reflectance", "vertex_color"),
        r#"
a.xml:4:29: "mesh_attribute" stands on something that is no mesh of a file
  <texture name='reflectance' type='mesh_attribute'><string name='name' value='vertex_color'/></texture>
                              ^
  help: attributes come from PLY files"#,
    );
    says(
        on(PLY, "diffuse", "reflectance", "color"),
        r#"
a.xml:4:71: "color" is no name of an attribute
  <texture name='reflectance' type='mesh_attribute'><string name='name' value='color'/></texture>
                                                                        ^
  help: it must begin with vertex_ or face_"#,
    );
    says(
        on(PLY, "diffuse", "reflectance", "vertex_color"),
        r#"
a.xml:4:71: the attribute "vertex_color" has 4 numbers, not 1 or 3
  <texture name='reflectance' type='mesh_attribute'><string name='name' value='vertex_color'/></texture>
                                                                        ^"#,
    );
    says(
        on(PLY, "roughconductor", "alpha", "face_color"),
        r#"
a.xml:4:65: the attribute "face_color" has 3 numbers, but one is wanted here
  <texture name='alpha' type='mesh_attribute'><string name='name' value='face_color'/></texture>
                                                                  ^"#,
    );
}
