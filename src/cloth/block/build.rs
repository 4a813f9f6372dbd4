//! What a block is built from: the strands that reach in, and their pieces.

use std::ops::Range;

use glam::DVec3;

use super::survey::{Boxed, around, unmade};
use super::{Block, BlockPlan, Cuts, Group, Piece, Strand, Tally, YarnForms};
use crate::accel::bilinear::Bilinear;
use crate::accel::bounds::Bounds;
use crate::accel::bvh::{Bvh, Effort};
use crate::accel::cylinder::Cylinder;
use crate::cloth::spec::YarnShape;
use crate::cloth::twist::Twist;
use crate::cloth::yarn_path::{YarnPath, YarnSet};

impl Block {
    /// Builds the strands of `plan` that reach into the block or just beside it, and the hierarchy over
    /// their pieces that reach in; what they take is added to `tally`, now and later.
    pub fn new(plan: &BlockPlan, forms: &YarnForms, effort: Effort, tally: Tally) -> Self {
        let mut boxes = Vec::new();
        let groups: Box<[_]> = kinds_near(plan)
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
        let block = Self {
            pressed: groups.iter().any(|group| group.widening != DVec3::ONE),
            groups,
            bvh: Bvh::new(&traced, effort),
            boxes: boxes.into(),
            room: around(plan.size),
            tally,
        };
        block.tally.add(block.bytes());
        block
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
    fn new(members: &Members, (shape, twist): (YarnShape, Twist), boxes: &mut Vec<Boxed>) -> Self {
        let aspect = shape.aspect();
        let widening = wider(members.set, aspect);
        let (cuts, strands) = match shape.unpressed() {
            round @ YarnShape::Round { plies, ply_radius, .. } => {
                let all = |path: &YarnPath| path.narrowed(aspect).plies(&round, plies, twist);
                let bounds = |start, end| {
                    let Bounds { min, max } = Cylinder::new(start, end, ply_radius).bounds();
                    Bounds { min: min * widening, max: max * widening }
                };
                let (joints, strands) = inside(members, all, bounds, boxes);
                (Cuts::Joints(joints.into(), ply_radius), strands)
            }
            YarnShape::Flat { width, .. } => {
                let all = |path: &YarnPath| vec![path.ribbon(width)];
                let bounds = |start, end| Bilinear::new(start, end).bounds();
                let (edges, strands) = inside(members, all, bounds, boxes);
                (Cuts::Edges(edges.into()), strands)
            }
        };
        let surveys = unmade(strands.len());
        let strands = strands.into();
        Self { cuts, strands, surveys, narrowing: widening.recip(), widening }
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
    boxes: &mut Vec<Boxed>,
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

/// Whether a box reaches over a footprint.
fn overlaps(bounds: &Bounds, footprint: &[Range<f64>; 2]) -> bool {
    (0..2).all(|axis| {
        bounds.max[axis] >= footprint[axis].start && bounds.min[axis] <= footprint[axis].end
    })
}
