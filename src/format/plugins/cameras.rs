//! The scene, films, reconstruction filters and samplers.

use super::super::limits::IMAGE_SIDE;
use super::{Category, Kind, Param, Plugin, Range, Slot};

const ANY_NUMBER: usize = usize::MAX;
const SIDE: (i64, i64) = (1, IMAGE_SIDE);

pub const SCENE: Plugin = Plugin {
    slots: &[
        Slot::new(Category::Integrator, 0, 1),
        Slot::new(Category::Sensor, 0, ANY_NUMBER),
        Slot::new(Category::Shape, 0, ANY_NUMBER),
        Slot::new(Category::Emitter, 0, ANY_NUMBER),
        Slot::new(Category::Bsdf, 0, ANY_NUMBER),
        Slot::new(Category::Texture, 0, ANY_NUMBER),
        Slot::new(Category::Film, 0, ANY_NUMBER),
        Slot::new(Category::Rfilter, 0, ANY_NUMBER),
        Slot::new(Category::Sampler, 0, ANY_NUMBER),
    ],
    ..Plugin::new(
        Category::Scene,
        "scene",
        &[],
        "The root: what it holds directly is used, or may be referred to by id.",
    )
};

const SAMPLES: Param = Param::int(
    "sample_count",
    (1, 1 << 31),
    4,
    "Samples per pixel; the command line may ask for others.",
);
const SEED: Param = Param::int("seed", (0, u32::MAX as i64), 0, "Seed of all numbers.");
const JITTER: Param = Param::bool("jitter", true, "Random position within each stratum.");

const fn sampler(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin::new(Category::Sampler, name, params, doc)
}

const fn rfilter(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin::new(Category::Rfilter, name, params, doc)
}

pub const PLUGINS: &[Plugin] = &[
    Plugin {
        slots: &[Slot::new(Category::Rfilter, 0, 1)],
        ..Plugin::new(
            Category::Film,
            "hdrfilm",
            &[
                Param::int("width", SIDE, 768, "Width of the full image in pixels."),
                Param::int("height", SIDE, 576, "Height of the full image in pixels."),
                Param::int(
                    "crop_offset_x",
                    (0, IMAGE_SIDE),
                    0,
                    "First column of the part to render.",
                ),
                Param::int(
                    "crop_offset_y",
                    (0, IMAGE_SIDE),
                    0,
                    "First row of the part to render.",
                ),
                Param::optional(
                    "crop_width",
                    Kind::Int(1, IMAGE_SIDE),
                    "Width of that part; without it, the full width.",
                ),
                Param::optional(
                    "crop_height",
                    Kind::Int(1, IMAGE_SIDE),
                    "Height of that part; without it, the full height.",
                ),
                Param::choice(
                    "file_format",
                    &["openexr", "exr", "pfm", "rgbe"],
                    "openexr",
                    "Format of the output file; the name given to -o decides.",
                ),
                Param::choice(
                    "pixel_format",
                    &["luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza"],
                    "rgb",
                    "Channels of the image.",
                ),
                Param::choice(
                    "component_format",
                    &["float16", "float32", "uint32"],
                    "float16",
                    "Type of the channels.",
                ),
                Param::bool(
                    "sample_border",
                    false,
                    "Sample beyond the border by the filter radius; luxel always does, so wide filters differ at the border where this is false.",
                ),
                Param::bool(
                    "compensate",
                    false,
                    "Compensated sums; luxel always sums in double precision.",
                ),
                Param::bool("banner", true, "Accepted; luxel draws no banner."),
            ],
            "Image of floating-point numbers.",
        )
    },
    rfilter("box", &[], "Box of one pixel."),
    rfilter(
        "tent",
        &[Param::float(
            "radius",
            Range::Positive,
            1.0,
            "Half width in pixels.",
        )],
        "Linear fall-off.",
    ),
    rfilter(
        "gaussian",
        &[Param::float(
            "stddev",
            Range::Positive,
            0.5,
            "Standard deviation in pixels; cut at four of them.",
        )],
        "Gaussian (the default filter).",
    ),
    rfilter(
        "mitchell",
        &[
            Param::float("B", Range::Any, 1.0 / 3.0, "B of the family."),
            Param::float("C", Range::Any, 1.0 / 3.0, "C of the family."),
        ],
        "Cubic family of Mitchell and Netravali 1988.",
    ),
    rfilter("catmullrom", &[], "Catmull-Rom spline (B = 0, C = 1/2)."),
    rfilter(
        "lanczos",
        &[Param::int("lobes", (1, 64), 3, "Number of lobes.")],
        "Windowed sinc.",
    ),
    sampler("independent", &[SAMPLES, SEED], "Independent numbers."),
    sampler(
        "sobol",
        &[SAMPLES, SEED],
        "Owen-scrambled Sobol points (Burley 2020); luxel only.",
    ),
    sampler(
        "stratified",
        &[SAMPLES, SEED, JITTER],
        "Rendered with the sampler sobol, which is stratified too.",
    ),
    sampler(
        "multijitter",
        &[SAMPLES, SEED, JITTER],
        "Rendered with the sampler sobol, which is stratified too.",
    ),
    sampler(
        "orthogonal",
        &[
            SAMPLES,
            SEED,
            JITTER,
            Param::int("strength", (2, 64), 2, "Strength of the orthogonal array."),
        ],
        "Rendered with the sampler sobol, which is stratified too.",
    ),
    sampler(
        "ldsampler",
        &[SAMPLES, SEED],
        "Rendered with the sampler sobol, of low discrepancy too.",
    ),
];
