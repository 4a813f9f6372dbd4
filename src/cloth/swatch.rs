//! A flat swatch of cloth: one tile of blocks, repeated within a rectangle.
//!
//! Memory grows with the crossings of the tile (64 bytes of heights and 10 of tables) and, up to a
//! limit, with the number of *different* blocks that rays visit, and not with the size of the swatch;
//! a ray costs as many block visits as its stretch inside the cloth crosses.

use std::sync::Arc;

use glam::DVec3;

use super::block::{MOST_GROUPS, Piece, Strand, SurfacePoint};
use super::blocks::{BlockRef, Blocks};
use super::grid::{Axis, Located, Visit, walk};
use super::layout::Layout;
use super::spec::{ClothSpec, YarnShape};
use super::yarn_path::YarnSet;
use crate::accel::ray::Ray;
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::extremes::{greater, greater3, lesser, lesser3};
use crate::weave::relax::{Relaxed, relax};

/// A surface closer than this part of the mean spacing is the one a ray starts from.
const SELF_HIT_DISTANCE: f64 = 1e-6;

/// A swatch, ready for rays.
#[derive(Debug)]
pub struct Swatch {
    pub(super) axes: [Axis; 2],
    has_ribbons: bool,
    blocks: Blocks,
    /// Ends and picks in the pattern.
    counts: [usize; 2],
    /// The first end and pick of each column and row of blocks.
    first_yarn: [Vec<usize>; 2],
    /// Ends and picks in the tile.
    tile_yarns: [usize; 2],
    pub(super) size: [f64; 2],
    heights: [f64; 2],
    pub(super) t_min: f64,
}

/// A piece of a ply somewhere in the swatch.
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

/// A place where a ray enters a yarn.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// The distance along the ray.
    pub t: f64,
    /// Of which yarn.
    pub place: Place,
    /// The surface, seen from where the ray comes from.
    pub surface: SurfacePoint,
    /// Whether the yarn is entered by a cut end.
    pub(super) cut: bool,
}

/// The stretch of a ray inside the swatch.
pub(super) struct Clipped {
    /// It, in the grid's coordinates.
    pub ray: Ray,
    /// Of its direction.
    pub inverse: DVec3,
    /// Where along the whole ray it starts; the other distances are measured from there.
    pub start: f64,
    /// The least distance of a hit.
    pub t_min: f64,
    /// Its length.
    pub t_max: f64,
    /// The axis (0 or 1) across which the swatch's edge cuts it off, if one does.
    pub cut: Option<usize>,
}

impl Swatch {
    /// Relaxes the cloth and lays out its blocks; `size` is that of the swatch in millimetres.
    pub fn new(spec: &ClothSpec, size: [f64; 2], control: &Control) -> Result<Self> {
        let spec = spec.bottom_up();
        let relaxed = relax(&spec.relax_problem(), control)?;
        Self::of(&spec, Arc::new(relaxed), size)
    }

    /// Lays out a cloth that is relaxed already; the picks of both are counted from the bottom.
    pub fn of(spec: &ClothSpec, relaxed: Arc<Relaxed>, size: [f64; 2]) -> Result<Self> {
        let layout = Layout::new(spec, relaxed, size);
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
            tile_yarns: layout.counts(),
            axes: layout.axes(),
            has_ribbons: [&spec.warp, &spec.weft].iter().any(|yarns| yarns.has_ribbons()),
            blocks: Blocks::new(layout)?,
            size,
            heights: [low - reach, high + reach],
            t_min: SELF_HIT_DISTANCE * spec.unit(),
        })
    }

    /// How many different blocks the swatch is made of; this looks at all of them.
    pub fn distinct_blocks(&self) -> usize {
        self.blocks.distinct()
    }

    /// The nearest yarn that the ray enters from outside, by its surface or by a cut end.
    #[inline]
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let clipped = self.clip(ray, f64::INFINITY)?;
        let Clipped { ray, inverse, start, t_min, t_max, cut } = clipped;
        if let Some(axis) = cut
            && let Some(end) = self.cut_end(&ray, axis)
        {
            return Some(Hit { t: start, ..end });
        }
        let (at, piece, t) = walk(&self.axes, &ray, inverse, t_max, |visit| {
            let (plan, corner) = self.visited(&visit);
            let (t_enter, t_leave) = (visit.t_enter - self.t_min, visit.t_leave + self.t_min);
            let local = ray.shifted(corner);
            let hit = self.block(plan).nearest(&local, inverse, greater(t_enter, t_min), t_leave);
            hit.map(|(piece, t)| (visit.at, piece, t))
        })?;
        Some(Hit { t: start + t, ..self.hit(&ray, &at, piece, t) })
    }

    /// What the ray (in the grid's coordinates) hits at distance `t`.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Ray, at: &[Located; 2], piece: Piece, t: f64) -> Hit {
        let (plan, corner) = self.plan_at(at);
        let block = self.block(plan);
        let place = self.place(at, block.strand(piece), plan, corner, piece);
        let mut surface = block.surface(piece, &ray.shifted(corner), t);
        if let YarnShape::Flat { .. } = self.shape(&place) {
            surface.normal *= -surface.normal.dot(ray.direction).signum();
        }
        Hit { t, place, surface, cut: false }
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
        at.tile as i64 * self.tile_yarns[axis] as i64 + self.first_yarn[axis][at.block] as i64
    }

    /// Whether the ray enters any yarn before `t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        let Some(clipped) = self.clip(ray, t_max) else { return false };
        let Clipped { ray, inverse, t_min, t_max, cut, .. } = clipped;
        if cut.is_some_and(|axis| self.cut_end(&ray, axis).is_some()) {
            return true;
        }
        let found = walk(&self.axes, &ray, inverse, t_max, |visit| {
            let (plan, corner) = self.visited(&visit);
            let (t_enter, t_leave) = (visit.t_enter - self.t_min, visit.t_leave + self.t_min);
            let (t_enter, t_leave) = (greater(t_enter, t_min), lesser(t_leave, t_max));
            self.block(plan).any(&ray.shifted(corner), inverse, t_enter, t_leave).then_some(())
        });
        found.is_some()
    }

    /// The stretch of the ray inside the swatch, if any. It starts there, since what a far camera
    /// sees would suffer from rounding.
    #[inline(always)]
    fn clip(&self, ray: &Ray, t_max: f64) -> Option<Clipped> {
        let ray = self.to_grid(ray);
        let inverse = ray.inverse();
        let [width, height] = self.size;
        let low = (DVec3::new(0.0, -height, self.heights[0]) - ray.origin) * inverse;
        let high = (DVec3::new(width, 0.0, self.heights[1]) - ray.origin) * inverse;
        let (enter, leave) = (lesser3(low, high), greater3(low, high));
        let start = greater(greater(enter.x, enter.y), greater(enter.z, 0.0));
        let end = lesser(lesser(leave.x, leave.y), lesser(leave.z, t_max));
        let cut = if enter.x > enter.y { 0 } else { 1 };
        (start < end).then(|| Clipped {
            ray: Ray { origin: ray.at(start), ..ray },
            inverse,
            start,
            t_min: self.t_min - start,
            t_max: end - start,
            cut: (start > 0.0 && enter[cut] == start).then_some(cut),
        })
    }

    /// Grid coordinates have their origin at the swatch's top left corner.
    #[inline]
    pub(super) fn to_grid(&self, ray: &Ray) -> Ray {
        ray.shifted(DVec3::new(-0.5 * self.size[0], 0.5 * self.size[1], 0.0))
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::spec::YarnSpec;
    use crate::weave::pattern::WeavePattern;

    fn twill() -> Swatch {
        let shape = YarnShape::round(0.4, 3, 0.18, 3.0);
        let yarns = || YarnSpec::uniform(shape, 1.0, vec![1.0; 4]);
        let warp_up = (0..16).map(|index| (index / 4 + index % 4) % 4 < 2).collect();
        let spec = ClothSpec {
            pattern: WeavePattern::new(4, 4, warp_up).unwrap(),
            warp: yarns(),
            weft: yarns(),
            collision_stiffness: 100.0,
        };
        Swatch::new(&spec, [8.0, 8.0], &Control::default()).unwrap()
    }

    /// What rays from above meet, at many places.
    fn hits(swatch: &Swatch) -> Vec<Option<(f64, DVec3, i64)>> {
        let ray = |index: u32| {
            let place = f64::from(index);
            let origin = DVec3::new(3.9 * (0.7 * place).sin(), 3.9 * (1.3 * place).cos(), 5.0);
            let direction = DVec3::new(0.2 * place.sin(), 0.3 * place.cos(), -1.0).normalize();
            Ray { origin, direction }
        };
        let hit = |hit: Hit| (hit.t, hit.surface.normal, hit.place.number());
        (0..2000).map(|index| swatch.nearest(&ray(index)).map(hit)).collect()
    }

    #[test]
    fn blocks_that_there_is_no_room_for_are_the_same() {
        let (kept, mut lent) = (twill(), twill());
        lent.blocks.limit = 0;
        let expected = hits(&kept);
        assert!(expected.iter().flatten().count() > 1000);
        assert!(hits(&lent) == expected);
    }
}
