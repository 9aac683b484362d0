//! Emitters and spectra.

use super::{Overrides, building_in, says};

fn building(body: &str) -> String {
    let body = format!("<sensor type='perspective'/>\n{body}");
    building_in("nowhere".as_ref(), &body, &Overrides::default())
}

#[test]
fn spots() {
    says(
        building("<emitter type='spot'><rgb name='texture' value='0.5'/></emitter>"),
        r#"
a.xml:3:42: the texture of a spot light is a single colour
  <emitter type='spot'><rgb name='texture' value='0.5'/></emitter>
                                           ^
  help: multiply the intensity by it instead"#,
    );
    says(
        building(
            "<emitter type='spot'><float name='cutoff_angle' value='95'/><texture type='checkerboard' name='texture'/></emitter>",
        ),
        r#"
a.xml:3:49: a spot light with a texture cannot reach 90 degrees from its axis
  <emitter type='spot'><float name='cutoff_angle' value='95'/><texture type='checkerboard' name='texture'/></emitter>
                                                  ^"#,
    );
    says(
        building("<emitter type='spot'><float name='cutoff_angle' value='181'/></emitter>"),
        r#"
a.xml:3:49: "cutoff_angle" must be a number from 0 to 180, not 181
  <emitter type='spot'><float name='cutoff_angle' value='181'/></emitter>
                                                  ^"#,
    );
    says(
        building("<emitter type='spot'><texture type='checkerboard' name='intensity'/></emitter>"),
        r#"
a.xml:3:51: "intensity" of emitter "spot" cannot be a texture
  <emitter type='spot'><texture type='checkerboard' name='intensity'/></emitter>
                                                    ^"#,
    );
    says(
        building(
            "<emitter type='spot'><transform name='to_world'><translate x='1e30'/></transform></emitter>",
        ),
        r#"
a.xml:3:22: the emitter lies more than 1e15 from the origin, too far to be rendered
  <emitter type='spot'><transform name='to_world'><translate x='1e30'/></transform></emitter>
                       ^"#,
    );
}

#[test]
fn projectors() {
    says(
        building(
            "<emitter type='projector'><float name='fov' value='40'/><string name='focal_length' value='50mm'/></emitter>",
        ),
        r#"
a.xml:3:65: emitter "projector" takes either "fov" or "focal_length", not both; "fov" is at a.xml:3:34
  <emitter type='projector'><float name='fov' value='40'/><string name='focal_length' value='50mm'/></emitter>
                                                                  ^"#,
    );
    says(
        building("<emitter type='projector'><string name='focal_length' value='x'/></emitter>"),
        r#"
a.xml:3:55: "x" is no focal length
  <emitter type='projector'><string name='focal_length' value='x'/></emitter>
                                                        ^
  help: write millimetres, such as 50mm"#,
    );
}

#[test]
fn directional_light() {
    says(
        building("<emitter type='directional'><vector name='direction' value='0'/></emitter>"),
        r#"
a.xml:3:54: the direction has no length
  <emitter type='directional'><vector name='direction' value='0'/></emitter>
                                                       ^"#,
    );
    says(
        building(
            "<emitter type='directional'><vector name='direction' value='1'/><transform name='to_world'/></emitter>",
        ),
        r#"
a.xml:3:76: emitter "directional" takes either "direction" or "to_world", not both; "direction" is at a.xml:3:37
  <emitter type='directional'><vector name='direction' value='1'/><transform name='to_world'/></emitter>
                                                                             ^"#,
    );
}

#[test]
fn beams() {
    says(
        building(
            "<shape type='sphere'><boolean name='flip_normals' value='true'/><emitter type='directionalarea'/></shape>",
        ),
        r#"
a.xml:3:74: a smooth mesh, or a shape that curves inwards, cannot shine along its normals
  <shape type='sphere'><boolean name='flip_normals' value='true'/><emitter type='directionalarea'/></shape>
                                                                           ^
  help: set face_normals of a mesh, or use a flat shape"#,
    );
    says(
        building("<shape type='sphere'><emitter type='spot'/></shape>"),
        r#"
a.xml:3:31: a shape cannot be an emitter of type "spot"
  <shape type='sphere'><emitter type='spot'/></shape>
                                ^
  help: use "area", or put the emitter beside the shape"#,
    );
}

fn constant(radiance: &str) -> String {
    building(&format!(
        "<emitter type='constant'>\n{radiance}\n</emitter>"
    ))
}

#[test]
fn spectra() {
    says(
        constant("<spectrum name='radiance' type='uniform'/>"),
        r#"
a.xml:4:27: texture "uniform" needs the parameter "value"
  <spectrum name='radiance' type='uniform'/>
                            ^
  help: add <float name="value" .../>: The value; in RGB, of all channels."#,
    );
    says(
        constant(
            "<spectrum name='radiance' type='srgb'><rgb name='color' value='3,2,1'/></spectrum>",
        ),
        r#"
a.xml:4:57: a channel of the colour is above 1
  <spectrum name='radiance' type='srgb'><rgb name='color' value='3,2,1'/></spectrum>
                                                          ^
  help: set "unbounded" to true to allow it"#,
    );
    says(
        constant(
            "<spectrum name='radiance' type='irregular'><string name='wavelengths' value='400, 300'/><string name='values' value='1, 2'/></spectrum>",
        ),
        r#"
a.xml:4:71: wavelengths must increase, but 300 follows 400
  <spectrum name='radiance' type='irregular'><string name='wavelengths' value='400, 300'/><string name='values' value='1, 2'/></spectrum>
                                                                        ^"#,
    );
    says(
        constant(
            "<spectrum name='radiance' type='irregular'><string name='wavelengths' value='400, 500'/><string name='values' value='1'/></spectrum>",
        ),
        r#"
a.xml:4:111: 1 values for 2 wavelengths
  <spectrum name='radiance' type='irregular'><string name='wavelengths' value='400, 500'/><string name='values' value='1'/></spectrum>
                                                                                                                ^"#,
    );
    says(
        constant(
            "<spectrum name='radiance' type='blackbody'><float name='temperature' value='5000'/><float name='wavelength_min' value='900'/></spectrum>",
        ),
        r#"
a.xml:4:113: wavelength_min 900 is not below wavelength_max 830
  <spectrum name='radiance' type='blackbody'><float name='temperature' value='5000'/><float name='wavelength_min' value='900'/></spectrum>
                                                                                                                  ^"#,
    );
    says(
        constant(
            "<spectrum name='radiance' type='d65'><float name='scale' value='2'/><texture type='checkerboard'/></spectrum>",
        ),
        r#"
a.xml:4:11: "radiance" of emitter "constant" cannot be a texture
  <spectrum name='radiance' type='d65'><float name='scale' value='2'/><texture type='checkerboard'/></spectrum>
            ^"#,
    );
}
