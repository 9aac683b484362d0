//! Emitters.

use super::{Category, Default, Kind, Param, Plugin, Range, Role};

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
                "Radiance in W/(m² sr); a texture follows the surface.",
            ),
            WEIGHT,
        ],
        "Light from the surface of the shape it stands in, on the side of the normal.",
    ),
    emitter(
        "directionalarea",
        &[
            Param::color(
                "radiance",
                Role::Emission,
                1.0,
                "What a surface at right angles before it receives, in W/m²; a texture follows the surface.",
            ),
            WEIGHT,
        ],
        "Light from the surface of the shape it stands in, along the normals only.",
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
        "spot",
        &[
            Param::color(
                "intensity",
                Role::Emission,
                1.0,
                "Intensity along the axis in W/sr.",
            ),
            Param::float(
                "cutoff_angle",
                Range::Closed(0.0, 180.0),
                20.0,
                "Angle from the axis, in degrees, at which the light ends.",
            ),
            Param::optional(
                "beam_width",
                Kind::Float(Range::Closed(0.0, 180.0)),
                "Angle up to which the intensity is full; three quarters of cutoff_angle if not given.",
            ),
            Param::optional(
                "texture",
                Kind::Color(Role::Emission),
                "A texture that multiplies the intensity, laid around the cone.",
            ),
            Param::transform("to_world", "Stands at the origin, shines along +z."),
            WEIGHT,
        ],
        "Light from a point into a cone.",
    ),
    Plugin {
        exclusive: &[("fov", "focal_length")],
        ..emitter(
            "projector",
            &[
                Param::color(
                    "irradiance",
                    Role::Emission,
                    1.0,
                    "The picture; a surface before its middle receives pi times this over the squared distance.",
                ),
                Param::float(
                    "scale",
                    Range::NonNegative,
                    1.0,
                    "Factor on the irradiance.",
                ),
                Param::optional(
                    "fov",
                    Kind::Float(Range::Open(0.0, 180.0)),
                    "Angle in degrees that the picture spans along fov_axis; without it, focal_length counts.",
                ),
                Param {
                    name: "focal_length",
                    kind: Kind::Text,
                    default: Default::Text("50mm"),
                    doc: "Focal length of the equivalent 35 mm film (36 x 24 mm), such as 50mm.",
                },
                Param::choice(
                    "fov_axis",
                    &["x", "y", "diagonal", "smaller", "larger"],
                    "x",
                    "Side of the picture that fov is measured along.",
                ),
                Param::transform(
                    "to_world",
                    "As of a camera: +z ahead, +y up, +x to the left.",
                ),
                WEIGHT,
            ],
            "A picture thrown from a point.",
        )
    },
    Plugin {
        exclusive: &[("direction", "to_world")],
        ..emitter(
            "directional",
            &[
                Param::color(
                    "irradiance",
                    Role::Emission,
                    1.0,
                    "Irradiance in W/m² on a surface at right angles to the light.",
                ),
                Param::optional("direction", Kind::Vector, "Where the light travels."),
                Param::transform("to_world", "Light travels along the image of +z."),
                WEIGHT,
            ],
            "Parallel light from infinity.",
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
