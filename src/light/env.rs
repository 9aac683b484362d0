//! The image environment: radiance from infinitely far away, given by a latitude-longitude image.
//!
//! Directions are drawn exactly in proportion to the luminance of the interpolated radiance, so the
//! density of a direction is that luminance over its integral: nothing that shines has density zero,
//! and looking the density up costs no more than looking the radiance up.

use crate::math::{DVec3, PI, Rgb, Transform, Vec2, Vec3};
use std::f64::consts;
use std::fmt;

/// A latitude-longitude radiance map in Mitsuba's `envmap` orientation: +y of its own space is the top
/// row, the middle column lies towards -z, columns run from there towards +x.
///
/// Columns have their centres at (i + 1/2) / width and wrap around; the first and last row lie on the
/// poles themselves. In between, radiance is bilinear in the angles (as in Mitsuba 3.9, measured).
#[derive(Clone, Debug)]
pub struct EnvMap {
    width: usize,
    height: usize,
    /// Scaled radiance, row by row, at least two rows.
    pixels: Vec<Rgb>,
    /// Columns are the axes of the map's space.
    axes: [Vec3; 3],
    /// Running sums of luminance along each row: entry `x` covers what lies before column centre `x + 1`.
    along: Vec<f32>,
    /// Running sums over the bands between rows, normalised to end on 1.
    bands: Vec<f64>,
    /// Luminance integrated over all directions.
    integral: f64,
}

/// Why an image is no environment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EnvError {
    /// No pixels, or another number of them than width times height.
    WrongSize {
        width: usize,
        height: usize,
        pixels: usize,
    },
    /// A pixel that is infinite or NaN after scaling.
    NotFinite { x: usize, y: usize },
    /// `to_world` is no rotation or reflection, translation aside.
    NotRigid,
}

impl fmt::Display for EnvError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EnvError::WrongSize {
                width,
                height,
                pixels,
            } => write!(f, "{pixels} pixels for an image of {width} x {height}"),
            EnvError::NotFinite { x, y } => {
                write!(f, "pixel ({x}, {y}) is not a finite number")
            }
            EnvError::NotRigid => write!(
                f,
                "the transform of an environment must be a rotation or a reflection"
            ),
        }
    }
}

impl std::error::Error for EnvError {}

impl EnvMap {
    /// `pixels` row by row from the top, radiance in W/(m² sr) before multiplication with `scale`.
    /// Negative channels, which resampling leaves in some images, count as zero.
    pub fn new(
        pixels: Vec<Rgb>,
        width: usize,
        height: usize,
        to_world: &Transform,
        scale: f32,
    ) -> Result<EnvMap, EnvError> {
        if width == 0 || height == 0 || Some(pixels.len()) != width.checked_mul(height) {
            return Err(EnvError::WrongSize {
                width,
                height,
                pixels: pixels.len(),
            });
        }
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| to_world.vector(a));
        let rigid = axes.iter().all(|a| (a.length() - 1.0).abs() < 1e-5)
            && (0..3).all(|i| axes[i].dot(axes[(i + 1) % 3]).abs() < 1e-5);
        if !rigid {
            return Err(EnvError::NotRigid);
        }
        let mut pixels: Vec<Rgb> = pixels.into_iter().map(|p| p * scale).collect();
        if let Some(i) = pixels.iter().position(|p| !p.is_finite()) {
            return Err(EnvError::NotFinite {
                x: i % width,
                y: i / width,
            });
        }
        for p in &mut pixels {
            *p = p.map(|v| v.max(0.0));
        }
        let height = if height == 1 {
            pixels.extend_from_within(..);
            2
        } else {
            height
        };
        let mut map = EnvMap {
            width,
            height,
            pixels,
            axes: axes.map(|a| a.normalize_or(DVec3::X).as_vec3()),
            along: Vec::new(),
            bands: Vec::new(),
            integral: 0.0,
        };
        map.tabulate();
        Ok(map)
    }

    /// Integral of the luminance over all directions; over 4π, the mean radiance.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    fn tabulate(&mut self) {
        let (w, h) = (self.width, self.height);
        let mut along = Vec::with_capacity(w * h);
        let mut sums = Vec::with_capacity(h);
        for y in 0..h {
            let mut sum = 0f64;
            for x in 0..w {
                let (a, b) = (self.luminance(x, y), self.luminance((x + 1) % w, y));
                sum += 0.5 * (a as f64 + b as f64);
                along.push(sum as f32);
            }
            sums.push(sum);
        }
        let mut total = 0.0;
        let mut bands = Vec::with_capacity(h - 1);
        for y in 0..h - 1 {
            total += self.band(y, sums[y], sums[y + 1]).integral(1.0);
            bands.push(total);
        }
        if total > 0.0 {
            for b in &mut bands {
                *b /= total;
            }
        }
        self.along = along;
        self.bands = bands;
        self.integral = total * consts::TAU / w as f64;
    }

    fn luminance(&self, x: usize, y: usize) -> f32 {
        self.pixels[y * self.width + x].luminance()
    }

    fn band(&self, y: usize, a: f64, b: f64) -> Band {
        let step = consts::PI / (self.height - 1) as f64;
        let theta = step * y as f64;
        Band {
            a,
            b,
            theta,
            step,
            sin: theta.sin(),
            cos: theta.cos(),
        }
    }

    /// Radiance that arrives from direction `d` (unit length, pointing away from the receiver).
    pub fn eval(&self, d: Vec3) -> Rgb {
        let [ax, ay, az] = self.axes;
        let l = Vec3::new(d.dot(ax), d.dot(ay), d.dot(az));
        let u = l.x.atan2(-l.z) * (0.5 / PI);
        let v = l.x.hypot(l.z).atan2(l.y) * (1.0 / PI);
        let x = u * self.width as f32 - 0.5;
        let y = v * (self.height - 1) as f32;
        let (x0, y0) = (x.floor(), y.floor().min((self.height - 2) as f32));
        let (fx, fy) = (x - x0, y - y0);
        // u lies in [-1/2, 1/2]: one turn added makes the column positive.
        let x0 = (x0 as isize + self.width as isize) as usize % self.width;
        let x1 = (x0 + 1) % self.width;
        let row = y0 as usize * self.width;
        let (top, bottom) = (
            &self.pixels[row..row + self.width],
            &self.pixels[row + self.width..],
        );
        top[x0]
            .lerp(top[x1], fx)
            .lerp(bottom[x0].lerp(bottom[x1], fx), fy)
    }

    /// Density per steradian with which [`EnvMap::sample`] returns `d`.
    pub fn pdf(&self, d: Vec3) -> f32 {
        self.density(self.eval(d))
    }

    /// The density that goes with the radiance `le`.
    fn density(&self, le: Rgb) -> f32 {
        if self.integral > 0.0 {
            (le.luminance() as f64 / self.integral).clamp(0.0, f32::MAX as f64) as f32
        } else {
            0.0
        }
    }

    /// A direction, the radiance from there and its density per steradian, which is positive.
    pub fn sample(&self, u: Vec2) -> Option<(Vec3, Rgb, f32)> {
        if self.integral <= 0.0 {
            return None;
        }
        // The band by its share, then the height within it, then the place along the circle there.
        let (band, rest) = pick(self.bands.len(), u.y as f64, |i| self.bands[i]);
        let w = self.width;
        let rows = [
            &self.along[band * w..][..w],
            &self.along[(band + 1) * w..][..w],
        ];
        let last = |r: usize| rows[r][w - 1] as f64;
        let f = self.band(band, last(0), last(1)).invert(rest);
        let sum = |i: usize| (1.0 - f) * rows[0][i] as f64 + f * rows[1][i] as f64;
        let total = sum(w - 1);
        let (x, rest) = pick(w, u.x as f64 * total, sum);
        let node = |x: usize| {
            (1.0 - f) * self.luminance(x, band) as f64 + f * self.luminance(x, band + 1) as f64
        };
        let fx = linear(node(x), node((x + 1) % w), rest);

        let theta = (band as f64 + f) * consts::PI / (self.height - 1) as f64;
        let phi = (x as f64 + fx + 0.5) / w as f64 * consts::TAU;
        let (sin, cos) = theta.sin_cos();
        let l = DVec3::new(sin * phi.sin(), cos, -sin * phi.cos()).as_vec3();
        let [ax, ay, az] = self.axes;
        let d = (ax * l.x + ay * l.y + az * l.z).normalize();
        let le = self.eval(d);
        let pdf = self.density(le);
        (pdf > 0.0).then_some((d, le, pdf))
    }
}

/// The interval of the non-decreasing upper ends `end(0..n)` in which `u` lies, and the place in it in
/// [0,1]. Intervals of no width are not returned while others remain.
fn pick(n: usize, u: f64, end: impl Fn(usize) -> f64) -> (usize, f64) {
    let (mut lo, mut hi) = (0, n - 1);
    while lo < hi {
        let mid = (lo + hi) / 2;
        if end(mid) <= u {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    let start = if lo == 0 { 0.0 } else { end(lo - 1) };
    let width = end(lo) - start;
    let rest = if width > 0.0 {
        (u - start) / width
    } else {
        0.5
    };
    (lo, rest.clamp(0.0, 1.0))
}

/// Inverse of the integral of a density that runs linearly from `a` to `b` over [0,1].
fn linear(a: f64, b: f64, u: f64) -> f64 {
    let root = a + (a * a + u * (b * b - a * a)).max(0.0).sqrt();
    if root > 0.0 {
        (u * (a + b) / root).clamp(0.0, 1.0)
    } else {
        u
    }
}

/// What lies between two rows: (a + (b - a) f) sin θ for θ = theta + f step, f in [0,1].
struct Band {
    a: f64,
    b: f64,
    theta: f64,
    step: f64,
    sin: f64,
    cos: f64,
}

impl Band {
    /// Integral over θ from the upper row down to `f`, and its derivative there.
    fn both(&self, f: f64) -> (f64, f64) {
        let (sin, cos) = (self.theta + f * self.step).sin_cos();
        let flat = self.cos - cos;
        let ramp = (sin - self.sin) / self.step - f * cos;
        let (a, slope) = (self.a, self.b - self.a);
        (a * flat + slope * ramp, (a + slope * f) * sin * self.step)
    }

    fn integral(&self, f: f64) -> f64 {
        self.both(f).0.max(0.0)
    }

    /// The `f` above which the share `u` of the integral lies: Newton's method, kept in a bracket.
    fn invert(&self, u: f64) -> f64 {
        let target = u * self.integral(1.0);
        let (mut lo, mut hi) = (0.0, 1.0);
        let at_ends = (self.theta + self.step).sin();
        let mut f = linear(self.a * self.sin, self.b * at_ends, u);
        for _ in 0..24 {
            let (value, slope) = self.both(f);
            let gap = value - target;
            if gap > 0.0 {
                hi = f;
            } else {
                lo = f;
            }
            let newton = f - gap / slope;
            let next = if newton > lo && newton < hi {
                newton
            } else {
                0.5 * (lo + hi)
            };
            if (next - f).abs() < 1e-9 {
                return next;
            }
            f = next;
        }
        f
    }
}
