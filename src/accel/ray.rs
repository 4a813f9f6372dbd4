//! Rays.

use glam::DVec3;

/// A half line; `direction` has unit length.
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

    /// The distances at which the ray enters and leaves a slab `low <= axis <= high`.
    #[inline]
    pub fn slab(&self, axis: usize, low: f64, high: f64) -> (f64, f64) {
        let (origin, direction) = (self.origin[axis], self.direction[axis]);
        if direction == 0.0 {
            let inside = (low..=high).contains(&origin);
            return if inside {
                (f64::NEG_INFINITY, f64::INFINITY)
            } else {
                (f64::INFINITY, f64::NEG_INFINITY)
            };
        }
        let (a, b) = ((low - origin) / direction, (high - origin) / direction);
        (a.min(b), a.max(b))
    }
}
