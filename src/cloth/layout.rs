//! The layout of a cloth: one tile of blocks, each with the plan of its yarns.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::{BlockPlan, YarnForms};
use super::grid::Axis;
use super::spec::{ClothSpec, YarnShape};
use super::twist::{Twist, common_multiple};
use super::yarn_path::{YarnPath, YarnSet};
use crate::weave::curve::HeightCurves;
use crate::weave::relax::Relaxed;

/// Ends and picks in a block: small blocks are traced fastest.
const BLOCK_CROSSINGS: usize = 2;

/// Heights and slopes are rounded to this part of the mean spacing (of one), so that blocks that look
/// the same compare equal: relaxation lets the yarns of a large pattern drift by less than shows.
const COARSEST_QUANTUM: f64 = 1.0 / 1024.0;

/// At most this part of the thinner yarns' collision radius is rounded away: they stay in order.
const QUANTUM_OF_RADIUS: f64 = 1.0 / 16.0;

/// Heights are no larger numbers than what is exact in double precision.
const FINEST_QUANTUM: f64 = 1.0 / (1u64 << 50) as f64;

/// One direction of yarns over the tile.
#[derive(Debug)]
struct YarnLayout {
    /// The number of each yarn's kind.
    kind_of: Vec<u32>,
    /// The width of each yarn's slot.
    spacing: Vec<f64>,
    /// Yarns in the tile.
    count: usize,
    /// Yarns beyond a block's edge that may reach into it.
    neighbours: i64,
}

/// A block of the tile.
pub struct Placed {
    /// Equal for blocks whose plans are.
    pub key: Vec<i64>,
    /// The plan.
    pub plan: BlockPlan,
    /// The height at which the plan's zero lies.
    pub height: f64,
}

/// The tile: the pattern, repeated until twists repeat too, but no larger than the swatch needs.
#[derive(Debug)]
pub struct Layout {
    sets: [YarnLayout; 2],
    relaxed: Arc<Relaxed>,
    /// The shapes of its yarns.
    pub forms: YarnForms,
    /// The rounding of heights, relative to the mean spacing, and of slopes.
    quantum: f64,
    unit: f64,
}

impl Layout {
    /// The tile of a cloth whose yarns have the given heights, for a swatch of `size`.
    pub fn new(spec: &ClothSpec, relaxed: Arc<Relaxed>, size: [f64; 2]) -> Self {
        let unit = spec.unit();
        let yarns = [&spec.warp, &spec.weft];
        let radii = yarns.map(|set| set.least(YarnShape::collision_radius) / unit);
        let quantum = quantum(radii[0].min(radii[1]));
        let twists = [0, 1].map(|axis| {
            let shapes: Vec<_> = yarns[axis].shapes().copied().collect();
            Twist::together(&shapes, &yarns[1 - axis].spacing)
        });
        let sets = [0, 1].map(|axis| {
            let spec = yarns[axis];
            let period = spec.spacing.len();
            let repeats = twists[1 - axis].iter().map(|twist| twist.repeats(period));
            let whole = period * repeats.fold(1, common_multiple);
            let needed = (size[axis] / spec.spacing.iter().sum::<f64>()).ceil() as usize * period;
            let reach = spec.greatest(YarnShape::reach);
            YarnLayout {
                kind_of: spec.kind_of.clone(),
                spacing: spec.spacing.clone(),
                count: needed.min(whole),
                neighbours: (reach / min(&spec.spacing)).ceil() as i64,
            }
        });
        let forms = [0, 1].map(|axis| {
            let shapes = yarns[axis].shapes().copied();
            shapes.zip(twists[axis].iter().copied()).collect()
        });
        let forms = YarnForms(forms);
        Self { sets, relaxed, forms, quantum, unit }
    }

    /// The edges of its blocks along x and y.
    pub fn axes(&self) -> [Axis; 2] {
        [0, 1].map(|axis| {
            let set = &self.sets[axis];
            Axis::new(self.starts(axis).map(|first| {
                let last = (first + BLOCK_CROSSINGS).min(set.count);
                (first..last).map(|yarn| set.spacing(yarn as i64)).sum::<f64>()
            }))
        })
    }

    fn starts(&self, axis: usize) -> impl Iterator<Item = usize> {
        (0..self.sets[axis].count).step_by(BLOCK_CROSSINGS)
    }

    /// The first end (or pick) of each column (or row) of blocks.
    pub fn first_yarns(&self, axis: usize) -> Vec<usize> {
        self.starts(axis).collect()
    }

    /// Ends and picks in the tile.
    pub fn counts(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.sets[axis].count)
    }

    /// No block has more different kinds of yarns near it.
    pub fn most_kinds_near(&self) -> usize {
        let near = |set: &YarnLayout| BLOCK_CROSSINGS + 2 * set.neighbours as usize;
        self.sets.iter().zip(&self.forms.0).map(|(set, kinds)| near(set).min(kinds.len())).sum()
    }

    /// The shape of one of the pattern's ends or picks.
    #[inline]
    pub fn shape(&self, set: YarnSet, yarn: usize) -> &YarnShape {
        let kind = self.sets[set as usize].kind_of[yarn];
        &self.forms.0[set as usize][kind as usize].0
    }

    /// The lowest and highest of all knots.
    pub fn height_range(&self) -> [f64; 2] {
        let heights = self.relaxed.warp.height.par_iter().chain(&self.relaxed.weft.height);
        let wider = |[low, high]: [f64; 2], [l, h]: [f64; 2]| [low.min(l), high.max(h)];
        let range = heights.map(|&h| [h, h]).reduce(|| [0.0; 2], wider);
        range.map(|h| self.height(self.rounded(h)))
    }

    /// The plan of a block, a key that equal plans share, and the height that the plan is seen from:
    /// that of a knot in it, since cloth rises and falls over many blocks.
    pub fn block(&self, block: [usize; 2]) -> Placed {
        let ranges = [0, 1].map(|axis| {
            let first = block[axis] * BLOCK_CROSSINGS;
            [first as i64, (first + BLOCK_CROSSINGS).min(self.sets[axis].count) as i64]
        });
        let size = [0, 1].map(|axis| {
            (ranges[axis][0]..ranges[axis][1]).map(|yarn| self.sets[axis].spacing(yarn)).sum()
        });
        let [ends, picks] = &self.sets;
        let (end, pick) = (ends.index(ranges[0][0]), picks.index(ranges[1][0]));
        let base = self.rounded(self.relaxed.warp.yarn(end).height[2 * pick]);
        let mut key = vec![ranges[0][1] - ranges[0][0], ranges[1][1] - ranges[1][0]];
        let mut yarns = Vec::new();
        for (axis, direction) in [(0, YarnSet::Warp), (1, YarnSet::Weft)] {
            let [first, last] = ranges[axis];
            let around = self.sets[axis].neighbours;
            for yarn in first - around..last + around {
                let offset = self.sets[axis].offset(first, yarn);
                let path = self.path(direction, yarn, offset, base, ranges[1 - axis], &mut key);
                yarns.push(((yarn - first) as i32, path));
            }
        }
        Placed { key, plan: BlockPlan { size, yarns }, height: self.height(base) }
    }

    /// The stretch of a yarn past a block; what it depends on is added to `key`.
    fn path(
        &self,
        direction: YarnSet,
        yarn: i64,
        offset: f64,
        base: i64,
        [first, last]: [i64; 2],
        key: &mut Vec<i64>,
    ) -> YarnPath {
        let (set, other) = (&self.sets[direction as usize], &self.sets[1 - direction as usize]);
        let kind = set.kind_of[set.index(yarn)] as usize;
        let (shape, twist) = &self.forms.0[direction as usize][kind];
        let margin = margin(shape, min(&other.spacing));
        let crossings = first - margin..last + margin;
        let slots: Vec<f64> = crossings.clone().map(|crossing| other.spacing(crossing)).collect();
        let curve = self.curves(direction).yarn(set.index(yarn));
        let knot = |index: usize| {
            let index = index % curve.knots.len();
            [self.rounded(curve.height[index]) - base, self.rounded(curve.slope[index])]
        };
        let indices = crossings.clone().flat_map(|crossing| {
            let slot = 2 * other.index(crossing);
            [slot, slot + 1]
        });
        let end = 2 * other.index(crossings.end);
        let knots: Vec<[i64; 2]> = indices.chain([end]).map(knot).collect();
        let phase = twist.phase(crossings.start);
        key.extend([kind as i64, phase, offset.to_bits() as i64]);
        key.extend(slots.iter().map(|slot| slot.to_bits() as i64));
        key.extend(knots.iter().flatten());
        let real = |[height, slope]: [i64; 2]| (self.height(height), slope as f64 * self.quantum);
        let start = -slots[..margin as usize].iter().sum::<f64>();
        let knots = knots.into_iter().map(real).collect();
        YarnPath { set: direction, kind, offset, start, slots, knots, phase }
    }

    fn curves(&self, set: YarnSet) -> &HeightCurves {
        match set {
            YarnSet::Warp => &self.relaxed.warp,
            YarnSet::Weft => &self.relaxed.weft,
        }
    }

    /// A relaxed height or slope in quanta.
    fn rounded(&self, value: f64) -> i64 {
        (value / self.quantum).round() as i64
    }

    /// Quanta of height in millimetres.
    fn height(&self, quanta: i64) -> f64 {
        quanta as f64 * self.quantum * self.unit
    }
}

impl YarnLayout {
    /// The yarn of the pattern that is number `yarn` of the tile.
    fn index(&self, yarn: i64) -> usize {
        yarn.rem_euclid(self.spacing.len() as i64) as usize
    }

    fn spacing(&self, yarn: i64) -> f64 {
        self.spacing[self.index(yarn)]
    }

    /// Where the centre of `yarn` lies, seen from the start of yarn `first`'s slot.
    fn offset(&self, first: i64, yarn: i64) -> f64 {
        let between: f64 = if yarn >= first {
            (first..yarn).map(|i| self.spacing(i)).sum()
        } else {
            -(yarn..first).map(|i| self.spacing(i)).sum::<f64>()
        };
        between + 0.5 * self.spacing(yarn)
    }
}

/// Crossings to store of a yarn beyond a block's edges: enough to follow most rays out of a ply.
fn margin(shape: &YarnShape, crossing: f64) -> i64 {
    (3.0 * shape.reach() / crossing).ceil().max(1.0) as i64
}

/// The rounding for yarns of at least the given collision radius (of a mean spacing of one): a power
/// of two.
fn quantum(radius: f64) -> f64 {
    let wanted = (QUANTUM_OF_RADIUS * radius).max(FINEST_QUANTUM);
    COARSEST_QUANTUM.min(wanted.log2().floor().exp2())
}

fn min(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}
