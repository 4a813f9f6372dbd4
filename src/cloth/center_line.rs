//! A yarn's centre line near one of its crossings.

use crate::weave::curve::{HeightCurve, Segment};

/// Steps towards the nearest point of a centre line.
const FOOT_STEPS: usize = 3;

/// Pieces of a centre line: those of the crossing's slot, and of the slots beside it.
const PIECES: usize = 6;

/// The piece that starts at the crossing.
const CROSSING: usize = 3;

/// A centre line in its yarn's upright plane, in millimetres; places are counted from the crossing.
pub struct CenterLine {
    /// Where each piece starts.
    starts: [f64; PIECES],
    /// Heights are polynomials of the distance from a piece's start, the constant first.
    cubics: [[f64; 4]; PIECES],
}

impl CenterLine {
    /// That of slot `slot` of a curve, which has a unit of `unit` millimetres; heights are multiplied
    /// with `scale`.
    pub fn new(curve: &HeightCurve, slot: usize, unit: f64, scale: f64) -> Self {
        let knots = curve.knots.len();
        let (mut starts, mut cubics) = ([0.0; PIECES], [[0.0; 4]; PIECES]);
        let mut start = 0.0;
        for piece in 0..PIECES {
            let segment = curve.segment((2 * slot + knots * 2 + piece - 2) % knots);
            let (length, height) =
                (segment.length * unit, segment.height.map(|h| h * unit * scale));
            let slope = segment.slope.map(|slope| slope * scale);
            starts[piece] = start;
            cubics[piece] = Segment { length, height, slope }.coefficients();
            start += length;
        }
        let crossing = starts[CROSSING];
        Self { starts: starts.map(|start| start - crossing), cubics }
    }

    /// The length of the crossing's slot.
    pub fn slot(&self) -> f64 {
        self.starts[CROSSING + 1] - self.starts[CROSSING - 1]
    }

    /// Height and slope.
    pub fn at(&self, place: f64) -> (f64, f64) {
        let piece = self.piece(place);
        let (x, [a, b, c, d]) = (place - self.starts[piece], self.cubics[piece]);
        (a + x * (b + x * (c + x * d)), b + x * (2.0 * c + x * 3.0 * d))
    }

    /// The distance of a point in the yarn's upright plane.
    pub fn distance(&self, place: f64, height: f64) -> f64 {
        let (mut foot, mut nearest) = (place, f64::INFINITY);
        for _ in 0..=FOOT_STEPS {
            let (h, slope) = self.at(foot);
            let (along, up) = (place - foot, height - h);
            nearest = nearest.min(along * along + up * up);
            foot += (along + slope * up) / (1.0 + slope * slope);
        }
        nearest.sqrt()
    }

    /// The largest second derivative between two places.
    pub fn bend(&self, [from, to]: [f64; 2]) -> f64 {
        let [first, last] = [self.piece(from), self.piece(to)];
        let bend = |piece: usize, place: f64| {
            let [_, _, c, d] = self.cubics[piece];
            (2.0 * c + 6.0 * d * (place - self.starts[piece])).abs()
        };
        let joints = (first..last).map(|piece| {
            bend(piece, self.starts[piece + 1]).max(bend(piece + 1, self.starts[piece + 1]))
        });
        joints.fold(bend(first, from).max(bend(last, to)), f64::max)
    }

    fn piece(&self, place: f64) -> usize {
        self.starts[1..].iter().map(|start| usize::from(*start <= place)).sum()
    }
}
