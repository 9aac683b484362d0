//! Values of parameters.

use super::*;

#[test]
fn wrong_types_and_ranges() {
    says(
        in_sphere("<string name='radius' value='big'/>"),
        r#"
a.xml:3:23: "radius" of shape "sphere" must be a number above 0, not a string
  <string name='radius' value='big'/>
                        ^
  help: write <float name="radius" .../>"#,
    );
    says(
        in_sphere("<float name='radius' value='-1'/>"),
        r#"
a.xml:3:22: "radius" must be a number above 0, not -1
  <float name='radius' value='-1'/>
                       ^"#,
    );
    says(
        in_sphere("<float name='center' value='0'/>"),
        r#"
a.xml:3:22: "center" of shape "sphere" must be a point, not a float
  <float name='center' value='0'/>
                       ^
  help: write <point name="center" .../>"#,
    );
    says(
        in_sphere("<texture name='radius' type='checkerboard'/>"),
        r#"
a.xml:3:10: "radius" of shape "sphere" cannot be a texture
  <texture name='radius' type='checkerboard'/>
           ^"#,
    );
    says(
        in_sphere("<texture type='checkerboard'/>"),
        r#"
a.xml:3:10: a <texture> has no place in shape "sphere"
  <texture type='checkerboard'/>
           ^"#,
    );
    says(
        inside("<film type='hdrfilm'><integer name='width' value='9999999'/></film>"),
        r#"
a.xml:2:44: "width" must be an integer from 1 to 65536, not 9999999
  <film type='hdrfilm'><integer name='width' value='9999999'/></film>
                                             ^"#,
    );
    says(
        inside("<film type='hdrfilm'><string name='pixel_format' value='rbg'/></film>"),
        r#"
a.xml:2:50: "pixel_format" must be one of "luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza", not "rbg"
  <film type='hdrfilm'><string name='pixel_format' value='rbg'/></film>
                                                   ^
  help: did you mean "rgb"?"#,
    );
    says(
        inside("<integrator type='path'><float name='max_depth' value='3'/></integrator>"),
        r#"
a.xml:2:49: "max_depth" of integrator "path" must be an integer of at least -1, not a float
  <integrator type='path'><float name='max_depth' value='3'/></integrator>
                                                  ^
  help: write <integer name="max_depth" .../>"#,
    );
    says(
        inside("<bsdf type='diffuse'><rgb name='reflectance' value='1.5, 0, 0'/></bsdf>"),
        r#"
a.xml:2:46: "reflectance" must be from 0 to 1 in each channel, not 1.5, 0, 0
  <bsdf type='diffuse'><rgb name='reflectance' value='1.5, 0, 0'/></bsdf>
                                               ^"#,
    );
    says(
        inside("<bsdf type='roughconductor'><string name='alpha' value='rough'/></bsdf>"),
        r#"
a.xml:2:50: "alpha" of bsdf "roughconductor" must be a number of at least 0, or a texture, not a string
  <bsdf type='roughconductor'><string name='alpha' value='rough'/></bsdf>
                                                   ^
  help: write <float name="alpha" .../>"#,
    );
    says(
        inside("<emitter type='area'><spectrum name='radiance' value='400:1, 500:-2'/></emitter>"),
        r#"
a.xml:2:48: "radiance" must be at least 0 in each channel, not -2 at 500 nm
  <emitter type='area'><spectrum name='radiance' value='400:1, 500:-2'/></emitter>
                                                 ^"#,
    );
    says(
        inside("<bsdf type='dielectric'><string name='int_ior' value='diamonds'/></bsdf>"),
        r#"
a.xml:2:48: unknown medium "diamonds"
  <bsdf type='dielectric'><string name='int_ior' value='diamonds'/></bsdf>
                                                 ^
  help: did you mean "diamond"?"#,
    );
    says(
        inside("<bsdf type='dielectric'><integer name='int_ior' value='2'/></bsdf>"),
        r#"
a.xml:2:49: "int_ior" of bsdf "dielectric" must be an index of refraction or the name of a medium, not an integer
  <bsdf type='dielectric'><integer name='int_ior' value='2'/></bsdf>
                                                  ^
  help: write <float name="int_ior" .../>"#,
    );
    says(
        inside("<bsdf type='dielectric'><float name='int_ior' value='0'/></bsdf>"),
        r#"
a.xml:2:47: "int_ior" must be a number above 0, not 0
  <bsdf type='dielectric'><float name='int_ior' value='0'/></bsdf>
                                                ^"#,
    );
}

#[test]
fn bad_numbers() {
    says(
        in_sphere("<float name='radius' value='1a'/>"),
        r#"
a.xml:3:22: "1a" is not a number
  <float name='radius' value='1a'/>
                       ^"#,
    );
    says(
        in_sphere("<float name='radius' value=''/>"),
        r#"
a.xml:3:22: "" is not a number
  <float name='radius' value=''/>
                       ^"#,
    );
    says(
        in_sphere("<float name='radius' value='nan'/>"),
        r#"
a.xml:3:22: "nan" is not a finite number
  <float name='radius' value='nan'/>
                       ^"#,
    );
    says(
        in_sphere("<float name='radius' value='1e39'/>"),
        r#"
a.xml:3:22: "1e39" is too large: numbers reach to 3.4e38
  <float name='radius' value='1e39'/>
                       ^"#,
    );
    says(
        in_sphere("<float name='radius' value='1e999'/>"),
        r#"
a.xml:3:22: "1e999" is not a finite number
  <float name='radius' value='1e999'/>
                       ^"#,
    );
    says(
        in_sphere("<integer name='radius' value='1.5'/>"),
        r#"
a.xml:3:24: "1.5" is not an integer
  <integer name='radius' value='1.5'/>
                         ^"#,
    );
    says(
        in_sphere("<integer name='radius' value='99999999999999999999'/>"),
        r#"
a.xml:3:24: "99999999999999999999" is too large an integer
  <integer name='radius' value='99999999999999999999'/>
                         ^"#,
    );
    says(
        in_sphere("<boolean name='flip_normals' value='yes'/>"),
        r#"
a.xml:3:30: "yes" is neither "true" nor "false"
  <boolean name='flip_normals' value='yes'/>
                               ^"#,
    );
    says(
        in_sphere("<rgb name='radius' value='1, 2'/>"),
        r#"
a.xml:3:20: expected 1 or 3 numbers, found 2
  <rgb name='radius' value='1, 2'/>
                     ^"#,
    );
    says(
        in_sphere("<rgb name='radius' value='#ff0000'/>"),
        r##"
a.xml:3:20: the hexadecimal colour "#ff0000" is not supported
  <rgb name='radius' value='#ff0000'/>
                     ^
  help: write the linear colour: value="1.000000, 0.000000, 0.000000""##,
    );
    says(
        in_sphere("<spectrum name='radius' value='400:1, 500'/>"),
        r#"
a.xml:3:25: "500" is not wavelength:value
  <spectrum name='radius' value='400:1, 500'/>
                          ^"#,
    );
    says(
        in_sphere("<spectrum name='radius' value='1, 2, 3'/>"),
        r#"
a.xml:3:25: "1, 2, 3" is not a spectrum
  <spectrum name='radius' value='1, 2, 3'/>
                          ^
  help: write one number, or pairs such as "400:0.1, 700:0.5"; for RGB use <rgb>"#,
    );
    says(
        in_sphere("<spectrum name='radius' value='500:1, 400:1'/>"),
        r#"
a.xml:3:25: wavelengths must increase, but 400 follows 500
  <spectrum name='radius' value='500:1, 400:1'/>
                          ^"#,
    );
    says(
        in_sphere("<point name='center' x='1' y='2'/>"),
        r#"
a.xml:3:1: <point> has no attribute "z"
  <point name='center' x='1' y='2'/>
  ^"#,
    );
    says(
        in_sphere("<point name='center' x='1' value='2'/>"),
        r#"
a.xml:3:22: "value" cannot stand beside "x", "y", "z"
  <point name='center' x='1' value='2'/>
                       ^"#,
    );
    says(
        in_sphere("<float name='radius'/>"),
        r#"
a.xml:3:1: <float> has no attribute "value"
  <float name='radius'/>
  ^"#,
    );
    says(
        in_sphere("<float value='1'/>"),
        r#"
a.xml:3:1: <float> has no attribute "name"
  <float value='1'/>
  ^"#,
    );
    says(
        in_sphere("<float name='radius' value='1'><integer name='a' value='1'/></float>"),
        r#"
a.xml:3:32: <integer> cannot stand inside <float>
  <float name='radius' value='1'><integer name='a' value='1'/></float>
                                 ^"#,
    );
}

#[test]
fn bad_transforms() {
    says(
        step("<scale x='0'/>"),
        r#"
a.xml:4:8: scaling by (0, 1, 1) cannot be undone
  <scale x='0'/>
         ^"#,
    );
    says(
        step("<rotate angle='3'/>"),
        r#"
a.xml:4:1: the axis of rotation is zero
  <rotate angle='3'/>
  ^"#,
    );
    says(
        step("<rotate x='1'/>"),
        r#"
a.xml:4:1: <rotate> has no attribute "angle"
  <rotate x='1'/>
  ^"#,
    );
    says(
        step("<lookat origin='1,2,3' target='1,2,3'/>"),
        r#"
a.xml:4:1: origin and target are the same point
  <lookat origin='1,2,3' target='1,2,3'/>
  ^"#,
    );
    says(
        step("<lookat origin='0,0,3' target='0,0,0' up='0,0,1'/>"),
        r#"
a.xml:4:1: "up" is parallel to the direction of view
  <lookat origin='0,0,3' target='0,0,0' up='0,0,1'/>
  ^"#,
    );
    says(
        step("<matrix value='1 2 3 4 5 6 7 8 9'/>"),
        r#"
a.xml:4:9: the matrix is singular
  <matrix value='1 2 3 4 5 6 7 8 9'/>
          ^"#,
    );
    says(
        step("<matrix value='1 2 3'/>"),
        r#"
a.xml:4:9: a matrix has 9 or 16 numbers, found 3
  <matrix value='1 2 3'/>
          ^"#,
    );
    says(
        step("<matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1'/>"),
        r#"
a.xml:4:9: the last row of the matrix is not 0 0 0 1
  <matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1'/>
          ^"#,
    );
    says(
        step("<lookAt origin='0,0,3' target='0,0,0'/>"),
        r#"
a.xml:4:1: unknown element <lookAt> in <transform>
  <lookAt origin='0,0,3' target='0,0,0'/>
  ^
  help: did you mean "lookat"?"#,
    );
    says(
        step("<float name='a' value='1'/>"),
        r#"
a.xml:4:1: unknown element <float> in <transform>
  <float name='a' value='1'/>
  ^
  help: a transform is made of "translate", "scale", "rotate", "lookat" and "matrix""#,
    );
    says(
        step(&"<scale value='1e38'/>\n".repeat(9)),
        r#"
a.xml:8:1: the transform up to here is singular or overflows
  <scale value='1e38'/>
  ^"#,
    );
}

#[test]
fn parameters_that_clash_or_are_missing() {
    says(
        in_sphere("<float name='radius' value='1'/><float name='radius' value='2'/>"),
        r#"
a.xml:3:40: "radius" is given twice; the first is at a.xml:3:8
  <float name='radius' value='1'/><float name='radius' value='2'/>
                                         ^"#,
    );
    says(
        inside(
            "<bsdf type='diffuse'><rgb name='reflectance' value='1'/>\n<texture type='checkerboard' name='reflectance'/></bsdf>",
        ),
        r#"
a.xml:3:30: "reflectance" is given twice; the first is at a.xml:2:27
  <texture type='checkerboard' name='reflectance'/></bsdf>
                               ^"#,
    );
    says(
        inside(
            "<sensor type='perspective'><float name='fov' value='40'/>\n<string name='focal_length' value='50mm'/></sensor>",
        ),
        r#"
a.xml:3:9: sensor "perspective" takes either "fov" or "focal_length", not both; "fov" is at a.xml:2:35
  <string name='focal_length' value='50mm'/></sensor>
          ^"#,
    );
    says(
        inside(
            "<bsdf type='roughconductor'><float name='alpha_u' value='1'/>\n<texture name='alpha' type='checkerboard'/></bsdf>",
        ),
        r#"
a.xml:3:10: bsdf "roughconductor" takes either "alpha_u" or "alpha", not both; "alpha_u" is at a.xml:2:36
  <texture name='alpha' type='checkerboard'/></bsdf>
           ^"#,
    );
    says(
        inside("<shape type='ply'/>"),
        r#"
a.xml:2:8: shape "ply" needs the parameter "filename"
  <shape type='ply'/>
         ^
  help: add <string name="filename" .../>: The PLY file, ASCII or binary."#,
    );
}
