//! The opening that the light of a perspective camera comes through.

use std::f32::consts::TAU;

use crate::math::{Vec2, warp};

/// The shape of an opening of circumradius 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aperture {
    Disk,
    /// A regular polygon.
    Polygon {
        /// Corners, at least 3.
        blades: u32,
        /// Direction of the first corner, in radians from the camera's x axis (to the left) towards its
        /// y axis (up).
        rotation: f32,
    },
}

impl Aperture {
    /// A point of the opening, uniform over its area.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        match *self {
            Aperture::Disk => warp::concentric_disk(u),
            Aperture::Polygon { blades, rotation } => {
                // The triangle between the middle and two corners that `u.x` falls in.
                let n = blades as f32;
                let scaled = u.x * n;
                let wedge = scaled.floor().min(n - 1.0);
                let b = warp::triangle(Vec2::new((scaled - wedge).clamp(0.0, 1.0), u.y));
                let corner = |k: f32| Vec2::from_angle(rotation + TAU * (k / n));
                b.x * corner(wedge) + b.y * corner(wedge + 1.0)
            }
        }
    }

    /// Area of the opening for a circumradius of 1.
    pub fn area(&self) -> f32 {
        match *self {
            Aperture::Disk => 0.5 * TAU,
            Aperture::Polygon { blades, .. } => {
                let n = blades as f32;
                0.5 * n * (TAU / n).sin()
            }
        }
    }
}

/// What the rays of a point of the picture pass through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// One point: everything is sharp.
    Pinhole,
    /// A thin lens: sharp is what lies in a plane.
    Thin {
        /// Circumradius of the opening, in scene units.
        radius: f32,
        /// The same over the distance of the plane of focus from the lens.
        slope: f32,
        aperture: Aperture,
    },
}

impl Lens {
    /// An opening of this `radius`, focused on the plane at distance `focus` > 0, both in scene units. A
    /// radius of 0 is a pinhole.
    pub fn new(radius: f64, focus: f64, aperture: Aperture) -> Lens {
        match radius > 0.0 {
            true => Lens::Thin {
                radius: radius as f32,
                slope: (radius / focus) as f32,
                aperture,
            },
            false => Lens::Pinhole,
        }
    }
}
