//! Ways inside the plies of a block, and what they meet.

use glam::DVec3;

use super::survey::Near;
use super::{Block, Cuts, Piece, Strand, cylinder};
use crate::accel::cylinder::{Joint, Leave};
use crate::accel::ray::Ray;
use crate::cloth::yarn_path::YarnSet;

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

impl Block {
    /// How far a ray stays inside the ply of `piece`, in which it is at distance `t`.
    #[inline]
    pub fn leave(&self, piece: Piece, ray: &Ray, t: f64) -> Stretch {
        self.walk_inside(piece, ray, t, |_, _| None)
    }

    /// The same, but no further than to the surface of another ply that it enters after `t_min`.
    #[inline]
    pub fn pass(&self, piece: Piece, ray: &Ray, t: f64, t_min: f64) -> Stretch {
        self.walk_inside(piece, ray, t, |near, t_out| {
            let (start, end) = (ray.at(t_min), ray.at(t_out));
            let apart = |near: &&Near| near.lies_before(start) & near.lies_before(end);
            let reached = near.iter().filter(|near| !apart(near)).map(|near| near.piece);
            self.enter_first(reached, ray, t_min, t_out)
        })
    }

    /// Walks inside the ply of `piece` from joint to joint. `meet(near, t)` looks at those pieces of
    /// other plies that may reach into one that is left at `t`.
    #[inline(always)]
    fn walk_inside(
        &self,
        piece: Piece,
        ray: &Ray,
        mut t: f64,
        mut meet: impl FnMut(&[Near], f64) -> Option<(Piece, f64)>,
    ) -> Stretch {
        let group = &self.groups[piece.group()];
        let Cuts::Joints(joints, radius) = &group.cuts else {
            return Stretch { piece, t, end: End::Wall, surveyed: true };
        };
        let own = if self.pressed { ray.scaled(group.narrowing) } else { *ray };
        let number = group.strand_number(piece.cut());
        let (strand, survey) = (&group.strands[number], self.survey(group, number));
        let mut cut = located(joints, strand, piece.cut(), own.at(t));
        let mut surveyed = true;
        loop {
            let left = cylinder(joints, *radius, cut).leave(&own, t);
            let (Leave::Wall(t_out) | Leave::Forward(t_out) | Leave::Backward(t_out)) = left;
            let piece = Piece::new(piece.group(), cut);
            match survey.near(cut - strand.first) {
                None => surveyed = false,
                Some(near) if !near.is_empty() => {
                    if let Some((other, t)) = meet(near, t_out) {
                        return Stretch { piece, t, end: End::Other(other), surveyed };
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
    /// `own`: for ways that lead where not all pieces near are known.
    pub fn nearest_other(
        &self,
        own: Option<Piece>,
        ray: &Ray,
        inverse: DVec3,
        [t_min, t_max]: [f64; 2],
    ) -> Option<(Piece, f64)> {
        let strand = own.map(|own| (own.group(), self.strand(own)));
        let is_own = |piece: Piece| {
            let (group, cut) = (piece.group(), piece.cut());
            strand.is_some_and(|(own, s)| own == group && (s.first..s.last).contains(&cut))
        };
        let enter = |pieces: [u32; 2], t_max| {
            let others = pieces.into_iter().map(Piece).filter(|piece| !is_own(*piece));
            self.enter_first(others, ray, t_min, t_max).map(|(piece, t)| (piece.0, t))
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
                let group = &self.groups[piece.group()];
                if let Cuts::Joints(joints, radius) = &group.cuts
                    && cylinder(joints, *radius, piece.cut()).contains(point * group.narrowing)
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
        let group = &self.groups[piece.group()];
        match &group.cuts {
            Cuts::Joints(joints, _) => Some(joints[piece.cut()].point * group.widening),
            Cuts::Edges(_) => None,
        }
    }

    /// The piece at a joint's place of the ply of the given yarn that has this joint, if the yarn
    /// reaches into the block. (A ply's number tells nothing: it depends on the phase of the twist
    /// that the block starts with.)
    pub fn piece_with(&self, set: YarnSet, yarn: i32, joint: DVec3) -> Option<Piece> {
        // All plies of a yarn are in one group.
        let is_it = |strand: &Strand| strand.set == set && strand.yarn == yarn;
        let number = self.groups.iter().position(|group| group.strands.iter().any(is_it))?;
        let group = &self.groups[number];
        let Cuts::Joints(joints, _) = &group.cuts else { return None };
        let joint = joint * group.narrowing;
        let pieces = group.strands.iter().filter(|strand| is_it(strand)).map(|strand| {
            let cut = located(joints, strand, strand.first, joint);
            let off = |cut: usize| joints[cut].point.distance_squared(joint);
            (off(cut).min(off(cut + 1)), Piece::new(number, cut))
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
