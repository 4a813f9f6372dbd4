//! Laying the layers of a cloth onto each other.

use super::components::Layer;
use crate::control::Control;
use crate::error::Result;
use crate::weave::curve::HeightCurves;
use crate::weave::problem::RelaxProblem;

/// Moves each of `layers`, which are given from the lowest to the highest, as close to the largest as
/// they can be without a collision, those below it first. The cost grows with the crossings between
/// layers.
pub(super) fn stack(
    problem: &RelaxProblem,
    layers: &[Layer],
    warp: &mut HeightCurves,
    weft: &mut HeightCurves,
    control: &Control,
) -> Result<()> {
    let size = |layer: &Layer| layer.ends.len() + layer.picks.len();
    let largest = layers.iter().map(size).max().unwrap_or(0);
    let anchor = layers.iter().position(|layer| size(layer) == largest).unwrap_or(0);
    let mut placed = Placed {
        ends: vec![false; problem.pattern.ends],
        picks: vec![false; problem.pattern.picks],
    };
    placed.add(&layers[anchor]);
    let below = layers[..anchor].iter().rev().map(|layer| (layer, -1.0));
    let above = layers[anchor + 1..].iter().map(|layer| (layer, 1.0));
    for (layer, up) in below.chain(above) {
        control.check()?;
        if let Some(room) = placed.room(problem, layer, [warp, weft], up) {
            shift(warp, &layer.ends, -up * room);
            shift(weft, &layer.picks, -up * room);
        }
        placed.add(layer);
    }
    Ok(())
}

/// The yarns that are in their places.
struct Placed {
    ends: Vec<bool>,
    picks: Vec<bool>,
}

impl Placed {
    fn add(&mut self, layer: &Layer) {
        layer.ends.iter().for_each(|&end| self.ends[end] = true);
        layer.picks.iter().for_each(|&pick| self.picks[pick] = true);
    }

    /// How far a layer can come closer to those in their places (or, negative, has to go away from
    /// them) until they touch. It is above them if `up` is 1, and below if it is -1; none, if no yarns
    /// cross.
    fn room(
        &self,
        problem: &RelaxProblem,
        layer: &Layer,
        [warp, weft]: [&HeightCurves; 2],
        up: f64,
    ) -> Option<f64> {
        let gap = |pick: usize, end: usize| {
            let over = warp.yarn(end).height[2 * pick + 1] - weft.yarn(pick).height[2 * end + 1];
            (over, problem.warp.radius[end] + problem.weft.radius[pick])
        };
        let mut room = f64::INFINITY;
        for &end in &layer.ends {
            for pick in (0..self.picks.len()).filter(|&pick| self.picks[pick]) {
                let (over, distance) = gap(pick, end);
                room = room.min(up * over - distance);
            }
        }
        for &pick in &layer.picks {
            for end in (0..self.ends.len()).filter(|&end| self.ends[end]) {
                let (over, distance) = gap(pick, end);
                room = room.min(-up * over - distance);
            }
        }
        room.is_finite().then_some(room)
    }
}

fn shift(curves: &mut HeightCurves, yarns: &[usize], amount: f64) {
    let knots = curves.knots.len();
    for yarn in yarns {
        curves.height[yarn * knots..(yarn + 1) * knots].iter_mut().for_each(|h| *h += amount);
    }
}
