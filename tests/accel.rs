//! Chains of cylinders and bilinear patches under many random rays.

mod common;

use std::f64::consts::{PI, TAU};

use common::rays::{direction, draw};
use glam::DVec3;
use plycloth::accel::bilinear::{Bilinear, Edge};
use plycloth::accel::cylinder::{Cylinder, Joint, Leave};
use plycloth::accel::ray::Ray;
use plycloth::math::rng::Sampler;

/// A ply of 48 segments along a curve.
struct Ply {
    joints: Vec<Joint>,
    segments: Vec<Cylinder>,
    radius: f64,
}

const SEGMENTS: usize = 48;

impl Ply {
    fn along(curve: impl Fn(f64) -> DVec3, radius: f64) -> Self {
        let points: Vec<_> = (0..=SEGMENTS).map(|i| curve(i as f64 / SEGMENTS as f64)).collect();
        let chord = |i: usize| (points[i + 1] - points[i]).normalize();
        let tangent = |i: usize| (chord(i.max(1) - 1) + chord(i.min(SEGMENTS - 1))).normalize();
        let joints: Vec<_> =
            (0..=SEGMENTS).map(|i| Joint { point: points[i], tangent: tangent(i) }).collect();
        let segments = joints.windows(2).map(|j| Cylinder::new(j[0], j[1], radius)).collect();
        Self { joints, segments, radius }
    }

    /// One and a half turns that do not touch each other.
    fn helix() -> Self {
        let turn = |s: f64| (1.5 * TAU * s).sin_cos();
        Self::along(|s| DVec3::new(0.6 * turn(s).0, 0.6 * turn(s).1, 3.0 * s), 0.4)
    }

    /// A yarn that goes over and under.
    fn bent() -> Self {
        Self::along(|s| DVec3::new(4.0 * s, 0.0, 0.25 * (9.0 * s).sin()), 0.2)
    }

    /// A yarn that bends with a radius (0.27) below its own.
    fn tight() -> Self {
        Self::along(|s| DVec3::new(4.0 * s, 0.0, 0.38 * (4.0 * PI * s).sin()), 0.4)
    }

    fn gentle() -> [Self; 2] {
        [Self::helix(), Self::bent()]
    }

    fn all() -> [Self; 3] {
        let [helix, bent] = Self::gentle();
        [helix, bent, Self::tight()]
    }

    /// The nearest entry by brute force: the segment and the distance.
    fn enter(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<(usize, f64)> {
        let hits = self.segments.iter().enumerate();
        let hits = hits.filter_map(|(i, s)| s.enter(ray, t_min, t_max).map(|t| (i, t)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Follows a ray inside from segment to segment; `None` where it leaves through an end.
    fn leave(&self, mut segment: usize, ray: &Ray) -> Option<(usize, f64)> {
        let mut t = 0.0;
        loop {
            (segment, t) = match self.segments[segment].leave(ray, t) {
                Leave::Wall(out) => return Some((segment, out)),
                Leave::Forward(through) if segment + 1 < SEGMENTS => (segment + 1, through),
                Leave::Backward(through) if segment > 0 => (segment - 1, through),
                _ => return None,
            }
        }
    }

    /// How far `point` is from being inside segment `i`: at most 0 inside. An independent
    /// description of the solid that the segment stands for.
    fn outside(&self, i: usize, point: DVec3) -> f64 {
        let [start, end] = [self.joints[i], self.joints[i + 1]];
        let axis = (end.point - start.point).normalize();
        let wall = (point - start.point).cross(axis).length() - self.radius;
        let before = -(point - start.point).dot(start.tangent);
        wall.max(before).max((point - end.point).dot(end.tangent))
    }

    fn depth(&self, point: DVec3) -> f64 {
        (0..SEGMENTS).map(|i| self.outside(i, point)).fold(f64::INFINITY, f64::min)
    }

    /// A random joint that is not one of the last few at an end.
    fn inner_joint(&self, sampler: &mut Sampler) -> usize {
        4 + (sampler.next_1d() * (SEGMENTS - 8) as f64) as usize
    }

    /// A point of the ellipse in which the segments on both sides of joint `i` meet.
    fn rim(&self, i: usize, angle: f64) -> DVec3 {
        let Joint { point, tangent } = self.joints[i];
        let axis = (self.joints[i + 1].point - point).normalize();
        let (u, v) = tangent.any_orthonormal_pair();
        let spoke = angle.cos() * u + angle.sin() * v;
        point + spoke * self.radius / spoke.cross(axis).length()
    }
}

#[test]
fn every_ray_from_outside_to_the_centre_line_hits() {
    let mut sampler = Sampler::new(1, 0, 0);
    for ply in Ply::all() {
        for _ in 0..150_000 {
            let i = ply.inner_joint(&mut sampler);
            let fraction = sampler.next_1d();
            let target = ply.joints[i].point.lerp(ply.joints[i + 1].point, fraction);
            let direction = direction(&mut sampler);
            let ray = Ray { origin: target - 10.0 * direction, direction };
            // Rays down the open ends of the chain are no cracks.
            if ply.depth(ray.at(10.0 - 1e-3)) > 0.0 || through_an_end(&ply, &ray, 10.0) {
                continue;
            }
            assert!(ply.enter(&ray, 0.0, 10.0).is_some(), "{ray:?}");
        }
    }
}

/// Whether the ray passes through the disc at an end of the chain before `t_max`.
fn through_an_end(ply: &Ply, ray: &Ray, t_max: f64) -> bool {
    [ply.joints[0], ply.joints[SEGMENTS]].iter().any(|end| {
        let t = (end.point - ray.origin).dot(end.tangent) / ray.direction.dot(end.tangent);
        t > 0.0 && t < t_max && (ray.at(t) - end.point).length() < 1.001 * ply.radius
    })
}

/// Rays to points a hair inside the ellipse of a joint, steep and almost tangential.
#[test]
fn every_ray_to_a_joint_ellipse_hits() {
    let mut sampler = Sampler::new(2, 0, 0);
    for ply in Ply::all() {
        for _ in 0..100_000 {
            let i = ply.inner_joint(&mut sampler);
            let rim = ply.rim(i, 7.0 * sampler.next_1d());
            let (normal, tangent) = ply.segments[i].shading(rim);
            let inside = rim - draw(&mut sampler, [1e-12, 1e-3]) * ply.radius * normal;
            let flat = direction(&mut sampler);
            let rise = sampler.next_1d().powi(4);
            let direction = (flat - flat.dot(normal) * normal - rise * normal).normalize();
            let origin = inside - 0.3 * ply.radius * direction;
            if ply.depth(origin) <= 0.0 {
                continue;
            }
            let ray = Ray { origin, direction };
            let aim = 0.3 * ply.radius;
            let hit = ply.enter(&ray, 0.0, aim + 1e-9);
            assert!(hit.is_some(), "joint {i} {ray:?} {tangent}");
        }
    }
}

#[test]
fn every_ray_inside_finds_one_exit_on_the_surface_and_does_not_enter_again_there() {
    let mut sampler = Sampler::new(3, 0, 0);
    let mut exits = 0;
    for ply in Ply::gentle() {
        for _ in 0..100_000 {
            let Some((ray, last, t)) = passage(&ply, &mut sampler) else { continue };
            exits += 1;
            let exit = ray.at(t);
            let error = ply.outside(last, exit);
            assert!(error.abs() < 1e-9, "{error} {ray:?}");
            for k in 1..8 {
                let depth = ply.depth(ray.at(t * f64::from(k) / 8.0));
                assert!(depth < 1e-9, "{depth} outside on the way {ray:?}");
            }
            // Steep rays are out at once; no ray enters where it leaves.
            let steep = ray.direction.dot(ply.segments[last].shading(exit).0) > 0.1;
            assert!(!steep || ply.depth(ray.at(t + 1e-6)) > 0.0, "still inside {ray:?}");
            assert_eq!(ply.enter(&ray, 1e-9, t + 1e-9), None, "{ray:?}");
        }
    }
    assert!(exits > 50_000, "{exits}");
}

/// Where a ply bends tighter than its radius its segments fold over each other: a ray may then miss
/// its wall, but hardly ever does.
#[test]
fn rays_inside_a_folded_ply_come_out_on_its_surface() {
    let (ply, mut sampler) = (Ply::tight(), Sampler::new(4, 0, 0));
    let (mut exits, mut strays) = (0.0, 0.0);
    for _ in 0..100_000 {
        let Some((ray, last, t)) = passage(&ply, &mut sampler) else { continue };
        exits += 1.0;
        strays += if ply.outside(last, ray.at(t)).abs() < 1e-9 { 0.0 } else { 1.0 };
    }
    assert!(exits > 5e4 && strays < 1e-4 * exits, "{strays} of {exits}");
}

/// The way of a random ray through the ply: the ray, the segment that it leaves and its length.
fn passage(ply: &Ply, sampler: &mut Sampler) -> Option<(Ray, usize, f64)> {
    let (segment, ray) = refracted(ply, sampler)?;
    let (last, t) = ply.leave(segment, &ray)?;
    Some((ray, last, t))
}

/// A random ray from outside that entered the ply, turned in a random way into it: the segment, and
/// the ray that starts at the point of entry.
fn refracted(ply: &Ply, sampler: &mut Sampler) -> Option<(usize, Ray)> {
    let joint = ply.joints[ply.inner_joint(sampler)];
    let offset = direction(sampler) * ply.radius * sampler.next_1d();
    let outer = direction(sampler);
    let ray = Ray { origin: joint.point + offset - 10.0 * outer, direction: outer };
    let (segment, t) = ply.enter(&ray, 0.0, f64::INFINITY)?;
    let point = ray.at(t);
    let (normal, _) = ply.segments[segment].shading(point);
    let inner = (outer / 1.5 + direction(sampler) * 0.3 - 0.5 * normal).normalize();
    (inner.dot(normal) < -0.2).then_some((segment, Ray { origin: point, direction: inner }))
}

#[test]
fn normals_and_tangents_agree_on_both_sides_of_a_joint() {
    let mut sampler = Sampler::new(4, 0, 0);
    for ply in Ply::gentle() {
        for _ in 0..20_000 {
            let i = ply.inner_joint(&mut sampler);
            let rim = ply.rim(i, 7.0 * sampler.next_1d());
            let before = ply.segments[i - 1].shading(rim);
            let behind = ply.segments[i].shading(rim);
            assert!((before.0 - behind.0).length() < 1e-12, "normals {before:?} {behind:?}");
            assert!((before.1 - behind.1).length() < 1e-12, "tangents {before:?} {behind:?}");
            assert!((before.1 - ply.joints[i].tangent).length() < 1e-12);
            assert!(
                before.0.dot(before.1).abs() < 1e-12
                    && before.0.dot(rim - ply.joints[i].point) > 0.0
            );
        }
    }
}

/// A ribbon's patch with corners `corners`, in the order left, right of each edge.
fn patch([a, b, c, d]: [DVec3; 4]) -> Bilinear {
    let edge = |left, right| Edge { left, right, normal: DVec3::Z, tangent: DVec3::Y };
    Bilinear::new(edge(a, b), edge(c, d))
}

fn at([a, b, c, d]: [DVec3; 4], u: f64, v: f64) -> DVec3 {
    a.lerp(b, u).lerp(c.lerp(d, u), v)
}

/// Moller and Trumbore's intersection: the distance and the cosine.
fn triangle(ray: &Ray, [a, b, c]: [DVec3; 3]) -> Option<(f64, f64)> {
    let (e, f) = (b - a, c - a);
    let p = ray.direction.cross(f);
    let det = e.dot(p);
    let s = ray.origin - a;
    let q = s.cross(e);
    let (u, v) = (s.dot(p) / det, ray.direction.dot(q) / det);
    let slack = 1e-9;
    let inside = u >= -slack && v >= -slack && u + v <= 1.0 + slack;
    let cosine = det.abs() / e.cross(f).length();
    (inside && f.dot(q) / det > 0.0).then(|| (f.dot(q) / det, cosine))
}

/// The nearest hit of a patch over u, v in [-`grow`, 1 + `grow`] cut into triangles.
fn brute_force(corners: [DVec3; 4], ray: &Ray, grow: f64) -> Option<(f64, f64)> {
    let n = 40;
    let place = |i: i32| -grow + (1.0 + 2.0 * grow) * f64::from(i) / f64::from(n);
    let cells = (0..n * n).map(|k| (k % n, k / n));
    let hits = cells.filter_map(|(i, j)| {
        let corner = |di, dj| at(corners, place(i + di), place(j + dj));
        let lower = triangle(ray, [corner(0, 0), corner(1, 0), corner(1, 1)]);
        lower.or_else(|| triangle(ray, [corner(0, 0), corner(1, 1), corner(0, 1)]))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[test]
fn patches_agree_with_their_subdivision_into_triangles() {
    let mut sampler = Sampler::new(5, 0, 0);
    let (mut hits, mut misses) = (0, 0);
    for _ in 0..3_000 {
        let mut jitter = |x, y| DVec3::new(x, y, 0.0) + 0.3 * direction(&mut sampler);
        let corners = [jitter(0.0, 0.0), jitter(1.0, 0.0), jitter(0.0, 1.0), jitter(1.0, 1.0)];
        let target = at(corners, 1.4 * sampler.next_1d() - 0.2, 1.4 * sampler.next_1d() - 0.2);
        let direction = direction(&mut sampler);
        let ray = Ray { origin: target - 2.0 * direction, direction };
        let found = patch(corners).intersect(&ray, 0.0, f64::INFINITY);
        let [larger, smaller] = [0.01, -0.01].map(|grow| brute_force(corners, &ray, grow));
        // Where the ray grazes the surface, flat triangles cannot tell.
        if [larger, smaller].iter().flatten().any(|&(_, cosine)| cosine < 0.1) {
            continue;
        }
        match (found, larger, smaller) {
            (None, _, None) => misses += 1,
            (Some(t), Some((near, _)), Some((far, _))) => {
                hits += 1;
                assert!(t > near - 0.01 && t < far + 0.01, "{t} {near} {far}");
                assert!(near < far - 0.02 || (t - far).abs() < 0.005, "{t} {near} {far}");
            }
            (Some(_), Some(_), None) => {}
            _ => panic!("{found:?} {larger:?} {smaller:?} {corners:?} {ray:?}"),
        }
    }
    assert!(hits > 500 && misses > 500, "{hits} {misses}");
}
