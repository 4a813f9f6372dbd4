//! Drives the path tracer over a picture, in passes that can be stopped, looked at and gone on with.

use rayon::prelude::*;

use super::path::{NoRecorder, PathLimits, radiance};
use super::scene::Scene;
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::color::Rgb;
use crate::math::rng::Sampler;

/// Samples of a pixel between two looks at whether to stop.
const SAMPLES_PER_CHECK: u32 = 64;

/// What a pixel has gathered: sums over its samples, always in the order of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pixel {
    sum: Rgb,
    sum_of_squares: Rgb,
    samples: u32,
}

impl Pixel {
    /// The mean of the samples; zero before the first.
    pub fn mean(&self) -> Rgb {
        self.sum / f64::from(self.samples.max(1))
    }

    /// The variance of the mean, estimated from the samples; infinite before the second.
    pub fn variance(&self) -> Rgb {
        let n = f64::from(self.samples);
        if self.samples < 2 {
            return Rgb::INFINITY;
        }
        let centred = (self.sum_of_squares / n - self.mean() * self.mean()).max(Rgb::ZERO);
        centred / (n - 1.0)
    }

    fn add(&mut self, sample: Rgb) {
        self.sum += sample;
        self.sum_of_squares += sample * sample;
        self.samples += 1;
    }
}

/// A picture in the making. Every sample depends on (seed, pixel, sample) alone, so the picture is
/// the same bit for bit for any number of threads and passes.
#[derive(Debug)]
pub struct Film {
    seed: u64,
    limits: PathLimits,
    pixels: Vec<Pixel>,
    target: u32,
}

impl Film {
    /// An empty picture for `scene`.
    pub fn new(scene: &Scene, seed: u64, limits: PathLimits) -> Result<Self> {
        let [width, height] = scene.camera.resolution;
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(width * height).map_err(|_| {
            let problem = format!("of {width} x {height} pixels does not fit into memory");
            Error::invalid("camera.resolution", problem)
        })?;
        pixels.resize(width * height, Pixel::default());
        Ok(Self { seed, limits, pixels, target: 0 })
    }

    /// Takes `samples` more samples of every pixel. If stopped, what was gathered is kept, and the
    /// next run goes on from there. Reports progress in samples.
    pub fn run(&mut self, scene: &Scene, samples: u32, control: &Control) -> Result<()> {
        self.target = self.target.checked_add(samples).ok_or_else(|| {
            Error::invalid("spp", "the picture would have over 4294967295 samples")
        })?;
        let (seed, limits, target) = (self.seed, self.limits, self.target);
        let width = scene.camera.resolution[0];
        self.pixels.par_iter_mut().enumerate().with_max_len(64).try_for_each(|(i, pixel)| {
            while pixel.samples < target {
                control.check()?;
                let samples = pixel.samples..target.min(pixel.samples + SAMPLES_PER_CHECK);
                control.advance(samples.len() as u64);
                for sample in samples {
                    let mut sampler = Sampler::new(seed, i as u64, u64::from(sample));
                    let [dx, dy] = sampler.next_2d();
                    let ray = scene.camera.ray((i % width) as f64 + dx, (i / width) as f64 + dy);
                    pixel.add(radiance(scene, ray, limits, sampler, &mut NoRecorder));
                }
            }
            Ok(())
        })
    }

    /// The pixels, row by row from the top.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// How many samples a run of `samples` more per pixel would take.
    pub fn remaining(&self, samples: u32) -> u64 {
        let target = u64::from(self.target) + u64::from(samples);
        self.pixels.iter().map(|pixel| target - u64::from(pixel.samples)).sum()
    }

    /// Samples per pixel asked for so far.
    pub fn target(&self) -> u32 {
        self.target
    }
}
