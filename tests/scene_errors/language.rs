//! Elements, names, references, parameters of the scene.

use super::*;

#[test]
fn files_that_are_no_scene() {
    let missing = format::load("no/such.xml".as_ref(), &[]).unwrap_err();
    says(
        missing.to_string(),
        r#"
no/such.xml: no such file"#,
    );
    says(
        file("<scene version='3.0.0'>\n  <bsdf type='diffuse'>\n</scene>"),
        r#"
a.xml:3:1: not XML: expected 'bsdf' tag, not 'scene'
  </scene>
  ^"#,
    );
    says(
        file("<scene version='3.0.0'><bsdf a=1/></scene>"),
        r#"
a.xml:1:32: not XML: expected a quote not '1'
  <scene version='3.0.0'><bsdf a=1/></scene>
                                 ^"#,
    );
    says(
        file("<scene version='3.0.0'><bsdf a='1' a='2'/></scene>"),
        r#"
a.xml:1:36: not XML: attribute 'a' is already defined
  <scene version='3.0.0'><bsdf a='1' a='2'/></scene>
                                     ^"#,
    );
    says(
        file("<scene version='3.0.0'>&lt;&foo;</scene>"),
        r#"
a.xml:1:28: not XML: unknown entity reference 'foo'
  <scene version='3.0.0'>&lt;&foo;</scene>
                             ^"#,
    );
    says(
        file(""),
        r#"
a.xml:1:1: not XML: the document does not have a root node"#,
    );
    says(
        file("<scene/>"),
        r#"
a.xml:1:1: <scene> has no attribute "version"
  <scene/>
  ^
  help: write <scene version="3.0.0">"#,
    );
    says(
        file("<scene version='3'/>"),
        r#"
a.xml:1:8: "3" is no version
  <scene version='3'/>
         ^
  help: write three numbers, such as "3.0.0""#,
    );
    says(
        file("<scene version='4.0.0'/>"),
        r#"
a.xml:1:8: version "4.0.0" is newer than luxel knows
  <scene version='4.0.0'/>
         ^"#,
    );
    says(
        file("<scene version='3.0.0' name='a'/>"),
        r#"
a.xml:1:24: unknown attribute "name" of <scene>
  <scene version='3.0.0' name='a'/>
                         ^
  help: allowed are "version""#,
    );
    says(
        file("<shape version='3.0.0' type='sphere'/>"),
        r#"
a.xml:1:1: the root is <shape>, not <scene>
  <shape version='3.0.0' type='sphere'/>
  ^"#,
    );
}

#[test]
fn entity_bombs_and_deep_nesting() {
    says(
        file(
            "<?xml version='1.0'?>\n<!DOCTYPE a [<!ENTITY b 'bb'>\n<!ENTITY c '&b;&b;'>]>\n<scene version='3.0.0'>&c;</scene>",
        ),
        r#"
a.xml:2:1: a document type is not allowed
  <!DOCTYPE a [<!ENTITY b 'bb'>
  ^
  help: remove <!DOCTYPE ...>; for values use <default> and $name"#,
    );
    says(
        file("<!DOCTYPE a SYSTEM 'file:///etc/hostname'><scene version='3.0.0'/>"),
        r#"
a.xml:1:1: a document type is not allowed
  <!DOCTYPE a SYSTEM 'file:///etc/hostname'><scene version='3.0.0'/>
  ^
  help: remove <!DOCTYPE ...>; for values use <default> and $name"#,
    );
    // Deep enough to overflow the stack of a reader that recurses.
    says(
        inside(&"<a>\n".repeat(1_000_000)),
        r#"
a.xml:65:1: elements nested more than 64 deep
  <a>
  ^"#,
    );
    // References may nest as deep as elements may, no deeper.
    let mut chain = String::from("<bsdf type='diffuse' id='b0'/>");
    for i in 1..100 {
        chain += &format!(
            "\n<bsdf type='twosided' id='b{i}'><ref id='b{}'/></bsdf>",
            i - 1
        );
    }
    says(
        inside(&chain),
        r#"
a.xml:66:37: objects nested more than 64 deep
  <bsdf type='twosided' id='b64'><ref id='b63'/></bsdf>
                                      ^"#,
    );
}

#[test]
fn unknown_names() {
    says(
        inside("  <bsdf type='difuse'/>"),
        r#"
a.xml:2:9: unknown bsdf "difuse"
    <bsdf type='difuse'/>
          ^
  help: did you mean "diffuse"?"#,
    );
    says(
        inside("<rfilter type='wobble'/>"),
        r#"
a.xml:2:10: unknown rfilter "wobble"
  <rfilter type='wobble'/>
           ^
  help: luxel has "box", "tent", "gaussian", "mitchell", "catmullrom" and "lanczos""#,
    );
    says(
        inside("<shape type='diffuse'/>"),
        r#"
a.xml:2:8: unknown shape "diffuse"
  <shape type='diffuse'/>
         ^
  help: "diffuse" is a <bsdf>"#,
    );
    says(
        inside("<medium type='homogeneous'/>"),
        r#"
a.xml:2:9: medium "homogeneous" is not supported
  <medium type='homogeneous'/>
          ^
  help: luxel renders surfaces only; leave participating media out"#,
    );
    says(
        inside("<shape type='merge'/>"),
        r#"
a.xml:2:8: shape "merge" is not supported
  <shape type='merge'/>
         ^
  help: put the shapes that it merges directly into the scene"#,
    );
    says(
        inside("<bsdf type='diffuse'>\n\t<rgb name='refletance' value='0.5'/>\n</bsdf>"),
        r#"
a.xml:3:7: unknown parameter "refletance" of bsdf "diffuse"
   <rgb name='refletance' value='0.5'/>
        ^
  help: did you mean "reflectance"?"#,
    );
    says(
        inside("<rfilter type='tent'><float name='blur' value='2'/></rfilter>"),
        r#"
a.xml:2:29: unknown parameter "blur" of rfilter "tent"
  <rfilter type='tent'><float name='blur' value='2'/></rfilter>
                              ^
  help: known are "radius""#,
    );
    says(
        inside("<bsdf type='twosided'><float name='blur' value='2'/></bsdf>"),
        r#"
a.xml:2:30: unknown parameter "blur" of bsdf "twosided"
  <bsdf type='twosided'><float name='blur' value='2'/></bsdf>
                               ^
  help: bsdf "twosided" has no parameters"#,
    );
    says(
        inside("<bsdf type='diffuse'><texture name='color' type='checkerboard'/></bsdf>"),
        r#"
a.xml:2:31: unknown parameter "color" of bsdf "diffuse"
  <bsdf type='diffuse'><texture name='color' type='checkerboard'/></bsdf>
                                ^
  help: known are "reflectance""#,
    );
    says(
        inside("<textur type='bitmap'/>"),
        r#"
a.xml:2:1: unknown element <textur>
  <textur type='bitmap'/>
  ^
  help: did you mean "texture"?"#,
    );
    says(
        inside("<scene version='3.0.0'/>"),
        r#"
a.xml:2:1: unknown element <scene>
  <scene version='3.0.0'/>
  ^
  help: a <scene> can only be the root of a file"#,
    );
    says(
        inside("<scale value='2'/>"),
        r#"
a.xml:2:1: unknown element <scale>
  <scale value='2'/>
  ^
  help: <scale> stands inside <transform>"#,
    );
    says(
        inside("<bsdf type='diffuse' ids='a'/>"),
        r#"
a.xml:2:22: unknown attribute "ids" of <bsdf>
  <bsdf type='diffuse' ids='a'/>
                       ^
  help: did you mean "id"?"#,
    );
    says(
        inside("<default name='a' value='1' unit='m'/>"),
        r#"
a.xml:2:29: unknown attribute "unit" of <default>
  <default name='a' value='1' unit='m'/>
                              ^
  help: allowed are "name" and "value""#,
    );
    says(
        inside("<bsdf/>"),
        r#"
a.xml:2:1: <bsdf> has no attribute "type"
  <bsdf/>
  ^"#,
    );
    says(
        inside("hello"),
        r#"
a.xml:2:1: text outside of tags: "hello"
  hello
  ^"#,
    );
    says(
        inside("<float name='a' value='1'/>"),
        r#"
a.xml:2:8: a <scene> has no parameters, found "a"
  <float name='a' value='1'/>
         ^"#,
    );
    says(
        file(
            "<scene version='0.6.0'><integrator type='path'><integer name='maxDeph' value='1'/></integrator></scene>",
        ),
        r#"
a.xml:1:57: unknown parameter "max_deph" of integrator "path"
  <scene version='0.6.0'><integrator type='path'><integer name='maxDeph' value='1'/></integrator></scene>
                                                          ^
  help: did you mean "max_depth"?"#,
    );
}

#[test]
fn ids_and_references() {
    says(
        inside("<shape type='sphere'><ref id='gren'/></shape>\n<bsdf type='diffuse' id='green'/>"),
        r#"
a.xml:2:27: no object has the id "gren"
  <shape type='sphere'><ref id='gren'/></shape>
                            ^
  help: did you mean "green"?"#,
    );
    says(
        inside("<bsdf type='diffuse' id='a'/>\n<shape type='cube' id='a'/>"),
        r#"
a.xml:3:20: the id "a" is taken; the first is at a.xml:2:22
  <shape type='cube' id='a'/>
                     ^"#,
    );
    says(
        inside(
            "<bsdf type='twosided' id='a'><ref id='b'/></bsdf>\n<bsdf type='twosided' id='b'><ref id='a'/></bsdf>",
        ),
        r#"
a.xml:3:35: "a" contains itself; it is defined at a.xml:2:7
  <bsdf type='twosided' id='b'><ref id='a'/></bsdf>
                                    ^"#,
    );
    says(
        inside("<alias id='a' as='b'/>\n<bsdf type='diffuse' id='a'/>"),
        r#"
a.xml:2:8: no object before this has the id "a"
  <alias id='a' as='b'/>
         ^"#,
    );
    says(
        inside("<bsdf type='diffuse' id='a'/>\n<alias id='a' as='a'/>"),
        r#"
a.xml:3:15: the id "a" is taken; the first is at a.xml:2:22
  <alias id='a' as='a'/>
                ^"#,
    );
    says(
        in_sphere("<bsdf type='diffuse'/><bsdf type='diffuse'/>"),
        r#"
a.xml:3:29: shape "sphere" takes at most one bsdf; the first is at a.xml:3:7
  <bsdf type='diffuse'/><bsdf type='diffuse'/>
                              ^"#,
    );
    says(
        in_sphere("<film type='hdrfilm'/>"),
        r#"
a.xml:3:7: a <film> has no place in shape "sphere"
  <film type='hdrfilm'/>
        ^"#,
    );
    says(
        inside("<integrator type='path'/>\n<integrator type='direct'/>"),
        r#"
a.xml:3:13: the scene takes at most one integrator; the first is at a.xml:2:13
  <integrator type='direct'/>
              ^"#,
    );
    says(
        inside("<bsdf type='twosided'/>"),
        r#"
a.xml:2:7: bsdf "twosided" needs a <bsdf> inside
  <bsdf type='twosided'/>
        ^"#,
    );
    says(
        inside("<bsdf type='diffuse'><texture type='checkerboard'/></bsdf>"),
        r#"
a.xml:2:31: a <texture> has no place in bsdf "diffuse"
  <bsdf type='diffuse'><texture type='checkerboard'/></bsdf>
                                ^
  help: give it the name of a parameter: "reflectance""#,
    );
}

/// The error of a scene with these `-D`.
fn define(defines: &[(&str, &str)], body: &str) -> String {
    let own = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
    let defines: Vec<_> = defines.iter().map(own).collect();
    let xml = format!("<scene version=\"3.0.0\">\n{body}\n</scene>");
    let loaded = format::load_str("a.xml", &xml, "nowhere".as_ref(), &defines);
    loaded.unwrap_err().to_string()
}

#[test]
fn defaults_and_definitions() {
    let spp = "<default name='spp' value='4'/>\n<sampler type='sobol'><integer name='sample_count' value='$spp'/></sampler>";
    says(
        define(&[("spp", "8"), ("sp", "9")], spp),
        r#"
command line:1:4: the scene does not use the parameter "sp"
  -D sp=9
     ^
  help: did you mean "spp"?"#,
    );
    says(
        define(&[("width", "9")], spp),
        r#"
command line:1:4: the scene does not use the parameter "width"
  -D width=9
     ^
  help: the parameters of the scene are "spp""#,
    );
    says(
        define(&[("width", "9")], ""),
        r#"
command line:1:4: the scene does not use the parameter "width"
  -D width=9
     ^
  help: the scene has no parameters"#,
    );
    says(
        define(&[("a", "9"), ("a", "8")], ""),
        r#"
command line:1:4: parameter "a" is given twice
  -D a=8
     ^"#,
    );
    says(
        define(&[("", "9")], ""),
        r#"
command line:1:4: "" cannot be the name of a parameter
  -D =9
     ^"#,
    );
    says(
        define(&[("spp", "many")], spp),
        r#"
a.xml:3:52: "many" is not an integer
  <sampler type='sobol'><integer name='sample_count' value='$spp'/></sampler>
                                                     ^"#,
    );
    says(
        inside("<integrator type='$method'/>"),
        r#"
a.xml:2:13: undefined parameter "$method"
  <integrator type='$method'/>
              ^
  help: define it before with <default name="method" value="..."/>, or with -D method=..."#,
    );
    says(
        inside("<default name='method' value='path'/><integrator type='$metod'/>"),
        r#"
a.xml:2:50: undefined parameter "$metod"
  <default name='method' value='path'/><integrator type='$metod'/>
                                                   ^
  help: did you mean "method"?"#,
    );
    // Each value doubles the one before.
    let mut bomb = String::from("<default name='a00' value='aaaaaaaaaaaaaaaa'/>");
    for i in 1..40 {
        bomb += &format!(
            "\n<default name='a{i:02}' value='$a{0:02}$a{0:02}'/>",
            i - 1
        );
    }
    says(
        inside(&bomb),
        r#"
a.xml:24:21: the values of parameters grow too long
  <default name='a22' value='$a21$a21'/>
                      ^
  help: at most 64 MiB may be filled in, all together"#,
    );
}
