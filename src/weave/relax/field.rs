//! One number per yarn and crossing, for both yarn directions, and arithmetic on it.
//!
//! Sums run over fixed chunks and are added up in order, so no result depends on the threads.

use rayon::prelude::*;

use super::transpose::{transpose, zip_transposed};

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
        for (target, source) in [(&mut self.warp, &other.warp), (&mut self.weft, &other.weft)] {
            update(target, source, |target, source| target + factor * source);
        }
    }

    /// self = factor * self + other
    pub fn scale_and_add(&mut self, factor: f64, other: &Self) {
        for (target, source) in [(&mut self.warp, &other.warp), (&mut self.weft, &other.weft)] {
            update(target, source, |target, source| factor * target + source);
        }
    }

    /// self = other
    pub fn copy_from(&mut self, other: &Self) {
        self.warp.copy_from_slice(&other.warp);
        self.weft.copy_from_slice(&other.weft);
    }

    /// self *= factor
    pub fn scale(&mut self, factor: f64) {
        for values in [&mut self.warp, &mut self.weft] {
            values.par_iter_mut().with_min_len(CHUNK).for_each(|value| *value *= factor);
        }
    }

    /// Warp less weft at each crossing, picks x ends.
    pub fn difference(&self, picks: usize, ends: usize) -> Vec<f64> {
        let mut difference = transpose(&self.warp, ends, picks);
        update(&mut difference, &self.weft, |warp, weft| warp - weft);
        difference
    }

    /// Adds `force`, picks x ends, to the warp, and takes it from the weft.
    pub fn add_opposed(&mut self, force: &[f64], picks: usize, ends: usize) {
        zip_transposed(&mut self.warp, force, picks, ends, |warp, force| warp + force);
        update(&mut self.weft, force, |weft, force| weft - force);
    }
}

fn update(target: &mut [f64], source: &[f64], value: impl Fn(f64, f64) -> f64 + Sync) {
    target
        .par_iter_mut()
        .zip(source)
        .with_min_len(CHUNK)
        .for_each(|(target, &source)| *target = value(*target, source));
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let products = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let sums: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(products).collect();
    sums.iter().sum()
}
