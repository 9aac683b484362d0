//! Film and sampler.

use crate::film::{FilmSpec, Filter, Window};
use crate::format::plugins::Category;
use crate::format::{Overrides, Props, SceneError};
use crate::render::{ComponentFormat, PixelFormat};
use crate::sampler::SamplerKind;
use crate::scene::Plan;

use super::{on_command_line, suggest};

/// Most pixels of a picture: beyond, film and files would not fit into memory.
const MAX_PIXELS: u64 = 1 << 28;

pub struct Film {
    pub spec: FilmSpec,
    pub pixel_format: PixelFormat,
    pub component_format: ComponentFormat,
}

/// What Mitsuba takes when a sensor has no film.
const DEFAULT_SIZE: [u32; 2] = [768, 576];
const DEFAULT_FILTER: Filter = Filter::Gaussian { stddev: 0.5 };

pub fn film(sensor: &Props, overrides: &Overrides) -> Result<Film, SceneError> {
    let props = sensor.child(Category::Film);
    let mut size = DEFAULT_SIZE;
    let mut crop = None;
    let mut filter = DEFAULT_FILTER;
    let mut pixel_format = PixelFormat::Rgb;
    let mut component_format = ComponentFormat::Float32;
    if let Some(p) = &props {
        size = [p.int("width")? as u32, p.int("height")? as u32];
        crop = crop_of(p, size)?;
        if let Some(rfilter) = p.child(Category::Rfilter) {
            filter = filter_of(&rfilter)?;
        }
        pixel_format = match p.choice("pixel_format")? {
            "luminance" => PixelFormat::Luminance,
            "luminance_alpha" => PixelFormat::LuminanceAlpha,
            "rgba" => PixelFormat::Rgba,
            "xyz" => PixelFormat::Xyz,
            "xyza" => PixelFormat::Xyza,
            _ => PixelFormat::Rgb,
        };
        // Mitsuba stores half floats unless told otherwise; here nobody loses precision by not asking.
        component_format = match (
            p.is_given("component_format"),
            p.choice("component_format")?,
        ) {
            (true, "float16") => ComponentFormat::Float16,
            (true, "uint32") => {
                return Err(p
                    .error_at(
                        "component_format",
                        "component_format \"uint32\" is not supported",
                    )
                    .with_help("use \"float32\" or \"float16\""));
            }
            _ => ComponentFormat::Float32,
        };
        // The names given to -o say the format, the filter is sampled beyond every border, sums are in
        // double precision, and there is no banner: these cannot change the picture.
        p.ignore(&["file_format", "sample_border", "compensate", "banner"]);
    }
    if let Some(resolution) = overrides.resolution {
        if crop.is_some() && overrides.crop.is_none() {
            let what = "the film has a crop window, which a new resolution makes meaningless";
            return Err(
                film_error(props.as_ref().unwrap_or(sensor), overrides, what)
                    .with_help("give --crop too"),
            );
        }
        size = resolution;
    }
    let [width, height] = size;
    let at = props.as_ref().unwrap_or(sensor);
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        let what = format!("a picture of {width} x {height} pixels has no pixel");
        return Err(film_error(at, overrides, what));
    }
    let crop = overrides.crop.or(crop).unwrap_or(Window {
        x: 0,
        y: 0,
        width,
        height,
    });
    let fits = |start: u32, length: u32, size: u32| {
        length > 0 && u64::from(start) + u64::from(length) <= u64::from(size)
    };
    if !fits(crop.x, crop.width, width) || !fits(crop.y, crop.height, height) {
        let what = format!(
            "the crop window of {} x {} pixels at ({}, {}) does not lie within the picture of {width} x {height}",
            crop.width, crop.height, crop.x, crop.y
        );
        return Err(film_error(at, overrides, what));
    }
    let rendered = u64::from(crop.width) * u64::from(crop.height);
    if rendered > MAX_PIXELS {
        let what = format!("{rendered} pixels are more than a picture can have ({MAX_PIXELS})");
        return Err(film_error(at, overrides, what));
    }
    Ok(Film {
        spec: FilmSpec {
            width,
            height,
            crop,
            filter,
        },
        pixel_format,
        component_format,
    })
}

/// An error about the size of the film, at what set it: the command line before the scene.
fn film_error(film: &Props, overrides: &Overrides, what: impl Into<String>) -> SceneError {
    match (overrides.crop, overrides.resolution) {
        (Some(c), _) => {
            let value = format!("{},{},{},{}", c.x, c.y, c.width, c.height);
            on_command_line("--crop", &value, what)
        }
        (None, Some([width, height])) => {
            on_command_line("--resolution", &format!("{width}x{height}"), what)
        }
        (None, None) => film.error(what),
    }
}

fn crop_of(film: &Props, size: [u32; 2]) -> Result<Option<Window>, SceneError> {
    let names = [
        "crop_offset_x",
        "crop_offset_y",
        "crop_width",
        "crop_height",
    ];
    let given = names.iter().any(|n| film.is_given(n));
    let window = Window {
        x: film.int("crop_offset_x")? as u32,
        y: film.int("crop_offset_y")? as u32,
        width: film.opt_int("crop_width")?.map_or(size[0], |v| v as u32),
        height: film.opt_int("crop_height")?.map_or(size[1], |v| v as u32),
    };
    Ok(given.then_some(window))
}

fn filter_of(p: &Props) -> Result<Filter, SceneError> {
    Ok(match p.plugin() {
        "box" => Filter::Box { radius: 0.5 },
        "tent" => Filter::Tent {
            radius: p.float("radius")? as f32,
        },
        "mitchell" => Filter::Mitchell {
            b: p.float("B")? as f32,
            c: p.float("C")? as f32,
        },
        "catmullrom" => Filter::Mitchell { b: 0.0, c: 0.5 },
        "lanczos" => Filter::Lanczos {
            lobes: p.int("lobes")? as f32,
        },
        _ => Filter::Gaussian {
            stddev: p.float("stddev")? as f32,
        },
    })
}

pub struct SamplerSpec {
    pub kind: SamplerKind,
    pub spp: u64,
    pub seed: u64,
}

/// Samples per pixel when nobody says how many: Mitsuba's default.
const DEFAULT_SPP: u64 = 4;

pub fn sampler(
    sensor: &Props,
    overrides: &Overrides,
    plan: &mut Plan,
) -> Result<SamplerSpec, SceneError> {
    let props = sensor.child(Category::Sampler);
    let mut spec = SamplerSpec {
        kind: SamplerKind::Sobol,
        spp: DEFAULT_SPP,
        seed: 0,
    };
    let mut reason = "the scene names no sampler, and these points converge fastest".to_string();
    if let Some(p) = &props {
        spec.spp = p.int("sample_count")? as u64;
        spec.seed = p.int("seed")? as u64;
        p.ignore(&["jitter", "strength"]);
        (spec.kind, reason) = match p.plugin() {
            "independent" => (
                SamplerKind::Independent,
                "the scene asks for it".to_string(),
            ),
            "sobol" => (SamplerKind::Sobol, "the scene asks for it".to_string()),
            other => (
                SamplerKind::Sobol,
                format!(
                    "the scene asks for \"{other}\", and this is the nearest: stratified in every pair of dimensions"
                ),
            ),
        };
    }
    if let Some(name) = &overrides.sampler {
        spec.kind = match name.as_str() {
            "independent" => SamplerKind::Independent,
            "sobol" => SamplerKind::Sobol,
            _ => {
                let what = format!("unknown sampler \"{name}\"");
                return Err(on_command_line("--sampler", name, what)
                    .with_help(suggest(name, ["independent", "sobol"])));
            }
        };
        reason = "the command line asks for it".to_string();
    }
    plan.add("sampler", spec.kind.name(), reason);
    Ok(spec)
}
