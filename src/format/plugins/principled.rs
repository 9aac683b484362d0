//! Burley's principled materials: their parameters.

use super::{Category, Default, Kind, Param, Plugin, Range, Role};

const SHARE: Range = Range::Closed(0.0, 1.0);

const fn scalar(name: &'static str, range: Range, default: f64, doc: &'static str) -> Param {
    Param {
        name,
        kind: Kind::FloatTexture(range),
        default: Default::Float(default),
        doc,
    }
}

const fn share(name: &'static str, doc: &'static str) -> Param {
    scalar(name, SHARE, 0.0, doc)
}

const fn rate(name: &'static str, doc: &'static str) -> Param {
    Param::float(name, Range::NonNegative, 1.0, doc)
}

const BASE_COLOR: Param = Param::color(
    "base_color",
    Role::Reflectance,
    0.5,
    "Colour of the material.",
);
const ROUGHNESS: Param = scalar(
    "roughness",
    SHARE,
    0.5,
    "Roughness; microfacets have its square.",
);
const ANISOTROPIC: Param = share(
    "anisotropic",
    "Stretch of the reflection along the first tangent.",
);
const SPEC_TRANS: Param = share("spec_trans", "From diffuse (0) to clear (1).");
const SPEC_TINT: Param = share(
    "spec_tint",
    "How much the reflection at normal incidence takes the hue of the base colour.",
);
const SHEEN: Param = scalar(
    "sheen",
    Range::NonNegative,
    0.0,
    "Strength of the sheen at grazing angles, as of cloth.",
);
const SHEEN_TINT: Param = share(
    "sheen_tint",
    "How much the sheen takes the hue of the base colour.",
);
const FLATNESS: Param = share(
    "flatness",
    "From Burley's diffuse reflection (0) to one that is flat as by subsurface scattering (1).",
);
const DIFFUSE_RATE: Param = rate(
    "diffuse_reflectance_sampling_rate",
    "Factor on the share of samples of diffuse reflection; changes the noise only.",
);

pub const PLUGINS: &[Plugin] = &[
    Plugin {
        exclusive: &[("eta", "specular")],
        ..Plugin::new(
            Category::Bsdf,
            "principled",
            &[
                BASE_COLOR,
                ROUGHNESS,
                ANISOTROPIC,
                share("metallic", "From dielectric (0) to metal (1)."),
                SPEC_TRANS,
                Param::optional(
                    "eta",
                    Kind::Float(Range::Positive),
                    "Index of refraction inside over that outside; without it, that of specular.",
                ),
                Param::float(
                    "specular",
                    Range::Closed(0.0, 12.0),
                    0.5,
                    "Reflectance at normal incidence in units of 0.08, which gives the index of refraction.",
                ),
                SPEC_TINT,
                SHEEN,
                SHEEN_TINT,
                FLATNESS,
                scalar(
                    "clearcoat",
                    Range::NonNegative,
                    0.0,
                    "Strength of a second, clear layer.",
                ),
                share(
                    "clearcoat_gloss",
                    "Gloss of the clear layer, from satin (0) to glossy (1).",
                ),
                rate(
                    "main_specular_sampling_rate",
                    "Factor on the share of samples of microfacets; changes the noise only.",
                ),
                rate(
                    "clearcoat_sampling_rate",
                    "Factor on the share of samples of the clear layer; changes the noise only.",
                ),
                DIFFUSE_RATE,
            ],
            "Burley's principled surface of a solid: metal, plastic, glass, cloth, lacquer.",
        )
    },
    Plugin::new(
        Category::Bsdf,
        "principledthin",
        &[
            BASE_COLOR,
            ROUGHNESS,
            ANISOTROPIC,
            SPEC_TRANS,
            scalar(
                "eta",
                Range::Positive,
                1.5,
                "Index of refraction of the sheet over that around it.",
            ),
            SPEC_TINT,
            SHEEN,
            SHEEN_TINT,
            FLATNESS,
            scalar(
                "diff_trans",
                Range::Closed(0.0, 2.0),
                0.0,
                "Diffuse transmission: none (0), as much as reflection (1), all (2).",
            ),
            rate(
                "specular_reflectance_sampling_rate",
                "Factor on the share of samples of specular reflection; changes the noise only.",
            ),
            rate(
                "specular_transmittance_sampling_rate",
                "Factor on the share of samples of specular transmission; changes the noise only.",
            ),
            DIFFUSE_RATE,
            rate(
                "diffuse_transmittance_sampling_rate",
                "Factor on the share of samples of diffuse transmission; changes the noise only.",
            ),
        ],
        "Burley's principled sheet without thickness: paper, leaves, frosted panes.",
    ),
];
