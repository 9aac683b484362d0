//! What throws shadows with edges: lamps as polygons, and lights without extent.

use super::Limits;
use super::shell::Shell;
use crate::light::Emitter;
use crate::math::DVec3;
use crate::radiosity::piece::Piece;
use crate::radiosity::{Surfaces, mesh};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A point that light comes from, in homogeneous coordinates: `w` is 1, or 0 for a direction.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    pub v: DVec3,
    pub w: f64,
}

/// Most corners that stand for a curved lamp.
const MOST_CORNERS: usize = 2048;

/// How bright a source is, for ranking.
#[derive(Clone, Copy, Debug)]
enum Strength {
    /// Power in W, summed over the channels, and the middle of the lamp.
    Lamp { power: f64, middle: DVec3 },
    /// A light without extent: its number among the emitters.
    Point(usize),
}

/// A light, or a polygon of one.
#[derive(Clone, Debug)]
pub struct Source {
    pub corners: Vec<Eye>,
    /// Pairs of corners; none of a lamp whose outline is smooth.
    pub edges: Vec<[usize; 2]>,
    /// A point of the lamp's plane and the normal towards the side that shines.
    pub plane: Option<(DVec3, DVec3)>,
    /// Only the outermost corners count: they stand for a curve.
    pub smooth: bool,
    strength: Strength,
}

impl Eye {
    pub fn point(v: DVec3) -> Eye {
        Eye { v, w: 1.0 }
    }

    /// From `p` to here, of any length.
    pub fn from(&self, p: DVec3) -> DVec3 {
        self.v - p * self.w
    }
}

impl Source {
    /// About the irradiance at `x` with normal `n` if nothing stood between, in W/m² summed over the channels.
    pub fn irradiance(&self, scene: &Scene, x: DVec3, n: DVec3) -> f64 {
        match self.strength {
            Strength::Lamp { power, middle } => {
                let to = middle - x;
                let r2 = to.length_squared();
                let to = to.normalize_or_zero();
                let cos_there = self.plane.map_or(1.0, |(_, normal)| -normal.dot(to));
                // A part of the lamp may be seen where its middle is not.
                let cos = n.dot(to).max(0.1) * cos_there.max(0.1);
                if r2 > 0.0 {
                    power * cos / (PI * r2)
                } else {
                    0.0
                }
            }
            Strength::Point(number) => {
                let to = self.corners[0].from(x);
                let cos = n.dot(to.normalize_or_zero()).max(0.0);
                let sum = |c: crate::math::Rgb| f64::from(c.r + c.g + c.b);
                match scene.emitters().get(number) {
                    Some(Emitter::Directional { irradiance, .. }) => sum(*irradiance) * cos,
                    Some(emitter) => {
                        let away = -to.normalize_or_zero().as_vec3();
                        sum(emitter.intensity(away)) * cos / to.length_squared()
                    }
                    None => 0.0,
                }
            }
        }
    }

    /// The corners that a plane through the line from `a` along `along` touches with all of the lamp on one side.
    pub fn outermost(&self, a: DVec3, along: DVec3) -> [usize; 2] {
        let along = along.normalize_or_zero();
        let flat = |eye: &Eye| {
            let d = eye.from(a);
            d - along * d.dot(along)
        };
        let mut ends = [0, 0];
        for (i, eye) in self.corners.iter().enumerate() {
            let side = |end: usize| flat(&self.corners[end]).cross(flat(eye)).dot(along);
            if side(ends[0]) < 0.0 {
                ends[0] = i;
            }
            if side(ends[1]) > 0.0 {
                ends[1] = i;
            }
        }
        ends
    }
}

/// The sources that matter most, brightest first, and how many others there are.
pub fn sources(
    scene: &Scene,
    surfaces: &Surfaces,
    shell: &Shell,
    limits: &Limits,
) -> (Vec<Source>, usize) {
    let mut ranked: Vec<(f64, Source)> = Vec::new();
    for group in emitting(scene, surfaces) {
        ranked.extend(lamps(surfaces, shell, &group, limits));
    }
    ranked.extend(points(scene));
    // Equal ones stay in order.
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let left = ranked.len().saturating_sub(limits.lamps);
    ranked.truncate(limits.lamps);
    (ranked.into_iter().map(|(_, source)| source).collect(), left)
}

/// A facet that shines, and its exitance summed over the channels.
type Shining = (usize, f64);

/// Facets that shine, by surface.
fn emitting(scene: &Scene, surfaces: &Surfaces) -> Vec<Vec<Shining>> {
    let mut groups: BTreeMap<u32, Vec<Shining>> = BTreeMap::new();
    for (i, facet) in surfaces.facets().iter().enumerate() {
        if !scene.is_emitter(facet.shape) {
            continue;
        }
        let optics = mesh::of_piece(scene, surfaces, i as u32, &facet.piece);
        let exitance = optics.emission.element_sum();
        if exitance > 0.0 {
            groups.entry(facet.surface).or_default().push((i, exitance));
        }
    }
    groups.into_values().collect()
}

/// Lights without extent, ranked by the power that they would have if they shone everywhere.
fn points(scene: &Scene) -> Vec<(f64, Source)> {
    let mut found = Vec::new();
    for (number, emitter) in scene.emitters().iter().enumerate() {
        let eye = match emitter {
            Emitter::Directional { d, .. } => Eye {
                v: -d.as_dvec3(),
                w: 0.0,
            },
            other => match other.standpoint() {
                Some(p) => Eye::point(p.as_dvec3()),
                None => continue,
            },
        };
        let source = Source {
            corners: vec![eye],
            edges: Vec::new(),
            plane: None,
            smooth: false,
            strength: Strength::Point(number),
        };
        // Their shadows are the hardest: first of all.
        found.push((f64::INFINITY, source));
    }
    found
}

/// Polygons of what shines in each plane, or all corners of a curved lamp.
fn lamps(
    surfaces: &Surfaces,
    shell: &Shell,
    group: &[Shining],
    limits: &Limits,
) -> Vec<(f64, Source)> {
    let piece = |shining: &Shining| &surfaces.facets()[shining.0].piece;
    let mut planes: Vec<(DVec3, DVec3, Vec<Shining>)> = Vec::new();
    for shining in group {
        let (p, n) = (piece(shining).center(), piece(shining).normal());
        let same = |(q, m, _): &&mut (DVec3, DVec3, Vec<Shining>)| {
            n.dot(*m) > 0.999_999 && (p - *q).dot(*m).abs() <= 4.0 * shell.tolerance
        };
        match planes.iter_mut().find(same) {
            Some(plane) => plane.2.push(*shining),
            None => planes.push((p, n, vec![*shining])),
        }
        if planes.len() > limits.corners {
            return cloud(surfaces, shell, group, None).into_iter().collect();
        }
    }
    let mut found = Vec::new();
    for (p, n, members) in planes {
        for corners in outlines(surfaces, shell, &members) {
            let points: Vec<DVec3> = corners.iter().map(|i| shell.points[*i as usize]).collect();
            if points.len() > limits.corners {
                found.extend(cloud(surfaces, shell, &members, Some((p, n))));
                break;
            }
            let area = outline_area(&points);
            let exitance = members.iter().map(|m| m.1).fold(0.0, f64::max);
            let count = points.len();
            let middle = points.iter().sum::<DVec3>() / count as f64;
            let source = Source {
                corners: points.into_iter().map(Eye::point).collect(),
                edges: (0..count).map(|i| [i, (i + 1) % count]).collect(),
                plane: Some((p, n)),
                smooth: false,
                strength: Strength::Lamp {
                    power: area * exitance,
                    middle,
                },
            };
            found.push((area * exitance, source));
        }
    }
    found
}

/// A lamp of many corners, of which the outermost count.
fn cloud(
    surfaces: &Surfaces,
    shell: &Shell,
    group: &[Shining],
    plane: Option<(DVec3, DVec3)>,
) -> Option<(f64, Source)> {
    let mut corners: Vec<u32> = group
        .iter()
        .filter_map(|shining| shell.polygons.get(shell.polygon_of[shining.0] as usize))
        .flat_map(|polygon| polygon.corners)
        .collect();
    corners.sort_unstable();
    corners.dedup();
    // Enough to tell where a curve ends.
    let step = corners.len().div_ceil(MOST_CORNERS).max(1);
    let corners: Vec<u32> = corners.into_iter().step_by(step).collect();
    let points: Vec<DVec3> = corners.iter().map(|i| shell.points[*i as usize]).collect();
    let power: f64 = group
        .iter()
        .map(|shining| surfaces.facets()[shining.0].piece.area() * shining.1)
        .sum();
    let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    (!points.is_empty()).then(|| {
        let source = Source {
            corners: points.into_iter().map(Eye::point).collect(),
            edges: Vec::new(),
            plane,
            smooth: true,
            strength: Strength::Lamp { power, middle },
        };
        (power, source)
    })
}

/// Loops of corners around facets of one plane, without corners on straight sides.
fn outlines(surfaces: &Surfaces, shell: &Shell, members: &[Shining]) -> Vec<Vec<u32>> {
    let mut sides: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for member in members {
        let Some(polygon) = shell.polygons.get(shell.polygon_of[member.0] as usize) else {
            continue;
        };
        // The polygon may have been made of the other side.
        let facet: &Piece = &surfaces.facets()[member.0].piece;
        let same = facet.normal().dot(polygon.piece.normal()) > 0.0;
        for (a, b) in polygon.sides() {
            let side = if same { (a, b) } else { (b, a) };
            *sides.entry(side).or_default() += 1;
        }
    }
    // What has a neighbour on the other side is no edge of the lamp.
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &(a, b) in sides.keys() {
        if !sides.contains_key(&(b, a)) {
            next.entry(a).or_default().push(b);
        }
    }
    let mut loops = Vec::new();
    while let Some(&start) = next.keys().next() {
        let mut corners = vec![];
        let mut at = start;
        while let Some(ways) = next.get_mut(&at) {
            corners.push(at);
            let Some(to) = ways.pop() else { break };
            if ways.is_empty() {
                next.remove(&at);
            }
            at = to;
            if at == start {
                break;
            }
        }
        let straight = without_straight(shell, &corners);
        if straight.len() >= 3 {
            loops.push(straight);
        }
    }
    loops
}

fn without_straight(shell: &Shell, corners: &[u32]) -> Vec<u32> {
    let n = corners.len();
    let at = |i: usize| shell.points[corners[i % n] as usize];
    let bends = |i: &usize| {
        let (before, here, after) = (at(i + n - 1), at(*i), at(i + 1));
        let (a, b) = (
            (here - before).normalize_or_zero(),
            (after - here).normalize_or_zero(),
        );
        a.cross(b).length() > 1e-5 || a.dot(b) < 0.0
    };
    (0..n).filter(bends).map(|i| corners[i]).collect()
}

fn outline_area(points: &[DVec3]) -> f64 {
    let n = points.len();
    let o = points[0];
    let doubled: DVec3 = (1..n.saturating_sub(1))
        .map(|i| (points[i] - o).cross(points[i + 1] - o))
        .sum();
    0.5 * doubled.length()
}
