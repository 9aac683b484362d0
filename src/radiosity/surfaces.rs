//! The surfaces of a scene that take part in radiosity, cut into flat facets.

use super::dark::DarkSides;
use super::piece::{Outline, Piece};
use super::{Rgb64, optics};
use crate::geom::{Geometry, Hit, Mesh, PlaceId, RawHit, Ray, ShapeId};
use crate::math::{DVec2, DVec3, Vec2};
use crate::scene::Scene;
use std::collections::HashMap;

/// One side of a flat part of a surface: a triangle of a mesh, two that make a parallelogram, or a piece of a
/// curved shape. `piece` shows its front.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    pub piece: Piece,
    pub shape: ShapeId,
    pub place: PlaceId,
    /// Whether the front is the inside of the shape: where its geometric normal points away from.
    pub inside: bool,
    /// All facets of a shape at one place, seen from one side, have the same number.
    pub surface: u32,
    /// Whether shading hides the edges towards other facets of the surface.
    pub smooth: bool,
    origin: Origin,
}

/// What a facet was made of.
#[derive(Clone, Copy, Debug)]
enum Origin {
    Triangle(u32),
    Pair(u32, u32),
    /// Half of a cell in the parameters of a curved shape: those at the piece's three corners.
    Cell([Vec2; 3]),
}

impl Facet {
    /// Whether it stands for a part of a curved shape.
    pub fn is_curved(&self) -> bool {
        matches!(self.origin, Origin::Cell(_))
    }
}

/// Where the facets of a shape at a place are to be found.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// Into `Surfaces::facet_of`: two entries, outside and inside, per triangle, or per half of a cell.
    first: usize,
    /// Cells of a curved shape in both parameters; [0, 0] for meshes.
    cells: [u32; 2],
    known: bool,
}

/// Why a part of the scene's surface has no facets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeftOut {
    /// Shapes that move or change their form.
    pub moving: u32,
    /// Shapes that cannot be divided: grids of distances.
    pub formless: u32,
    /// Triangles without area.
    pub degenerate: u32,
    /// Area that neither reflects diffusely nor shines, from no side; and that of everything which was looked
    /// at. In squared scene units.
    pub idle_area: f64,
    pub area: f64,
}

impl LeftOut {
    /// Share of the area that neither reflects diffusely nor shines.
    pub fn share(&self) -> f64 {
        match self.area > 0.0 {
            true => self.idle_area / self.area,
            false => 0.0,
        }
    }
}

/// What of the surfaces of a scene is cut, and how.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// Largest distance of a curved shape from its facets, relative to its radius.
    pub curve_error: f64,
    /// Whether opaque surfaces that reflect in other ways than diffusely are treated as if they did so diffusely:
    /// their light is not lost, but goes astray.
    pub gloss_as_diffuse: bool,
    /// Sides that have no facets unless they shine.
    pub dark: DarkSides,
}

/// All facets, and how to find that of a hit.
#[derive(Debug)]
pub struct Surfaces {
    facets: Vec<Facet>,
    /// Of shapes that stand by themselves, by number.
    still: Vec<Slot>,
    placed: HashMap<(u32, u32), Slot>,
    facet_of: Vec<[u32; 2]>,
    pub left_out: LeftOut,
    pub cut: Cut,
}

const NONE: u32 = u32::MAX;

/// Area over the square of the longest edge of what is a line, or a point: halves of cells at poles are no more,
/// and coordinates in f32 cannot say less.
const LEAST_AREA: f64 = 1e-12;

impl Surfaces {
    /// Cuts all surfaces of `scene` that stand still. Facets keep nearer to curved shapes than `curve_error` of
    /// their radius. A side without diffuse reflection and emission has no facets.
    pub fn new(scene: &Scene, curve_error: f64) -> Surfaces {
        let cut = Cut {
            curve_error,
            ..Cut::default()
        };
        Surfaces::of(scene, cut)
    }

    /// The same as `cut` asks for.
    pub fn of(scene: &Scene, cut: Cut) -> Surfaces {
        let world = scene.world();
        let mut surfaces = Surfaces {
            facets: Vec::new(),
            still: vec![Slot::default(); world.geometries().len()],
            placed: HashMap::new(),
            facet_of: Vec::new(),
            left_out: LeftOut::default(),
            cut,
        };
        for number in 0..world.geometries().len() as u32 {
            let shape = ShapeId(number);
            match world.placement_of(shape) {
                None => {
                    let slot = surfaces.cut(scene, shape, PlaceId::NONE);
                    surfaces.still[number as usize] = slot;
                }
                Some(first) => {
                    let places = world.places().iter().enumerate();
                    for (i, _) in places.filter(|(_, place)| place.group == first.group) {
                        let slot = surfaces.cut(scene, shape, PlaceId(i as u32));
                        surfaces.placed.insert((i as u32, number), slot);
                    }
                }
            }
        }
        surfaces
    }

    pub fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// The facet at `hit` on the side of `hit.wo`; `None` where the surface takes no part.
    #[inline]
    pub fn facet_at(&self, hit: &Hit) -> Option<u32> {
        let slot = match hit.place {
            PlaceId::NONE => *self.still.get(hit.shape.0 as usize)?,
            place => *self.placed.get(&(place.0, hit.shape.0))?,
        };
        if !slot.known {
            return None;
        }
        let inside = usize::from(hit.wo.dot(hit.ng) < 0.0);
        let facet = match slot.cells {
            [0, 0] => self.facet_of.get(slot.first + hit.prim as usize)?[inside],
            [nu, nv] => {
                let cell = |x: f32, n: u32| ((x * n as f32) as u32).min(n - 1);
                let (i, j) = (cell(hit.uv.x, nu), cell(hit.uv.y, nv));
                let first = slot.first + (j * nu + i) as usize * 2;
                let halves = self.facet_of.get(first..first + 2)?;
                self.nearer([halves[0][inside], halves[1][inside]], hit.p.as_dvec3())
            }
        };
        (facet != NONE).then_some(facet)
    }

    /// Which half of a cell `p` is over, of those that there are: the edge between them is straight in space, not
    /// in the parameters of the shape.
    #[inline]
    fn nearer(&self, [a, b]: [u32; 2], p: DVec3) -> u32 {
        if a == b || b == NONE {
            return a;
        }
        let inside = |facet: u32| {
            let st = self.facets[facet as usize].piece.locate(p);
            st.x.min(st.y).min(1.0 - st.x - st.y)
        };
        match a == NONE || inside(b) > inside(a) {
            true => b,
            false => a,
        }
    }

    /// The surface at `st` of a facet, seen from its front: on the exact surface, with error bounds, as a ray
    /// would have met it.
    pub fn hit(&self, scene: &Scene, facet: u32, st: DVec2) -> Hit {
        let facet = &self.facets[facet as usize];
        look(scene, facet, st)
    }

    /// Cuts what stands at one place.
    fn cut(&mut self, scene: &Scene, shape: ShapeId, place: PlaceId) -> Slot {
        let world = scene.world();
        let moves = world
            .places()
            .get(place.0 as usize)
            .is_some_and(|place| place.motion.as_still().is_none());
        if moves {
            self.left_out.moving += 1;
            return Slot::default();
        }
        let first = self.facet_of.len();
        let cells = match &world.geometries()[shape.0 as usize] {
            Geometry::Deforming(_) => {
                self.left_out.moving += 1;
                return Slot::default();
            }
            Geometry::Sdf(_) => {
                self.left_out.formless += 1;
                return Slot::default();
            }
            Geometry::Mesh(mesh) => {
                self.cut_mesh(scene, mesh, shape, place);
                [0, 0]
            }
            curved => self.cut_curved(scene, curved, shape, place),
        };
        Slot {
            first,
            cells,
            known: true,
        }
    }

    fn cut_mesh(&mut self, scene: &Scene, mesh: &Mesh, shape: ShapeId, place: PlaceId) {
        let count = mesh.indices().len() as u32;
        let surface = self.facet_of.len() as u32 * 2;
        let smooth = !mesh.normals().is_empty();
        let mut prim = 0;
        while prim < count {
            let pair = (prim + 1 < count)
                .then(|| parallelogram(mesh, prim))
                .flatten();
            let (piece, origin) = match pair {
                Some(piece) => (piece, Origin::Pair(prim, prim + 1)),
                None => {
                    let corners = mesh.triangle(prim).map(|p| p.as_dvec3());
                    (Piece::triangle(corners), Origin::Triangle(prim))
                }
            };
            let facet = Facet {
                piece: placed(scene, place, piece),
                shape,
                place,
                inside: false,
                surface,
                smooth,
                origin,
            };
            let sides = self.add(scene, facet);
            self.facet_of.push(sides);
            if pair.is_some() {
                self.facet_of.push(sides);
                prim += 1;
            }
            prim += 1;
        }
    }

    /// Cells in both parameters of the shape, two triangles each.
    fn cut_curved(
        &mut self,
        scene: &Scene,
        shape_geometry: &Geometry,
        shape: ShapeId,
        place: PlaceId,
    ) -> [u32; 2] {
        // A chord of the angle a leaves the circle by 1 - cos(a/2) of the radius.
        let angle = 2.0 * (1.0 - self.cut.curve_error.clamp(1e-6, 0.3)).acos();
        let around = |angle: f64| (std::f64::consts::TAU / angle).ceil().max(6.0) as u32;
        let (nu, nv) = match shape_geometry {
            // The middle of a cell's diagonal leaves the sphere by as much as both of its sides together.
            Geometry::Sphere(_) => {
                let around = around(angle * std::f64::consts::FRAC_1_SQRT_2);
                (around, around.div_ceil(2))
            }
            Geometry::Disk(_) => (1, around(angle)),
            _ => (around(angle), 1),
        };
        let surface = self.facet_of.len() as u32 * 2;
        for j in 0..nv {
            for i in 0..nu {
                let at = |di: u32, dj: u32| {
                    let (u, v) = (i + di, j + dj);
                    Vec2::new(u as f32 / nu as f32, v as f32 / nv as f32)
                };
                for uvs in [
                    [at(0, 0), at(1, 0), at(1, 1)],
                    [at(0, 0), at(1, 1), at(0, 1)],
                ] {
                    let corners = uvs.map(|uv| shape_geometry.at_uv(uv.as_dvec2()));
                    let facet = Facet {
                        piece: placed(scene, place, Piece::triangle(corners)),
                        shape,
                        place,
                        inside: false,
                        surface,
                        smooth: !matches!(shape_geometry, Geometry::Disk(_)),
                        origin: Origin::Cell(uvs),
                    };
                    let sides = self.add(scene, facet);
                    self.facet_of.push(sides);
                }
                // At a pole, one of both has no area: the other stands in for it.
                let last = self.facet_of.len() - 1;
                let [a, b] = [self.facet_of[last - 1], self.facet_of[last]];
                for side in 0..2 {
                    if a[side] == NONE {
                        self.facet_of[last - 1][side] = b[side];
                    } else if b[side] == NONE {
                        self.facet_of[last][side] = a[side];
                    }
                }
            }
        }
        [nu, nv]
    }

    /// The facet seen from both of its sides, as far as these take part. `facet.piece` has its corners in the
    /// order of the shape; the numbers of what was made of it, outside first.
    fn add(&mut self, scene: &Scene, mut facet: Facet) -> [u32; 2] {
        let area = facet.piece.area();
        if !(area > LEAST_AREA * facet.piece.longest_edge().powi(2) && area.is_finite()) {
            self.left_out.degenerate += 1;
            return [NONE; 2];
        }
        // Outside is where the shape's own normal points to: not always where the order of corners does.
        let outward = look(scene, &facet, facet.piece.outline.center())
            .ng
            .as_dvec3();
        if outward.dot(facet.piece.cross()) < 0.0 {
            facet = turned(facet);
        }
        let mut sides = [NONE; 2];
        for (inside, number) in sides.iter_mut().enumerate() {
            if inside == 1 {
                facet = turned(facet);
                facet.inside = true;
                facet.surface += 1;
            }
            let points = if scene.varies(facet.shape) { 16 } else { 1 };
            let (look, outline) = (|st| look(scene, &facet, st), facet.piece.outline);
            let mean = optics::mean(scene, look, outline, points, self.cut.gloss_as_diffuse);
            let reflects =
                mean.albedo != Rgb64::ZERO && !self.cut.dark.contain(facet.shape, facet.inside);
            if reflects || mean.emission != Rgb64::ZERO {
                *number = self.facets.len() as u32;
                self.facets.push(facet);
            }
        }
        self.left_out.area += area;
        if sides == [NONE; 2] {
            self.left_out.idle_area += area;
        }
        sides
    }
}

/// The facet from its other side.
fn turned(facet: Facet) -> Facet {
    let origin = match facet.origin {
        Origin::Cell([a, b, c]) => Origin::Cell([a, c, b]),
        same => same,
    };
    let piece = Piece {
        e1: facet.piece.e2,
        e2: facet.piece.e1,
        ..facet.piece
    };
    Facet {
        piece,
        origin,
        ..facet
    }
}

/// A piece of a shape where its group stands.
fn placed(scene: &Scene, place: PlaceId, piece: Piece) -> Piece {
    let places = scene.world().places();
    match places
        .get(place.0 as usize)
        .and_then(|p| p.motion.as_still())
    {
        None => piece,
        Some(to_world) => Piece {
            o: to_world.point(piece.o),
            e1: to_world.vector(piece.e1),
            e2: to_world.vector(piece.e2),
            ..piece
        },
    }
}

/// The surface at `st` of a facet as seen along its normal.
fn look(scene: &Scene, facet: &Facet, st: DVec2) -> Hit {
    let world = scene.world();
    let p = facet.piece.at(st);
    // Near enough that a curved shape's root is not mistaken for the one on its far side.
    let height = 0.25 * facet.piece.longest_edge();
    let normal = facet.piece.normal();
    let geometry = &world.geometries()[facet.shape.0 as usize];
    let (prim, uv) = match (facet.origin, geometry) {
        (Origin::Triangle(prim), Geometry::Mesh(mesh)) => {
            (prim, weights(scene, facet, mesh, prim, p).0)
        }
        (Origin::Pair(a, b), Geometry::Mesh(mesh)) => match weights(scene, facet, mesh, a, p) {
            (uv, true) => (a, uv),
            _ => (b, weights(scene, facet, mesh, b, p).0),
        },
        (Origin::Cell([a, b, c]), curved) => {
            // Over the flat piece, not in between its parameters: these bend it, most of all around poles.
            let [o, e, f] = [a, b, c].map(|uv| curved.at_uv(uv.as_dvec2()));
            let uv = curved.uv_at((o + (e - o) * st.x + (f - o) * st.y).as_vec3());
            let exact = curved.at_uv(uv.as_dvec2());
            let p = to_world(scene, facet.place, exact);
            return scene.hit_at(
                &short_ray(p, normal, height),
                &raw(facet, 0, uv, height),
                facet.place,
            );
        }
        _ => (0, Vec2::ZERO),
    };
    scene.hit_at(
        &short_ray(p, normal, height),
        &raw(facet, prim, uv, height),
        facet.place,
    )
}

fn to_world(scene: &Scene, place: PlaceId, p: DVec3) -> DVec3 {
    let places = scene.world().places();
    match places
        .get(place.0 as usize)
        .and_then(|p| p.motion.as_still())
    {
        None => p,
        Some(to_world) => to_world.point(p),
    }
}

fn short_ray(p: DVec3, normal: DVec3, height: f64) -> Ray {
    Ray::new((p + normal * height).as_vec3(), -normal.as_vec3())
}

fn raw(facet: &Facet, prim: u32, uv: Vec2, height: f64) -> RawHit {
    RawHit {
        t: height as f32,
        shape: facet.shape,
        prim,
        uv,
    }
}

/// Barycentric weights of `p` in a triangle of the facet's mesh, and whether it lies inside.
fn weights(scene: &Scene, facet: &Facet, mesh: &Mesh, prim: u32, p: DVec3) -> (Vec2, bool) {
    let corners = mesh.triangle(prim).map(|p| p.as_dvec3());
    let triangle = placed(scene, facet.place, Piece::triangle(corners));
    let st = triangle.locate(p);
    let inside = Outline::Triangle.contains(st);
    (Outline::Triangle.clamp(st).as_vec2(), inside)
}

/// Triangles `prim` and the next one as a parallelogram, if they make one.
fn parallelogram(mesh: &Mesh, prim: u32) -> Option<Piece> {
    let [first, second] = [mesh.triangle(prim), mesh.triangle(prim + 1)];
    // The corner of the first that is not on the common edge, and of the second.
    let alone = |of: &[crate::math::Vec3; 3], others: &[crate::math::Vec3; 3]| {
        let mut found = (0..3).filter(|&i| !others.contains(&of[i]));
        let corner = found.next()?;
        found.next().is_none().then_some(corner)
    };
    let (i, k) = (alone(&first, &second)?, alone(&second, &first)?);
    let [a, b, c] = [first[i], first[(i + 1) % 3], first[(i + 2) % 3]].map(|p| p.as_dvec3());
    let d = second[k].as_dvec3();
    // The common edge runs the other way in a neighbour of the same side.
    if second[(k + 1) % 3].as_dvec3() != c {
        return None;
    }
    let (e1, e2) = (b - a, c - a);
    // As good as rounded coordinates can be.
    let size = e1.length().max(e2.length());
    let coordinates = [a, b, c, d].map(|p| p.abs().max_element());
    let rounding = coordinates.into_iter().fold(0.0, f64::max) * 4.0 * f64::from(f32::EPSILON);
    let off = (d - (b + e2)).length();
    (off <= rounding && off <= 1e-4 * size).then_some(Piece {
        o: a,
        e1,
        e2,
        outline: Outline::Parallelogram,
    })
}
