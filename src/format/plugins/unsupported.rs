//! Plugins that scenes written for Mitsuba may name and luxel does not know, with what to do instead.

use super::Category;
use Category::{Bsdf, Emitter, Film, Integrator, Sampler, Sensor, Shape, Texture};

const SURFACES: &str = "luxel renders surfaces only; leave participating media out";
const MESH: &str = "export the shape as a mesh in a PLY or OBJ file";
const METHOD: &str = "use the integrator \"path\"";
const DERIVATIVE: &str = "luxel computes no derivatives; use the integrator \"path\"";
const RGB: &str = "luxel renders in RGB; write the colour with <rgb>";
const BAKE: &str = "bake the texture into an image and use the texture \"bitmap\"";
const NEAR_BSDF: &str = "use the nearest of diffuse, plastic, roughplastic, conductor, roughconductor, dielectric and roughdielectric";

const TABLE: &[(Category, &[&str], &str)] = &[
    (
        Shape,
        &[
            "bsplinecurve",
            "linearcurve",
            "ellipsoids",
            "ellipsoidsmesh",
            "heightfield",
            "hair",
            "deformable",
            "blender",
            "merge",
        ],
        MESH,
    ),
    (
        Bsdf,
        &[
            "pplastic",
            "phong",
            "ward",
            "roughdiffuse",
            "roughcoating",
            "coating",
            "hair",
            "irawan",
            "difftrans",
            "hk",
            "mixturebsdf",
        ],
        NEAR_BSDF,
    ),
    (
        Bsdf,
        &["displacement"],
        "use \"bumpmap\", or put the relief into the mesh",
    ),
    (
        Bsdf,
        &[
            "measured",
            "measured_polarized",
            "polarizer",
            "retarder",
            "circular",
        ],
        "luxel renders unpolarized RGB; use the nearest of diffuse, conductor, roughconductor and dielectric",
    ),
    (
        Emitter,
        &[
            "collimated",
            "sun",
            "sky",
            "sunsky",
            "volumelight",
            "timed_sunsky",
        ],
        "use a directional light, an area light or an environment map",
    ),
    (Texture, &["rawconstant", "discrete"], RGB),
    (
        Texture,
        &[
            "volume",
            "vertexcolors",
            "scale",
            "gridtexture",
            "wireframe",
            "curvature",
        ],
        BAKE,
    ),
    (
        Sensor,
        &[
            "spherical",
            "telecentric",
            "perspective_rdist",
            "batch",
            "mpath",
        ],
        "use one of the sensors \"perspective\", \"thinlens\" and \"orthographic\"",
    ),
    (
        Sensor,
        &["fluencemeter"],
        "use the sensor \"irradiancemeter\" inside a shape",
    ),
    (
        Film,
        &["ldrfilm", "mfilm", "specfilm", "tiledhdrfilm", "libfilm"],
        "use the film \"hdrfilm\"; -o with a name ending in .png writes an 8-bit image",
    ),
    (
        Integrator,
        &[
            "ptracer",
            "photonmapper",
            "ppm",
            "sppm",
            "bdpt",
            "mlt",
            "pssmlt",
            "erpt",
            "vpl",
            "irrcache",
            "adaptive",
            "depth",
            "stokes",
            "volpath",
            "volpathmis",
            "volpath_simple",
        ],
        METHOD,
    ),
    (
        Integrator,
        &[
            "prb",
            "prb_basic",
            "prb_projective",
            "prbvolpath",
            "direct_projective",
            "volprim_rf_basic",
        ],
        DERIVATIVE,
    ),
    (
        Sampler,
        &["halton", "hammersley"],
        "use the sampler \"sobol\" or \"independent\"",
    ),
];

/// What to do about a plugin that is known but not supported; `None` for a name that nobody knows.
pub fn why_unsupported(category: Category, name: &str) -> Option<&'static str> {
    match category {
        Category::Medium | Category::Volume | Category::Phase => Some(SURFACES),
        _ => TABLE
            .iter()
            .find(|(c, names, _)| *c == category && names.contains(&name))
            .map(|(_, _, help)| *help),
    }
}
