//! The report: one page of HTML that holds all it shows, pictures included, and asks for nothing elsewhere.

use serde_json::{Value, json};

use super::Picture;
use super::error_map::{false_colour, false_colours};
use super::evaluate::{common_scale, pictures, to_image};
use super::plan::{Study, StudyError};
use super::sweep::Findings;
use crate::image_io::write_atomic;
use crate::math::Rgb;

const PAGE: &str = include_str!("report/page.html");
const STYLE: &str = include_str!("report/style.css");
const SCRIPTS: [&str; 3] = [
    include_str!("report/plots.js"),
    include_str!("report/pictures.js"),
    include_str!("report/tables.js"),
];

/// The page's name in the folder.
pub const NAME: &str = "report.html";

/// Pixels that all pictures of the page may have together: at some three bytes each, pages stay below 32 MiB.
const MOST_PIXELS: usize = 8 << 20;

/// Steps of the colour bar.
const BAR_STEPS: i32 = 16;

/// Writes the page.
///
/// # Errors
/// A picture cannot be read any more, or the file not be written.
pub fn write(study: &Study, findings: &Findings, json: &Value) -> Result<(), StudyError> {
    let reference = &findings.reference.reference.picture;
    let count = 1 + 3 * findings.rows.len();
    let block = block(count * reference.pixels.len());
    let small = |picture: &Picture| url(&shrunk(picture, block));
    let mut images = Vec::new();
    for row in &findings.rows {
        let scale = common_scale(&findings.rows, row.amount);
        let (first, mean) = pictures(study, row)?;
        images.push(json!({
            "run": small(&first)?,
            "error": small(&false_colours(&first, reference, scale))?,
            "bias": small(&false_colours(&mean, reference, scale))?,
        }));
    }
    let bar: Vec<String> = (-BAR_STEPS..=BAR_STEPS)
        .map(|i| css_colour(false_colour(i as f32 / BAR_STEPS as f32)))
        .collect();
    let pictures = json!({
        "reference": small(reference)?,
        "points": images,
        "block": block,
        "bar": bar,
    });
    let html = page(json, &pictures);
    write_atomic(&study.plan.folder.join(NAME), html.as_bytes())?;
    Ok(())
}

/// The page from the results and the pictures, both as its scripts read them.
pub fn page(results: &Value, pictures: &Value) -> String {
    let title = results["scene"].as_str().unwrap_or("scene");
    let mut html = PAGE.replace("{{title}}", &escape(title));
    html = html.replace("{{style}}", STYLE);
    html = html.replace("{{scripts}}", &SCRIPTS.join("\n"));
    // Last, since texts from outside may hold anything, `{{` included.
    let (before, after) = html.split_once("{{data}}").unwrap_or((&html, ""));
    let data = json!({ "results": results, "pictures": pictures });
    format!("{before}{}{after}", inert(&data.to_string()))
}

/// JSON that no parser of HTML takes for the end of a script.
fn inert(json: &str) -> String {
    json.replace('<', "\\u003c")
}

fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '{' => out.push_str("&#123;"),
            c => out.push(c),
        }
    }
    out
}

/// Side of the squares of pixels that become one, so that all pictures together fit.
fn block(pixels: usize) -> usize {
    (1..).find(|b| pixels / (b * b) <= MOST_PIXELS).unwrap_or(1)
}

/// Means of squares of `block` pixels; what is left over at the right and at the bottom makes smaller ones.
fn shrunk(picture: &Picture, block: usize) -> Picture {
    if block <= 1 {
        return picture.clone();
    }
    let (width, height) = (
        picture.width.div_ceil(block),
        picture.height.div_ceil(block),
    );
    let mean = |i: usize| {
        let (x0, y0) = ((i % width) * block, (i / width) * block);
        let (x1, y1) = (
            (x0 + block).min(picture.width),
            (y0 + block).min(picture.height),
        );
        let mut sum = Rgb::BLACK;
        for y in y0..y1 {
            for x in x0..x1 {
                sum += picture.pixels[y * picture.width + x];
            }
        }
        sum * (1.0 / ((x1 - x0) * (y1 - y0)) as f32)
    };
    Picture {
        width,
        height,
        pixels: (0..width * height).map(mean).collect(),
    }
}

fn url(picture: &Picture) -> Result<String, StudyError> {
    let png = to_image(picture).png().map_err(StudyError::Output)?;
    Ok(format!("data:image/png;base64,{}", base64(&png)))
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let at = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= chunk.len() {
                char::from(digit)
            } else {
                '='
            });
        }
    }
    out
}

fn css_colour(linear: Rgb) -> String {
    let byte =
        |v: f32| (crate::image_io::color::linear_to_srgb(v).clamp(0.0, 1.0) * 255.0).round() as u8;
    format!(
        "#{:02x}{:02x}{:02x}",
        byte(linear.r),
        byte(linear.g),
        byte(linear.b)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        for (text, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), coded);
        }
    }

    #[test]
    fn large_sets_of_pictures_are_shrunk_and_their_mean_stays() {
        assert_eq!(
            (block(0), block(MOST_PIXELS), block(MOST_PIXELS + 1)),
            (1, 1, 2)
        );
        let picture = Picture {
            width: 3,
            height: 2,
            pixels: (0..6).map(|i| Rgb::splat(i as f32)).collect(),
        };
        let small = shrunk(&picture, 2);
        assert_eq!((small.width, small.height), (2, 1));
        assert_eq!(small.pixels, [Rgb::splat(2.0), Rgb::splat(3.5)]);
    }

    #[test]
    fn texts_from_outside_stay_texts() {
        let results =
            json!({ "scene": "</title><script>{{data}}", "command": "</script>{{style}}" });
        let html = page(&results, &json!({}));
        assert!(html.contains("&lt;/title&gt;&lt;script&gt;&#123;&#123;data}}"));
        assert!(html.contains(r"\u003c/script>{{style}}"));
        assert!(!html.contains("{{scripts}}"));
    }

    #[test]
    fn the_page_asks_for_nothing_elsewhere() {
        let html = page(&json!({}), &json!({}));
        // The namespace of SVG is a name, not an address that is asked.
        let html = html.replace("http://www.w3.org/2000/svg", "");
        for outside in [
            "http:",
            "https:",
            "src=\"//",
            "@import",
            "fetch(",
            "XMLHttpRequest",
        ] {
            assert!(!html.contains(outside), "{outside}");
        }
    }
}
