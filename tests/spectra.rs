//! Spectra that are written as plugins, in RGB.

use luxel::format::{self, Category, FloatOrTexture, SceneDesc};
use luxel::math::Rgb;

fn load(body: &str) -> SceneDesc {
    let xml = format!("<scene version=\"3.0.0\">{body}</scene>");
    format::load_str("a.xml", &xml, "nowhere".as_ref(), &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// The colour of an emission written as `spectrum`, which is complete but for its name.
fn emission(spectrum: &str) -> Rgb {
    let spectrum = spectrum.replacen("<spectrum ", "<spectrum name=\"radiance\" ", 1);
    let desc = load(&format!("<emitter type=\"constant\">{spectrum}</emitter>"));
    let emitter = desc.scene().child(Category::Emitter).unwrap();
    let rgb = emitter.rgb("radiance").unwrap_or_else(|e| panic!("{e}"));
    desc.check_all_read().unwrap_or_else(|e| panic!("{e}"));
    rgb
}

#[track_caller]
fn close(got: Rgb, expected: [f32; 3], tolerance: f32) {
    for (a, b) in got.to_array().iter().zip(expected) {
        assert!(
            (a - b).abs() <= tolerance * b,
            "{got:?} and not {expected:?}"
        );
    }
}

#[test]
fn plain_numbers_stay_what_they_are() {
    // As measured with Mitsuba 3.9.1 (scalar_rgb).
    let uniform = "<spectrum type='uniform'><float name='value' value='0.5'/></spectrum>";
    assert_eq!(emission(uniform), Rgb::splat(0.5));
    let range = "<spectrum type='uniform'><float name='value' value='2'/><float name='wavelength_min' value='500'/></spectrum>";
    assert_eq!(emission(range), Rgb::splat(2.0));
    assert_eq!(emission("<spectrum type='d65'/>"), Rgb::WHITE);
    let scaled = "<spectrum type='d65'><rgb name='color' value='3,2,1'/><float name='scale' value='2'/></spectrum>";
    assert_eq!(emission(scaled), Rgb::new(6.0, 4.0, 2.0));
    let srgb = "<spectrum type='srgb'><rgb name='color' value='0.2,0.5,0.8'/></spectrum>";
    assert_eq!(emission(srgb), Rgb::new(0.2, 0.5, 0.8));
    let unbounded = "<spectrum type='srgb'><rgb name='color' value='3,2,1'/><boolean name='unbounded' value='true'/></spectrum>";
    assert_eq!(emission(unbounded), Rgb::new(3.0, 2.0, 1.0));
}

#[test]
fn curves_have_the_colour_that_spectral_rendering_shows() {
    // As measured with Mitsuba 3.9.1 (scalar_spectral), to what chance leaves of it.
    let regular = "<spectrum type='regular'><float name='wavelength_min' value='400'/><float name='wavelength_max' value='700'/><string name='values' value='1,2,3,2'/></spectrum>";
    let irregular = "<spectrum type='irregular'><string name='wavelengths' value='400 500 600 700'/><string name='values' value='1,2,3,2'/></spectrum>";
    close(emission(regular), [3.5260, 2.3542, 1.2513], 4e-3);
    assert_eq!(emission(regular), emission(irregular));
    assert_eq!(
        emission(regular),
        emission("<spectrum value='400:1, 500:2, 600:3, 700:2'/>")
    );
    let black = |t: &str| {
        emission(&format!(
            "<spectrum type='blackbody'><float name='temperature' value='{t}'/></spectrum>"
        ))
    };
    close(black("5000"), [15278.5, 12094.8, 9602.2], 4e-3);
    close(black("3000"), [733.85, 349.92, 112.82], 6e-3);
}

#[test]
fn reflectances_and_numbers_may_be_spectra() {
    let desc = load(
        "<shape type='sphere'><bsdf type='roughconductor'>
        <spectrum name='specular_reflectance' type='uniform'><float name='value' value='0.25'/></spectrum>
        <texture name='alpha' type='uniform'><float name='value' value='0.3'/></texture></bsdf></shape>",
    );
    let bsdf = desc
        .scene()
        .child(Category::Shape)
        .unwrap()
        .child(Category::Bsdf)
        .unwrap();
    assert_eq!(bsdf.rgb("specular_reflectance").unwrap(), Rgb::splat(0.25));
    assert_eq!(
        bsdf.float_or_texture("alpha").unwrap(),
        FloatOrTexture::Float(0.3)
    );
    let desc = load(
        "<bsdf type='diffuse' id='x'><spectrum name='reflectance' type='d65'><float name='scale' value='2'/></spectrum></bsdf><shape type='sphere'><ref id='x'/></shape>",
    );
    let bsdf = desc.scene().child(Category::Bsdf).unwrap();
    let error = bsdf.rgb("reflectance").unwrap_err();
    assert_eq!(
        error.what,
        "a reflectance must be from 0 to 1 in each channel, not 2, 2, 2"
    );
}
