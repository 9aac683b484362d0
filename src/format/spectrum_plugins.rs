//! Spectra that are written as plugins, and what they are in RGB.
//!
//! `uniform`, `d65` and `srgb` mean in RGB what they do in Mitsuba's RGB modes (measured): numbers, not
//! curves. `regular`, `irregular` and `blackbody`, which those modes cannot evaluate, become the colour that
//! Mitsuba's spectral modes show (measured).

use super::error::{SceneError, shown_number};
use super::plugins::{Category, Role};
use super::props::{Props, RgbOrTexture};
use super::spectrum::Spectrum;
use crate::math::Rgb;

/// The value of a colour that the object `p` stands for: any texture, or one of the spectra.
pub(super) fn resolve(p: &Props, role: Role) -> Result<RgbOrTexture, SceneError> {
    let rgb = match p.plugin() {
        "uniform" => Rgb::splat(uniform(p)? as f32),
        "d65" => match d65(p)? {
            RgbOrTexture::Rgb(rgb) => rgb,
            texture => return Ok(texture),
        },
        "srgb" => {
            let rgb = p.rgb("color")?;
            if !p.bool("unbounded")? && rgb.max_component() > 1.0 {
                let what = "a channel of the colour is above 1";
                let error = p.error_at("color", what);
                return Err(error.with_help("set \"unbounded\" to true to allow it"));
            }
            rgb
        }
        "regular" => regular(p)?.to_rgb(role),
        "irregular" => irregular(p)?.to_rgb(role),
        "blackbody" => blackbody(p)?.to_rgb(role),
        _ => return Ok(RgbOrTexture::Texture(p.object_id())),
    };
    if role == Role::Reflectance && rgb.max_component() > 1.0 {
        let found = rgb
            .to_array()
            .map(|c| shown_number(f64::from(c)))
            .join(", ");
        let what = format!("a reflectance must be from 0 to 1 in each channel, not {found}");
        return Err(p.error(what));
    }
    Ok(RgbOrTexture::Rgb(rgb))
}

/// The number that a spectrum stands for where one is wanted; `None` for anything but `uniform`.
pub(super) fn number(p: &Props) -> Option<Result<f64, SceneError>> {
    (p.plugin() == "uniform").then(|| uniform(p))
}

fn uniform(p: &Props) -> Result<f64, SceneError> {
    // Without effect in RGB, as in Mitsuba.
    p.ignore(&["wavelength_min", "wavelength_max"]);
    p.float("value")
}

fn d65(p: &Props) -> Result<RgbOrTexture, SceneError> {
    // The scale does not act on a texture in Mitsuba's RGB modes: left unread, it is refused.
    if let Some(texture) = p.child(Category::Texture) {
        return resolve(&texture, Role::Emission);
    }
    match p.opt_rgb_or_texture("color")? {
        Some(RgbOrTexture::Rgb(rgb)) => Ok(RgbOrTexture::Rgb(rgb * p.float("scale")? as f32)),
        Some(texture) => Ok(texture),
        None => Ok(RgbOrTexture::Rgb(Rgb::splat(p.float("scale")? as f32))),
    }
}

fn regular(p: &Props) -> Result<Spectrum, SceneError> {
    let (low, high) = bounds(p)?;
    let values = numbers(p, "values")?;
    let step = (high - low) / (values.len().max(2) - 1) as f64;
    let wavelengths = (0..values.len()).map(|i| low + step * i as f64).collect();
    sampled(p, wavelengths, values)
}

fn irregular(p: &Props) -> Result<Spectrum, SceneError> {
    let wavelengths = numbers(p, "wavelengths")?;
    if let Some(w) = wavelengths.windows(2).find(|w| w[0] >= w[1]) {
        let (first, second) = (shown_number(w[0]), shown_number(w[1]));
        let what = format!("wavelengths must increase, but {second} follows {first}");
        return Err(p.error_at("wavelengths", what));
    }
    let values = numbers(p, "values")?;
    if values.len() != wavelengths.len() {
        let what = format!(
            "{} values for {} wavelengths",
            values.len(),
            wavelengths.len()
        );
        return Err(p.error_at("values", what));
    }
    sampled(p, wavelengths, values)
}

fn sampled(p: &Props, wavelengths: Vec<f64>, values: Vec<f64>) -> Result<Spectrum, SceneError> {
    if values.len() < 2 {
        return Err(p.error_at("values", "a spectrum needs at least two wavelengths"));
    }
    if let Some(x) = values.iter().find(|x| **x < 0.0) {
        let what = format!("a spectrum must be at least 0, not {}", shown_number(*x));
        return Err(p.error_at("values", what));
    }
    Ok(Spectrum::Sampled(
        wavelengths.into_iter().zip(values).collect(),
    ))
}

/// Planck's law, in W/(m² sr nm).
fn blackbody(p: &Props) -> Result<Spectrum, SceneError> {
    // Planck's constant, the speed of light and Boltzmann's constant in SI units.
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    const K: f64 = 1.380_649e-23;
    let (low, high) = bounds(p)?;
    let t = p.float("temperature")?;
    let planck = |nm: f64| {
        let m = nm * 1e-9;
        2e-9 * H * C * C / (m.powi(5) * (H * C / (m * K * t)).exp_m1())
    };
    // Linear between steps of at most 1 nm, where it is visible.
    let (low, high) = (low.max(360.0), high.min(830.0));
    if low >= high {
        return Ok(Spectrum::Sampled(vec![(360.0, 0.0), (830.0, 0.0)]));
    }
    let count = (high - low).ceil() as usize;
    let at = |i: usize| low + (high - low) * i as f64 / count as f64;
    let samples: Vec<_> = (0..=count).map(|i| (at(i), planck(at(i)))).collect();
    match samples.iter().all(|s| s.1 <= f64::from(f32::MAX)) {
        true => Ok(Spectrum::Sampled(samples)),
        false => Err(p.error_at("temperature", "the radiation is too large for a number")),
    }
}

fn bounds(p: &Props) -> Result<(f64, f64), SceneError> {
    let (low, high) = (p.float("wavelength_min")?, p.float("wavelength_max")?);
    if low >= high {
        let (l, h) = (shown_number(low), shown_number(high));
        let what = format!("wavelength_min {l} is not below wavelength_max {h}");
        return Err(p.error_at("wavelength_min", what));
    }
    Ok((low, high))
}

fn numbers(p: &Props, name: &str) -> Result<Vec<f64>, SceneError> {
    super::xml::floats(p.string(name)?)
        .map_err(|(what, help)| p.error_at(name, what).with_help_opt(help))
}
