//! Emitters.

use super::{Category, Param, Plugin, Range, Role};

const WEIGHT: Param = Param::float(
    "sampling_weight",
    Range::NonNegative,
    1.0,
    "Scales how often this emitter is chosen for sampling.",
);

const fn emitter(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin::new(Category::Emitter, name, params, doc)
}

pub const PLUGINS: &[Plugin] = &[
    emitter(
        "area",
        &[
            Param::color(
                "radiance",
                Role::Emission,
                1.0,
                "Radiance in W/(m² sr); a single colour so far.",
            ),
            WEIGHT,
        ],
        "Light from the surface of the shape it stands in, on the side of the normal.",
    ),
    Plugin {
        exclusive: &[("position", "to_world")],
        ..emitter(
            "point",
            &[
                Param::color("intensity", Role::Emission, 1.0, "Intensity in W/sr."),
                Param::point("position", [0.0; 3], "Where it stands."),
                Param::transform("to_world", "Where it stands, as image of the origin."),
                WEIGHT,
            ],
            "Light from a point, equal in all directions.",
        )
    },
    emitter(
        "constant",
        &[
            Param::color("radiance", Role::Emission, 1.0, "Radiance in W/(m² sr)."),
            Param::transform("to_world", "Without effect."),
            WEIGHT,
        ],
        "Equal light from all directions.",
    ),
    emitter(
        "envmap",
        &[
            Param::file("filename", "The image, latitude by longitude, with +y up."),
            Param::float(
                "scale",
                Range::NonNegative,
                1.0,
                "Factor on the radiance of the image.",
            ),
            Param::bool(
                "mis_compensation",
                false,
                "Sample only what exceeds the mean.",
            ),
            Param::transform("to_world", "Turns the environment."),
            WEIGHT,
        ],
        "Light from an image of the surroundings.",
    ),
];
