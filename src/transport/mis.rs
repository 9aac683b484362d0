//! Multiple importance sampling over all ways to find a path from both ends.
//!
//! A path x_0 (on an emitter) … x_k (the camera) can be found with s vertices made by the light's walk and the
//! rest by the eye's, for each s, and by merging at x_i, where both walks make x_i to within a disk. Let
//! p_i be the density per area with which the walk in question made x_i and q_i that of the other walk. A
//! walk sums up, vertex by vertex, the densities of all techniques that cut the path behind it, relative
//! to its own: with S_i for those up to the edge before x_i, relative to the technique that cuts there,
//!
//! ```text
//! S_i     = c_i + q_{i-1} (S_{i-1} / p_{i-1} + m_{i-1} eta)
//! ```
//!
//! where c_i is 1 if the edge can be cut, m_i is 1 if walks can be merged at x_i, eta is the area of the disk
//! times the number of photons, and every density ratio is raised to the power of the heuristic. q_{i-1}
//! depends on where the walk goes from x_i, so a [`State`] keeps its factor apart. This is the recursion of
//! Georgiev et al. 2012 ("Light transport simulation with vertex connection and merging") with every
//! technique switched by itself. Delta lobes count as density 1 in both directions, and no edge at them can
//! be cut. Whatever the densities are called, the weights of one path sum to one.

use crate::bsdf::Density;
use crate::light::EmissionPdf;

/// The power heuristic's exponent is 2 (Veach 1997, section 9.2.4).
#[inline]
pub fn power(ratio: f64) -> f64 {
    ratio * ratio
}

/// Ways to find paths, switched one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Techniques {
    /// The walk from the eye runs into emitters.
    pub emission: bool,
    /// Vertices of the eye's walk are connected to emitters.
    pub next_event: bool,
    /// Vertices of both walks are connected.
    pub connection: bool,
    /// Walks from lights per iteration that are connected to the camera; 0 for none.
    pub splats: f64,
    /// Photons per iteration times the area of the disk that they are gathered from; 0 for none.
    pub merging: f64,
    /// Share of its density that merging counts with where the eye's walk was scattered before, by other lobes
    /// than delta ones. Such a walk hits a bright spot by chance and then finds many photons at once: they
    /// are no independent samples, and the heuristic must not take them for such (Grittmann et al. 2021,
    /// "Correlation-aware multiple importance sampling for bidirectional rendering algorithms"). 0: none is
    /// merged there.
    pub later: f64,
}

impl Techniques {
    /// Whether there is more than one, so that weights must be known.
    pub fn weighs(&self) -> bool {
        self.emission || self.next_event || self.connection || self.splats > 0.0
    }

    /// What merging counts for where the eye's walk was scattered before by other lobes than delta ones
    /// (`later`), or not.
    #[inline]
    pub fn merging(&self, later: bool) -> f64 {
        match later {
            true => self.merging * self.later,
            false => self.merging,
        }
    }
}

/// What a walk knows on arriving at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// Density per area with which the walk made this vertex.
    pub pdf: f64,
    /// What the power of the density (per steradian) of going back from here is multiplied with.
    pub reverse: f64,
    /// Density, relative to this walk's, of the cut just before this vertex, if it has a lobe that is not a
    /// delta one.
    pub cut: f64,
    /// The same for light that comes here straight from an emitter.
    pub cut_straight: f64,
}

/// What a walk knows on leaving a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub struct Leg {
    /// Density per steradian of the direction.
    onward: f64,
    bracket: f64,
    /// If light is emitted at the next vertex.
    bracket_met: f64,
    cos: f64,
    cut: f64,
}

impl State {
    /// Sum over the cuts before this vertex, for a density `back` per steradian of going back.
    #[inline]
    pub fn sum(&self, back: f64) -> f64 {
        self.cut + power(back) * self.reverse
    }

    /// The same for light that comes here straight from an emitter.
    #[inline]
    pub fn sum_straight(&self, back: f64) -> f64 {
        self.cut_straight + power(back) * self.reverse
    }

    /// [`State::sum`], and merging here if `merging` is its eta, over the density of this vertex: what the density
    /// with which the other walk makes this vertex is multiplied with.
    #[inline]
    pub fn bracket(&self, back: f64, merging: f64) -> f64 {
        self.sum(back) / power(self.pdf) + power(merging)
    }

    /// Goes on with density `onward` in a direction at cosine `cos`; `back` is the density per steradian of
    /// going back. `merging` is what merging here counts for, and `cut` whether vertices are connected.
    #[inline]
    pub fn leave(
        &self,
        onward: Density,
        back: impl FnOnce() -> f32,
        cos: f64,
        cut: bool,
        merging: f64,
    ) -> Leg {
        match onward {
            Density::Delta => Leg {
                onward: 1.0,
                bracket: self.reverse / power(self.pdf),
                bracket_met: self.reverse / power(self.pdf),
                cos,
                cut: 0.0,
            },
            Density::PerSr(pdf) => {
                let back = f64::from(back());
                Leg {
                    onward: f64::from(pdf),
                    bracket: self.bracket(back, merging),
                    // Straight from an emitter, light is not merged.
                    bracket_met: self.sum_straight(back) / power(self.pdf),
                    cos,
                    cut: if cut { 1.0 } else { 0.0 },
                }
            }
        }
    }
}

impl Leg {
    /// Sum over all techniques but connecting to the emitter, relative to a walk that arrives at a point where
    /// light is emitted with the density `pdf`.
    #[inline]
    pub fn emitted(&self, pdf: &EmissionPdf) -> f64 {
        let ray = f64::from(pdf.start) * f64::from(pdf.onward) * self.cos;
        power(ray / (self.onward * f64::from(pdf.cos))) * self.bracket_met
    }

    /// Arrives after the squared distance `dist2` at a surface under the cosine `cos`.
    #[inline]
    pub fn arrive(&self, dist2: f64, cos: f64) -> State {
        let back = power(self.cos / dist2);
        State {
            pdf: self.onward * cos / dist2,
            reverse: back * self.bracket,
            cut: self.cut,
            cut_straight: self.cut,
        }
    }
}
