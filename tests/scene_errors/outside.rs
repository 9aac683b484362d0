//! What comes from outside the scene file: pictures, and the options of the command line.

use super::*;
use luxel::film::Window;
use luxel::image_io::Image;
use luxel::math::Rgb;

/// The error of asking for this on the command line.
fn asking(overrides: Overrides) -> String {
    let body = "<sensor type='perspective'/>";
    building_in(Path::new("nowhere"), body, &overrides)
}

#[test]
fn options_of_the_command_line() {
    says(
        asking(Overrides {
            integrator: Some("pahth".into()),
            ..Overrides::default()
        }),
        r#"
command line:1:14: unknown integrator "pahth"
  --integrator pahth
               ^
  help: did you mean "path"?"#,
    );
    says(
        asking(Overrides {
            sampler: Some("halton".into()),
            ..Overrides::default()
        }),
        r#"
command line:1:11: unknown sampler "halton"
  --sampler halton
            ^
  help: there are "independent" and "sobol""#,
    );
    says(
        asking(Overrides {
            aovs: vec!["albdo".into()],
            ..Overrides::default()
        }),
        r#"
command line:1:7: unknown layer "albdo"
  --aov albdo
        ^
  help: did you mean "albedo"?"#,
    );
    says(
        asking(Overrides {
            aovs: vec!["uv".into(), "uv".into()],
            ..Overrides::default()
        }),
        r#"
command line:1:7: two layers would have the name "uv"
  --aov uv
        ^"#,
    );
    says(
        asking(Overrides {
            integrator: Some("direct".into()),
            max_depth: Some(3),
            ..Overrides::default()
        }),
        r#"
command line:1:13: the integrator "direct" has no depth to set
  --max-depth 3
              ^
  help: leave --max-depth out, or give --integrator path"#,
    );
    says(
        asking(Overrides {
            resolution: Some([1_000_000, 1_000_000]),
            ..Overrides::default()
        }),
        r#"
command line:1:14: 1000000000000 pixels are more than a picture can have (268435456)
  --resolution 1000000x1000000
               ^"#,
    );
    says(
        asking(Overrides {
            resolution: Some([0, 10]),
            ..Overrides::default()
        }),
        r#"
command line:1:14: a picture of 0 x 10 pixels has no pixel
  --resolution 0x10
               ^"#,
    );
    says(
        asking(Overrides {
            crop: Some(Window {
                x: 760,
                y: 0,
                width: 20,
                height: 20,
            }),
            ..Overrides::default()
        }),
        r#"
command line:1:8: the crop window of 20 x 20 pixels at (760, 0) does not lie within the picture of 768 x 576
  --crop 760,0,20,20
         ^"#,
    );
}

#[test]
fn pictures() {
    let dir = folder("pictures");
    let write = |name: &str, content: &[u8]| fs::write(dir.join(name), content).unwrap();
    let save = |name: &str, value: f32| {
        let image = Image::from_rgb(
            2,
            2,
            &[Rgb::WHITE, Rgb::WHITE, Rgb::splat(value), Rgb::WHITE],
        );
        image.write(dir.join(name)).unwrap();
        fs::read(dir.join(name)).unwrap()
    };
    for name in ["cut.png", "cut.exr"] {
        let whole = save(name, 0.5);
        write(name, &whole[..whole.len() * 2 / 3]);
    }
    save("nan.exr", f32::NAN);
    write("empty.png", b"");
    write("text.png", b"no picture at all");
    let picture = |name: &str| {
        let body = format!(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='diffuse'>\n\
             <texture type='bitmap' name='reflectance'><string name='filename' value='{name}'/></texture></bsdf></shape>"
        );
        building_in(&dir, &body, &Overrides::default())
    };
    let environment = |name: &str| {
        let body = format!(
            "<sensor type='perspective'/>\n\
             <emitter type='envmap'><string name='filename' value='{name}'/></emitter>"
        );
        building_in(&dir, &body, &Overrides::default())
    };
    says(
        picture("cut.png"),
        r#"
a.xml:4:67: cannot read DIR/cut.png: the file is cut off
  <texture type='bitmap' name='reflectance'><string name='filename' value='cut.png'/></texture></bsdf></shape>
                                                                    ^"#,
    );
    says(
        picture("cut.exr"),
        r#"
a.xml:4:67: cannot read DIR/cut.exr: the file is cut off or malformed
  <texture type='bitmap' name='reflectance'><string name='filename' value='cut.exr'/></texture></bsdf></shape>
                                                                    ^"#,
    );
    says(
        picture("nan.exr"),
        r#"
a.xml:4:67: pixel (0, 1) is not a finite number
  <texture type='bitmap' name='reflectance'><string name='filename' value='nan.exr'/></texture></bsdf></shape>
                                                                    ^"#,
    );
    says(
        picture("empty.png"),
        r#"
a.xml:4:67: cannot read DIR/empty.png: the file is empty
  <texture type='bitmap' name='reflectance'><string name='filename' value='empty.png'/></texture></bsdf></shape>
                                                                    ^"#,
    );
    says(
        picture("text.png"),
        r#"
a.xml:4:67: cannot read DIR/text.png: not an EXR, PNG, JPEG, BMP, TGA, Radiance HDR or PFM file, or cut off at its start
  <texture type='bitmap' name='reflectance'><string name='filename' value='text.png'/></texture></bsdf></shape>
                                                                    ^"#,
    );
    says(
        picture("missing.exr"),
        r#"
a.xml:4:67: no file "missing.exr"
  <texture type='bitmap' name='reflectance'><string name='filename' value='missing.exr'/></texture></bsdf></shape>
                                                                    ^
  help: looked in "DIR""#,
    );
    says(
        environment("cut.exr"),
        r#"
a.xml:3:48: cannot read DIR/cut.exr: the file is cut off or malformed
  <emitter type='envmap'><string name='filename' value='cut.exr'/></emitter>
                                                 ^"#,
    );
    says(
        environment("nan.exr"),
        r#"
a.xml:3:48: pixel (0, 1) is not a finite number
  <emitter type='envmap'><string name='filename' value='nan.exr'/></emitter>
                                                 ^"#,
    );
    says(
        environment("missing.png"),
        r#"
a.xml:3:48: no file "missing.png"
  <emitter type='envmap'><string name='filename' value='missing.png'/></emitter>
                                                 ^
  help: looked in "DIR""#,
    );
}
