//! A piece of a flat yarn: a bilinear patch (Ramsey et al. 2004).

use glam::DVec3;

use super::bounds::Bounds;
use super::ray::Ray;

/// One end of a patch: its two corners, and the unit normal and tangent of the ribbon there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// The left corner (u = 0).
    pub left: DVec3,
    /// The right corner (u = 1).
    pub right: DVec3,
    /// The ribbon's normal.
    pub normal: DVec3,
    /// The direction of the ribbon.
    pub tangent: DVec3,
}

/// The patch p(u, v) = lerp over v of lerp over u of the corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bilinear {
    start: Edge,
    end: Edge,
}

/// u and v of a hit may overstep [0, 1] by this much, so that rounding opens no crack.
const OVERSTEP: f64 = 1e-9;

impl Bilinear {
    /// The patch between two edges.
    #[inline]
    pub fn new(start: Edge, end: Edge) -> Self {
        Self { start, end }
    }

    /// A box around the patch.
    pub fn bounds(&self) -> Bounds {
        Bounds::around([self.start.left, self.start.right, self.end.left, self.end.right])
    }

    /// How far down the patch reaches along `up`.
    pub fn lowest(&self, up: DVec3) -> f64 {
        let corners = [self.start.left, self.start.right, self.end.left, self.end.right];
        corners.map(|corner| corner.dot(up)).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The distance of the nearest hit in (`t_min`, `t_max`), from either side.
    ///
    /// Along the ray, the lines of constant v are met where the triple product of the ray's
    /// direction, the line's direction and the offset to it vanishes: a quadratic in v.
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<f64> {
        let start = self.start.left - ray.origin;
        let along = self.end.left - self.start.left;
        let across = self.start.right - self.start.left;
        let twist = (self.end.right - self.end.left) - across;
        let direction = ray.direction;
        let c = direction.dot(start.cross(across));
        let b = direction.dot(along.cross(across) + start.cross(twist));
        let a = direction.dot(along.cross(twist));
        let mut nearest = None;
        for v in quadratic_roots(a, b, c).into_iter().flatten() {
            if !(-OVERSTEP..=1.0 + OVERSTEP).contains(&v) {
                continue;
            }
            if let Some(t) = line_hit(ray, start + v * along, across + v * twist)
                && t > t_min
                && t < nearest.unwrap_or(t_max)
            {
                nearest = Some(t);
            }
        }
        nearest
    }

    /// The unit normal and tangent of the ribbon at a `point` of it, continuous from patch to patch:
    /// they run from edge to edge with the distance along the ribbon.
    #[inline]
    pub fn shading(&self, point: DVec3) -> (DVec3, DVec3) {
        let behind = (point - self.start.left).dot(self.start.tangent);
        let ahead = (self.end.left - point).dot(self.end.tangent);
        let v = (behind / (behind + ahead)).clamp(0.0, 1.0);
        let normal = self.start.normal.lerp(self.end.normal, v).normalize();
        let tangent = self.start.tangent.lerp(self.end.tangent, v);
        (normal, tangent.reject_from_normalized(normal).normalize())
    }
}

/// The distance along the ray to the segment `offset` + u `line` (seen from the ray's origin), which
/// the ray is known to meet, if u is in [0, 1].
#[inline]
fn line_hit(ray: &Ray, offset: DVec3, line: DVec3) -> Option<f64> {
    let normal = ray.direction.cross(line);
    let length2 = normal.length_squared();
    if length2 == 0.0 {
        return None;
    }
    let u = offset.cross(ray.direction).dot(normal) / length2;
    if !(-OVERSTEP..=1.0 + OVERSTEP).contains(&u) {
        return None;
    }
    Some((offset + u * line).dot(ray.direction))
}

#[inline]
fn quadratic_roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    if a.abs() <= 1e-14 * b.abs() {
        return [(b != 0.0).then(|| -c / b), None];
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [None, None];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [Some(q / a), (q != 0.0).then(|| c / q)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(y: f64, left: f64, right: f64, normal: DVec3) -> Edge {
        Edge {
            left: DVec3::new(0.0, y, left),
            right: DVec3::new(1.0, y, right),
            normal,
            tangent: DVec3::Y,
        }
    }

    /// The hyperbolic paraboloid z = x y over the unit square.
    fn saddle() -> Bilinear {
        Bilinear::new(edge(0.0, 0.0, 0.0, DVec3::Z), edge(1.0, 0.0, 1.0, DVec3::X))
    }

    #[test]
    fn a_saddle_is_met_in_closed_form_from_both_sides() {
        for (x, y) in [(0.0, 0.0), (0.3, 0.9), (1.0, 1.0), (0.5, 0.0)] {
            for side in [1.0, -1.0] {
                let direction = DVec3::new(0.0, 0.0, -side);
                let ray = Ray { origin: DVec3::new(x, y, 3.0 * side), direction };
                let t = saddle().intersect(&ray, 0.0, 9.0).unwrap();
                assert!((t - (3.0 - side * x * y)).abs() < 1e-14, "{x} {y} {t}");
            }
        }
        let beside = Ray { origin: DVec3::new(1.001, 0.5, 3.0), direction: DVec3::NEG_Z };
        assert_eq!(saddle().intersect(&beside, 0.0, 9.0), None);
    }

    /// Along x = y the saddle is the parabola z = x^2, which a ray at z = c meets at both +-sqrt(c).
    #[test]
    fn of_two_hits_the_nearest_inside_the_interval_counts() {
        let square = Bilinear::new(
            Edge {
                left: DVec3::new(-1.0, -1.0, 1.0),
                right: DVec3::new(1.0, -1.0, -1.0),
                ..edge(0.0, 0.0, 0.0, DVec3::Z)
            },
            Edge {
                left: DVec3::new(-1.0, 1.0, -1.0),
                right: DVec3::new(1.0, 1.0, 1.0),
                ..edge(0.0, 0.0, 0.0, DVec3::Z)
            },
        );
        let direction = DVec3::new(1.0, 1.0, 0.0).normalize();
        let ray = Ray { origin: DVec3::new(-2.0, -2.0, 0.36), direction };
        let at = |x: f64| (x + 2.0) * 2f64.sqrt();
        let hit = |t_min, t_max| square.intersect(&ray, t_min, t_max);
        assert!((hit(0.0, 9.0).unwrap() - at(-0.6)).abs() < 1e-14);
        assert!((hit(at(0.0), 9.0).unwrap() - at(0.6)).abs() < 1e-14);
        assert_eq!(hit(at(-0.59), at(0.59)), None);
    }

    #[test]
    fn it_reaches_down_to_its_lowest_corner() {
        assert_eq!(saddle().lowest(DVec3::NEG_Z), -1.0);
        assert_eq!(saddle().lowest(DVec3::new(1.0, -2.0, 0.5)), -2.0);
    }

    #[test]
    fn the_normal_turns_from_edge_to_edge() {
        assert_eq!(saddle().shading(DVec3::new(0.4, 0.0, 0.0)), (DVec3::Z, DVec3::Y));
        assert_eq!(saddle().shading(DVec3::new(0.4, 1.0, 0.4)), (DVec3::X, DVec3::Y));
        let (normal, _) = saddle().shading(DVec3::new(0.4, 0.5, 0.2));
        assert!((normal - DVec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-15);
    }
}
