//! Plugins that scenes written for Mitsuba may name and luxel does not know, with what to do instead.

use super::Category;
use Category::{Bsdf, Emitter, Film, Integrator, Sampler, Sensor, Shape, Texture};

const SURFACES: &str = "luxel renders surfaces only; leave participating media out";
const MESH: &str = "export the shape as a mesh in a PLY or OBJ file";
const METHOD: &str = "use the integrator \"path\"";
const BAKE: &str = "bake the texture into an image and use the texture \"bitmap\"";
const CAMERAS: &str = "use one of the sensors \"perspective\", \"thinlens\" and \"orthographic\"";

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
            "blender",
        ],
        MESH,
    ),
    (
        Shape,
        &["deformable"],
        "use \"filename_end\" of the shapes \"obj\", \"ply\" and \"serialized\"",
    ),
    (
        Shape,
        &["merge"],
        "put the shapes that it merges directly into the scene",
    ),
    (Bsdf, &["roughdiffuse"], "use \"diffuse\""),
    (
        Bsdf,
        &["phong", "ward", "irawan"],
        "use \"principled\", \"roughplastic\" or \"roughconductor\"",
    ),
    (
        Bsdf,
        &["coating", "roughcoating"],
        "use \"clearcoat\" of \"principled\"; over a diffuse base, \"plastic\" or \"roughplastic\"",
    ),
    (
        Bsdf,
        &["difftrans"],
        "use \"diff_trans\" of \"principledthin\"",
    ),
    (
        Bsdf,
        &["hair"],
        "luxel renders no fibres; use \"principled\" on a mesh",
    ),
    (
        Bsdf,
        &["hk"],
        "luxel renders surfaces only; use \"principled\" or \"principledthin\"",
    ),
    (
        Bsdf,
        &["mixturebsdf"],
        "use \"blendbsdf\", one within another for more than two materials",
    ),
    (
        Bsdf,
        &["displacement"],
        "use \"bumpmap\", or put the relief into the mesh",
    ),
    (
        Bsdf,
        &["measured"],
        "luxel renders no tables of measurements; use \"principled\" or \"roughconductor\"",
    ),
    (
        Bsdf,
        &["pplastic"],
        "luxel renders unpolarized light; use \"roughplastic\"",
    ),
    (
        Bsdf,
        &["measured_polarized"],
        "luxel renders unpolarized light; use \"principled\" or \"roughconductor\"",
    ),
    (
        Bsdf,
        &["polarizer", "retarder", "circular"],
        "luxel renders unpolarized light; use \"mask\" or \"thindielectric\"",
    ),
    (
        Emitter,
        &["collimated"],
        "use \"directionalarea\" in a small \"disk\"",
    ),
    (Emitter, &["sun"], "use \"directional\""),
    (
        Emitter,
        &["sky", "sunsky", "timed_sunsky"],
        "bake the sky into an image and use \"envmap\"; for the sun, \"directional\"",
    ),
    (
        Emitter,
        &["volumelight"],
        "luxel renders surfaces only; use \"area\" in a shape",
    ),
    (
        Texture,
        &["rawconstant"],
        "write the number with <float>, or the colour with <rgb>",
    ),
    (
        Texture,
        &["discrete"],
        "luxel renders in RGB; write the colour with <rgb>",
    ),
    (
        Texture,
        &["vertexcolors"],
        "use \"mesh_attribute\" with the colours in a PLY file",
    ),
    (
        Texture,
        &["volume", "scale", "gridtexture", "wireframe", "curvature"],
        BAKE,
    ),
    (
        Sensor,
        &["spherical", "telecentric", "perspective_rdist", "mpath"],
        CAMERAS,
    ),
    (
        Sensor,
        &["batch"],
        "list its sensors in the scene; luxel renders the first",
    ),
    (
        Sensor,
        &["fluencemeter"],
        "use the sensor \"irradiancemeter\" inside a shape",
    ),
    (
        Film,
        &["ldrfilm", "mfilm", "tiledhdrfilm", "libfilm"],
        "use the film \"hdrfilm\"; -o with a name ending in .png writes an 8-bit image",
    ),
    (
        Film,
        &["specfilm"],
        "luxel renders in RGB; use the film \"hdrfilm\"",
    ),
    (
        Integrator,
        &["ppm"],
        "use the integrator \"sppm\", which shoots photons for every pass and keeps none",
    ),
    (
        Integrator,
        &["mlt", "pssmlt", "erpt"],
        "luxel mutates no paths; use the integrator \"bdpt\" or \"vcm\"",
    ),
    (Integrator, &["vpl", "irrcache", "adaptive"], METHOD),
    (
        Integrator,
        &["depth"],
        "use the integrator \"aov\" with the type \"depth\"",
    ),
    (
        Integrator,
        &["stokes"],
        "luxel renders unpolarized light; use the integrator \"path\"",
    ),
    (
        Integrator,
        &[
            "volpath",
            "volpathmis",
            "volpath_simple",
            "volprim_rf_basic",
        ],
        "luxel renders surfaces only; use the integrator \"path\"",
    ),
    (
        Integrator,
        &[
            "prb",
            "prb_basic",
            "prb_projective",
            "prb_reparam",
            "prbvolpath",
            "direct_projective",
            "direct_reparam",
            "emission_reparam",
        ],
        "luxel computes no derivatives; use the integrator \"path\"",
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
