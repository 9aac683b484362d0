//! Groups of shapes, their instances, and shapes that change.

use super::*;

fn building(body: &str) -> String {
    let sensor = "<sensor type='perspective'><float name='shutter_close' value='1'/></sensor>";
    building_in(
        "nowhere".as_ref(),
        &format!("{body}\n{sensor}"),
        &Overrides::default(),
    )
}

#[test]
fn instances() {
    says(
        building("<shape type='instance'/>"),
        r#"
a.xml:2:8: shape "instance" needs a <shape> inside
  <shape type='instance'/>
         ^"#,
    );
    says(
        building(
            "<shape type='sphere' id='ball'/>\n<shape type='instance'><ref id='ball'/></shape>",
        ),
        r#"
a.xml:3:8: an instance places a shapegroup, not a shape of type "sphere"
  <shape type='instance'><ref id='ball'/></shape>
         ^
  help: put the shape into a <shape type="shapegroup"> and refer to that"#,
    );
    says(
        building(
            "<shape type='shapegroup' id='g'/>\n<shape type='instance'><ref id='g'/>\n<ref id='g'/></shape>",
        ),
        r#"
a.xml:4:6: shape "instance" takes at most one shape; the first is at a.xml:3:29
  <ref id='g'/></shape>
       ^"#,
    );
    says(
        building(
            "<shape type='shapegroup' id='g'/>\n<shape type='instance'><ref id='g'/>\n<bsdf type='diffuse'/></shape>",
        ),
        r#"
a.xml:4:7: a <bsdf> has no place in shape "instance"
  <bsdf type='diffuse'/></shape>
        ^"#,
    );
}

#[test]
fn groups() {
    let group = |inside: &str| {
        building(&format!(
            "<shape type='shapegroup' id='g'>\n{inside}\n</shape>\n<shape type='instance'><ref id='g'/></shape>"
        ))
    };
    says(
        group("<shape type='sphere'>\n<emitter type='area'/></shape>"),
        r#"
a.xml:4:10: a shape in a shapegroup cannot be an emitter
  <emitter type='area'/></shape>
           ^
  help: put the shape that shines beside the group, once for each place"#,
    );
    says(
        group("<shape type='shapegroup'/>"),
        r#"
a.xml:3:8: the shape "shapegroup" cannot stand in a shapegroup
  <shape type='shapegroup'/>
         ^
  help: list the shapes themselves in each group"#,
    );
    says(
        group("<shape type='instance'><shape type='shapegroup'/></shape>"),
        r#"
a.xml:3:8: the shape "instance" cannot stand in a shapegroup
  <shape type='instance'><shape type='shapegroup'/></shape>
         ^
  help: list the shapes themselves in each group"#,
    );
    says(
        group(
            "<shape type='sphere'><animation name='to_world'>\n<transform time='0'/><transform time='1'><translate x='1'/></transform></animation></shape>",
        ),
        r#"
a.xml:3:22: a shape in a shapegroup cannot move by itself
  <shape type='sphere'><animation name='to_world'>
                       ^
  help: give the <animation> to the instances of the group"#,
    );
    says(
        building("<shape type='shapegroup'>\n<float name='radius' value='1'/></shape>"),
        r#"
a.xml:3:8: unknown parameter "radius" of shape "shapegroup"
  <float name='radius' value='1'/></shape>
         ^
  help: shape "shapegroup" has no parameters"#,
    );
}

#[test]
fn a_group_that_nothing_places_is_not_there() {
    let xml = "<scene version='3.0.0'><sensor type='perspective'/>\n<shape type='shapegroup' id='g'>\n\
               <shape type='sphere'/></shape></scene>";
    let compiled = format::compile(&load(xml).unwrap(), &Overrides::default()).unwrap();
    assert_eq!(
        compiled.warnings[0],
        "a.xml:2:8: no instance places this shapegroup, so it is not there"
    );
    assert_eq!(compiled.job.scene.counts().shapes, 0);
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn meshes_that_deform() {
    let dir = folder("deforming");
    let write = |name: &str, text: &str| fs::write(dir.join(name), text).unwrap();
    write("a.obj", TRIANGLE);
    write(
        "more.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n",
    );
    write("twice.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3\n");
    write("turned.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 1 3\n");
    write("moved.obj", "v 0 0 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let sensor = "<sensor type='perspective'><float name='shutter_close' value='1'/></sensor>";
    let error = |end: &str, more: &str| {
        let body = format!(
            "<shape type='obj'><string name='filename' value='a.obj'/>\n\
             <string name='filename_end' value='{end}'/>\n{more}</shape>{sensor}"
        );
        building_in(&dir, &body, &Overrides::default())
    };
    let expected = |end: &str, what: &str| {
        format!(
            "a.xml:3:29: {what}\n  <string name='filename_end' value='{end}'/>\n{:>31}\n  help: a mesh \
             deforms by moving its vertices: both files must list the same triangles",
            '^'
        )
    };
    let check = |end: &str, what: &str| says(error(end, ""), &expected(end, what));
    check("more.obj", "it has 4 vertices where the mesh has 3");
    check("twice.obj", "it has 2 triangles where the mesh has 1");
    says(
        error("moved.obj", "<emitter type='area'/>"),
        r#"
a.xml:4:10: a mesh that changes its form cannot be an emitter
  <emitter type='area'/></shape><sensor type='perspective'><float name='shutter_close' value='1'/></sensor>
           ^
  help: leave filename_end out, or move the shape as a whole by an <animation>"#,
    );
}
