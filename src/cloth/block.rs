//! A block: the few crossings that rays are traced against at a time. Blocks that look the same are
//! stored once.

use std::ops::Range;

use glam::DVec3;

use super::spec::YarnShape;
use super::twist::Twist;
use super::yarn_path::{YarnPath, YarnSet};
use crate::accel::bilinear::{Bilinear, Edge};
use crate::accel::bounds::Bounds;
use crate::accel::bvh::Bvh;
use crate::accel::cylinder::{Cylinder, Joint, Leave};
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

/// The cuts between the pieces of the yarns of one direction, strand after strand: piece i of the
/// surface lies between cuts i and i + 1. Those of pressed plies lie in the set's own space, which is
/// narrower across the yarns by their aspect: there the plies are round.
#[derive(Debug)]
enum Cuts {
    /// Of round plies, and the plies' radius there.
    Joints(Vec<Joint>, f64),
    /// Of ribbons.
    Edges(Vec<Edge>),
}

impl Cuts {
    fn len(&self) -> usize {
        match self {
            Self::Joints(joints, _) => joints.len(),
            Self::Edges(edges) => edges.len(),
        }
    }
}

/// The geometry of a block.
#[derive(Debug)]
pub struct Block {
    cuts: [Cuts; 2],
    /// Those of each set in the order of their cuts.
    strands: [Vec<Strand>; 2],
    /// What takes a point of the block into each set's own space, and back.
    narrowing: [DVec3; 2],
    widening: [DVec3; 2],
    /// Whether any yarns are.
    pressed: bool,
    /// By set and cut, where in `near` the pieces of other plies stand that may reach into the piece.
    /// Known (`Some`) of those alone that lie wholly in the block or just beside it.
    near_of: [Vec<Option<[u32; 2]>>; 2],
    near: Vec<u32>,
    /// Over the pieces that reach into the block.
    bvh: Bvh,
}

/// A ray in each set's own space, where yarns are round.
struct Rays {
    each: [Ray; 2],
    /// The ray itself: that of both sets if no yarns are pressed.
    twice: RayPair,
}

/// A piece of surface in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece(u32);

impl Piece {
    fn new(set: YarnSet, cut: usize) -> Self {
        Self(2 * cut as u32 + set as u32)
    }

    #[inline]
    fn set(self) -> usize {
        (self.0 % 2) as usize
    }

    #[inline]
    fn cut(self) -> usize {
        (self.0 / 2) as usize
    }
}

/// How much room around a block's footprint, as a part of its size, other plies are looked for in
/// that reach into a piece.
const AROUND: f64 = 0.15;

/// How far a ray inside a ply goes, as far as the block knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// The last piece that it passes.
    pub piece: Piece,
    /// Where it leaves that, or enters another ply.
    pub t: f64,
    /// How it ends.
    pub end: End,
    /// Whether all other plies are known that reach into the way.
    pub surveyed: bool,
}

/// How a stretch inside a ply ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// Through the ply's wall.
    Wall,
    /// At the surface of another ply.
    Other(Piece),
    /// Where the stored stretch does.
    Open,
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
    /// Builds the strands of `plan` that reach into the block or just beside it, and the hierarchy over
    /// their pieces that reach in.
    pub fn new(plan: &BlockPlan, forms: &YarnForms) -> Self {
        let mut boxes = Vec::new();
        let sets = [YarnSet::Warp, YarnSet::Weft];
        let widening = sets.map(|set| wider(set, forms.of(set).0.aspect()));
        let [warp, weft] = sets.map(|set| match (forms.of(set).0.unpressed(), forms.of(set).1) {
            (shape @ YarnShape::Round { plies, ply_radius, .. }, twist) => {
                let aspect = forms.of(set).0.aspect();
                let all = |path: &YarnPath| {
                    let path = path.narrowed(aspect);
                    (0..plies).map(|n| path.ply(&shape, twist, n)).collect()
                };
                let bounds = |start, end| {
                    let Bounds { min, max } = Cylinder::new(start, end, ply_radius).bounds();
                    let widening = widening[set as usize];
                    Bounds { min: min * widening, max: max * widening }
                };
                let (joints, strands) = inside(plan, set, all, bounds, &mut boxes);
                (Cuts::Joints(joints, ply_radius), strands)
            }
            (YarnShape::Flat { width, .. }, _) => {
                let all = |path: &YarnPath| vec![path.ribbon(width)];
                let bounds = |start, end| Bilinear::new(start, end).bounds();
                let (edges, strands) = inside(plan, set, all, bounds, &mut boxes);
                (Cuts::Edges(edges), strands)
            }
        });
        let footprint = footprint(plan.size);
        let mut traced = boxes.clone();
        traced.retain(|(_, bounds)| overlaps(bounds, &footprint));
        let mut block = Self {
            near_of: [&warp.0, &weft.0].map(|cuts| vec![None; cuts.len()]),
            near: Vec::new(),
            cuts: [warp.0, weft.0],
            strands: [warp.1, weft.1],
            narrowing: widening.map(DVec3::recip),
            pressed: widening != [DVec3::ONE; 2],
            widening,
            bvh: Bvh::new(&traced),
        };
        let room = around(plan.size);
        for boxed in boxes.iter().filter(|(_, bounds)| within(bounds, &room)) {
            let first = block.near.len() as u32;
            let near = boxes.iter().filter(|other| block.may_overlap(*boxed, **other));
            let near: Vec<_> = near.map(|(number, _)| *number).collect();
            block.near.extend(near);
            let (set, cut) = (Piece(boxed.0).set(), Piece(boxed.0).cut());
            block.near_of[set][cut] = Some([first, block.near.len() as u32]);
        }
        block
    }

    /// Whether two pieces are of different plies that perhaps overlap there.
    fn may_overlap(&self, (a, a_box): (u32, Bounds), (b, b_box): (u32, Bounds)) -> bool {
        let [a, b] = [a, b].map(Piece);
        if !a_box.meets(&b_box) || self.strand(a) == self.strand(b) {
            return false;
        }
        match [a, b].map(|piece| &self.cuts[piece.set()]) {
            // Of pressed yarns, only in one set's own space are both round.
            [Cuts::Joints(joints, radius), Cuts::Joints(others, other_radius)]
                if !self.pressed || a.set() == b.set() =>
            {
                let a = cylinder(joints, *radius, a.cut());
                a.may_overlap(&cylinder(others, *other_radius, b.cut()))
            }
            _ => true,
        }
    }

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
        let rays = self.narrowed(ray);
        let enter = |pieces, t_max| self.enter(pieces, &rays, t_min, t_max);
        let hit = self.bvh.nearest(ray, inverse, t_min, t_max, enter);
        hit.map(|(piece, t)| (Piece(piece), t))
    }

    /// Whether the ray enters any surface within (`t_min`, `t_max`).
    #[inline]
    pub fn any(&self, ray: &Ray, inverse: DVec3, t_min: f64, t_max: f64) -> bool {
        let rays = self.narrowed(ray);
        let enters = |pieces| self.enter(pieces, &rays, t_min, t_max).is_some();
        self.bvh.any(ray, inverse, t_min, t_max, enters)
    }

    /// The ray in each set's own space.
    #[inline]
    fn narrowed(&self, ray: &Ray) -> Rays {
        let twice = RayPair::new(ray, ray);
        if self.pressed {
            Rays { each: self.narrowing.map(|narrowing| ray.scaled(narrowing)), twice }
        } else {
            Rays { each: [*ray; 2], twice }
        }
    }

    /// Which of two pieces the ray enters first, and where; `rays` is it in each set's own space.
    // Inlined into each loop over boxes: calls would cost a tenth of all.
    #[inline(always)]
    fn enter(&self, pieces: [u32; 2], rays: &Rays, t_min: f64, t_max: f64) -> Option<(u32, f64)> {
        let [a, b] = pieces.map(Piece);
        match [a, b].map(|piece| &self.cuts[piece.set()]) {
            [Cuts::Joints(joints, radius), Cuts::Joints(others, other_radius)] => {
                let pair;
                let pair = if self.pressed {
                    pair = RayPair::new(&rays.each[a.set()], &rays.each[b.set()]);
                    &pair
                } else {
                    &rays.twice
                };
                let (a, b) = (ends(joints, a.cut()), ends(others, b.cut()));
                let radii = [*radius, *other_radius];
                let (which, t) = enter_either(a, b, radii, pair, t_min, t_max)?;
                Some((pieces[which], t))
            }
            _ => self.enter_in_turn(pieces, rays, t_min, t_max),
        }
    }

    /// The same, where not both are of round plies: one after the other.
    // Not inlined: it would make the loop over round plies slower.
    #[inline(never)]
    fn enter_in_turn(
        &self,
        [a, b]: [u32; 2],
        rays: &Rays,
        t_min: f64,
        t_max: f64,
    ) -> Option<(u32, f64)> {
        let first = self.enter_one(Piece(a), rays, t_min, t_max).map(|t| (a, t));
        if a == b {
            return first;
        }
        let t_max = first.map_or(t_max, |(_, t)| t);
        self.enter_one(Piece(b), rays, t_min, t_max).map(|t| (b, t)).or(first)
    }

    /// Where the ray enters a piece.
    #[inline]
    fn enter_one(&self, piece: Piece, rays: &Rays, t_min: f64, t_max: f64) -> Option<f64> {
        let ray = &rays.each[piece.set()];
        match &self.cuts[piece.set()] {
            Cuts::Joints(joints, radius) => {
                cylinder(joints, *radius, piece.cut()).enter(ray, t_min, t_max)
            }
            Cuts::Edges(edges) => patch(edges, piece.cut()).intersect(ray, t_min, t_max),
        }
    }

    /// The strand that `piece` belongs to.
    #[inline]
    pub fn strand(&self, piece: Piece) -> &Strand {
        let strands = &self.strands[piece.set()];
        &strands[strands.partition_point(|strand| strand.last <= piece.cut())]
    }

    /// Normal and tangent where the ray meets `piece` at distance `t`.
    #[inline(always)]
    pub fn surface(&self, piece: Piece, ray: &Ray, t: f64) -> SurfacePoint {
        let set = piece.set();
        match &self.cuts[set] {
            Cuts::Joints(joints, radius) if !self.pressed => {
                let (normal, tangent) =
                    cylinder(joints, *radius, piece.cut()).directions(ray.at(t));
                SurfacePoint { normal: normal.normalize(), tangent: tangent.normalize() }
            }
            Cuts::Joints(joints, radius) => {
                let point = ray.at(t) * self.narrowing[set];
                let (normal, tangent) = cylinder(joints, *radius, piece.cut()).directions(point);
                // Normals change by the inverse transpose of what changes tangents.
                SurfacePoint {
                    normal: (normal * self.narrowing[set]).normalize(),
                    tangent: (tangent * self.widening[set]).normalize(),
                }
            }
            Cuts::Edges(edges) => {
                let (normal, tangent) = patch(edges, piece.cut()).shading(ray.at(t));
                SurfacePoint { normal, tangent }
            }
        }
    }

    /// How far a ray stays inside the ply of `piece`, in which it is at distance `t`.
    #[inline]
    pub fn leave(&self, piece: Piece, ray: &Ray, t: f64) -> Stretch {
        self.walk_inside(piece, ray, t, |_, _| None)
    }

    /// The same, but no further than to the surface of another ply that it enters after `t_min`.
    #[inline]
    pub fn pass(&self, piece: Piece, ray: &Ray, t: f64, t_min: f64) -> Stretch {
        self.walk_inside(piece, ray, t, |near, t_out| {
            let mut nearest = None;
            for &piece in near {
                let t_max = nearest.map_or(t_out, |(_, t)| t);
                let met = self.enter_alone(Piece(piece), ray, t_min, t_max);
                nearest = met.map(|t| (piece, t)).or(nearest);
            }
            nearest
        })
    }

    /// Where the ray enters a piece.
    #[inline]
    fn enter_alone(&self, piece: Piece, ray: &Ray, t_min: f64, t_max: f64) -> Option<f64> {
        match &self.cuts[piece.set()] {
            Cuts::Joints(joints, radius) => {
                let own = if self.pressed { ray.scaled(self.narrowing[piece.set()]) } else { *ray };
                cylinder(joints, *radius, piece.cut()).enter(&own, t_min, t_max)
            }
            Cuts::Edges(edges) => patch(edges, piece.cut()).intersect(ray, t_min, t_max),
        }
    }

    /// Walks inside the ply of `piece` from joint to joint. `meet(near, t)` looks at those pieces of
    /// other plies that may reach into one that is left at `t`.
    #[inline(always)]
    fn walk_inside(
        &self,
        piece: Piece,
        ray: &Ray,
        mut t: f64,
        mut meet: impl FnMut(&[u32], f64) -> Option<(u32, f64)>,
    ) -> Stretch {
        let set = piece.set();
        let Cuts::Joints(joints, radius) = &self.cuts[set] else {
            return Stretch { piece, t, end: End::Wall, surveyed: true };
        };
        let own = if self.pressed { ray.scaled(self.narrowing[set]) } else { *ray };
        let strand = self.strand(piece);
        let mut cut = located(joints, strand, piece.cut(), own.at(t));
        let mut surveyed = true;
        loop {
            let left = cylinder(joints, *radius, cut).leave(&own, t);
            let (Leave::Wall(t_out) | Leave::Forward(t_out) | Leave::Backward(t_out)) = left;
            let piece = Piece::new(strand.set, cut);
            match self.near_of[set][cut] {
                None => surveyed = false,
                Some([first, last]) if first < last => {
                    if let Some((other, t)) = meet(&self.near[first as usize..last as usize], t_out)
                    {
                        return Stretch { piece, t, end: End::Other(Piece(other)), surveyed };
                    }
                }
                Some(_) => {}
            }
            t = t_out;
            let end = match left {
                Leave::Forward(_) if cut + 1 < strand.last => {
                    cut += 1;
                    continue;
                }
                Leave::Backward(_) if cut > strand.first => {
                    cut -= 1;
                    continue;
                }
                Leave::Wall(_) => End::Wall,
                Leave::Forward(_) | Leave::Backward(_) => End::Open,
            };
            return Stretch { piece, t, end, surveyed };
        }
    }

    /// The nearest surface that the ray enters within (`t_min`, `t_max`) and that is not of the ply of
    /// `own`.
    #[inline]
    pub fn nearest_other(
        &self,
        own: Option<Piece>,
        ray: &Ray,
        inverse: DVec3,
        [t_min, t_max]: [f64; 2],
    ) -> Option<(Piece, f64)> {
        let rays = self.narrowed(ray);
        let strand = own.map(|own| self.strand(own));
        let is_own = |piece: u32| {
            let (set, cut) = (Piece(piece).set(), Piece(piece).cut());
            strand.is_some_and(|s| s.set as usize == set && (s.first..s.last).contains(&cut))
        };
        let enter = |pieces: [u32; 2], t_max| {
            let (first, t) = self.enter(pieces, &rays, t_min, t_max)?;
            if !is_own(first) {
                return Some((first, t));
            }
            let second = pieces[usize::from(first == pieces[0])];
            if is_own(second) {
                return None;
            }
            self.enter_one(Piece(second), &rays, t_min, t_max).map(|t| (second, t))
        };
        let hit = self.bvh.nearest(ray, inverse, t_min, t_max, enter);
        hit.map(|(piece, t)| (Piece(piece), t))
    }

    /// A piece of each ply that `point` lies inside of.
    pub fn containing(&self, point: DVec3) -> Vec<Piece> {
        let mut found: Vec<Piece> = Vec::new();
        // A ray too short to leave a box visits all boxes around its origin.
        let ray = Ray { origin: point, direction: DVec3::Z };
        self.bvh.any(&ray, ray.inverse(), 0.0, f64::MIN_POSITIVE, |[a, b]| {
            for piece in [a, b].iter().take(if a == b { 1 } else { 2 }).map(|&piece| Piece(piece)) {
                if let Cuts::Joints(joints, radius) = &self.cuts[piece.set()]
                    && cylinder(joints, *radius, piece.cut())
                        .contains(point * self.narrowing[piece.set()])
                    && !found.iter().any(|other| self.strand(*other) == self.strand(piece))
                {
                    found.push(piece);
                }
            }
            false
        });
        found
    }

    /// The first joint of `piece`.
    pub fn joint(&self, piece: Piece) -> Option<DVec3> {
        match &self.cuts[piece.set()] {
            Cuts::Joints(joints, _) => Some(joints[piece.cut()].point * self.widening[piece.set()]),
            Cuts::Edges(_) => None,
        }
    }

    /// The piece at a joint's place of the ply of the given yarn that has this joint, if the yarn
    /// reaches into the block. (A ply's number tells nothing: it depends on the phase of the twist
    /// that the block starts with.)
    pub fn piece_with(&self, set: YarnSet, yarn: i32, joint: DVec3) -> Option<Piece> {
        let Cuts::Joints(joints, _) = &self.cuts[set as usize] else { return None };
        let joint = joint * self.narrowing[set as usize];
        let plies = self.strands[set as usize].iter().filter(|strand| strand.yarn == yarn);
        let pieces = plies.map(|strand| {
            let cut = located(joints, strand, strand.first, joint);
            let off = |cut: usize| joints[cut].point.distance_squared(joint);
            (off(cut).min(off(cut + 1)), Piece::new(set, cut))
        });
        pieces.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, piece)| piece)
    }
}

/// The cut before `point` along the strand, looked for from `cut` on.
#[inline]
fn located(joints: &[Joint], strand: &Strand, mut cut: usize, point: DVec3) -> usize {
    while cut + 1 < strand.last && joints[cut + 1].beyond(point) > 0.0 {
        cut += 1;
    }
    while cut > strand.first && joints[cut].beyond(point) < 0.0 {
        cut -= 1;
    }
    cut
}

/// What widens a set by `aspect`, across its yarns.
fn wider(set: YarnSet, aspect: f64) -> DVec3 {
    match set {
        YarnSet::Warp => DVec3::new(aspect, 1.0, 1.0),
        YarnSet::Weft => DVec3::new(1.0, aspect, 1.0),
    }
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

/// The cuts of those strands of a set that reach into the block or just beside it; their pieces that
/// do are added to `boxes`. `cuts_of` answers the cuts of a yarn, strand by strand.
fn inside<C: Copy>(
    plan: &BlockPlan,
    set: YarnSet,
    cuts_of: impl Fn(&YarnPath) -> Vec<Vec<C>>,
    bounds: impl Fn(C, C) -> Bounds,
    boxes: &mut Vec<(u32, Bounds)>,
) -> (Vec<C>, Vec<Strand>) {
    let (mut cuts, mut strands) = (Vec::new(), Vec::new());
    let room = around(plan.size);
    for (yarn, path) in plan.yarns.iter().filter(|(_, path)| path.set == set) {
        for strand in cuts_of(path) {
            let first = cuts.len();
            let pieces = strand.windows(2).map(|pair| bounds(pair[0], pair[1])).enumerate();
            let before = boxes.len();
            boxes.extend(
                pieces
                    .filter(|(_, bounds)| overlaps(bounds, &room))
                    .map(|(cut, bounds)| (Piece::new(set, first + cut).0, bounds)),
            );
            if boxes.len() > before {
                cuts.extend(strand);
                let (yarn, last) = (*yarn, cuts.len() - 1);
                strands.push(Strand { set, yarn, offset: path.offset, first, last });
            }
        }
    }
    (cuts, strands)
}

/// A block's footprint, along x and y.
fn footprint(size: [f64; 2]) -> [Range<f64>; 2] {
    let slack = 1e-6 * (size[0] + size[1]);
    size.map(|size| -slack..size + slack)
}

/// The footprint with some room around it, in which all pieces are known.
fn around(size: [f64; 2]) -> [Range<f64>; 2] {
    size.map(|size| -AROUND * size..(1.0 + AROUND) * size)
}

/// Whether a box lies over a footprint with all of it.
fn within(bounds: &Bounds, footprint: &[Range<f64>; 2]) -> bool {
    (0..2).all(|axis| {
        bounds.min[axis] >= footprint[axis].start && bounds.max[axis] <= footprint[axis].end
    })
}

/// Whether a box reaches over a footprint.
fn overlaps(bounds: &Bounds, footprint: &[Range<f64>; 2]) -> bool {
    (0..2).all(|axis| {
        bounds.max[axis] >= footprint[axis].start && bounds.min[axis] <= footprint[axis].end
    })
}
