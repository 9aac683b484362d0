//! The eight-lane operations that traversal needs, and their plain-array form.
//!
//! Each operation rounds once, and `min` and `max` treat NaN and signed zeros as x86 does (the second
//! operand wins). No fused operations: the two implementations must agree in every bit.

use super::{Lanes, WIDTH};

/// An instruction set. A value of the implementing type is the proof that the processor has it.
pub trait Isa: Copy {
    /// Eight numbers.
    type F: Copy;

    fn splat(self, x: f32) -> Self::F;
    fn load(self, a: &Lanes<f32>) -> Self::F;
    fn store(self, a: Self::F) -> Lanes<f32>;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a < b ? a : b`, so `b` if either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a > b ? a : b`, so `b` if either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Bit i is set where `a <= b` in lane i; no bit for NaN, here and below.
    fn le(self, a: Self::F, b: Self::F) -> u32;
    fn lt(self, a: Self::F, b: Self::F) -> u32;
    fn eq(self, a: Self::F, b: Self::F) -> u32;
    /// Fetch the cache lines of a `T` at `p`, which need not be valid.
    fn prefetch<T>(self, p: *const T);
}

/// Plain arrays: any processor.
#[derive(Clone, Copy)]
pub struct Plain;

#[inline(always)]
fn zip(a: Lanes<f32>, b: Lanes<f32>, f: impl Fn(f32, f32) -> f32) -> Lanes<f32> {
    Lanes(std::array::from_fn(|i| f(a.0[i], b.0[i])))
}

#[inline(always)]
fn mask(a: Lanes<f32>, b: Lanes<f32>, f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..WIDTH).fold(0, |m, i| m | u32::from(f(a.0[i], b.0[i])) << i)
}

impl Isa for Plain {
    type F = Lanes<f32>;

    #[inline(always)]
    fn splat(self, x: f32) -> Lanes<f32> {
        Lanes([x; WIDTH])
    }
    #[inline(always)]
    fn load(self, a: &Lanes<f32>) -> Lanes<f32> {
        *a
    }
    #[inline(always)]
    fn store(self, a: Lanes<f32>) -> Lanes<f32> {
        a
    }
    #[inline(always)]
    fn add(self, a: Lanes<f32>, b: Lanes<f32>) -> Lanes<f32> {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Lanes<f32>, b: Lanes<f32>) -> Lanes<f32> {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Lanes<f32>, b: Lanes<f32>) -> Lanes<f32> {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Lanes<f32>, b: Lanes<f32>) -> Lanes<f32> {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: Lanes<f32>, b: Lanes<f32>) -> Lanes<f32> {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Lanes<f32>, b: Lanes<f32>) -> Lanes<f32> {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, a: Lanes<f32>, b: Lanes<f32>) -> u32 {
        mask(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, a: Lanes<f32>, b: Lanes<f32>) -> u32 {
        mask(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn eq(self, a: Lanes<f32>, b: Lanes<f32>) -> u32 {
        mask(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn prefetch<T>(self, _: *const T) {}
}
