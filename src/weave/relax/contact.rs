//! The collisions of a layer's crossings: how close the yarns are, the forces, and the forces'
//! derivatives, all of them softened by the given softness (see `softening`).

use rayon::prelude::*;

use super::components::Layer;
use super::field::{Field, yarns_per_task};
use crate::weave::energy::{Push, Repulsion};
use crate::weave::problem::RelaxProblem;

/// Collision energy as a function of the ratios u of Eq. 3, one per crossing, picks x ends.
///
/// Ratios are signed by the pattern: positive while the yarns are in the right order.
pub(super) struct Contacts {
    pub picks: usize,
    pub ends: usize,
    stiffness: f64,
    warp_up: Vec<bool>,
    warp_radius: Vec<f64>,
    weft_radius: Vec<f64>,
}

impl Contacts {
    pub fn new(problem: &RelaxProblem, layer: &Layer) -> Self {
        let (picks, ends) = (&layer.picks, &layer.ends);
        let mut warp_up = Vec::with_capacity(picks.len() * ends.len());
        for &pick in picks {
            warp_up.extend(ends.iter().map(|&end| problem.pattern.is_warp_up(pick, end)));
        }
        Self {
            picks: picks.len(),
            ends: ends.len(),
            stiffness: problem.collision_stiffness,
            warp_up,
            warp_radius: ends.iter().map(|&end| problem.warp.radius[end]).collect(),
            weft_radius: picks.iter().map(|&pick| problem.weft.radius[pick]).collect(),
        }
    }

    /// Number of crossings.
    pub fn count(&self) -> usize {
        self.warp_up.len()
    }

    /// Heights that give every crossing the ratio 1, shared equally by warp and weft.
    pub fn touching(&self) -> Field {
        let mut halves = vec![0.5; self.count()];
        self.update(&mut halves, |half, distance| half * distance);
        let mut heights = Field::zeros(self.count());
        heights.add_opposed(&halves, self.picks, self.ends);
        heights
    }

    /// The ratio at every crossing, or its change if `heights` are changes.
    pub fn ratios(&self, heights: &Field) -> Vec<f64> {
        let mut ratios = heights.difference(self.picks, self.ends);
        self.update(&mut ratios, |difference, distance| difference / distance);
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

    /// The mean square of the pushes, in units of the collision stiffness.
    pub fn mean_square_push(&self, ratios: &[f64]) -> f64 {
        let sums: Vec<f64> = ratios
            .par_chunks(self.ends)
            .with_min_len(yarns_per_task(self.ends))
            .map(|ratios| ratios.iter().map(|&ratio| Repulsion::at(ratio).slope.powi(2)).sum())
            .collect();
        sums.iter().sum::<f64>() / ratios.len() as f64
    }

    /// Turns ratios into the energy's derivatives with respect to the height of warp over weft.
    pub fn forces(&self, mut ratios: Vec<f64>, softness: f64) -> Vec<f64> {
        let stiffness = self.stiffness;
        self.update(&mut ratios, |ratio, distance| {
            -stiffness * Push::softened(ratio, softness).force / distance
        });
        ratios
    }

    /// The second derivative of Eq. 3's potential with respect to the ratio, at each crossing. Rounded
    /// to single precision, it changes a step by so little that the next makes good for it.
    pub fn curvatures(&self, ratios: &[f64], softness: f64) -> Vec<f32> {
        let mut curvatures = vec![0.0; ratios.len()];
        let curvature =
            |ratio| Push::softened(ratio, softness).curvature.min(f64::from(f32::MAX)) as f32;
        curvatures
            .par_iter_mut()
            .zip(ratios)
            .with_min_len(yarns_per_task(1))
            .for_each(|(target, &ratio)| *target = curvature(ratio));
        curvatures
    }

    /// Turns heights of warp over weft into forces, by the curvatures at their crossings.
    pub fn resist(&self, differences: &mut [f64], curvatures: &[f32]) {
        let stiffness = self.stiffness;
        let rows = differences.par_chunks_mut(self.ends).zip(curvatures.par_chunks(self.ends));
        rows.zip(&self.weft_radius).with_min_len(yarns_per_task(self.ends)).for_each(
            |((differences, curvatures), weft_radius)| {
                let yarns = curvatures.iter().zip(&self.warp_radius);
                for (difference, (&curvature, warp_radius)) in differences.iter_mut().zip(yarns) {
                    let distance = warp_radius + weft_radius;
                    *difference *= stiffness * f64::from(curvature) / (distance * distance);
                }
            },
        );
    }

    /// The second derivative of the energy with respect to the height of `end` over `pick`, of this
    /// curvature.
    pub fn resistance(&self, pick: usize, end: usize, curvature: f32) -> f64 {
        let distance = self.warp_radius[end] + self.weft_radius[pick];
        self.stiffness * f64::from(curvature) / (distance * distance)
    }

    /// First and second derivative of the energy of `ratios + step * changes` with respect to step.
    pub fn along(&self, ratios: &[f64], changes: &[f64], softness: f64, step: f64) -> [f64; 2] {
        let row = |(ratios, changes): (&[f64], &[f64])| {
            let mut sums = [0.0; 2];
            for (&ratio, &change) in ratios.iter().zip(changes) {
                let push = Push::softened(ratio + step * change, softness);
                sums[0] -= push.force * change;
                sums[1] += push.curvature * change * change;
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

    /// Gives every value, picks x ends, that of itself and R_A + R_B, which is negative where the
    /// weft is on top.
    fn update(&self, values: &mut [f64], value: impl Fn(f64, f64) -> f64 + Sync) {
        let rows = values.par_chunks_mut(self.ends).zip(self.warp_up.par_chunks(self.ends));
        rows.zip(&self.weft_radius).with_min_len(yarns_per_task(self.ends)).for_each(
            |((values, warp_up), weft_radius)| {
                let yarns = warp_up.iter().zip(&self.warp_radius);
                for (target, (&warp_up, warp_radius)) in values.iter_mut().zip(yarns) {
                    let distance = warp_radius + weft_radius;
                    *target = value(*target, if warp_up { distance } else { -distance });
                }
            },
        );
    }
}
