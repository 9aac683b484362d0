//! Nothing that is not there stands in the way.

use crate::common::Rng;
use crate::rooms::{quad, room};
use luxel::math::DVec3;
use luxel::radiosity::form_factors::sight::Sight;

/// From a low wall to the floor whose edge it stands on: rays a hundred times shorter than the floor is wide.
#[test]
fn short_rays_to_large_surfaces_are_not_lost() {
    let floor = quad(DVec3::ZERO, DVec3::X, DVec3::Y);
    let wall = quad(DVec3::ZERO, DVec3::Y, DVec3::Z * 0.01);
    let room = room(&(floor + &wall), f64::INFINITY, 1e-3);
    let sight = Sight::new(&room.scene, &room.mesh, 1, 1);
    let piece = |patch: u32| room.mesh.patches[patch as usize].piece;
    let mut rng = Rng::new(1);
    let (mut seen, mut lost) = (0u32, 0u32);
    for strip in 1..room.mesh.len() as u32 {
        for _ in 0..20_000 {
            let x = piece(strip).sample(rng.vec2().as_dvec2());
            let [slope, side] = rng.vec2().to_array().map(f64::from);
            // Downwards, mostly by less than the height of the wall.
            let along = x.z / (0.1 + 2.0 * slope);
            let y = DVec3::new(along, x.y + along * (2.0 * side - 1.0), 0.0);
            // Nearer to the floor than the errors of both, nothing can be told.
            if x.z > 1e-5 && (0.0..1.0).contains(&y.y) {
                seen += 1;
                lost += u32::from(sight.places((strip, x), (0, y)) < 1.0);
            }
        }
    }
    assert!(seen > 900_000, "{seen}");
    assert_eq!(lost, 0, "of {seen}");
}
