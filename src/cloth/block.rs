//! A block: the few crossings that rays are traced against at a time. Blocks that look the same are
//! stored once.

use glam::DVec3;

use super::spec::YarnShape;
use super::twist::Twist;
use super::yarn_path::{YarnPath, YarnSet};
use crate::accel::bilinear::Bilinear;
use crate::accel::bvh::{Bounds, Bvh};
use crate::accel::cylinder::{Cylinder, Leave};
use crate::accel::ray::Ray;

/// Everything that the geometry of a block depends on, in the block's own coordinates: its corner
/// with the lowest x and y is the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockPlan {
    /// Its size along x and y.
    pub size: [f64; 2],
    /// The yarns that come near it, each numbered relative to the block's first of that set.
    pub yarns: Vec<(i32, YarnPath)>,
}

/// The shapes that yarns have in a cloth, and how they twist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YarnForms {
    /// Shape and twist of the ends.
    pub warp: (YarnShape, Twist),
    /// Shape and twist of the picks.
    pub weft: (YarnShape, Twist),
}

impl YarnForms {
    /// Shape and twist of a set.
    pub fn of(&self, set: YarnSet) -> (YarnShape, Twist) {
        match set {
            YarnSet::Warp => self.warp,
            YarnSet::Weft => self.weft,
        }
    }
}

/// Which yarn a segment belongs to, and where the segments of its ply lie in the block's list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strand {
    /// The yarn's direction.
    pub set: YarnSet,
    /// The yarn, counted from the block's first of that set.
    pub yarn: i32,
    first: usize,
    last: usize,
}

#[derive(Debug, Clone, Copy)]
enum Shape {
    Cylinder(Cylinder),
    Patch(Bilinear),
}

/// The geometry of a block.
#[derive(Debug)]
pub struct Block {
    shapes: Vec<Shape>,
    /// The strand of each shape.
    strand_of: Vec<u32>,
    strands: Vec<Strand>,
    bvh: Bvh,
    /// The shapes that the hierarchy holds: those that reach into the block.
    inside: Vec<u32>,
}

/// A point of a yarn's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The unit normal: outwards on a ply, upwards (where the ribbon's face is) on a ribbon.
    pub normal: DVec3,
    /// The unit tangent along the ply.
    pub tangent: DVec3,
}

impl Block {
    /// Builds the shapes of `plan` and the hierarchy over those that reach into the block.
    pub fn new(plan: &BlockPlan, forms: &YarnForms) -> Self {
        let (mut shapes, mut strands, mut strand_of) = (Vec::new(), Vec::new(), Vec::new());
        let mut bounds = Vec::new();
        for (yarn, path) in &plan.yarns {
            for strand_shapes in strand_shapes(path, forms.of(path.set)) {
                let first = shapes.len();
                strand_of.resize(first + strand_shapes.len(), strands.len() as u32);
                bounds.extend(strand_shapes.iter().map(Shape::bounds));
                shapes.extend(strand_shapes);
                strands.push(Strand { set: path.set, yarn: *yarn, first, last: shapes.len() - 1 });
            }
        }
        let inside: Vec<u32> = (0..shapes.len() as u32)
            .filter(|&i| overlaps(&bounds[i as usize], plan.size))
            .collect();
        let boxes: Vec<_> = inside.iter().map(|&i| bounds[i as usize]).collect();
        Self { shapes, strand_of, strands, bvh: Bvh::new(&boxes), inside }
    }

    /// The nearest surface that the ray enters within (`t_min`, `t_max`): its number and distance.
    #[inline]
    pub fn nearest(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<(usize, f64)> {
        let hit = self.bvh.nearest(ray, t_min, t_max, |slot, t_max| {
            self.shapes[self.inside[slot] as usize].enter(ray, t_min, t_max)
        });
        hit.map(|(slot, t)| (self.inside[slot] as usize, t))
    }

    /// Whether the ray enters any surface within (`t_min`, `t_max`).
    #[inline]
    pub fn any(&self, ray: &Ray, t_min: f64, t_max: f64) -> bool {
        self.bvh.any(ray, t_min, t_max, |slot| {
            self.shapes[self.inside[slot] as usize].enter(ray, t_min, t_max).is_some()
        })
    }

    /// The strand that shape `number` is a piece of.
    #[inline]
    pub fn strand(&self, number: usize) -> &Strand {
        &self.strands[self.strand_of[number] as usize]
    }

    /// Normal and tangent where the ray meets shape `number` at distance `t`.
    #[inline]
    pub fn surface(&self, number: usize, ray: &Ray, t: f64) -> SurfacePoint {
        let (normal, tangent) = match &self.shapes[number] {
            Shape::Cylinder(cylinder) => cylinder.shading(ray.at(t)),
            Shape::Patch(patch) => patch.shading(ray.at(t)),
        };
        SurfacePoint { normal, tangent }
    }

    /// Where a ray that starts inside the ply of shape `number` leaves that ply: the shape and the
    /// distance. Segments are walked from joint to joint; where the stored stretch ends the ray is out.
    #[inline]
    pub fn leave(&self, number: usize, ray: &Ray) -> (usize, f64) {
        let strand = self.strand(number);
        let (mut number, mut t) = (number, 0.0);
        loop {
            let Shape::Cylinder(cylinder) = &self.shapes[number] else { return (number, t) };
            match cylinder.leave(ray, t) {
                Leave::Forward(through) if number < strand.last => {
                    (number, t) = (number + 1, through)
                }
                Leave::Backward(through) if number > strand.first => {
                    (number, t) = (number - 1, through);
                }
                Leave::Wall(out) | Leave::Forward(out) | Leave::Backward(out) => {
                    return (number, out);
                }
            }
        }
    }
}

/// The shapes of a yarn, ply by ply.
fn strand_shapes(path: &YarnPath, (shape, twist): (YarnShape, Twist)) -> Vec<Vec<Shape>> {
    match shape {
        YarnShape::Round { plies, ply_radius, .. } => (0..plies)
            .map(|ply| {
                let joints = path.ply(&shape, twist, ply);
                let cylinder =
                    |pair: &[_]| Shape::Cylinder(Cylinder::new(pair[0], pair[1], ply_radius));
                joints.windows(2).map(cylinder).collect()
            })
            .collect(),
        YarnShape::Flat { width, .. } => {
            let edges = path.ribbon(width);
            let patch = |pair: &[_]| Shape::Patch(Bilinear::new(pair[0], pair[1]));
            vec![edges.windows(2).map(patch).collect()]
        }
    }
}

impl Shape {
    fn bounds(&self) -> Bounds {
        match self {
            Self::Cylinder(cylinder) => cylinder.bounds(),
            Self::Patch(patch) => patch.bounds(),
        }
    }

    #[inline]
    fn enter(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<f64> {
        match self {
            Self::Cylinder(cylinder) => cylinder.enter(ray, t_min, t_max),
            Self::Patch(patch) => patch.intersect(ray, t_min, t_max),
        }
    }
}

/// Whether a box reaches over the block's footprint, with room for rounding.
fn overlaps(bounds: &Bounds, size: [f64; 2]) -> bool {
    let slack = 1e-6 * (size[0] + size[1]);
    (0..2).all(|axis| bounds.max[axis] >= -slack && bounds.min[axis] <= size[axis] + slack)
}
