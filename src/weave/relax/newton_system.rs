//! One step of Newton's method: the energy's second derivative, and the linear solve with it.

use rayon::prelude::*;

use super::common_mode::CommonMode;
use super::contact::Contacts;
use super::cyclic::CyclicTridiagonal;
use super::field::{Field, yarns_per_task};
use super::strain::Strain;
use super::transpose::transpose;
use crate::control::Control;
use crate::error::Result;

/// Stiffness added to the single yarns of the preconditioner, as a fraction of their own, so that
/// it can also solve for a yarn that touches nothing.
const REGULARISATION: f64 = 1e-8;
const CG_ITERATIONS: usize = 2000;

/// The second derivative H of the energy at some heights, and an approximate inverse.
///
/// H = strain of each yarn + contact curvature on the difference at each crossing. The approximate
/// inverse is the sum of the inverses on three subspaces (an additive Schwarz method): every warp
/// with the wefts held, every weft with the warps held, and the motion common to both, which the
/// contacts do not resist.
pub(super) struct NewtonSystem<'a> {
    pub warp_strain: &'a Strain,
    pub weft_strain: &'a Strain,
    pub common_mode: &'a CommonMode,
    warp_solvers: Vec<CyclicTridiagonal>,
    weft_solvers: Vec<CyclicTridiagonal>,
    /// Picks x ends.
    curvatures: Vec<f64>,
}

impl<'a> NewtonSystem<'a> {
    pub fn new(
        [warp_strain, weft_strain]: [&'a Strain; 2],
        common_mode: &'a CommonMode,
        contacts: &Contacts,
        ratios: &[f64],
    ) -> Self {
        let curvatures = contacts.curvatures(ratios);
        let by_warp = transpose(&curvatures, contacts.picks, contacts.ends);
        Self {
            warp_strain,
            weft_strain,
            common_mode,
            warp_solvers: single_yarn_solvers(warp_strain, &by_warp),
            weft_solvers: single_yarn_solvers(weft_strain, &curvatures),
            curvatures,
        }
    }

    /// Solves H x = `right` by preconditioned conjugate gradients, until the residual's norm in the
    /// preconditioner's metric has fallen by the factor `tolerance`, or until its square, which is
    /// about twice the energy still to be gained, is below `negligible`.
    ///
    /// H is singular, for nothing resists a common shift of all yarns: without such a floor, rounding
    /// left in the residual would in the end be taken for a force along the shift. Stopped early, the
    /// solution is still a direction of descent of the energy.
    pub fn solve(
        &self,
        right: Field,
        tolerance: f64,
        negligible: f64,
        control: &Control,
    ) -> Result<Field> {
        let mut solution = Field::zeros(right.warp.len());
        let mut residual = right;
        let mut direction = self.precondition(&residual);
        let mut square = residual.dot(&direction);
        let target = f64::max(tolerance * tolerance * square, negligible);
        for _ in 0..CG_ITERATIONS {
            if square <= target {
                break;
            }
            control.check()?;
            let image = self.apply(&direction);
            let curvature = direction.dot(&image);
            if curvature <= 0.0 {
                break;
            }
            let step = square / curvature;
            solution.add(step, &direction);
            residual.add(-step, &image);
            let preconditioned = self.precondition(&residual);
            let next = residual.dot(&preconditioned);
            direction.scale(next / square);
            direction.add(1.0, &preconditioned);
            square = next;
        }
        Ok(solution)
    }

    /// H times `change`.
    fn apply(&self, change: &Field) -> Field {
        let (picks, ends) = (self.warp_strain.crossings(), self.weft_strain.crossings());
        let mut image = Field {
            warp: self.warp_strain.apply(&change.warp),
            weft: self.weft_strain.apply(&change.weft),
        };
        let mut forces = change.difference(picks, ends);
        forces
            .par_iter_mut()
            .zip(&self.curvatures)
            .with_min_len(yarns_per_task(1))
            .for_each(|(force, curvature)| *force *= curvature);
        image.add_opposed(&forces, picks, ends);
        image
    }

    fn precondition(&self, residual: &Field) -> Field {
        let (picks, ends) = (self.warp_strain.crossings(), self.weft_strain.crossings());
        let mut result = residual.clone();
        let common = self.common_mode.solve(&residual.sum(picks, ends));
        solve_single_yarns(&self.warp_solvers, picks, &mut result.warp);
        solve_single_yarns(&self.weft_solvers, ends, &mut result.weft);
        result.add_common(&common, picks, ends);
        result
    }
}

/// For each yarn, the solver of its heights with the yarns that it crosses held, its strain taken
/// as if it were straight between crossings (the true one is at most some 30% higher).
fn single_yarn_solvers(strain: &Strain, curvatures: &[f64]) -> Vec<CyclicTridiagonal> {
    let count = strain.crossings();
    let straight: Vec<f64> = strain.straight_coupling().collect();
    let solver = |(curvatures, &stiffness): (&[f64], &f64)| {
        let coupling: Vec<f64> = straight.iter().map(|coupling| -stiffness * coupling).collect();
        let mut diagonal = curvatures.to_vec();
        for (index, coupling) in coupling.iter().enumerate() {
            diagonal[index] -= coupling * (1.0 + REGULARISATION);
            diagonal[(index + 1) % count] -= coupling;
        }
        CyclicTridiagonal::factor(&diagonal, &coupling)
    };
    curvatures
        .par_chunks(count)
        .zip(strain.stiffness())
        .with_min_len(yarns_per_task(count))
        .map(solver)
        .collect()
}

fn solve_single_yarns(solvers: &[CyclicTridiagonal], crossings: usize, values: &mut [f64]) {
    values
        .par_chunks_mut(crossings)
        .zip(solvers)
        .with_min_len(yarns_per_task(crossings))
        .for_each(|(values, solver)| solver.solve(values));
}
