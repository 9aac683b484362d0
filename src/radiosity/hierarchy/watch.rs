//! Whether work that takes long is to go on.

use super::gather::Field;
use super::output;
use super::tree::Tree;
use crate::radiosity::{PatchMesh, Progress, Rgb64};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Time between two looks: so fast a wish to stop is heard.
const OFTEN: Duration = Duration::from_millis(200);
/// What is shown is as old as this many times what it takes to make it, at most: looking costs little.
const WORTH: u32 = 20;

/// Shows the state to an observer, which may say that it is enough.
pub struct Watch<'a> {
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    /// Of the last solution.
    pub step: u64,
    pub residual: f64,
    looked: Instant,
    shown: Option<Shown>,
    stopped: bool,
}

/// A state as it is shown.
struct Shown {
    mesh: PatchMesh,
    radiosity: Vec<Rgb64>,
    made: Instant,
    /// Time that it took.
    took: Duration,
}

impl Shown {
    fn new(tree: &Tree, field: &Field) -> Shown {
        let start = Instant::now();
        let (mesh, numbers) = output::mesh(tree);
        Shown {
            radiosity: output::by_patch(&numbers, &field.radiosity),
            mesh,
            made: Instant::now(),
            took: start.elapsed(),
        }
    }
}

impl<'a> Watch<'a> {
    pub fn new(observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Watch<'a> {
        Watch {
            observe,
            step: 0,
            residual: 1.0,
            looked: Instant::now(),
            shown: None,
            stopped: false,
        }
    }

    /// Whether the observer has said that it is enough.
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Shows the state as it is.
    pub fn show(&mut self, tree: &Tree, field: &Field) {
        self.shown = Some(Shown::new(tree, field));
        self.ask();
    }

    /// Shows the state as it was lately, if that has not been done for a while. Gives whether the work is to end;
    /// the result of work that goes on does not depend on it.
    #[inline]
    pub fn look(&mut self, tree: &Tree, field: &Field) -> bool {
        if !self.stopped && self.looked.elapsed() >= OFTEN {
            let is_new = |s: &Shown| s.made.elapsed() < WORTH * s.took.max(OFTEN / WORTH);
            if !self.shown.as_ref().is_some_and(is_new) {
                self.shown = Some(Shown::new(tree, field));
            }
            self.ask();
        }
        self.stopped
    }

    fn ask(&mut self) {
        if let Some(shown) = &self.shown {
            let progress = Progress {
                step: self.step,
                mesh: &shown.mesh,
                radiosity: &shown.radiosity,
                ambient: Rgb64::ZERO,
                residual: self.residual,
            };
            self.stopped |= (self.observe)(&progress).is_break();
        }
        self.looked = Instant::now();
    }
}
