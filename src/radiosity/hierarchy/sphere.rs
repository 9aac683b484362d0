//! Light as a function of direction.

use crate::math::DVec3;
use crate::radiosity::Rgb64;
use std::f64::consts::PI;

/// Light by direction: radiant intensity of a small body in W/sr, or radiance that arrives in it, by the first
/// nine spherical harmonics: enough for diffuse surfaces up to a few percent (Ramamoorthi & Hanrahan 2001).
#[derive(Clone, Copy, Debug, Default)]
pub struct Sphere(pub [Rgb64; 9]);

/// The clamped cosine in each band.
pub const COSINE: [f64; 9] = {
    let (one, two) = (2.0 * PI / 3.0, PI / 4.0);
    [PI, one, one, one, two, two, two, two, two]
};

/// Real spherical harmonics up to the second band.
pub fn harmonics(d: DVec3) -> [f64; 9] {
    let (x, y, z) = (d.x, d.y, d.z);
    [
        0.282_094_791_773_878_14,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079 * x * y,
        1.092_548_430_592_079 * y * z,
        0.315_391_565_252_520_05 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079 * x * z,
        0.546_274_215_296_039_5 * (x * x - y * y),
    ]
}

impl Sphere {
    /// A surface of radiosity `b`.
    pub fn add_surface(&mut self, b: Rgb64, area: f64, normal: DVec3) {
        if b == Rgb64::ZERO {
            return;
        }
        let power = b * (area / PI);
        let y = harmonics(normal);
        for (c, (cosine, y)) in self.0.iter_mut().zip(COSINE.iter().zip(y)) {
            *c += power * (cosine * y);
        }
    }

    /// What a surface of unit normal `normal` and 1 unit of area sends per radiosity, and π times less than it
    /// receives, by coefficient.
    pub fn lobe(normal: DVec3) -> [f64; 9] {
        let y = harmonics(normal);
        std::array::from_fn(|i| COSINE[i] * y[i] / PI)
    }

    /// Power of a radiant intensity, in W.
    pub fn power(&self) -> Rgb64 {
        self.0[0] * (2.0 * PI.sqrt())
    }

    pub fn scale(&mut self, by: Rgb64) {
        self.0.iter_mut().for_each(|c| *c *= by);
    }

    /// Takes away light that would be negative: what nine numbers make of light from one side.
    pub fn keep_positive(&mut self) {
        let power = self.power();
        for channel in (0..3).filter(|&c| power[c] < 0.0) {
            self.0.iter_mut().for_each(|c| c[channel] = 0.0);
        }
    }

    pub fn add(&mut self, o: &Sphere) {
        for (a, b) in self.0.iter_mut().zip(o.0) {
            *a += b;
        }
    }

    /// Light from the unit vector `d` alone: irradiance `e` on what is at right angles to it.
    pub fn add_from(&mut self, d: DVec3, e: Rgb64) {
        for (c, y) in self.0.iter_mut().zip(harmonics(d)) {
            *c += e * y;
        }
    }

    /// The same radiance from everywhere.
    pub fn add_everywhere(&mut self, radiance: Rgb64) {
        self.0[0] += radiance * (2.0 * PI.sqrt());
    }

    /// Irradiance of a surface with unit normal `n`.
    pub fn irradiance(&self, n: DVec3) -> Rgb64 {
        let y = harmonics(n);
        let sum: Rgb64 = (0..9).map(|i| self.0[i] * (COSINE[i] * y[i])).sum();
        sum.max(Rgb64::ZERO)
    }

    pub fn towards(&self, d: DVec3) -> Rgb64 {
        let y = harmonics(d);
        let sum: Rgb64 = self.0.iter().zip(y).map(|(c, y)| *c * y).sum();
        sum.max(Rgb64::ZERO)
    }
}
