//! The collisions of all crossings: how close the yarns are, the forces, and the forces' derivatives.

use rayon::prelude::*;

use super::field::{Field, yarns_per_task};
use crate::weave::energy::Repulsion;
use crate::weave::problem::RelaxProblem;

/// Collision energy as a function of the ratios u of Eq. 3, one per crossing, picks x ends.
///
/// Ratios are signed by the pattern: positive while the yarns are in the right order.
pub(super) struct Contacts {
    pub picks: usize,
    pub ends: usize,
    stiffness: f64,
    /// 1 / (R_A + R_B), negative where the weft is on top.
    inverse_distance: Vec<f64>,
}

impl Contacts {
    pub fn new(problem: &RelaxProblem) -> Self {
        let (picks, ends) = (problem.pattern.picks, problem.pattern.ends);
        let inverse_distance = (0..picks)
            .flat_map(|pick| (0..ends).map(move |end| 1.0 / problem.contact(pick, end)))
            .collect();
        Self { picks, ends, stiffness: problem.collision_stiffness, inverse_distance }
    }

    /// Number of crossings.
    pub fn count(&self) -> usize {
        self.inverse_distance.len()
    }

    /// Heights that give every crossing the ratio 1, shared equally by warp and weft.
    pub fn touching(&self) -> Field {
        let halves: Vec<f64> = self.inverse_distance.iter().map(|inverse| 0.5 / inverse).collect();
        let mut heights = Field::zeros(self.count());
        heights.add_opposed(&halves, self.picks, self.ends);
        heights
    }

    /// The ratio at every crossing, or its change if `heights` are changes.
    pub fn ratios(&self, heights: &Field) -> Vec<f64> {
        let mut ratios = heights.difference(self.picks, self.ends);
        self.scale_by_distance(&mut ratios);
        ratios
    }

    /// The collision energy.
    pub fn energy(&self, ratios: &[f64]) -> f64 {
        let sums: Vec<f64> = ratios
            .par_chunks(self.ends)
            .with_min_len(yarns_per_task(self.ends))
            .map(|ratios| ratios.iter().map(|&ratio| Repulsion::at(ratio).value).sum::<f64>())
            .collect();
        self.stiffness * sums.iter().sum::<f64>()
    }

    /// Derivative of the energy with respect to the height of warp over weft, at each crossing.
    pub fn forces(&self, ratios: &[f64]) -> Vec<f64> {
        self.map(ratios, |ratio, inverse| Repulsion::at(ratio).slope * inverse)
    }

    /// Derivative of [`Contacts::forces`] with respect to the same height.
    pub fn curvatures(&self, ratios: &[f64]) -> Vec<f64> {
        self.map(ratios, |ratio, inverse| Repulsion::at(ratio).curvature * inverse * inverse)
    }

    /// First and second derivative of the energy of `ratios + step * changes` with respect to step.
    pub fn along(&self, ratios: &[f64], changes: &[f64], step: f64) -> [f64; 2] {
        let row = |(ratios, changes): (&[f64], &[f64])| {
            let mut sums = [0.0; 2];
            for (&ratio, &change) in ratios.iter().zip(changes) {
                let repulsion = Repulsion::at(ratio + step * change);
                sums[0] += repulsion.slope * change;
                sums[1] += repulsion.curvature * change * change;
            }
            sums
        };
        let rows = ratios.par_chunks(self.ends).zip(changes.par_chunks(self.ends));
        let sums: Vec<[f64; 2]> = rows.with_min_len(yarns_per_task(self.ends)).map(row).collect();
        [0, 1].map(|order| self.stiffness * sums.iter().map(|sums| sums[order]).sum::<f64>())
    }

    /// The step at which the first crossing would reach ratio 0; infinite if none comes closer.
    pub fn longest_step(ratios: &[f64], changes: &[f64]) -> f64 {
        let steps = ratios.iter().zip(changes).filter(|(_, change)| **change < 0.0);
        steps.map(|(ratio, change)| -ratio / change).fold(f64::INFINITY, f64::min)
    }

    fn map(&self, ratios: &[f64], value: impl Fn(f64, f64) -> f64 + Sync) -> Vec<f64> {
        let mut values = vec![0.0; ratios.len()];
        values
            .par_iter_mut()
            .zip(ratios.par_iter().zip(&self.inverse_distance))
            .with_min_len(yarns_per_task(1))
            .for_each(|(target, (&ratio, &inverse))| {
                *target = self.stiffness * value(ratio, inverse);
            });
        values
    }

    fn scale_by_distance(&self, values: &mut [f64]) {
        values
            .par_iter_mut()
            .zip(&self.inverse_distance)
            .with_min_len(yarns_per_task(1))
            .for_each(|(value, inverse)| *value *= inverse);
    }
}
