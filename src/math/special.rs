//! The error function and its inverse in f32: the Beckmann distribution is Gaussian in slopes.

/// erf(x), absolute error below 3e-7 (Abramowitz & Stegun 1964, equation 7.1.26).
#[inline]
pub fn erf(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let poly = t
        * (0.254_829_6
            + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152 + t * 1.061_405_4))));
    (1.0 - poly * (-x * x).exp()).copysign(x)
}

/// The x of erf(x) = `y` for `y` in (-1, 1), relative error below 4e-7 (Giles 2012, "Approximating the
/// erfinv function", single precision). At the ends of the interval the result is not finite.
#[inline]
pub fn erf_inv(y: f32) -> f32 {
    let w = -((1.0 - y) * (1.0 + y)).ln();
    let horner = |w: f32, c: [f32; 9]| c.into_iter().fold(0.0, |p, c| p * w + c);
    let p = if w < 5.0 {
        horner(
            w - 2.5,
            [
                2.810_226_4e-8,
                3.432_739_4e-7,
                -3.523_387_7e-6,
                -4.391_506_5e-6,
                2.185_808_7e-4,
                -1.253_725e-3,
                -4.177_681_6e-3,
                0.246_640_73,
                1.501_409_4,
            ],
        )
    } else {
        horner(
            w.sqrt() - 3.0,
            [
                -2.002_142_6e-4,
                1.009_505_6e-4,
                1.349_343_2e-3,
                -3.673_428_4e-3,
                5.739_507_7e-3,
                -7.622_461_3e-3,
                9.438_870_5e-3,
                1.001_674,
                2.832_976_8,
            ],
        )
    };
    p * y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erf_has_its_tabulated_values() {
        // Abramowitz & Stegun, table 7.1.
        for (x, y) in [
            (0.0, 0.0),
            (0.1, 0.112_462_916),
            (0.5, 0.520_499_9),
            (1.0, 0.842_700_8),
            (1.5, 0.966_105_15),
            (2.0, 0.995_322_3),
            (4.0, 1.0),
        ] {
            assert!((erf(x) - y).abs() < 3e-7, "{x}: {}", erf(x));
            assert!((erf(-x) + y).abs() < 3e-7);
        }
    }

    #[test]
    fn erf_inv_undoes_erf() {
        for i in -999..1000 {
            let y = i as f32 / 1000.0;
            assert!((erf(erf_inv(y)) - y).abs() < 5e-7, "{y}");
        }
        let last = 1.0 - f32::EPSILON / 2.0;
        assert!((erf_inv(last) - 3.832).abs() < 0.01 && erf_inv(-last) == -erf_inv(last));
    }
}
