//! Materials made of materials, and movements that no time is left for.

use super::{building, says};

/// The error of a material.
fn of(bsdf: &str) -> String {
    building(&format!(
        "<sensor type='perspective'/>\n<shape type='sphere'>{bsdf}</shape>"
    ))
}

#[test]
fn mixtures_and_reliefs() {
    says(
        of(
            "<bsdf type='blendbsdf'><float name='weight' value='0.5'/><bsdf type='diffuse'/></bsdf>",
        ),
        r#"
a.xml:3:28: bsdf "blendbsdf" needs 2 of <bsdf> inside
  <shape type='sphere'><bsdf type='blendbsdf'><float name='weight' value='0.5'/><bsdf type='diffuse'/></bsdf></shape>
                             ^"#,
    );
    says(
        of("<bsdf type='bumpmap'><texture type='checkerboard'/><bsdf type='diffuse'/></bsdf>"),
        r#"
a.xml:3:52: the texture "checkerboard" has no slopes
  <shape type='sphere'><bsdf type='bumpmap'><texture type='checkerboard'/><bsdf type='diffuse'/></bsdf></shape>
                                                     ^
  help: use a bitmap with bilinear interpolation"#,
    );
    let map = "<rgb name='normalmap' value='0.4 0.5 0.9'/>";
    says(
        of(&format!(
            "<bsdf type='normalmap'>{map}\n<bsdf type='normalmap'>{map}<bsdf type='diffuse'/></bsdf></bsdf>"
        )),
        r#"
a.xml:3:28: a bump or normal map within another is not supported
  <shape type='sphere'><bsdf type='normalmap'><rgb name='normalmap' value='0.4 0.5 0.9'/>
                             ^
  help: combine the two maps into one image"#,
    );
    says(
        of("<bsdf type='twosided'><bsdf type='mask'><bsdf type='diffuse'/></bsdf></bsdf>"),
        r#"
a.xml:3:50: "mask" already has two sides
  <shape type='sphere'><bsdf type='twosided'><bsdf type='mask'><bsdf type='diffuse'/></bsdf></bsdf></shape>
                                                   ^
  help: use it without "twosided" around it"#,
    );
}
