//! The strain energy of one yarn direction as a quadratic form of the heights at the crossings.
//!
//! Given these heights, the energy is quadratic in everything else: each knot between two crossings
//! couples only to the two, so it is eliminated in closed form; the slopes at the crossings are then
//! a cyclic tridiagonal system that all yarns of the direction share.

use std::sync::Arc;

use rayon::prelude::*;

use super::cyclic::CyclicTridiagonal;
use super::field::yarns_per_task;
use crate::weave::curve::HeightCurve;
use crate::weave::problem::YarnData;

/// The strain of all yarns of one direction.
pub(super) struct Strain {
    stiffness: Vec<f64>,
    spans: Vec<Span>,
    slopes: CyclicTridiagonal,
    knots: Arc<[f64]>,
    period: f64,
}

impl Strain {
    /// The strain of `yarns`, whose knots are the boundaries and middles of the `crossed` slots.
    pub fn new(yarns: &YarnData, crossed: &YarnData) -> Self {
        let slots = &crossed.spacing;
        let spans: Vec<Span> = (0..slots.len())
            .map(|slot| Span::new(slots[slot] / 2.0, slots[(slot + 1) % slots.len()] / 2.0))
            .collect();
        let mut diagonal = vec![0.0; slots.len()];
        for (slot, span) in spans.iter().enumerate() {
            diagonal[slot] += span.matrix[1][1];
            diagonal[(slot + 1) % slots.len()] += span.matrix[3][3];
        }
        let coupling: Vec<f64> = spans.iter().map(|span| span.matrix[1][3]).collect();
        let mut period = 0.0;
        let mut knots = Vec::with_capacity(2 * slots.len());
        for slot in slots {
            knots.extend([period, period + slot / 2.0]);
            period += slot;
        }
        Self {
            stiffness: yarns.stiffness.clone(),
            slopes: CyclicTridiagonal::factor(&diagonal, &coupling),
            spans,
            knots: knots.into(),
            period,
        }
    }

    /// Number of crossings of one yarn.
    pub fn crossings(&self) -> usize {
        self.spans.len()
    }

    /// Stiffness of each yarn.
    pub fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// Reciprocal distance of each crossing to the next: the form's coefficients, were the yarn
    /// straight in between.
    pub fn straight_coupling(&self) -> impl Iterator<Item = f64> + '_ {
        self.spans.iter().map(|span| 1.0 / (span.lengths[0] + span.lengths[1]))
    }

    /// The derivative of the strain energy with respect to the crossing heights, yarns x crossings.
    pub fn apply(&self, heights: &[f64]) -> Vec<f64> {
        let count = self.crossings();
        let mut forces = vec![0.0; heights.len()];
        forces
            .par_chunks_mut(count)
            .zip(heights.par_chunks(count))
            .zip(&self.stiffness)
            .with_min_len(yarns_per_task(count))
            .for_each_init(
                || vec![0.0; count],
                |slopes, ((forces, heights), &stiffness)| {
                    self.solve_slopes(heights, slopes);
                    self.add_forces(heights, slopes, stiffness, forces);
                },
            );
        forces
    }

    /// The whole curve of a yarn with these heights at its crossings.
    pub fn curve(&self, heights: &[f64]) -> HeightCurve {
        let count = self.crossings();
        let mut slopes = vec![0.0; count];
        self.solve_slopes(heights, &mut slopes);
        let mut curve = HeightCurve {
            knots: self.knots.clone(),
            period: self.period,
            height: vec![0.0; 2 * count],
            slope: vec![0.0; 2 * count],
        };
        for (index, span) in self.spans.iter().enumerate() {
            let next = (index + 1) % count;
            let ends = [heights[index], slopes[index], heights[next], slopes[next]];
            (curve.height[2 * next], curve.slope[2 * next]) = span.middle(ends);
            curve.height[2 * index + 1] = heights[index];
            curve.slope[2 * index + 1] = slopes[index];
        }
        curve
    }

    /// The slopes at the crossings with the least strain.
    fn solve_slopes(&self, heights: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
        self.for_each_span(|span, index, next| {
            let rise = heights[next] - heights[index];
            slopes[index] -= span.matrix[1][2] * rise;
            slopes[next] -= span.matrix[3][2] * rise;
        });
        self.slopes.solve(slopes);
    }

    fn add_forces(&self, heights: &[f64], slopes: &[f64], stiffness: f64, forces: &mut [f64]) {
        self.for_each_span(|span, index, next| {
            let rise = heights[next] - heights[index];
            let row = &span.matrix[2];
            let force = row[2] * rise + row[1] * slopes[index] + row[3] * slopes[next];
            forces[index] -= stiffness * force;
            forces[next] += stiffness * force;
        });
    }

    /// Calls `visit(span, crossing, next crossing)` for every span.
    fn for_each_span(&self, mut visit: impl FnMut(&Span, usize, usize)) {
        let last = self.spans.len() - 1;
        for (index, span) in self.spans[..last].iter().enumerate() {
            visit(span, index, index + 1);
        }
        visit(&self.spans[last], last, 0);
    }
}

/// Two cubic segments between neighbouring crossings, their common knot eliminated.
struct Span {
    /// From the first crossing to the knot, and from there to the second.
    lengths: [f64; 2],
    /// The form at stiffness 1 over (h, slope) of the first and (h, slope) of the second crossing.
    matrix: [[f64; 4]; 4],
}

impl Span {
    fn new(first: f64, second: f64) -> Self {
        let lengths = [first, second];
        let mut matrix = [
            [1.2 / first, 0.1, 0.0, 0.0],
            [0.1, first / 7.5, 0.0, 0.0],
            [0.0, 0.0, 1.2 / second, -0.1],
            [0.0, 0.0, -0.1, second / 7.5],
        ];
        let (coupling, pivots) = Self::knot(lengths);
        for (row, pivot) in coupling.iter().zip(pivots) {
            for i in 0..4 {
                for j in 0..4 {
                    matrix[i][j] -= row[i] * row[j] / pivot;
                }
            }
        }
        Self { lengths, matrix }
    }

    /// How the height and the slope of the knot between couple to the crossings, and their own
    /// coefficients; the two do not couple to each other.
    fn knot([first, second]: [f64; 2]) -> ([[f64; 4]; 2], [f64; 2]) {
        let height = [-1.2 / first, -0.1, -1.2 / second, 0.1];
        let slope = [0.1, -first / 30.0, -0.1, -second / 30.0];
        ([height, slope], [1.2 / first + 1.2 / second, (first + second) / 7.5])
    }

    /// Height and slope of the knot between, for the least strain.
    fn middle(&self, ends: [f64; 4]) -> (f64, f64) {
        let (coupling, pivots) = Self::knot(self.lengths);
        let [height, slope] = [0, 1].map(|row| {
            -(0..4).map(|column| coupling[row][column] * ends[column]).sum::<f64>() / pivots[row]
        });
        (height, slope)
    }
}
