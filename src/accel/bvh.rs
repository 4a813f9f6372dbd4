//! The bounding volume hierarchy: obvhs builds a binary one, of which four levels are merged into one,
//! so that a ray is tested against sixteen boxes at a time (Wald et al. 2008, "Getting rid of packets").

use std::iter;

use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use smallvec::SmallVec;
use wide::f32x16;

use super::bounds::Bounds;
use super::ray::Ray;

/// Boxes grow by this fraction of the whole, so that single precision never loses a hit.
const RELATIVE_PADDING: f64 = 1e-5;

/// Children of a node. Branches that the processor cannot foresee cost more than boxes tested in vain.
const WIDTH: usize = 16;

struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Boxes, side by side.
#[derive(Debug, Clone)]
struct Node {
    /// Lower and upper x, lower and upper y, lower and upper z.
    planes: [f32x16; 6],
    /// What is in each: the number of a node, or of what was put into the hierarchy.
    children: [u32; WIDTH],
    /// A bit for each child that is no node.
    leaves: u32,
}

/// Children that a ray has still to look at.
type Pending = SmallVec<[Met; 64]>;

/// A node that a ray meets. The distance at which it does, which is not negative, makes up the upper
/// bits, so that the nearer is the lesser: then the processor needs no branch to tell which is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Met(u64);

impl Met {
    #[inline]
    fn new(entry: f32, node: u32) -> Self {
        Self(u64::from(entry.to_bits()) << 32 | u64::from(node))
    }

    #[inline]
    fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline]
    fn node(self) -> usize {
        self.0 as u32 as usize
    }
}

/// How much time a hierarchy is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// For many rays.
    Thorough,
    /// For few: built several times faster, and traced some percent slower.
    Quick,
}

/// A hierarchy over numbered boxes.
#[derive(Debug, Clone)]
pub struct Bvh(Box<[Node]>);

impl Bvh {
    /// How much memory the hierarchy takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }

    /// Builds the hierarchy over numbered boxes; the cost grows as n log n.
    pub fn new(boxes: &[(u32, Bounds)], effort: Effort) -> Self {
        let whole = boxes.iter().fold(Bounds::EMPTY, |whole, (_, b)| whole.union(*b));
        let reach = whole.min.abs().max(whole.max.abs()).max_element();
        let padded: Vec<_> = boxes
            .iter()
            .map(|(_, b)| b.grown(RELATIVE_PADDING * reach))
            .map(|b| Padded(Aabb::new(b.min.as_vec3a(), b.max.as_vec3a())))
            .collect();
        let preset = match effort {
            Effort::Thorough => BvhBuildParams::very_slow_build(),
            Effort::Quick => BvhBuildParams::medium_build(),
        };
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..preset };
        let binary = build_bvh2(&padded, params, &mut Default::default());
        let mut nodes = Vec::new();
        if !binary.nodes.is_empty() {
            let number = |slot| boxes[binary.primitive_indices[slot] as usize].0;
            merge(&binary, 0, &number, &mut nodes);
        }
        Self(nodes.into())
    }

    /// The nearest hit with `t` in (`t_min`, `t_max`): the box's number and `t`. `inverse` is that of
    /// the ray's direction.
    ///
    /// `intersect(numbers, t_max)` looks at what is in two boxes (or in one, given twice) at once; it
    /// answers which is hit first, and where, if below `t_max`.
    #[inline]
    pub fn nearest(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
        mut intersect: impl FnMut([u32; 2], f64) -> Option<(u32, f64)>,
    ) -> Option<(u32, f64)> {
        let mut best = None;
        let mut nearest = t_max;
        self.traverse(&SingleRay::new(ray, inverse, t_min, t_max), |numbers| {
            let hit = intersect(numbers, nearest)?;
            nearest = hit.1;
            best = Some(hit);
            Some(round_up(nearest - t_min))
        });
        best
    }

    /// Whether anything is hit with `t` in (`t_min`, `t_max`); `intersect` is asked as by
    /// [`Bvh::nearest`].
    #[inline]
    pub fn any(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
        mut intersect: impl FnMut([u32; 2]) -> bool,
    ) -> bool {
        let mut found = false;
        self.traverse(&SingleRay::new(ray, inverse, t_min, t_max), |numbers| {
            found = intersect(numbers);
            found.then_some(f32::NEG_INFINITY)
        });
        found
    }

    /// Visits the boxes that the ray meets by twos, nearer nodes first; `visit` may bring its end
    /// nearer.
    #[inline(always)]
    fn traverse(&self, ray: &SingleRay, mut visit: impl FnMut([u32; 2]) -> Option<f32>) {
        if self.0.is_empty() {
            return;
        }
        let mut t_max = ray.t_max;
        let mut pending = Pending::new();
        let mut current = 0;
        loop {
            let node = &self.0[current];
            let (entry, hits) = node.intersect(ray, t_max);
            for [first, second] in pairs(hits & node.leaves) {
                if (entry[first] <= t_max) | (entry[second] <= t_max) {
                    let numbers = [node.children[first], node.children[second]];
                    t_max = visit(numbers).unwrap_or(t_max);
                }
            }
            let nearest = node.nearest(&entry, hits & !node.leaves, &mut pending);
            let next = nearest
                .or_else(|| iter::from_fn(|| pending.pop()).find(|met| met.entry() <= t_max));
            let Some(next) = next else { return };
            current = next.node();
        }
    }
}

impl Node {
    /// Where the ray enters each box, and a bit for each that it meets before `t_max`.
    #[inline(always)]
    fn intersect(&self, ray: &SingleRay, t_max: f32) -> ([f32; WIDTH], u32) {
        let (mut enter, mut leave) = (f32x16::ZERO, f32x16::splat(t_max));
        for axis in 0..3 {
            let near = ray.near[axis];
            let (origin, inverse) = (ray.origin[axis], ray.inverse[axis]);
            enter = enter.fast_max((self.planes[near] - origin) * inverse);
            leave = leave.fast_min((self.planes[near ^ 1] - origin) * inverse);
        }
        (enter.to_array(), enter.simd_le(leave).to_bitmask())
    }

    /// That of the children `hits` which the ray enters first; the others become pending.
    #[inline(always)]
    fn nearest(&self, entry: &[f32; WIDTH], hits: u32, pending: &mut Pending) -> Option<Met> {
        let mut met = bits(hits).map(|child| Met::new(entry[child], self.children[child]));
        let mut nearest = met.next()?;
        for met in met {
            pending.push(nearest.max(met));
            nearest = nearest.min(met);
        }
        Some(nearest)
    }
}

/// The places of the bits that are set.
#[inline]
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    iter::from_fn(move || {
        let place = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (place < u32::BITS).then_some(place as usize)
    })
}

/// The places of the bits that are set, by twos; the last is given twice if it has no other.
#[inline]
fn pairs(mask: u32) -> impl Iterator<Item = [usize; 2]> {
    let mut places = bits(mask);
    iter::from_fn(move || {
        let first = places.next()?;
        Some([first, places.next().unwrap_or(first)])
    })
}

/// Adds a node over at most [`WIDTH`] nodes of the binary hierarchy that make up node `root`, and all
/// below it; answers its number.
fn merge(
    binary: &Bvh2,
    root: usize,
    number_of: &impl Fn(usize) -> u32,
    nodes: &mut Vec<Node>,
) -> u32 {
    let held = opened(binary, root);
    let nothing = [f32::INFINITY, f32::NEG_INFINITY];
    let mut planes = [0, 1, 2, 3, 4, 5].map(|plane| [nothing[plane % 2]; WIDTH]);
    for (child, &slot) in held.iter().enumerate() {
        let Aabb { min, max } = *binary.nodes[slot].aabb();
        for axis in 0..3 {
            planes[2 * axis][child] = min[axis];
            planes[2 * axis + 1][child] = max[axis];
        }
    }
    let number = nodes.len();
    nodes.push(Node { planes: planes.map(f32x16::from), children: [0; WIDTH], leaves: 0 });
    for (child, slot) in held.into_iter().enumerate() {
        let node = &binary.nodes[slot];
        nodes[number].children[child] = if node.is_leaf() {
            nodes[number].leaves |= 1 << child;
            number_of(node.first_index as usize)
        } else {
            merge(binary, slot, number_of, nodes)
        };
    }
    number as u32
}

/// Node `root` of the binary hierarchy, replaced by its children, the largest of which is replaced by
/// its own, until there are [`WIDTH`] or only leaves.
fn opened(binary: &Bvh2, root: usize) -> Vec<usize> {
    let mut held = vec![root];
    while held.len() < WIDTH {
        let inner = (0..held.len()).filter(|&place| !binary.nodes[held[place]].is_leaf());
        let area = |&place: &usize| binary.nodes[held[place]].aabb().half_area();
        let largest = inner.max_by(|a, b| area(a).total_cmp(&area(b)));
        let Some(largest) = largest else { break };
        let first = binary.nodes[held[largest]].first_index as usize;
        held[largest] = first;
        held.push(first + 1);
    }
    held
}

/// A ray in single precision. It starts as near to where it may hit as can be: far from its origin
/// a ray in single precision goes astray by more than the padding.
struct SingleRay {
    origin: [f32x16; 3],
    inverse: [f32x16; 3],
    /// Which plane of each axis the ray meets first.
    near: [usize; 3],
    t_max: f32,
}

impl SingleRay {
    #[inline]
    fn new(ray: &Ray, inverse: DVec3, t_min: f64, t_max: f64) -> Self {
        let inverse = inverse.as_vec3().to_array();
        let near = [0, 1, 2].map(|axis| 2 * axis + usize::from(inverse[axis] < 0.0));
        let origin = ray.at(t_min).as_vec3().to_array();
        let [origin, inverse] = [origin, inverse].map(|v| v.map(f32x16::splat));
        Self { origin, inverse, near, t_max: round_up(t_max - t_min) }
    }
}

#[inline]
fn round_up(t: f64) -> f32 {
    (t + 1e-6 * t.abs()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Sampler;

    fn point(sampler: &mut Sampler) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| 4.0 * sampler.next_1d() - 2.0))
    }

    /// Some boxes, of which half lie on one spot, numbered backwards.
    fn boxes(count: u32) -> Vec<(u32, Bounds)> {
        let sampler = &mut Sampler::new(1, u64::from(count), 0);
        let corner = |i: u32, sampler: &mut Sampler| {
            if i.is_multiple_of(2) { DVec3::ONE } else { point(sampler) }
        };
        (0..count)
            .map(|i| {
                let (low, size) = (corner(i, sampler), 0.2 * (point(sampler) + 2.0));
                (count - i, Bounds { min: low, max: low + size })
            })
            .collect()
    }

    /// Where a ray enters a box, or 0 if it starts in it.
    fn enter(ray: &Ray, bounds: &Bounds) -> Option<f64> {
        let [a, b] = [bounds.min, bounds.max].map(|p| (p - ray.origin) * ray.inverse());
        let (t_in, t_out) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
        (t_in <= t_out).then_some(t_in)
    }

    #[test]
    fn boxes_are_met_as_by_trying_them_all() {
        for count in [0, 1, 2, 16, 17, 300] {
            let boxes = boxes(count);
            let bvh = Bvh::new(&boxes, Effort::Quick);
            let number = |i: u32| boxes[(count - i) as usize].1;
            for i in 0..2000 {
                let sampler = &mut Sampler::new(2, i, 0);
                let mut direction = point(sampler).normalize();
                if i.is_multiple_of(8) {
                    direction = DVec3::NEG_Y;
                }
                let ray = Ray { origin: 1.5 * point(sampler), direction };
                let t_max = 3.0 * sampler.next_1d();
                let met = |i: u32| enter(&ray, &number(i)).filter(|&t| t < t_max);
                let expected = (1..=count).filter_map(met).min_by(f64::total_cmp);
                let found = bvh.nearest(&ray, ray.inverse(), 0.0, t_max, |numbers, t_max| {
                    let hits = numbers.map(|i| (i, met(i).unwrap_or(f64::INFINITY)));
                    hits.into_iter().filter(|hit| hit.1 < t_max).min_by(|a, b| a.1.total_cmp(&b.1))
                });
                assert_eq!(found.map(|(_, t)| t), expected, "{count} boxes, ray {i}");
                let any = bvh.any(&ray, ray.inverse(), 0.0, t_max, |numbers| {
                    numbers.iter().any(|&i| met(i).is_some())
                });
                assert_eq!(any, expected.is_some(), "{count} boxes, ray {i}");
            }
        }
    }
}
