//! Which samples pixels have received, and what their sums come to.

use super::Sum;
use std::ops::Range;

/// Samples that each pixel of a tile has received, by their numbers. Sample `s` belongs to replicate `s % R`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Taken {
    /// All from the first to before the last.
    Range(Range<u64>),
    /// So many of the even and of the odd replicates, the first ones of each. Each half decides how many samples the
    /// other gets, never how many it gets itself: so no half's mean depends on its own luck, and the pixel is the mean of
    /// both means.
    Halves([u64; 2]),
}

impl Taken {
    pub fn count(&self) -> u64 {
        match self {
            Taken::Range(range) => range.end - range.start,
            Taken::Halves([even, odd]) => even + odd,
        }
    }

    pub fn add(&mut self, more: &Taken) {
        match (self, more) {
            (Taken::Range(all), Taken::Range(more)) => {
                debug_assert_eq!(all.end, more.start);
                all.end = more.end;
            }
            (Taken::Halves(all), Taken::Halves(more)) => {
                (all.iter_mut().zip(more)).for_each(|(n, more)| *n += more);
            }
            _ => debug_assert!(false, "films of different kinds"),
        }
    }

    /// Samples of replicate `r` of `of`.
    #[inline]
    pub fn of_replicate(&self, r: usize, of: usize) -> u64 {
        let (r, of) = (r as u64, of as u64);
        match self {
            Taken::Range(range) => {
                let before = |n: u64| n / of + u64::from(r < n % of);
                before(range.end) - before(range.start)
            }
            Taken::Halves(halves) => {
                let (n, half) = (halves[(r % 2) as usize], of / 2);
                n / half + u64::from(r / 2 < n % half)
            }
        }
    }

    /// Number of sample `i` of half `half`, 0 or 1, with `of` replicates.
    #[inline]
    pub fn number_in_half(i: u64, half: u64, of: u64) -> u64 {
        i / (of / 2) * of + 2 * (i % (of / 2)) + half
    }

    /// Mean of a pixel whose replicates have these sums; 0 where there are no samples.
    #[inline]
    pub(super) fn mean(&self, sum_of: impl Fn(usize) -> Sum, replicates: usize) -> f64 {
        let over = |first: usize, step: usize, n: u64| {
            let mut sum = Sum::ZERO;
            for r in (first..replicates).step_by(step) {
                sum += sum_of(r);
            }
            sum.value() / n.max(1) as f64
        };
        match self {
            Taken::Range(_) => over(0, 1, self.count()),
            Taken::Halves([even, odd]) => 0.5 * (over(0, 2, *even) + over(1, 2, *odd)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replicates_have_the_samples_that_they_should() {
        for of in [4usize, 8, 16] {
            for (from, to) in [(0u64, 50u64), (3, 4), (17, 64), (5, 5)] {
                let range = Taken::Range(from..to);
                for r in 0..of {
                    let counted = (from..to).filter(|s| s % of as u64 == r as u64).count();
                    assert_eq!(range.of_replicate(r, of), counted as u64);
                }
            }
            let halves = [13u64, 30];
            let mut counts = vec![0; of];
            for half in 0..2 {
                for i in 0..halves[half as usize] {
                    let s = Taken::number_in_half(i, half, of as u64);
                    let r = (s % of as u64) as usize;
                    assert_eq!(r as u64 % 2, half);
                    // Replicates get their points one after the other.
                    assert_eq!(s / of as u64, counts[r]);
                    counts[r] += 1;
                }
            }
            let taken = Taken::Halves(halves);
            assert!((0..of).all(|r| taken.of_replicate(r, of) == counts[r]));
        }
    }
}
