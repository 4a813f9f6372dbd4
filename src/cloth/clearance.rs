//! Where yarns overlap: relaxation keeps their centre lines apart at the crossings alone, and yarns
//! that are too wide cut into each other beside them.
//!
//! A yarn is taken as the tube around its centre line that holds its plies (a ribbon as its sheet).
//! Points of one tube are tested for how deep they lie inside another, to first order.

use std::sync::LazyLock;

use rayon::prelude::*;
use smallvec::SmallVec;

use super::center_line::CenterLine;
use super::spec::{ClothSpec, YarnShape};
use super::yarn_path::YarnSet;
use crate::control::Control;
use crate::error::Result;
use crate::memory;
use crate::weave::pattern::WeavePattern;
use crate::weave::relax::Relaxed;

/// Places along a yarn, and around it, at which its surface is tested at a crossing.
const ALONG: usize = 13;
const AROUND: usize = 12;

/// Cosines and sines of the places around a yarn, from one edge to the other.
static AROUND_YARN: LazyLock<[[f64; 2]; AROUND]> = LazyLock::new(|| {
    let angles = fractions(AROUND).map(|f| 0.5 * std::f64::consts::PI * f);
    let turns: Vec<_> = angles.map(|angle| [angle.sin(), angle.cos()]).collect();
    turns.try_into().expect("there are as many places as asked for")
});

/// Iterations that narrow down how steep a centre line is near a point.
const STEEPNESS_STEPS: usize = 4;

/// Places in each slot at which yarns of one set are compared.
const PER_SLOT: usize = 4;

/// What depths take, and a copy of them in another order.
const BYTES_PER_CROSSING: usize = 2 * size_of::<f64>();

/// A cloth whose yarns have found their heights.
#[derive(Debug, Clone, Copy)]
pub struct Woven<'a> {
    /// The cloth, with its picks in the order of `relaxed`.
    spec: &'a ClothSpec,
    /// The heights, in the cloth's units.
    relaxed: &'a Relaxed,
    /// What heights are multiplied with.
    scale: f64,
    /// A unit of heights and places in millimetres.
    unit: f64,
    /// Half the width of the widest end and of the widest pick.
    widest: [f64; 2],
}

/// The tube around a yarn's centre line: an ellipse, or a line for a ribbon.
#[derive(Debug, Clone, Copy)]
struct Tube {
    half_width: f64,
    half_height: f64,
}

impl Tube {
    fn new(shape: &YarnShape) -> Self {
        let half_height = match *shape {
            YarnShape::Round { thickness, .. } => 0.5 * thickness,
            YarnShape::Flat { .. } => 0.0,
        };
        Self { half_width: shape.half_width(), half_height }
    }

    fn is_sheet(&self) -> bool {
        self.half_height == 0.0
    }

    /// How deep a point lies inside that is `aside` and `away` from the nearest point of the centre
    /// line: across the yarn, and perpendicular to that.
    fn depth(&self, aside: f64, away: f64) -> f64 {
        depth([self.half_width, self.half_height], [aside, away])
    }
}

/// A centre line near a crossing, and the tube around it.
type Strand<'a> = (&'a CenterLine, Tube);

/// How deep the origin-centred ellipse with these half axes holds a point, to first order; negative
/// outside.
fn depth([a, b]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    let (p, q) = (x / a, y / b);
    let radius = (p * p + q * q).sqrt();
    let (p, q) = (p / a, q / b);
    let slope = (p * p + q * q).sqrt();
    if slope > 0.0 { ((1.0 - radius) * radius / slope).min(a.min(b)) } else { a.min(b) }
}

/// How deep `upper` and `lower`, which cross, overlap, if by more than `floor`; else `floor`.
fn crossing_depth(upper: Strand, lower: Strand, floor: f64) -> f64 {
    match (upper.1.is_sheet(), lower.1.is_sheet()) {
        (true, true) => sheets_depth(upper, lower).max(floor),
        (false, true) => depth_inside(lower, upper, 1.0, floor),
        _ => depth_inside(upper, lower, -1.0, floor),
    }
}

/// How deep the surface of `yarn` reaches into `other`, which crosses it towards `side` (up: 1), if
/// by more than `floor`; else `floor`.
fn depth_inside(yarn: Strand, other: Strand, side: f64, floor: f64) -> f64 {
    let mut points = points_perhaps_inside(yarn, other, side, floor);
    let mut deepest = floor;
    // What reaches deepest at most comes first: most of the others are then ruled out.
    while let Some((next, point)) =
        points.iter().enumerate().max_by(|(_, a), (_, b)| a.at_most.total_cmp(&b.at_most))
        && point.at_most > deepest
    {
        let away = other.0.distance(point.across, point.height);
        deepest = deepest.max(other.1.depth(point.along, away));
        points.swap_remove(next);
    }
    deepest
}

/// A point of a yarn's surface, seen from the crossing.
struct Point {
    /// Its distance from the other centre line's upright plane.
    along: f64,
    /// Its place along the other centre line.
    across: f64,
    height: f64,
    /// It lies no deeper than this inside the other yarn.
    at_most: f64,
}

/// The points of the surface of `yarn` that perhaps lie deeper than `floor` inside `other`.
fn points_perhaps_inside(
    yarn: Strand,
    other: Strand,
    side: f64,
    floor: f64,
) -> SmallVec<[Point; 64]> {
    let places = AROUND_YARN.map(|[cos, sin]| {
        let across = cos * yarn.1.half_width;
        let (height, stretch) = height_and_stretch(other, across);
        (across, side * yarn.1.half_height * sin, height, 1.0 / stretch)
    });
    let mut points = SmallVec::new();
    for u in fractions(ALONG).map(|f| f * other.1.half_width) {
        let (h, slope) = yarn.0.at(u);
        let shrink = 1.0 / (1.0 + slope * slope).sqrt();
        for (across, out, below, shorter) in places {
            // From the centre line along its normal and across.
            let out = out * shrink;
            let [along, height] = [u - out * slope, h + out];
            let away = (height - below).abs() * shorter;
            if away < other.1.half_height {
                let at_most = other.1.depth(along, away);
                if at_most > floor {
                    points.push(Point { along, across, height, at_most });
                }
            }
        }
    }
    points
}

/// The height of a centre line at a place, and what a point inside the yarn there is at most nearer to
/// the line than to that height.
///
/// The line is nearest at most the sine of its slope there times the half height from the place.
fn height_and_stretch((line, tube): Strand, place: f64) -> (f64, f64) {
    let reach = tube.half_height;
    let (height, slope) = line.at(place);
    let bend = line.bend([place - reach, place + reach]);
    let (mut foot, mut stretch) = (reach, 1.0);
    for _ in 0..STEEPNESS_STEPS {
        let steepest = slope.abs() + bend * foot;
        stretch = (1.0 + steepest * steepest).sqrt();
        foot = reach * steepest / stretch;
    }
    (height, stretch)
}

/// How far one sheet passes through another that should be below it.
fn sheets_depth(upper: Strand, lower: Strand) -> f64 {
    let extreme = |(line, _): Strand, half_width: f64, sign: f64| {
        let heights = fractions(ALONG).map(|f| sign * line.at(f * half_width).0);
        heights.fold(f64::NEG_INFINITY, f64::max)
    };
    extreme(lower, upper.1.half_width, 1.0) + extreme(upper, lower.1.half_width, -1.0)
}

/// Numbers from -1 to 1.
fn fractions(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| 2.0 * i as f64 / (count - 1) as f64 - 1.0)
}

impl<'a> Woven<'a> {
    /// A cloth and its heights, which are multiplied with `scale`.
    pub fn new(spec: &'a ClothSpec, relaxed: &'a Relaxed, scale: f64) -> Self {
        let widest = [&spec.warp, &spec.weft].map(|yarns| yarns.greatest(YarnShape::half_width));
        Self { spec, relaxed, scale, unit: spec.unit(), widest }
    }

    /// How deep yarns overlap at each crossing in millimetres, 0 where they do by no more than `floor`
    /// (at least 0): picks x ends.
    ///
    /// A crossing counts the overlap of its two yarns there, and that of each with its next
    /// neighbours of the same set over the crossing's slot. The cost is linear in the crossings.
    /// [`Error::OutOfMemory`](crate::error::Error::OutOfMemory) if there is no room for the depths.
    pub fn overlaps(&self, floor: f64, control: &Control) -> Result<Vec<f64>> {
        let WeavePattern { picks, ends, ref warp_up } = self.spec.pattern;
        let work = format!("finding the overlaps of {picks} picks x {ends} ends");
        memory::claim(&work, warp_up.len().saturating_mul(BYTES_PER_CROSSING))?;
        let mut depths = vec![0.0; warp_up.len()];
        depths.par_chunks_mut(ends).enumerate().try_for_each(|(pick, row)| {
            control.check()?;
            for (end, depth) in row.iter_mut().enumerate() {
                let found = self.at(pick, end, floor);
                *depth = if found > floor { found } else { 0.0 };
            }
            Ok(())
        })?;
        Ok(depths)
    }

    /// Whether none of these crossings (pick x ends + end) has an overlap of more than `tolerance`.
    pub fn is_clear(
        &self,
        crossings: impl IntoParallelIterator<Item = usize>,
        tolerance: f64,
        control: &Control,
    ) -> Result<bool> {
        let ends = self.spec.pattern.ends;
        let overlapping = crossings.into_par_iter().any(|crossing| {
            let [pick, end] = [crossing / ends, crossing % ends];
            control.stopped() || self.at(pick, end, tolerance) > tolerance
        });
        control.check()?;
        Ok(!overlapping)
    }

    /// How deep yarns overlap at a crossing, if by more than `floor`; else `floor`.
    fn at(&self, pick: usize, end: usize, floor: f64) -> f64 {
        let warp = self.line(YarnSet::Warp, end, pick);
        let weft = self.line(YarnSet::Weft, pick, end);
        let beside = self.beside(YarnSet::Warp, end, pick, &warp);
        let beside = self.beside(YarnSet::Weft, pick, end, &weft).max(beside).max(floor);
        let warp = (&warp, Tube::new(&self.spec.warp.kind(end).shape));
        let weft = (&weft, Tube::new(&self.spec.weft.kind(pick).shape));
        if self.spec.pattern.is_warp_up(pick, end) {
            crossing_depth(warp, weft, beside)
        } else {
            crossing_depth(weft, warp, beside)
        }
    }

    fn line(&self, set: YarnSet, yarn: usize, slot: usize) -> CenterLine {
        let curves = match set {
            YarnSet::Warp => &self.relaxed.warp,
            YarnSet::Weft => &self.relaxed.weft,
        };
        CenterLine::new(&curves.yarn(yarn), slot, self.unit, self.scale)
    }

    /// How deep a yarn overlaps with the next ones of its set over a slot, where it is `here`.
    fn beside(&self, set: YarnSet, yarn: usize, slot: usize, here: &CenterLine) -> f64 {
        let own = match set {
            YarnSet::Warp => &self.spec.warp,
            YarnSet::Weft => &self.spec.weft,
        };
        let (widest, count) = (self.widest[set as usize], own.spacing.len());
        let shape = &own.kind(yarn).shape;
        let (mut deepest, mut distance, mut next) = (0.0f64, 0.0, yarn);
        loop {
            distance += 0.5 * own.spacing[next];
            next = (next + 1) % count;
            distance += 0.5 * own.spacing[next];
            if distance >= shape.half_width() + widest {
                return deepest;
            }
            let other = &own.kind(next).shape;
            let width = shape.half_width() + other.half_width();
            if distance >= width {
                continue;
            }
            // A ribbon's sheet has no height: its thickness keeps it from its neighbours.
            let height = 0.5 * shape.thickness() + 0.5 * other.thickness();
            let there = self.line(set, next, slot);
            for place in fractions(PER_SLOT + 1).map(|f| 0.5 * f * here.slot()) {
                let ((h, slope), (other, _)) = (here.at(place), there.at(place));
                let axes = [width, height * slope.hypot(1.0)];
                deepest = deepest.max(depth(axes, [distance, h - other]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Sampler;
    use crate::weave::curve::HeightCurve;

    /// A curve over three slots of a millimetre, with heights and slopes up to these around `base`.
    fn line(sampler: &mut Sampler, base: f64, height: f64, slope: f64) -> CenterLine {
        let mut values = |base, most| [0; 6].map(|_| base + most * (2.0 * sampler.next_1d() - 1.0));
        let (height, slope) = (&values(base, height), &values(0.0, slope));
        let knots = &[0.0, 0.5, 1.0, 1.5, 2.0, 2.5];
        CenterLine::new(&HeightCurve { knots, period: 3.0, height, slope }, 1, 1.0, 1.0)
    }

    /// The deepest of all points, none ruled out.
    fn deepest(yarn: Strand, other: Strand, side: f64) -> f64 {
        let mut deepest = 0.0f64;
        for u in fractions(ALONG).map(|f| f * other.1.half_width) {
            let (h, slope) = yarn.0.at(u);
            for [cos, sin] in *AROUND_YARN {
                let out = side * yarn.1.half_height * sin / slope.hypot(1.0);
                let away = other.0.distance(cos * yarn.1.half_width, h + out);
                deepest = deepest.max(other.1.depth(u - out * slope, away));
            }
        }
        deepest
    }

    #[test]
    fn no_point_that_lies_deepest_is_ruled_out() {
        let mut sampler = Sampler::new(1, 2, 3);
        let mut overlapping = 0;
        for case in 0..4000 {
            let (height, slope) = [(0.3, 0.5), (0.6, 2.0)][case % 2];
            let side = [-1.0, 1.0][case / 2 % 2];
            let bases = [-side * sampler.next_1d(), 0.0];
            let lines = bases.map(|base| line(&mut sampler, base, height, slope));
            let tubes = [0, 1].map(|_| {
                let half_width = 0.1 + 0.6 * sampler.next_1d();
                Tube { half_width, half_height: half_width * (0.2 + 0.8 * sampler.next_1d()) }
            });
            let (yarn, other) = ((&lines[0], tubes[0]), (&lines[1], tubes[1]));
            let expected = deepest(yarn, other, side);
            overlapping += usize::from(expected > 0.0);
            for floor in [0.0, 0.5 * expected, 0.99 * expected, 0.1] {
                let depth = depth_inside(yarn, other, side, floor);
                assert!((depth - expected.max(floor)).abs() < 1e-12, "{depth} {expected}");
            }
        }
        assert!((500..3500).contains(&overlapping), "{overlapping}");
    }
}
