//! The stiffness against heights that warp and weft share, solved by Fourier transforms.
//!
//! Crossings that move up or down together with their neighbourhood are what collisions do not
//! resist at all: the long waves of this motion are the softest modes of a cloth, and no solve of
//! single yarns sees them. With equal yarns the stiffness against them is a convolution, which the
//! two-dimensional Fourier transform makes diagonal; unequal ones are taken at their mean.

use std::f64::consts::TAU;
use std::sync::Arc;

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::field::yarns_per_task;
use super::strain::Strain;
use super::transpose::transpose;

/// Solver for the heights common to both yarns of each crossing.
pub(super) struct CommonMode {
    picks: usize,
    ends: usize,
    along_weft: Transform,
    along_warp: Transform,
    /// Reciprocal eigenvalues, scaled for the unnormalised transforms; ends x picks.
    inverse: Vec<f64>,
}

impl CommonMode {
    pub fn new(warp: &Strain, weft: &Strain) -> Self {
        let (picks, ends) = (warp.crossings(), weft.crossings());
        let (by_pick, by_end) = (eigenvalues(warp), eigenvalues(weft));
        let scale = 1.0 / (picks * ends) as f64;
        let inverse = by_end
            .iter()
            .flat_map(|end| by_pick.iter().map(move |pick| end + pick))
            .enumerate()
            // The constant mode comes first: it has no stiffness, and is left alone.
            .map(|(index, sum)| if index == 0 { 0.0 } else { scale / sum })
            .collect();
        let (along_weft, along_warp) = (Transform::new(ends), Transform::new(picks));
        Self { picks, ends, along_weft, along_warp, inverse }
    }

    /// The common heights that balance `forces`, both picks x ends.
    pub fn solve(&self, forces: &[f64]) -> Vec<f64> {
        let mut rows: Vec<_> = forces.iter().map(|&force| Complex::from(force)).collect();
        apply(&*self.along_weft.forward, &mut rows);
        let mut columns = transpose(&rows, self.picks, self.ends);
        apply(&*self.along_warp.forward, &mut columns);
        columns
            .par_iter_mut()
            .zip(&self.inverse)
            .with_min_len(yarns_per_task(1))
            .for_each(|(value, inverse)| *value *= inverse);
        apply(&*self.along_warp.backward, &mut columns);
        let mut rows = transpose(&columns, self.ends, self.picks);
        apply(&*self.along_weft.backward, &mut rows);
        rows.iter().map(|value| value.re).collect()
    }
}

/// A Fourier transform of one length, and back.
struct Transform {
    forward: Arc<dyn Fft<f64>>,
    backward: Arc<dyn Fft<f64>>,
}

impl Transform {
    fn new(length: usize) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            forward: planner.plan_fft_forward(length),
            backward: planner.plan_fft_inverse(length),
        }
    }
}

/// Transforms every row.
fn apply(transform: &dyn Fft<f64>, rows: &mut [Complex<f64>]) {
    let length = transform.len();
    rows.par_chunks_mut(length).with_min_len(yarns_per_task(length)).for_each_init(
        || vec![Complex::default(); transform.get_inplace_scratch_len()],
        |scratch, row| transform.process_with_scratch(row, scratch),
    );
}

/// Eigenvalues of the mean yarn of a direction, straight between crossings, in the transform's order.
fn eigenvalues(strain: &Strain) -> Vec<f64> {
    let count = strain.crossings();
    let coupling = strain.straight_coupling().sum::<f64>() / count as f64;
    let stiffness = strain.stiffness().iter().sum::<f64>() / strain.stiffness().len() as f64;
    (0..count)
        .map(|wave| 2.0 * stiffness * coupling * (1.0 - (TAU * wave as f64 / count as f64).cos()))
        .collect()
}
