//! Whether an iteration comes nearer.

/// Looks at the residual of every round (a sweep, or as many shots as there are patches).
pub(super) struct Watch {
    rounds: u32,
    /// Residual at the last look.
    before: f64,
}

/// Rounds between two looks: light that travels through white rooms loses nothing before it is there.
const WINDOW: u32 = 100;

/// Share of the residual that a window must take away: less than a millionth of the light fades in a round, which
/// is not told from the error of form factors (see `direct::MOST_GAIN`).
const LEAST: f64 = 1e-4;

/// A residual that no iteration reaches which will converge: it begins with what was emitted, as 1.
const GROWN: f64 = 1e3;

/// Whether light grows.
pub(super) fn grows(residual: f64) -> bool {
    !residual.is_finite() || residual > GROWN
}

impl Watch {
    pub fn new() -> Watch {
        Watch {
            rounds: 0,
            before: f64::INFINITY,
        }
    }

    /// Whether the iteration has stopped to come nearer, with `residual` after one more round.
    pub fn is_stuck(&mut self, residual: f64) -> bool {
        if grows(residual) {
            return true;
        }
        self.rounds += 1;
        if !self.rounds.is_multiple_of(WINDOW) {
            return false;
        }
        let stuck = residual > self.before * (1.0 - LEAST);
        self.before = residual;
        stuck
    }
}
