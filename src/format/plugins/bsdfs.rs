//! Scattering models and textures.

use super::{Category, Default, Kind, Param, Plugin, Range, Role, Slot};

const SPECULAR_R: Param = Param::color(
    "specular_reflectance",
    Role::Reflectance,
    1.0,
    "Scales reflection; 1 is physical.",
);
const SPECULAR_T: Param = Param::color(
    "specular_transmittance",
    Role::Reflectance,
    1.0,
    "Scales transmission; 1 is physical.",
);
const INT_IOR: Param = Param::ior("int_ior", "bk7", "Index of refraction inside.");
const EXT_IOR: Param = Param::ior("ext_ior", "air", "Index of refraction outside.");
const MATERIAL: Param = Param {
    name: "material",
    kind: Kind::Text,
    default: Default::Text("none"),
    doc: "Name of a metal whose eta and k are known; \"none\" is a perfect mirror.",
};
const ETA: Param = Param::optional(
    "eta",
    Kind::Color(Role::Unbounded),
    "Real part of the index of refraction; without it, that of the material (0 for \"none\").",
);
const K: Param = Param::optional(
    "k",
    Kind::Color(Role::Unbounded),
    "Imaginary part of the index of refraction; without it, that of the material (1 for \"none\").",
);
const DISTRIBUTION: Param = Param::choice(
    "distribution",
    &["beckmann", "ggx"],
    "beckmann",
    "Distribution of microfacet normals.",
);
const ALPHA: Param = Param {
    name: "alpha",
    kind: Kind::FloatTexture(Range::NonNegative),
    default: Default::Float(0.1),
    doc: "Roughness along both tangents.",
};
const ALPHA_U: Param = Param::optional(
    "alpha_u",
    Kind::FloatTexture(Range::NonNegative),
    "Roughness along the first tangent; needs alpha_v.",
);
const ALPHA_V: Param = Param::optional(
    "alpha_v",
    Kind::FloatTexture(Range::NonNegative),
    "Roughness along the second tangent; needs alpha_u.",
);
const SAMPLE_VISIBLE: Param = Param::bool(
    "sample_visible",
    true,
    "Sample the visible normals rather than all.",
);
const DIFFUSE_R: Param = Param::color(
    "diffuse_reflectance",
    Role::Reflectance,
    0.5,
    "Share of light that the base reflects.",
);
const NONLINEAR: Param = Param::bool(
    "nonlinear",
    false,
    "Let the colour of the base deepen with each reflection below the surface.",
);
const INT_IOR_PLASTIC: Param =
    Param::ior("int_ior", "polypropylene", "Index of refraction inside.");
const ALPHA_EVERYWHERE: Param = Param::float(
    "alpha",
    Range::NonNegative,
    0.1,
    "Roughness, the same everywhere and in all directions.",
);
const TO_UV: Param = Param::transform(
    "to_uv",
    "Maps texture coordinates before look-up (x and y of the transform).",
);

const FLIP_INVALID: Param = Param::bool(
    "flip_invalid_normals",
    true,
    "Mirror bent normals that look away from the viewer, which would be black.",
);
const SHADOWING: Param = Param::bool(
    "use_shadowing_function",
    true,
    "Darken grazing light smoothly where the bent surface would shadow itself.",
);

const fn bsdf(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin::new(Category::Bsdf, name, params, doc)
}

pub const PLUGINS: &[Plugin] = &[
    bsdf(
        "diffuse",
        &[Param::color(
            "reflectance",
            Role::Reflectance,
            0.5,
            "Share of light that is reflected.",
        )],
        "Ideally diffuse (Lambertian) reflection, one-sided.",
    ),
    Plugin {
        slots: &[Slot::new(Category::Bsdf, 1, 2)],
        ..bsdf(
            "twosided",
            &[],
            "Gives a one-sided material to both sides, or the first to the front, the second to the back.",
        )
    },
    Plugin {
        exclusive: &[("material", "eta"), ("material", "k")],
        ..bsdf(
            "conductor",
            &[MATERIAL, ETA, K, SPECULAR_R],
            "Smooth metal.",
        )
    },
    Plugin {
        exclusive: &[
            ("material", "eta"),
            ("material", "k"),
            ("alpha", "alpha_u"),
            ("alpha", "alpha_v"),
        ],
        ..bsdf(
            "roughconductor",
            &[
                DISTRIBUTION,
                ALPHA,
                ALPHA_U,
                ALPHA_V,
                MATERIAL,
                ETA,
                K,
                SPECULAR_R,
                SAMPLE_VISIBLE,
            ],
            "Rough metal with microfacets.",
        )
    },
    bsdf(
        "dielectric",
        &[INT_IOR, EXT_IOR, SPECULAR_R, SPECULAR_T],
        "Smooth boundary of glass, water and the like; the normal points outside.",
    ),
    Plugin {
        slots: &[Slot::new(Category::Bsdf, 1, 1)],
        ..bsdf(
            "mask",
            &[Param {
                name: "opacity",
                kind: Kind::FloatTexture(Range::Any),
                default: Default::Float(0.5),
                doc: "Share of the surface that is there, cut to 0 to 1.",
            }],
            "Lets light through as if parts of the surface were not there.",
        )
    },
    Plugin {
        slots: &[Slot::new(Category::Bsdf, 2, 2)],
        ..bsdf(
            "blendbsdf",
            &[Param {
                name: "weight",
                kind: Kind::FloatTexture(Range::Any),
                default: Default::Required,
                doc: "Share of the second material, cut to 0 to 1; the rest is the first.",
            }],
            "Mixture of two materials.",
        )
    },
    Plugin {
        slots: &[
            Slot::new(Category::Texture, 1, 1),
            Slot::new(Category::Bsdf, 1, 1),
        ],
        ..bsdf(
            "bumpmap",
            &[
                Param::float(
                    "scale",
                    Range::Any,
                    1.0,
                    "Height in scene units of a texture value of 1.",
                ),
                FLIP_INVALID,
                SHADOWING,
            ],
            "Bends the shading normals of a material by the slopes of a texture of heights.",
        )
    },
    Plugin {
        slots: &[Slot::new(Category::Bsdf, 1, 1)],
        ..bsdf(
            "normalmap",
            &[
                Param {
                    name: "normalmap",
                    kind: Kind::Color(Role::Unbounded),
                    default: Default::Required,
                    doc: "Texture of normals: colour c is the normal 2 c - 1 in the tangent frame; its bitmap wants raw.",
                },
                FLIP_INVALID,
                SHADOWING,
            ],
            "Replaces the shading normals of a material by those of a texture.",
        )
    },
    bsdf(
        "thindielectric",
        &[INT_IOR, EXT_IOR, SPECULAR_R, SPECULAR_T],
        "A pane of glass as one surface: light passes straight on, reflections inside are counted in.",
    ),
    Plugin {
        exclusive: &[("alpha", "alpha_u"), ("alpha", "alpha_v")],
        ..bsdf(
            "roughdielectric",
            &[
                DISTRIBUTION,
                ALPHA,
                ALPHA_U,
                ALPHA_V,
                INT_IOR,
                EXT_IOR,
                SPECULAR_R,
                SPECULAR_T,
                SAMPLE_VISIBLE,
            ],
            "Rough boundary of glass and the like, with microfacets; the normal points outside.",
        )
    },
    bsdf(
        "plastic",
        &[INT_IOR_PLASTIC, EXT_IOR, DIFFUSE_R, SPECULAR_R, NONLINEAR],
        "Diffuse base under a smooth clear boundary, one-sided.",
    ),
    bsdf(
        "roughplastic",
        &[
            DISTRIBUTION,
            ALPHA_EVERYWHERE,
            INT_IOR_PLASTIC,
            EXT_IOR,
            DIFFUSE_R,
            SPECULAR_R,
            NONLINEAR,
            SAMPLE_VISIBLE,
        ],
        "Diffuse base under a rough clear boundary with microfacets, one-sided.",
    ),
    bsdf(
        "null",
        &[],
        "A surface that is not there: light passes straight on.",
    ),
    Plugin::new(
        Category::Texture,
        "bitmap",
        &[
            Param::file("filename", "The image."),
            Param::choice(
                "filter_type",
                &["bilinear", "nearest"],
                "bilinear",
                "Interpolation between pixels.",
            ),
            Param::choice(
                "wrap_mode",
                &["repeat", "mirror", "clamp"],
                "repeat",
                "What lies outside 0 to 1.",
            ),
            Param::choice(
                "format",
                &["auto", "variant", "float16", "fp16", "uint8"],
                "auto",
                "Storage; without effect on the meaning.",
            ),
            Param::bool(
                "raw",
                false,
                "Take the numbers as they are, without sRGB decoding.",
            ),
            TO_UV,
        ],
        "An image.",
    ),
    Plugin::new(
        Category::Texture,
        "checkerboard",
        &[
            Param::color(
                "color0",
                Role::Reflectance,
                0.4,
                "Colour of the squares at the origin.",
            ),
            Param::color("color1", Role::Reflectance, 0.2, "Colour of the others."),
            TO_UV,
        ],
        "Two by two squares per unit of texture coordinates.",
    ),
    Plugin::new(
        Category::Texture,
        "mesh_attribute",
        &[
            Param {
                name: "name",
                kind: Kind::Text,
                default: Default::Required,
                doc: "Such as vertex_color or face_heat: numbers of the properties r, g, b or heat_1 in a PLY file.",
            },
            Param::float("scale", Range::NonNegative, 1.0, "Factor on the values."),
        ],
        "Values that a mesh carries at its vertices, interpolated, or at its faces.",
    ),
];
