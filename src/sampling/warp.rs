//! Directions from uniform numbers. Local frame, z up; densities with respect to solid angle.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

/// Sine and cosine of `v` turns: those of single precision, which cost a quarter, made a unit vector
/// of double precision by one step of Newton's. The angle is that of `v` to 3e-7.
#[inline]
fn turn(v: f64) -> (f64, f64) {
    let (sin, cos) = ((TAU * v) as f32).sin_cos();
    let (sin, cos) = (f64::from(sin), f64::from(cos));
    let scale = 1.5 - 0.5 * (sin * sin + cos * cos);
    (sin * scale, cos * scale)
}

/// A point of the unit disc, uniform by area.
#[inline]
pub fn square_to_disk([u, v]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = turn(v);
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
    let (sin, cos) = turn(v);
    let radius = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(radius * cos, radius * sin, z)
}

/// The density of [`square_to_sphere`].
pub const SPHERE_PDF: f64 = FRAC_1_PI / 4.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_a_unit_vector_at_the_right_angle() {
        for v in (0..1000).map(|i| f64::from(i) / 1000.0) {
            let (sin, cos) = turn(v);
            assert!((sin * sin + cos * cos - 1.0).abs() < 1e-13, "{v}");
            assert!((sin - (TAU * v).sin()).abs() < 5e-7 && (cos - (TAU * v).cos()).abs() < 5e-7);
        }
    }
}
