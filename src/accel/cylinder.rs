//! A segment of a round ply: a cylinder cut by two planes (Montazeri et al. 2020, section 5.1).
//!
//! Neighbouring segments share their cutting plane, which is perpendicular to the average of their
//! directions: both cylinders meet it in the same ellipse, so a ply has no cracks.

use std::ops::{Mul, Sub};

use glam::DVec3;

use super::bounds::Bounds;
use super::ray::Ray;
use crate::math::extremes::{greater, lesser};

/// A joint of a ply: a point of its centre line and the unit normal of the cutting plane there,
/// which points along the ply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The point.
    pub point: DVec3,
    /// The normal of the plane: the average tangent.
    pub tangent: DVec3,
}

impl Joint {
    /// The signed distance of `point` beyond the joint's plane.
    #[inline]
    pub fn beyond(&self, point: DVec3) -> f64 {
        (point - self.point).dot(self.tangent)
    }
}

/// The piece of a ply between two joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    pub(super) start: Joint,
    pub(super) end: Joint,
    pub(super) radius: f64,
}

/// A hit on a cylinder may overstep its joints by this much (relative to the radius), since
/// rounding must not open a crack between two segments; both then answer the same point.
pub(super) const OVERSTEP: f64 = 1e-9;

impl Cylinder {
    /// The segment between two joints that do not coincide.
    #[inline]
    pub fn new(start: Joint, end: Joint, radius: f64) -> Self {
        Self { start, end, radius }
    }

    /// From joint to joint, not normalised: no square root is needed where its length cancels.
    #[inline]
    fn axis(&self) -> DVec3 {
        self.end.point - self.start.point
    }

    /// The box around the segment: that around the ellipses at its joints, whose hull it is.
    pub fn bounds(&self) -> Bounds {
        let [start, end] = self.ellipses().map(|[center, a, b]| {
            let reach = self.radius * (a * a + b * b).map(f64::sqrt);
            Bounds { min: center - reach, max: center + reach }
        });
        start.union(end)
    }

    /// How far down the segment reaches along `up`.
    pub fn lowest(&self, up: DVec3) -> f64 {
        let [start, end] = self
            .ellipses()
            .map(|[center, a, b]| center.dot(up) - self.radius * a.dot(up).hypot(b.dot(up)));
        start.min(end)
    }

    /// The ellipses at the joints: centre, and two conjugate half axes over the radius.
    fn ellipses(&self) -> [[DVec3; 3]; 2] {
        let axis = self.axis().normalize();
        let (u, v) = axis.any_orthonormal_pair();
        [self.start, self.end].map(|joint| {
            // A spoke of the cylinder's circle, slid along the axis into the joint's plane.
            let along = axis.dot(joint.tangent).max(0.1);
            let slid = |spoke: DVec3| spoke - axis * (joint.tangent.dot(spoke) / along);
            [joint.point, slid(u), slid(v)]
        })
    }

    /// The distance at which the ray enters from outside, if in (`t_min`, `t_max`). Quickest if it
    /// mostly does not; many segments are better asked by twos
    /// ([`enter_either`](super::cylinder_pair::enter_either)).
    #[inline]
    pub fn enter(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<f64> {
        let (a, b, c) = self.quadratic(ray);
        let discriminant = b * b - a * c;
        if b >= 0.0 || discriminant < 0.0 {
            return None;
        }
        // c / (-b + sqrt(..)) rather than (-b - sqrt(..)) / a: no cancellation near the surface.
        let t = c / (discriminant.sqrt() - b);
        let (point, overstep) = (ray.at(t), OVERSTEP * self.radius);
        let inside = t > t_min
            && t < t_max
            && self.start.beyond(point) >= -overstep
            && self.end.beyond(point) <= overstep;
        inside.then_some(t)
    }

    /// Where the ray meets the infinite cylinder: see [`quadratic`].
    #[inline(always)]
    fn quadratic(&self, ray: &Ray) -> (f64, f64, f64) {
        let (axis, offset) = (self.axis(), ray.origin - self.start.point);
        quadratic(
            [axis.length_squared(), ray.direction.length_squared()],
            [ray.direction.dot(axis), offset.dot(axis)],
            ray.direction.dot(offset),
            offset.length_squared() - self.radius * self.radius,
        )
    }

    /// Whether the segments perhaps overlap: capsules about their axes do that hold them.
    pub fn may_overlap(&self, other: &Self) -> bool {
        let reach = self.reach() + other.reach();
        let [a, b] = [self, other].map(|segment| [segment.start.point, segment.end.point]);
        between(a, b).length_squared() < reach * reach
    }

    /// How far the surface is from the axis between the joints at most: their planes slant.
    fn reach(&self) -> f64 {
        let axis = self.axis().normalize();
        self.radius / axis.dot(self.start.tangent).min(axis.dot(self.end.tangent)).max(0.1)
    }

    /// Whether `point` lies inside the segment.
    pub fn contains(&self, point: DVec3) -> bool {
        let axis = self.axis();
        let radial = away_from(axis, point - self.start.point) / axis.length_squared();
        radial.length_squared() < self.radius * self.radius
            && self.start.beyond(point) >= 0.0
            && self.end.beyond(point) <= 0.0
    }

    /// Where the ray, inside the ply, leaves this segment at or after `t`.
    #[inline(always)]
    pub fn leave(&self, ray: &Ray, t: f64) -> Leave {
        let (a, b, c) = self.quadratic(ray);
        let root = (b * b - a * c).max(0.0).sqrt();
        let wall = if a > 0.0 { ((root - b) / a).max(t) } else { f64::INFINITY };
        let crossing = |joint: &Joint| -joint.beyond(ray.origin) / ray.direction.dot(joint.tangent);
        if ray.direction.dot(self.end.tangent) > 0.0 {
            let through = crossing(&self.end);
            if through < wall {
                return Leave::Forward(through.max(t));
            }
        }
        if ray.direction.dot(self.start.tangent) < 0.0 {
            let through = crossing(&self.start);
            if through < wall {
                return Leave::Backward(through.max(t));
            }
        }
        Leave::Wall(wall)
    }

    /// The outward unit normal and the unit tangent at a `point` of the surface, both continuous
    /// along the ply: the tangent runs from joint to joint, the radius is made perpendicular to it.
    #[inline]
    pub fn shading(&self, point: DVec3) -> (DVec3, DVec3) {
        let (normal, tangent) = self.directions(point);
        (normal.normalize(), tangent.normalize())
    }

    /// Normal and tangent of [`Cylinder::shading`] before they are made unit vectors.
    #[inline(always)]
    pub fn directions(&self, point: DVec3) -> (DVec3, DVec3) {
        let axis = self.axis();
        let behind = self.start.beyond(point) * axis.dot(self.end.tangent);
        let ahead = -self.end.beyond(point) * axis.dot(self.start.tangent);
        let fraction = greater(lesser(behind / (behind + ahead), 1.0), 0.0);
        let tangent = self.start.tangent + fraction * (self.end.tangent - self.start.tangent);
        let radial = away_from(axis, point - self.start.point);
        (away_from(tangent, radial), tangent)
    }
}

/// The shortest way from one line segment to another, each given by its ends (Ericson 2004, "Real-Time
/// Collision Detection", section 5.1.9).
pub fn between([a0, a1]: [DVec3; 2], [b0, b1]: [DVec3; 2]) -> DVec3 {
    let (u, v, w) = (a1 - a0, b1 - b0, a0 - b0);
    let (uu, uv, vv) = (u.length_squared(), u.dot(v), v.length_squared());
    let (uw, vw) = (u.dot(w), v.dot(w));
    let determinant = uu * vv - uv * uv;
    let s = if determinant > 1e-12 * uu * vv {
        ((uv * vw - vv * uw) / determinant).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = ((uv * s + vw) / vv).clamp(0.0, 1.0);
    let s = ((uv * t - uw) / uu).clamp(0.0, 1.0);
    t * v - (w + s * u)
}

/// Where a ray o + t d meets an infinite cylinder about an axis: the coefficients of
/// t^2 a + 2 t b + c = 0, all times the squared length of the axis. What it takes are that squared
/// length and that of d, the dot products of d and o with the axis, that of d and o, and o^2 - r^2.
#[inline]
pub(super) fn quadratic<T: Copy + Mul<Output = T> + Sub<Output = T>>(
    [length2, direction2]: [T; 2],
    [along, offset_along]: [T; 2],
    approach: T,
    excess: T,
) -> (T, T, T) {
    let a = length2 * direction2 - along * along;
    let b = length2 * approach - along * offset_along;
    let c = length2 * excess - offset_along * offset_along;
    (a, b, c)
}

/// The part of `v` perpendicular to `axis`, times the squared length of `axis`.
#[inline]
fn away_from(axis: DVec3, v: DVec3) -> DVec3 {
    axis.length_squared() * v - axis.dot(v) * axis
}

/// How a ray leaves a segment from inside, and at which distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leave {
    /// Through the wall: it is out of the ply.
    Wall(f64),
    /// Through the far joint, into the next segment.
    Forward(f64),
    /// Through the near joint, into the segment before.
    Backward(f64),
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A segment along x from -2 to 3, of radius 0.5, with slanted ends.
    fn segment() -> Cylinder {
        let slanted = |x: f64, z: f64| Joint {
            point: DVec3::new(x, 1.0, 0.0),
            tangent: DVec3::new(1.0, 0.0, z).normalize(),
        };
        Cylinder::new(slanted(-2.0, 0.2), slanted(3.0, -0.3), 0.5)
    }

    /// A ray that meets the plane x = `x` at the impact parameter `p` of the axis, with the given
    /// slope along the axis, from a height of 2.
    fn ray(x: f64, p: f64, slope: f64) -> Ray {
        let direction = DVec3::new(slope, 0.0, -1.0).normalize();
        Ray { origin: DVec3::new(x, 1.0 + p, 0.0) - 2.0 * direction / -direction.z, direction }
    }

    #[test]
    fn entry_and_exit_of_a_straight_segment_in_closed_form() {
        for (p, slope) in [(0.0, 0.0), (0.3, 0.0), (-0.49, 0.7), (0.1, -1.3)] {
            let ray = ray(0.4, p, slope);
            let half_chord = (0.25f64 - p * p).sqrt();
            let stretch = (1.0 + slope * slope).sqrt();
            let entry = (2.0 - half_chord) * stretch;
            let t = segment().enter(&ray, 0.0, f64::INFINITY).unwrap();
            assert!((t - entry).abs() < 1e-12, "{t} {entry}");
            let inside = Ray { origin: ray.at(t), ..ray };
            let Leave::Wall(way) = segment().leave(&inside, 0.0) else { panic!("{p} {slope}") };
            assert!((way - 2.0 * half_chord * stretch).abs() < 1e-12, "{way}");
        }
    }

    #[test]
    fn rays_beside_before_behind_or_out_of_it_miss() {
        let hit = |ray: &Ray, t_min, t_max| segment().enter(ray, t_min, t_max).is_some();
        let straight = ray(0.4, 0.0, 0.0);
        assert!(hit(&straight, 1.4999, 1.5001));
        assert!(!hit(&straight, 1.5001, 9.0) && !hit(&straight, 0.0, 1.4999));
        assert!(!hit(&ray(0.4, 0.5001, 0.0), 0.0, 9.0));
        // The upper side ends at x = -2 - 0.2 * 0.5 and at x = 3 + 0.3 * 0.5.
        for (x, expected) in [(-2.101, false), (-2.099, true), (3.149, true), (3.151, false)] {
            assert_eq!(hit(&ray(x, 0.0, 0.0), 0.0, 9.0), expected, "{x}");
        }
        let from_inside = Ray { origin: DVec3::new(0.0, 1.2, 0.1), direction: DVec3::Y };
        assert!(!hit(&from_inside, 0.0, 9.0));
    }

    #[test]
    fn a_ray_along_the_axis_leaves_through_the_joints() {
        let from = |direction| Ray { origin: DVec3::new(0.0, 1.0, 0.0), direction };
        assert_eq!(segment().leave(&from(DVec3::X), 0.0), Leave::Forward(3.0));
        assert_eq!(segment().leave(&from(DVec3::NEG_X), 0.0), Leave::Backward(2.0));
    }

    /// Against the least distance of many points of both.
    #[test]
    fn distances_of_segments_are_those_of_their_nearest_points() {
        let mut sampler = crate::math::rng::Sampler::new(4, 0, 0);
        let mut point = || DVec3::from_array([(); 3].map(|()| sampler.next_1d()));
        for pair in 0..300 {
            let a = [point(), point()];
            // Every tenth pair is parallel.
            let shift = point();
            let b = if pair % 10 == 0 { a.map(|end| end + shift) } else { [point(), point()] };
            let at = |[start, end]: [DVec3; 2], i: u32| start.lerp(end, f64::from(i) / 200.0);
            let pairs = (0..=200).flat_map(|i| (0..=200).map(move |j| (i, j)));
            let least = pairs
                .map(|(i, j)| at(a, i).distance_squared(at(b, j)))
                .fold(f64::INFINITY, f64::min);
            let found = between(a, b).length_squared();
            assert!(found <= least + 1e-12 && found > least - 2e-2 * least.sqrt() - 1e-4);
        }
    }

    /// Against many points of its surface.
    #[test]
    fn it_reaches_down_to_its_lowest_point() {
        let segment = segment();
        for up in [DVec3::X, -DVec3::X, DVec3::new(1.0, -2.0, 0.5), DVec3::new(-0.1, 1.0, 3.0)] {
            let ring = (0..1000).map(|i| (f64::from(i) * TAU / 1000.0).sin_cos());
            let least = ring
                .flat_map(|(sin, cos)| {
                    let spoke = 0.5 * DVec3::new(0.0, sin, cos);
                    [segment.start, segment.end].map(|joint| {
                        let slid = spoke.dot(joint.tangent) / joint.tangent.x;
                        joint.point + spoke - slid * DVec3::X
                    })
                })
                .map(|point| point.dot(up))
                .fold(f64::INFINITY, f64::min);
            let lowest = segment.lowest(up);
            assert!(lowest <= least + 1e-12 && lowest > least - 1e-4, "{up} {lowest} {least}");
        }
    }

    #[test]
    fn the_box_holds_the_rims_and_is_not_much_larger() {
        let bounds = segment().bounds();
        assert!(bounds.min.x <= -2.1 && bounds.max.x >= 3.15);
        assert!(bounds.min.z <= -0.5 && bounds.max.z >= 0.5);
        assert!((bounds.max - bounds.min).max_element() < 6.2);
    }
}
