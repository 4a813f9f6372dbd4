//! Directions round a lamp that a ribbon hides.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec2, DVec3};

use super::ply::PlyBsdf;
use crate::math::frame::Frame;

/// The ways by which light from a lamp without extent comes through a ribbon.
///
/// Both faces have the same normal, so what is refracted twice keeps its direction but for the slopes
/// of the two microfacets: each moves the part of the direction that lies in the ribbon's plane by
/// slope × (η cos θ_t − cos θ_i), since only its part along the facet's normal changes. So the halo
/// is a GGX distribution of slopes round the lamp, as wide as both together.
#[derive(Debug, Clone, PartialEq)]
pub struct Halo {
    /// The ribbon's, in the coordinates of the directions that are chosen.
    frame: Frame,
    /// The lamp's direction in that frame.
    lamp: DVec3,
    /// The widths along and across the fiber.
    spread: DVec2,
}

impl Halo {
    /// The lamp in direction `lamp` behind a ribbon with this frame, both in the same coordinates.
    pub fn new(ribbon: &PlyBsdf, frame: Frame, lamp: DVec3) -> Self {
        let lamp = frame.to_local(lamp);
        let p = ribbon.parameters();
        let (entry, exit) = (p.roughness, p.exit_roughness);
        let slopes = DVec2::new(entry.along.hypot(exit.along), entry.across.hypot(exit.across));
        // η cos θ_t by Snell's law.
        let refracted = (p.eta * p.eta - 1.0 + lamp.z * lamp.z).sqrt();
        Self { frame, lamp, spread: slopes * (refracted - lamp.z.abs()) }
    }

    /// A direction; `None` if the slopes would bend the light back.
    #[inline]
    pub fn sample(&self, [u, v]: [f64; 2]) -> Option<DVec3> {
        let radius = (u / (1.0 - u)).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        let in_plane = self.lamp.truncate() + radius * self.spread * DVec2::new(cos, sin);
        let z2 = 1.0 - in_plane.length_squared();
        (z2 > 0.0).then(|| self.frame.to_world(in_plane.extend(z2.sqrt().copysign(self.lamp.z))))
    }

    /// The density of [`Halo::sample`].
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let direction = self.frame.to_local(direction);
        if direction.z * self.lamp.z <= 0.0 {
            return 0.0;
        }
        let slopes = (direction - self.lamp).truncate() / self.spread;
        let stretched = 1.0 + slopes.length_squared();
        let in_plane = FRAC_1_PI / (self.spread.x * self.spread.y * stretched * stretched);
        in_plane * direction.z.abs()
    }
}
