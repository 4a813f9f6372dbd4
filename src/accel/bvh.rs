//! The bounding volume hierarchy: obvhs builds a binary one, of which three levels are merged into
//! one, so that a ray is tested against eight boxes at a time (Wald et al. 2008, "Getting rid of
//! packets").

use std::iter;

use glam::{DVec3, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use smallvec::SmallVec;

use super::bounds::Bounds;
use super::ray::Ray;

/// Boxes grow by this fraction of the whole, so that single precision never loses a hit.
const RELATIVE_PADDING: f64 = 1e-5;

/// Children of a node.
const WIDTH: usize = 8;

/// Marks a child that is a box's number rather than a node's.
const LEAF: u32 = 1 << 31;

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
    planes: [[Vec4; 2]; 6],
    /// What is in each: the number of a node, or of a box with the [`LEAF`] bit.
    children: [u32; WIDTH],
}

/// Children that a ray has still to look at, and where it enters them.
type Pending = SmallVec<[(f32, u32); 64]>;

/// A hierarchy over numbered boxes.
#[derive(Debug, Clone)]
pub struct Bvh(Vec<Node>);

impl Bvh {
    /// Builds the hierarchy over numbered boxes; the cost grows as n log n.
    pub fn new(boxes: &[(u32, Bounds)]) -> Self {
        let whole = boxes.iter().fold(Bounds::EMPTY, |whole, (_, b)| whole.union(*b));
        let reach = whole.min.abs().max(whole.max.abs()).max_element();
        let padded: Vec<_> = boxes
            .iter()
            .map(|(_, b)| b.grown(RELATIVE_PADDING * reach))
            .map(|b| Padded(Aabb::new(b.min.as_vec3a(), b.max.as_vec3a())))
            .collect();
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::slow_build() };
        let binary = build_bvh2(&padded, params, &mut Default::default());
        let mut nodes = Vec::new();
        if !binary.nodes.is_empty() {
            let number = |slot| boxes[binary.primitive_indices[slot] as usize].0;
            merge(&binary, vec![0], &number, &mut nodes);
        }
        Self(nodes)
    }

    /// The nearest hit with `t` in (`t_min`, `t_max`): the box's number and `t`. `inverse` is that of
    /// the ray's direction.
    ///
    /// `intersect(number, t_max)` answers the distance to what is in a box if below `t_max`.
    #[inline]
    pub fn nearest(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
        mut intersect: impl FnMut(u32, f64) -> Option<f64>,
    ) -> Option<(u32, f64)> {
        let mut best = None;
        let mut nearest = t_max;
        self.traverse(&SingleRay::new(ray, inverse, t_min, t_max), |number| {
            let t = intersect(number, nearest)?;
            nearest = t;
            best = Some((number, t));
            Some(round_up(t - t_min))
        });
        best
    }

    /// Whether anything is hit with `t` in (`t_min`, `t_max`).
    #[inline]
    pub fn any(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
        mut intersect: impl FnMut(u32) -> bool,
    ) -> bool {
        let mut found = false;
        self.traverse(&SingleRay::new(ray, inverse, t_min, t_max), |number| {
            found = intersect(number);
            found.then_some(f32::NEG_INFINITY)
        });
        found
    }

    /// Visits the boxes that the ray meets, nearer ones first; `visit` may bring its end nearer.
    #[inline]
    fn traverse(&self, ray: &SingleRay, mut visit: impl FnMut(u32) -> Option<f32>) {
        if self.0.is_empty() {
            return;
        }
        let mut t_max = ray.t_max;
        let mut pending = Pending::new();
        let mut current = 0;
        loop {
            let nearest = if current & LEAF == 0 {
                self.0[current as usize].enter(ray, t_max, &mut pending)
            } else {
                t_max = visit(current & !LEAF).unwrap_or(t_max);
                None
            };
            let next = nearest.or_else(|| {
                iter::from_fn(|| pending.pop()).find(|&(t, _)| t <= t_max).map(|(_, child)| child)
            });
            let Some(next) = next else { return };
            current = next;
        }
    }
}

impl Node {
    /// The child that the ray enters first; others that it meets before `t_max` become pending.
    #[inline]
    fn enter(&self, ray: &SingleRay, t_max: f32, pending: &mut Pending) -> Option<u32> {
        let (entry, mut hits) = self.intersect(ray, t_max);
        let mut nearest = None;
        while hits != 0 {
            let child = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let met = (entry[child], self.children[child]);
            nearest = match nearest {
                None => Some(met),
                Some(best) => {
                    let (near, far) = if met.0 < best.0 { (met, best) } else { (best, met) };
                    pending.push(far);
                    Some(near)
                }
            };
        }
        nearest.map(|(_, child)| child)
    }

    /// Where the ray enters each box, and a bit for each that it meets before `t_max`.
    #[inline]
    fn intersect(&self, ray: &SingleRay, t_max: f32) -> ([f32; WIDTH], u32) {
        let halves = [0, 1].map(|half| {
            let (mut enter, mut leave) = (Vec4::ZERO, Vec4::splat(t_max));
            for axis in 0..3 {
                let near = ray.near[axis];
                let (origin, inverse) = (ray.origin[axis], ray.inverse[axis]);
                enter = enter.max((self.planes[near][half] - origin) * inverse);
                leave = leave.min((self.planes[near ^ 1][half] - origin) * inverse);
            }
            (enter, enter.cmple(leave).bitmask())
        });
        let [(low, hits), (high, more)] = halves;
        let mut entry = [0.0; WIDTH];
        low.write_to_slice(&mut entry);
        high.write_to_slice(&mut entry[4..]);
        (entry, hits | more << 4)
    }
}

/// Adds a node over the given nodes of the binary hierarchy, at most two, and all below it; answers
/// its number.
fn merge(
    binary: &Bvh2,
    mut held: Vec<usize>,
    number_of: &impl Fn(usize) -> u32,
    nodes: &mut Vec<Node>,
) -> u32 {
    let size = |&slot: &usize| {
        let node = &binary.nodes[slot];
        if node.is_leaf() { -1.0 } else { node.aabb().half_area() }
    };
    while held.len() < WIDTH {
        let largest = (0..held.len()).max_by(|&a, &b| size(&held[a]).total_cmp(&size(&held[b])));
        let Some(open) = largest.filter(|&i| !binary.nodes[held[i]].is_leaf()) else { break };
        let first = binary.nodes[held[open]].first_index as usize;
        held[open] = first;
        held.push(first + 1);
    }
    let number = nodes.len();
    let nothing = [f32::INFINITY, f32::NEG_INFINITY];
    let mut planes = [0, 1, 2, 3, 4, 5].map(|plane| [[nothing[plane % 2]; 4]; 2]);
    for (child, &slot) in held.iter().enumerate() {
        let Aabb { min, max } = *binary.nodes[slot].aabb();
        for axis in 0..3 {
            planes[2 * axis][child / 4][child % 4] = min[axis];
            planes[2 * axis + 1][child / 4][child % 4] = max[axis];
        }
    }
    nodes.push(Node { planes: planes.map(|p| p.map(Vec4::from)), children: [0; WIDTH] });
    for (child, slot) in held.into_iter().enumerate() {
        let node = &binary.nodes[slot];
        nodes[number].children[child] = if node.is_leaf() {
            LEAF | number_of(node.first_index as usize)
        } else {
            merge(binary, vec![slot], number_of, nodes)
        };
    }
    number as u32
}

/// A ray in single precision. It starts as near to where it may hit as can be: far from its origin
/// a ray in single precision goes astray by more than the padding.
struct SingleRay {
    origin: [f32; 3],
    inverse: [f32; 3],
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
        Self { origin, inverse, near, t_max: round_up(t_max - t_min) }
    }
}

#[inline]
fn round_up(t: f64) -> f32 {
    (t + 1e-6 * t.abs()) as f32
}
