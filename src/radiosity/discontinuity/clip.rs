//! Parts of straight lines.

use crate::math::DVec2;
use crate::radiosity::piece::Outline;

/// The part [from, to] of [0,1] in which linear functions are positive.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from: f64,
    pub to: f64,
}

impl Part {
    pub const ALL: Part = Part { from: 0.0, to: 1.0 };

    /// Keeps where the function that is `a` at 0 and `b` at 1 is not negative; whether anything is left.
    #[inline]
    pub fn keep(&mut self, a: f64, b: f64) -> bool {
        if a < 0.0 && b < 0.0 {
            return false;
        }
        if a < 0.0 {
            self.from = self.from.max(a / (a - b));
        } else if b < 0.0 {
            self.to = self.to.min(a / (a - b));
        }
        self.from < self.to
    }
}

/// The part of the line between two places that lies within an outline.
pub fn to_outline(outline: Outline, [a, b]: [DVec2; 2]) -> Option<[DVec2; 2]> {
    let mut part = Part::ALL;
    let inside = part.keep(a.x, b.x)
        && part.keep(a.y, b.y)
        && match outline {
            Outline::Triangle => part.keep(1.0 - a.x - a.y, 1.0 - b.x - b.y),
            Outline::Parallelogram => {
                part.keep(1.0 - a.x, 1.0 - b.x) && part.keep(1.0 - a.y, 1.0 - b.y)
            }
        };
    inside.then(|| [a.lerp(b, part.from), a.lerp(b, part.to)].map(|st| outline.clamp(st)))
}

/// Distances of `st` from the lines that the sides of an outline lie on: 0 on them, positive inside.
pub fn depths(outline: Outline, st: DVec2) -> [f64; 4] {
    match outline {
        Outline::Triangle => [st.x, st.y, 1.0 - st.x - st.y, 1.0],
        Outline::Parallelogram => [st.x, st.y, 1.0 - st.x, 1.0 - st.y],
    }
}
