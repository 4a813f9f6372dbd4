//! What other plies reach into a strand's pieces. That is found when light first goes inside a strand:
//! most strands of a block that is seldom visited are never entered.

use std::ops::Range;
use std::sync::OnceLock;

use glam::{DVec3, Vec3};

use super::{Block, Cuts, Group, Piece, cylinder, patch};
use crate::accel::bounds::Bounds;
use crate::accel::cylinder::{Cylinder, between};

/// Room for rounding, as a part of a piece's size.
const ROUNDING: f64 = 1e-6;

/// How much room around a block's footprint, as a part of its size, other plies are looked for in
/// that reach into a piece.
const AROUND: f64 = 0.15;

/// A piece of another ply that may reach into one, and a plane that all of it lies beyond. Only ways
/// that come there as well can meet it: that is soon told, and so most pieces are passed over.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    /// It.
    pub piece: Piece,
    /// The plane's normal, of about unit length or zero, towards the piece.
    pub normal: Vec3,
    /// The plane's height along its normal.
    pub height: f32,
}

impl Near {
    /// Whether `point` is on the near side of the plane.
    #[inline]
    pub fn lies_before(&self, point: DVec3) -> bool {
        self.normal.as_dvec3().dot(point) < f64::from(self.height)
    }
}

/// The pieces of other plies that may reach into those of one strand.
#[derive(Debug)]
pub(super) struct Survey {
    near: Box<[Near]>,
    /// By piece of the strand, where in `near` those stand that may reach into it. Known (`Some`) of
    /// those alone that lie wholly in the block or just beside it.
    of_piece: Box<[Option<[u32; 2]>]>,
}

impl Survey {
    /// What may reach into the strand's piece with this number, if that is known.
    #[inline(always)]
    pub fn near(&self, number: usize) -> Option<&[Near]> {
        self.of_piece[number].map(|[first, last]| &self.near[first as usize..last as usize])
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.near[..]) + size_of_val(&self.of_piece[..])
    }
}

/// A piece's number, and the box around it.
pub(super) type Boxed = (u32, Bounds);

impl Block {
    /// The survey of a group's strand with this number.
    #[inline(always)]
    pub(super) fn survey<'a>(&'a self, group: &'a Group, strand: usize) -> &'a Survey {
        group.surveys[strand].get_or_init(|| self.surveyed(group, strand))
    }

    /// Finds the pieces near those of a strand that lie in the room around the block with all of them.
    #[cold]
    fn surveyed(&self, group: &Group, strand: usize) -> Survey {
        let strand = &group.strands[strand];
        let is_own = |piece: u32| {
            let piece = Piece(piece);
            std::ptr::eq(&self.groups[piece.group()], group)
                && (strand.first..strand.last).contains(&piece.cut())
        };
        let known = |(piece, bounds): &&Boxed| is_own(*piece) && within(bounds, &self.room);
        let own: Vec<_> = self.boxes.iter().filter(known).collect();
        let whole = own.iter().fold(Bounds::EMPTY, |whole, (_, bounds)| whole.union(*bounds));
        let perhaps = |(piece, bounds): &&Boxed| !is_own(*piece) && bounds.meets(&whole);
        let others: Vec<_> = self.boxes.iter().filter(perhaps).collect();
        let mut near = Vec::new();
        let mut of_piece = vec![None; strand.last - strand.first];
        for piece in own {
            let first = near.len() as u32;
            near.extend(others.iter().filter_map(|other| self.near(piece, other)));
            let cut = Piece(piece.0).cut();
            of_piece[cut - strand.first] = Some([first, near.len() as u32]);
        }
        let survey = Survey { near: near.into(), of_piece: of_piece.into() };
        self.tally.add(survey.bytes());
        survey
    }

    /// The second of two pieces of different plies, if it perhaps overlaps the first.
    fn near(&self, (own, own_box): &Boxed, (other, other_box): &Boxed) -> Option<Near> {
        if !own_box.meets(other_box) {
            return None;
        }
        let [own, other] = [*own, *other].map(Piece);
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

/// Surveys of so many strands, none of them made.
pub(super) fn unmade(strands: usize) -> Box<[OnceLock<Survey>]> {
    (0..strands).map(|_| OnceLock::new()).collect()
}

/// A block's footprint with some room around it, in which all pieces are known.
pub(super) fn around(size: [f64; 2]) -> [Range<f64>; 2] {
    size.map(|size| -AROUND * size..(1.0 + AROUND) * size)
}

/// Whether a box lies over a footprint with all of it.
fn within(bounds: &Bounds, footprint: &[Range<f64>; 2]) -> bool {
    (0..2).all(|axis| {
        bounds.min[axis] >= footprint[axis].start && bounds.max[axis] <= footprint[axis].end
    })
}
