//! Rays.

use glam::DVec3;

use crate::math::extremes::{greater, lesser};

/// A half line; `direction` has unit length, unless the ray was [`Ray::scaled`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes.
    pub direction: DVec3,
}

impl Ray {
    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    /// The same ray seen from a frame whose origin is at `shift`.
    #[inline]
    pub fn shifted(&self, shift: DVec3) -> Self {
        Self { origin: self.origin - shift, direction: self.direction }
    }

    /// The same ray seen from a frame whose axes are longer by `1 / factors`; distances along it stay
    /// as they are.
    #[inline]
    pub fn scaled(&self, factors: DVec3) -> Self {
        Self { origin: self.origin * factors, direction: self.direction * factors }
    }

    /// One over each component of the direction, kept finite: zero times it is zero.
    #[inline]
    pub fn inverse(&self) -> DVec3 {
        self.direction.map(|d| greater(lesser(d.recip(), GREATEST), -GREATEST))
    }
}

/// The inverse of a component of a direction is at most this: finite in single precision.
const GREATEST: f64 = 1e20;
