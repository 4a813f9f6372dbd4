//! Where yarns overlap: relaxation keeps their centre lines apart at the crossings alone, and yarns
//! that are too wide cut into each other beside them.
//!
//! A yarn is taken as the tube around its centre line that holds its plies (a ribbon as its sheet).
//! Points of one tube are tested for how deep they lie inside another, to first order.

use rayon::prelude::*;

use super::spec::{ClothSpec, YarnShape};
use super::yarn_path::YarnSet;
use crate::control::Control;
use crate::error::Result;
use crate::weave::curve::{HeightCurve, Segment};
use crate::weave::relax::Relaxed;

/// Places along a yarn, and around it, at which its surface is tested at a crossing.
const ALONG: usize = 13;
const AROUND: usize = 12;

/// Steps towards the nearest point of a centre line.
const FOOT_STEPS: usize = 3;

/// Places in each slot at which yarns of one set are compared.
const PER_SLOT: usize = 4;

/// A cloth whose yarns have found their heights.
#[derive(Debug, Clone, Copy)]
pub struct Woven<'a> {
    /// The cloth, with its picks in the order of `relaxed`.
    pub spec: &'a ClothSpec,
    /// The heights, in the cloth's units.
    pub relaxed: &'a Relaxed,
    /// What heights are multiplied with.
    pub scale: f64,
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
        Self { half_width: half_width(shape), half_height }
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

/// How deep the origin-centred ellipse with these half axes holds a point, to first order; negative
/// outside.
fn depth([a, b]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    let radius = (x / a).hypot(y / b);
    let slope = (x / (a * a)).hypot(y / (b * b));
    if slope > 0.0 { ((1.0 - radius) * radius / slope).min(a.min(b)) } else { a.min(b) }
}

/// Half of a yarn's extent in the plane of the cloth.
pub(super) fn half_width(shape: &YarnShape) -> f64 {
    match *shape {
        YarnShape::Round { radius, .. } => radius,
        YarnShape::Flat { width, .. } => 0.5 * width,
    }
}

/// A centre line near one of its crossings, in millimetres; places are counted from the crossing.
struct Line {
    /// Where each piece starts, and the piece.
    pieces: [(f64, Segment); 6],
}

impl Line {
    /// That of slot `slot` of a curve, and of the slots beside it.
    fn new(curve: &HeightCurve, slot: usize, unit: f64, scale: f64) -> Self {
        let knots = curve.knots.len();
        let mut start = 0.0;
        let mut pieces = [0, 1, 2, 3, 4, 5].map(|piece| {
            let Segment { length, height, slope } =
                curve.segment((2 * slot + knots * 2 + piece - 2) % knots);
            let from = start;
            start += length * unit;
            let height = height.map(|h| h * unit * scale);
            (from, Segment { length: length * unit, height, slope: slope.map(|m| m * scale) })
        });
        let crossing = pieces[3].0;
        pieces.iter_mut().for_each(|(start, _)| *start -= crossing);
        Self { pieces }
    }

    /// Height and slope.
    fn at(&self, place: f64) -> (f64, f64) {
        let after = self.pieces[1..].iter().take_while(|(start, _)| *start <= place).count();
        let (start, segment) = &self.pieces[after];
        segment.eval((place - start) / segment.length)
    }

    /// The distance of a point in the yarn's upright plane.
    fn distance(&self, place: f64, height: f64) -> f64 {
        let (mut foot, mut nearest) = (place, f64::INFINITY);
        for _ in 0..=FOOT_STEPS {
            let (h, slope) = self.at(foot);
            let (along, up) = (place - foot, height - h);
            nearest = nearest.min(along.hypot(up));
            foot += (along + slope * up) / (1.0 + slope * slope);
        }
        nearest
    }
}

/// How deep `upper` and `lower`, which cross, overlap; not less than 0.
fn crossing_depth(upper: (&Line, Tube), lower: (&Line, Tube)) -> f64 {
    let depth = match (upper.1.is_sheet(), lower.1.is_sheet()) {
        (true, true) => sheets_depth(upper, lower),
        (false, true) => depth_inside(lower, upper, 1.0),
        _ => depth_inside(upper, lower, -1.0),
    };
    depth.max(0.0)
}

/// How deep the surface of `yarn` reaches into `other`, which crosses it towards `side` (up: 1).
fn depth_inside(yarn: (&Line, Tube), other: (&Line, Tube), side: f64) -> f64 {
    let mut deepest = f64::NEG_INFINITY;
    for u in fractions(ALONG).map(|f| f * other.1.half_width) {
        let (h, slope) = yarn.0.at(u);
        let length = slope.hypot(1.0);
        for cos in fractions(AROUND).map(|f| (0.5 * std::f64::consts::PI * f).sin()) {
            // From the centre line along its normal and across.
            let out = side * yarn.1.half_height * (1.0 - cos * cos).sqrt() / length;
            let [along, across, height] = [u - out * slope, cos * yarn.1.half_width, h + out];
            deepest = deepest.max(other.1.depth(along, other.0.distance(across, height)));
        }
    }
    deepest
}

/// How far one sheet passes through another that should be below it.
fn sheets_depth(upper: (&Line, Tube), lower: (&Line, Tube)) -> f64 {
    let extreme = |(line, _): (&Line, Tube), half_width: f64, sign: f64| {
        let heights = fractions(ALONG).map(|f| sign * line.at(f * half_width).0);
        heights.fold(f64::NEG_INFINITY, f64::max)
    };
    extreme(lower, upper.1.half_width, 1.0) + extreme(upper, lower.1.half_width, -1.0)
}

/// Numbers from -1 to 1.
fn fractions(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| 2.0 * i as f64 / (count - 1) as f64 - 1.0)
}

impl Woven<'_> {
    /// How deep yarns overlap at each crossing in millimetres, 0 where they do not: picks x ends.
    ///
    /// A crossing counts the overlap of its two yarns there, and that of each with its next
    /// neighbours of the same set over the crossing's slot. The cost is linear in the crossings.
    pub fn overlaps(&self, control: &Control) -> Result<Vec<f64>> {
        let ends = self.spec.pattern.ends;
        let mut depths = vec![0.0; self.spec.pattern.warp_up.len()];
        depths.par_chunks_mut(ends).enumerate().try_for_each(|(pick, row)| {
            control.check()?;
            for (end, depth) in row.iter_mut().enumerate() {
                *depth = self.at(pick, end);
            }
            Ok(())
        })?;
        Ok(depths)
    }

    /// Whether no crossing has an overlap of more than `tolerance`.
    pub fn is_clear(&self, tolerance: f64, control: &Control) -> Result<bool> {
        let ends = self.spec.pattern.ends;
        let overlapping = (0..self.spec.pattern.warp_up.len()).into_par_iter().any(|crossing| {
            control.stopped() || self.at(crossing / ends, crossing % ends) > tolerance
        });
        control.check()?;
        Ok(!overlapping)
    }

    fn at(&self, pick: usize, end: usize) -> f64 {
        let beside = self.beside(YarnSet::Warp, end, pick);
        self.crossing(pick, end).max(beside).max(self.beside(YarnSet::Weft, pick, end))
    }

    fn crossing(&self, pick: usize, end: usize) -> f64 {
        let unit = self.spec.unit();
        let warp = Line::new(&self.relaxed.warp[end], pick, unit, self.scale);
        let weft = Line::new(&self.relaxed.weft[pick], end, unit, self.scale);
        let warp = (&warp, Tube::new(&self.spec.warp.shape));
        let weft = (&weft, Tube::new(&self.spec.weft.shape));
        if self.spec.pattern.is_warp_up(pick, end) {
            crossing_depth(warp, weft)
        } else {
            crossing_depth(weft, warp)
        }
    }

    /// How deep a yarn overlaps with the next ones of its set over a slot.
    fn beside(&self, set: YarnSet, yarn: usize, slot: usize) -> f64 {
        let (own, curves) = match set {
            YarnSet::Warp => (&self.spec.warp, &self.relaxed.warp),
            YarnSet::Weft => (&self.spec.weft, &self.relaxed.weft),
        };
        let (half_width, count) = (half_width(&own.shape), own.spacing.len());
        // A ribbon's sheet has no height: its thickness keeps it from its neighbours.
        let half_height = match own.shape {
            YarnShape::Round { thickness, .. } | YarnShape::Flat { thickness, .. } => {
                0.5 * thickness
            }
        };
        let unit = self.spec.unit();
        let line = |yarn: usize| Line::new(&curves[yarn], slot, unit, self.scale);
        let (mut deepest, mut distance, mut next) = (0.0f64, 0.0, yarn);
        loop {
            distance += 0.5 * own.spacing[next];
            next = (next + 1) % count;
            distance += 0.5 * own.spacing[next];
            if distance >= 2.0 * half_width {
                return deepest;
            }
            let (here, there) = (line(yarn), line(next));
            let length = here.pieces[2].1.length + here.pieces[3].1.length;
            for place in fractions(PER_SLOT + 1).map(|f| 0.5 * f * length) {
                let ((h, slope), (other, _)) = (here.at(place), there.at(place));
                let axes = [2.0 * half_width, 2.0 * half_height * slope.hypot(1.0)];
                deepest = deepest.max(depth(axes, [distance, h - other]));
            }
        }
    }
}
