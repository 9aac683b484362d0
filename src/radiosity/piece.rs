//! Flat pieces of surface: triangles and parallelograms, and how they are divided.

use crate::math::{DVec2, DVec3};

/// What part of the plane `o + s e1 + t e2` a piece covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outline {
    /// s, t ≥ 0 and s + t ≤ 1.
    Triangle,
    /// s and t in [0,1].
    Parallelogram,
}

/// A flat piece of surface, seen from the side that `e1` × `e2` points to. Lengths in scene units, relative to
/// the scene's centre like all its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub o: DVec3,
    pub e1: DVec3,
    pub e2: DVec3,
    pub outline: Outline,
}

impl Piece {
    /// The triangle with these corners, counter-clockwise as seen from its front.
    pub fn triangle([a, b, c]: [DVec3; 3]) -> Piece {
        Piece {
            o: a,
            e1: b - a,
            e2: c - a,
            outline: Outline::Triangle,
        }
    }

    /// The point at `st`.
    #[inline]
    pub fn at(&self, st: DVec2) -> DVec3 {
        self.o + self.e1 * st.x + self.e2 * st.y
    }

    /// A vector at right angles to the piece, as long as the parallelogram of its edges is large.
    #[inline]
    pub fn cross(&self) -> DVec3 {
        self.e1.cross(self.e2)
    }

    /// Unit normal; +z for a piece without area.
    #[inline]
    pub fn normal(&self) -> DVec3 {
        // Scaled first: squares of small areas leave the range.
        let n = self.cross();
        let scale = n.abs().max_element();
        match scale > 0.0 {
            true => (n / scale).normalize_or(DVec3::Z),
            false => DVec3::Z,
        }
    }

    pub fn area(&self) -> f64 {
        let n = self.cross();
        let scale = n.abs().max_element();
        let whole = match scale > 0.0 {
            true => (n / scale).length() * scale,
            false => 0.0,
        };
        match self.outline {
            Outline::Triangle => 0.5 * whole,
            Outline::Parallelogram => whole,
        }
    }

    pub fn center(&self) -> DVec3 {
        self.at(self.outline.center())
    }

    /// Corners in order around the piece, counter-clockwise from the front.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + Clone + '_ {
        self.outline.corners().iter().map(|st| self.at(*st))
    }

    /// The place of `p`, or of the nearest point of the plane, in the coordinates of the piece; not clamped to
    /// the piece. (0, 0) for a piece without area.
    pub fn locate(&self, p: DVec3) -> DVec2 {
        let scale = self.cross().abs().max_element();
        if scale <= 0.0 {
            return DVec2::ZERO;
        }
        let n = self.cross() / scale;
        let n2 = n.length_squared() * scale;
        let d = p - self.o;
        DVec2::new(d.cross(self.e2).dot(n) / n2, self.e1.cross(d).dot(n) / n2)
    }

    /// A point of the piece for `u` in [0,1)², uniform over the area.
    pub fn sample(&self, u: DVec2) -> DVec3 {
        self.at(self.outline.sample(u))
    }

    /// Length of the longest edge.
    pub fn longest_edge(&self) -> f64 {
        let edges = self.e1.length().max(self.e2.length());
        match self.outline {
            Outline::Triangle => edges.max((self.e2 - self.e1).length()),
            Outline::Parallelogram => edges,
        }
    }

    /// A quarter of the piece, of the same form: number `child` of four.
    pub fn child(&self, child: usize) -> Piece {
        let (e1, e2) = (self.e1 * 0.5, self.e2 * 0.5);
        let (o, turn) = match (self.outline, child) {
            (_, 0) => (self.o, 1.0),
            (_, 1) => (self.o + e1, 1.0),
            (_, 2) => (self.o + e2, 1.0),
            (Outline::Parallelogram, _) => (self.o + e1 + e2, 1.0),
            // The middle one stands on its head.
            (Outline::Triangle, _) => (self.o + e1 + e2, -1.0),
        };
        Piece {
            o,
            e1: e1 * turn,
            e2: e2 * turn,
            outline: self.outline,
        }
    }
}

impl Outline {
    pub fn center(self) -> DVec2 {
        match self {
            Outline::Triangle => DVec2::splat(1.0 / 3.0),
            Outline::Parallelogram => DVec2::splat(0.5),
        }
    }

    pub fn corners(self) -> &'static [DVec2] {
        const TRIANGLE: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];
        const SQUARE: [DVec2; 4] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        match self {
            Outline::Triangle => &TRIANGLE,
            Outline::Parallelogram => &SQUARE,
        }
    }

    /// [0,1)² to the outline, keeping areas: neighbours stay neighbours, so that well spread points stay well
    /// spread (the map of triangles is that of Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
    pub fn sample(self, u: DVec2) -> DVec2 {
        match self {
            Outline::Parallelogram => u,
            Outline::Triangle => {
                let h = if u.y > u.x {
                    DVec2::new(0.5 * u.x, u.y - 0.5 * u.x)
                } else {
                    DVec2::new(u.x - 0.5 * u.y, 0.5 * u.y)
                };
                h.max(DVec2::ZERO)
            }
        }
    }

    /// The nearest place that is surely inside: what rounding, or the flattening of a curve, put outside comes
    /// back.
    pub fn clamp(self, st: DVec2) -> DVec2 {
        let st = st.clamp(DVec2::ZERO, DVec2::ONE);
        let beyond = st.x + st.y - 1.0;
        match self {
            Outline::Triangle if beyond > 0.0 => {
                (st - DVec2::splat(0.5 * beyond)).clamp(DVec2::ZERO, DVec2::ONE)
            }
            _ => st,
        }
    }

    /// Whether `st` is inside or on the edge.
    pub fn contains(self, st: DVec2) -> bool {
        st.x >= 0.0
            && st.y >= 0.0
            && match self {
                Outline::Triangle => st.x + st.y <= 1.0,
                Outline::Parallelogram => st.x <= 1.0 && st.y <= 1.0,
            }
    }

    /// Which quarter of a piece `st` lies in, and where in it (see [`Piece::child`]).
    #[inline]
    pub fn child_at(self, st: DVec2) -> (usize, DVec2) {
        let twice = st * 2.0;
        match self {
            Outline::Parallelogram => {
                let (x, y) = (twice.x >= 1.0, twice.y >= 1.0);
                let corner = DVec2::new(f64::from(x), f64::from(y));
                (usize::from(x) + 2 * usize::from(y), twice - corner)
            }
            Outline::Triangle => {
                if twice.x >= 1.0 {
                    (1, twice - DVec2::X)
                } else if twice.y >= 1.0 {
                    (2, twice - DVec2::Y)
                } else if twice.x + twice.y <= 1.0 {
                    (0, twice)
                } else {
                    (3, DVec2::ONE - twice)
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces() -> [Piece; 2] {
        [Outline::Triangle, Outline::Parallelogram].map(|outline| Piece {
            o: DVec3::new(1.0, 2.0, 3.0),
            e1: DVec3::new(2.0, 0.5, 0.0),
            e2: DVec3::new(-0.5, 1.5, 1.0),
            outline,
        })
    }

    #[test]
    fn children_cover_the_piece_and_know_their_points() {
        for piece in pieces() {
            let children: f64 = (0..4).map(|i| piece.child(i).area()).sum();
            assert!((children / piece.area() - 1.0).abs() < 1e-14);
            for i in 0..400 {
                let u = DVec2::new(f64::from(i % 20) + 0.31, f64::from(i / 20) + 0.47) / 20.0;
                let st = piece.outline.sample(u);
                assert!(piece.outline.contains(st));
                let (child, inside) = piece.outline.child_at(st);
                assert!(piece.outline.contains(inside));
                assert!(piece.child(child).at(inside).distance(piece.at(st)) < 1e-14);
                assert!(piece.locate(piece.at(st)).distance(st) < 1e-13);
            }
        }
    }

    #[test]
    fn extremes_of_size_keep_area_and_normal() {
        for scale in [1e-100, 1e-6, 1.0, 1e6, 1e100] {
            for piece in pieces() {
                let scaled = Piece {
                    o: piece.o * scale,
                    e1: piece.e1 * scale,
                    e2: piece.e2 * scale,
                    ..piece
                };
                assert!((scaled.area() / (piece.area() * scale * scale) - 1.0).abs() < 1e-12);
                assert!(scaled.normal().distance(piece.normal()) < 1e-12);
                let st = piece.outline.center();
                assert!(scaled.locate(scaled.at(st)).distance(st) < 1e-9, "{scale}");
            }
        }
    }
}
