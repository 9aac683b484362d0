use super::*;

fn points(f: impl Fn(f64) -> (f64, f64)) -> Vec<FitPoint> {
    let point = |k: i32| {
        let spp = f64::from(1 << k);
        let (bias2, variance) = f(spp);
        FitPoint {
            spp,
            seconds: 0.5 + 0.01 * spp,
            runs: 8,
            mse: Estimate::new(bias2 + variance, 0.02 * (bias2 + variance), 2.36),
            bias2: Estimate::new(bias2, 0.05 * bias2 + 0.01 * variance, 2.36),
            variance: Estimate::new(variance, 0.02 * variance, 2.36),
        }
    };
    (0..=8).map(point).collect()
}

#[test]
fn noise_alone_falls_by_the_root_and_is_forecast() {
    let c = Convergence::of(&points(|n| (0.0, 0.04 / n)), false);
    let slope = c.error.unwrap().slope;
    assert!((slope.value + 0.5).abs() < 1e-9 && slope.low < -0.5 && slope.high > -0.5);
    assert!(matches!(c.bias, Some(Bias::NotSeen { .. })), "{:?}", c.bias);
    let Forecast::Reached { spp, seconds } = c.forecast(0.01) else {
        panic!("{:?}", c.forecast(0.01));
    };
    assert!((spp.value - 400.0).abs() < 1e-6 && spp.low < 400.0 && spp.high > 400.0);
    assert!((seconds.value - 4.5).abs() < 1e-6, "{seconds:?}");
}

#[test]
fn a_bias_that_stays_is_a_floor() {
    // Noise 0.2 / sqrt(N) meets the bias of 0.02 at N = 100.
    let c = Convergence::of(&points(|n| (4e-4, 0.04 / n)), false);
    let Some(Bias::Stays { last, floor_spp }) = c.bias else {
        panic!("{:?}", c.bias);
    };
    assert!((last.value - 0.02).abs() < 1e-9);
    assert!((floor_spp.unwrap() - 100.0).abs() < 1e-6);
    assert_eq!(c.forecast(0.01), Forecast::NeverBelow(last.value));
    // 0.025² = 0.02² + 0.015²: the noise of 178 samples.
    let Forecast::Reached { spp, .. } = c.forecast(0.025) else {
        panic!();
    };
    assert!((spp.value - 0.04 / 2.25e-4).abs() < 1e-6);
}

#[test]
fn a_bias_that_falls_is_no_floor() {
    // As of density estimation with shrinking radii: bias² ~ N^-2/3.
    let c = Convergence::of(&points(|n| (1e-2 * n.powf(-2.0 / 3.0), 1e-3 / n)), false);
    let Some(Bias::Falls {
        line: Line { slope, .. },
        ..
    }) = c.bias
    else {
        panic!("{:?}", c.bias);
    };
    assert!(
        slope.low < -1.0 / 3.0 && slope.high > -1.0 / 3.0,
        "{slope:?}"
    );
    assert!(matches!(c.forecast(1e-3), Forecast::Reached { .. }));
}

#[test]
fn no_error_has_no_slope() {
    let mut all = points(|_| (0.0, 0.0));
    for p in &mut all {
        p.mse = Estimate::exact(0.0);
    }
    let c = Convergence::of(&all, false);
    assert!(c.exact && c.error.is_none() && c.noise.is_none());
    assert_eq!(c.forecast(0.01), Forecast::Exact);
    let nothing = Convergence::of(&[], false);
    assert_eq!(nothing.forecast(0.01), Forecast::Unknown(Doubt::Slope));
}

#[test]
fn other_powers_are_found_and_noise_is_in_their_interval() {
    // N^-3/4, as of well-spread points, with errors of some per cent on the squares.
    let mut all = points(|n| (0.0, 0.04 * n.powf(-1.5)));
    for (k, p) in all.iter_mut().enumerate() {
        let by = 1.0 + 0.03 * if k % 2 == 0 { 1.0 } else { -1.0 };
        (p.mse.value, p.variance.value) = (p.mse.value * by, p.variance.value * by);
    }
    let c = Convergence::of(&all, false);
    let slope = c.error.unwrap().slope;
    assert!(slope.low < -0.75 && slope.high > -0.75, "{slope:?}");
    assert!(slope.high - slope.low < 0.05, "{slope:?}");
    // 0.2 N^-3/4 is 0.002 at N = 100^(2/1.5).
    let Forecast::Reached { spp, .. } = c.forecast(0.002) else {
        panic!("{:?}", c.forecast(0.002));
    };
    let truth = 1e4f64.powf(1.0 / 1.5);
    assert!(spp.low < truth && truth < spp.high, "{spp:?} {truth}");
}

#[test]
fn two_settings_have_a_line_with_an_interval() {
    let c = Convergence::of(&points(|n| (0.0, 0.04 / n))[3..5], false);
    let slope = c.error.unwrap().slope;
    assert!((slope.value + 0.5).abs() < 1e-9);
    assert!(slope.low < -0.5 && slope.high > -0.5 && slope.high - slope.low < 0.5);
    assert!(matches!(c.forecast(0.01), Forecast::Reached { .. }));
}

#[test]
fn settings_of_the_same_samples_have_no_slope() {
    // Times so short that all come to one sample per pixel.
    let mut all = points(|n| (0.0, 0.04 / n));
    all.iter_mut().for_each(|p| p.spp = 1.0);
    let c = Convergence::of(&all, false);
    assert!(c.error.is_none() && c.noise.is_none());
    assert_eq!(c.forecast(0.01), Forecast::Unknown(Doubt::Slope));
    // And where only the first and the last are alike, all are used.
    all[4].spp = 4.0;
    assert!(Convergence::of(&all, false).error.is_some());
}

#[test]
fn what_was_measured_without_error_is_reached() {
    // An error of 0.2 / √N that is gone from 64 samples on.
    let mut all = points(|n| (0.0, if n < 64.0 { 0.04 / n } else { 0.0 }));
    for p in &mut all[6..] {
        (p.mse, p.bias2, p.variance) = (
            Estimate::exact(0.0),
            Estimate::exact(0.0),
            Estimate::exact(0.0),
        );
    }
    let c = Convergence::of(&all, false);
    assert!(!c.exact && (c.error.unwrap().slope.value + 0.5).abs() < 1e-9);
    let spp = |wanted: f64| match c.forecast(wanted) {
        Forecast::Reached { spp, seconds } => {
            assert!(seconds.value.is_finite());
            spp.value
        }
        other => panic!("{other:?}"),
    };
    assert!((spp(0.04) - 25.0).abs() < 1e-6);
    assert_eq!((spp(0.01), spp(1e-9)), (64.0, 64.0));
}

#[test]
fn no_number_is_ever_nonsense() {
    // Negative, infinite and unknown values in every place.
    let odd = [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e-300, 1e300, 0.04];
    for a in odd {
        for b in odd {
            let mut all = points(|n| (0.0, 0.04 / n));
            all[2].mse = Estimate::new(a, b.abs(), 2.0);
            all[5].variance = Estimate::new(b, a, 2.0);
            all[8].bias2 = Estimate::new(a, b, 2.0);
            all[7].seconds = if b.is_finite() { b } else { 1.0 };
            let c = Convergence::of(&all, false);
            let lines = [c.error, c.noise].into_iter().flatten();
            for line in lines {
                assert!(
                    !line.slope.value.is_nan() && !line.at_center.value.is_nan(),
                    "{a} {b}: {line:?}"
                );
            }
            for wanted in [0.0, -1.0, f64::NAN, 1e-300, 0.01, 1e300] {
                if let Forecast::Reached { spp, seconds } = c.forecast(wanted) {
                    assert!(
                        !spp.value.is_nan() && !seconds.value.is_nan(),
                        "{a} {b} {wanted}"
                    );
                }
            }
        }
    }
}

#[test]
fn one_setting_gives_no_slope_but_no_nonsense_either() {
    let c = Convergence::of(&points(|n| (0.0, 0.04 / n))[..1], false);
    assert!(c.error.is_none());
    assert_eq!(c.forecast(0.01), Forecast::Unknown(Doubt::Slope));
}

#[test]
fn bias_that_may_be_there_forbids_forecasts_of_less() {
    let unseen = points(|n| (0.0, 0.04 / n));
    let Some(Bias::NotSeen { below }) = Convergence::of(&unseen, true).bias else {
        panic!();
    };
    let forecast = |biased, wanted| Convergence::of(&unseen, biased).forecast(wanted);
    assert_eq!(
        forecast(true, 0.5 * below),
        Forecast::Unknown(Doubt::BiasUpTo(below))
    );
    assert!(matches!(
        forecast(false, 0.5 * below),
        Forecast::Reached { .. }
    ));
    // Above the bound there is one, whose upper end leaves room for the bias.
    let spp = |biased| match forecast(biased, 1.2 * below) {
        Forecast::Reached { spp, .. } => spp,
        other => panic!("{other:?}"),
    };
    assert_eq!(spp(true).value, spp(false).value);
    assert!(spp(true).high > 1.2 * spp(false).high);
    let words = Doubt::BiasUpTo(0.0321).to_string();
    assert_eq!(words, "bias may be as large as 3.21 %");
}

#[test]
fn fewer_samples_may_have_bias_that_many_have_not() {
    // A bias of 0.3 with 1 and 2 samples, and none later: noise of 0.25 is reached before.
    let c = Convergence::of(
        &points(|n| (if n < 4.0 { 0.09 } else { 0.0 }, 0.04 / n)),
        true,
    );
    let Forecast::Reached { spp, .. } = c.forecast(0.25) else {
        panic!("{:?}", c.forecast(0.25));
    };
    assert_eq!(spp.value, 4.0);
}

#[test]
fn noise_and_falling_bias_are_forecast_each_by_its_line() {
    // Noise outweighs bias at all settings, and bias noise far beyond them: the line of the error would be too steep.
    let (bias2, noise2) = (|n: f64| 1e-4 * n.powf(-2.0 / 3.0), |n: f64| 0.04 / n);
    let mut all = points(|n| (bias2(n), noise2(n)));
    for p in &mut all {
        p.bias2 = Estimate::new(p.bias2.value, 0.05 * p.bias2.value, 2.36);
    }
    let c = Convergence::of(&all, true);
    let n = 1e9f64;
    let wanted = (bias2(n) + noise2(n)).sqrt();
    let Forecast::Reached { spp, .. } = c.forecast(wanted) else {
        panic!("{:?}", c.forecast(wanted));
    };
    assert!((spp.value / n - 1.0).abs() < 1e-6, "{spp:?}");
    assert!(spp.low < n && spp.high > n, "{spp:?}");
}

#[test]
fn bias_that_may_fall_too_slowly_has_no_forecast() {
    let mut all = points(|n| (1e-2 * n.powf(-0.12), 1e-3 / n));
    for p in &mut all {
        p.bias2 = Estimate::new(p.bias2.value, 0.2 * p.bias2.value, 2.36);
    }
    let c = Convergence::of(&all, true);
    assert!(matches!(c.bias, Some(Bias::Falls { .. })), "{:?}", c.bias);
    assert_eq!(c.forecast(1e-3), Forecast::Unknown(Doubt::SlowBias));
}

#[test]
fn slopes_that_may_be_anything_say_nothing_beyond_the_settings() {
    // Two settings of three runs that know their squares to 30 %, with a slope by chance of -1.1.
    let mut two = points(|n| (0.0, 0.04 * n.powf(-2.2)))[3..5].to_vec();
    for p in &mut two {
        p.runs = 3;
        p.mse = Estimate::new(p.mse.value, 0.3 * p.mse.value, 4.3);
        p.variance = p.mse;
    }
    let c = Convergence::of(&two, false);
    let slope = c.noise.unwrap().slope;
    assert!(slope.value < -1.0 && slope.high > -0.5, "{slope:?}");
    assert_eq!(c.forecast(1e-4), Forecast::Unknown(Doubt::WideSlope));
}
