//! Figures of glass and plastic measured with Mitsuba 3.9.1 (variant scalar_rgb), so that the same scene
//! gives the same image. Directions are given by polar angle and azimuth in degrees.

use luxel::bsdf::{
    Base, Bsdf, Coat, Density, Dielectric, Microfacet, Mode, Plastic, RoughDielectric,
    RoughPlastic, Shape,
};
use luxel::math::{DVec3, Rgb, Vec2, Vec3};

fn direction(polar: f64, azimuth: f64) -> Vec3 {
    let ((st, ct), (sp, cp)) = (polar.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    DVec3::new(st * cp, st * sp, ct).as_vec3()
}

/// The words of each line of a table, and the numbers among them.
fn lines(table: &'static str) -> impl Iterator<Item = (&'static str, Vec<&'static str>, Vec<f64>)> {
    table.lines().filter(|l| !l.is_empty()).map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = words.iter().filter_map(|w| w.parse().ok()).collect();
        (line, words, numbers)
    })
}

fn assert_close(ours: f32, figure: f64, tolerance: f64, what: &str) {
    let ours = f64::from(ours);
    let error = (ours - figure).abs();
    assert!(
        error <= tolerance * figure.abs(),
        "{what}: {ours} for {figure}, off by {:.2e}",
        error / figure.abs()
    );
}

const DIFFUSE: Rgb = Rgb::new(0.1, 0.5, 0.8);
const SPECULAR: Rgb = Rgb::new(0.9, 0.8, 0.5);

fn shape(word: &str) -> Shape {
    match word {
        "ggx" => Shape::Ggx,
        _ => Shape::Beckmann,
    }
}

/// shape, alpha_u, alpha_v, int_ior, sampled normals, wo, wi, f (specular_reflectance 0.9 0.8 0.5,
/// specular_transmittance 0.3 0.6 1), green of f for importance, pdf
const ROUGH_DIELECTRICS: &str = "
ggx 0.701 0.069 1.02 visible 55 19 126.3 -161.2 647.448 1294.9 2158.16 1347.21 1560.55
beckmann 0.159 0.159 2.4 visible 150 100 151 -77 3.69888 3.28789 2.05493 3.28789 3.59457
ggx 0.489 0.963 0.7 visible 92 167 87 1 0.530368 1.06074 1.76789 2.16477 0.980775
beckmann 0.187 0.187 1.33 all 71 330 138 156 1.4501 2.9002 4.83366 5.13016 8.27909
ggx 0.061 0.063 1.02 visible 179 259 1 75.6 19892 39784 66306.7 38239.2 63722.3
beckmann 0.661 0.59 2.4 visible 63 230 34 55 0.0811423 0.0721265 0.0450791 0.0721265 0.0747445
ggx 0.11 0.039 4.0 visible 103 237 107 59.9 59.0989 52.5323 32.8327 52.5323 19.4111
beckmann 0.929 0.256 2.4 all 39 229 60 57 0.0837694 0.0744617 0.0465386 0.0744617 0.0543524
ggx 0.044 0.066 1.5 visible 145 2 55.9 -176.9 30.4923 60.9847 101.641 27.1043 25.353
beckmann 0.586 0.718 4.0 visible 95 205 106 26 2.2681 2.01609 1.26006 2.01609 0.857206
ggx 0.159 0.096 2.4 visible 141 270 136 30.7 0.0988677 0.0878824 0.0549265 0.0878824 0.0794084
beckmann 0.307 0.307 2.4 all 86 28 114 -156 3.8005e-07 7.60099e-07 1.26683e-06 4.37817e-06 1.77832e-05
ggx 0.108 0.444 0.7 visible 110 327 42 180 0.0152743 0.0305487 0.0509145 0.0623443 0.0774001
beckmann 0.051 0.051 1.1 visible 108 305 105.1 125 267.711 237.966 148.729 237.966 77.4889
ggx 0.388 0.388 1.1 visible 163 71 24 -112 1.75005 3.50009 5.83349 2.89264 4.43688
beckmann 0.102 0.102 1.02 all 129 32 52 -148 979.933 1959.87 3266.44 1883.76 1852.86
ggx 0.7 0.235 1.02 visible 73 153 107 -27 251.608 503.217 838.695 523.547 420.765
beckmann 0.19 0.075 1.33 visible 38 283 152.4 94.2 6.83296 13.6659 22.7765 24.1737 35.7046
ggx 0.1 0.1 1.1 visible 115 73 107.9 -102.5 9.64399 8.57244 5.35777 8.57244 3.37061
beckmann 0.254 0.254 4.0 all 10 62 53 180 0.0362061 0.0321832 0.0201145 0.0321832 0.024939
ggx 0.277 0.06 4.0 visible 115 22 116.3 -155.5 10.4237 9.26548 5.79092 9.26548 5.4489
beckmann 0.741 0.655 1.1 visible 10 320 166 160 0.971778 1.94356 3.23926 2.3517 3.80308
ggx 0.076 0.076 0.7 visible 84 67 64.6 -112.1 6.80421 6.04818 3.78011 6.04818 3.26349
beckmann 0.034 0.034 1.5 all 60 205 143.5 25.4 47.4171 94.8341 158.057 213.377 274.463
";

/// GGX agrees to the rounding of directions. For Beckmann Mitsuba takes the rational masking function of
/// Walter et al. 2007, within 0.35 % of the exact one, once in the density and twice in the value.
#[test]
fn rough_dielectrics() {
    for (line, words, n) in lines(ROUGH_DIELECTRICS) {
        let mut facets = Microfacet::new(shape(words[0]), n[0] as f32, n[1] as f32);
        facets.visible = words[4] == "visible";
        let tolerance = match facets.shape {
            Shape::Ggx => 1e-4,
            Shape::Beckmann => 3.5e-3,
        };
        let surface = Dielectric {
            reflectance: SPECULAR,
            transmittance: Rgb::new(0.3, 0.6, 1.0),
            ..Dielectric::new(n[2] as f32)
        };
        let bsdf = Bsdf::RoughDielectric(RoughDielectric { facets, surface });
        let (wo, wi) = (direction(n[3], n[4]), direction(n[5], n[6]));
        let (f, pdf) = bsdf.eval_pdf(wo, wi, Mode::Radiance);
        for c in 0..3 {
            assert_close(f[c], n[7 + c], 2.0 * tolerance, line);
        }
        assert_close(
            bsdf.eval(wo, wi, Mode::Importance).g,
            n[10],
            2.0 * tolerance,
            line,
        );
        assert_close(pdf, n[11], tolerance, line);
    }
}

/// int_ior, nonlinear, wo, wi, f (diffuse_reflectance 0.1 0.5 0.8), green of f for importance, pdf
const PLASTICS: &str = "
1.49 linear 83 85 17 274 0.0166013 0.0830066 0.132811 0.0830066 0.116371
1.33 linear 51 135 3 85 0.0322619 0.16131 0.258095 0.16131 0.300829
2.0 nonlinear 71 168 85 324 0.00240302 0.0182944 0.04814 0.0182944 0.0182714
1.05 nonlinear 76 5 4 208 0.0276739 0.144499 0.239145 0.144499 0.292816
0.8 linear 30 303 28 55 0.0510006 0.255003 0.408005 0.255003 0.274524
1.49 linear 10 108 55 45 0.0313795 0.156898 0.251036 0.156898 0.171701
1.33 nonlinear 70 108 27 238 0.0160422 0.100057 0.196567 0.100057 0.228659
2.0 nonlinear 76 156 70 109 0.00443638 0.0337745 0.0888744 0.0337745 0.0616313
1.05 linear 11 298 68 270 0.0318134 0.159067 0.254507 0.159067 0.119129
0.8 linear 78 179 17 210 0 0 0 0 0
";

/// int_ior, angle, weight of the specular lobe, its probability
const PLASTIC_MIRRORS: &str = "
1.49 51.0 0.59176 0.526009 0.328756 0.0884478
1.33 34.0 0.579905 0.515471 0.322169 0.0340371
2.0 56.0 0.62041 0.551475 0.344672 0.211355
1.05 23.0 0.572928 0.509269 0.318293 0.00096152
0.8 54.0 0.9 0.8 0.5 1
";

/// Mitsuba takes a polynomial for the reflectance of diffuse light, within 0.12 % here of the closed form.
#[test]
fn plastics() {
    let plastic = |eta: f64, nonlinear: bool| {
        let base = Base::smooth(eta as f32, nonlinear);
        Bsdf::Plastic(Plastic::new(eta as f32, &base, DIFFUSE, SPECULAR))
    };
    for (line, words, n) in lines(PLASTICS) {
        let bsdf = plastic(n[0], words[1] == "nonlinear");
        let (wo, wi) = (direction(n[1], n[2]), direction(n[3], n[4]));
        let (f, pdf) = bsdf.eval_pdf(wo, wi, Mode::Radiance);
        for c in 0..3 {
            assert_close(f[c], n[5 + c], 1.5e-3, line);
        }
        assert_close(pdf, n[9], 1e-5, line);
    }
    for (line, _, n) in lines(PLASTIC_MIRRORS) {
        let bsdf = plastic(n[0], false);
        let wo = direction(n[1], 30.0);
        let sample = |u| {
            bsdf.sample(wo, u, Vec2::splat(0.5), Mode::Radiance)
                .expect(line)
        };
        let mirror = sample(0.999 * n[5] as f32);
        assert_eq!(
            (mirror.density, mirror.wi),
            (Density::Delta, Vec3::new(-wo.x, -wo.y, wo.z))
        );
        for c in 0..3 {
            assert_close(mirror.weight[c], n[2 + c], 1e-5, line);
        }
        if n[5] < 0.999 {
            assert_ne!(
                sample(1.001 * n[5] as f32).density,
                Density::Delta,
                "{line}"
            );
        }
    }
}

/// shape, alpha, int_ior, sampled normals, nonlinear, wo, wi, f (diffuse_reflectance 0.1 0.5 0.8,
/// specular_reflectance 0.9 0.8 0.5), green of f for importance, pdf
const ROUGH_PLASTICS: &str = "
ggx 0.02 1.49 visible linear 70 34 71 214 199.075 177.051 110.77 177.051 99.4128
beckmann 0.05 1.33 visible linear 81 296 79 474 5.96001 5.35725 3.41878 5.35725 1.80484
ggx 0.1 2.0 visible nonlinear 7 259 3 440 0.646077 0.618381 0.480038 0.618381 1.31855
beckmann 0.2 1.05 all nonlinear 12 58 16 241 0.0301485 0.150508 0.245296 0.150508 0.307574
ggx 0.4 3.0 visible linear 58 77 30 275 0.11897 0.128647 0.107554 0.128647 0.339587
beckmann 0.7 0.8 visible linear 79 136 79 265 0.00249585 0.00228284 0.00150302 0.00228284 0.00151122
ggx 1 1.49 visible nonlinear 88 236 88 412 0.203029 0.186122 0.123374 0.186122 0.123314
beckmann 0.02 1.33 visible nonlinear 75 48 75 229 39.925 35.5513 22.3165 35.5513 16.1685
ggx 0.05 2.0 all linear 46 135 40 313 1.36723 1.32463 0.95753 1.32463 1.84686
beckmann 0.1 1.05 visible linear 26 77 10 254 0.0325547 0.159907 0.255246 0.159907 0.314424
ggx 0.2 3.0 visible nonlinear 52 29 52 197 0.589318 0.538149 0.370665 0.538149 0.695944
beckmann 0.4 0.8 visible nonlinear 77 107 88 290 10.7646 9.56851 5.98032 9.56851 1.56136
ggx 0.7 1.49 visible linear 80 47 78 228 0.257419 0.25352 0.187744 0.25352 0.229493
beckmann 1 1.33 all linear 57 29 85 220 0.0677742 0.108705 0.125406 0.108705 0.0619425
ggx 0.02 2.0 visible nonlinear 74 110 75 289 55.9343 49.7476 31.155 49.7476 21.071
beckmann 0.05 1.05 visible nonlinear 76 67 73 247 11.9736 10.7591 6.86802 10.7591 8.10756
ggx 0.1 3.0 visible linear 77 135 70 324 0.487483 0.486774 0.367622 0.486774 0.318515
beckmann 0.2 0.8 visible linear 58 261 53 449 4.24637 3.79988 2.40496 3.79988 2.37657
ggx 0.4 1.49 all nonlinear 75 242 23 427 0.0287033 0.0791473 0.125514 0.0791473 0.253761
beckmann 0.7 1.33 visible nonlinear 20 186 23 328 0.0208183 0.0991569 0.16881 0.0991569 0.287909
";

/// The transmittance that Mitsuba tabulates is within 0.05 % of its limit, as ours is.
#[test]
fn rough_plastics() {
    for (line, words, n) in lines(ROUGH_PLASTICS) {
        let (alpha, eta) = (n[0] as f32, n[1] as f32);
        let mut facets = Microfacet::new(shape(words[0]), alpha, alpha);
        facets.visible = words[3] == "visible";
        let tolerance = match facets.shape {
            Shape::Ggx => 2e-3,
            Shape::Beckmann => 7e-3,
        };
        let coat = Coat::of(facets.shape, alpha, eta);
        let base = coat.base(eta, words[4] == "nonlinear");
        let plastic = RoughPlastic::new(facets, eta, coat, &base, DIFFUSE, SPECULAR);
        let bsdf = Bsdf::RoughPlastic(plastic);
        let (wo, wi) = (direction(n[2], n[3]), direction(n[4], n[5]));
        let (f, pdf) = bsdf.eval_pdf(wo, wi, Mode::Radiance);
        for c in 0..3 {
            assert_close(f[c], n[6 + c], tolerance, line);
        }
        // The density holds the share reflected, in which an error of the transmittance weighs more.
        assert_close(pdf, n[10], 5e-3, line);
    }
}
