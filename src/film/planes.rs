//! A film as planes of numbers, one per pixel, to be stored: what has been summed is kept to the last bit.

use super::{Film, Sum, Taken, Tile};
use std::fmt;

/// Names and planes, in a fixed order; each plane has one entry per pixel, row by row.
///
/// A sum is four planes, the low and high 32 bits of its two numbers (see [`Sum`]): `sum{r}{c}{i}` for channel c of
/// replicate r, `aov{c}_{i}`; `part{p}_{i}` are the two moments of a part, of two planes each; `taken_{i}` the number of
/// samples of both halves, those that are wanted next, and rays, where tiles differ.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes(pub Vec<(String, Vec<u32>)>);

/// Planes that are not those of a film like this one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaneError {
    /// The plane that is missing or wrong.
    pub name: String,
}

impl fmt::Display for PlaneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the plane \"{}\" is missing or has another size",
            self.name
        )
    }
}

impl std::error::Error for PlaneError {}

/// What one pixel keeps, as the planes have it.
fn numbers(tile: &Tile, i: usize, mut put: impl FnMut(u32)) {
    let (r, a) = (tile.replicates as usize, tile.aov_channels);
    let sums = tile.rgb[i * r..(i + 1) * r].iter().flatten();
    for sum in sums.chain(&tile.aov[i * a..(i + 1) * a]) {
        sum.to_bits().into_iter().for_each(&mut put);
    }
    for moment in tile.parts.of_pixel(i).iter().flatten() {
        let bits = moment.to_bits();
        put(bits as u32);
        put((bits >> 32) as u32);
    }
    if let Taken::Halves([even, odd]) = tile.taken {
        for n in [even, odd, tile.goal[0], tile.goal[1], tile.cost] {
            put(n as u32);
            put((n >> 32) as u32);
        }
    }
}

impl Film {
    fn plane_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for r in 0..self.replicates {
            for c in ["R", "G", "B"] {
                names.extend((0..4).map(|i| format!("sum{r}{c}{i}")));
            }
        }
        for c in 0..self.aov_channels {
            names.extend((0..4).map(|i| format!("aov{c}_{i}")));
        }
        for p in 0..self.parts() {
            names.extend((0..4).map(|i| format!("part{p}_{i}")));
        }
        if self.range().is_none() {
            names.extend((0..10).map(|i| format!("taken_{i}")));
        }
        names
    }

    /// All that it has summed.
    pub fn planes(&self) -> Planes {
        let names = self.plane_names();
        let width = self.window.width as usize;
        let pixels = width * self.window.height as usize;
        let mut planes = vec![vec![0; pixels]; names.len()];
        for tile in &self.tiles {
            for i in 0..(tile.width * tile.height) as usize {
                let at = tile.at(i, width);
                let mut all = planes.iter_mut();
                numbers(tile, i, |n| {
                    if let Some(plane) = all.next() {
                        plane[at] = n;
                    }
                });
            }
        }
        Planes(names.into_iter().zip(planes).collect())
    }

    /// Adds what another film of this kind has summed, of the samples `taken`; where tiles differ, `taken` counts for
    /// nothing and what was taken is found in the planes.
    ///
    /// # Errors
    /// Planes that are missing, or have another number of pixels; nothing is added then.
    pub fn add_planes(&mut self, planes: &Planes, taken: &Taken) -> Result<(), PlaneError> {
        let names = self.plane_names();
        let width = self.window.width as usize;
        let pixels = width * self.window.height as usize;
        let mut found = Vec::with_capacity(names.len());
        for name in names {
            let plane = planes.0.iter().find(|(n, _)| *n == name);
            let plane = plane.filter(|(_, plane)| plane.len() == pixels);
            match plane {
                Some((_, plane)) => found.push(plane),
                None => return Err(PlaneError { name }),
            }
        }
        let differ = self.range().is_none();
        for tile in &mut self.tiles {
            let (r, a) = (tile.replicates as usize, tile.aov_channels);
            let mut numbers = [0; 5];
            for i in 0..(tile.width * tile.height) as usize {
                let at = tile.at(i, width);
                let mut next = found.iter().map(|plane| plane[at]);
                let mut word = || next.next().unwrap_or(0);
                let sums = tile.rgb[i * r..(i + 1) * r].iter_mut().flatten();
                for sum in sums.chain(&mut tile.aov[i * a..(i + 1) * a]) {
                    *sum += Sum::from_bits([word(), word(), word(), word()]);
                }
                for moment in tile.parts.of_pixel_mut(i).iter_mut().flatten() {
                    *moment += f64::from_bits(u64::from(word()) | u64::from(word()) << 32);
                }
                if differ {
                    numbers = [(); 5].map(|_| u64::from(word()) | u64::from(word()) << 32);
                }
            }
            match differ {
                true => {
                    let [even, odd, a, b, cost] = numbers;
                    tile.take(&Taken::Halves([even, odd]));
                    (tile.goal, tile.cost) = ([a, b], cost);
                }
                false => tile.take(taken),
            }
        }
        Ok(())
    }
}

impl Tile {
    /// Where pixel `i` lies in a picture of `width`.
    fn at(&self, i: usize, width: usize) -> usize {
        let (x, y) = (i % self.width as usize, i / self.width as usize);
        (self.y as usize + y) * width + self.x as usize + x
    }
}

#[cfg(test)]
mod tests {
    use super::super::Window;
    use super::*;
    use crate::math::Rgb;

    const WINDOW: Window = Window {
        x: 3,
        y: 5,
        width: 21,
        height: 18,
    };

    fn fill(film: &mut Film, samples: std::ops::Range<u64>) {
        for tile in film.tiles_mut() {
            for y in 0..tile.height {
                for x in 0..tile.width {
                    for s in samples.clone() {
                        let v = ((s * 7 + u64::from(x * y)) as f32).sin().abs()
                            * 1e3f32.powi(s as i32 % 3);
                        tile.add(x, y, s, Rgb::new(v, 0.1 * v, v + 1.0));
                        tile.add_aov(x, y, &[v - 0.5, 3.0]);
                        tile.add_part(x, y, 0, f64::from(v));
                    }
                }
            }
        }
        film.finish_pass(samples.end - samples.start);
    }

    #[test]
    fn parts_come_to_the_whole_bit_for_bit() {
        let new = || Film::new(WINDOW, 4, 2).with_parts(1);
        let mut whole = new();
        fill(&mut whole, 0..23);
        let mut joined = new();
        for range in [0..5, 5..6, 6..23] {
            let mut part = new().from_sample(range.start);
            fill(&mut part, range.clone());
            joined
                .add_planes(&part.planes(), &Taken::Range(range))
                .unwrap();
        }
        assert_eq!(joined.range(), Some(0..23));
        let bits = |film: &Film| {
            film.mean()
                .concat()
                .iter()
                .map(|v| v.to_bits())
                .collect::<Vec<_>>()
        };
        assert_eq!(bits(&whole), bits(&joined));
        assert_eq!(whole.standard_error(), joined.standard_error());
        assert_eq!(whole.aov(0), joined.aov(0));
        assert_eq!(
            whole.part_moments(0).mean as f32,
            joined.part_moments(0).mean as f32
        );
    }

    #[test]
    fn planes_of_another_film_are_refused() {
        let mut film = Film::new(WINDOW, 4, 2);
        let planes = Film::new(WINDOW, 2, 2).planes();
        let error = film.add_planes(&planes, &Taken::Range(0..4)).unwrap_err();
        assert_eq!(error.name, "sum2R0");
        assert_eq!(film.spp(), 0);
    }

    #[test]
    fn halves_are_kept() {
        let mut film = Film::adaptive(WINDOW, 4, 0);
        for (i, tile) in film.tiles_mut().iter_mut().enumerate() {
            tile.add(0, 0, 2, Rgb::splat(0.1));
            tile.take(&Taken::Halves([i as u64, 4]));
        }
        let mut again = Film::adaptive(WINDOW, 4, 0);
        again
            .add_planes(&film.planes(), &Taken::Halves([0, 0]))
            .unwrap();
        assert_eq!(again.counts(), film.counts());
        assert_eq!(again.mean(), film.mean());
    }
}
