//! Spectra that are written as plugins. They stand wherever a colour may.

use super::{Category, Default, Kind, Param, Plugin, Range, Role, Slot};

const LOW: Param = Param::float(
    "wavelength_min",
    Range::Positive,
    360.0,
    "Shortest wavelength in nm.",
);
const HIGH: Param = Param::float(
    "wavelength_max",
    Range::Positive,
    830.0,
    "Longest wavelength in nm.",
);
const VALUES: Param = Param {
    name: "values",
    kind: Kind::Text,
    default: Default::Required,
    doc: "The values, with commas or spaces between them.",
};

const fn spectrum(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin::new(Category::Texture, name, params, doc)
}

pub const PLUGINS: &[Plugin] = &[
    spectrum(
        "uniform",
        &[
            Param {
                name: "value",
                kind: Kind::Float(Range::NonNegative),
                default: Default::Required,
                doc: "The value; in RGB, of all channels.",
            },
            LOW,
            HIGH,
        ],
        "The same at all wavelengths.",
    ),
    Plugin {
        slots: &[Slot::new(Category::Texture, 0, 1)],
        ..spectrum(
            "d65",
            &[
                Param::float("scale", Range::NonNegative, 1.0, "Factor on the spectrum."),
                Param::optional(
                    "color",
                    Kind::Color(Role::Unbounded),
                    "A colour that multiplies the spectrum.",
                ),
            ],
            "Daylight, the white of RGB; a texture inside takes its place.",
        )
    },
    spectrum(
        "srgb",
        &[
            Param {
                name: "color",
                kind: Kind::Color(Role::Unbounded),
                default: Default::Required,
                doc: "The colour.",
            },
            Param::bool("unbounded", false, "Allow channels above 1."),
        ],
        "An RGB colour.",
    ),
    spectrum(
        "regular",
        &[
            Param {
                default: Default::Required,
                ..LOW
            },
            Param {
                default: Default::Required,
                ..HIGH
            },
            VALUES,
        ],
        "Values at wavelengths of equal distance, linear between them.",
    ),
    spectrum(
        "irregular",
        &[
            Param {
                name: "wavelengths",
                kind: Kind::Text,
                default: Default::Required,
                doc: "Wavelengths in nm, increasing.",
            },
            VALUES,
        ],
        "Values at given wavelengths, linear between them.",
    ),
    spectrum(
        "blackbody",
        &[
            Param {
                name: "temperature",
                kind: Kind::Float(Range::Positive),
                default: Default::Required,
                doc: "Temperature in K.",
            },
            LOW,
            HIGH,
        ],
        "Radiation of a black body in W/(m² sr nm).",
    ),
];
