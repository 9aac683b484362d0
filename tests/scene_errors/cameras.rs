//! Sensors, and what moves.

use super::*;

fn building(body: &str) -> String {
    building_in(Path::new("nowhere"), body, &Overrides::default())
}

/// The error of building a sensor whose content begins on line 3.
fn sensor(kind: &str, content: &str) -> String {
    building(&format!("<sensor type='{kind}'>\n{content}</sensor>"))
}

/// The error of what stands inside an animation, which begins on line 3.
fn animation(keys: &str) -> String {
    inside(&format!(
        "<sensor type='perspective'><animation name='to_world'>\n{keys}\n</animation></sensor>"
    ))
}

const ONE_PIXEL: &str = "<film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film>";

#[test]
fn keyframes() {
    says(
        animation(""),
        r#"
a.xml:2:28: an <animation> needs at least one <transform time="...">
  <sensor type='perspective'><animation name='to_world'>
                             ^"#,
    );
    says(
        animation("<transform><scale value='2'/></transform>"),
        r#"
a.xml:3:1: <transform> has no attribute "time"
  <transform><scale value='2'/></transform>
  ^"#,
    );
    says(
        animation("<transform time='1'/>\n<transform time='1'/>"),
        r#"
a.xml:4:12: times must increase, but 1 follows 1
  <transform time='1'/>
             ^"#,
    );
    says(
        animation("<transform time='1'/>\n<transform time='0.5'/>"),
        r#"
a.xml:4:12: times must increase, but 0.5 follows 1
  <transform time='0.5'/>
             ^"#,
    );
    says(
        animation("<transform time='soon'/>"),
        r#"
a.xml:3:12: "soon" is not a number
  <transform time='soon'/>
             ^"#,
    );
    says(
        animation("<transform time='1' name='to_world'/>"),
        r#"
a.xml:3:21: unknown attribute "name" of <transform>
  <transform time='1' name='to_world'/>
                      ^
  help: did you mean "time"?"#,
    );
    says(
        animation("<translate x='1'/>"),
        r#"
a.xml:3:1: unknown element <translate> in <animation>
  <translate x='1'/>
  ^
  help: an animation is made of <transform time="...">"#,
    );
    says(
        animation("one"),
        r#"
a.xml:3:1: text outside of tags: "one"
  one
  ^"#,
    );
    says(
        inside("<animation name='to_world'><transform time='0'/></animation>"),
        r#"
a.xml:2:12: a <scene> has no parameters, found "to_world"
  <animation name='to_world'><transform time='0'/></animation>
             ^"#,
    );
    says(
        in_sphere("<transform name='to_world' time='0'/>"),
        r#"
a.xml:3:28: unknown attribute "time" of <transform>
  <transform name='to_world' time='0'/>
                             ^
  help: did you mean "name"?"#,
    );
    says(
        in_sphere("<animation name='radius'><transform time='0'/></animation>"),
        r#"
a.xml:3:1: "radius" of shape "sphere" must be a number above 0, not an animation
  <animation name='radius'><transform time='0'/></animation>
  ^
  help: write <float name="radius" .../>"#,
    );
    says(
        inside(
            "<texture type='checkerboard'>\n<animation name='to_uv'><transform time='0'/></animation></texture>",
        ),
        r#"
a.xml:3:1: "to_uv" of texture "checkerboard" cannot move
  <animation name='to_uv'><transform time='0'/></animation></texture>
  ^
  help: write <transform name="to_uv">"#,
    );
    says(
        sensor(
            "orthographic",
            "<float name='shutter_close' value='1'/>\n<animation name='to_world'><transform time='0'/><transform time='2'><scale x='-1'/></transform></animation>",
        ),
        r#"
a.xml:4:1: the animation goes through a transform that is singular
  <animation name='to_world'><transform time='0'/><transform time='2'><scale x='-1'/></transform></animation></sensor>
  ^
  help: mirror all of its transforms or none, and flatten none of them"#,
    );
}

#[test]
fn lenses() {
    says(
        sensor("thinlens", ""),
        r#"
a.xml:2:9: sensor "thinlens" needs the parameter "aperture_radius"
  <sensor type='thinlens'>
          ^
  help: add <float name="aperture_radius" .../>: Radius of the lens in scene units; 0 makes a pinhole."#,
    );
    says(
        sensor("thinlens", "<float name='aperture_radius' value='-1'/>"),
        r#"
a.xml:3:31: "aperture_radius" must be a number of at least 0, not -1
  <float name='aperture_radius' value='-1'/></sensor>
                                ^"#,
    );
    says(
        sensor(
            "thinlens",
            "<float name='aperture_radius' value='1'/><integer name='aperture_blades' value='2'/>",
        ),
        r#"
a.xml:3:74: "aperture_blades" must be an integer from 3 to 1024, not 2
  <float name='aperture_radius' value='1'/><integer name='aperture_blades' value='2'/></sensor>
                                                                           ^"#,
    );
    says(
        sensor(
            "thinlens",
            "<float name='aperture_radius' value='1'/><float name='blade_rotation' value='9'/>",
        ),
        r#"
a.xml:3:71: blade_rotation has no effect on a round lens
  <float name='aperture_radius' value='1'/><float name='blade_rotation' value='9'/></sensor>
                                                                        ^
  help: add <integer name="aperture_blades" .../>"#,
    );
    says(
        sensor(
            "thinlens",
            "<float name='aperture_radius' value='10'/><float name='focus_distance' value='1e-6'/>",
        ),
        r#"
a.xml:3:31: an aperture of radius 10 is too wide for focus at 0.000001
  <float name='aperture_radius' value='10'/><float name='focus_distance' value='1e-6'/></sensor>
                                ^"#,
    );
    says(
        sensor(
            "perspective",
            "<float name='near_clip' value='1e20'/><float name='far_clip' value='1e30'/>",
        ),
        r#"
a.xml:3:25: a corner of the near plane lies more than 1e15 from the origin, too far to be rendered
  <float name='near_clip' value='1e20'/><float name='far_clip' value='1e30'/></sensor>
                          ^"#,
    );
    says(
        sensor("orthographic", "<float name='fov' value='30'/>"),
        r#"
a.xml:3:8: unknown parameter "fov" of sensor "orthographic"
  <float name='fov' value='30'/></sensor>
         ^
  help: known are "near_clip", "far_clip", "focus_distance", "shutter_open", "shutter_close" and "to_world""#,
    );
    says(
        sensor(
            "orthographic",
            "<transform name='to_world'><scale value='1e20'/></transform>",
        ),
        r#"
a.xml:3:1: the camera lies more than 1e15 from the origin, too far to be rendered
  <transform name='to_world'><scale value='1e20'/></transform></sensor>
  ^"#,
    );
    says(
        sensor(
            "thinlens",
            "<float name='aperture_radius' value='1'/>\n<animation name='to_world'><transform time='0'/><transform time='1'><scale value='2'/></transform></animation>",
        ),
        r#"
a.xml:4:1: the transform of a camera must not scale
  <animation name='to_world'><transform time='0'/><transform time='1'><scale value='2'/></transform></animation></sensor>
  ^
  help: leave <scale> out: fov says how much the camera sees"#,
    );
}

#[test]
fn meters() {
    says(
        sensor("radiancemeter", ""),
        r#"
a.xml:2:9: sensor "radiancemeter" measures one number: its film must have 1 x 1 pixels, not 768 x 576
  <sensor type='radiancemeter'>
          ^
  help: give it a <film type="hdrfilm"> of width and height 1"#,
    );
    says(
        sensor(
            "radiancemeter",
            &format!("<point name='origin' x='0' y='0' z='0'/>{ONE_PIXEL}"),
        ),
        r#"
a.xml:3:22: "origin" of sensor "radiancemeter" needs "direction" too
  <point name='origin' x='0' y='0' z='0'/><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
                       ^"#,
    );
    says(
        sensor(
            "radiancemeter",
            &format!("<vector name='direction' x='0' y='0' z='1'/>{ONE_PIXEL}"),
        ),
        r#"
a.xml:3:26: "direction" of sensor "radiancemeter" needs "origin" too
  <vector name='direction' x='0' y='0' z='1'/><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
                           ^"#,
    );
    says(
        sensor(
            "radiancemeter",
            "<point name='origin' x='0' y='0' z='0'/><vector name='direction' x='0' y='0' z='1'/>\n<transform name='to_world'/>",
        ),
        r#"
a.xml:4:12: sensor "radiancemeter" takes either "origin" or "to_world", not both; "origin" is at a.xml:3:8
  <transform name='to_world'/></sensor>
             ^"#,
    );
    says(
        sensor(
            "distant",
            &format!("<vector name='direction' x='0' y='0' z='0'/>{ONE_PIXEL}"),
        ),
        r#"
a.xml:3:26: the direction is zero
  <vector name='direction' x='0' y='0' z='0'/><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
                           ^"#,
    );
    says(
        sensor("distant", &format!("<shape type='disk'/>{ONE_PIXEL}")),
        r#"
a.xml:3:8: the shape in a distant sensor is its target, but not named so
  <shape type='disk'/><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
         ^
  help: write <shape name="target" ...>"#,
    );
    says(
        sensor(
            "distant",
            &format!(
                "<point name='target' x='0' y='0' z='0'/>\n<shape type='disk' name='target'/>{ONE_PIXEL}"
            ),
        ),
        r#"
a.xml:4:8: the sensor has a target already, which is a point
  <shape type='disk' name='target'/><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
         ^"#,
    );
    says(
        sensor(
            "distant",
            &format!(
                "<shape type='disk' name='target'>\n<bsdf type='diffuse'/></shape>{ONE_PIXEL}"
            ),
        ),
        r#"
a.xml:4:7: bsdf "diffuse" in shape "disk" has no effect here
  <bsdf type='diffuse'/></shape><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
        ^"#,
    );
    says(
        sensor(
            "distant",
            &format!("<point name='target' x='1e30' y='0' z='0'/>{ONE_PIXEL}"),
        ),
        r#"
a.xml:3:22: the target lies more than 1e15 from the origin, too far to be rendered
  <point name='target' x='1e30' y='0' z='0'/><film type='hdrfilm'><integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>
                       ^"#,
    );
    says(
        sensor("irradiancemeter", ONE_PIXEL),
        r#"
a.xml:2:9: an irradiance meter measures the shape that it stands in, but it stands in none
  <sensor type='irradiancemeter'>
          ^
  help: put it inside a <shape>"#,
    );
    says(
        building("<shape type='disk'>\n<sensor type='irradiancemeter'/></shape>"),
        r#"
a.xml:3:9: sensor "irradiancemeter" measures one number: its film must have 1 x 1 pixels, not 768 x 576
  <sensor type='irradiancemeter'/></shape>
          ^
  help: give it a <film type="hdrfilm"> of width and height 1"#,
    );
    says(
        building("<shape type='disk'>\n<sensor type='perspective'/></shape>"),
        r#"
a.xml:3:9: only an irradiance meter can stand inside a shape
  <sensor type='perspective'/></shape>
          ^
  help: put the sensor beside the shape"#,
    );
    says(
        inside("<sensor type='batch'/>"),
        r#"
a.xml:2:9: sensor "batch" is not supported
  <sensor type='batch'/>
          ^
  help: use one of the sensors "perspective", "thinlens" and "orthographic""#,
    );
    says(
        inside("<sensor type='fluencemeter'/>"),
        r#"
a.xml:2:9: sensor "fluencemeter" is not supported
  <sensor type='fluencemeter'/>
          ^
  help: use the sensor "irradiancemeter" inside a shape"#,
    );
}
