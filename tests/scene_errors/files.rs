//! Included files, mesh files, and what compiling leaves unread.

use super::*;

#[test]
fn includes() {
    let dir = folder("includes");
    let write = |name: &str, content: &[u8]| fs::write(dir.join(name), content).unwrap();
    let error = |xml: &str| {
        let loaded = format::load_str("a.xml", xml, &dir, &[]);
        let text = loaded.unwrap_err().to_string();
        text.replace(dir.to_str().unwrap(), "DIR")
    };
    let scene = |body: &str| format!("<scene version='3.0.0'>{body}</scene>");
    says(
        error(&scene("<include filename='b.xml'/>")),
        r#"
a.xml:1:33: no file "b.xml"
  <scene version='3.0.0'><include filename='b.xml'/></scene>
                                  ^
  help: looked in "DIR""#,
    );
    write(
        "self.xml",
        scene("<include filename='self.xml'/>").as_bytes(),
    );
    says(
        error(&scene("<include filename='self.xml'/>")),
        r#"
DIR/self.xml:1:33: too many includes, at "self.xml"
  <scene version='3.0.0'><include filename='self.xml'/></scene>
                                  ^
  help: files may include files up to 15 deep; does this one include itself?"#,
    );
    let twice = "<include filename='twice.xml'/>".repeat(2);
    write("twice.xml", scene(&twice).as_bytes());
    says(
        error(&scene(&twice)),
        r#"
DIR/twice.xml:1:33: too many includes, at "twice.xml"
  <scene version='3.0.0'><include filename='twice.xml'/><include filename='twice.xml'/></scene>
                                  ^
  help: files may include files up to 15 deep; does this one include itself?"#,
    );
    write(
        "wrong.xml",
        b"<scene version='3.0.0'>\n  <bsdf type='difuse'/></scene>",
    );
    says(
        error(&scene("<include filename='wrong.xml'/>")),
        r#"
DIR/wrong.xml:2:9: unknown bsdf "difuse"
    <bsdf type='difuse'/></scene>
          ^
  help: did you mean "diffuse"?"#,
    );
    write("latin.xml", b"<scene version='3.0.0'>\n\xe4</scene>");
    says(
        error(&scene("<include filename='latin.xml'/>")),
        r#"
a.xml:1:33: cannot include "latin.xml": line 2 is not UTF-8
  <scene version='3.0.0'><include filename='latin.xml'/></scene>
                                  ^"#,
    );
    says(
        error(&scene("<path value='textures'/>")),
        r#"
a.xml:1:30: no folder "textures"
  <scene version='3.0.0'><path value='textures'/></scene>
                               ^"#,
    );
    write("bad.spd", b"400 0.5\n500 high\n");
    says(
        error(&scene(
            "<bsdf type='diffuse'><spectrum name='reflectance' filename='bad.spd'/></bsdf>",
        )),
        r#"
a.xml:1:74: "bad.spd": line 2: "high" is not a number
  <scene version='3.0.0'><bsdf type='diffuse'><spectrum name='reflectance' filename='bad.spd'/></bsdf></scene>
                                                                           ^"#,
    );
}

#[test]
fn mesh_files() {
    let dir = folder("meshes");
    let error = |kind: &str, name: &str, content: &[u8]| {
        fs::write(dir.join(name), content).unwrap();
        let xml = format!(
            "<scene version='3.0.0'>\n<shape type='{kind}'><string name='filename' value='{name}'/></shape>\n\
             <sensor type='perspective'/></scene>"
        );
        let desc = format::load_str("a.xml", &xml, &dir, &[]).unwrap();
        let compiled = format::compile(&desc, &format::Overrides::default());
        let text = compiled.unwrap_err().to_string();
        text.replace(dir.to_str().unwrap(), "DIR")
    };
    says(
        in_sphere("<include filename='no.xml'/>"),
        r#"
a.xml:3:10: no file "no.xml"
  <include filename='no.xml'/>
           ^
  help: looked in "nowhere""#,
    );
    says(
        inside("<shape type='obj'><string name='filename' value='no.obj'/></shape>"),
        r#"
a.xml:2:43: no file "no.obj"
  <shape type='obj'><string name='filename' value='no.obj'/></shape>
                                            ^
  help: looked in "nowhere""#,
    );
    says(
        inside("<shape type='obj'><string name='filename' value=''/></shape>"),
        r#"
a.xml:2:43: the name of the file is empty
  <shape type='obj'><string name='filename' value=''/></shape>
                                            ^"#,
    );
    says(
        error("obj", "a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
        r#"
a.xml:2:43: DIR/a.obj:4: index 4 is out of range: there are 3 vertices so far
  <shape type='obj'><string name='filename' value='a.obj'/></shape>
                                            ^"#,
    );
    says(
        error("obj", "empty.obj", b""),
        r#"
a.xml:2:43: DIR/empty.obj: the mesh has no triangles
  <shape type='obj'><string name='filename' value='empty.obj'/></shape>
                                            ^"#,
    );
    says(
        error("obj", "nan.obj", b"v 0 0 nan\n"),
        r#"
a.xml:2:43: DIR/nan.obj:1: "nan" is not a finite number
  <shape type='obj'><string name='filename' value='nan.obj'/></shape>
                                            ^"#,
    );
    let header = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let cut = [&header[..], &[0; 30]].concat();
    says(
        error("ply", "cut.ply", &cut),
        r#"
a.xml:2:43: DIR/cut.ply: the file is truncated: 3 elements "vertex" do not fit into the 30 bytes that are left
  <shape type='ply'><string name='filename' value='cut.ply'/></shape>
                                            ^"#,
    );
    let nan = [&header[..], &f32::NAN.to_le_bytes(), &[0; 40]].concat();
    says(
        error("ply", "nan.ply", &nan),
        r#"
a.xml:2:43: DIR/nan.ply: vertex 0 is not finite
  <shape type='ply'><string name='filename' value='nan.ply'/></shape>
                                            ^"#,
    );
    says(
        error("ply", "not.ply", b"solid\n"),
        r#"
a.xml:2:43: DIR/not.ply:1: not a PLY file: the first line is not "ply"
  <shape type='ply'><string name='filename' value='not.ply'/></shape>
                                            ^"#,
    );
}

#[test]
fn what_nothing_reads_is_reported() {
    let desc = load("<scene version='3.0.0'>\n<integrator type='path'><integer name='rr_depth' value='9'/></integrator>\n<bsdf type='diffuse' id='unused'/></scene>").unwrap();
    let unread = || desc.check_all_read().unwrap_err().to_string();
    let scene = desc.scene();
    says(
        unread(),
        r#"
a.xml:2:13: integrator "path" in the scene has no effect here
  <integrator type='path'><integer name='rr_depth' value='9'/></integrator>
              ^"#,
    );
    let path = scene.child(Category::Integrator).unwrap();
    says(
        unread(),
        r#"
a.xml:2:34: parameter "rr_depth" of integrator "path" has no effect here
  <integrator type='path'><integer name='rr_depth' value='9'/></integrator>
                                   ^"#,
    );
    assert_eq!(path.int("rr_depth").unwrap(), 9);
    assert!(desc.check_all_read().is_ok());
    // A name that the table does not have is a mistake of the program, yet no panic.
    says(
        path.int("rr_dept").unwrap_err().to_string(),
        r#"
a.xml:2:13: integrator "path" has no parameter "rr_dept"
  <integrator type='path'><integer name='rr_depth' value='9'/></integrator>
              ^"#,
    );
}
