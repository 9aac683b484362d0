//! Sensors.

use super::{Category, Default, Kind, Param, Plugin, Range, Slot};

const SLOTS: &[Slot] = &[
    Slot::new(Category::Film, 0, 1),
    Slot::new(Category::Sampler, 0, 1),
];
const FOV: Param = Param::optional(
    "fov",
    Kind::Float(Range::Open(0.0, 180.0)),
    "Field of view in degrees along fov_axis; without it, focal_length counts.",
);
const FOCAL_LENGTH: Param = Param {
    name: "focal_length",
    kind: Kind::Text,
    default: Default::Text("50mm"),
    doc: "Focal length of the equivalent 35 mm film (36 x 24 mm), such as 50mm.",
};
const FOV_AXIS: Param = Param::choice(
    "fov_axis",
    &["x", "y", "diagonal", "smaller", "larger"],
    "x",
    "Side of the image that fov is measured along.",
);
const NEAR: Param = Param::float(
    "near_clip",
    Range::Positive,
    0.01,
    "Nearest distance seen, along the axis.",
);
const FAR: Param = Param::float(
    "far_clip",
    Range::Positive,
    1e4,
    "Farthest distance seen, along the axis.",
);
const NO_FOCUS: Param = Param::optional(
    "focus_distance",
    Kind::Float(Range::Positive),
    "Accepted; without effect, as everything is in focus.",
);
const OPEN: Param = Param::float("shutter_open", Range::Any, 0.0, "Time the shutter opens.");
const CLOSE: Param = Param::float("shutter_close", Range::Any, 0.0, "Time the shutter closes.");
const TO_WORLD: Param = Param::motion(
    "to_world",
    "Places the camera; it looks along +z with +y up and +x to the left.",
);
const DIRECTION: Param = Param::optional(
    "direction",
    Kind::Vector,
    "Direction that the rays run in; without it, the +z axis of to_world.",
);

const fn sensor(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin {
        slots: SLOTS,
        ..Plugin::new(Category::Sensor, name, params, doc)
    }
}

pub const PLUGINS: &[Plugin] = &[
    Plugin {
        exclusive: &[("fov", "focal_length")],
        ..sensor(
            "perspective",
            &[
                FOV,
                FOCAL_LENGTH,
                FOV_AXIS,
                Param::float(
                    "principal_point_offset_x",
                    Range::Any,
                    0.0,
                    "Shift of the image centre, in image widths.",
                ),
                Param::float(
                    "principal_point_offset_y",
                    Range::Any,
                    0.0,
                    "Shift of the image centre, in image heights.",
                ),
                NEAR,
                FAR,
                NO_FOCUS,
                OPEN,
                CLOSE,
                TO_WORLD,
            ],
            "Pinhole camera.",
        )
    },
    Plugin {
        exclusive: &[("fov", "focal_length")],
        ..sensor(
            "thinlens",
            &[
                Param {
                    name: "aperture_radius",
                    kind: Kind::Float(Range::NonNegative),
                    default: Default::Required,
                    doc: "Radius of the lens in scene units; 0 makes a pinhole.",
                },
                Param::optional(
                    "focus_distance",
                    Kind::Float(Range::Positive),
                    "Distance of the plane of focus, along the axis; without it, far_clip.",
                ),
                Param::optional(
                    "aperture_blades",
                    Kind::Int(3, 1 << 10),
                    "Corners of a regular polygon that the lens is cut to, inside its circle; without it, the lens is round. luxel only.",
                ),
                Param::optional(
                    "blade_rotation",
                    Kind::Float(Range::Any),
                    "Direction of the first corner in degrees, from the camera's +x axis (left) towards +y (up). luxel only.",
                ),
                FOV,
                FOCAL_LENGTH,
                FOV_AXIS,
                NEAR,
                FAR,
                OPEN,
                CLOSE,
                TO_WORLD,
            ],
            "Perspective camera with a thin lens, which blurs what is out of focus.",
        )
    },
    sensor(
        "orthographic",
        &[
            NEAR,
            FAR,
            NO_FOCUS,
            OPEN,
            CLOSE,
            Param::motion(
                "to_world",
                "Places the camera; it looks along +z with +y up and +x to the left, and sees from -1 to 1 along x. A scale lets it see more.",
            ),
        ],
        "Camera of parallel rays.",
    ),
    Plugin {
        exclusive: &[("to_world", "origin"), ("to_world", "direction")],
        ..sensor(
            "radiancemeter",
            &[
                Param::optional(
                    "origin",
                    Kind::Point,
                    "Where the ray begins; needs direction too.",
                ),
                DIRECTION,
                OPEN,
                CLOSE,
                TO_WORLD,
            ],
            "Measures the radiance along one ray; the film has one pixel.",
        )
    },
    sensor(
        "irradiancemeter",
        &[OPEN, CLOSE],
        "Inside a shape: measures the mean irradiance over it; the film has one pixel.",
    ),
    Plugin {
        slots: &[
            Slot::new(Category::Film, 0, 1),
            Slot::new(Category::Sampler, 0, 1),
            Slot::new(Category::Shape, 0, 1),
        ],
        exclusive: &[("to_world", "direction")],
        ..sensor(
            "distant",
            &[
                DIRECTION,
                Param::optional(
                    "target",
                    Kind::Point,
                    "The point that the rays run to, or a shape of this name whose points they run to; without it, all of the scene.",
                ),
                OPEN,
                CLOSE,
                TO_WORLD,
            ],
            "Measures the mean radiance along parallel rays; the film has one pixel.",
        )
    },
];
