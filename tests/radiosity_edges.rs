//! Lines of discontinuity are where geometry says, and facets are divided along them without gap or overlap.

mod common;
#[path = "common/render.rs"]
mod render;

use luxel::math::{DVec2, DVec3};
use luxel::radiosity::discontinuity::{self, Found, Kind, Limits, Line};
use luxel::radiosity::mesh::Division;
use luxel::radiosity::triangulation::{Order, Triangulation};
use luxel::radiosity::{
    FormFactorMethod, Outline, PatchMesh, Piece, Progress, SolveSpec, Solver, Surfaces,
};
use luxel::scene::Scene;
use std::sync::Arc;

const LAMP: &str = "<emitter type='area'><rgb name='radiance' value='10'/></emitter>";

/// A shape after a transform given as XML.
fn shape(kind: &str, transform: &str, more: &str) -> String {
    format!(
        "<shape type='{kind}'><transform name='to_world'>{transform}</transform>\
         <bsdf type='diffuse'/>{more}</shape>"
    )
}

/// The scene, all lengths times `scale`.
fn built(shapes: &[String], scale: f64) -> Scene {
    let end = format!("<scale value='{scale}'/></transform>");
    let shapes = shapes.concat().replace("</transform>", &end);
    let xml = format!("<scene version='3.0.0'><sensor type='perspective'/>{shapes}</scene>");
    render::compile(&xml).job.scene
}

/// Floor of 4 by 4 in the plane z = 0, a square table of 1 by 1 at height 1, a square lamp of 0.4 by 0.4 at height 3.
fn table() -> Vec<String> {
    vec![
        shape("rectangle", "<scale value='2'/>", ""),
        shape("rectangle", "<scale value='0.5'/><translate z='1'/>", ""),
        shape(
            "rectangle",
            "<scale value='0.2'/><rotate x='1' angle='180'/><translate z='3'/>",
            LAMP,
        ),
    ]
}

fn meshed(scene: &Scene, size: f64) -> (PatchMesh, Found) {
    let surfaces = Arc::new(Surfaces::new(scene, 0.02));
    discontinuity::mesh(scene, surfaces, size, &Limits::default())
}

/// Both ends in the world.
fn placed(piece: &Piece, line: &Line) -> [DVec3; 2] {
    line.ends.map(|st| piece.at(st))
}

/// The number of the facet that looks up at `z` = 0 and is the largest.
fn floor_of(surfaces: &Surfaces) -> usize {
    let facets = surfaces.facets();
    let up = |i: &usize| facets[*i].piece.normal().z > 0.99;
    (0..facets.len())
        .filter(up)
        .max_by(|a, b| facets[*a].piece.area().total_cmp(&facets[*b].piece.area()))
        .unwrap()
}

/// Fails unless the triangles cover each facet once, and every point of it is found.
fn assert_sound(mesh: &PatchMesh) {
    let facets = mesh.surfaces.facets();
    let mut first = 0;
    for (facet, division) in facets.iter().zip(&mesh.divisions) {
        let own = mesh.patches[first..]
            .iter()
            .take_while(|p| std::ptr::eq(&facets[p.facet as usize], facet))
            .count();
        let patches = &mesh.patches[first..first + own];
        let area: f64 = patches.iter().map(|p| p.area).sum();
        let exact = facet.piece.area();
        assert!((area / exact - 1.0).abs() < 1e-9, "{area} {exact}");
        if let Division::Triangles(triangles) = division {
            assert_eq!(triangles.first as usize, first);
            assert_eq!(triangles.triangles.len(), own);
            assert_found(triangles, facet.piece.outline);
        }
        first += own;
    }
    assert_eq!(first, mesh.len());
}

fn assert_found(triangles: &Triangulation, outline: Outline) {
    for [a, b, c] in &triangles.triangles {
        assert!((*b - *a).perp_dot(*c - *a) > 0.0);
    }
    for i in 0..10_000u32 {
        // The additive recurrence of the plastic number: spread evenly.
        let u = DVec2::new(0.754_877_666, 0.569_840_291) * f64::from(i);
        let st = outline.sample(DVec2::new(u.x.fract(), u.y.fract()));
        let (index, inside) = triangles.locate(st);
        let corners = triangles.triangles[index as usize];
        let back = corners[0]
            + (corners[1] - corners[0]) * inside.x
            + (corners[2] - corners[0]) * inside.y;
        assert!(back.distance(st) < 1e-9, "{st} {back}");
    }
}

/// Fails if the line, but for what is snapped, passes through the inside of a triangle.
fn assert_not_straddled(triangles: &Triangulation, line: &Line, tolerance: f64) {
    for t in 1..64 {
        let st = line.ends[0].lerp(line.ends[1], f64::from(t) / 64.0);
        let (index, _) = triangles.locate(st);
        let [a, b, c] = triangles.triangles[index as usize];
        let near = [(a, b), (b, c), (c, a)].iter().any(|(p, q)| {
            let d = *q - *p;
            let along = (st - *p).dot(d) / d.length_squared();
            st.distance(p.lerp(*q, along.clamp(0.0, 1.0))) <= tolerance
        });
        assert!(near, "{line:?} at {st}");
    }
}

#[test]
fn edges_of_a_square_shadow_are_where_projection_puts_them() {
    let scene = built(&table(), 1.0);
    let surfaces = Surfaces::new(&scene, 0.02);
    let (lines, found) = discontinuity::lines(&scene, &surfaces, 0.25, &Limits::default());
    let floor = floor_of(&surfaces);
    let piece = &surfaces.facets()[floor].piece;
    // From a corner l of the lamp, a corner p of the table falls on p + (p - l) / 2.
    let mut expected = Vec::new();
    let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let lamp = signs.map(|(x, y)| DVec3::new(0.2 * x, 0.2 * y, 3.0));
    let table = signs.map(|(x, y)| DVec3::new(0.5 * x, 0.5 * y, 1.0));
    let shadow = |l: DVec3, p: DVec3| p + (p - l) * 0.5;
    for i in 0..4 {
        let k = (i + 1) % 4;
        for m in 0..4 {
            let line = [shadow(lamp[m], table[i]), shadow(lamp[m], table[k])];
            expected.push((Kind::VertexEdge, line));
            let line = [shadow(lamp[i], table[m]), shadow(lamp[k], table[m])];
            expected.push((Kind::EdgeVertex, line));
        }
    }
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1e-5;
    for (kind, [a, b]) in &expected {
        let there = lines[floor].iter().any(|line| {
            let [p, q] = placed(piece, line);
            line.kind == *kind && (near(p, *a) && near(q, *b) || near(p, *b) && near(q, *a))
        });
        assert!(there, "{kind:?} {a} {b} of {:?}", lines[floor]);
    }
    assert_eq!(lines[floor].len(), expected.len(), "{:?}", lines[floor]);
    assert_eq!((found.vertex_edge, found.edge_vertex), (16, 16));
    let (mesh, _) = meshed(&scene, 0.25);
    assert_sound(&mesh);
    let Division::Triangles(triangles) = &mesh.divisions[floor] else {
        panic!("the floor is not cut");
    };
    for line in &lines[floor] {
        // Points snap within a hundredth of the size, here of a floor of 4.
        assert_not_straddled(triangles, line, 0.01 * 0.25 / 4.0 * 1.1);
    }
}

#[test]
fn no_patch_reaches_under_a_block() {
    for turn in [0.0, 30.0] {
        let mut shapes = table();
        shapes[1] = shape(
            "cube",
            &format!(
                "<scale value='0.37'/><rotate z='1' angle='{turn}'/><translate x='0.6' y='-0.3' z='0.37'/>"
            ),
            "",
        );
        let scene = built(&shapes, 1.0);
        let (mesh, found) = meshed(&scene, 0.3);
        assert_sound(&mesh);
        assert!(found.contacts >= 4, "{found:?}");
        let floor = floor_of(&mesh.surfaces) as u32;
        let (sin, cos) = f64::to_radians(turn).sin_cos();
        let mut under = 0.0;
        for patch in mesh.patches.iter().filter(|p| p.facet == floor) {
            // In the frame of the block: at most 0.37 from the middle on both axes.
            let depth = |p: DVec3| {
                let d = p - DVec3::new(0.6, -0.3, 0.0);
                let (x, y) = (d.x * cos + d.y * sin, d.y * cos - d.x * sin);
                0.37 - x.abs().max(y.abs())
            };
            let inside = depth(patch.piece.center()) > 0.0;
            under += if inside { patch.area } else { 0.0 };
            for corner in patch.piece.corners() {
                let depth = depth(corner);
                assert!(if inside { depth > -1e-5 } else { depth < 1e-5 }, "{depth}");
            }
        }
        assert!((under / (0.74 * 0.74) - 1.0).abs() < 1e-5, "{under}");
        let Division::Triangles(triangles) = &mesh.divisions[floor as usize] else {
            panic!("the floor is not cut");
        };
        let jumps = triangles.edges.iter().flatten();
        assert!(jumps.filter(|e| **e == Some(Order::Value)).count() >= 8);
    }
}

/// Random lines over an outline: also through corners, along sides, twice, and almost twice.
fn random_lines(rng: &mut common::Rng, outline: Outline, count: usize) -> Vec<Line> {
    let corners = outline.corners();
    let mut lines: Vec<Line> = Vec::new();
    for i in 0..count {
        let mut place = || {
            let u = DVec2::new(f64::from(rng.f32()), f64::from(rng.f32()));
            match (rng.f32() * 8.0) as u32 {
                0 => corners[(u.x * 2.99) as usize],
                1 => corners[0].lerp(corners[1], u.x),
                2 => corners[1].lerp(corners[2], u.x),
                _ => outline.sample(u),
            }
        };
        let mut ends = [place(), place()];
        if i % 5 == 4 {
            let by = [0.0, 1e-12, 1e-7, 1e-4, 3e-3][(i / 5) % 5];
            ends = lines[i - 2].ends.map(|st| outline.clamp(st + by));
        }
        let kind = [Kind::Contact, Kind::VertexEdge, Kind::EdgeVertex][i % 3];
        lines.push(Line {
            ends,
            kind,
            weight: 1.0,
        });
    }
    lines
}

#[test]
fn any_lines_on_any_facet_leave_no_gap_and_no_overlap() {
    let mut rng = common::Rng::new(7);
    let mut cut = 0;
    for i in 0..240 {
        let outline = [Outline::Triangle, Outline::Parallelogram][i % 2];
        let scale = [1e-6, 1.0, 1e6][i % 3];
        let thin = [1.0, 0.3, 1e-3, 1e-5][(i / 6) % 4];
        let piece = Piece {
            o: DVec3::new(3.0, -2.0, 1.0) * scale,
            e1: DVec3::new(2.0, 0.3, 0.1) * scale,
            e2: DVec3::new(-0.5, 1.1, 0.7) * scale * thin,
            outline,
        };
        let lines = random_lines(&mut rng, outline, 2 + i / 6);
        let size = [0.1, 0.5, f64::INFINITY][(i / 2) % 3] * scale;
        let Some(triangles) = discontinuity::triangulate(&piece, size, &lines) else {
            continue;
        };
        cut += 1;
        let area: f64 = triangles
            .triangles
            .iter()
            .map(|[a, b, c]| 0.5 * (*b - *a).perp_dot(*c - *a))
            .sum();
        let whole = Piece {
            o: DVec3::ZERO,
            e1: DVec3::X,
            e2: DVec3::Y,
            outline,
        }
        .area();
        assert!((area / whole - 1.0).abs() < 1e-9, "{i}: {area}");
        if i % 8 < 2 {
            assert_found(&triangles, outline);
        }
    }
    assert!(cut > 200, "{cut}");
}

#[test]
fn extremes_of_geometry_are_cut_or_left_alone() {
    for scale in [1e-6, 1.0, 1e6] {
        let mut shapes = table();
        let cube = |transform: &str| shape("cube", transform, "");
        // Boxes that pass through each other and the floor, touch face to face, and lie in one plane.
        shapes.push(cube("<scale value='0.3'/><translate x='1' z='0.2'/>"));
        shapes.push(cube(
            "<scale value='0.3'/><rotate z='1' angle='20'/><translate x='1.2' y='0.1' z='0.3'/>",
        ));
        shapes.push(cube("<scale value='0.2'/><translate x='-1' z='0.2'/>"));
        shapes.push(cube(
            "<scale value='0.2'/><translate x='-1' y='0.4' z='0.2'/>",
        ));
        shapes.push(shape(
            "rectangle",
            "<scale value='0.2'/><translate y='-1.5'/>",
            "",
        ));
        // Needles: upright, and on the floor.
        shapes.push(cube(
            "<scale x='1e-5' y='1e-5' z='0.4'/><translate x='-1.5' y='-1' z='0.4'/>",
        ));
        shapes.push(shape(
            "rectangle",
            "<scale x='1' y='1e-5'/><translate y='1.7' z='1e-3'/>",
            "",
        ));
        let (mesh, found) = meshed(&built(&shapes, scale), 0.4 * scale);
        assert_sound(&mesh);
        assert!(found.contacts >= 16, "{found:?}");
        assert!(
            mesh.patches
                .iter()
                .all(|p| p.area.is_finite() && p.area > 0.0)
        );
        if scale != 1.0 {
            continue;
        }
        // The same however often it is made, and with any number of threads.
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let again = pool.install(|| meshed(&built(&shapes, scale), 0.4 * scale));
        assert_eq!(again.1, found);
        let same = |a: &luxel::radiosity::Patch, b: &luxel::radiosity::Patch| a.piece == b.piece;
        assert!(
            mesh.patches
                .iter()
                .zip(&again.0.patches)
                .all(|(a, b)| same(a, b))
        );
    }
}

#[test]
fn lights_without_extent_throw_one_hard_line_per_edge() {
    for light in [
        "<emitter type='point'><point name='position' x='0' y='0' z='3'/></emitter>",
        "<emitter type='directional'><vector name='direction' x='0.3' y='0' z='-1'/></emitter>",
    ] {
        let mut shapes = table();
        shapes[2] = light.to_string();
        let scene = built(&shapes, 1.0);
        let surfaces = Surfaces::new(&scene, 0.02);
        let (lines, found) = discontinuity::lines(&scene, &surfaces, 0.25, &Limits::default());
        let floor = floor_of(&surfaces);
        let piece = &surfaces.facets()[floor].piece;
        assert_eq!(found.shadows, 4, "{found:?}");
        for line in &lines[floor] {
            assert_eq!(line.kind, Kind::Shadow);
            for p in placed(piece, line) {
                // The point light enlarges the table by 3/2, the sun shifts it by 0.3.
                let size = if light.contains("point'>") { 0.75 } else { 0.5 };
                let shift = if size == 0.5 { 0.3 } else { 0.0 };
                let (x, y) = ((p.x - shift).abs(), p.y.abs());
                assert!((x - size).abs() < 1e-5 && (y - size).abs() < 1e-5, "{p}");
            }
        }
    }
}

#[test]
fn large_scenes_meet_limits_and_say_so() {
    let mut shapes = table();
    shapes.push("<shape type='sphere'><point name='center' x='1' y='1' z='0.5'/><float name='radius' value='0.3'/>\
                 <bsdf type='diffuse'/></shape>".to_string());
    shapes.push(format!(
        "<shape type='sphere'><point name='center' x='1' y='-1' z='2'/>\
                 <float name='radius' value='0.1'/>{LAMP}</shape>"
    ));
    let scene = built(&shapes, 1.0);
    let surfaces = Arc::new(Surfaces::new(&scene, 8e-5));
    assert!(
        surfaces.facets().len() > 100_000,
        "{}",
        surfaces.facets().len()
    );
    let (mesh, found) = discontinuity::mesh(&scene, surfaces, 0.25, &Limits::default());
    assert!(mesh.len() > 100_000);
    assert_eq!(found.left_out.curved, 1);
    assert!(found.left_out.short_edges > 100_000, "{found:?}");
    assert!(!found.warnings().is_empty());
}

/// The solution on the floor under the table: area of patches whose middle no lamp shines on, in units of the true
/// one, and the most direct irradiance of these, in units of the most on the floor.
fn darkness(scene: &Scene, spec: &SolveSpec) -> (f64, f64) {
    let go = |_: &Progress| std::ops::ControlFlow::Continue(());
    let solution = luxel::radiosity::solve(scene, spec, &mut { go }).unwrap();
    let floor = floor_of(&solution.mesh.surfaces);
    let facet = &solution.mesh.surfaces.facets()[floor].piece;
    let (mut area, mut dark, mut leak, mut most) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for (i, patch) in solution.mesh.patches.iter().enumerate() {
        if patch.facet as usize != floor {
            continue;
        }
        area += patch.area;
        let middle = patch.piece.center();
        let st = facet.locate(middle);
        let hit = solution.mesh.surfaces.hit(scene, floor as u32, st);
        assert_eq!(solution.mesh.locate(&hit).unwrap().patch as usize, i);
        most = most.max(solution.direct[i].x);
        // From the far corners of the lamp, edges at 0.5 fall on 0.65.
        if middle.abs().max_element() < 0.65 {
            dark += patch.area;
            leak = leak.max(solution.direct[i].x);
        }
    }
    assert!((area / facet.area() - 1.0).abs() < 1e-9, "{area}");
    (dark / (1.3 * 1.3), leak / most)
}

#[test]
fn no_light_leaks_under_a_table_with_any_solver() {
    let scene = built(&table(), 1.0);
    for solver in [Solver::Hierarchical, Solver::Shooting, Solver::GaussSeidel] {
        let spec = SolveSpec {
            solver,
            form_factors: FormFactorMethod::Analytic { samples: 16 },
            patch_size: Some(0.4),
            min_size: Some(0.2),
            discontinuities: true,
            ..SolveSpec::default()
        };
        let (dark, leak) = darkness(&scene, &spec);
        assert!((dark - 1.0).abs() < 0.01, "{solver:?}: {dark}");
        // Points snap within a hundredth of a patch.
        assert!(leak < 1e-3, "{solver:?}: {leak}");
        let without = SolveSpec {
            discontinuities: false,
            ..spec
        };
        let (dark, leak) = darkness(&scene, &without);
        assert!((dark - 1.0).abs() > 0.05 || leak > 1e-2, "{dark} {leak}");
    }
}

/// Draws what `LUXEL_MESH` names to `LUXEL_MESH_OUT`: each cut facet as a picture, lines thick.
#[test]
#[ignore = "draws pictures; it checks nothing"]
fn draw() {
    let (Ok(path), Ok(out)) = (std::env::var("LUXEL_MESH"), std::env::var("LUXEL_MESH_OUT")) else {
        return;
    };
    let size = std::env::var("LUXEL_MESH_SIZE").map_or(0.2, |s| s.parse().unwrap());
    let xml = std::fs::read_to_string(&path).unwrap();
    let scene = render::compile(&xml).job.scene;
    let start = std::time::Instant::now();
    let (mesh, found) = meshed(&scene, size);
    println!("{found:?}\n{:?} patches {}", start.elapsed(), mesh.len());
    println!("{:?}", found.warnings());
    for (i, division) in mesh.divisions.iter().enumerate() {
        let Division::Triangles(triangles) = division else {
            continue;
        };
        let piece = &mesh.surfaces.facets()[i].piece;
        if piece.area() < 0.2 {
            continue;
        }
        let name = format!("{out}/facet_{i}.svg");
        std::fs::write(name, svg(piece, triangles)).unwrap();
    }
    assert_sound(&mesh);
}

fn svg(piece: &Piece, triangles: &Triangulation) -> String {
    let scale = 1000.0 / piece.e1.length().max(piece.e2.length());
    let (w, h) = (piece.e1.length() * scale, piece.e2.length() * scale);
    let mut text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{w}' height='{h}'><rect width='100%' height='100%' fill='white'/>"
    );
    for (corners, edges) in triangles.triangles.iter().zip(&triangles.edges) {
        for k in 0..3 {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            let (color, width) = match edges[k] {
                Some(Order::Value) => ("red", 2.5),
                Some(Order::Slope) => ("blue", 1.5),
                None => ("#999", 0.5),
            };
            text += &format!(
                "<line x1='{:.2}' y1='{:.2}' x2='{:.2}' y2='{:.2}' stroke='{color}' stroke-width='{width}'/>\n",
                a.x * w,
                h - a.y * h,
                b.x * w,
                h - b.y * h
            );
        }
    }
    text + "</svg>"
}
