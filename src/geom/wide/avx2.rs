//! The eight-lane operations as AVX2 instructions, and the traversal compiled for them.
//!
//! The soundness of every block below rests on one fact: an [`Avx2`] value exists only where
//! [`Avx2::detect`] has seen that the processor has these instructions.
#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, trace};

#[cfg(not(target_arch = "x86_64"))]
pub use none::{Avx2, trace};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::isa::Isa;
    use super::super::trace as generic;
    use super::super::{Found, Lanes, Leaf, Wide};
    use crate::geom::Ray;
    use std::arch::x86_64::*;

    /// Proof that the processor has AVX2 and the bit instructions of its generation.
    #[derive(Clone, Copy)]
    pub struct Avx2(());

    impl Avx2 {
        pub fn detect() -> Option<Avx2> {
            let all = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt");
            all.then_some(Avx2(()))
        }
    }

    /// The traversal of `trace.rs`, compiled with these instructions.
    #[inline]
    pub fn trace<L: Leaf, const ANY: bool>(
        isa: Avx2,
        wide: &Wide,
        ray: &Ray,
        leaf: &L,
    ) -> Option<Found> {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
        fn inner<L: Leaf, const ANY: bool>(
            isa: Avx2,
            wide: &Wide,
            ray: &Ray,
            leaf: &L,
        ) -> Option<Found> {
            generic::trace::<Avx2, L, ANY>(isa, wide, ray, leaf)
        }
        // SAFETY: `isa` proves that the processor has the features enabled above.
        unsafe { inner::<L, ANY>(isa, wide, ray, leaf) }
    }

    macro_rules! binary {
        ($($name:ident $op:ident;)*) => {$(
            #[inline(always)]
            fn $name(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: `self` proves that the processor has AVX.
                unsafe { $op(a, b) }
            }
        )*};
    }

    macro_rules! compare {
        ($($name:ident $predicate:ident;)*) => {$(
            #[inline(always)]
            fn $name(self, a: __m256, b: __m256) -> u32 {
                // SAFETY: `self` proves that the processor has AVX.
                unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<$predicate>(a, b)) as u32 }
            }
        )*};
    }

    impl Isa for Avx2 {
        type F = __m256;

        binary! {
            add _mm256_add_ps;
            sub _mm256_sub_ps;
            mul _mm256_mul_ps;
            div _mm256_div_ps;
            min _mm256_min_ps;
            max _mm256_max_ps;
        }
        compare! {
            le _CMP_LE_OQ;
            lt _CMP_LT_OQ;
            eq _CMP_EQ_OQ;
        }

        #[inline(always)]
        fn splat(self, x: f32) -> __m256 {
            // SAFETY: `self` proves that the processor has AVX.
            unsafe { _mm256_set1_ps(x) }
        }

        #[inline(always)]
        fn load(self, a: &Lanes<f32>) -> __m256 {
            // SAFETY: `self` proves AVX; `Lanes` holds 8 floats and is aligned to 32 bytes.
            unsafe { _mm256_load_ps(a.0.as_ptr()) }
        }

        #[inline(always)]
        fn store(self, a: __m256) -> Lanes<f32> {
            let mut to = Lanes([0.0; 8]);
            // SAFETY: `self` proves AVX; `Lanes` holds 8 floats and is aligned to 32 bytes.
            unsafe { _mm256_store_ps(to.0.as_mut_ptr(), a) };
            to
        }

        #[inline(always)]
        fn prefetch<T>(self, p: *const T) {
            for line in 0..size_of::<T>().div_ceil(64) {
                // SAFETY: prefetching reads nothing and never faults, whatever the address.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(p.cast::<i8>().wrapping_add(64 * line)) };
            }
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
mod none {
    use super::super::{Found, Leaf, Wide};
    use crate::geom::Ray;

    /// Does not exist on this processor.
    #[derive(Clone, Copy)]
    pub enum Avx2 {}

    impl Avx2 {
        pub fn detect() -> Option<Avx2> {
            None
        }
    }

    pub fn trace<L: Leaf, const ANY: bool>(isa: Avx2, _: &Wide, _: &Ray, _: &L) -> Option<Found> {
        match isa {}
    }
}
