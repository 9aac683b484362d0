//! Pictures of an error: signed differences, and the same in false colours with a bar that tells the
//! scale.

use super::Picture;
use crate::math::Rgb;

/// The share of pixels whose error lies within the scale that is chosen automatically.
const SCALE_QUANTILE: f64 = 0.99;

/// OKLab coordinates of the ends of the colour map: of equal lightness and chroma, so that errors of
/// either sign look equally large.
const NEGATIVE: [f32; 3] = [0.45, -0.02, -0.17];
const POSITIVE: [f32; 3] = [0.45, 0.15, 0.08];
const WHITE: [f32; 3] = [1.0, 0.0, 0.0];

/// A false-colour picture of the error of luminance.
#[derive(Clone, Debug)]
pub struct ErrorMap {
    pub picture: Picture,
    /// The error of luminance, in units of radiance, that has the colour at the end of the bar; larger
    /// ones have it too.
    pub scale: f64,
}

/// Image - reference, channel by channel; both of the same size.
pub fn signed_difference(image: &Picture, reference: &Picture) -> Picture {
    let pairs = image.pixels.iter().zip(&reference.pixels);
    Picture {
        width: image.width,
        height: image.height,
        pixels: pairs.map(|(a, b)| *a - *b).collect(),
    }
}

/// Draws the luminance of image - reference: blue where the image is too dark, white where it is right,
/// red where it is too bright. Without a `scale` (above zero) one is chosen from the errors: rounded up
/// to 1, 2 or 5 times a power of ten, so that 99 % of the pixels lie within it.
pub fn error_map(image: &Picture, reference: &Picture, scale: Option<f64>) -> ErrorMap {
    let difference = signed_difference(image, reference);
    let errors: Vec<f32> = difference.pixels.iter().map(|p| p.luminance()).collect();
    let scale = scale.unwrap_or_else(|| scale_of(&errors));
    let mut canvas = Canvas::new(image.width, image.height, scale);
    for (i, error) in errors.iter().enumerate() {
        let (x, y) = (i % image.width, i / image.width);
        canvas.put(x, y, false_colour((f64::from(*error) / scale) as f32));
    }
    canvas.draw_bar(image.width, scale);
    ErrorMap {
        picture: canvas.picture,
        scale,
    }
}

/// The scale that [`error_map`] chooses for a picture of differences.
pub(super) fn choose_scale(difference: &Picture) -> f64 {
    let errors: Vec<f32> = difference.pixels.iter().map(|p| p.luminance()).collect();
    scale_of(&errors)
}

/// The colours of [`error_map`] without its bar, as large as the pictures.
pub(super) fn false_colours(image: &Picture, reference: &Picture, scale: f64) -> Picture {
    let mut map = signed_difference(image, reference);
    for p in &mut map.pixels {
        *p = false_colour((f64::from(p.luminance()) / scale) as f32);
    }
    map
}

fn scale_of(errors: &[f32]) -> f64 {
    let mut sizes: Vec<f32> = errors.iter().map(|e| e.abs()).collect();
    sizes.sort_unstable_by(f32::total_cmp);
    let last = sizes.len().saturating_sub(1);
    let quantile = sizes.get((last as f64 * SCALE_QUANTILE) as usize);
    // Where nearly all is right, what is left decides.
    let size = quantile.filter(|&&q| q > 0.0).or(sizes.last());
    let size = f64::from(size.copied().unwrap_or(0.0));
    if size == 0.0 || !size.is_finite() {
        return 1.0;
    }
    let power = 10f64.powf(size.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    // The power of ten carries a rounding error; do not step up because of it.
    let step = steps.into_iter().find(|s| s * power >= size * (1.0 - 1e-6));
    let scale = step.unwrap_or(10.0) * power;
    // Products with powers of ten are off in the last digit; people shall read 0.1.
    format!("{scale:.0e}").parse().unwrap_or(scale)
}

/// Linear colour for an error of -1 (blue) over 0 (white) to 1 (red), on straight lines through OKLab
/// (Ottosson 2020), where equal steps look equal.
pub(super) fn false_colour(error: f32) -> Rgb {
    let end = if error < 0.0 { NEGATIVE } else { POSITIVE };
    let t = error.abs().min(1.0);
    let [l, a, b] = std::array::from_fn(|c| WHITE[c] + t * (end[c] - WHITE[c]));
    let cube = |v: f32| v * v * v;
    let l_ = cube(l + 0.396_337_78 * a + 0.215_803_76 * b);
    let m_ = cube(l - 0.105_561_346 * a - 0.063_854_17 * b);
    let s_ = cube(l - 0.089_484_18 * a - 1.291_485_5 * b);
    Rgb::new(
        4.076_741_7 * l_ - 3.307_711_6 * m_ + 0.230_969_94 * s_,
        -1.268_438 * l_ + 2.609_757_4 * m_ - 0.341_319_4 * s_,
        -0.004_196_086 * l_ - 0.703_418_6 * m_ + 1.707_614_7 * s_,
    )
    .map(|v| v.clamp(0.0, 1.0))
}

/// Glyphs of 3 x 5 dots, one row in three bits, the leftmost highest.
const GLYPHS: [(char, [u8; 5]); 14] = [
    ('0', [0b111, 0b101, 0b101, 0b101, 0b111]),
    ('1', [0b010, 0b110, 0b010, 0b010, 0b111]),
    ('2', [0b111, 0b001, 0b111, 0b100, 0b111]),
    ('3', [0b111, 0b001, 0b011, 0b001, 0b111]),
    ('4', [0b101, 0b101, 0b111, 0b001, 0b001]),
    ('5', [0b111, 0b100, 0b111, 0b001, 0b111]),
    ('6', [0b111, 0b100, 0b111, 0b101, 0b111]),
    ('7', [0b111, 0b001, 0b010, 0b010, 0b010]),
    ('8', [0b111, 0b101, 0b111, 0b101, 0b111]),
    ('9', [0b111, 0b101, 0b111, 0b001, 0b111]),
    ('+', [0b000, 0b010, 0b111, 0b010, 0b000]),
    ('-', [0b000, 0b000, 0b111, 0b000, 0b000]),
    ('.', [0b000, 0b000, 0b000, 0b000, 0b010]),
    ('e', [0b000, 0b111, 0b111, 0b100, 0b111]),
];
const GLYPH_HEIGHT: usize = 5;
/// A glyph and the gap after it.
const GLYPH_ADVANCE: usize = 4;

/// Sizes of the bar, in dots: gap beside the picture, the bar, gap before the numbers.
const BAR: [usize; 3] = [4, 8, 3];
/// Lowest bar that has room for its three numbers, in dots.
const LOWEST_BAR: usize = 4 * GLYPH_HEIGHT;

/// The picture with room for the bar at its right, on light grey.
struct Canvas {
    picture: Picture,
    /// Side of a dot of the font, pixels.
    dot: usize,
}

impl Canvas {
    fn new(width: usize, height: usize, scale: f64) -> Canvas {
        let dot = (height / 200).max(1);
        let longest = labels(scale).iter().map(String::len).max().unwrap_or(0);
        let beside = (BAR.iter().sum::<usize>() + longest * GLYPH_ADVANCE) * dot;
        let (width, height) = (width + beside, height.max(LOWEST_BAR * dot));
        Canvas {
            picture: Picture {
                width,
                height,
                pixels: vec![Rgb::splat(0.8); width * height],
            },
            dot,
        }
    }

    fn put(&mut self, x: usize, y: usize, colour: Rgb) {
        if x < self.picture.width && y < self.picture.height {
            self.picture.pixels[y * self.picture.width + x] = colour;
        }
    }

    /// The bar over the whole height with its ends and middle labelled, right of column `left`.
    fn draw_bar(&mut self, left: usize, scale: f64) {
        let height = self.picture.height;
        let start = left + BAR[0] * self.dot;
        let text = start + (BAR[1] + BAR[2]) * self.dot;
        for y in 0..height {
            let error = 1.0 - 2.0 * (y as f32 + 0.5) / height as f32;
            for x in 0..BAR[1] * self.dot {
                self.put(start + x, y, false_colour(error));
            }
        }
        let room = height - GLYPH_HEIGHT * self.dot;
        for (label, y) in labels(scale).iter().zip([0, room / 2, room]) {
            self.draw_text(text, y, label);
        }
    }

    fn draw_text(&mut self, left: usize, top: usize, text: &str) {
        for (i, c) in text.chars().enumerate() {
            let Some((_, rows)) = GLYPHS.iter().find(|(glyph, _)| *glyph == c) else {
                continue;
            };
            let left = left + i * GLYPH_ADVANCE * self.dot;
            for y in 0..GLYPH_HEIGHT * self.dot {
                for x in 0..3 * self.dot {
                    if rows[y / self.dot] >> (2 - x / self.dot) & 1 == 1 {
                        self.put(left + x, top + y, Rgb::BLACK);
                    }
                }
            }
        }
    }
}

/// The numbers at the bar, from the top.
fn labels(scale: f64) -> [String; 3] {
    let number = if (1e-3..1e4).contains(&scale) {
        format!("{scale}")
    } else {
        format!("{scale:e}")
    };
    [format!("+{number}"), "0".to_string(), format!("-{number}")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_and_hold_the_errors() {
        let scale = |v: f32| scale_of(&[v; 10]);
        for (size, rounded) in [(0.1, 0.1), (0.11, 0.2), (3.0, 5.0), (5.1, 10.0), (0.0, 1.0)] {
            assert!((scale(size) / rounded - 1.0).abs() < 1e-6, "{size}");
            assert!((scale(-size) / rounded - 1.0).abs() < 1e-6, "{size}");
        }
        assert!(scale(1e-30) > 0.0 && scale(f32::MAX).is_finite());
    }

    #[test]
    fn colours_darken_evenly_to_both_sides_of_white() {
        let white = false_colour(0.0);
        assert!(white.min_component() > 0.999);
        for sign in [-1.0f32, 1.0] {
            let steps: Vec<Rgb> = (0..=10)
                .map(|i| false_colour(sign * i as f32 / 10.0))
                .collect();
            for pair in steps.windows(2) {
                assert!(pair[1].luminance() < pair[0].luminance());
            }
            let end = steps[10];
            assert_eq!(end.max_component(), if sign < 0.0 { end.b } else { end.r });
            assert_eq!(false_colour(sign * 7.0), end);
        }
    }

    #[test]
    fn the_map_shows_errors_where_they_are_and_draws_a_bar() {
        let grey = |v: f32| Picture {
            width: 30,
            height: 10,
            pixels: vec![Rgb::splat(v); 300],
        };
        let mut image = grey(1.0);
        image.pixels[3] = Rgb::splat(1.5);
        image.pixels[4] = Rgb::splat(0.5);
        let map = error_map(&image, &grey(1.0), Some(0.5));
        let at = |x: usize, y: usize| map.picture.pixels[y * map.picture.width + x];
        assert_eq!(
            (at(3, 0), at(4, 0)),
            (false_colour(1.0), false_colour(-1.0))
        );
        assert_eq!(at(5, 0), false_colour(0.0));
        // Low pictures get a canvas on which the numbers have room.
        assert_eq!(map.picture.height, LOWEST_BAR);
        let black = map.picture.pixels.iter().filter(|p| p.is_black()).count();
        assert!(black > 30, "the labels are drawn");
    }
}
