//! Rooms whose surfaces fall on one grid: patches of all solvers are then the same squares.

use crate::render;
use luxel::scene::Scene;

/// A wall, floor or lid: corner and two edges, counter-clockwise as seen from its front.
fn quad(o: [f64; 3], e1: [f64; 3], e2: [f64; 3], more: &str) -> String {
    let at = |i: usize, s: f64, t: f64| o[i] + s * e1[i] + t * e2[i];
    let n = [
        e1[1] * e2[2] - e1[2] * e2[1],
        e1[2] * e2[0] - e1[0] * e2[2],
        e1[0] * e2[1] - e1[1] * e2[0],
    ];
    let row = |i: usize| {
        let middle = at(i, 0.5, 0.5);
        format!("{} {} {} {middle}", 0.5 * e1[i], 0.5 * e2[i], n[i])
    };
    format!(
        "<shape type='rectangle'><transform name='to_world'><matrix value='{} {} {} 0 0 0 1'/></transform>{more}</shape>",
        row(0),
        row(1),
        row(2)
    )
}

fn diffuse([r, g, b]: [f64; 3]) -> String {
    format!("<bsdf type='diffuse'><rgb name='reflectance' value='{r}, {g}, {b}'/></bsdf>")
}

const WHITE: [f64; 3] = [0.7, 0.7, 0.7];
const RED: [f64; 3] = [0.6, 0.1, 0.1];
const GREEN: [f64; 3] = [0.1, 0.5, 0.2];

fn checkers() -> String {
    "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'><rgb name='color0' value='0.1'/>\
     <rgb name='color1' value='0.8'/><transform name='to_uv'><scale x='3' y='3'/></transform></texture></bsdf>"
        .to_string()
}

/// The inside of the box from the origin to `size`: floor, ceiling, then the walls at x = 0, x = size, z = 0,
/// z = size, each with what it is made of.
fn inside([x, y, z]: [f64; 3], made_of: [String; 6]) -> String {
    let [floor, ceiling, left, right, back, front] = made_of;
    quad([0.0; 3], [0.0, 0.0, z], [x, 0.0, 0.0], &floor)
        + &quad([0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z], &ceiling)
        + &quad([0.0; 3], [0.0, y, 0.0], [0.0, 0.0, z], &left)
        + &quad([x, 0.0, 0.0], [0.0, 0.0, z], [0.0, y, 0.0], &right)
        + &quad([0.0; 3], [x, 0.0, 0.0], [0.0, y, 0.0], &back)
        + &quad([0.0, 0.0, z], [0.0, y, 0.0], [x, 0.0, 0.0], &front)
}

/// The outside of a box, without its bottom.
fn block([x0, y0, z0]: [f64; 3], [x, y, z]: [f64; 3], made_of: &str) -> String {
    let (x1, y1, z1) = (x0 + x, y0 + y, z0 + z);
    quad([x0, y1, z0], [0.0, 0.0, z], [x, 0.0, 0.0], made_of)
        + &quad([x0, y0, z0], [0.0, 0.0, z], [0.0, y, 0.0], made_of)
        + &quad([x1, y0, z0], [0.0, y, 0.0], [0.0, 0.0, z], made_of)
        + &quad([x0, y0, z0], [0.0, y, 0.0], [x, 0.0, 0.0], made_of)
        + &quad([x0, y0, z1], [x, 0.0, 0.0], [0.0, y, 0.0], made_of)
}

fn shining(exitance: f64) -> String {
    let radiance = exitance / std::f64::consts::PI;
    format!("<emitter type='area'><rgb name='radiance' value='{radiance}'/></emitter>")
}

/// A square lamp that shines down, of 4 W.
fn lamp([x, y, z]: [f64; 3], edge: f64) -> String {
    let made_of = diffuse([0.0; 3]) + &shining(4.0 / (edge * edge));
    let corner = [x - 0.5 * edge, y, z - 0.5 * edge];
    quad(corner, [edge, 0.0, 0.0], [0.0, 0.0, edge], &made_of)
}

fn walls(floor: String) -> [String; 6] {
    [
        floor,
        diffuse(WHITE),
        diffuse(RED),
        diffuse(GREEN),
        diffuse(WHITE),
        diffuse(WHITE),
    ]
}

#[derive(Clone, Copy, Debug)]
pub enum Room {
    /// One wall shines; nothing is in the way.
    Empty,
    /// A block on the floor, a lamp below the ceiling.
    Body,
    /// The same with a chequered floor.
    Textured,
    /// The same with a lamp of a thousandth of the floor.
    SmallLamp,
    /// The lamp is behind a wall with a gap.
    Door,
}

pub const ALL: [Room; 5] = [
    Room::Empty,
    Room::Body,
    Room::Textured,
    Room::SmallLamp,
    Room::Door,
];

impl Room {
    pub fn scene(self) -> Scene {
        let two = [2.0; 3];
        let body = || block([1.0, 0.0, 0.5], [0.5, 1.0, 0.5], &diffuse(WHITE));
        let above = |edge| lamp([1.0, 1.75, 1.0], edge);
        let content = match self {
            Room::Empty => {
                let mut made_of = walls(diffuse(WHITE));
                made_of[4] += &shining(1.0);
                inside(two, made_of)
            }
            Room::Body => inside(two, walls(diffuse(WHITE))) + &body() + &above(0.5),
            Room::Textured => inside(two, walls(checkers())) + &body() + &above(0.5),
            Room::SmallLamp => inside(two, walls(diffuse(WHITE))) + &body() + &above(0.0625),
            Room::Door => {
                let both = format!("<bsdf type='twosided'>{}</bsdf>", diffuse(WHITE));
                let wall = |z: f64, width: f64, y: f64, height: f64| {
                    quad([2.0, y, z], [0.0, 0.0, width], [0.0, height, 0.0], &both)
                };
                inside([4.0, 2.0, 2.0], walls(diffuse(WHITE)))
                    + &wall(0.0, 1.0, 0.0, 2.0)
                    + &wall(1.5, 0.5, 0.0, 2.0)
                    + &wall(1.0, 0.5, 1.5, 0.5)
                    + &above(0.5)
            }
        };
        let xml = format!("<scene version='3.0.0'><sensor type='perspective'/>{content}</scene>");
        render::compile(&xml).job.scene
    }
}
