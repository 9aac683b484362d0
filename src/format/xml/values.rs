//! The text of an attribute as number, colour, spectrum, vector or step of a transform.

use super::super::error::shown_number;
use super::super::spectrum::Spectrum;
use crate::math::{DVec3, Frame, Transform, Vec3};

/// What is wrong, and what may help.
pub type Wrong = (String, Option<String>);

fn wrong(what: impl Into<String>) -> Wrong {
    (what.into(), None)
}

/// A finite number, also as f32, with nothing after it.
pub fn float(text: &str) -> Result<f64, Wrong> {
    let number: f64 = text
        .trim()
        .parse()
        .map_err(|_| wrong(format!("{} is not a number", quoted(text))))?;
    if !number.is_finite() {
        return Err(wrong(format!("{} is not a finite number", quoted(text))));
    }
    // Most of them become f32.
    if number.abs() > f32::MAX.into() {
        let what = format!("{} is too large: numbers reach to 3.4e38", quoted(text));
        return Err(wrong(what));
    }
    Ok(number)
}

pub fn int(text: &str) -> Result<i64, Wrong> {
    let digits = text.trim();
    let plain = digits.strip_prefix('-').unwrap_or(digits);
    if plain.is_empty() || !plain.bytes().all(|b| b.is_ascii_digit()) {
        return Err(wrong(format!("{} is not an integer", quoted(text))));
    }
    digits
        .parse()
        .map_err(|_| wrong(format!("{} is too large an integer", quoted(text))))
}

pub fn bool(text: &str) -> Result<bool, Wrong> {
    if text.eq_ignore_ascii_case("true") {
        Ok(true)
    } else if text.eq_ignore_ascii_case("false") {
        Ok(false)
    } else {
        let what = format!("{} is neither \"true\" nor \"false\"", quoted(text));
        Err(wrong(what))
    }
}

/// Numbers with commas or spaces between them.
pub fn floats(text: &str) -> Result<Vec<f64>, Wrong> {
    words(text).map(float).collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_ascii_whitespace())
        .filter(|word| !word.is_empty())
}

/// Three numbers, or one for all three.
pub fn triple(text: &str) -> Result<[f64; 3], Wrong> {
    match floats(text)?[..] {
        [x] => Ok([x; 3]),
        [x, y, z] => Ok([x, y, z]),
        ref numbers => {
            let what = format!("expected 1 or 3 numbers, found {}", numbers.len());
            Err(wrong(what))
        }
    }
}

/// `r, g, b` or one number. Hexadecimal colours are told apart, as older files may have them.
pub fn rgb(text: &str) -> Result<[f64; 3], Wrong> {
    let hex = text.trim();
    if let Some(digits) = hex.strip_prefix('#') {
        let linear = hex_to_linear(digits)
            .map(|[r, g, b]| format!("write the linear colour: value=\"{r:.6}, {g:.6}, {b:.6}\""));
        let what = format!("the hexadecimal colour {} is not supported", quoted(hex));
        return Err((what, linear));
    }
    triple(text)
}

/// `rrggbb` decoded by the sRGB curve (IEC 61966-2-1).
fn hex_to_linear(digits: &str) -> Option<[f64; 3]> {
    let all_hex = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
    let packed = all_hex.then(|| u32::from_str_radix(digits, 16).ok())??;
    let channel = |shift: u32| f64::from((packed >> shift) & 0xff) / 255.0;
    let decode = |c: f64| match c <= 0.04045 {
        true => c / 12.92,
        false => ((c + 0.055) / 1.055).powf(2.4),
    };
    Some([decode(channel(16)), decode(channel(8)), decode(channel(0))])
}

/// One number, or `nm:value` pairs by increasing wavelength.
pub fn spectrum(text: &str) -> Result<Spectrum, Wrong> {
    if !text.contains(':') {
        return match floats(text)?[..] {
            [value] => Ok(Spectrum::Uniform(value)),
            _ => Err((
                format!("{} is not a spectrum", quoted(text)),
                Some(
                    "write one number, or pairs such as \"400:0.1, 700:0.5\"; for RGB use <rgb>"
                        .into(),
                ),
            )),
        };
    }
    let pairs = words(text).map(|word| {
        let (nm, value) = word
            .split_once(':')
            .ok_or_else(|| wrong(format!("{} is not wavelength:value", quoted(word))))?;
        Ok((float(nm)?, float(value)?))
    });
    sampled(pairs.collect::<Result<_, Wrong>>()?)
}

/// The content of an `.spd` file: wavelength and value per line, `#` starts a comment.
///
/// The error comes with the number of the line, from 1; 0 for the file as a whole.
pub fn spectrum_file(text: &str) -> Result<Spectrum, (usize, String)> {
    let mut samples = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        match floats(line).map_err(|(what, _)| (i + 1, what))?[..] {
            [nm, value] => samples.push((nm, value)),
            _ => return Err((i + 1, "expected a wavelength and a value".into())),
        }
    }
    sampled(samples).map_err(|(what, _)| (0, what))
}

fn sampled(samples: Vec<(f64, f64)>) -> Result<Spectrum, Wrong> {
    if samples.len() < 2 {
        return Err(wrong("a spectrum needs at least two wavelengths"));
    }
    match samples.windows(2).find(|w| w[0].0 >= w[1].0) {
        Some(w) => Err(wrong(format!(
            "wavelengths must increase, but {} follows {}",
            w[1].0, w[0].0
        ))),
        None => Ok(Spectrum::Sampled(samples)),
    }
}

/// 9 or 16 numbers, row by row.
pub fn matrix(text: &str) -> Result<Transform, Wrong> {
    let m = floats(text)?;
    let mut rows = [[0.0; 4]; 4];
    rows[3][3] = 1.0;
    let side = match m.len() {
        9 => 3,
        16 => 4,
        n => return Err(wrong(format!("a matrix has 9 or 16 numbers, found {n}"))),
    };
    for (i, row) in m.chunks(side).enumerate() {
        rows[i][..side].copy_from_slice(row);
    }
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err(wrong("the last row of the matrix is not 0 0 0 1"));
    }
    Transform::from_rows(rows).ok_or_else(|| wrong("the matrix is singular"))
}

pub fn scale(factors: DVec3) -> Result<Transform, Wrong> {
    Transform::scale(factors).ok_or_else(|| {
        let [x, y, z] = factors.to_array().map(shown_number);
        let what = format!("scaling by ({x}, {y}, {z}) cannot be undone");
        wrong(what)
    })
}

/// Any length of axis but zero. (Mitsuba 3.9 takes the axis as a unit vector without making it one.)
pub fn rotate(axis: DVec3, degrees: f64) -> Result<Transform, Wrong> {
    Transform::rotate(axis, degrees).ok_or_else(|| wrong("the axis of rotation is zero"))
}

/// Without `up`, one is chosen as Mitsuba does.
pub fn look_at(origin: DVec3, target: DVec3, up: Option<DVec3>) -> Result<Transform, Wrong> {
    let dir = (target - origin)
        .try_normalize()
        .ok_or_else(|| wrong("origin and target are the same point"))?;
    let up = up.unwrap_or_else(|| {
        let n = Vec3::new(dir.x as f32, dir.y as f32, dir.z as f32);
        Frame::from_normal(n).s.as_dvec3()
    });
    Transform::look_at(origin, target, up)
        .ok_or_else(|| wrong("\"up\" is parallel to the direction of view"))
}

/// A piece of input in quotes, cut when long.
pub fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(40).collect();
    if shown.len() < text.len() {
        shown.push_str("...");
    }
    format!("\"{shown}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_complete_and_finite() {
        assert_eq!(float(" .5 "), Ok(0.5));
        assert_eq!(float("+1e-3"), Ok(1e-3));
        for bad in [
            "", "1a", "1,5", "nan", "inf", "1e999", "-1e39", "0x10", "1 2",
        ] {
            assert!(float(bad).is_err(), "{bad}");
        }
        assert_eq!(int(" -12 "), Ok(-12));
        for bad in ["", "+1", "1.5", "1e3", "9223372036854775808", "-"] {
            assert!(int(bad).is_err(), "{bad}");
        }
        assert_eq!(bool("TRUE"), Ok(true));
        assert!(bool("1").is_err());
        assert_eq!(triple("1,,2 3,"), Ok([1.0, 2.0, 3.0]));
        assert!(triple("1,2").is_err());
    }

    #[test]
    fn hexadecimal_colours_say_what_to_write() {
        let (_, help) = rgb("#ff8000").unwrap_err();
        let expected = "write the linear colour: value=\"1.000000, 0.215861, 0.000000\"";
        assert_eq!(help.as_deref(), Some(expected));
        assert_eq!(rgb("#ää").unwrap_err().1, None);
    }

    #[test]
    fn look_at_without_up_is_that_of_mitsuba() {
        let t = look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, None).unwrap();
        let left = DVec3::new(-0.0792865, 0.841427, -0.534522);
        let up = DVec3::new(0.960357, -0.0792865, -0.267261);
        assert!((t.vector(DVec3::X) - left).length() < 1e-5);
        assert!((t.vector(DVec3::Y) - up).length() < 1e-5);
    }

    #[test]
    fn spectra_come_from_text_and_files() {
        assert_eq!(spectrum("2"), Ok(Spectrum::Uniform(2.0)));
        let two = Spectrum::Sampled(vec![(400.0, 1.0), (500.5, 2.0)]);
        assert_eq!(spectrum("400:1 500.5:2"), Ok(two.clone()));
        assert_eq!(spectrum_file("# x\n400 1\n\n500.5, 2 # y"), Ok(two));
        for bad in [
            "400:1",
            "500:1,400:2",
            "400:1,500",
            "0.5,0.6",
            "400:x,500:1",
        ] {
            assert!(spectrum(bad).is_err(), "{bad}");
        }
        assert_eq!(spectrum_file("400 1\nx 2").unwrap_err().0, 2);
    }
}
