//! A stretch of one yarn: its centre line, and the joints of its plies or the edges of its ribbon
//! (Montazeri et al. 2020, sections 3.2 and 5.1).

use glam::DVec3;

use super::spec::YarnShape;
use super::twist::Twist;
use crate::accel::bilinear::Edge;
use crate::accel::cylinder::Joint;
use crate::weave::curve::Segment;

/// Patches of a ribbon from one crossing to the next.
const PATCHES_PER_CROSSING: usize = 8;

/// Which way a yarn runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum YarnSet {
    /// Along y.
    Warp,
    /// Along x.
    Weft,
}

/// A stretch of some crossings of one yarn.
#[derive(Debug, Clone, PartialEq)]
pub struct YarnPath {
    /// Which way it runs.
    pub set: YarnSet,
    /// The number of its kind.
    pub kind: usize,
    /// Where it lies across its direction.
    pub offset: f64,
    /// Where the stretch starts along its direction.
    pub start: f64,
    /// The length of the yarn in each crossing's slot.
    pub slots: Vec<f64>,
    /// Height and slope at the knots: two per slot (its start and its middle) and one at the end.
    pub knots: Vec<(f64, f64)>,
    /// The phase of the twist at the start.
    pub phase: i64,
}

/// The centre line's local frame at some place along it.
struct Station {
    center: DVec3,
    tangent: DVec3,
    side: DVec3,
    normal: DVec3,
    /// Slots passed since the start.
    crossings: f64,
}

impl YarnPath {
    /// The same stretch where everything across the yarns of its set is narrower by `aspect`.
    pub fn narrowed(&self, aspect: f64) -> Self {
        Self { offset: self.offset / aspect, ..self.clone() }
    }

    /// The joints of each ply of a round yarn: a helix about its centre line, right-handed if the twist
    /// is positive.
    pub fn plies(&self, shape: &YarnShape, plies: usize, twist: Twist) -> Vec<Vec<Joint>> {
        let stations: Vec<_> = self.stations(twist.segments_per_crossing()).collect();
        let helix_radius = shape.helix_radius();
        let point = |station: &Station, ply: usize| {
            let (sin, cos) = twist.angle(self.phase, station.crossings, ply).sin_cos();
            station.center + helix_radius * (cos * station.side - sin * station.normal)
        };
        let points = |ply| stations.iter().map(|station| point(station, ply)).collect();
        (0..plies).map(|ply| joints(points(ply))).collect()
    }

    /// The edges of a ribbon of the given width.
    pub fn ribbon(&self, width: f64) -> Vec<Edge> {
        self.stations(PATCHES_PER_CROSSING)
            .map(|Station { center, side, normal, tangent, .. }| {
                let half = 0.5 * width * side;
                Edge { left: center - half, right: center + half, normal, tangent }
            })
            .collect()
    }

    /// Places along the yarn, `segments` (an even number) to a slot.
    fn stations(&self, segments: usize) -> impl Iterator<Item = Station> + '_ {
        let mut starts = vec![self.start];
        starts.extend(self.slots.iter().scan(self.start, |end, slot| {
            *end += slot;
            Some(*end)
        }));
        let count = self.slots.len() * segments;
        (0..=count).map(move |step| {
            let slot = (step / segments).min(self.slots.len() - 1);
            let fraction = (step - slot * segments) as f64 / segments as f64;
            self.station(slot, starts[slot], fraction)
        })
    }

    fn station(&self, slot: usize, start: f64, fraction: f64) -> Station {
        let half = usize::from(fraction > 0.5);
        let knot = 2 * slot + half;
        let length = self.slots[slot];
        let t = 2.0 * fraction - half as f64;
        let [(h0, m0), (h1, m1)] = [self.knots[knot], self.knots[knot + 1]];
        let segment = Segment { length: 0.5 * length, height: [h0, h1], slope: [m0, m1] };
        let (height, slope) = segment.eval(t);
        let along = start + fraction * length;
        let (center, direction, side) = match self.set {
            YarnSet::Warp => (DVec3::new(self.offset, along, height), DVec3::Y, DVec3::X),
            YarnSet::Weft => (DVec3::new(along, self.offset, height), DVec3::X, DVec3::NEG_Y),
        };
        let tangent = (direction + slope * DVec3::Z).normalize();
        let crossings = slot as f64 + fraction;
        Station { center, tangent, side, normal: side.cross(tangent), crossings }
    }
}

/// A ply through these points.
fn joints(points: Vec<DVec3>) -> Vec<Joint> {
    let chords: Vec<_> = points.windows(2).map(|pair| (pair[1] - pair[0]).normalize()).collect();
    let last = chords.len() - 1;
    let tangent = |i: usize| (chords[i.max(1) - 1] + chords[i.min(last)]).normalize();
    points.iter().enumerate().map(|(i, &point)| Joint { point, tangent: tangent(i) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(set: YarnSet) -> YarnPath {
        let knots = vec![(0.3, 0.0); 9];
        YarnPath { set, kind: 0, offset: 0.5, start: 0.0, slots: vec![1.0; 4], knots, phase: 0 }
    }

    #[test]
    fn plies_of_positive_pitch_turn_like_a_right_handed_screw() {
        for (set, axis) in [(YarnSet::Warp, DVec3::Y), (YarnSet::Weft, DVec3::X)] {
            for pitch in [4.0, -4.0, 0.9] {
                let shape = YarnShape::round(0.4, 2, 0.2, pitch);
                let path = straight(set);
                let middle = path.stations(2).next().unwrap().center;
                let plies = path.plies(&shape, 2, Twist::new(&shape, &[1.0]));
                let spokes: Vec<_> =
                    plies[0].iter().map(|joint| (joint.point - middle).reject_from(axis)).collect();
                for pair in spokes.windows(2) {
                    let turn = pair[0].cross(pair[1]).dot(axis);
                    assert!(turn * pitch > 0.0, "{set:?} {pitch} {turn}");
                }
            }
        }
    }
}
