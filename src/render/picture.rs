//! From the film to a picture with layers and metadata.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{AovLayer, Job, Stats};
use crate::film::{Film, student_t_95};
use crate::image_io::{Channel, Image, Layer, Samples};
use crate::math::Rgb;
use crate::transport::aov::Aov;

/// How the colour channels of the file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ComponentFormat {
    Float16,
    Float32,
}

/// Which channels the picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PixelFormat {
    Luminance,
    LuminanceAlpha,
    Rgb,
    Rgba,
    Xyz,
    Xyza,
}

impl PixelFormat {
    pub fn has_alpha(self) -> bool {
        matches!(
            self,
            PixelFormat::LuminanceAlpha | PixelFormat::Rgba | PixelFormat::Xyza
        )
    }
}

/// What the file says about the making of the picture, beyond what job, film and statistics know.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Metadata {
    /// File name of the scene.
    pub scene: String,
    /// Hash of the scene's text after substitution.
    pub scene_hash: String,
    pub command_line: String,
}

/// What of a job a picture tells: enough to make one of a film where the scene is not at hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Width and height of the full picture.
    pub frame: [u32; 2],
    pub aovs: Vec<AovLayer>,
    pub pixel_format: PixelFormat,
    pub component_format: ComponentFormat,
    pub integrator: String,
    pub biased: bool,
    pub sampler: String,
    pub seed: u64,
}

impl Job {
    pub fn recipe(&self) -> Recipe {
        Recipe {
            frame: [self.film.width, self.film.height],
            aovs: self.aovs.clone(),
            pixel_format: self.pixel_format,
            component_format: self.component_format,
            integrator: self.integrator.name().to_string(),
            biased: self.integrator.biased(),
            sampler: self.sampler.name().to_string(),
            seed: self.seed,
        }
    }

    /// As [`Recipe::picture`].
    pub fn picture(&self, film: &Film, stats: &Stats, metadata: &Metadata) -> Image {
        self.recipe().picture(film, stats, metadata)
    }
}

impl Recipe {
    /// The picture: the colours, their standard error (`stderr`), the number of samples (`spp`) and a
    /// layer for each arbitrary output variable.
    pub fn picture(&self, film: &Film, stats: &Stats, metadata: &Metadata) -> Image {
        let window = film.window();
        let mut image = Image::new(window.width as usize, window.height as usize);
        image.offset = [window.x as i32, window.y as i32];
        image.frame = self.frame.map(|n| n as usize);
        let store = match self.component_format {
            ComponentFormat::Float16 => Samples::Half,
            ComponentFormat::Float32 => Samples::Float,
        };
        let to_rgb = |v: &[f64; 3]| Rgb::from_array(v.map(|v| v as f32));
        let mean: Vec<Rgb> = film.mean().iter().map(to_rgb).collect();
        image.layers.push(self.color_layer(&mean, store));
        if film.has_error() {
            let stderr: Vec<Rgb> = film.standard_error().iter().map(to_rgb).collect();
            image
                .layers
                .push(Layer::from_rgb("stderr", &stderr, Samples::Float));
        }
        let spp = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        let counts = film.counts().into_iter().map(spp).collect();
        image
            .layers
            .push(Layer::from_scalar("spp", Samples::Uint(counts)));
        let mut first = 0;
        for layer in &self.aovs {
            let names = layer.aov.channels();
            let plane = |c: usize| {
                film.aov(first + c)
                    .iter()
                    .map(|v| *v as f32)
                    .collect::<Vec<f32>>()
            };
            let channel = |c: usize| Channel {
                name: names[c].to_string(),
                samples: Samples::Float(plane(c)),
            };
            let channels = (0..names.len()).map(channel);
            match layer.aov {
                // Part of the colours, so stored as they are.
                Aov::Alpha => image.layers[0].channels.extend(channels.map(|c| Channel {
                    samples: match c.samples {
                        Samples::Float(v) => store(v),
                        other => other,
                    },
                    ..c
                })),
                _ => image.layers.push(Layer {
                    name: layer.name.clone(),
                    channels: channels.collect(),
                }),
            }
            first += names.len();
        }
        image.metadata = Some(self.metadata(film, stats, metadata).to_string());
        image
    }

    fn color_layer(&self, mean: &[Rgb], store: fn(Vec<f32>) -> Samples) -> Layer {
        let single = |name: &str, f: &dyn Fn(&Rgb) -> f32| Channel {
            name: name.to_string(),
            samples: store(mean.iter().map(f).collect()),
        };
        match self.pixel_format {
            PixelFormat::Rgb | PixelFormat::Rgba => Layer::from_rgb("", mean, store),
            PixelFormat::Luminance | PixelFormat::LuminanceAlpha => Layer {
                name: String::new(),
                channels: vec![single("Y", &|c| c.luminance())],
            },
            PixelFormat::Xyz | PixelFormat::Xyza => {
                let row = |r: [f32; 3]| move |c: &Rgb| r[0] * c.r + r[1] * c.g + r[2] * c.b;
                let channels = vec![
                    single("X", &row([0.412_453, 0.357_580, 0.180_423])),
                    single("Y", &row([0.212_671, 0.715_160, 0.072_169])),
                    single("Z", &row([0.019_334, 0.119_193, 0.950_227])),
                ];
                Layer {
                    name: String::new(),
                    channels,
                }
            }
        }
    }

    /// The `luxel` attribute of the file.
    fn metadata(&self, film: &Film, stats: &Stats, metadata: &Metadata) -> Value {
        let error = film.estimate_error();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": metadata.scene,
            "scene_hash": metadata.scene_hash,
            "command_line": metadata.command_line,
            "integrator": self.integrator,
            "biased": if self.biased { "yes" } else { "no" },
            "bias": stats.radius.map(|[first, last]| json!({
                "of": "light gathered from disks: detail smaller than them is blurred",
                "parameter": "radius",
                "first": first,
                "last": last,
            })),
            "sampler": self.sampler,
            "spp": film.spp(),
            "seed": self.seed,
            "replicates": film.replicates(),
            "seconds": stats.seconds,
            "invalid_samples": stats.invalid.count,
            "estimated_error": error.map(|e| json!({ "relmse": e.relmse, "ci95": e.ci95 })),
            // Half-width of a pixel's 95 % confidence interval, in units of the layer `stderr`.
            "ci95_in_stderr": film.has_error().then(|| student_t_95(film.freedom())),
        })
    }
}
