//! What a scene means: parameters, includes, references, upgrades, defaults.

use luxel::format::{self, Category, FloatOrTexture, Overrides, Props, RgbOrTexture, SceneDesc};
use luxel::math::{DVec3, Rgb, Transform};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::fs;
use std::path::PathBuf;

fn load(body: &str) -> SceneDesc {
    load_version("3.0.0", body)
}

fn load_version(version: &str, body: &str) -> SceneDesc {
    let xml = format!("<scene version=\"{version}\">{body}</scene>");
    format::load_str("a.xml", &xml, "nowhere".as_ref(), &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn only(desc: &SceneDesc, category: Category) -> Props<'_> {
    desc.scene().child(category).unwrap()
}

/// A fresh folder for the files of one test.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("scene_language_{test}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("sub")).unwrap();
    folder
}

#[test]
fn defaults_come_from_the_table() {
    let desc = load("<bsdf type='roughconductor'/><film type='hdrfilm'/><bsdf type='dielectric'/>");
    let bsdfs = desc.scene().children(Category::Bsdf);
    let rough = bsdfs[0];
    assert_eq!(rough.choice("distribution").unwrap(), "beckmann");
    assert_eq!(
        rough.float_or_texture("alpha").unwrap(),
        FloatOrTexture::Float(0.1)
    );
    assert_eq!(rough.opt_float_or_texture("alpha_u").unwrap(), None);
    assert_eq!(rough.opt_rgb("eta").unwrap(), None);
    assert_eq!(rough.rgb("specular_reflectance").unwrap(), Rgb::WHITE);
    assert!(rough.bool("sample_visible").unwrap());
    let film = only(&desc, Category::Film);
    assert_eq!(film.int("width").unwrap(), 768);
    assert_eq!(film.opt_int("crop_width").unwrap(), None);
    assert_eq!(bsdfs[1].ior("int_ior").unwrap(), 1.5046);
    assert!(bsdfs[1].transform("int_ior").is_err());
}

#[test]
fn values_are_read_in_all_their_forms() {
    let desc = load(
        "<shape type='cylinder'>
           <point name='p0' x='1' y='2' z='3'/><vector name='p1' value='4 5,6'/>
           <integer name='radius' value='2'/><boolean name='flip_normals' value='TRUE'/>
         </shape>
         <bsdf type='diffuse'><spectrum name='reflectance' value='0.25'/></bsdf>
         <bsdf type='roughconductor'>
           <rgb name='alpha' value='0.3'/><rgb name='eta' value='0.1 0.2, 0.3'/>
           <float name='k' value='3'/><string name='distribution' value='GGX'/>
         </bsdf>
         <emitter type='area'><spectrum name='radiance' value='400:0, 500:8, 600:15.6, 700:18.4'/></emitter>
         <emitter type='point'><float name='intensity' value='7'/></emitter>
         <texture type='checkerboard' id='t'><rgb name='color0' value='1'/></texture>
         <bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf>",
    );
    let shape = only(&desc, Category::Shape);
    assert_eq!(shape.vec3("p0").unwrap(), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(shape.vec3("p1").unwrap(), DVec3::new(4.0, 5.0, 6.0));
    assert_eq!(shape.float("radius").unwrap(), 2.0);
    assert!(shape.bool("flip_normals").unwrap());
    let bsdfs = desc.scene().children(Category::Bsdf);
    assert_eq!(bsdfs[0].rgb("reflectance").unwrap(), Rgb::splat(0.25));
    let rough = bsdfs[1];
    assert_eq!(
        rough.float_or_texture("alpha").unwrap(),
        FloatOrTexture::Float(0.3)
    );
    assert_eq!(rough.rgb("eta").unwrap(), Rgb::new(0.1, 0.2, 0.3));
    assert_eq!(rough.rgb("k").unwrap(), Rgb::splat(3.0));
    assert_eq!(rough.choice("distribution").unwrap(), "ggx");
    let emitters = desc.scene().children(Category::Emitter);
    let red = emitters[0].rgb("radiance").unwrap().r;
    assert!((red - 20.7108).abs() < 0.1, "{red}");
    assert_eq!(emitters[1].rgb("intensity").unwrap(), Rgb::splat(7.0));
    let texture = only(&desc, Category::Texture);
    let reflectance = bsdfs[2].rgb_or_texture("reflectance").unwrap();
    assert_eq!(reflectance, RgbOrTexture::Texture(texture.object_id()));
    assert!(bsdfs[2].rgb("reflectance").is_err());
}

#[test]
fn steps_of_a_transform_act_in_order() {
    let of = |steps: &str| {
        let desc = load(&format!(
            "<shape type='cube'><transform name='to_world'>{steps}</transform></shape>"
        ));
        only(&desc, Category::Shape).transform("to_world").unwrap()
    };
    let chain = of("<scale value='2'/><rotate z='1' angle='90'/><translate x='1'/>");
    assert!((chain.point(DVec3::X) - DVec3::new(1.0, 2.0, 0.0)).length() < 1e-12);
    let partial = of("<scale x='5' y='5'/>");
    assert_eq!(partial.point(DVec3::ONE), DVec3::new(5.0, 5.0, 1.0));
    let matrix = of("<matrix value='1 2 3 4 5 6 7 8 9 10 12 12 0 0 0 1'/>");
    assert_eq!(matrix.point(DVec3::X), DVec3::new(5.0, 13.0, 21.0));
    let small = of("<matrix value='1 2 3, 4 5 6, 7 8 10'/>");
    assert_eq!(small.point(DVec3::Y), DVec3::new(2.0, 5.0, 8.0));
    // The axis need not be of unit length.
    let long = of("<rotate value='0 0 7' angle='90'/>");
    assert!((long.point(DVec3::X) - DVec3::Y).length() < 1e-12);
    assert_eq!(of(""), Transform::IDENTITY);
}

#[test]
fn objects_are_shared_by_reference() {
    // A reference may come before what it names, and an alias is another name.
    let desc = load(
        "<shape type='sphere'><ref id='a'/></shape>
         <bsdf type='twosided' id='a'><bsdf type='diffuse'/></bsdf><alias id='a' as='b'/>
         <shape type='sphere'><ref name='any' id='b'/><emitter type='area'/></shape>",
    );
    let shapes = desc.scene().children(Category::Shape);
    let first = shapes[0].child(Category::Bsdf).unwrap();
    let (name, second) = shapes[1].named_children(Category::Bsdf)[0];
    assert_eq!((name, first.object_id()), (Some("any"), second.object_id()));
    assert_eq!((first.plugin(), first.id()), ("twosided", Some("a")));
    assert_eq!(first.child(Category::Bsdf).unwrap().plugin(), "diffuse");
    assert_eq!(shapes[1].child(Category::Emitter).unwrap().plugin(), "area");
    assert_eq!(desc.object_count(), 6);
}

#[test]
fn old_files_are_upgraded() {
    let desc = load_version(
        "0.6.0",
        "<default name='maxDepth' value='3'/>
         <integrator type='path'><integer name='maxDepth' value='$maxDepth'/></integrator>
         <bsdf type='diffuse' id='myBsdf'>
           <texture type='checkerboard' name='diffuseReflectance'>
             <float name='uoffset' value='0.1'/><integer name='vscale' value='4'/>
             <float name='uscale' value='3'/>
           </texture>
         </bsdf>
         <bsdf type='dielectric'><float name='intIOR' value='1.3'/></bsdf>",
    );
    assert_eq!(
        only(&desc, Category::Integrator).int("max_depth").unwrap(),
        3
    );
    let bsdfs = desc.scene().children(Category::Bsdf);
    let RgbOrTexture::Texture(id) = bsdfs[0].rgb_or_texture("reflectance").unwrap() else {
        panic!("no texture");
    };
    let to_uv = desc.object(id).transform("to_uv").unwrap();
    let uv = to_uv.point(DVec3::new(1.0, 1.0, 0.0));
    assert!((uv - DVec3::new(3.3, 4.0, 0.0)).length() < 1e-12, "{uv}");
    assert_eq!(bsdfs[1].ior("int_ior").unwrap(), 1.3);
    assert_eq!(bsdfs[0].id(), Some("myBsdf"));
}

#[test]
fn included_files_see_and_set_parameters() {
    let dir = folder("includes");
    let write = |name: &str, text: &str| fs::write(dir.join(name), text).unwrap();
    // Found beside the including file, beside the scene, and in a folder of <path>.
    write(
        "main.xml",
        "<scene version='3.0.0'><default name='a' value='0.5'/><path value='sub'/>
         <include filename='sub/one.xml'/><include filename='two.xml'/>
         <bsdf type='diffuse'><float name='reflectance' value='$b'/></bsdf>
         <shape type='obj'><string name='filename' value='quad.obj'/><include filename='area.xml'/></shape></scene>",
    );
    write(
        "sub/one.xml",
        "<scene version='3.0.0'><default name='a' value='0.9'/><default name='b' value='0.25'/>
         <include filename='deep.xml'/><include filename='beside.xml'/></scene>",
    );
    write(
        "sub/deep.xml",
        "<scene version='0.5.0'><bsdf type='diffuse'><float name='diffuseReflectance' value='$a'/></bsdf></scene>",
    );
    write(
        "beside.xml",
        "<scene version='3.0.0'><bsdf type='conductor'/></scene>",
    );
    write("sub/two.xml", "<bsdf version='3.0.0' type='dielectric'/>");
    write(
        "sub/area.xml",
        "<scene version='3.0.0'><bsdf type='diffuse'/><emitter type='area'/></scene>",
    );
    write(
        "sub/quad.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0.25\nf 1/1 2/1 3/1 4/1\n",
    );
    let load = |b: &str| format::load(&dir.join("main.xml"), &[("b".into(), b.into())]).unwrap();
    let desc = load("0.75");
    let bsdfs = desc.scene().children(Category::Bsdf);
    let plugins: Vec<_> = bsdfs.iter().map(|b| b.plugin()).collect();
    assert_eq!(plugins, ["diffuse", "conductor", "dielectric", "diffuse"]);
    // The first default counts, the command line before it.
    assert_eq!(bsdfs[0].rgb("reflectance").unwrap(), Rgb::splat(0.5));
    assert_eq!(bsdfs[3].rgb("reflectance").unwrap(), Rgb::splat(0.75));
    let shape = only(&desc, Category::Shape);
    assert_eq!(shape.file("filename").unwrap(), dir.join("sub/quad.obj"));
    assert!(shape.child(Category::Emitter).is_some());
    assert_eq!(desc.files().count(), 6);
}

#[test]
fn the_reference_names_every_plugin() {
    let text = format::plugins::reference();
    for plugin in format::plugins::all() {
        assert!(text.contains(&format!("  {}: {}\n", plugin.name, plugin.doc)));
    }
    assert!(text.contains("    reflectance (a colour or texture within 0 to 1; default 0.5): "));
}

const VALID: &str = "<?xml version='1.0'?>
<scene version='0.6.0'><!-- all kinds of things -->
  <default name='n' value='16'/><default name='méthode' value='path'/>
  <integrator type='aov'><string name='aovs' value='d:depth'/><integrator type='$méthode'/></integrator>
  <sensor type='perspective'><float name='fov' value='4.5e1'/>
    <transform name='toWorld'><lookat origin='0, 0, -5' target='0, 0, 0' up='0, 1, 0'/><scale x='-1'/></transform>
    <sampler type='independent'><integer name='sampleCount' value='$n'/></sampler>
    <film type='hdrfilm'><integer name='width' value='64'/><rfilter type='box'/></film>
  </sensor>
  <bsdf type='twosided' id='grün'><bsdf type='diffuse'><rgb name='reflectance' value='.2 .3, .4'/></bsdf></bsdf>
  <shape type='sphere'><ref id='grün'/><point name='center' x='1' y='2' z='3'/>
    <emitter type='area'><spectrum name='radiance' value='400:1, 500:2, 700:0.5'/></emitter></shape>
  <bsdf type='diffuse'><texture type='checkerboard' name='diffuseReflectance'><float name='uscale' value='2'/></texture></bsdf>
  <alias id='grün' as='b'/><shape type='cube'><ref id='b'/><boolean name='flipNormals' value='true'/>
    <transform name='toWorld'><matrix value='1 0 0 0 1 0 0 0 1'/><rotate y='1' angle='3'/></transform></shape>
</scene>";

#[test]
fn the_scene_to_be_mutated_is_valid() {
    format::load_str("a.xml", VALID, "".as_ref(), &[]).unwrap_or_else(|e| panic!("{e}"));
}

/// Pieces that break things when they land in the wrong place.
const PIECES: &[&str] = &[
    "<",
    ">",
    "/>",
    "'",
    "\"",
    "&",
    "&#0;",
    "&lt;",
    "$",
    "$n",
    "-",
    "1e999",
    "nan",
    "<!--",
    "-->",
    "<![CDATA[",
    "<scene>",
    "</scene>",
    "<ref id='b'/>",
    "<shape type='cube'/>",
    "é",
    "\u{0}",
    "9999999999999999999999",
    "id='b'",
    "name='radius'",
    "value='0'",
    "<transform name='toWorld'>",
    "<default name='n' value='$n$n'/>",
    "<path value='.'/>",
    "<include filename='a.xml'/>",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// Whatever the text, there is an answer; an error can be shown.
    #[test]
    fn mutated_scenes_never_panic(
        edits in prop::collection::vec((0.0..1.0f64, 0usize..12, 0usize..PIECES.len()), 1..6)
    ) {
        let mut text: Vec<char> = VALID.chars().collect();
        for (at, remove, piece) in edits {
            let start = (at * text.len() as f64) as usize;
            let end = (start + remove).min(text.len());
            text.splice(start..end, PIECES[piece].chars());
        }
        let text: String = text.into_iter().collect();
        if let Err(error) = format::load_str("a.xml", &text, "nowhere".as_ref(), &[]) {
            prop_assert!(error.to_string().starts_with("a.xml"));
        }
    }

    /// The same for bytes of meshes.
    #[test]
    fn mutated_meshes_never_panic(edits in prop::collection::vec((0.0..1.0f64, any::<u8>()), 1..8)) {
        let dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
            property float y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let mut ply = header.as_bytes().to_vec();
        ply.extend([7; 48]);
        ply.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
        let mut obj = b"v 0 0 0\nv 1 0 0 # a\nv 0 1 -.5e1\nvt 0 1\nvn 0 0 1\nf 1/1/1 \\\n2/1/-1 -1//1\n".to_vec();
        for (at, byte) in edits {
            let (i, k) = ((at * ply.len() as f64) as usize, (at * obj.len() as f64) as usize);
            ply[i] = byte;
            obj[k] = byte;
        }
        let (ply_path, obj_path) = (dir.join("mutated.ply"), dir.join("mutated.obj"));
        fs::write(&ply_path, ply).unwrap();
        fs::write(&obj_path, obj).unwrap();
        let read = [format::mesh_io::read_ply(&ply_path, &[]), format::mesh_io::read_obj(&obj_path)];
        for mesh in read.into_iter().flatten() {
            prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
            prop_assert!(mesh.normals.iter().flatten().all(|n| n.is_finite()));
            prop_assert!(mesh.uvs.iter().flatten().all(|uv| uv.is_finite()));
            let count = mesh.positions.len() as u32;
            prop_assert!(mesh.indices.iter().flatten().all(|i| *i < count));
        }
    }
}

#[test]
fn integrators_of_mitsuba_0_6_keep_their_settings() {
    use luxel::transport::{BidirSpec, IntegratorSpec, Method, PhotonSpec};
    let of = |integrator: &str| {
        let xml = format!(
            "<scene version='0.6.0'><sensor type='perspective'/>{integrator}\
             <shape type='sphere'><bsdf type='diffuse'/></shape></scene>"
        );
        let desc = format::load_str("a.xml", &xml, "nowhere".as_ref(), &[]).unwrap();
        format::compile(&desc, &Overrides::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .job
            .integrator
    };
    let sppm = of(
        "<integrator type='sppm'><integer name='maxDepth' value='7'/><integer name='rrDepth' value='3'/>
         <integer name='photonCount' value='1000'/><float name='initialRadius' value='0.5'/>
         <float name='alpha' value='0.6'/><integer name='maxPasses' value='-1'/>
         <integer name='granularity' value='500'/></integrator>",
    );
    let expected = BidirSpec {
        method: Method::Sppm,
        max_depth: Some(7),
        rr_depth: 3,
        hide_emitters: false,
        light_image: true,
        photons: PhotonSpec {
            count: Some(1000),
            radius: Some(0.5),
            alpha: 0.6,
            ..PhotonSpec::default()
        },
    };
    assert_eq!(sppm, IntegratorSpec::Bidirectional(expected));
    let bdpt = of(
        "<integrator type='bdpt'><boolean name='lightImage' value='false'/>
         <boolean name='sampleDirect' value='true'/></integrator>",
    );
    let expected = BidirSpec {
        method: Method::Bdpt,
        max_depth: None,
        rr_depth: 5,
        hide_emitters: false,
        light_image: false,
        photons: PhotonSpec::default(),
    };
    assert_eq!(bdpt, IntegratorSpec::Bidirectional(expected));
    // Of a radius of 0 Mitsuba makes one of its own, and so does luxel.
    let sppm = of("<integrator type='sppm'><float name='initialRadius' value='0'/></integrator>");
    let IntegratorSpec::Bidirectional(spec) = sppm else {
        panic!("{sppm:?}");
    };
    assert_eq!(spec.photons, PhotonSpec::default());
}
