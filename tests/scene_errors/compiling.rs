use super::*;
fn compiled(dir: &std::path::Path, xml: &str, overrides: &format::Overrides) -> String {
    let desc = match format::load_str("a.xml", xml, dir, &[]) {
        Ok(d) => d,
        Err(e) => return format!("AT LOAD {e}"),
    };
    match format::compile(&desc, overrides) {
        Ok(c) => format!("OK {:?}", c.warnings),
        Err(e) => e.to_string(),
    }
}
#[test]
fn explore() {
    let dir = folder("compiling");
    fs::write(dir.join("a.png"), b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR").unwrap();
    let mut image = luxel::image_io::Image::from_rgb(2, 2, &[luxel::math::Rgb::WHITE; 4]);
    image.write(dir.join("good.exr")).unwrap();
    let bytes = fs::read(dir.join("good.exr")).unwrap();
    fs::write(dir.join("cut.exr"), &bytes[..bytes.len() / 2]).unwrap();
    image = luxel::image_io::Image::from_rgb(2, 2, &[luxel::math::Rgb::splat(f32::NAN); 4]);
    image.write(dir.join("nan.exr")).unwrap();
    image = luxel::image_io::Image::from_rgb(2, 2, &[luxel::math::Rgb::splat(-1.0); 4]);
    image.write(dir.join("neg.exr")).unwrap();
    fs::write(dir.join("empty.png"), b"").unwrap();
    let s = "<sensor type='perspective'/>";
    let sensor = |b: &str| format!("<sensor type='perspective'>{b}</sensor>");
    let film = |b: &str| sensor(&format!("<film type='hdrfilm'>{b}</film>"));
    let sphere = |b: &str| format!("{s}\n<shape type='sphere'>{b}</shape>");
    let tex = |n: &str| {
        sphere(&format!(
            "<bsdf type='diffuse'>\n<texture type='bitmap' name='reflectance'><string name='filename' value='{n}'/></texture></bsdf>"
        ))
    };
    let env = |n: &str| {
        format!("{s}\n<emitter type='envmap'><string name='filename' value='{n}'/></emitter>")
    };
    let aov = |a: &str| {
        format!("{s}\n<integrator type='aov'><string name='aovs' value='{a}'/></integrator>")
    };
    for body in [
        "".to_string(),
        film("<integer name='crop_offset_x' value='700'/><integer name='crop_width' value='100'/>"),
        film("<integer name='crop_width' value='0'/>"),
        film("<integer name='width' value='1000000'/><integer name='height' value='1000000'/>"),
        film("<integer name='width' value='65536'/><integer name='height' value='65536'/>"),
        film("<integer name='width' value='0'/>"),
        film("<string name='component_format' value='uint32'/>"),
        sensor("<float name='near_clip' value='2'/><float name='far_clip' value='1'/>"),
        sensor("<float name='near_clip' value='2'/><float name='far_clip' value='2'/>"),
        sensor("<float name='near_clip' value='0'/>"),
        sensor("<float name='shutter_open' value='2'/><float name='shutter_close' value='1'/>"),
        sensor("<string name='focal_length' value='long'/>"),
        sensor("<string name='focal_length' value='0mm'/>"),
        sensor("<float name='fov' value='180'/>"),
        sensor("<transform name='to_world'><scale value='2'/></transform>"),
        sensor("<transform name='to_world'><scale value='0'/></transform>"),
        sensor("<transform name='to_world'><scale x='-1'/></transform>"),
        sensor(
            "<transform name='to_world'><lookat origin='0,0,0' target='0,0,0' up='0,1,0'/></transform>",
        ),
        sensor(
            "<transform name='to_world'><lookat origin='0,0,0' target='0,1,0' up='0,1,0'/></transform>",
        ),
        sensor(
            "<transform name='to_world'><matrix value='1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1'/></transform>",
        ),
        sensor("<sampler type='sobol'><integer name='sample_count' value='0'/></sampler>"),
        format!("{s}\n<emitter type='constant'/>\n<emitter type='constant'/>"),
        sphere("<bsdf type='conductor'><string name='material' value='Agg'/></bsdf>"),
        sphere("<bsdf type='conductor'><string name='material' value='unobtainium'/></bsdf>"),
        sphere("<bsdf type='roughconductor'><float name='alpha_u' value='0.1'/></bsdf>"),
        sphere("<bsdf type='twosided'><bsdf type='dielectric'/></bsdf>"),
        sphere("<transform name='to_world'><scale x='2'/></transform>"),
        sphere("<transform name='to_world'><scale value='0'/></transform>"),
        sphere("<float name='radius' value='1e-300'/>"),
        sphere("<float name='radius' value='1e-30'/>"),
        sphere("<float name='radius' value='1e30'/>"),
        sphere("<point name='center' x='1e30' y='0' z='0'/>"),
        sphere("<point name='center' x='1e300' y='0' z='0'/>"),
        sphere("<emitter type='constant'/>"),
        sphere("<emitter type='point'/>"),
        sphere("<emitter type='area'><texture type='checkerboard' name='radiance'/></emitter>"),
        format!(
            "{s}\n<shape type='cylinder'><transform name='to_world'><scale x='2'/></transform></shape>"
        ),
        format!("{s}\n<shape type='cylinder'><point name='p1' x='0' y='0' z='0'/></shape>"),
        format!("{s}\n<shape type='cylinder'><float name='radius' value='1e-300'/></shape>"),
        format!(
            "{s}\n<shape type='disk'><transform name='to_world'><scale x='0'/></transform></shape>"
        ),
        format!(
            "{s}\n<shape type='cube'><transform name='to_world'><translate x='1e300'/></transform></shape>"
        ),
        format!(
            "{s}\n<shape type='cube'><transform name='to_world'><translate x='1e39'/></transform></shape>"
        ),
        format!(
            "{s}\n<shape type='cube'><transform name='to_world'><scale value='1e39'/></transform></shape>"
        ),
        format!(
            "{s}\n<shape type='cube'/><shape type='cube'><transform name='to_world'><translate x='1e39'/></transform></shape>"
        ),
        format!(
            "{s}\n<shape type='cube'/><emitter type='constant'><float name='radiance' value='1e39'/></emitter>"
        ),
        format!("{s}\n<emitter type='point'><float name='intensity' value='1e39'/></emitter>"),
        format!(
            "{s}\n<emitter type='point'><point name='position' x='1e300' y='0' z='0'/></emitter>"
        ),
        tex("a.png"),
        tex("cut.exr"),
        tex("nan.exr"),
        tex("neg.exr"),
        tex("missing.exr"),
        tex("empty.png"),
        env("a.png"),
        env("cut.exr"),
        env("nan.exr"),
        env("neg.exr"),
        env("missing.exr"),
        aov("depth"),
        aov("d:deepth"),
        aov("d:depth,d:uv"),
        aov(":depth"),
        aov("d:dp_du"),
        aov("spp:depth"),
        aov("stderr:depth"),
        aov("d:"),
        aov(","),
        aov(""),
        aov("a.b:uv"),
        format!(
            "{s}\n<integrator type='aov'><string name='aovs' value='a:uv'/>\n<integrator type='path'/>\n<integrator type='path'/></integrator>"
        ),
        format!(
            "{s}\n<integrator type='direct'><integer name='shading_samples' value='0'/></integrator>"
        ),
        format!(
            "{s}\n<integrator type='direct'><integer name='shading_samples' value='100000'/></integrator>"
        ),
        format!("{s}\n<integrator type='path'><float name='timeout' value='3'/></integrator>"),
    ] {
        let xml = format!("<scene version='3.0.0'>\n{body}\n</scene>");
        println!(
            "=== {body}\n{}",
            compiled(&dir, &xml, &Default::default()).replace(dir.to_str().unwrap(), "DIR")
        );
    }
    let d = format::Overrides::default;
    for o in [
        format::Overrides {
            integrator: Some("pahth".into()),
            ..d()
        },
        format::Overrides {
            sampler: Some("halton".into()),
            ..d()
        },
        format::Overrides {
            aovs: vec!["albdo".into()],
            ..d()
        },
        format::Overrides {
            aovs: vec!["uv".into(), "uv".into()],
            ..d()
        },
        format::Overrides {
            integrator: Some("direct".into()),
            max_depth: Some(3),
            ..d()
        },
        format::Overrides {
            resolution: Some([1_000_000, 1_000_000]),
            ..d()
        },
        format::Overrides {
            resolution: Some([0, 10]),
            ..d()
        },
        format::Overrides {
            crop: Some(luxel::film::Window {
                x: 760,
                y: 0,
                width: 20,
                height: 20,
            }),
            ..d()
        },
    ] {
        println!(
            "=== {o:?}\n{}",
            compiled(&dir, &format!("<scene version='3.0.0'>{s}</scene>"), &o)
        );
    }
    println!(
        "{}",
        compiled(
            &dir,
            &format!(
                "<scene version='3.0.0'>{}</scene>",
                film("<integer name='crop_width' value='10'/>")
            ),
            &format::Overrides {
                resolution: Some([10, 10]),
                ..d()
            }
        )
    );
}
