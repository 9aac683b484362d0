//! From lists of splats to the film.

use rayon::prelude::*;

use super::Invalid;
use crate::film::{Film, Splat, SplatBuffer};
use crate::math::{Rgb, Vec2};

/// Bands per thread: splats crowd in some rows.
const BANDS: usize = 4;

/// Adds the splats of the sample that is under way to all pixels, by way of the empty `buffer`, and to part
/// `part` of the film's moments if there is one. Those that are NaN, infinite or negative are left out and
/// returned. No sum depends on the number of threads, since the buffer's have no order.
pub fn add(
    mut lists: Vec<&mut Vec<Splat>>,
    buffer: &mut SplatBuffer,
    film: &mut Film,
    part: Option<usize>,
) -> Invalid {
    let mut invalid = Invalid::default();
    for list in &mut lists {
        list.retain(|splat| {
            let value = splat.value;
            let valid = buffer.accepts(value) && value.min_component() >= 0.0;
            if !valid {
                let pixel = splat.film.floor().max(Vec2::ZERO).as_uvec2();
                invalid.count += 1;
                invalid.first =
                    (invalid.first).or(Some((pixel.x, pixel.y, film.next_sample(), value)));
            }
            valid
        });
    }
    let bands = match rayon::current_num_threads() {
        1 => 1,
        n => n * BANDS,
    };
    buffer.bands(bands).par_iter_mut().for_each(|band| {
        let all = lists.iter().flat_map(|list| list.iter());
        all.for_each(|splat| band.add(splat));
    });
    let values = buffer.take();
    film.add_everywhere(&values);
    if let Some(part) = part {
        let luminance = |v: &[f64; 3]| f64::from(Rgb::from_array(v.map(|v| v as f32)).luminance());
        let values: Vec<f64> = values.iter().map(luminance).collect();
        film.add_part_everywhere(part, &values);
    }
    invalid
}
