//! Integrators, and what wraps them.

use super::super::limits::IMAGE_SIDE;
use super::{Category, Default, Kind, Param, Plugin, Range, Slot};

const HIDE: Param = Param::bool(
    "hide_emitters",
    false,
    "Leave emitters out of what the camera sees directly.",
);
const PER_PASS: Param = Param::optional(
    "samples_per_pass",
    Kind::Int(-1, 1 << 31),
    "Samples per pass; without effect on the image.",
);
const TIMEOUT: Param = Param::float(
    "timeout",
    Range::Any,
    -1.0,
    "Stop after so many seconds; negative: never.",
);
const BLOCK: Param = Param::int(
    "block_size",
    (0, IMAGE_SIDE),
    0,
    "Side of an image tile, 0: chosen by luxel; without effect on the image.",
);
const MAX_DEPTH: Param = Param::int(
    "max_depth",
    (-1, i32::MAX as i64),
    -1,
    "Longest path in edges: 1 shows emitters, 2 adds direct light; -1: no limit.",
);
const RR_DEPTH: Param = Param::int(
    "rr_depth",
    (1, i32::MAX as i64),
    5,
    "Depth from which Russian roulette may end a path.",
);
const PHOTON_COUNT: Param = Param::optional(
    "photon_count",
    Kind::Int(1, 1 << 31),
    "Walks of light per iteration, that is per sample of each pixel; without it, as many as the image has pixels.",
);
const INITIAL_RADIUS: Param = Param::optional(
    "initial_radius",
    Kind::Float(Range::NonNegative),
    "Radius that photons are gathered from in the first iteration, in scene units; without it or 0, a few pixels as the camera sees the scene.",
);
const ALPHA: Param = Param::float(
    "alpha",
    Range::Open(0.0, 1.0),
    0.75,
    "How the radius shrinks from iteration to iteration: near 1 slowly, near 0 fast (Knaus and Zwicker 2011).",
);
const MEMORY: Param = Param::int(
    "memory",
    (1, 1 << 24),
    4096,
    "Most memory for photons, in MiB.",
);
const MAX_PASSES: Param = Param::int(
    "max_passes",
    (-1, i32::MAX as i64),
    -1,
    "Only -1: a pass is a sample of each pixel, and the sampler or the command line says how many.",
);
const GRANULARITY: Param = Param::int(
    "granularity",
    (0, i32::MAX as i64),
    0,
    "How work is divided; without effect on the image.",
);
const LIGHT_IMAGE: Param = Param::bool(
    "light_image",
    true,
    "Connect walks of light to the camera too, where the sensor can be connected to; without, caustics of point lights are lost.",
);
const SAMPLE_DIRECT: Param = Param::bool(
    "sample_direct",
    true,
    "Connect vertices to emitters by points made for them; only true.",
);
const INDIRECT: Param = Param::choice(
    "indirect",
    &["none", "gather", "guide"],
    "none",
    "Light between diffuse surfaces: none, walks find it; gather, read from radiosity where a walk meets a second diffuse surface (biased); guide, radiosity sends walks where it comes from (unbiased); luxel only.",
);
const SOLVER: Param = Param::choice(
    "solver",
    &[
        "gauss",
        "gauss-seidel",
        "jacobi",
        "shooting",
        "hierarchical",
    ],
    "hierarchical",
    "How radiosity is solved for; this and what follows have an effect only where it is.",
);
const FORM_FACTORS: Param = Param::choice(
    "form_factors",
    &["hemicube", "montecarlo", "analytic"],
    "analytic",
    "How the share of light that goes from patch to patch is found.",
);
const RESOLUTION: Param = Param::int(
    "resolution",
    (2, 4096),
    128,
    "Pixels along the edge of a hemicube.",
);
const SAMPLES_PER_PAIR: Param = Param::int(
    "samples",
    (1, 1 << 20),
    16,
    "Rays between two patches, for form factors by montecarlo or analytic.",
);
const PATCH_SIZE: Param = Param::optional(
    "patch_size",
    Kind::Float(Range::Positive),
    "Longest edge of a patch in scene units; without it, a part of the scene.",
);
const MIN_SIZE: Param = Param::optional(
    "min_size",
    Kind::Float(Range::Positive),
    "Shortest edge that the solver hierarchical makes, in scene units; without it, a part of the scene.",
);
const ERROR: Param = Param::optional(
    "error",
    Kind::Float(Range::Positive),
    "Greatest error of a link of the solver hierarchical, as a share of the light that is usual at its receiver, times the receiver's share of all area; without it, 1e-5, or 1e-2 behind indirect=gather and 1e-4 behind indirect=guide.",
);
const WALKS: Param = Param::int(
    "walks",
    (-1, 1 << 26),
    -1,
    "Edges of random walks by which the solver hierarchical corrects what links bring; 0: it trusts links; -1: 2^20, or 2^19 with indirect.",
);
const RESIDUAL: Param = Param::float(
    "residual",
    Range::Positive,
    1e-4,
    "Residual relative to the emitted power at which solving ends.",
);
const MAX_STEPS: Param = Param::int(
    "max_steps",
    (-1, 1 << 40),
    -1,
    "Most steps of solving: sweeps, or patches that shoot; -1: as many as the residual takes.",
);
const CURVE_ERROR: Param = Param::float(
    "curve_error",
    Range::Open(0.0, 0.3),
    0.02,
    "Greatest distance of patches from curved shapes, as a share of their radius.",
);
const MAX_PATCHES: Param = Param::int(
    "max_patches",
    (1, u32::MAX as i64 - 1),
    4_000_000,
    "Most patches; more are an error.",
);
const SHOW: Param = Param::choice(
    "show",
    &["flat", "gouraud", "gather"],
    "gather",
    "Patches as they are, interpolated, or a final gather: light sent to the point that is seen.",
);
const INTEGRATORS: &[Slot] = &[Slot::new(Category::Integrator, 0, usize::MAX)];

const fn integrator(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin::new(Category::Integrator, name, params, doc)
}

const INT32: (i64, i64) = (0, i32::MAX as i64);

const SAMPLES: (i64, i64) = (0, 1 << 16);
const PHOTONS: (i64, i64) = (0, 1 << 31);
const LOOKUP: (i64, i64) = (1, 1 << 20);

const PHOTON_MAPPER: &[Param] = &[
    Param::int(
        "direct_samples",
        (1, 1 << 16),
        16,
        "Samples of the emitters where the camera's walk first scatters.",
    ),
    Param::int(
        "gather_samples",
        SAMPLES,
        32,
        "Rays of the final gather from there, where the surface is diffuse; luxel only.",
    ),
    Param::int(
        "glossy_samples",
        SAMPLES,
        32,
        "The same where it is anything else.",
    ),
    MAX_DEPTH,
    RR_DEPTH,
    Param::int(
        "global_photons",
        PHOTONS,
        250_000,
        "Photons to keep of all light.",
    ),
    Param::int(
        "caustic_photons",
        PHOTONS,
        250_000,
        "Photons to keep of caustics.",
    ),
    Param::float(
        "global_lookup_radius",
        Range::Open(0.0, 1e6),
        0.05,
        "Most distance that photons of all light are gathered from, relative to the radius of the scene.",
    ),
    Param::float(
        "caustic_lookup_radius",
        Range::Open(0.0, 1e6),
        0.0125,
        "The same for photons of caustics.",
    ),
    Param::optional(
        "lookup_size",
        Kind::Int(1, 1 << 20),
        "Sets global_lookup_size and caustic_lookup_size.",
    ),
    Param::int(
        "global_lookup_size",
        LOOKUP,
        120,
        "Photons of all light to gather at once, where as many are near enough.",
    ),
    Param::int(
        "caustic_lookup_size",
        LOOKUP,
        120,
        "The same for photons of caustics.",
    ),
    MEMORY,
    Param::optional(
        "volume_photons",
        Kind::Int(0, 1 << 31),
        "Photons in media, of which luxel has none; without effect on the image.",
    ),
    Param::optional(
        "volume_lookup_size",
        Kind::Int(0, 1 << 31),
        "Photons to gather in media; without effect on the image.",
    ),
    Param::optional(
        "granularity",
        Kind::Int(0, 1 << 31),
        "Photons per unit of work; without effect on the image.",
    ),
    Param::optional(
        "gather_locally",
        Kind::Bool,
        "Where photons are shot; without effect on the image.",
    ),
    Param::optional(
        "auto_cancel_gathering",
        Kind::Bool,
        "Give up where hardly a photon is kept; luxel always does.",
    ),
    HIDE,
    PER_PASS,
    TIMEOUT,
    BLOCK,
];

pub const PLUGINS: &[Plugin] = &[
    integrator(
        "path",
        &[
            MAX_DEPTH,
            RR_DEPTH,
            HIDE,
            INDIRECT,
            SOLVER,
            FORM_FACTORS,
            RESOLUTION,
            SAMPLES_PER_PAIR,
            PATCH_SIZE,
            MIN_SIZE,
            ERROR,
            WALKS,
            RESIDUAL,
            MAX_STEPS,
            CURVE_ERROR,
            MAX_PATCHES,
            PER_PASS,
            TIMEOUT,
            BLOCK,
        ],
        "Path tracing with next-event estimation and multiple importance sampling.",
    ),
    integrator(
        "combined",
        &[
            Param::bool(
                "caustics",
                true,
                "Find caustics by photons; without them, this is the integrator path.",
            ),
            MAX_DEPTH,
            RR_DEPTH,
            HIDE,
            INDIRECT,
            SOLVER,
            FORM_FACTORS,
            RESOLUTION,
            SAMPLES_PER_PAIR,
            PATCH_SIZE,
            MIN_SIZE,
            ERROR,
            WALKS,
            RESIDUAL,
            MAX_STEPS,
            CURVE_ERROR,
            MAX_PATCHES,
            PHOTON_COUNT,
            INITIAL_RADIUS,
            ALPHA,
            MEMORY,
            PER_PASS,
            TIMEOUT,
            BLOCK,
        ],
        "Path tracing that leaves caustics to photons; biased by their radius, which shrinks; luxel only.",
    ),
    integrator(
        "radiosity",
        &[
            SHOW,
            SOLVER,
            FORM_FACTORS,
            RESOLUTION,
            SAMPLES_PER_PAIR,
            PATCH_SIZE,
            MIN_SIZE,
            ERROR,
            WALKS,
            RESIDUAL,
            MAX_STEPS,
            CURVE_ERROR,
            MAX_PATCHES,
            MAX_DEPTH,
            RR_DEPTH,
            HIDE,
            PER_PASS,
            TIMEOUT,
            BLOCK,
        ],
        "Radiosity: light between diffuse surfaces by patches, with mirrors, glass and gloss by walks on top of it; biased by the size of patches; luxel only.",
    ),
    integrator(
        "bdpt",
        &[
            MAX_DEPTH,
            RR_DEPTH,
            HIDE,
            LIGHT_IMAGE,
            SAMPLE_DIRECT,
            PER_PASS,
            TIMEOUT,
            BLOCK,
        ],
        "Bidirectional path tracing: walks from the eye and from lights, connected in all ways.",
    ),
    integrator(
        "ptracer",
        &[MAX_DEPTH, RR_DEPTH, HIDE, PER_PASS, TIMEOUT, BLOCK],
        "Light tracing: walks from lights alone, connected to the camera.",
    ),
    integrator(
        "vcm",
        &[
            MAX_DEPTH,
            RR_DEPTH,
            HIDE,
            PHOTON_COUNT,
            INITIAL_RADIUS,
            ALPHA,
            MEMORY,
            PER_PASS,
            TIMEOUT,
            BLOCK,
        ],
        "Vertex connection and merging: bidirectional path tracing and photons together; biased by the photons' radius, which shrinks; luxel only.",
    ),
    integrator(
        "sppm",
        &[
            MAX_DEPTH,
            RR_DEPTH,
            HIDE,
            PHOTON_COUNT,
            INITIAL_RADIUS,
            ALPHA,
            MEMORY,
            MAX_PASSES,
            GRANULARITY,
            PER_PASS,
            TIMEOUT,
            BLOCK,
        ],
        "Stochastic progressive photon mapping: all light by photons; biased by their radius, which shrinks.",
    ),
    Plugin {
        exclusive: &[
            ("lookup_size", "global_lookup_size"),
            ("lookup_size", "caustic_lookup_size"),
        ],
        ..integrator(
            "photonmapper",
            PHOTON_MAPPER,
            "Photon maps (Jensen 1996) as in Mitsuba 0.6, the global one behind a final gather; biased by the number of photons.",
        )
    },
    Plugin {
        exclusive: &[
            ("shading_samples", "emitter_samples"),
            ("shading_samples", "bsdf_samples"),
        ],
        ..integrator(
            "direct",
            &[
                Param::int(
                    "shading_samples",
                    INT32,
                    1,
                    "Sets emitter_samples and bsdf_samples.",
                ),
                Param::int(
                    "emitter_samples",
                    INT32,
                    1,
                    "Samples of the emitters per hit.",
                ),
                Param::int("bsdf_samples", INT32, 1, "Samples of the BSDF per hit."),
                HIDE,
                PER_PASS,
                TIMEOUT,
                BLOCK,
            ],
            "Direct light by multiple importance sampling.",
        )
    },
    Plugin {
        slots: INTEGRATORS,
        ..integrator(
            "moment",
            &[HIDE, PER_PASS, TIMEOUT, BLOCK],
            "The image of the integrators in it, with its second moment.",
        )
    },
    Plugin {
        slots: INTEGRATORS,
        ..integrator(
            "aov",
            &[
                Param {
                    name: "aovs",
                    kind: Kind::Text,
                    default: Default::Required,
                    doc: "Comma-separated name:type; types: albedo depth position uv geo_normal sh_normal prim_index shape_index.",
                },
                HIDE,
                PER_PASS,
                TIMEOUT,
                BLOCK,
            ],
            "Images of properties of the first hit, beside those of the integrators in it.",
        )
    },
];
