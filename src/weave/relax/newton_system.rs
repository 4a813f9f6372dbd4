//! One step of Newton's method: the energy's second derivative, and the linear solve with it.

use std::ops::Range;

use rayon::prelude::*;

use super::common_mode::CommonMode;
use super::contact::Contacts;
use super::cyclic::CyclicTridiagonal;
use super::field::{Field, yarns_per_task};
use super::lanes::{LANES, Lanes, interleave, lanes, separate};
use super::strain::Strain;
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
    pub contacts: &'a Contacts,
    /// Of the contacts, picks x ends.
    pub curvatures: Vec<f32>,
}

/// What [`NewtonSystem::solve`] finds.
pub(super) struct Step {
    pub change: Field,
    /// The energy's slope along the change, with its sign turned.
    pub decrease: f64,
    /// Iterations of conjugate gradients that it took.
    pub iterations: u64,
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
        let mut iterations = 0;
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
            iterations += 1;
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
        Ok(Step { change, decrease, iterations })
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
        let ends = self.contacts.ends;
        solve_yarns(self.warp_strain, values, |yarns, resistance| {
            for (pick, (row, resistance)) in
                self.curvatures.chunks_exact(ends).zip(resistance).enumerate()
            {
                let curvatures = &row[yarns.clone()];
                for ((end, &curvature), resistance) in yarns.clone().zip(curvatures).zip(resistance)
                {
                    *resistance = self.contacts.resistance(pick, end, curvature);
                }
            }
        });
    }

    fn solve_wefts(&self, values: &mut [f64]) {
        let ends = self.contacts.ends;
        solve_yarns(self.weft_strain, values, |yarns, resistance| {
            for (lane, pick) in yarns.enumerate() {
                let row = &self.curvatures[pick * ends..(pick + 1) * ends];
                for (end, (&curvature, resistance)) in row.iter().zip(&mut *resistance).enumerate()
                {
                    resistance[lane] = self.contacts.resistance(pick, end, curvature);
                }
            }
        });
    }
}

/// Turns the forces on all yarns of a direction into heights, with the yarns that they cross held.
/// The strain is taken as if they were straight between crossings (the true one is at most some 30%
/// higher).
///
/// `resist` writes the contacts' second derivative, crossing by crossing, for a range of yarns. It is
/// factored anew for each solve: the factors of all yarns would take more memory than all else.
fn solve_yarns(
    strain: &Strain,
    values: &mut [f64],
    resist: impl Fn(Range<usize>, &mut [Lanes]) + Sync,
) {
    let count = strain.crossings();
    let straight: Vec<f64> = strain.straight_coupling().collect();
    let room =
        || ([(); 2].map(|()| vec![[0.0; LANES]; count]), CyclicTridiagonal::with_room(count));
    values
        .par_chunks_mut(LANES * count)
        .zip(strain.stiffness().par_chunks(LANES))
        .enumerate()
        .with_min_len(yarns_per_task(LANES * count))
        .for_each_init(room, |([diagonal, heights], factors), (group, (values, yarns))| {
            let first = group * LANES;
            resist(first..first + yarns.len(), diagonal);
            // Lanes without a yarn have any stiffness that can be divided by.
            let stiffness: Lanes = lanes(|lane| yarns.get(lane).copied().unwrap_or(1.0));
            let coupling = |place: usize| lanes(|lane| -stiffness[lane] * straight[place]);
            for place in 0..count {
                let coupling = coupling(place);
                let next = (place + 1) % count;
                for lane in 0..LANES {
                    diagonal[place][lane] -= coupling[lane] * (1.0 + REGULARISATION);
                    diagonal[next][lane] -= coupling[lane];
                }
            }
            factors.factor(diagonal, coupling);
            interleave(values, count, heights);
            factors.solve(heights);
            separate(heights, count, values);
        });
}
