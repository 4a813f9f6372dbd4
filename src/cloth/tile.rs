//! A relaxed cloth cut into blocks: one tile of the pattern, which swatches of any size repeat.
//!
//! Memory grows with the crossings of the tile (64 bytes of heights and 10 of tables) and, up to a
//! limit, with the number of *different* blocks that rays visit.

use glam::DVec3;

use super::block::{MOST_GROUPS, Piece, Strand, SurfacePoint};
use super::blocks::{BlockRef, Blocks};
use super::grid::{Axis, Located, Visit};
use super::layout::Layout;
use super::spec::{ClothSpec, YarnShape};
use super::yarn_path::YarnSet;
use crate::accel::ray::Ray;
use crate::error::{Error, Result};

/// A surface closer than this part of the mean spacing is the one a ray starts from.
const SELF_HIT_DISTANCE: f64 = 1e-6;

/// The blocks of a cloth, and where they lie in it.
///
/// Its coordinates are the grid's: the origin is the top left corner of the first block.
#[derive(Debug)]
pub struct Tile {
    pub(super) axes: [Axis; 2],
    has_ribbons: bool,
    blocks: Blocks,
    /// Ends and picks in the pattern.
    counts: [usize; 2],
    /// The first end and pick of each column and row of blocks.
    first_yarn: [Vec<usize>; 2],
    /// Ends and picks in the tile.
    yarns: [usize; 2],
    /// Between which all yarns lie.
    pub(super) heights: [f64; 2],
    /// The least distance of a hit.
    pub(super) t_min: f64,
}

/// A piece of a ply somewhere in the cloth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Which way the yarn runs.
    pub set: YarnSet,
    /// Which of the pattern's ends (or picks, counted from the bottom).
    pub yarn: usize,
    /// The same, counted through all repeats.
    pub(super) number: i64,
    pub(super) plan: u32,
    pub(super) piece: Piece,
    pub(super) corner: DVec3,
}

impl Place {
    /// Which yarn of its set, counted through all repeats of the pattern.
    pub fn number(&self) -> i64 {
        self.number
    }
}

impl Tile {
    /// The tile of a cloth, laid out like this; picks are counted from the bottom.
    pub(super) fn new(spec: &ClothSpec, layout: Layout) -> Result<Self> {
        let kinds = layout.most_kinds_near();
        if kinds > MOST_GROUPS {
            let problem = format!(
                "may have {kinds} different yarns that reach over one crossing, of which at most \
                 {MOST_GROUPS} can be told apart: make the yarns narrower or more alike"
            );
            return Err(Error::invalid("fabric", problem));
        }
        // A little more than the yarns' own: joints of bent plies are wider than the plies.
        let reach = [&spec.warp, &spec.weft].map(|yarns| yarns.greatest(YarnShape::reach));
        let reach = 1.25 * reach[0].max(reach[1]);
        let [low, high] = layout.height_range();
        Ok(Self {
            counts: [spec.pattern.ends, spec.pattern.picks],
            first_yarn: [0, 1].map(|axis| layout.first_yarns(axis)),
            yarns: layout.counts(),
            axes: layout.axes(),
            has_ribbons: [&spec.warp, &spec.weft].iter().any(|yarns| yarns.has_ribbons()),
            blocks: Blocks::new(layout)?,
            heights: [low - reach, high + reach],
            t_min: SELF_HIT_DISTANCE * spec.unit(),
        })
    }

    /// How many different blocks there are; this looks at all of them.
    pub fn distinct_blocks(&self) -> usize {
        self.blocks.distinct()
    }

    /// Whether any yarns are ribbons.
    #[inline]
    pub fn has_ribbons(&self) -> bool {
        self.has_ribbons
    }

    /// The shape of the yarn at a place.
    #[inline]
    pub fn shape(&self, place: &Place) -> &YarnShape {
        self.blocks.layout.shape(place.set, place.yarn)
    }

    /// What the ray enters at distance `t`: a piece of the block at `at`.
    #[inline(always)]
    pub(super) fn entered(
        &self,
        ray: &Ray,
        at: &[Located; 2],
        piece: Piece,
        t: f64,
    ) -> (Place, SurfacePoint) {
        let (plan, corner) = self.plan_at(at);
        let block = self.block(plan);
        let place = self.place(at, block.strand(piece), plan, corner, piece);
        let mut surface = block.surface(piece, &ray.shifted(corner), t);
        if let YarnShape::Flat { .. } = self.shape(&place) {
            surface.normal *= -surface.normal.dot(ray.direction).signum();
        }
        (place, surface)
    }

    /// Where a piece of a block is.
    #[inline(always)]
    pub(super) fn place(
        &self,
        at: &[Located; 2],
        strand: &Strand,
        plan: u32,
        corner: DVec3,
        piece: Piece,
    ) -> Place {
        let axis = strand.set as usize;
        let number = self.first_number(axis, &at[axis]) + i64::from(strand.yarn);
        let yarn = number.rem_euclid(self.counts[axis] as i64) as usize;
        Place { set: strand.set, yarn, number, plan, piece, corner }
    }

    /// The number of a block's first end (or pick), counted through all repeats.
    #[inline(always)]
    pub(super) fn first_number(&self, axis: usize, at: &Located) -> i64 {
        at.tile as i64 * self.yarns[axis] as i64 + self.first_yarn[axis][at.block] as i64
    }

    #[inline]
    pub(super) fn visited(&self, visit: &Visit) -> (u32, DVec3) {
        self.plan_at(&visit.at)
    }

    /// The plan of a block, and where its corner lies.
    #[inline]
    pub(super) fn plan_at(&self, [x, y]: &[Located; 2]) -> (u32, DVec3) {
        let (plan, height) = self.blocks.plan_of(y.block * self.axes[0].len() + x.block);
        (plan, DVec3::new(x.low, y.low, height))
    }

    #[inline]
    pub(super) fn block(&self, plan: u32) -> BlockRef<'_> {
        self.blocks.block(plan)
    }

    /// The same tile with no room to keep blocks.
    #[cfg(test)]
    pub(super) fn keeping_none(mut self) -> Self {
        self.blocks.limit = 0;
        self
    }
}
