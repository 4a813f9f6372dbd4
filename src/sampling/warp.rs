//! Directions from uniform numbers. Local frame, z up; densities with respect to solid angle.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

/// A point of the unit disc, uniform by area.
#[inline]
pub fn square_to_disk([u, v]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    [radius * cos, radius * sin]
}

/// A direction of the upper hemisphere, with density cos(theta) / pi.
#[inline]
pub fn square_to_cosine_hemisphere(u: [f64; 2]) -> DVec3 {
    let [x, y] = square_to_disk(u);
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// The density of [`square_to_cosine_hemisphere`]; zero below the horizon.
#[inline]
pub fn square_to_cosine_hemisphere_pdf(direction: DVec3) -> f64 {
    direction.z.max(0.0) * FRAC_1_PI
}

/// A direction of the unit sphere, uniform.
#[inline]
pub fn square_to_sphere([u, v]: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * u;
    let (sin, cos) = (TAU * v).sin_cos();
    let radius = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(radius * cos, radius * sin, z)
}

/// The density of [`square_to_sphere`].
pub const SPHERE_PDF: f64 = FRAC_1_PI / 4.0;
