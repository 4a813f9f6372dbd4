//! One step of Newton's method: the energy's second derivative, and the linear solve with it.

use rayon::prelude::*;

use super::common_mode::CommonMode;
use super::contact::Contacts;
use super::cyclic::CyclicTridiagonal;
use super::field::{Field, yarns_per_task};
use super::strain::Strain;
use crate::control::Control;
use crate::error::Result;

/// Stiffness added to the single yarns of the preconditioner, as a fraction of their own, so that
/// it can also solve for a yarn that touches nothing.
const REGULARISATION: f64 = 1e-8;
const CG_ITERATIONS: usize = 2000;
/// Warps that are solved for together: as many numbers as a cache line of curvatures holds.
const WARPS_AT_ONCE: usize = 16;

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
    pub contacts: &'a Contacts,
    /// Of the contacts, picks x ends.
    pub curvatures: Vec<f32>,
}

/// What [`NewtonSystem::solve`] finds.
pub(super) struct Step {
    pub change: Field,
    /// The energy's slope along the change, with its sign turned.
    pub decrease: f64,
}

impl NewtonSystem<'_> {
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
    ) -> Result<Step> {
        let mut change = Field::zeros(right.warp.len());
        let mut decrease = 0.0;
        let mut residual = right;
        // The image of the direction, and then the residual, preconditioned.
        let mut image = Field::zeros(residual.warp.len());
        self.precondition(&residual, &mut image, control)?;
        let mut direction = image.clone();
        let mut square = residual.dot(&direction);
        let target = f64::max(tolerance * tolerance * square, negligible);
        for _ in 0..CG_ITERATIONS {
            if square <= target {
                break;
            }
            self.apply(&direction, &mut image, control)?;
            let curvature = direction.dot(&image);
            if curvature <= 0.0 {
                break;
            }
            let step = square / curvature;
            change.add(step, &direction);
            // Directions conjugate to those before have the same product with all residuals.
            decrease += step * square;
            residual.add(-step, &image);
            self.precondition(&residual, &mut image, control)?;
            let next = residual.dot(&image);
            direction.scale_and_add(next / square, &image);
            square = next;
        }
        Ok(Step { change, decrease })
    }

    /// H times `change`.
    fn apply(&self, change: &Field, image: &mut Field, control: &Control) -> Result<()> {
        control.check()?;
        let (picks, ends) = (self.contacts.picks, self.contacts.ends);
        self.warp_strain.apply(&change.warp, &mut image.warp);
        self.weft_strain.apply(&change.weft, &mut image.weft);
        control.check()?;
        let mut forces = change.difference(picks, ends);
        self.contacts.resist(&mut forces, &self.curvatures);
        image.add_opposed(&forces, picks, ends);
        Ok(())
    }

    fn precondition(&self, residual: &Field, result: &mut Field, control: &Control) -> Result<()> {
        control.check()?;
        result.copy_from(residual);
        self.solve_warps(&mut result.warp);
        self.solve_wefts(&mut result.weft);
        control.check()?;
        self.common_mode.add(self.common_mode.solve(residual), result);
        Ok(())
    }

    fn solve_warps(&self, values: &mut [f64]) {
        let (picks, ends) = (self.contacts.picks, self.contacts.ends);
        let straight: Vec<f64> = self.warp_strain.straight_coupling().collect();
        values
            .par_chunks_mut(WARPS_AT_ONCE * picks)
            .enumerate()
            .with_min_len(yarns_per_task(WARPS_AT_ONCE * picks))
            .for_each_init(
                || (SingleYarn::default(), vec![0.0; WARPS_AT_ONCE * picks]),
                |(solver, resistance), (group, values)| {
                    let first = group * WARPS_AT_ONCE;
                    let warps = first..ends.min(first + WARPS_AT_ONCE);
                    for (pick, row) in self.curvatures.chunks_exact(ends).enumerate() {
                        for end in warps.clone() {
                            resistance[(end - first) * picks + pick] =
                                self.contacts.resistance(pick, end, row[end]);
                        }
                    }
                    let yarns = values.chunks_mut(picks).zip(resistance.chunks(picks));
                    for ((values, resistance), end) in yarns.zip(warps) {
                        let stiffness = self.warp_strain.stiffness()[end];
                        solver.solve(stiffness, &straight, resistance.iter().copied(), values);
                    }
                },
            );
    }

    fn solve_wefts(&self, values: &mut [f64]) {
        let ends = self.contacts.ends;
        let straight: Vec<f64> = self.weft_strain.straight_coupling().collect();
        values
            .par_chunks_mut(ends)
            .zip(self.curvatures.par_chunks(ends))
            .enumerate()
            .with_min_len(yarns_per_task(ends))
            .for_each_init(SingleYarn::default, |solver, (pick, (values, curvatures))| {
                let row = curvatures.iter().enumerate();
                let resistance =
                    row.map(|(end, &curvature)| self.contacts.resistance(pick, end, curvature));
                let stiffness = self.weft_strain.stiffness()[pick];
                solver.solve(stiffness, &straight, resistance, values);
            });
    }
}

/// Solver of a yarn's heights with the yarns that it crosses held, its strain taken as if it were
/// straight between crossings (the true one is at most some 30% higher).
///
/// It factors anew for each solve: the factors of all yarns would take more memory than all else.
#[derive(Default)]
struct SingleYarn {
    diagonal: Vec<f64>,
    coupling: Vec<f64>,
    factors: CyclicTridiagonal,
}

impl SingleYarn {
    /// Turns forces into heights; `straight` is the strain's coupling at stiffness 1.
    fn solve(
        &mut self,
        stiffness: f64,
        straight: &[f64],
        resistance: impl Iterator<Item = f64>,
        values: &mut [f64],
    ) {
        self.diagonal.clear();
        self.diagonal.extend(resistance);
        self.coupling.clear();
        self.coupling.extend(straight.iter().map(|coupling| -stiffness * coupling));
        let count = values.len();
        for (index, coupling) in self.coupling.iter().enumerate() {
            self.diagonal[index] -= coupling * (1.0 + REGULARISATION);
            self.diagonal[(index + 1) % count] -= coupling;
        }
        self.factors.refactor(&self.diagonal, &self.coupling);
        self.factors.solve(values);
    }
}
