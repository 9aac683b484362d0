//! Colours that vary over a surface.
//!
//! Texel (0, 0) is the top left of the picture and lies at uv (0, 0); texel centres are at half-integers.

mod attribute;

use std::sync::{Arc, LazyLock};

use glam::Affine2;

use crate::image_io::color::srgb_to_linear;
use crate::math::{Rgb, Vec2};

pub use attribute::{AttributeValues, MeshAttribute};

/// A colour as a function of the surface parameters.
#[derive(Clone, Debug)]
pub enum Texture {
    Constant(Rgb),
    Bitmap(Bitmap),
    Checkerboard(Box<Checkerboard>),
    MeshAttribute(MeshAttribute),
}

/// A place on a surface, as textures see it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct At {
    /// Texture coordinates.
    pub uv: Vec2,
    /// Triangle of a mesh.
    pub prim: u32,
    /// Barycentric weights of its second and third corner.
    pub bary: Vec2,
}

impl Texture {
    #[inline]
    pub fn eval(&self, at: &At) -> Rgb {
        match self {
            Texture::Constant(c) => *c,
            Texture::Bitmap(b) => b.eval(at.uv),
            Texture::Checkerboard(c) => c.eval(at),
            Texture::MeshAttribute(a) => a.eval(at),
        }
    }

    /// The one number of a scalar texture: where it has a colour, as in Mitsuba, the luminance of a
    /// picture's and the mean of any other.
    #[inline]
    pub fn eval_scalar(&self, at: &At) -> f32 {
        match self {
            Texture::Constant(c) => mean(*c),
            Texture::Bitmap(b) => b.eval(at.uv).luminance(),
            Texture::Checkerboard(c) => c.eval_scalar(at),
            Texture::MeshAttribute(a) => mean(a.eval(at)),
        }
    }

    /// Change of [`Texture::eval_scalar`] with u and v; 0 where the texture is constant or steps.
    pub fn gradient(&self, uv: Vec2) -> Vec2 {
        match self {
            Texture::Bitmap(b) => b.gradient(uv),
            Texture::Constant(_) | Texture::Checkerboard(_) | Texture::MeshAttribute(_) => {
                Vec2::ZERO
            }
        }
    }

    /// The same texture in its cheapest form: one that has a single colour becomes that colour.
    pub fn folded(self) -> Texture {
        let single = match &self {
            Texture::Constant(c) => Some(*c),
            Texture::Bitmap(b) => b.texels.single_color(),
            Texture::MeshAttribute(a) => a.single_color(),
            Texture::Checkerboard(c) => match (&c.color0, &c.color1) {
                (Texture::Constant(a), Texture::Constant(b)) if a == b => Some(*a),
                _ => None,
            },
        };
        single.map_or(self, Texture::Constant)
    }

    pub fn as_constant(&self) -> Option<Rgb> {
        match self {
            Texture::Constant(c) => Some(*c),
            _ => None,
        }
    }
}

/// Of three equal numbers exactly that number.
fn mean(c: Rgb) -> f32 {
    match c.r == c.g && c.g == c.b {
        true => c.r,
        false => (c.r + c.g + c.b) / 3.0,
    }
}

/// What lies outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    Nearest,
    Bilinear,
}

/// The texels of a picture; 8-bit pictures stay 8-bit and are decoded when looked up.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// 8 bits per channel, sRGB-encoded when the flag is set, otherwise value / 255.
    Bytes {
        data: Vec<[u8; 3]>,
        srgb: bool,
    },
    Floats(Vec<[f32; 3]>),
}

/// A picture in memory; shared by the textures that use its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub texels: Texels,
}

impl Picture {
    #[inline]
    fn texel(&self, x: u32, y: u32) -> Rgb {
        let i = y as usize * self.width as usize + x as usize;
        match &self.texels {
            Texels::Floats(data) => Rgb::from_array(data[i]),
            Texels::Bytes { data, srgb } => {
                let decode: &[f32; 256] = if *srgb {
                    &SRGB_TO_LINEAR
                } else {
                    &BYTE_TO_UNIT
                };
                Rgb::from_array(data[i].map(|v| decode[v as usize]))
            }
        }
    }

    /// All texels, row by row from the top left, linear.
    pub fn colors(&self) -> Vec<Rgb> {
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| self.texel(x, y)))
            .collect()
    }

    fn single_color(&self) -> Option<Rgb> {
        let same = match &self.texels {
            Texels::Floats(data) => data.windows(2).all(|w| w[0] == w[1]),
            Texels::Bytes { data, .. } => data.windows(2).all(|w| w[0] == w[1]),
        };
        same.then(|| self.texel(0, 0))
    }
}

static BYTE_TO_UNIT: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| (i as f64 / 255.0) as f32));
static SRGB_TO_LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));

#[derive(Clone, Debug)]
pub struct Bitmap {
    pub texels: Arc<Picture>,
    pub interpolation: Interpolation,
    pub wrap: Wrap,
    /// Maps surface parameters to picture coordinates.
    pub to_uv: Affine2,
}

impl Bitmap {
    fn eval(&self, uv: Vec2) -> Rgb {
        let (w, h) = (self.texels.width, self.texels.height);
        let p = self.to_uv.transform_point2(uv) * Vec2::new(w as f32, h as f32);
        match self.interpolation {
            Interpolation::Nearest => {
                let cell = p.floor();
                self.at(cell.x as i64, cell.y as i64)
            }
            Interpolation::Bilinear => {
                let p = p - 0.5;
                let cell = p.floor();
                let f = p - cell;
                let (x, y) = (cell.x as i64, cell.y as i64);
                let top = self.at(x, y).lerp(self.at(x + 1, y), f.x);
                let bottom = self.at(x, y + 1).lerp(self.at(x + 1, y + 1), f.x);
                top.lerp(bottom, f.y)
            }
        }
    }

    /// The exact derivative of the bilinear surface of the luminance.
    fn gradient(&self, uv: Vec2) -> Vec2 {
        if self.interpolation == Interpolation::Nearest {
            return Vec2::ZERO;
        }
        let size = Vec2::new(self.texels.width as f32, self.texels.height as f32);
        let p = self.to_uv.transform_point2(uv) * size - 0.5;
        let cell = p.floor();
        let f = p - cell;
        let (x, y) = (cell.x as i64, cell.y as i64);
        let at = |dx: i64, dy: i64| self.at(x + dx, y + dy).luminance();
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        let slope = Vec2::new(
            (b - a) * (1.0 - f.y) + (d - c) * f.y,
            (c - a) * (1.0 - f.x) + (d - b) * f.x,
        );
        self.to_uv.matrix2.transpose() * (slope * size)
    }

    #[inline]
    fn at(&self, x: i64, y: i64) -> Rgb {
        self.texels.texel(
            wrap(self.wrap, x, self.texels.width),
            wrap(self.wrap, y, self.texels.height),
        )
    }
}

#[inline]
fn wrap(mode: Wrap, i: i64, size: u32) -> u32 {
    let n = i64::from(size);
    let inside = match mode {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let j = i.rem_euclid(2 * n);
            if j < n { j } else { 2 * n - 1 - j }
        }
    };
    inside as u32
}

/// A board of squares of half a unit: `color0` at the origin.
#[derive(Clone, Debug)]
pub struct Checkerboard {
    pub color0: Texture,
    pub color1: Texture,
    pub to_uv: Affine2,
}

impl Checkerboard {
    fn eval(&self, at: &At) -> Rgb {
        match self.is_first(at) {
            true => self.color0.eval(at),
            false => self.color1.eval(at),
        }
    }

    /// As a scalar the squares have each other's numbers: measured with Mitsuba 3.9.1, whose scenes are to
    /// keep their pictures.
    fn eval_scalar(&self, at: &At) -> f32 {
        match self.is_first(at) {
            true => self.color1.eval_scalar(at),
            false => self.color0.eval_scalar(at),
        }
    }

    /// Whether a place lies on a square like that at the origin.
    #[inline]
    fn is_first(&self, at: &At) -> bool {
        let p = self.to_uv.transform_point2(at.uv);
        let p = p - p.floor();
        (p.x > 0.5) == (p.y > 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Red counts columns, green counts rows.
    fn ramp(interpolation: Interpolation, wrap: Wrap) -> Bitmap {
        let data = (0..8)
            .map(|i| [(i % 4) as f32, (i / 4) as f32, 1.0])
            .collect();
        let texels = Arc::new(Picture {
            width: 4,
            height: 2,
            texels: Texels::Floats(data),
        });
        Bitmap {
            texels,
            interpolation,
            wrap,
            to_uv: Affine2::IDENTITY,
        }
    }

    /// Figures of Mitsuba 3.9.1.
    #[test]
    fn scalar_checkerboard_swaps_its_squares() {
        let board = Texture::Checkerboard(Box::new(Checkerboard {
            color0: Texture::Constant(Rgb::new(0.1, 0.5, 0.9)),
            color1: Texture::Constant(Rgb::splat(0.8)),
            to_uv: Affine2::IDENTITY,
        }));
        for (u, v, color, scalar) in [(0.2, 0.2, 0.1, 0.8), (0.7, 0.2, 0.8, 0.5)] {
            let at = At {
                uv: Vec2::new(u, v),
                ..At::default()
            };
            assert_eq!(board.eval(&at).r, color);
            assert!((board.eval_scalar(&at) - scalar).abs() < 1e-6);
        }
    }

    #[test]
    fn lookups_match_measured_values() {
        use Interpolation::*;
        use Wrap::*;
        // Red and green at (u, v), measured with Mitsuba 3.9.1 on the same ramp.
        let table = [
            (
                Bilinear,
                Repeat,
                [
                    (0.05, 0.1, 0.9, 0.3),
                    (0.95, 0.4, 2.1, 0.3),
                    (1.2, -0.3, 0.3, 0.9),
                ],
            ),
            (
                Bilinear,
                Mirror,
                [
                    (0.05, 0.1, 0.0, 0.0),
                    (0.95, 0.4, 3.0, 0.3),
                    (1.2, -0.3, 2.7, 0.1),
                ],
            ),
            (
                Bilinear,
                Clamp,
                [
                    (0.3, 0.9, 0.7, 1.0),
                    (1.2, -0.3, 3.0, 0.0),
                    (-0.1, 0.6, 0.0, 0.7),
                ],
            ),
            (
                Nearest,
                Repeat,
                [
                    (-0.1, 0.6, 3.0, 1.0),
                    (1.2, -0.3, 0.0, 1.0),
                    (2.3, 0.2, 1.0, 0.0),
                ],
            ),
            (
                Nearest,
                Mirror,
                [
                    (-0.1, 0.6, 0.0, 1.0),
                    (1.2, -0.3, 3.0, 0.0),
                    (2.3, 0.2, 1.0, 0.0),
                ],
            ),
        ];
        for (interpolation, wrap, points) in table {
            let bitmap = ramp(interpolation, wrap);
            for (u, v, r, g) in points {
                let c = bitmap.eval(Vec2::new(u, v));
                let close = (c.r - r).abs() < 1e-5 && (c.g - g).abs() < 1e-5;
                assert!(close, "{interpolation:?} {wrap:?} ({u}, {v}): {c:?}");
            }
        }
    }

    #[test]
    fn wild_coordinates_stay_inside() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for interpolation in [Interpolation::Nearest, Interpolation::Bilinear] {
                let bitmap = ramp(interpolation, wrap);
                for u in [f32::NAN, f32::INFINITY, -1e30, 1e30, -0.0] {
                    bitmap.eval(Vec2::new(u, -u));
                }
            }
        }
    }

    #[test]
    fn scalars_of_colours_match_measured_values() {
        // Mitsuba 3.9.1: luminance of a picture, mean of a colour.
        let texels = Texels::Floats(vec![[0.44723, 0.80453, 0.30388], [0.0; 3]]);
        let picture = Bitmap {
            texels: Arc::new(Picture {
                width: 2,
                height: 1,
                texels,
            }),
            ..ramp(Interpolation::Nearest, Wrap::Repeat)
        };
        let picture = Texture::Bitmap(picture);
        assert!((picture.eval_scalar(&At::default()) - 0.69241).abs() < 1e-4);
        let board = Texture::Checkerboard(Box::new(Checkerboard {
            color0: Texture::Constant(Rgb::new(0.1, 0.8, 0.3)),
            color1: picture,
            to_uv: Affine2::IDENTITY,
        }));
        assert!((board.eval_scalar(&At::default()) - 0.69241).abs() < 1e-4);
        let right = At {
            uv: Vec2::new(0.7, 0.2),
            ..At::default()
        };
        assert!((board.eval_scalar(&right) - 0.4).abs() < 1e-6);
        let third = Texture::Constant(Rgb::splat(0.1));
        assert_eq!(third.eval_scalar(&At::default()), 0.1);
    }

    #[test]
    fn single_coloured_textures_fold() {
        let texels = Texels::Bytes {
            data: vec![[255, 0, 255]; 6],
            srgb: true,
        };
        let picture = Arc::new(Picture {
            width: 3,
            height: 2,
            texels,
        });
        let bitmap = Bitmap {
            texels: picture,
            ..ramp(Interpolation::Bilinear, Wrap::Repeat)
        };
        assert_eq!(
            Texture::Bitmap(bitmap).folded().as_constant(),
            Some(Rgb::new(1.0, 0.0, 1.0))
        );
        assert!(
            Texture::Bitmap(ramp(Interpolation::Nearest, Wrap::Repeat))
                .folded()
                .as_constant()
                .is_none()
        );
    }
}
