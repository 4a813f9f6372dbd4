//! Directions inside a ply that come out towards a lamp.

use glam::DVec3;

use super::dielectric::RoughDielectric;
use crate::math::dual::constant;
use crate::math::frame::Frame;

/// The interface through which light from a lamp without extent comes into plies.
///
/// Such a lamp is met by connections alone, where a path leaves the plies. What comes out there goes
/// mostly near the direction that it is refracted into; so directions inside are worth choosing in
/// which the lamp's own light would be refracted, if it came in.
#[derive(Debug, Clone, PartialEq)]
pub struct Aim {
    /// The interface, seen from outside.
    interface: RoughDielectric,
    /// Its frame, normal *into* the ply, in the coordinates of the directions that are chosen.
    frame: Frame,
    /// The direction from the lamp (z > 0), in that frame: facets are the same all the way round, so
    /// what comes along it is refracted as if it entered on the other side.
    from_lamp: DVec3,
}

impl Aim {
    /// Light that leaves through `interface` (seen from outside) towards `lamp`; `None` if the lamp is
    /// on the same side. `frame` has its normal into the ply, both are in the same coordinates.
    #[inline]
    pub fn new(interface: RoughDielectric, frame: Frame, lamp: DVec3) -> Option<Self> {
        let from_lamp = frame.to_local(-lamp);
        (from_lamp.z > 0.0).then_some(Self { interface, frame, from_lamp })
    }

    /// The same for directions in `frame`, which is given in the coordinates used so far.
    #[inline]
    pub fn seen_from(self, frame: &Frame) -> Self {
        Self { frame: self.frame.seen_from(frame), ..self }
    }

    /// The direction that a smooth interface refracts towards the lamp.
    #[inline]
    pub fn middle(&self) -> DVec3 {
        let (eta, cosine) = (self.interface.eta, self.from_lamp.z);
        let inside = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
        let local = (cosine / eta - inside) * DVec3::Z - self.from_lamp / eta;
        self.frame.to_world(local)
    }

    /// A direction that some facet refracts towards the lamp.
    #[inline]
    pub fn sample(&self, u: [f64; 2]) -> Option<DVec3> {
        self.interface.sample_refraction(self.from_lamp, u).map(|local| self.frame.to_world(local))
    }

    /// The density of [`Aim::sample`].
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let direction = self.frame.to_local(direction);
        self.interface.refraction_pdf(&constant(self.from_lamp), &constant(direction))
    }
}
