//! What is found wrong only when the scene is built: values that contradict each other or cannot be rendered.

use super::*;

fn building(body: &str) -> String {
    building_in(Path::new("nowhere"), body, &Overrides::default())
}

#[test]
fn film_and_camera() {
    says(
        building(""),
        r#"
a.xml:1:1: the scene has no sensor
  <scene version='3.0.0'>
  ^
  help: add <sensor type="perspective"> to say where to look from"#,
    );
    says(
        building(
            "<sensor type='perspective'><film type='hdrfilm'>\n<integer name='crop_offset_x' value='700'/><integer name='crop_width' value='100'/></film></sensor>",
        ),
        r#"
a.xml:2:34: the crop window of 100 x 576 pixels at (700, 0) does not lie within the picture of 768 x 576
  <sensor type='perspective'><film type='hdrfilm'>
                                   ^"#,
    );
    says(
        building(
            "<sensor type='perspective'><film type='hdrfilm'>\n<integer name='width' value='65536'/><integer name='height' value='65536'/></film></sensor>",
        ),
        r#"
a.xml:2:34: 4294967296 pixels are more than a picture can have (268435456)
  <sensor type='perspective'><film type='hdrfilm'>
                                   ^"#,
    );
    says(
        building(
            "<sensor type='perspective'><film type='hdrfilm'>\n<string name='component_format' value='uint32'/></film></sensor>",
        ),
        r#"
a.xml:3:33: component_format "uint32" is not supported
  <string name='component_format' value='uint32'/></film></sensor>
                                  ^
  help: use "float32" or "float16""#,
    );
    says(
        building(
            "<sensor type='perspective'>\n<float name='near_clip' value='2'/><float name='far_clip' value='1'/></sensor>",
        ),
        r#"
a.xml:3:25: near_clip 2 is not below far_clip 1
  <float name='near_clip' value='2'/><float name='far_clip' value='1'/></sensor>
                          ^"#,
    );
    says(
        building(
            "<sensor type='perspective'>\n<float name='shutter_open' value='2'/><float name='shutter_close' value='1'/></sensor>",
        ),
        r#"
a.xml:3:28: the shutter closes before it opens
  <float name='shutter_open' value='2'/><float name='shutter_close' value='1'/></sensor>
                             ^"#,
    );
    says(
        building("<sensor type='perspective'>\n<string name='focal_length' value='0mm'/></sensor>"),
        r#"
a.xml:3:29: "0mm" is no focal length
  <string name='focal_length' value='0mm'/></sensor>
                              ^
  help: write millimetres, such as 50mm"#,
    );
    says(
        building(
            "<sensor type='perspective'>\n<transform name='to_world'><scale value='2'/></transform></sensor>",
        ),
        r#"
a.xml:3:1: the transform of a camera must not scale
  <transform name='to_world'><scale value='2'/></transform></sensor>
  ^
  help: leave <scale> out: fov says how much the camera sees"#,
    );
    says(
        building(
            "<sensor type='perspective'>\n<transform name='to_world'><translate x='1e30'/></transform></sensor>",
        ),
        r#"
a.xml:3:1: the camera lies more than 1e15 from the origin, too far to be rendered
  <transform name='to_world'><translate x='1e30'/></transform></sensor>
  ^"#,
    );
}

#[test]
fn shapes() {
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><transform name='to_world'><scale x='2'/></transform></shape>",
        ),
        r#"
a.xml:3:22: the transform makes the sphere an ellipsoid, which is not supported
  <shape type='sphere'><transform name='to_world'><scale x='2'/></transform></shape>
                       ^
  help: use a uniform scale, or a mesh of the shape"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><transform name='to_world'><translate x='1e30'/></transform></shape>",
        ),
        r#"
a.xml:3:22: a part of the shape lies more than 1e15 from the origin, too far to be rendered
  <shape type='sphere'><transform name='to_world'><translate x='1e30'/></transform></shape>
                       ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='cylinder'><transform name='to_world'><scale x='2'/></transform><emitter type='area'/></shape>",
        ),
        r#"
a.xml:3:24: the transform makes the cylinder elliptic or oblique, which is not supported of an emitter
  <shape type='cylinder'><transform name='to_world'><scale x='2'/></transform><emitter type='area'/></shape>
                         ^
  help: use a uniform scale, or a mesh of the shape"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='cylinder'><point name='p1' x='0' y='0' z='0'/></shape>",
        ),
        r#"
a.xml:3:41: p0 and p1 are the same point, which gives the cylinder no axis
  <shape type='cylinder'><point name='p1' x='0' y='0' z='0'/></shape>
                                          ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='cylinder'><float name='radius' value='1e-300'/></shape>",
        ),
        r#"
a.xml:3:45: the radius is too small for the length
  <shape type='cylinder'><float name='radius' value='1e-300'/></shape>
                                              ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><float name='radius' value='1e-300'/></shape>",
        ),
        r#"
a.xml:3:43: the radius is too small or too large
  <shape type='sphere'><float name='radius' value='1e-300'/></shape>
                                            ^"#,
    );
}

#[test]
fn materials() {
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='conductor'><string name='material' value='Agg'/></bsdf></shape>",
        ),
        r#"
a.xml:3:69: no metal "Agg" is known
  <shape type='sphere'><bsdf type='conductor'><string name='material' value='Agg'/></bsdf></shape>
                                                                      ^
  help: did you mean "Ag"?"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='roughconductor'><float name='alpha_u' value='0.1'/></bsdf></shape>",
        ),
        r#"
a.xml:3:28: alpha_u and alpha_v come together
  <shape type='sphere'><bsdf type='roughconductor'><float name='alpha_u' value='0.1'/></bsdf></shape>
                             ^
  help: give both, or alpha alone"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='twosided'><bsdf type='dielectric'/></bsdf></shape>",
        ),
        r#"
a.xml:3:50: "dielectric" already has two sides
  <shape type='sphere'><bsdf type='twosided'><bsdf type='dielectric'/></bsdf></shape>
                                                   ^
  help: use it without "twosided" around it"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='twosided'><bsdf type='principledthin'/></bsdf></shape>",
        ),
        r#"
a.xml:3:50: "principledthin" already has two sides
  <shape type='sphere'><bsdf type='twosided'><bsdf type='principledthin'/></bsdf></shape>
                                                   ^
  help: use it without "twosided" around it"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='twosided'><bsdf type='principled'><float name='spec_trans' value='0.1'/></bsdf></bsdf></shape>",
        ),
        r#"
a.xml:3:93: what light goes through already has two sides
  <shape type='sphere'><bsdf type='twosided'><bsdf type='principled'><float name='spec_trans' value='0.1'/></bsdf></bsdf></shape>
                                                                                              ^
  help: leave out spec_trans, or "twosided" around the material"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='principled'><float name='eta' value='1.5'/><float name='specular' value='0.5'/></bsdf></shape>",
        ),
        r#"
a.xml:3:84: bsdf "principled" takes either "eta" or "specular", not both; "eta" is at a.xml:3:53
  <shape type='sphere'><bsdf type='principled'><float name='eta' value='1.5'/><float name='specular' value='0.5'/></bsdf></shape>
                                                                                     ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='principled'><float name='specular' value='12.5'/></bsdf></shape>",
        ),
        r#"
a.xml:3:69: "specular" must be a number from 0 to 12, not 12.5
  <shape type='sphere'><bsdf type='principled'><float name='specular' value='12.5'/></bsdf></shape>
                                                                      ^"#,
    );
}

#[test]
fn glass_and_plastic() {
    for plugin in ["thindielectric", "roughdielectric", "null"] {
        let body = format!(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='twosided'><bsdf type='{plugin}'/></bsdf></shape>"
        );
        says(
            building(&body),
            &format!(
                r#"
a.xml:3:50: "{plugin}" already has two sides
  <shape type='sphere'><bsdf type='twosided'><bsdf type='{plugin}'/></bsdf></shape>
                                                   ^
  help: use it without "twosided" around it"#
            ),
        );
    }
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='roughdielectric'><float name='alpha_v' value='0.1'/></bsdf></shape>",
        ),
        r#"
a.xml:3:28: alpha_u and alpha_v come together
  <shape type='sphere'><bsdf type='roughdielectric'><float name='alpha_v' value='0.1'/></bsdf></shape>
                             ^
  help: give both, or alpha alone"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='roughplastic'><texture name='alpha' type='checkerboard'/></bsdf></shape>",
        ),
        r#"
a.xml:3:57: "alpha" of bsdf "roughplastic" cannot be a texture
  <shape type='sphere'><bsdf type='roughplastic'><texture name='alpha' type='checkerboard'/></bsdf></shape>
                                                          ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><bsdf type='null'><rgb name='transmittance' value='1'/></bsdf></shape>",
        ),
        r#"
a.xml:3:45: unknown parameter "transmittance" of bsdf "null"
  <shape type='sphere'><bsdf type='null'><rgb name='transmittance' value='1'/></bsdf></shape>
                                              ^
  help: bsdf "null" has no parameters"#,
    );
}

#[test]
fn emitters() {
    says(
        building(
            "<sensor type='perspective'/>\n<emitter type='constant'/>\n<emitter type='constant'/>",
        ),
        r#"
a.xml:4:10: a second environment: the first is at a.xml:3:10
  <emitter type='constant'/>
           ^
  help: a scene has one environment at most"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<shape type='sphere'><emitter type='constant'/></shape>",
        ),
        r#"
a.xml:3:31: a shape cannot be an emitter of type "constant"
  <shape type='sphere'><emitter type='constant'/></shape>
                                ^
  help: use "area", or put the emitter beside the shape"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<emitter type='point'><point name='position' x='1e30' y='0' z='0'/></emitter>",
        ),
        r#"
a.xml:3:46: the emitter lies more than 1e15 from the origin, too far to be rendered
  <emitter type='point'><point name='position' x='1e30' y='0' z='0'/></emitter>
                                               ^"#,
    );
}

#[test]
fn integrators() {
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value='depth'/></integrator>",
        ),
        r#"
a.xml:3:44: expected name:type, found "depth"
  <integrator type='aov'><string name='aovs' value='depth'/></integrator>
                                             ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value='d:deepth'/></integrator>",
        ),
        r#"
a.xml:3:44: unknown type "deepth" of output variable "d"
  <integrator type='aov'><string name='aovs' value='d:deepth'/></integrator>
                                             ^
  help: did you mean "depth"?"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value='d:dp_du'/></integrator>",
        ),
        r#"
a.xml:3:44: output variable "dp_du" is not supported
  <integrator type='aov'><string name='aovs' value='d:dp_du'/></integrator>
                                             ^
  help: there are "albedo", "sh_normal", "geo_normal", "depth", "position", "uv", "shape_index" and "prim_index""#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value='d:depth, d:uv'/></integrator>",
        ),
        r#"
a.xml:3:44: two layers would have the name "d"
  <integrator type='aov'><string name='aovs' value='d:depth, d:uv'/></integrator>
                                             ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value=':depth'/></integrator>",
        ),
        r#"
a.xml:3:44: an output variable has no name
  <integrator type='aov'><string name='aovs' value=':depth'/></integrator>
                                             ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value='spp:depth'/></integrator>",
        ),
        r#"
a.xml:3:44: "spp" is the name of a layer that every picture has
  <integrator type='aov'><string name='aovs' value='spp:depth'/></integrator>
                                             ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='aov'><string name='aovs' value='a:uv'/>\n<integrator type='path'/>\n<integrator type='path'/></integrator>",
        ),
        r#"
a.xml:5:13: several integrators inside "aov" are not supported
  <integrator type='path'/></integrator>
              ^
  help: keep one of them"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='direct'><integer name='shading_samples' value='0'/></integrator>",
        ),
        r#"
a.xml:3:13: neither the emitters nor the BSDF would be sampled
  <integrator type='direct'><integer name='shading_samples' value='0'/></integrator>
              ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='direct'><integer name='shading_samples' value='100000'/></integrator>",
        ),
        r#"
a.xml:3:13: more than 65536 samples per hit are not supported
  <integrator type='direct'><integer name='shading_samples' value='100000'/></integrator>
              ^"#,
    );
    says(
        building(
            "<sensor type='perspective'/>\n<integrator type='path'><float name='timeout' value='3'/></integrator>",
        ),
        r#"
a.xml:3:47: a timeout in the scene is not supported
  <integrator type='path'><float name='timeout' value='3'/></integrator>
                                                ^
  help: use --time to limit the time"#,
    );
}
