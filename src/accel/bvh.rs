//! The bounding volume hierarchy: the only file that knows obvhs.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::{Boundable, BvhBuildParams};

use super::ray::Ray;

/// Boxes grow by this fraction of the whole, so that single precision never loses a hit.
const RELATIVE_PADDING: f64 = 1e-5;

/// Rays start this much earlier in single precision: obvhs skips all that is nearer than half of it.
const LEAD: f64 = 2e-4;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lowest corner.
    pub min: DVec3,
    /// The highest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box of nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box around points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |bounds, point| Self {
            min: bounds.min.min(point),
            max: bounds.max.max(point),
        })
    }

    /// The box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box grown by `margin` on every side.
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }
}

struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// A hierarchy over numbered boxes.
#[derive(Debug, Clone)]
pub struct Bvh(CwBvh);

impl Bvh {
    /// Builds the hierarchy; the cost grows as n log n.
    pub fn new(boxes: &[Bounds]) -> Self {
        let whole = boxes.iter().fold(Bounds::EMPTY, |whole, &b| whole.union(b));
        let reach = whole.min.abs().max(whole.max.abs()).max_element();
        let padded: Vec<_> = boxes
            .iter()
            .map(|b| b.grown(RELATIVE_PADDING * reach))
            .map(|b| Padded(Aabb::new(b.min.as_vec3a(), b.max.as_vec3a())))
            .collect();
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::slow_build() };
        Self(build_cwbvh(&padded, params, &mut Default::default()))
    }

    /// The nearest hit with `t` in (`t_min`, `t_max`): the box's number and `t`.
    ///
    /// `intersect(number, t_max)` answers the distance to what is in a box if below `t_max`.
    #[inline]
    pub fn nearest(
        &self,
        ray: &Ray,
        t_min: f64,
        t_max: f64,
        mut intersect: impl FnMut(usize, f64) -> Option<f64>,
    ) -> Option<(usize, f64)> {
        let mut best = None;
        let mut nearest = t_max;
        let (single, start) = single(ray, t_min, t_max);
        self.0.ray_traverse(single, &mut RayHit::none(), |_, slot| {
            let number = self.0.primitive_indices[slot] as usize;
            match intersect(number, nearest) {
                Some(t) => {
                    nearest = t;
                    best = Some((number, t));
                    round_up(t - start)
                }
                None => f32::INFINITY,
            }
        });
        best
    }

    /// Whether anything is hit with `t` in (`t_min`, `t_max`).
    #[inline]
    pub fn any(
        &self,
        ray: &Ray,
        t_min: f64,
        t_max: f64,
        mut intersect: impl FnMut(usize) -> bool,
    ) -> bool {
        let (ray, _) = single(ray, t_min, t_max);
        !self.0.ray_traverse_miss(ray, |_, slot| {
            let hit = intersect(self.0.primitive_indices[slot] as usize);
            if hit { f32::NEG_INFINITY } else { f32::INFINITY }
        })
    }
}

/// The ray in single precision, and the distance at which it now starts: as near to `t_min` as may
/// be, since far from its origin a ray in single precision goes astray by more than the padding.
#[inline]
fn single(ray: &Ray, t_min: f64, t_max: f64) -> (ObvhsRay, f64) {
    let start = t_min - LEAD;
    let origin: Vec3A = ray.at(start).as_vec3a();
    (ObvhsRay::new(origin, ray.direction.as_vec3a(), 0.0, round_up(t_max - start)), start)
}

#[inline]
fn round_up(t: f64) -> f32 {
    (t + 1e-6 * t.abs()) as f32
}
