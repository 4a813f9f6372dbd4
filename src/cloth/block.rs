//! A block: the few crossings that rays are traced against at a time. Blocks that look the same are
//! stored once.

mod build;
mod survey;
mod ways;

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use self::survey::{Boxed, Survey};
pub use self::ways::{End, Stretch};

use super::spec::YarnShape;
use super::twist::Twist;
use super::yarn_path::{YarnPath, YarnSet};
use crate::accel::bilinear::{Bilinear, Edge};
use crate::accel::bvh::Bvh;
use crate::accel::cylinder::{Cylinder, Joint};
use crate::accel::cylinder_pair::{RayPair, enter_either};
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

/// The shapes that the kinds of yarns have in a cloth, and how they twist: of ends and of picks.
#[derive(Debug, Clone, PartialEq)]
pub struct YarnForms(pub [Vec<(YarnShape, Twist)>; 2]);

/// Which ply a piece of surface belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strand {
    /// The yarn's direction.
    pub set: YarnSet,
    /// The yarn, counted from the block's first of that set.
    pub yarn: i32,
    /// Where the yarn's centre line lies across its direction.
    pub offset: f64,
    /// The first of its cuts.
    first: usize,
    /// The last of its cuts.
    last: usize,
}

/// Yarns of one direction and kind that come near a block.
#[derive(Debug)]
struct Group {
    /// The cuts of their surfaces.
    cuts: Cuts,
    /// Their strands, in the order of the cuts.
    strands: Box<[Strand]>,
    /// By strand.
    surveys: Box<[OnceLock<Survey>]>,
    /// What takes a point of the block into the group's own space, and back.
    narrowing: DVec3,
    widening: DVec3,
}

impl Group {
    /// The number of the strand that has this cut before one of its pieces.
    #[inline]
    fn strand_number(&self, cut: usize) -> usize {
        self.strands.partition_point(|strand| strand.last <= cut)
    }
}

/// The cuts between the pieces of the yarns of a group, strand after strand: piece i of the
/// surface lies between cuts i and i + 1. Those of pressed plies lie in the group's own space, which
/// is narrower across the yarns by their aspect: there the plies are round.
#[derive(Debug)]
enum Cuts {
    /// Of round plies, and the plies' radius there.
    Joints(Box<[Joint]>, f64),
    /// Of ribbons.
    Edges(Box<[Edge]>),
}

/// Bytes that blocks take which are kept together.
#[derive(Debug, Clone, Default)]
pub struct Tally(Arc<AtomicUsize>);

impl Tally {
    /// Those counted so far.
    pub fn bytes(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    fn add(&self, bytes: usize) {
        self.0.fetch_add(bytes, Ordering::Relaxed);
    }
}

/// The geometry of a block.
#[derive(Debug)]
pub struct Block {
    /// Two, of ends and of picks, if the cloth's yarns are all of one kind each.
    groups: Box<[Group]>,
    /// Whether any yarns are pressed.
    pressed: bool,
    /// Over the pieces that reach into the block.
    bvh: Bvh,
    /// Of the pieces that reach into the room.
    boxes: Box<[Boxed]>,
    /// The block's footprint and some more.
    room: [Range<f64>; 2],
    tally: Tally,
}

/// A piece of surface in a block: its group and its cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece(u32);

/// Bits of a piece's number that tell the group.
const GROUP_BITS: u32 = 6;

/// The most groups of a block.
pub const MOST_GROUPS: usize = 1 << GROUP_BITS;

impl Piece {
    fn new(group: usize, cut: usize) -> Self {
        Self((cut as u32) << GROUP_BITS | group as u32)
    }

    #[inline]
    fn group(self) -> usize {
        (self.0 % (1 << GROUP_BITS)) as usize
    }

    #[inline]
    fn cut(self) -> usize {
        (self.0 >> GROUP_BITS) as usize
    }
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
    /// The nearest surface that the ray enters within (`t_min`, `t_max`), and its distance; `inverse`
    /// is that of its direction.
    #[inline]
    pub fn nearest(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<(Piece, f64)> {
        if self.pressed || self.groups.len() > 2 {
            return self.nearest_elsewise(ray, inverse, t_min, t_max);
        }
        let (two, pair) = (self.two(), RayPair::new(ray, ray));
        let enter = |pieces, t_max| self.enter(two, pieces, ray, &pair, t_min, t_max);
        let hit = self.bvh.nearest(ray, inverse, t_min, t_max, enter);
        hit.map(|(piece, t)| (Piece(piece), t))
    }

    /// The same, if any yarns are pressed, or of several kinds.
    // Not inlined: it would make the loop over round plies slower.
    #[inline(never)]
    fn nearest_elsewise(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<(Piece, f64)> {
        if self.groups.len() > 2 {
            return self.nearest_of_many(ray, inverse, t_min, t_max);
        }
        let two = self.two();
        let rays = narrowed(two, ray);
        let enter =
            |pieces, t_max| self.enter(two, pieces, ray, &pair_of(&rays, pieces), t_min, t_max);
        let hit = self.bvh.nearest(ray, inverse, t_min, t_max, enter);
        hit.map(|(piece, t)| (Piece(piece), t))
    }

    /// The same, if yarns of one direction are of several kinds.
    #[inline(never)]
    fn nearest_of_many(
        &self,
        ray: &Ray,
        inverse: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<(Piece, f64)> {
        let enter = |pieces, t_max| {
            self.enter(&self.groups[..], pieces, ray, &self.own_pair(ray, pieces), t_min, t_max)
        };
        let hit = self.bvh.nearest(ray, inverse, t_min, t_max, enter);
        hit.map(|(piece, t)| (Piece(piece), t))
    }

    /// Whether the ray enters any surface within (`t_min`, `t_max`).
    #[inline]
    pub fn any(&self, ray: &Ray, inverse: DVec3, t_min: f64, t_max: f64) -> bool {
        if self.pressed || self.groups.len() > 2 {
            return self.any_elsewise(ray, inverse, t_min, t_max);
        }
        let (two, pair) = (self.two(), RayPair::new(ray, ray));
        let enters = |pieces| self.enter(two, pieces, ray, &pair, t_min, t_max).is_some();
        self.bvh.any(ray, inverse, t_min, t_max, enters)
    }

    /// The same, if any yarns are pressed, or of several kinds.
    #[inline(never)]
    fn any_elsewise(&self, ray: &Ray, inverse: DVec3, t_min: f64, t_max: f64) -> bool {
        if self.groups.len() > 2 {
            return self.any_of_many(ray, inverse, t_min, t_max);
        }
        let two = self.two();
        let rays = narrowed(two, ray);
        let enters =
            |pieces| self.enter(two, pieces, ray, &pair_of(&rays, pieces), t_min, t_max).is_some();
        self.bvh.any(ray, inverse, t_min, t_max, enters)
    }

    /// The same, if yarns of one direction are of several kinds.
    #[inline(never)]
    fn any_of_many(&self, ray: &Ray, inverse: DVec3, t_min: f64, t_max: f64) -> bool {
        let enters = |pieces| {
            let pair = self.own_pair(ray, pieces);
            self.enter(&self.groups[..], pieces, ray, &pair, t_min, t_max).is_some()
        };
        self.bvh.any(ray, inverse, t_min, t_max, enters)
    }

    /// The groups of a block that has two.
    #[inline]
    fn two(&self) -> &[Group; 2] {
        self.groups.first_chunk().expect("ends and picks come near every block")
    }

    /// For each of two pieces the ray in its group's own space.
    #[inline(always)]
    fn own_pair(&self, ray: &Ray, pieces: [u32; 2]) -> RayPair {
        let [a, b] = pieces.map(|piece| {
            let group = &self.groups[Piece(piece).group()];
            if self.pressed { ray.scaled(group.narrowing) } else { *ray }
        });
        RayPair::new(&a, &b)
    }

    /// Which of two pieces the ray enters first, and where; `pair` is it in their groups' own spaces.
    // Inlined into each loop over boxes: calls would cost a tenth of all.
    #[inline(always)]
    fn enter(
        &self,
        groups: &(impl Groups + ?Sized),
        pieces: [u32; 2],
        ray: &Ray,
        pair: &RayPair,
        t_min: f64,
        t_max: f64,
    ) -> Option<(u32, f64)> {
        let [a, b] = pieces.map(Piece);
        match [a, b].map(|piece| &groups.of(piece).cuts) {
            [Cuts::Joints(joints, radius), Cuts::Joints(others, other_radius)] => {
                let (a, b) = (ends(joints, a.cut()), ends(others, b.cut()));
                let radii = [*radius, *other_radius];
                let (which, t) = enter_either(a, b, radii, pair, t_min, t_max)?;
                Some((pieces[which], t))
            }
            _ => self.enter_in_turn(pieces, ray, t_min, t_max),
        }
    }

    /// The same, where not both are of round plies: one after the other.
    // Not inlined: it would make the loop over round plies slower.
    #[inline(never)]
    fn enter_in_turn(
        &self,
        pieces: [u32; 2],
        ray: &Ray,
        t_min: f64,
        t_max: f64,
    ) -> Option<(u32, f64)> {
        let count = if pieces[0] == pieces[1] { 1 } else { 2 };
        let pieces = pieces.into_iter().take(count).map(Piece);
        self.enter_first(pieces, ray, t_min, t_max).map(|(piece, t)| (piece.0, t))
    }

    /// Which of `pieces` the ray enters first, and where.
    #[inline]
    fn enter_first(
        &self,
        pieces: impl Iterator<Item = Piece>,
        ray: &Ray,
        t_min: f64,
        mut t_max: f64,
    ) -> Option<(Piece, f64)> {
        let mut first = None;
        for piece in pieces {
            if let Some(t) = self.enter_one(piece, ray, t_min, t_max) {
                first = Some((piece, t));
                t_max = t;
            }
        }
        first
    }

    /// Where the ray enters a piece.
    #[inline]
    fn enter_one(&self, piece: Piece, ray: &Ray, t_min: f64, t_max: f64) -> Option<f64> {
        let group = &self.groups[piece.group()];
        match &group.cuts {
            Cuts::Joints(joints, radius) => {
                let own = if self.pressed { ray.scaled(group.narrowing) } else { *ray };
                cylinder(joints, *radius, piece.cut()).enter(&own, t_min, t_max)
            }
            Cuts::Edges(edges) => patch(edges, piece.cut()).intersect(ray, t_min, t_max),
        }
    }

    /// About how much memory it takes before anything is surveyed.
    fn bytes(&self) -> usize {
        let groups = self.groups.iter().map(|group| {
            let cuts = match &group.cuts {
                Cuts::Joints(joints, _) => size_of_val(&joints[..]),
                Cuts::Edges(edges) => size_of_val(&edges[..]),
            };
            size_of_val(group)
                + cuts
                + size_of_val(&group.surveys[..])
                + size_of_val(&group.strands[..])
        });
        let own = size_of::<Self>() + size_of_val(&self.boxes[..]) + self.bvh.bytes();
        own + groups.sum::<usize>()
    }

    /// The strand that `piece` belongs to.
    #[inline]
    pub fn strand(&self, piece: Piece) -> &Strand {
        let group = &self.groups[piece.group()];
        &group.strands[group.strand_number(piece.cut())]
    }

    /// Normal and tangent where the ray meets `piece` at distance `t`.
    #[inline(always)]
    pub fn surface(&self, piece: Piece, ray: &Ray, t: f64) -> SurfacePoint {
        match &self.groups[piece.group()].cuts {
            Cuts::Joints(joints, radius) if !self.pressed => {
                let cylinder = cylinder(joints, *radius, piece.cut());
                let (normal, tangent) = cylinder.directions(ray.at(t));
                SurfacePoint { normal: normal.normalize(), tangent: tangent.normalize() }
            }
            _ => self.surface_pressed_or_flat(piece, ray, t),
        }
    }

    /// The same of pressed plies and of ribbons.
    #[inline(never)]
    fn surface_pressed_or_flat(&self, piece: Piece, ray: &Ray, t: f64) -> SurfacePoint {
        let group = &self.groups[piece.group()];
        match &group.cuts {
            Cuts::Joints(joints, radius) => {
                let point = ray.at(t) * group.narrowing;
                let (normal, tangent) = cylinder(joints, *radius, piece.cut()).directions(point);
                // Normals change by the inverse transpose of what changes tangents.
                SurfacePoint {
                    normal: (normal * group.narrowing).normalize(),
                    tangent: (tangent * group.widening).normalize(),
                }
            }
            Cuts::Edges(edges) => {
                let (normal, tangent) = patch(edges, piece.cut()).shading(ray.at(t));
                SurfacePoint { normal, tangent }
            }
        }
    }
}

/// The groups of a block.
trait Groups {
    /// The one that a piece is of.
    fn of(&self, piece: Piece) -> &Group;
}

/// Of two there need be no test whether there is one of that number: loops over boxes are faster.
impl Groups for [Group; 2] {
    #[inline(always)]
    fn of(&self, piece: Piece) -> &Group {
        &self[piece.group() % 2]
    }
}

impl Groups for [Group] {
    #[inline(always)]
    fn of(&self, piece: Piece) -> &Group {
        &self[piece.group()]
    }
}

/// The ray in the own space of each of two groups, where yarns are round.
#[inline]
fn narrowed(two: &[Group; 2], ray: &Ray) -> [Ray; 2] {
    two.each_ref().map(|group| ray.scaled(group.narrowing))
}

/// For each of two pieces the ray in its group's own space, of two groups.
#[inline]
fn pair_of(rays: &[Ray; 2], pieces: [u32; 2]) -> RayPair {
    let [a, b] = pieces.map(|piece| &rays[Piece(piece).group() % 2]);
    RayPair::new(a, b)
}

#[inline]
fn ends(joints: &[Joint], cut: usize) -> [&Joint; 2] {
    [&joints[cut], &joints[cut + 1]]
}

#[inline]
fn cylinder(joints: &[Joint], radius: f64, cut: usize) -> Cylinder {
    Cylinder::new(joints[cut], joints[cut + 1], radius)
}

#[inline]
fn patch(edges: &[Edge], cut: usize) -> Bilinear {
    Bilinear::new(edges[cut], edges[cut + 1])
}
