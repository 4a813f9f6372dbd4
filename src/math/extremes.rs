//! The lesser and the greater of two numbers where no NaN can occur: one instruction each, while
//! `f64::min` and `f64::max` take six to sort out NaN.

use glam::DVec3;

/// The lesser of `a` and `b`.
#[inline]
pub fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of `a` and `b`.
#[inline]
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The lesser of each pair of components.
#[inline]
pub fn lesser3(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(lesser(a.x, b.x), lesser(a.y, b.y), lesser(a.z, b.z))
}

/// The greater of each pair of components.
#[inline]
pub fn greater3(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(greater(a.x, b.x), greater(a.y, b.y), greater(a.z, b.z))
}
