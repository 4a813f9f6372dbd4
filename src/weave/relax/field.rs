//! One number per yarn and crossing, for both yarn directions, and arithmetic on it.
//!
//! Sums run over fixed chunks and are added up in order, so no result depends on the threads.

use rayon::prelude::*;

use super::transpose::transpose;

const CHUNK: usize = 4096;

/// Yarns that make up a task of worthwhile size.
pub(super) fn yarns_per_task(crossings: usize) -> usize {
    CHUNK.div_ceil(crossings)
}

/// A value for the warp yarn and one for the weft yarn of every crossing.
#[derive(Clone)]
pub(super) struct Field {
    /// Ends x picks, yarn by yarn.
    pub warp: Vec<f64>,
    /// Picks x ends, yarn by yarn.
    pub weft: Vec<f64>,
}

impl Field {
    pub fn zeros(crossings: usize) -> Self {
        Self { warp: vec![0.0; crossings], weft: vec![0.0; crossings] }
    }

    pub fn dot(&self, other: &Self) -> f64 {
        dot(&self.warp, &other.warp) + dot(&self.weft, &other.weft)
    }

    /// self += factor * other
    pub fn add(&mut self, factor: f64, other: &Self) {
        add_to(&mut self.warp, factor, &other.warp);
        add_to(&mut self.weft, factor, &other.weft);
    }

    /// self *= factor
    pub fn scale(&mut self, factor: f64) {
        for values in [&mut self.warp, &mut self.weft] {
            values.par_iter_mut().with_min_len(CHUNK).for_each(|value| *value *= factor);
        }
    }

    pub fn shift(&mut self, amount: f64) {
        self.warp.iter_mut().chain(&mut self.weft).for_each(|value| *value += amount);
    }

    pub fn mean(&self) -> f64 {
        let sum: f64 = self.warp.iter().chain(&self.weft).sum();
        sum / (self.warp.len() + self.weft.len()) as f64
    }

    /// Warp less weft at each crossing, picks x ends.
    pub fn difference(&self, picks: usize, ends: usize) -> Vec<f64> {
        let mut difference = transpose(&self.warp, ends, picks);
        add_to(&mut difference, -1.0, &self.weft);
        difference
    }

    /// Warp plus weft at each crossing, picks x ends.
    pub fn sum(&self, picks: usize, ends: usize) -> Vec<f64> {
        let mut sum = transpose(&self.warp, ends, picks);
        add_to(&mut sum, 1.0, &self.weft);
        sum
    }

    /// Adds `force`, picks x ends, to the warp, and takes it from the weft.
    pub fn add_opposed(&mut self, force: &[f64], picks: usize, ends: usize) {
        add_to(&mut self.warp, 1.0, &transpose(force, picks, ends));
        add_to(&mut self.weft, -1.0, force);
    }

    /// Adds `amount`, picks x ends, to both.
    pub fn add_common(&mut self, amount: &[f64], picks: usize, ends: usize) {
        add_to(&mut self.warp, 1.0, &transpose(amount, picks, ends));
        add_to(&mut self.weft, 1.0, amount);
    }
}

fn add_to(target: &mut [f64], factor: f64, source: &[f64]) {
    target
        .par_iter_mut()
        .zip(source)
        .with_min_len(CHUNK)
        .for_each(|(target, source)| *target += factor * source);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let products = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let sums: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(products).collect();
    sums.iter().sum()
}
