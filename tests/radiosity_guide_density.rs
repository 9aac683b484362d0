//! The density of the directions that radiosity guides to: against the directions themselves, and against the links
//! that it is made of.

mod common;
#[path = "common/render.rs"]
mod render;

use common::stats::chi2_p_value;
use common::{Rng, sidak};
use luxel::geom::{Hit, Ray};
use luxel::math::{DVec2, DVec3, Vec3};
use luxel::radiosity::guide::Receiver;
use luxel::radiosity::{Guide, Rgb64, Solution, SolveSpec, solve};
use luxel::scene::Scene;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A box, open to one side, lit by a lamp that shines up: two of its walls are coloured, and a block and a ball stand
/// in it, which hide senders and are some.
const ROOM: &str = r#"<scene version="3.0.0"><sensor type="perspective"/>
    <bsdf type="diffuse" id="white"><rgb name="reflectance" value="0.7"/></bsdf>
    <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.6, 0.1, 0.1"/></bsdf>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="-1"/></transform>
        <ref id="white"/></shape>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="1"/></transform>
        <ref id="white"/></shape>
    <shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform><ref id="white"/></shape>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><translate x="-1"/></transform>
        <ref id="red"/></shape>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="-90"/><translate x="1"/></transform>
        <ref id="white"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.2" y="0.5" z="0.2"/><rotate y="1" angle="20"/>
        <translate x="0.4" y="-0.5" z="-0.3"/></transform><ref id="white"/></shape>
    <shape type="sphere"><point name="center" x="-0.4" y="-0.7" z="0.1"/><float name="radius" value="0.3"/>
        <ref id="white"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.3"/><rotate x="1" angle="-90"/>
        <translate x="-0.3" y="0.3" z="-0.4"/></transform><bsdf type="twosided"><ref id="white"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="10"/></emitter></shape></scene>"#;

/// Rays to where the density is looked at: floor beside the ball, floor behind the block, the ceiling, the ball
/// itself, the red wall, and the side of the block.
const PLACES: [[[f32; 3]; 2]; 6] = [
    [[0.0, 0.0, 0.9], [0.07, -1.0, 0.31]],
    [[0.85, 0.0, 0.6], [0.83, -1.0, -0.62]],
    [[0.0, 0.0, 0.9], [0.37, 1.0, 0.23]],
    [[0.0, 0.0, 0.9], [-0.31, -0.5, 0.1]],
    [[0.0, 0.0, 0.9], [-1.0, -0.53, -0.71]],
    [[0.0, 0.0, 0.9], [0.35, -0.43, -0.3]],
];

struct Guided {
    scene: Scene,
    solution: Arc<Solution>,
    guide: Guide,
}

impl Guided {
    fn new() -> Guided {
        let scene = render::compile(ROOM).job.scene;
        let spec = SolveSpec {
            error: 1e-2,
            ..SolveSpec::default()
        };
        let solution = solve(&scene, &spec, &mut |_| ControlFlow::Continue(()));
        let solution = Arc::new(solution.unwrap_or_else(|e| panic!("{e}")));
        let guide = Guide::new(&scene, solution.clone()).unwrap();
        Guided {
            scene,
            solution,
            guide,
        }
    }

    /// Places on surfaces, and the patches there.
    fn places(&self) -> Vec<(Hit, u32, Receiver)> {
        let look = |[from, to]: [[f32; 3]; 2]| {
            let (from, to) = (Vec3::from(from), Vec3::from(to));
            let hit = self
                .scene
                .intersect(&Ray::new(from, (to - from).normalize()));
            let hit = hit.unwrap_or_else(|| panic!("{from} {to}"));
            let patch = self.guide.patch(&hit).unwrap();
            (hit, patch, self.guide.receiver(patch).unwrap())
        };
        PLACES.into_iter().map(look).collect()
    }

    /// What is seen from `hit` in direction `wi`, and its patch.
    fn seen(&self, hit: &Hit, wi: Vec3) -> Option<(Hit, u32)> {
        let met = self.scene.intersect(&hit.spawn(wi))?;
        let patch = self.guide.patch(&met)?;
        Some((met, patch))
    }

    /// By patch: with what probability the guide says that it is aimed at.
    fn aimed(&self, receiver: Receiver) -> Vec<f64> {
        let patches = 0..self.solution.mesh.len() as u32;
        patches
            .map(|patch| self.guide.probability(receiver, patch))
            .collect()
    }

    /// By patch: with what probability it is aimed at by `receiver`, found from the links as they are written.
    fn shares(&self, receiver: u32) -> Vec<f64> {
        let hierarchy = self.solution.hierarchy.as_ref().unwrap();
        let patches = &self.solution.mesh.patches;
        let facets = self.solution.mesh.surfaces.facets();
        let power = |i: usize| match self
            .scene
            .is_emitter(facets[patches[i].facet as usize].shape)
        {
            true => 0.0,
            false => {
                let b = self.solution.radiosity[i] - patches[i].emission;
                patches[i].area * b.dot(Rgb64::new(0.212_671, 0.715_160, 0.072_169))
            }
        };
        let mut brought = vec![0.0; patches.len()];
        let mut linked = vec![0; patches.len()];
        let mut node = hierarchy.leaf[receiver as usize];
        while let Some(n) = hierarchy.nodes.get(node as usize) {
            for link in &hierarchy.links[n.links.start as usize..n.links.end as usize] {
                let below = &hierarchy.nodes[link.sender as usize].patches;
                let below = below.start as usize..below.end as usize;
                let area: f64 = patches[below.clone()].iter().map(|p| p.area).sum();
                for i in below {
                    brought[i] += f64::from(link.form_factor) * power(i) / area;
                    linked[i] += 1;
                }
            }
            node = n.parent;
        }
        assert!(
            linked.iter().all(|n| *n <= 1),
            "links of {receiver} overlap"
        );
        let all: f64 = brought.iter().sum();
        brought.into_iter().map(|b| b / all).collect()
    }
}

const SAMPLES: usize = 1_000_000;

/// Two numbers of 24 bits in one.
fn fine(rng: &mut Rng) -> f64 {
    f64::from(rng.f32()) + f64::from(rng.f32()) * 2f64.powi(-24)
}

fn two(rng: &mut Rng) -> DVec2 {
    DVec2::new(f64::from(rng.f32()), f64::from(rng.f32()))
}

/// Directions by height and azimuth: cells of equal solid angle.
const ROWS: usize = 16;
const COLUMNS: usize = 32;
/// Strata of each cell along both axes, for the integral of the density.
const STRATA: usize = 32;

/// A number per cell, and the mean direction.
struct Tally {
    cells: Vec<f64>,
    /// Of the number of each cell.
    variance: Vec<f64>,
    directions: DVec3,
}

/// The density integrated over the cells: twice at random in each stratum, so that its error is known. Edges of
/// patches and of bodies run through all of it, which leaves nothing for a quadrature to gain.
fn integrated(rng: &mut Rng, pdf: impl Fn(Vec3) -> f32) -> Tally {
    let mut tally = Tally {
        cells: vec![0.0; ROWS * COLUMNS],
        variance: vec![0.0; ROWS * COLUMNS],
        directions: DVec3::ZERO,
    };
    let (rows, columns) = ((ROWS * STRATA) as f64, (COLUMNS * STRATA) as f64);
    let solid_angle = 4.0 * PI / (rows * columns);
    for row in 0..ROWS * STRATA {
        for column in 0..COLUMNS * STRATA {
            let cell = row / STRATA * COLUMNS + column / STRATA;
            let mut look = || {
                let z = 1.0 - 2.0 * (row as f64 + f64::from(rng.f32())) / rows;
                let azimuth = 2.0 * PI * (column as f64 + f64::from(rng.f32())) / columns;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let d = DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z);
                let pdf = f64::from(pdf(d.as_vec3())) * solid_angle;
                assert!(pdf >= 0.0 && pdf.is_finite(), "{pdf} at {d}");
                tally.directions += d * (0.5 * pdf);
                pdf
            };
            let (a, b) = (look(), look());
            tally.cells[cell] += 0.5 * (a + b);
            tally.variance[cell] += 0.25 * (a - b) * (a - b);
        }
    }
    tally
}

/// The cell of a direction.
fn cell_of(d: Vec3) -> usize {
    let row = 0.5 * (1.0 - f64::from(d.z)) * ROWS as f64;
    let turn = f64::from(d.y).atan2(f64::from(d.x)) / (2.0 * PI);
    let column = turn.rem_euclid(1.0) * COLUMNS as f64;
    (row as usize).min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)
}

/// Fails unless the samples, of which those that count for nothing are `None`, follow the density: in each cell (chi
/// square at this level), in how many count (within five standard errors, which are below 0.15 %), and in their mean
/// direction.
fn assert_follows(
    what: &str,
    alpha: f64,
    seed: u64,
    mut sample: impl FnMut(&mut Rng) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
) {
    let mut rng = Rng::new(seed);
    let expected = integrated(&mut rng, pdf);
    let mut counts = vec![0.0; ROWS * COLUMNS];
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for _ in 0..SAMPLES {
        if let Some(d) = sample(&mut rng) {
            counts[cell_of(d)] += 1.0;
            let d = d.as_dvec3();
            sum += d;
            squares += d * d;
        }
    }
    let n = SAMPLES as f64;
    let (mut chi2, mut dof) = (0.0, 0.0);
    let mut rare = [0.0; 3];
    for ((count, m), variance) in counts.iter().zip(&expected.cells).zip(&expected.variance) {
        // What the density says must be known better than what is counted.
        if m * n < 5.0 || variance * n > *m {
            rare = [rare[0] + count / n, rare[1] + m, rare[2] + variance];
            continue;
        }
        chi2 += (count / n - m).powi(2) / (m * (1.0 - m) / n + variance);
        dof += 1.0;
    }
    chi2 += (rare[0] - rare[1]).powi(2) / (rare[1].max(5.0 / n) / n + rare[2]);
    let p = chi2_p_value(chi2, dof + 1.0);
    let share = counts.iter().sum::<f64>() / n;
    let integral: f64 = expected.cells.iter().sum();
    let variance = share * (1.0 - share) / n + expected.variance.iter().sum::<f64>();
    assert!(p > alpha, "{what}: chi2 = {chi2:.1} of {dof}, p = {p:.2e}");
    assert!(
        variance.sqrt() < 1.5e-3 * share,
        "{what}: {variance} says too little"
    );
    assert!(
        (share - integral).abs() < 5.0 * variance.sqrt(),
        "{what}: {share} of the samples count, the density has {integral} +- {}",
        variance.sqrt()
    );
    let (mean, error) = (sum / n, (squares / n - (sum / n) * (sum / n)).abs());
    let error = (error / n + expected.variance.iter().sum::<f64>()).map(f64::sqrt);
    let off = ((mean - expected.directions) / error).abs();
    assert!(off.max_element() < 5.0, "{what}: {off} standard errors");
}

#[test]
fn directions_follow_their_density() {
    let guided = Guided::new();
    let places = guided.places();
    for (seed, (hit, _, receiver)) in places.iter().enumerate() {
        assert_follows(
            &format!("at {}", hit.p),
            sidak(0.01, places.len()),
            seed as u64,
            |rng| {
                let aim = guided.guide.sample(*receiver, hit.p, fine(rng), two(rng))?;
                let (_, seen) = guided.seen(hit, aim.wi)?;
                (seen == aim.patch).then_some(aim.wi)
            },
            |wi| {
                let pdf =
                    |(met, patch): (Hit, u32)| guided.guide.pdf(*receiver, hit.p, wi, &met, patch);
                guided.seen(hit, wi).map_or(0.0, pdf)
            },
        );
    }
}

/// What is aimed at, whether it is seen or not.
#[test]
fn patches_are_chosen_as_often_as_is_said() {
    let guided = Guided::new();
    let places = guided.places();
    for (seed, (hit, _, receiver)) in places.iter().enumerate() {
        let shares = guided.aimed(*receiver);
        let all: f64 = shares.iter().sum();
        assert!((all - 1.0).abs() < 1e-9, "probabilities sum to {all}");
        let mut counts = vec![0u32; shares.len() + 1];
        let mut rng = Rng::new(seed as u64);
        for _ in 0..SAMPLES {
            let aim = guided
                .guide
                .sample(*receiver, hit.p, fine(&mut rng), two(&mut rng));
            // Those that turn their backs, in part or whole, are not told.
            counts[aim.map_or(shares.len(), |aim| aim.patch as usize)] += 1;
        }
        let (mut chi2, mut dof) = (0.0, -1.0);
        let (mut rare, mut expected_rare) = (0.0, 0.0);
        for (i, share) in shares.iter().enumerate() {
            let piece = &guided.solution.mesh.patches[i].piece;
            let front = (hit.p.as_dvec3() - piece.o).dot(piece.cross()) > 0.0;
            let (n, e) = (f64::from(counts[i]), share * SAMPLES as f64);
            if !front || e < 5.0 {
                rare += n;
                expected_rare += e;
                continue;
            }
            chi2 += (n - e) * (n - e) / e;
            dof += 1.0;
        }
        rare += f64::from(counts[shares.len()]);
        chi2 += (rare - expected_rare).powi(2) / expected_rare.max(1.0);
        let p = chi2_p_value(chi2, dof + 1.0);
        assert!(
            p > sidak(0.01, places.len()),
            "at {}: {chi2} of {dof}, p = {p}",
            hit.p
        );
    }
}

/// Tables are means over neighbours, and some steps of theirs are joined: they still follow the links. Half the sum of
/// the differences is the share of aims that another patch gets; the receivers' own neighbours make a tenth of it, the
/// wider ones that are mixed in another.
#[test]
fn patches_are_chosen_by_the_light_that_they_send() {
    let guided = Guided::new();
    for (hit, patch, receiver) in guided.places() {
        let shares = guided.shares(patch);
        let aimed = guided.aimed(receiver);
        let differences = shares.iter().zip(&aimed).map(|(a, b)| (a - b).abs());
        let moved = 0.5 * differences.sum::<f64>();
        assert!(moved < 0.3, "at {}: {moved} of the aims", hit.p);
    }
}

#[test]
fn the_density_is_that_of_probability_and_geometry() {
    let guided = Guided::new();
    let mut rng = Rng::new(7);
    for (hit, _, receiver) in guided.places() {
        let shares = guided.aimed(receiver);
        let mut counted = 0;
        for _ in 0..20_000 {
            // As the guide finds directions, and as others do.
            let aim = guided
                .guide
                .sample(receiver, hit.p, fine(&mut rng), two(&mut rng));
            let any = common::direction(180.0 * f64::from(rng.f32()), 360.0 * f64::from(rng.f32()));
            for wi in aim.map(|aim| aim.wi).into_iter().chain([any]) {
                let Some((met, seen)) = guided.seen(&hit, wi) else {
                    continue;
                };
                let found = f64::from(guided.guide.pdf(receiver, hit.p, wi, &met, seen));
                let p = &guided.solution.mesh.patches[seen as usize].piece;
                let (n, wi, at) = (p.normal(), wi.as_dvec3(), hit.p.as_dvec3());
                let (height, cos) = ((at - p.o).dot(n), -wi.dot(n));
                let st = p.locate(at + wi * (height / cos));
                // On the very edge, rounding says who is right: rays begin some 1e-6 off their surface, and what they meet
                // is a point in f32; along its plane it is off by the inverse of the cosine more, which is a larger part of
                // a smaller patch.
                let edge = 1e-5 / (cos.abs() * p.area().sqrt()).min(1.0);
                let inside = |slack: f64| {
                    cos > 0.0
                        && p.outline.contains(
                            (st - p.outline.center()) * (1.0 + slack) + p.outline.center(),
                        )
                };
                let d = height / cos;
                let expected = shares[seen as usize] / p.area() * d * d / cos;
                match (inside(edge), inside(-edge)) {
                    (true, true) => {
                        let off = (found - expected).abs();
                        // What is met is a point in f32, off by about 1e-7 of its coordinates, and along its plane by
                        // the inverse of the cosine more.
                        assert!(off <= 3e-5 / cos * expected, "{found} {expected}");
                        counted += 1;
                    }
                    (false, false) => assert_eq!(found, 0.0),
                    _ => {}
                }
            }
        }
        assert!(counted > 10_000);
    }
}
