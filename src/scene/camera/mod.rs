//! Where camera rays come from, and what the light along them counts for.
//!
//! A camera turns a point of the picture, a point of the lens and a time into a ray; a meter does the same
//! for the one pixel that it has. Where it stands is a [`View`], which may move while the shutter is open;
//! what it makes of the picture is one of the files beside this one.

mod connect;
mod distant;
mod irradiancemeter;
mod lens;
mod orthographic;
mod perspective;
mod radiancemeter;
mod surface;
mod view;

pub use connect::Sight;
pub use distant::{Distant, Target};
pub use irradiancemeter::IrradianceMeter;
pub use lens::{Aperture, Lens};
pub use orthographic::{Orthographic, OrthographicSpec};
pub use perspective::{FovAxis, Perspective, PerspectiveSpec};
pub use radiancemeter::RadianceMeter;
pub use surface::Surface;
pub use view::{Pose, View};

use crate::geom::Ray;
use crate::math::Vec2;

/// What decides a camera ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSample {
    /// Point of the picture, in pixels from its top left corner.
    pub film: Vec2,
    /// Point of the lens, or whatever else a sensor spreads its rays over, in [0,1)².
    pub lens: Vec2,
    /// 0 to 1 over the shutter.
    pub time: f32,
}

impl CameraSample {
    /// Through the middle of the lens as the shutter opens.
    pub fn central(film: Vec2) -> CameraSample {
        CameraSample {
            film,
            lens: Vec2::splat(0.5),
            time: 0.0,
        }
    }
}

/// A ray into the scene.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    pub ray: Ray,
    /// What the radiance that arrives along it is multiplied with: 1 for everything that measures
    /// radiance.
    pub weight: f32,
}

/// A sensor of the scene, in its coordinates.
#[derive(Clone, Debug)]
pub struct Camera(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Perspective(View, Perspective),
    Orthographic(View, Orthographic),
    RadianceMeter(View, RadianceMeter),
    IrradianceMeter(IrradianceMeter),
    Distant(View, Distant),
}

impl Camera {
    pub fn perspective(view: View, perspective: Perspective) -> Camera {
        Camera(Kind::Perspective(view, perspective))
    }

    pub fn orthographic(view: View, orthographic: Orthographic) -> Camera {
        Camera(Kind::Orthographic(view, orthographic))
    }

    pub fn radiance_meter(view: View) -> Camera {
        Camera(Kind::RadianceMeter(view, RadianceMeter))
    }

    pub fn irradiance_meter(meter: IrradianceMeter) -> Camera {
        Camera(Kind::IrradianceMeter(meter))
    }

    /// Of the view, its direction alone counts.
    pub fn distant(view: View, distant: Distant) -> Camera {
        Camera(Kind::Distant(view, distant))
    }

    /// The ray of a sample.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> CameraRay {
        let (mut ray, weight) = match &self.0 {
            Kind::Perspective(view, p) => (p.ray(&view.at(sample.time), sample), 1.0),
            Kind::Orthographic(view, o) => (o.ray(&view.at(sample.time), sample), 1.0),
            Kind::RadianceMeter(view, m) => (m.ray(&view.at(sample.time)), 1.0),
            Kind::IrradianceMeter(m) => m.ray(sample),
            Kind::Distant(view, d) => d.ray(&view.at(sample.time), sample),
        };
        ray.time = sample.time;
        CameraRay { ray, weight }
    }

    /// What the rays of a perspective camera pass through; `None` for any other sensor.
    pub fn lens(&self) -> Option<Lens> {
        match &self.0 {
            Kind::Perspective(_, p) => Some(p.lens()),
            _ => None,
        }
    }

    /// Whether it moves while the shutter is open.
    pub fn moves(&self) -> bool {
        match &self.0 {
            Kind::Perspective(view, _)
            | Kind::Orthographic(view, _)
            | Kind::RadianceMeter(view, _)
            | Kind::Distant(view, _) => view.moves(),
            Kind::IrradianceMeter(_) => false,
        }
    }
}
