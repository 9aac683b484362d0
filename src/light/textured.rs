//! Surfaces whose radiance varies over them.
//!
//! A part of such a surface keeps a table of its luminance over the unit square that its points are drawn
//! from. Where the part is far, points follow the table; where it is so near that its solid angle is
//! sampled, half of them do and half follow the solid angle, and the density is the mean of both.

use super::local::{self, Part, Towards, pdf_a_to_sr};
use crate::geom::{Geometry, Mesh, ShapeId, SurfaceSample};
use crate::math::fp::ONE_MINUS_EPSILON;
use crate::math::warp::{self, Tabulated2};
use crate::math::{DVec3, Vec2, Vec3};
use crate::texture::{At, Texture};

/// Most cells of a table along each side.
const MAX_SIDE: usize = 256;
/// Most cells of all tables of a shape.
const MAX_CELLS: usize = 1 << 22;
/// Weight that each cell gets of the mean over the shape: the table is made of samples, which may have
/// missed the one bright texel.
const FLOOR: f32 = 0.02;

/// A part, how its radiance is spread and how much of it there is.
pub(super) struct Spread {
    pub part: Part,
    /// Mean luminance.
    pub mean: f32,
    /// `None` where one cell is enough.
    pub table: Option<Tabulated2>,
}

/// The parts of a shape that shines with `radiance`.
pub(super) fn spread(shape: ShapeId, g: &Geometry, radiance: &Texture) -> Vec<Spread> {
    let parts = local::parts_of(shape, g);
    let limit = ((MAX_CELLS / parts.len().max(1)) as f64).sqrt() as usize;
    let limit = limit.clamp(1, MAX_SIDE);
    // Weights of the cells, width and area of each part.
    let mut sampled = Vec::with_capacity(parts.len());
    let (mut sum, mut total) = (0.0, 0.0);
    for part in parts {
        let side = texels_across(&part, g, radiance).clamp(1, limit);
        let weights = sample_cells(&part, g, radiance, side);
        let mean = weights.iter().map(|&w| f64::from(w)).sum::<f64>() / weights.len() as f64;
        let area = part.area(g);
        sum += mean * area;
        total += area;
        sampled.push((part, weights, side, mean));
    }
    let floor = match total > 0.0 && sum > 0.0 {
        true => FLOOR * (sum / total) as f32,
        false => f32::MIN_POSITIVE,
    };
    let with_table = |(part, mut weights, side, mean): (Part, Vec<f32>, usize, f64)| {
        let table = (side > 1 && can_locate(&part, g)).then(|| {
            weights.iter_mut().for_each(|w| *w += floor);
            Tabulated2::new(&weights, side, side)
        });
        Spread {
            part,
            mean: mean as f32 + floor,
            table: table.flatten(),
        }
    };
    sampled.into_iter().map(with_table).collect()
}

/// How many texels the part covers along its longer side, where that is known.
fn texels_across(part: &Part, g: &Geometry, radiance: &Texture) -> usize {
    let [w, h] = match radiance {
        Texture::Constant(_) => return 1,
        Texture::Bitmap(b) => [b.texels.width, b.texels.height],
        // Of unknown grain.
        _ => [64; 2],
    };
    let Geometry::Mesh(m) = g else {
        return w.max(h) as usize;
    };
    let (mut lo, mut hi) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    for prim in part.prims() {
        for b in [Vec2::ZERO, Vec2::X, Vec2::Y] {
            let uv = m.surface_sample(prim, b).uv;
            (lo, hi) = (lo.min(uv), hi.max(uv));
        }
    }
    let texels = (hi - lo) * Vec2::new(w as f32, h as f32);
    // Float casts saturate, and make 0 of NaN.
    texels.max_element().ceil() as usize
}

/// Mean luminance of `side` x `side` cells of the unit square.
fn sample_cells(part: &Part, g: &Geometry, radiance: &Texture, side: usize) -> Vec<f32> {
    // Samples along each side of a cell; a texture of one cell still gets a fair mean.
    let fine = (16 / side).clamp(3, 8);
    let mut weights = vec![0f32; side * side];
    let step = 1.0 / (side * fine) as f32;
    for y in 0..side * fine {
        for x in 0..side * fine {
            let u = (Vec2::new(x as f32, y as f32) + 0.5) * step;
            let value = radiance.eval(&place(part, g, u).1).luminance();
            weights[y / fine * side + x / fine] += value / (fine * fine) as f32;
        }
    }
    for w in &mut weights {
        *w = if w.is_finite() { w.max(0.0) } else { 0.0 };
    }
    weights
}

/// The point that `u` in [0,1)² gives, uniform over the area, and the place on the surface.
pub(super) fn place(part: &Part, g: &Geometry, u: Vec2) -> (SurfaceSample, At) {
    match (part, g) {
        (Part::Triangle { prim, .. }, Geometry::Mesh(m)) => {
            let bary = warp::triangle(u);
            let at = m.surface_sample(*prim, bary);
            let uv = at.uv;
            (
                at,
                At {
                    uv,
                    prim: *prim,
                    bary,
                },
            )
        }
        (
            Part::Rectangle {
                rectangle, prim, ..
            },
            Geometry::Mesh(m),
        ) => {
            let (prim, bary) = on_pair(m, *prim, rectangle.at(u));
            let at = m.surface_sample(prim, bary);
            let uv = at.uv;
            (at, At { uv, prim, bary })
        }
        _ => {
            let at = g.sample_area(0, u);
            let uv = at.uv;
            (
                at,
                At {
                    uv,
                    ..At::default()
                },
            )
        }
    }
}

/// Whether [`locate`] undoes [`place`].
fn can_locate(part: &Part, g: &Geometry) -> bool {
    !matches!(part, Part::Whole { .. })
        || matches!(
            g,
            Geometry::Sphere(_) | Geometry::Disk(_) | Geometry::Cylinder(_)
        )
}

/// The numbers in [0,1)² for which [`place`] returns the point `p`, which lies on the surface at `at`.
fn locate(part: &Part, g: &Geometry, p: Vec3, at: &At) -> Vec2 {
    let u = match (part, g) {
        (Part::Triangle { .. }, _) => warp::triangle_inverse(at.bary),
        (Part::Rectangle { rectangle, .. }, _) => rectangle.locate(p),
        (_, Geometry::Sphere(s)) => {
            let n = (p.as_dvec3() - s.center()) / s.radius();
            let turn = n.y.atan2(n.x) / std::f64::consts::TAU;
            let turn = if turn < 0.0 { turn + 1.0 } else { turn };
            Vec2::new((0.5 - 0.5 * n.z) as f32, turn as f32)
        }
        (_, Geometry::Disk(_)) => Vec2::new(at.uv.x * at.uv.x, at.uv.y),
        _ => at.uv,
    };
    u.clamp(Vec2::ZERO, Vec2::splat(ONE_MINUS_EPSILON))
}

/// Triangle `prim` or the next one, whichever holds the point `p` of their rectangle, and its weights there.
fn on_pair(m: &Mesh, prim: u32, p: Vec3) -> (u32, Vec2) {
    let b = weights_at(m, prim, p);
    if b.min_element() >= 0.0 && b.x + b.y <= 1.0 {
        (prim, b)
    } else {
        (prim + 1, weights_at(m, prim + 1, p))
    }
}

/// Barycentric weights of the second and third corner of triangle `prim` at the point `p` of its plane.
pub(super) fn weights_at(m: &Mesh, prim: u32, p: Vec3) -> Vec2 {
    let [a, b, c] = m.triangle(prim).map(|p| p.as_dvec3());
    let (e1, e2, d) = (b - a, c - a, p.as_dvec3() - a);
    let n: DVec3 = e1.cross(e2);
    let scale = 1.0 / n.length_squared();
    if !scale.is_finite() {
        return Vec2::ZERO;
    }
    Vec2::new(
        (d.cross(e2).dot(n) * scale) as f32,
        (e1.cross(d).dot(n) * scale) as f32,
    )
}

/// The place on the surface of the point `p` of a part.
pub(super) fn at_point(part: &Part, g: &Geometry, p: Vec3) -> At {
    match (part, g) {
        (Part::Triangle { prim, .. }, Geometry::Mesh(m)) => {
            at_weights(m, *prim, weights_at(m, *prim, p))
        }
        (Part::Rectangle { prim, .. }, Geometry::Mesh(m)) => {
            let (prim, bary) = on_pair(m, *prim, p);
            at_weights(m, prim, bary)
        }
        _ => At {
            uv: g.uv_at(p),
            ..At::default()
        },
    }
}

/// The place on triangle `prim` at the barycentric weights `bary`.
pub(super) fn at_weights(m: &Mesh, prim: u32, bary: Vec2) -> At {
    let uv = m.surface_sample(prim, bary).uv;
    At { uv, prim, bary }
}

/// Share of the samples that follow the table.
fn table_share(part: &Part, g: &Geometry, eye: Vec3) -> f32 {
    if part.is_by_area(g, eye) { 1.0 } else { 0.5 }
}

/// A point to connect to from `eye`, and the place on the surface.
pub(super) fn sample(
    part: &Part,
    g: &Geometry,
    table: Option<&Tabulated2>,
    eye: Vec3,
    mut u: Vec2,
) -> Option<(Towards, At)> {
    let Some(table) = table else {
        let towards = part.sample(g, eye, u)?;
        return Some((towards, at_point(part, g, towards.end.p)));
    };
    let share = table_share(part, g, eye);
    let by_table = u.x < share;
    u.x = match by_table {
        true => u.x / share,
        false => (u.x - share) / (1.0 - share),
    };
    u = u.min(Vec2::splat(ONE_MINUS_EPSILON));
    let mut towards;
    let at;
    if by_table {
        let (u, density) = table.sample(u);
        let (surface, place) = place(part, g, u);
        let area = part.area(g);
        at = place;
        towards = local::connect(surface, eye, |s, d| {
            pdf_a_to_sr(local::bounded(f64::from(density) / area), d, s.ng)
        })?;
        if share < 1.0 {
            let rival = part.pdf(g, eye, towards.end.p, towards.end.ng);
            towards.pdf = share * towards.pdf + (1.0 - share) * rival;
        }
    } else {
        towards = part.sample(g, eye, u)?;
        at = at_point(part, g, towards.end.p);
        let rival = table_pdf(part, g, table, eye, (towards.end.p, towards.end.ng, &at));
        towards.pdf = share * rival + (1.0 - share) * towards.pdf;
    }
    (towards.pdf > 0.0 && towards.pdf < f32::MAX).then_some((towards, at))
}

/// Density per unit of area of the points that follow the table, relative to that of uniform ones, at the
/// point `p` of the surface.
pub(super) fn table_density(
    part: &Part,
    g: &Geometry,
    table: &Tabulated2,
    p: Vec3,
    at: &At,
) -> f32 {
    table.pdf(locate(part, g, p, at))
}

fn table_pdf(
    part: &Part,
    g: &Geometry,
    table: &Tabulated2,
    eye: Vec3,
    (p, ng, at): (Vec3, Vec3, &At),
) -> f32 {
    let density = f64::from(table_density(part, g, table, p, at));
    pdf_a_to_sr(local::bounded(density / part.area(g)), p - eye, ng)
}

/// Density per steradian at `eye` with which [`sample`] returns a point, given with its normal and place.
pub(super) fn pdf(
    part: &Part,
    g: &Geometry,
    table: Option<&Tabulated2>,
    eye: Vec3,
    met: (Vec3, Vec3, &At),
) -> f32 {
    let (p, ng, _) = met;
    let Some(table) = table else {
        return part.pdf(g, eye, p, ng);
    };
    let share = table_share(part, g, eye);
    let by_table = table_pdf(part, g, table, eye, met);
    if share < 1.0 {
        share * by_table + (1.0 - share) * part.pdf(g, eye, p, ng)
    } else {
        by_table
    }
}
