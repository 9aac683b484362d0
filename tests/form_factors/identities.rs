//! What must hold of all form factors, in closed rooms; and that the methods agree.

use crate::rooms::{Room, furnished, inside, room};
use luxel::math::DVec3;
use luxel::radiosity::FormFactorMethod::{self, Analytic, Hemicube, MonteCarlo};
use luxel::radiosity::form_factors::{FormFactors, Matrix, Quality};

const METHODS: [FormFactorMethod; 3] = [
    Analytic { samples: 16 },
    MonteCarlo { samples: 64 },
    Hemicube { resolution: 128 },
];

fn quality(room: &Room, method: FormFactorMethod, tolerance: f64) -> (Matrix, Quality) {
    let factors = FormFactors::new(&room.scene, &room.mesh, method, 3);
    let (matrix, losses) = factors.matrix_and_losses();
    let quality = Quality::new(&factors, &matrix, &losses, tolerance);
    println!("{method:?}\n{quality}");
    (matrix, quality)
}

#[test]
fn an_empty_box_is_closed() {
    let room = room(&inside(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0)), 0.4, 1e-3);
    for (method, tolerance) in METHODS.into_iter().zip([1e-6, 0.03, 1e-12]) {
        let (_, quality) = quality(&room, method, tolerance);
        assert_eq!(quality.rows_off, 0.0, "{quality}");
        assert_eq!(quality.self_max, 0.0);
        match method {
            Hemicube { .. } => assert!(quality.reciprocity_rms < 0.02, "{quality}"),
            _ => assert!(quality.reciprocity_max < 1e-14, "{quality}"),
        }
    }
}

/// Blocks in the way: rows are as exact as rays are many, and the methods agree.
#[test]
fn a_furnished_room_is_closed() {
    let room = room(&furnished(), 0.17, 1e-3);
    println!("{} patches", room.mesh.len());
    let mut matrices = Vec::new();
    for (method, mean, most) in [
        (METHODS[0], 2e-3, 0.05),
        (METHODS[1], 2e-3, 0.05),
        // A few pixels at the horizon see past the edges of patches.
        (METHODS[2], 1e-5, 1e-4),
    ] {
        let (matrix, quality) = quality(&room, method, 0.03);
        assert!((quality.row_sum_mean - 1.0).abs() < mean, "{quality}");
        assert!(
            quality.row_sum_max < 1.0 + most && quality.row_sum_min > 1.0 - most,
            "{quality}"
        );
        matrices.push(matrix);
    }
    // Their difference, as the share of light that goes elsewhere.
    let areas: Vec<f64> = room.mesh.patches.iter().map(|p| p.area).collect();
    let all: f64 = areas.iter().sum();
    for (k, most) in [(1, 0.02), (2, 0.03)] {
        let row = |i: usize| {
            let pairs = matrices[0].row(i).iter().zip(matrices[k].row(i));
            areas[i] * 0.5 * pairs.map(|(a, b)| (a - b).abs()).sum::<f64>()
        };
        let elsewhere = (0..areas.len()).map(row).sum::<f64>() / all;
        println!(
            "{:?} against analytic: {elsewhere:.2e} of the light goes elsewhere",
            METHODS[k]
        );
        assert!(elsewhere < most, "{:?}: {elsewhere}", METHODS[k]);
    }
}

#[test]
fn rows_are_those_of_the_matrix_for_any_number_of_threads() {
    let room = room(&furnished(), 0.5, 1e-3);
    for method in METHODS {
        let pool = |n| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(n)
                .build()
                .unwrap()
        };
        let [one, four] = [1, 4].map(|n| pool(n).install(|| room.matrix(method, 5)));
        assert!(one == four, "{method:?}");
        let factors = FormFactors::new(&room.scene, &room.mesh, method, 5);
        let mut row = vec![9.0; one.n];
        for i in 0..one.n {
            factors.row(i as u32, &mut row);
            assert!(row == one.row(i), "{method:?}, row {i}");
        }
    }
}

/// Patches between pixels are reported.
#[test]
fn small_patches_are_not_lost_in_silence() {
    let small = crate::rooms::block(
        DVec3::new(0.5, 0.5, 0.4),
        [DVec3::X, DVec3::Y, DVec3::Z].map(|e| e * 0.004),
    );
    let room = room(&(inside(DVec3::ZERO, DVec3::ONE) + &small), 0.5, 1e-3);
    let (_, coarse) = quality(&room, Hemicube { resolution: 8 }, 0.01);
    assert!(
        coarse.lost_patches > 0 && coarse.lost_pairs > 0 && coarse.lost_share > 0.0,
        "{coarse}"
    );
    assert!(coarse.lost_area < 1e-4 && coarse.to_string().contains("raise the resolution"));
    let (_, fine) = quality(&room, Hemicube { resolution: 512 }, 0.01);
    assert_eq!(fine.lost_patches, 0, "{fine}");
}

/// Half of the light passes a veil that is half there.
#[test]
fn masks_let_light_through() {
    use crate::rooms::quad;
    let square = |z: f64, turned: bool| {
        let edges = [DVec3::X, DVec3::Y];
        quad(
            DVec3::Z * z,
            edges[usize::from(turned)],
            edges[usize::from(!turned)],
        )
    };
    let plates = square(0.0, false) + &square(1.0, true);
    let veil = quad(DVec3::new(-1.0, -1.0, 0.5), DVec3::X * 3.0, DVec3::Y * 3.0);
    let glass =
        r#"<bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="conductor"/></bsdf>"#;
    let veil = veil.replace(r#"<bsdf type="diffuse"/>"#, glass);
    let [clear, veiled] = [plates.clone(), plates + &veil].map(|c| room(&c, f64::INFINITY, 1e-3));
    for method in &METHODS[..2] {
        let share = veiled.first_to_others(*method, 1) / clear.first_to_others(*method, 1);
        assert!((share - 0.5).abs() < 1e-6, "{method:?}: {share}");
    }
    // Hemicubes take them for opaque, and say so.
    assert_eq!(veiled.first_to_others(METHODS[2], 1), 0.0);
}
