use super::split::{self, MOST};
use super::*;
use crate::math::{DVec3, Motion, Transform};

fn flight(way: f64) -> Motion {
    let keys = [0.0, way].map(|x| Transform::translate(DVec3::new(x, 0.3 * x, 0.0)));
    Motion::new(&[(0.0, keys[0]), (1.0, keys[1])], [0.0, 1.0]).unwrap()
}

const CUBE: Aabb = Aabb {
    min: Vec3::NEG_ONE,
    max: Vec3::ONE,
};

#[test]
fn what_flies_far_is_cut_and_what_hardly_moves_is_not() {
    let count = |way: f64| split::of_motion(&flight(way), CUBE).len() as u32;
    assert_eq!(count(0.01), 1);
    assert_eq!(count(1000.0), MOST);
    let counts = [0.01, 0.1, 1.0, 10.0, 100.0].map(count);
    assert!(counts.is_sorted(), "{counts:?}");
}

#[test]
fn each_time_belongs_to_one_stretch_whose_box_holds_the_thing() {
    let motion = flight(20.0);
    let what = What::Place(PlaceId(0));
    let pieces: Vec<_> = split::of_motion(&motion, CUBE)
        .into_iter()
        .map(|p| p.stretch(what))
        .collect();
    assert!(pieces.len() > 4);
    for i in -10..1034 {
        let time = i as f32 / 1024.0;
        let mut of_time = pieces.iter().filter(|p| p.0.contains(time));
        let (_, bounds) = of_time.next().expect("a time without a box");
        assert!(of_time.next().is_none(), "two boxes at {time}");
        let there = motion.bounds(CUBE, time.clamp(0.0, 1.0), time.clamp(0.0, 1.0));
        assert_eq!(bounds.union(there), *bounds, "at {time}");
    }
}
