//! What a block is built from: the strands that reach in, their pieces, and which of those are near
//! each other.

use std::ops::Range;

use glam::DVec3;

use super::ways::Near;
use super::{Block, BlockPlan, Cuts, Group, Piece, Strand, YarnForms, cylinder, patch};
use crate::accel::bilinear::Bilinear;
use crate::accel::bounds::Bounds;
use crate::accel::bvh::Bvh;
use crate::accel::cylinder::{Cylinder, between};
use crate::cloth::spec::YarnShape;
use crate::cloth::twist::Twist;
use crate::cloth::yarn_path::{YarnPath, YarnSet};

/// Room for rounding, as a part of a piece's size.
const ROUNDING: f64 = 1e-6;

/// How much room around a block's footprint, as a part of its size, other plies are looked for in
/// that reach into a piece.
const AROUND: f64 = 0.15;

impl Block {
    /// Builds the strands of `plan` that reach into the block or just beside it, and the hierarchy over
    /// their pieces that reach in.
    pub fn new(plan: &BlockPlan, forms: &YarnForms) -> Self {
        let mut boxes = Vec::new();
        let groups: Vec<_> = kinds_near(plan)
            .into_iter()
            .enumerate()
            .map(|(number, (set, kind))| {
                let of_kind = Members { plan, set, kind, number };
                Group::new(&of_kind, forms.0[set as usize][kind], &mut boxes)
            })
            .collect();
        let footprint = footprint(plan.size);
        let mut traced = boxes.clone();
        traced.retain(|(_, bounds)| overlaps(bounds, &footprint));
        let mut block = Self {
            near: Vec::new(),
            pressed: groups.iter().any(|group| group.widening != DVec3::ONE),
            groups,
            bvh: Bvh::new(&traced),
        };
        block.survey(&boxes, &around(plan.size));
        block
    }

    /// Finds the pieces near those that lie in `room` with all of them.
    fn survey(&mut self, boxes: &[(u32, Bounds)], room: &[Range<f64>; 2]) {
        for own in boxes.iter().filter(|(_, bounds)| within(bounds, room)) {
            let first = self.near.len() as u32;
            let near: Vec<_> = boxes.iter().filter_map(|other| self.near(*own, *other)).collect();
            self.near.extend(near);
            let (group, cut) = (Piece(own.0).group(), Piece(own.0).cut());
            self.groups[group].near_of[cut] = Some([first, self.near.len() as u32]);
        }
    }

    /// The second of two pieces, if it is of a different ply and perhaps overlaps the first.
    fn near(
        &self,
        (own, own_box): (u32, Bounds),
        (other, other_box): (u32, Bounds),
    ) -> Option<Near> {
        let [own, other] = [own, other].map(Piece);
        let is_same = own.group() == other.group() && self.strand(own) == self.strand(other);
        if is_same || !own_box.meets(&other_box) {
            return None;
        }
        // Only in the same own space are both round.
        let [narrowing, others] = [own, other].map(|piece| self.groups[piece.group()].narrowing);
        if narrowing == others
            && let [Some(a), Some(b)] = [own, other].map(|piece| self.round(piece))
            && !a.may_overlap(&b)
        {
            return None;
        }
        let [axis, other_axis] = [own, other].map(|piece| self.axis(piece));
        let normal = between(axis, other_axis).normalize_or_zero().as_vec3();
        // Room for rounding, and for what rays that meet a piece may overstep it by.
        let slack = ROUNDING * (other_box.max - other_box.min).max_element();
        let height = (self.lowest(other, normal.as_dvec3()) - slack) as f32;
        Some(Near { piece: other, normal, height: height.next_down() })
    }

    /// A piece of a round ply, in its group's own space.
    fn round(&self, piece: Piece) -> Option<Cylinder> {
        match &self.groups[piece.group()].cuts {
            Cuts::Joints(joints, radius) => Some(cylinder(joints, *radius, piece.cut())),
            Cuts::Edges(_) => None,
        }
    }

    /// The ends of a piece's centre line.
    fn axis(&self, piece: Piece) -> [DVec3; 2] {
        let group = &self.groups[piece.group()];
        [piece.cut(), piece.cut() + 1].map(|cut| match &group.cuts {
            Cuts::Joints(joints, _) => joints[cut].point * group.widening,
            Cuts::Edges(edges) => 0.5 * (edges[cut].left + edges[cut].right),
        })
    }

    /// How far down a piece reaches along `up`.
    fn lowest(&self, piece: Piece, up: DVec3) -> f64 {
        let group = &self.groups[piece.group()];
        match &group.cuts {
            Cuts::Joints(joints, radius) => {
                cylinder(joints, *radius, piece.cut()).lowest(up * group.widening)
            }
            Cuts::Edges(edges) => patch(edges, piece.cut()).lowest(up),
        }
    }
}

/// The kinds of yarns in a plan: ends first, each set's in the order of their numbers.
pub fn kinds_near(plan: &BlockPlan) -> Vec<(YarnSet, usize)> {
    let mut kinds: Vec<_> = plan.yarns.iter().map(|(_, path)| (path.set, path.kind)).collect();
    kinds.sort_by_key(|(set, kind)| (*set as usize, *kind));
    kinds.dedup();
    kinds
}

/// The yarns of a group: those of a plan that run one way and are of one kind.
struct Members<'a> {
    plan: &'a BlockPlan,
    set: YarnSet,
    kind: usize,
    /// The group's number.
    number: usize,
}

impl Group {
    /// Builds the strands of these yarns; the boxes of their pieces are added to `boxes`.
    fn new(
        members: &Members,
        (shape, twist): (YarnShape, Twist),
        boxes: &mut Vec<(u32, Bounds)>,
    ) -> Self {
        let aspect = shape.aspect();
        let widening = wider(members.set, aspect);
        let (cuts, strands) = match shape.unpressed() {
            round @ YarnShape::Round { plies, ply_radius, .. } => {
                let all = |path: &YarnPath| {
                    let path = path.narrowed(aspect);
                    (0..plies).map(|n| path.ply(&round, twist, n)).collect()
                };
                let bounds = |start, end| {
                    let Bounds { min, max } = Cylinder::new(start, end, ply_radius).bounds();
                    Bounds { min: min * widening, max: max * widening }
                };
                let (joints, strands) = inside(members, all, bounds, boxes);
                (Cuts::Joints(joints, ply_radius), strands)
            }
            YarnShape::Flat { width, .. } => {
                let all = |path: &YarnPath| vec![path.ribbon(width)];
                let bounds = |start, end| Bilinear::new(start, end).bounds();
                let (edges, strands) = inside(members, all, bounds, boxes);
                (Cuts::Edges(edges), strands)
            }
        };
        let near_of = vec![None; cuts.len()];
        Self { cuts, strands, near_of, narrowing: widening.recip(), widening }
    }
}

/// What widens a set by `aspect`, across its yarns.
fn wider(set: YarnSet, aspect: f64) -> DVec3 {
    match set {
        YarnSet::Warp => DVec3::new(aspect, 1.0, 1.0),
        YarnSet::Weft => DVec3::new(1.0, aspect, 1.0),
    }
}

/// The cuts of those strands of a group that reach into the block or just beside it; their pieces that
/// do are added to `boxes`. `cuts_of` answers the cuts of a yarn, strand by strand.
fn inside<C: Copy>(
    members: &Members,
    cuts_of: impl Fn(&YarnPath) -> Vec<Vec<C>>,
    bounds: impl Fn(C, C) -> Bounds,
    boxes: &mut Vec<(u32, Bounds)>,
) -> (Vec<C>, Vec<Strand>) {
    let Members { plan, set, kind, number } = *members;
    let (mut cuts, mut strands) = (Vec::new(), Vec::new());
    let room = around(plan.size);
    let of_kind = |(_, path): &&(i32, YarnPath)| (path.set, path.kind) == (set, kind);
    for (yarn, path) in plan.yarns.iter().filter(of_kind) {
        for strand in cuts_of(path) {
            let first = cuts.len();
            let pieces = strand.windows(2).map(|pair| bounds(pair[0], pair[1])).enumerate();
            let before = boxes.len();
            boxes.extend(
                pieces
                    .filter(|(_, bounds)| overlaps(bounds, &room))
                    .map(|(cut, bounds)| (Piece::new(number, first + cut).0, bounds)),
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
