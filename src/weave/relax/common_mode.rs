//! The stiffness against heights that warp and weft share, solved by Fourier transforms.
//!
//! Crossings that move up or down together with their neighbourhood are what collisions do not
//! resist at all: the long waves of this motion are the softest modes of a cloth, and no solve of
//! single yarns sees them. With equal yarns the stiffness against them is a convolution, which the
//! two-dimensional Fourier transform makes diagonal; unequal ones are taken at their mean.
//!
//! Single precision is enough for what only speeds up a solve. Forces are scaled to ones of about 1
//! before they are rounded.

use std::f64::consts::TAU;
use std::sync::Arc;

use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

use super::field::{Field, yarns_per_task};
use super::strain::Strain;
use super::transpose::{transpose, zip_transposed};

/// Solver for the heights common to both yarns of each crossing.
pub(super) struct CommonMode {
    picks: usize,
    ends: usize,
    to_waves: Arc<dyn RealToComplex<f32>>,
    from_waves: Arc<dyn ComplexToReal<f32>>,
    along_warp: [Arc<dyn Fft<f32>>; 2],
    /// Eigenvalues of the mean yarn of each direction, by wave, of all that the transform keeps.
    by_end: Vec<f64>,
    by_pick: Vec<f64>,
}

impl CommonMode {
    pub fn new(warp: &Strain, weft: &Strain) -> Self {
        let (picks, ends) = (warp.crossings(), weft.crossings());
        let mut real = RealFftPlanner::new();
        let mut planner = FftPlanner::new();
        let mut by_end = eigenvalues(weft);
        by_end.truncate(ends / 2 + 1);
        Self {
            picks,
            ends,
            to_waves: real.plan_fft_forward(ends),
            from_waves: real.plan_fft_inverse(ends),
            along_warp: [planner.plan_fft_forward(picks), planner.plan_fft_inverse(picks)],
            by_end,
            by_pick: eigenvalues(warp),
        }
    }

    /// The common heights that balance `forces`, and what to multiply them by; picks x ends.
    pub fn solve(&self, forces: &Field) -> (Vec<f32>, f64) {
        let size = forces.dot(forces).sqrt() / (forces.warp.len() as f64).sqrt();
        if size == 0.0 || !size.is_finite() {
            return (vec![0.0; forces.warp.len()], 0.0);
        }
        let stiffest = self.by_end.iter().chain(&self.by_pick).copied().fold(0.0, f64::max);
        let mut waves = transpose(&self.forward(forces, size), self.picks, self.by_end.len());
        self.transform_columns(0, &mut waves);
        self.divide(&mut waves, stiffest);
        self.transform_columns(1, &mut waves);
        (self.backward(waves), size / stiffest)
    }

    /// Adds what [`CommonMode::solve`] found to both yarns of each crossing.
    pub fn add(&self, (common, scale): (Vec<f32>, f64), heights: &mut Field) {
        let moved = |height: f64, common: f32| height + scale * f64::from(common);
        zip_transposed(&mut heights.warp, &common, self.picks, self.ends, moved);
        heights
            .weft
            .par_iter_mut()
            .zip(&common)
            .with_min_len(yarns_per_task(1))
            .for_each(|(height, &common)| *height = moved(*height, common));
    }

    /// The forces on both yarns, over `size`, in waves along the picks.
    fn forward(&self, forces: &Field, size: f64) -> Vec<Complex<f32>> {
        let mut sums = vec![0.0_f32; forces.warp.len()];
        let scaled = |force: f64| (force / size) as f32;
        zip_transposed(&mut sums, &forces.warp, self.ends, self.picks, |_, warp| scaled(warp));
        let kept = self.by_end.len();
        let mut waves = vec![Complex::default(); self.picks * kept];
        sums.par_chunks_mut(self.ends)
            .zip(forces.weft.par_chunks(self.ends))
            .zip(waves.par_chunks_mut(kept))
            .with_min_len(yarns_per_task(self.ends))
            .for_each_init(
                || self.to_waves.make_scratch_vec(),
                |scratch, ((sums, weft), waves)| {
                    for (sum, &weft) in sums.iter_mut().zip(weft) {
                        *sum += scaled(weft);
                    }
                    let done = self.to_waves.process_with_scratch(sums, waves, scratch);
                    done.expect("the lengths are those of the plan");
                },
            );
        waves
    }

    fn transform_columns(&self, which: usize, waves: &mut [Complex<f32>]) {
        let transform = &*self.along_warp[which];
        waves.par_chunks_mut(self.picks).with_min_len(yarns_per_task(self.picks)).for_each_init(
            || vec![Complex::default(); transform.get_inplace_scratch_len()],
            |scratch, column| transform.process_with_scratch(column, scratch),
        );
    }

    /// Divides by the stiffness of each wave, relative to `stiffest`.
    fn divide(&self, waves: &mut [Complex<f32>], stiffest: f64) {
        // The transforms back are not normalised.
        let scale = stiffest / (self.picks * self.ends) as f64;
        waves
            .par_chunks_mut(self.picks)
            .zip(&self.by_end)
            .with_min_len(yarns_per_task(self.picks))
            .for_each(|(column, end)| {
                for (wave, pick) in column.iter_mut().zip(&self.by_pick) {
                    let stiffness = end + pick;
                    // The constant one has no stiffness, and is left alone.
                    *wave *= if stiffness > 0.0 { (scale / stiffness) as f32 } else { 0.0 };
                }
            });
    }

    fn backward(&self, waves: Vec<Complex<f32>>) -> Vec<f32> {
        let kept = self.by_end.len();
        let mut rows = transpose(&waves, kept, self.picks);
        drop(waves);
        let mut values = vec![0.0; self.picks * self.ends];
        values
            .par_chunks_mut(self.ends)
            .zip(rows.par_chunks_mut(kept))
            .with_min_len(yarns_per_task(self.ends))
            .for_each_init(
                || self.from_waves.make_scratch_vec(),
                |scratch, (values, waves)| {
                    // What rounding left of parts that are nil in waves of a real row.
                    waves[0].im = 0.0;
                    if self.ends.is_multiple_of(2) {
                        waves[kept - 1].im = 0.0;
                    }
                    let done = self.from_waves.process_with_scratch(waves, values, scratch);
                    done.expect("the lengths are those of the plan");
                },
            );
        values
    }
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
