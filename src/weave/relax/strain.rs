//! The strain energy of one yarn direction as a quadratic form of the heights at the crossings.
//!
//! Given these heights, the energy is quadratic in everything else. The knots between two crossings
//! couple only to the two, so they are eliminated in closed form, with all crossings in between of
//! yarns of other layers (see `float`); the slopes at the crossings are then a cyclic tridiagonal
//! system that all yarns of the direction share.

use rayon::prelude::*;

use super::cyclic::CyclicTridiagonal;
use super::field::yarns_per_task;
use super::float::Float;
use super::lanes::{LANES, Lanes, interleave, lanes, separate};

/// The strain of all yarns of one direction and layer.
pub(super) struct Strain {
    stiffness: Vec<f64>,
    /// From each crossing to the next of the same layer.
    floats: Vec<Float>,
    slopes: CyclicTridiagonal<1>,
}

impl Strain {
    /// The strain of yarns of these stiffnesses, which cross yarns with these `slots`; the heights
    /// are those at the crossings with `crossed`, some of them, in ascending order.
    pub fn new(stiffness: Vec<f64>, slots: &[f64], crossed: &[usize]) -> Self {
        let floats: Vec<Float> = (0..crossed.len())
            .map(|place| {
                let first = crossed[place];
                let next = crossed[(place + 1) % crossed.len()];
                Float::new(segments(slots, first, next))
            })
            .collect();
        let mut diagonal = vec![[0.0]; floats.len()];
        for (place, float) in floats.iter().enumerate() {
            diagonal[place][0] += float.slope[0][0];
            diagonal[(place + 1) % floats.len()][0] += float.slope[1][1];
        }
        let mut slopes = CyclicTridiagonal::with_room(floats.len());
        slopes.factor(&diagonal, |place| [floats[place].slope[0][1]]);
        Self { stiffness, slopes, floats }
    }

    /// Number of crossings of one yarn.
    pub fn crossings(&self) -> usize {
        self.floats.len()
    }

    /// Stiffness of each yarn.
    pub fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// Reciprocal distance of each crossing to the next: the form's coefficients, were the yarn
    /// straight in between.
    pub fn straight_coupling(&self) -> impl Iterator<Item = f64> + '_ {
        self.floats.iter().map(|float| 1.0 / float.length)
    }

    /// The derivative of the strain energy with respect to the crossing heights, yarns x crossings,
    /// written over `forces`.
    pub fn apply(&self, heights: &[f64], forces: &mut [f64]) {
        let count = self.crossings();
        let room = || [(); 3].map(|()| vec![[0.0; LANES]; count]);
        forces
            .par_chunks_mut(LANES * count)
            .zip(heights.par_chunks(LANES * count))
            .zip(self.stiffness.par_chunks(LANES))
            .with_min_len(yarns_per_task(LANES * count))
            .for_each_init(room, |[side_by_side, slopes, own], ((forces, heights), stiffness)| {
                interleave(heights, count, side_by_side);
                self.solve_slopes(side_by_side, slopes);
                let stiffness = lanes(|lane| stiffness.get(lane).copied().unwrap_or(0.0));
                self.write_forces(side_by_side, slopes, &stiffness, own);
                separate(own, count, forces);
            });
    }

    /// Writes height and slope at all knots of a yarn with these heights at its crossings with
    /// `crossed`.
    pub fn write_curve(
        &self,
        heights: &[f64],
        crossed: &[usize],
        height: &mut [f64],
        slope: &mut [f64],
    ) {
        let mut slopes = vec![[0.0]; self.crossings()];
        self.solve_slopes(heights.as_chunks().0, &mut slopes);
        let slopes = slopes.as_flattened();
        self.for_each_float(|float, place, next| {
            let first = 2 * crossed[place] + 1;
            (height[first], slope[first]) = (heights[place], slopes[place]);
            let joints =
                float.joints([heights[place], heights[next]], [slopes[place], slopes[next]]);
            for (offset, joint) in joints.into_iter().enumerate() {
                let knot = (first + 1 + offset) % height.len();
                (height[knot], slope[knot]) = joint;
            }
        });
    }

    /// The slopes at the crossings with the least strain.
    fn solve_slopes<const N: usize>(&self, heights: &[Lanes<N>], slopes: &mut [Lanes<N>]) {
        slopes.fill([0.0; N]);
        self.for_each_float(|float, place, next| {
            let [first, second] = float.rise_slope;
            let rise: Lanes<N> = lanes(|lane| heights[next][lane] - heights[place][lane]);
            slopes[place] = lanes(|lane| slopes[place][lane] - first * rise[lane]);
            slopes[next] = lanes(|lane| slopes[next][lane] - second * rise[lane]);
        });
        self.slopes.solve(slopes);
    }

    fn write_forces(
        &self,
        heights: &[Lanes],
        slopes: &[Lanes],
        stiffness: &Lanes,
        forces: &mut [Lanes],
    ) {
        forces.fill([0.0; LANES]);
        self.for_each_float(|float, place, next| {
            let [first, second] = float.rise_slope;
            let force: Lanes = lanes(|lane| {
                let rise = heights[next][lane] - heights[place][lane];
                let by_slopes = first * slopes[place][lane] + second * slopes[next][lane];
                stiffness[lane] * (float.rise * rise + by_slopes)
            });
            forces[place] = lanes(|lane| forces[place][lane] - force[lane]);
            forces[next] = lanes(|lane| forces[next][lane] + force[lane]);
        });
    }

    /// Calls `visit(float, crossing, next crossing)` for every float.
    fn for_each_float(&self, mut visit: impl FnMut(&Float, usize, usize)) {
        let last = self.floats.len() - 1;
        for (place, float) in self.floats[..last].iter().enumerate() {
            visit(float, place, place + 1);
        }
        visit(&self.floats[last], last, 0);
    }
}

/// The segments from the middle of one slot to that of another, or round the period to its own: half
/// a slot each.
fn segments(slots: &[f64], first: usize, next: usize) -> Vec<f64> {
    let mut segments = vec![slots[first] / 2.0];
    let mut slot = (first + 1) % slots.len();
    while slot != next {
        segments.extend([slots[slot] / 2.0; 2]);
        slot = (slot + 1) % slots.len();
    }
    segments.push(slots[next] / 2.0);
    segments
}
