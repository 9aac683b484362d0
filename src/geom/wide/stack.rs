//! The stack of a traversal: what is still to visit, with the distance at which the ray enters it.
#![allow(unsafe_code)]

use super::{Child, MAX_DEPTH, WIDTH};
use std::mem::MaybeUninit;

const SIZE: usize = 256;
// Each level leaves at most WIDTH - 1 siblings behind.
const _: () = assert!(MAX_DEPTH as usize * (WIDTH - 1) < SIZE);

/// A child and its entry distance in one word that sorts by distance: non-negative floats order like
/// their bits.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub struct Entry(u64);

impl Entry {
    /// `t` is not negative and not NaN.
    #[inline(always)]
    pub fn new(child: Child, t: f32) -> Entry {
        Entry(u64::from(t.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    pub fn child(self) -> Child {
        Child(self.0 as u32)
    }

    #[inline(always)]
    pub fn t(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// Not initialised, because clearing it would cost more than tracing a ray through a small scene.
/// Indices are masked, so that a tree deeper than promised would give wrong results, not wild reads.
pub struct Stack {
    slots: [MaybeUninit<Entry>; SIZE],
    len: usize,
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Stack {
        Stack {
            slots: [const { MaybeUninit::uninit() }; SIZE],
            len: 0,
        }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn push(&mut self, e: Entry) {
        debug_assert!(self.len < SIZE);
        self.slots[self.len % SIZE] = MaybeUninit::new(e);
        self.len += 1;
    }

    /// Put `e` among the entries from `base` on, which are sorted with the nearest last.
    #[inline(always)]
    pub fn insert(&mut self, base: usize, e: Entry) {
        debug_assert!(self.len < SIZE);
        let mut at = self.len;
        while at > base {
            let below = self.get(at - 1);
            if below >= e {
                break;
            }
            self.slots[at % SIZE] = MaybeUninit::new(below);
            at -= 1;
        }
        self.slots[at % SIZE] = MaybeUninit::new(e);
        self.len += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        Some(self.get(self.len))
    }

    #[inline(always)]
    fn get(&self, at: usize) -> Entry {
        // SAFETY: `at` is below what `len` is or was just before, and every slot below `len` has been
        // written by `push` or `insert`; the mask maps only such indices onto each other.
        unsafe { self.slots[at % SIZE].assume_init() }
    }
}
