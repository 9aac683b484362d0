//! A surface given as a grid of signed distances: where their trilinear interpolation is zero.
//!
//! A ray is followed from voxel to voxel; along it the interpolated distance is a cubic polynomial, whose
//! first change of sign is the hit (Hansson-Söderlund, Evans & Akenine-Möller 2022, "Ray Tracing of Signed
//! Distance Function Grids", sections 3 and 4). All in f64. The sign is carried over from one voxel to the
//! next, so no rounding lets a ray slip through where they meet.

use std::sync::Arc;

use super::analytic::{in_reach, outward_box};
use super::{Hit, PlaceId, RawHit, Ray, SurfaceSample};
use crate::math::{Aabb, DVec3, Frame, Transform, Vec2, Vec3, fp};

/// Distances at the vertices of a regular grid over the unit cube, positive outside.
#[derive(Debug, PartialEq)]
pub struct SdfGrid {
    /// Vertices along x, y and z; at least 2 each.
    size: [usize; 3],
    /// x runs fastest.
    values: Vec<f32>,
    /// What each voxel holds; as `values`, with one less along each axis.
    voxels: Vec<Voxel>,
}

/// The signs in a voxel; 0 counts as outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Voxel {
    Inside,
    Outside,
    /// Some surface passes through.
    Surface,
}

impl SdfGrid {
    /// `size`: vertices along x, y and z; `values`: distances, x fastest.
    ///
    /// # Errors
    /// Too small a grid, a number of values that does not fit it, values that are no finite numbers, or no
    /// surface, told for a user.
    pub fn new(size: [usize; 3], values: Vec<f32>) -> Result<SdfGrid, String> {
        let [nx, ny, nz] = size;
        if size.iter().any(|n| *n < 2) {
            return Err(format!(
                "the grid has {nx} x {ny} x {nz} values: it needs at least 2 along each axis"
            ));
        }
        let count = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz));
        if count != Some(values.len()) {
            return Err(format!(
                "a grid of {nx} x {ny} x {nz} does not have {} values",
                values.len()
            ));
        }
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            return Err(format!("value {i} of the grid is not a finite number"));
        }
        let mut grid = SdfGrid {
            size,
            values,
            voxels: Vec::new(),
        };
        let mut voxels = Vec::with_capacity((nx - 1) * (ny - 1) * (nz - 1));
        for z in 0..nz - 1 {
            for y in 0..ny - 1 {
                voxels.extend((0..nx - 1).map(|x| Voxel::of(grid.corners([x, y, z]))));
            }
        }
        if !voxels.contains(&Voxel::Surface) {
            return Err("the grid holds no surface: its values have all one sign".into());
        }
        grid.voxels = voxels;
        Ok(grid)
    }

    /// Values at the corners of a voxel, x fastest.
    fn corners(&self, [x, y, z]: [usize; 3]) -> [f64; 8] {
        let [nx, ny, _] = self.size;
        std::array::from_fn(|i| {
            let (x, y, z) = (x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
            f64::from(self.values[(z * ny + y) * nx + x])
        })
    }

    fn voxel(&self, [x, y, z]: [usize; 3]) -> Voxel {
        let [nx, ny, _] = self.size;
        self.voxels[(z * (ny - 1) + y) * (nx - 1) + x]
    }

    /// Voxels along each axis: the side of the grid in its own coordinates.
    fn extent(&self) -> DVec3 {
        let [x, y, z] = self.size.map(|n| (n - 1) as f64);
        DVec3::new(x, y, z)
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.values[..]) + size_of_val(&self.voxels[..])
    }
}

impl Voxel {
    fn of(corners: [f64; 8]) -> Voxel {
        let inside = corners.iter().filter(|v| **v < 0.0).count();
        match inside {
            0 => Voxel::Outside,
            8 => Voxel::Inside,
            _ => Voxel::Surface,
        }
    }
}

/// The zero surface of a grid, the unit cube of which is placed by any affine map. Texture coordinates are
/// (0, 0) everywhere.
#[derive(Clone, Debug)]
pub struct Sdf {
    grid: Arc<SdfGrid>,
    to_world: Transform,
    /// Interpolate the normals between voxels.
    smooth: bool,
}

/// Where a ray meets the surface, in coordinates of the grid.
struct Meeting {
    t: f64,
    at: DVec3,
    voxel: [usize; 3],
}

impl Sdf {
    pub fn new(grid: Arc<SdfGrid>, to_world: Transform, smooth: bool) -> Sdf {
        Sdf {
            grid,
            to_world,
            smooth,
        }
    }

    /// The box of the whole grid.
    pub fn bounds(&self) -> Aabb {
        let corner = |i: u32| {
            let bit = |b: u32| f64::from(i >> b & 1);
            self.to_world.point(DVec3::new(bit(0), bit(1), bit(2)))
        };
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = (0..8)
            .map(corner)
            .fold(start, |(lo, hi), p| (lo.min(p), hi.max(p)));
        outward_box(lo, hi)
    }

    /// Memory that the grid takes.
    pub fn bytes(&self) -> usize {
        self.grid.bytes()
    }

    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<(f32, Vec2)> {
        let meeting = self.meet(ray, t_max.into())?;
        in_reach(meeting.t, t_max).map(|t| (t, Vec2::ZERO))
    }

    pub(super) fn hit(&self, ray: &Ray, raw: &RawHit) -> Hit {
        // The distance was rounded, maybe downwards.
        let meeting = self.meet(ray, raw.t.next_up().into());
        let t = meeting.as_ref().map_or(raw.t.into(), |m| m.t);
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let p = (o + d * t).as_vec3();
        let (ng, ns) = match &meeting {
            Some(m) => self.normals(m),
            None => {
                let back = -ray.d.normalize_or(Vec3::Z);
                (back, back)
            }
        };
        let f64_error = ((o.length() + t * d.length()) * 16.0 * f64::EPSILON) as f32;
        Hit {
            p,
            p_err: p.abs() * fp::gamma(3) + Vec3::splat(f64_error),
            ng,
            frame: Frame::from_normal(ns),
            uv: Vec2::ZERO,
            wo: -ray.d,
            time: ray.time,
            shape: raw.shape,
            place: PlaceId::NONE,
            prim: raw.prim,
            bary: raw.uv,
        }
    }

    /// A stand-in, as the surface is not sampled: the centre of the box, facing nowhere.
    pub(super) fn no_sample(&self) -> SurfaceSample {
        SurfaceSample {
            p: self.to_world.point(DVec3::splat(0.5)).as_vec3(),
            p_err: Vec3::ZERO,
            ng: Vec3::ZERO,
            ns: Vec3::ZERO,
            uv: Vec2::ZERO,
            pdf_a: f32::MAX,
        }
    }

    /// The first change of sign along `ray` beyond its origin.
    fn meet(&self, ray: &Ray, t_max: f64) -> Option<Meeting> {
        let extent = self.grid.extent();
        let inverse = self.to_world.inverse();
        let o = inverse.point(ray.o.as_dvec3()) * extent;
        let d = inverse.vector(ray.d.as_dvec3()) * extent;
        let mut walk = Walk::new(o, d, t_max, extent)?;
        // Whether the ray is outside, once that is known.
        let mut outside = None;
        loop {
            let t_out = walk.t_out();
            let change = match self.grid.voxel(walk.voxel) {
                Voxel::Surface => {
                    let from = o + d * walk.t - walk.lower();
                    let cubic = Cubic::along(self.grid.corners(walk.voxel), from, d);
                    let outside = *outside.get_or_insert(cubic.at(0.0) >= 0.0);
                    cubic.first_change(outside, t_out - walk.t)
                }
                plain => {
                    let before = outside.replace(plain == Voxel::Outside);
                    (before.is_some() && before != outside).then_some(0.0)
                }
            };
            if let Some(s) = change {
                let t = walk.t + s;
                return Some(Meeting {
                    t,
                    at: o + d * t,
                    voxel: walk.voxel,
                });
            }
            if !walk.step(t_out) {
                return None;
            }
        }
    }

    /// Geometric and shading normal.
    fn normals(&self, m: &Meeting) -> (Vec3, Vec3) {
        let gradient = self.gradient(m.voxel, m.at);
        let to_world = |n: DVec3| self.to_world.normal(n).try_normalize();
        let ng = to_world(gradient).unwrap_or(DVec3::Z);
        let ns = match self.smooth {
            true => to_world(self.smooth_normal(m)).unwrap_or(ng),
            false => ng,
        };
        (ng.as_vec3(), ns.as_vec3())
    }

    /// Gradient, over the unit cube, of the polynomial of `voxel`.
    fn gradient(&self, voxel: [usize; 3], at: DVec3) -> DVec3 {
        DVec3::from(std::array::from_fn(|axis| self.slope(axis, voxel, at)))
    }

    /// One component of the gradient: differences along the four edges of `voxel`, interpolated.
    fn slope(&self, axis: usize, voxel: [usize; 3], at: DVec3) -> f64 {
        let c = self.grid.corners(voxel);
        let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let local = |a: usize| (at[a] - voxel[a] as f64).clamp(0.0, 1.0);
        let difference = |edge: usize| c[edge | 1 << axis] - c[edge];
        let low = lerp(difference(0), difference(1 << j), local(j));
        let high = lerp(difference(1 << k), difference(1 << j | 1 << k), local(j));
        lerp(low, high, local(k)) * self.grid.extent()[axis]
    }

    /// The normal as Mitsuba smooths it: the slope along each axis is taken in the two voxels on that axis
    /// whose centres enclose the point; the eight unit normals that their combinations give are weighed by
    /// the distances from the centres. At the border the outermost voxel stands for the missing one, on
    /// all sides (in Mitsuba 3.9.1 on the lower ones; on the upper ones it takes a slope of zero).
    fn smooth_normal(&self, m: &Meeting) -> DVec3 {
        let last = self.grid.size.map(|n| n - 2);
        let pairs: [[(f64, f64); 2]; 3] = std::array::from_fn(|axis| {
            let x = m.at[axis] - 0.5;
            let share = x - x.floor();
            let slope = |cell: f64| {
                let mut voxel = m.voxel;
                voxel[axis] = (cell.max(0.0) as usize).min(last[axis]);
                self.slope(axis, voxel, m.at)
            };
            [
                (slope(x.floor()), 1.0 - share),
                (slope(x.floor() + 1.0), share),
            ]
        });
        let mut sum = DVec3::ZERO;
        for (x, wx) in pairs[0] {
            for (y, wy) in pairs[1] {
                for (z, wz) in pairs[2] {
                    sum += DVec3::new(x, y, z).normalize_or_zero() * (wx * wy * wz);
                }
            }
        }
        sum
    }
}

/// The voxels along a ray (Amanatides & Woo 1987). Distances to the next planes come from the plane, not
/// from a sum of steps, so their errors do not grow.
struct Walk {
    o: DVec3,
    d: DVec3,
    /// 1 / d
    inverse: DVec3,
    last: [usize; 3],
    /// Where the ray enters the voxel and where it leaves the grid or ends.
    t: f64,
    t_end: f64,
    voxel: [usize; 3],
    /// Distances of the planes through which the ray would leave the voxel along each axis.
    planes: [f64; 3],
}

impl Walk {
    /// `None` where the ray does not pass through the grid.
    fn new(o: DVec3, d: DVec3, t_max: f64, extent: DVec3) -> Option<Walk> {
        let inverse = d.recip();
        let (mut t, mut t_end) = (0f64, t_max);
        for axis in 0..3 {
            if d[axis] != 0.0 {
                let (a, b) = (
                    -o[axis] * inverse[axis],
                    (extent[axis] - o[axis]) * inverse[axis],
                );
                (t, t_end) = (t.max(a.min(b)), t_end.min(a.max(b)));
            } else if !(0.0..=extent[axis]).contains(&o[axis]) {
                return None;
            }
        }
        let start = o + d * t;
        if !(t <= t_end && start.is_finite()) {
            return None;
        }
        let last = extent.to_array().map(|n| n as usize - 1);
        let voxel = |axis: usize| (start[axis].max(0.0) as usize).min(last[axis]);
        let mut walk = Walk {
            o,
            d,
            inverse,
            last,
            t,
            t_end,
            voxel: std::array::from_fn(voxel),
            planes: [f64::INFINITY; 3],
        };
        (0..3).for_each(|axis| walk.find_plane(axis));
        Some(walk)
    }

    /// The corner of least coordinates.
    fn lower(&self) -> DVec3 {
        DVec3::from(self.voxel.map(|i| i as f64))
    }

    fn find_plane(&mut self, axis: usize) {
        if self.d[axis] != 0.0 {
            let ahead = self.voxel[axis] + usize::from(self.d[axis] > 0.0);
            self.planes[axis] = (ahead as f64 - self.o[axis]) * self.inverse[axis];
        }
    }

    /// Where the ray leaves the voxel.
    fn t_out(&self) -> f64 {
        let [a, b, c] = self.planes;
        a.min(b).min(c).min(self.t_end).max(self.t)
    }

    /// On to the next voxel; false at the end.
    fn step(&mut self, t_out: f64) -> bool {
        let [a, b, c] = self.planes;
        let axis = match (a <= b && a <= c, b <= c) {
            (true, _) => 0,
            (_, true) => 1,
            _ => 2,
        };
        let at = self.voxel[axis];
        let next = match self.d[axis] > 0.0 {
            true => (at < self.last[axis]).then_some(at + 1),
            false => at.checked_sub(1),
        };
        let (Some(next), true) = (next, t_out < self.t_end) else {
            return false;
        };
        (self.voxel[axis], self.t) = (next, t_out);
        self.find_plane(axis);
        true
    }
}

/// c0 + c1 s + c2 s² + c3 s³: the distance along a ray within one voxel.
struct Cubic([f64; 4]);

impl Cubic {
    /// Along `from + s d`, in coordinates of the voxel, by its `corners`.
    fn along(corners: [f64; 8], from: DVec3, d: DVec3) -> Cubic {
        let [v0, vx, vy, vxy, vz, vxz, vyz, vxyz] = corners;
        // The interpolation as polynomial of x, y and z.
        let (kx, ky, kz) = (vx - v0, vy - v0, vz - v0);
        let (kxy, kyz, kxz) = (vxy - vx - ky, vyz - vy - kz, vxz - vx - kz);
        let kxyz = vxyz - vxy - vxz + vx - (vyz - vy - vz + v0);
        let DVec3 { x, y, z } = from;
        let c0 = v0 + kx * x + ky * y + kz * z + kxy * x * y + kyz * y * z + kxz * x * z;
        let c1 = d.x * (kx + kxy * y + kxz * z + kxyz * y * z)
            + d.y * (ky + kxy * x + kyz * z + kxyz * x * z)
            + d.z * (kz + kyz * y + kxz * x + kxyz * x * y);
        let c2 = d.x * d.y * (kxy + kxyz * z)
            + d.y * d.z * (kyz + kxyz * x)
            + d.x * d.z * (kxz + kxyz * y);
        Cubic([c0 + kxyz * x * y * z, c1, c2, kxyz * d.x * d.y * d.z])
    }

    fn at(&self, s: f64) -> f64 {
        let Cubic([c0, c1, c2, c3]) = self;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// Least s in [0, end] from which on the sign is not that of `outside` any more. Between its extrema
    /// the polynomial is monotone, so each stretch has one change at most.
    fn first_change(&self, outside: bool, end: f64) -> Option<f64> {
        let mut from = 0.0;
        for to in self.extrema(end).into_iter().flatten().chain([end]) {
            if (self.at(to) >= 0.0) != outside {
                return Some(match (self.at(from) >= 0.0) == outside {
                    true => self.bisect(from, to, outside),
                    false => from,
                });
            }
            from = to;
        }
        None
    }

    /// Extrema within (0, end), ascending.
    fn extrema(&self, end: f64) -> [Option<f64>; 2] {
        let Cubic([_, c1, c2, c3]) = self;
        let discriminant = c2 * c2 - 3.0 * c3 * c1;
        if discriminant.is_nan() || discriminant < 0.0 {
            return [None, None];
        }
        // Without cancellation; either is infinite or NaN where there are fewer.
        let q = -(c2 + discriminant.sqrt().copysign(*c2));
        let within = |s: f64| (s > 0.0 && s < end).then_some(s);
        match (within(q / (3.0 * c3)), within(c1 / q)) {
            (Some(a), Some(b)) if b < a => [Some(b), Some(a)],
            pair => [pair.0, pair.1],
        }
    }

    /// Where the sign changes within [a, b], to the last bit of it: Newton's method, kept within the
    /// bracket by halving.
    fn bisect(&self, mut a: f64, mut b: f64, outside: bool) -> f64 {
        let Cubic([_, c1, c2, c3]) = self;
        let mut s = 0.5 * (a + b);
        for _ in 0..100 {
            let value = self.at(s);
            if (value >= 0.0) == outside {
                a = s;
            } else {
                b = s;
            }
            let next = s - value / (c1 + s * (2.0 * c2 + s * 3.0 * c3));
            let next = if next > a && next < b {
                next
            } else {
                0.5 * (a + b)
            };
            if next == s || next <= a || next >= b {
                break;
            }
            s = next;
        }
        s
    }
}
