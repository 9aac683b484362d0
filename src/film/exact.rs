//! Sums that do not depend on the order of what is added.

use std::ops::AddAssign;

/// A sum as two numbers that do not overlap: `high` is the sum rounded to 53 bits, `low` the rest.
///
/// Whatever is added, in whatever order and grouping, the sum is the same bit for bit as long as the lowest bit of
/// each term is above 2^-105 of the sum's highest: so the sum of the film, whose terms have 24 bits, is exact unless a
/// term is below 1e-24 of it; where one is, sums may differ by 1e-32 of themselves (two-sum: Knuth 1997, section
/// 4.2.2, theorem B).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    high: f64,
    low: f64,
}

impl Sum {
    pub const ZERO: Sum = Sum {
        high: 0.0,
        low: 0.0,
    };

    /// Rounded to nearest.
    #[inline]
    pub fn value(self) -> f64 {
        self.high
    }

    /// The bits of both numbers, to be stored.
    pub fn to_bits(self) -> [u32; 4] {
        let [a, b] = [self.high, self.low].map(f64::to_bits);
        [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32]
    }

    /// What [`Sum::to_bits`] gave.
    pub fn from_bits(bits: [u32; 4]) -> Sum {
        let joined = |low: u32, high: u32| f64::from_bits(u64::from(high) << 32 | u64::from(low));
        Sum {
            high: joined(bits[0], bits[1]),
            low: joined(bits[2], bits[3]),
        }
    }
}

/// Sum and rounding error.
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    let error = (a - (sum - of_b)) + (b - of_b);
    (sum, error)
}

impl AddAssign<f64> for Sum {
    /// `term` must be finite.
    #[inline]
    fn add_assign(&mut self, term: f64) {
        let (high, error) = two_sum(self.high, term);
        (self.high, self.low) = two_sum(high, self.low + error);
    }
}

impl AddAssign<Sum> for Sum {
    fn add_assign(&mut self, other: Sum) {
        *self += other.high;
        *self += other.low;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sum(terms: &[f32]) -> Sum {
        let mut sum = Sum::ZERO;
        terms.iter().for_each(|t| sum += f64::from(*t));
        sum
    }

    proptest! {
        /// Terms from 1e-9 to 1e9, as many as a few thousand samples of a film, in two orders and in parts.
        #[test]
        fn order_and_grouping_make_no_difference(
            terms in prop::collection::vec((0.0f32..1.0, -30i32..30, any::<bool>()), 1..2000),
            cut in 0.0f64..1.0,
            step in 1usize..50,
        ) {
            let term = |&(m, e, negative): &(f32, i32, bool)| m * 2f32.powi(e) * if negative { -1.0 } else { 1.0 };
            let terms: Vec<f32> = terms.iter().map(term).collect();
            let whole = sum(&terms);
            let mixed: Vec<f32> = (0..step).flat_map(|i| terms.iter().skip(i).step_by(step).copied()).collect();
            prop_assert_eq!(whole, sum(&mixed));
            let (a, b) = terms.split_at((cut * terms.len() as f64) as usize);
            let mut parts = sum(b);
            parts += sum(a);
            prop_assert_eq!(whole, parts);
            prop_assert_eq!(Sum::from_bits(whole.to_bits()), whole);
        }
    }

    #[test]
    fn what_is_far_smaller_is_not_lost() {
        let mut sum = Sum::ZERO;
        sum += 1e15;
        (0..1_000_000).for_each(|_| sum += 1e-3f32 as f64);
        let exact = 1e6 * f64::from(1e-3f32);
        assert_eq!(sum.value(), 1e15 + exact);
    }
}
