//! Cross sections with which the yarns of a cloth do not cut into each other: they are pressed oval,
//! and where that is not enough they shrink.

use rayon::prelude::*;

use super::clearance::Woven;
use super::spec::{ClothSpec, YarnShape, YarnSpec};
use crate::control::Control;
use crate::error::Result;
use crate::weave::relax::{Relaxed, relax, relax_near};

/// An overlap of less than this part of the thinner yarn's thickness does not show.
pub const TOLERANCE: f64 = 0.02;

/// What a search aims at, since the relaxation that follows it differs a little.
const AIM: f64 = 0.95 * TOLERANCE;

/// Pressed yarns are at most this many times wider than high, unless they were before.
const MAX_ASPECT: f64 = 3.0;

/// Halvings of the range of aspects, or of sizes.
const HALVINGS: usize = 7;

/// The least size that is tried.
const LEAST_SIZE: f64 = 1.0 / 64.0;

/// Relaxations, of which each begins with what the last has led to.
const ROUNDS: usize = 3;

/// Crossings that a search looks at first, and how many it adds each time that others overlap.
const WATCHED: usize = 256;

/// The cloth with yarns that are as wide as the given ones as far as their neighbours leave room, and
/// as round as fits, and whether none overlap; [`TOLERANCE`] says what counts. Yarns of one kind stay of
/// one. Where no size helps, such as of ribbons whose neighbours lie at other heights, they stay as they
/// are.
///
/// With a stiff contact heights are proportional to how far the yarns keep from each other: a search
/// needs one relaxation, and a short one to confirm it.
pub fn fitted(spec: &ClothSpec, control: &Control) -> Result<(ClothSpec, bool)> {
    let mut spec = spec.clone();
    for yarns in [&mut spec.warp, &mut spec.weft] {
        cap(yarns);
    }
    let mut relaxed = relax(&spec.relax_problem(), control)?;
    for round in 1..=ROUNDS {
        let search = Search { spec: &spec, relaxed: &relaxed, control };
        if search.is_clear(0..spec.pattern.warp_up.len(), UNCHANGED, TOLERANCE)? {
            break;
        }
        let Some(change) = search.run()? else { return Ok((spec, false)) };
        let next = changed(&spec, change);
        if round < ROUNDS {
            let scale = next.contact() / spec.contact();
            relaxed = relax_near(&next.relax_problem(), &relaxed, scale, control)?;
        }
        spec = next;
    }
    Ok((spec, true))
}

/// What is done to all yarns: see [`other`].
#[derive(Debug, Clone, Copy)]
struct Change {
    size: f64,
    press: f64,
    /// A factor on the width of ribbons.
    ribbon: f64,
}

const UNCHANGED: Change = Change { size: 1.0, press: 0.0, ribbon: 1.0 };

/// The search for the least change of a relaxed cloth that leaves no overlaps.
struct Search<'a> {
    spec: &'a ClothSpec,
    relaxed: &'a Relaxed,
    control: &'a Control,
}

impl Search<'_> {
    /// Few crossings decide: the search is one among these, and those are added that it leaves
    /// overlapping.
    fn run(&self) -> Result<Option<Change>> {
        let count = self.spec.pattern.warp_up.len();
        let mut watched: Vec<_> = (0..count).step_by(count.div_ceil(WATCHED)).collect();
        loop {
            let Some(change) = self.among(&watched)? else { return Ok(None) };
            let overlapping = self.overlapping(change)?;
            if overlapping.is_empty() {
                return Ok(Some(change));
            }
            watched.extend(&overlapping[..overlapping.len().min(WATCHED)]);
        }
    }

    /// The least change that clears these crossings, if one does.
    fn among(&self, crossings: &[usize]) -> Result<Option<Change>> {
        let clear = |change| self.is_clear(crossings.par_iter().copied(), change, AIM);
        let pressed = |press| Change { press, ..UNCHANGED };
        if clear(pressed(1.0))? {
            return Ok(Some(pressed(bisected([1.0, 0.0], |press| clear(pressed(press)))?)));
        }
        let smaller = |size| Change { size, ..pressed(1.0) };
        if clear(smaller(LEAST_SIZE))? {
            return Ok(Some(smaller(bisected([LEAST_SIZE, 1.0], |size| clear(smaller(size)))?)));
        }
        if ![&self.spec.warp, &self.spec.weft].iter().any(|yarns| yarns.mixes_ribbons()) {
            return Ok(None);
        }
        // Beside a thicker yarn what crosses a ribbon comes down too steeply at its edge, however
        // small all heights are.
        let narrower = |size| Change { ribbon: size, ..smaller(size) };
        if !clear(narrower(LEAST_SIZE))? {
            return Ok(None);
        }
        Ok(Some(narrower(bisected([LEAST_SIZE, 1.0], |size| clear(narrower(size)))?)))
    }

    fn is_clear(
        &self,
        crossings: impl IntoParallelIterator<Item = usize>,
        change: Change,
        tolerance: f64,
    ) -> Result<bool> {
        let tried = changed(self.spec, change);
        self.woven(&tried).is_clear(crossings, tolerance * tried.thinnest(), self.control)
    }

    /// The crossings that overlap after a change, the deepest overlap first.
    fn overlapping(&self, change: Change) -> Result<Vec<usize>> {
        let tried = changed(self.spec, change);
        let depths = self.woven(&tried).overlaps(AIM * tried.thinnest(), self.control)?;
        let mut crossings: Vec<_> = (0..depths.len()).filter(|&i| depths[i] > 0.0).collect();
        crossings.sort_by(|&a, &b| depths[b].total_cmp(&depths[a]));
        Ok(crossings)
    }

    /// The cloth with other yarns, before it is relaxed again.
    fn woven<'a>(&'a self, tried: &'a ClothSpec) -> Woven<'a> {
        Woven::new(tried, self.relaxed, tried.contact() / self.spec.contact())
    }
}

/// A value that holds, close to one that does not; the range is from the first to the second.
fn bisected([mut good, mut bad]: [f64; 2], holds: impl Fn(f64) -> Result<bool>) -> Result<f64> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        *(if holds(middle)? { &mut good } else { &mut bad }) = middle;
    }
    Ok(good)
}

/// Narrows yarns that are wider than their neighbours leave room for: of two that would meet, both by
/// the same factor.
fn cap(yarns: &mut YarnSpec) {
    let count = yarns.spacing.len();
    let mut room = vec![1.0f64; yarns.kinds.len()];
    for yarn in 0..count {
        let next = (yarn + 1) % count;
        let distance = 0.5 * (yarns.spacing[yarn] + yarns.spacing[next]);
        let pair = [yarn, next].map(|yarn| yarns.kind_of[yarn] as usize);
        let [a, b] = pair.map(|kind| yarns.kinds[kind].shape.half_width());
        for kind in pair {
            room[kind] = room[kind].min(distance / (a + b));
        }
    }
    for (kind, narrower) in yarns.kinds.iter_mut().zip(room) {
        kind.shape = narrowed(&kind.shape, narrower);
    }
}

/// The shape, narrower by a factor, and no higher than wide.
fn narrowed(shape: &YarnShape, narrower: f64) -> YarnShape {
    match *shape {
        YarnShape::Round { thickness, collision, plies, ply_radius, pitch, radius } => {
            let radius = narrower * radius;
            let thickness = thickness.min(2.0 * radius);
            let collision = collision.min(radius);
            let ply_radius = narrower * ply_radius;
            YarnShape::Round { radius, thickness, collision, plies, ply_radius, pitch }
        }
        YarnShape::Flat { width, thickness } => {
            YarnShape::Flat { width: narrower * width, thickness }
        }
    }
}

/// The cloth with other yarns: see [`other`].
fn changed(spec: &ClothSpec, change: Change) -> ClothSpec {
    let mut changed = spec.clone();
    for kind in changed.warp.kinds.iter_mut().chain(&mut changed.weft.kinds) {
        kind.shape = other(&kind.shape, change);
    }
    changed
}

/// The shape with another size, on the way from its own thickness (`press` = 0) to the least (1).
///
/// A pressed yarn keeps half of the room at a crossing that it no longer fills: two wide yarns that
/// touched there would cut into each other beside it.
fn other(shape: &YarnShape, Change { size, press, ribbon }: Change) -> YarnShape {
    match *shape {
        YarnShape::Round { radius, thickness, collision, plies, ply_radius, pitch } => {
            let thinner = press * (thickness - 2.0 * radius / MAX_ASPECT).max(0.0);
            YarnShape::Round {
                radius: size * radius,
                thickness: size * (thickness - thinner),
                collision: size * (collision - 0.25 * thinner),
                plies,
                ply_radius: size * ply_radius,
                pitch,
            }
        }
        YarnShape::Flat { width, thickness } => {
            YarnShape::Flat { width: ribbon * width, thickness: size * thickness }
        }
    }
}
