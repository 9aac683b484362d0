//! What a scene requires, and what is therefore modelled.

use crate::geom::World;
use crate::light::{Emitter, Lights};
use crate::material::Material;

/// One decision and its reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanEntry {
    /// What is decided on.
    pub subject: &'static str,
    /// What is done about it.
    pub decision: String,
    /// Why.
    pub reason: String,
}

/// The decisions made when the scene was compiled, in the order they were made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    pub entries: Vec<PlanEntry>,
}

impl Plan {
    pub fn add(
        &mut self,
        subject: &'static str,
        decision: impl Into<String>,
        reason: impl Into<String>,
    ) {
        self.entries.push(PlanEntry {
            subject,
            decision: decision.into(),
            reason: reason.into(),
        });
    }
}

/// What materials ask for beyond a look at their numbers.
pub fn of_materials(plan: &mut Plan, materials: &[Material]) {
    let mut any = |subject, asks: fn(&Material) -> bool, yes: [&str; 2], no: [&str; 2]| {
        let [decision, reason] = match materials.iter().any(asks) {
            true => yes,
            false => no,
        };
        plan.add(subject, decision, reason);
    };
    any(
        "reliefs",
        Material::has_relief,
        [
            "shading normals bent by a texture",
            "a material has a bump or normal map",
        ],
        ["none", "no material has a bump or normal map"],
    );
    any(
        "tangents",
        Material::follows_tangents,
        [
            "shading frames follow the texture coordinates",
            "a material is anisotropic or has a relief",
        ],
        ["none", "no material is anisotropic or has a relief"],
    );
    any(
        "mixtures",
        Material::is_mixed,
        [
            "a random number says what the surface is at each hit",
            "a material is a mask or a mixture",
        ],
        [
            "no chance in materials",
            "no material is a mask or a mixture",
        ],
    );
    any(
        "masks",
        Material::lets_through,
        [
            "shadow rays look for the surfaces that let them through",
            "a material is a mask or null",
        ],
        [
            "whatever a shadow ray meets blocks it",
            "no material is a mask or null",
        ],
    );
}

/// What shapes there are, and where they stand when.
pub fn of_world(plan: &mut Plan, world: &World) {
    match world.has_analytic() {
        true => plan.add(
            "shapes",
            "triangles and exact shapes in one tree",
            "there are spheres, disks, cylinders or grids of distances",
        ),
        false => plan.add("shapes", "triangles only", "no shape is anything else"),
    }
    match world.places().len() {
        0 => {
            let reason = "no shape is an instance or moves as a whole";
            plan.add("instances", "one tree", reason);
        }
        n => {
            let reason = format!("places of groups: {n}; a shape that moves is a group");
            plan.add("instances", "a tree of its own for each group", reason);
        }
    }
    match world.moving() {
        (0, _) => {}
        (n, stretches) => {
            let decision = format!("{stretches} boxes, each for a stretch of time");
            let reason = format!("shapes and instances that change while the shutter is open: {n}");
            plan.add("moving shapes", decision, reason);
        }
    }
}

/// How a light, and a point on it, is chosen.
pub fn of_lights(plan: &mut Plan, lights: &Lights) {
    let (decision, reason) = lights.choice();
    plan.add("light choice", decision, reason);
    let emitters = lights.emitters();
    if emitters
        .iter()
        .any(|e| matches!(e, Emitter::TexturedArea { .. }))
    {
        let decision = "points by the brightness of the texture";
        plan.add("textured lights", decision, "a surface shines by a texture");
    }
    if emitters.iter().any(|e| matches!(e, Emitter::Image(_))) {
        let decision = "directions by the brightness of the image";
        let reason = "light comes from an image of the surroundings";
        plan.add("environment", decision, reason);
    }
    if !lights.is_empty() && !emitters.iter().any(Emitter::can_be_met) {
        let reason = "every light is a point or a beam, which no ray can meet";
        plan.add("last bounce", "no ray to meet an emitter", reason);
    }
}
