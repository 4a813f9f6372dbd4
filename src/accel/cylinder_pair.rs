//! Two segments of round plies at a time, side by side in vectors: where rays enter plies is what
//! pictures spend most arithmetic on.

use std::array;

use glam::DVec3;
use wide::f64x2;

use super::cylinder::{Joint, OVERSTEP, quadratic};
use super::ray::Ray;
use crate::math::extremes::lesser;

/// Two vectors side by side.
type Both = [f64x2; 3];

/// Two rays side by side.
#[derive(Debug, Clone, Copy)]
pub struct RayPair {
    origin: Both,
    direction: Both,
    /// The squared lengths of their directions.
    direction2: f64x2,
}

impl RayPair {
    /// The rays that look at the first and at the second segment of [`enter_either`].
    #[inline]
    pub fn new(a: &Ray, b: &Ray) -> Self {
        let direction = both(a.direction, b.direction);
        let direction2 = dot(direction, direction);
        Self { origin: both(a.origin, b.origin), direction, direction2 }
    }
}

/// Which of two segments (0 or 1) is entered from outside first, each by its own ray, and at which
/// distance, if in (`t_min`, `t_max`). The segments are given by their joints and radii.
// By reference: joints that are copied are read back from memory before they have arrived there.
#[inline(always)]
pub fn enter_either(
    [a_start, a_end]: [&Joint; 2],
    [b_start, b_end]: [&Joint; 2],
    radii: [f64; 2],
    ray: &RayPair,
    t_min: f64,
    t_max: f64,
) -> Option<(usize, f64)> {
    let start = both(a_start.point, b_start.point);
    let axis = minus(both(a_end.point, b_end.point), start);
    let offset = minus(ray.origin, start);
    let radius = f64x2::new(radii);
    let (qa, qb, qc) = quadratic(
        [dot(axis, axis), ray.direction2],
        [dot(ray.direction, axis), dot(offset, axis)],
        dot(ray.direction, offset),
        dot(offset, offset) - radius * radius,
    );
    // c / (-b + sqrt(..)) rather than (-b - sqrt(..)) / a: no cancellation near the surface.
    let t = qc / ((qb * qb - qa * qc).sqrt() - qb);
    let beyond =
        |offset: Both, tangent: Both| dot(offset, tangent) + t * dot(ray.direction, tangent);
    let beyond_start = beyond(offset, both(a_start.tangent, b_start.tangent));
    let beyond_end = beyond(minus(offset, axis), both(a_end.tangent, b_end.tangent));
    let overstep = radius * f64x2::splat(OVERSTEP);
    // One branch for all conditions, since each alone is a toss-up. The NaN of a miss fails.
    let hit = qb.simd_lt(f64x2::splat(0.0))
        & t.simd_gt(f64x2::splat(t_min))
        & t.simd_lt(f64x2::splat(t_max))
        & beyond_start.simd_ge(-overstep)
        & beyond_end.simd_le(overstep);
    if !hit.any() {
        return None;
    }
    let [first, second] = hit.select(t, f64x2::splat(f64::INFINITY)).to_array();
    Some((usize::from(second < first), lesser(first, second)))
}

/// Two vectors, component by component.
#[inline]
fn both(a: DVec3, b: DVec3) -> Both {
    // By name: components told by number would go by way of memory.
    [f64x2::new([a.x, b.x]), f64x2::new([a.y, b.y]), f64x2::new([a.z, b.z])]
}

#[inline]
fn minus(a: Both, b: Both) -> Both {
    array::from_fn(|axis| a[axis] - b[axis])
}

#[inline]
fn dot(a: Both, b: Both) -> f64x2 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn upright(x: f64, radius: f64) -> ([Joint; 2], f64) {
        let joint = |z: f64| Joint { point: DVec3::new(x, 0.0, z), tangent: DVec3::Z };
        ([-1.0, 1.0].map(joint), radius)
    }

    fn either(
        (a, a_radius): &([Joint; 2], f64),
        (b, b_radius): &([Joint; 2], f64),
        ray: &RayPair,
        t_min: f64,
        t_max: f64,
    ) -> Option<(usize, f64)> {
        enter_either(a.each_ref(), b.each_ref(), [*a_radius, *b_radius], ray, t_min, t_max)
    }

    /// Both in any order, one alone, none: along the x axis each is entered at x - radius.
    #[test]
    fn the_first_of_two_segments_counts() {
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::X };
        let slow = RayPair::new(&ray, &ray.scaled(DVec3::splat(0.5)));
        let ray = RayPair::new(&ray, &ray);
        let (near, far, behind) = (upright(2.0, 0.5), upright(4.0, 1.0), upright(-2.0, 0.5));
        let enter = |a, b| either(a, b, &ray, 0.0, 10.0);
        assert_eq!(enter(&near, &far), Some((0, 1.5)));
        assert_eq!(enter(&far, &near), Some((1, 1.5)));
        assert_eq!(enter(&far, &behind), Some((0, 3.0)));
        assert_eq!(enter(&behind, &far), Some((1, 3.0)));
        assert_eq!(enter(&behind, &behind), None);
        assert_eq!(either(&near, &far, &ray, 1.6, 10.0), Some((1, 3.0)));
        assert_eq!(either(&near, &far, &ray, 0.0, 1.4), None);
        // A ray with half the direction takes twice as long.
        assert_eq!(either(&far, &near, &slow, 0.0, 10.0), Some((0, 3.0)));
        assert_eq!(either(&behind, &near, &slow, 0.0, 10.0), Some((1, 3.0)));
    }
}
