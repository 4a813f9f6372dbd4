//! Drives the path tracer over a picture, in passes that can be stopped, looked at and gone on with.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use super::camera::Camera;
use super::path::{PathLimits, radiance};
use super::pixel::{Pixel, WORDS};
use super::recorder::NoRecorder;
use super::scene::Scene;
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::rng::{Sampler, mix};

/// Pixels, in reading order, that one thread at a time works on.
const TILE: usize = 64;

/// Words that a tile is saved as: its samples, those of others (low and high half), its pixels.
const TILE_WORDS: usize = 3 + WORDS * TILE;

/// Some pixels with equally many samples each.
#[derive(Debug, Clone, Default)]
struct Tile {
    /// Samples that were taken here, which are the first so many of the seed's.
    own: u32,
    /// Samples that were merged in.
    others: u64,
    pixels: Pixels,
}

/// An array of so many has no `Default`.
#[derive(Debug, Clone)]
struct Pixels([Pixel; TILE]);

impl Default for Pixels {
    fn default() -> Self {
        Self([Pixel::default(); TILE])
    }
}

impl Tile {
    fn count(&self) -> u64 {
        u64::from(self.own) + self.others
    }

    /// Adds the next sample of each pixel.
    fn add(&mut self, samples: &[[f32; 3]], random: impl Fn(usize) -> u64) {
        self.own += 1;
        let count = self.count();
        for (i, (pixel, sample)) in self.pixels.0.iter_mut().zip(samples).enumerate() {
            pixel.add(*sample, count, random(i));
        }
    }

    fn merge(&mut self, other: &Self) {
        for (pixel, theirs) in self.pixels.0.iter_mut().zip(&other.pixels.0) {
            pixel.merge(u64::from(self.own) + self.others, theirs, other.count());
        }
        self.others += other.count();
    }

    fn words(&self) -> impl Iterator<Item = u32> + '_ {
        let head = [self.own, self.others as u32, (self.others >> 32) as u32];
        head.into_iter().chain(self.pixels.0.iter().flat_map(|pixel| pixel.to_words()))
    }

    fn from_words(words: &[u32]) -> Self {
        let (head, pixels) = words.split_at(TILE_WORDS - WORDS * TILE);
        let mut tile = Self {
            own: head[0],
            others: u64::from(head[2]) << 32 | u64::from(head[1]),
            pixels: Pixels::default(),
        };
        for (pixel, words) in tile.pixels.0.iter_mut().zip(pixels.chunks_exact(WORDS)) {
            *pixel = Pixel::from_words([0, 1, 2, 3, 4].map(|i| words[i]));
        }
        tile
    }
}

/// A picture in the making. Every sample depends on (seed, pixel, sample) alone, and a pixel takes
/// its samples in their order, so the picture is the same bit for bit for any number of threads and
/// passes. It may be looked at, saved and merged with another from any thread, also during a run.
#[derive(Debug)]
pub struct Film {
    camera: Camera,
    seed: u64,
    limits: PathLimits,
    tiles: Vec<Mutex<Tile>>,
    target: AtomicU32,
}

impl Film {
    /// An empty picture of what `camera` sees.
    pub fn new(camera: Camera, seed: u64, limits: PathLimits) -> Result<Self> {
        let [width, height] = camera.resolution;
        let count = (width * height).div_ceil(TILE);
        let mut tiles = reserved(count, [width, height])?;
        tiles.resize_with(count, Mutex::default);
        let target = AtomicU32::new(0);
        Ok(Self { camera, seed, limits, tiles, target })
    }

    /// Takes `samples` more samples of every pixel, one of all before the next of any. If stopped,
    /// what was gathered is kept, and the next run goes on from there. Reports progress in samples.
    pub fn run(&self, scene: &Scene, samples: u32, control: &Control) -> Result<()> {
        let target = self.raise_target(samples)?;
        let tiles = self.tiles.len() as u64;
        let passes = target.saturating_sub(self.least(|tile| tile.own));
        let visits = u64::from(passes) * tiles;
        let next = AtomicU64::new(0);
        let results = rayon::broadcast(|_| {
            let _guard = StopIfPanicking(control);
            loop {
                let visit = next.fetch_add(1, Ordering::Relaxed);
                if visit >= visits {
                    return Ok(());
                }
                control.check()?;
                control.advance(self.visit(scene, (visit % tiles) as usize, target));
            }
        });
        results.into_iter().collect()
    }

    fn raise_target(&self, samples: u32) -> Result<u32> {
        let raised = |target: u32| target.checked_add(samples);
        let before = self.target.fetch_update(Ordering::Relaxed, Ordering::Relaxed, raised);
        before
            .map(|before| before + samples)
            .map_err(|_| Error::invalid("spp", "the picture would have over 4294967295 samples"))
    }

    /// Takes the next sample of each pixel of a tile, unless it has `target`; answers how many.
    fn visit(&self, scene: &Scene, number: usize, target: u32) -> u64 {
        let mut tile = self.tile(number);
        if tile.own >= target {
            return 0;
        }
        let (first, sample) = (number * TILE, tile.own);
        let mut values = [[0.0; 3]; TILE];
        let values = &mut values[..self.pixels_of(number)];
        // A panic in here leaves the tile as it was.
        for (i, value) in values.iter_mut().enumerate() {
            *value = self.trace(scene, first + i, sample);
        }
        tile.add(values, |i| mix(mix((first + i) as u64) ^ u64::from(sample)));
        values.len() as u64
    }

    fn trace(&self, scene: &Scene, pixel: usize, sample: u32) -> [f32; 3] {
        let width = self.camera.resolution[0];
        let mut sampler = Sampler::new(self.seed, pixel as u64, u64::from(sample));
        let [dx, dy] = sampler.next_2d();
        let ray = self.camera.ray((pixel % width) as f64 + dx, (pixel / width) as f64 + dy);
        radiance(scene, ray, self.limits, sampler, &mut NoRecorder).as_vec3().to_array()
    }

    /// The picture as it is now, row by row from the top: means of the samples, and the variances of
    /// these means, which are infinite before the second sample.
    pub fn image(&self) -> Result<[Vec<f32>; 2]> {
        let count = 3 * self.camera.resolution[0] * self.camera.resolution[1];
        let mut means = reserved(count, self.camera.resolution)?;
        let mut variances = reserved(count, self.camera.resolution)?;
        for number in 0..self.tiles.len() {
            let tile = self.tile(number);
            let is_known = tile.count() > 1;
            for pixel in &tile.pixels.0[..self.pixels_of(number)] {
                means.extend(pixel.mean());
                variances.extend(if is_known { pixel.variance() } else { [f32::INFINITY; 3] });
            }
        }
        Ok([means, variances])
    }

    /// Samples that every pixel has at least.
    pub fn samples(&self) -> u64 {
        self.least(Tile::count)
    }

    /// Samples per pixel asked for so far, without those merged in.
    pub fn target(&self) -> u32 {
        self.target.load(Ordering::Relaxed)
    }

    /// How many samples a run of `samples` more per pixel would take.
    pub fn remaining(&self, samples: u32) -> u64 {
        let target = u64::from(self.target()) + u64::from(samples);
        let of_tile = |number| {
            let left = target.saturating_sub(u64::from(self.tile(number).own));
            left * self.pixels_of(number) as u64
        };
        (0..self.tiles.len()).map(of_tile).sum()
    }

    /// All that was gathered, to be restored or merged.
    pub fn words(&self) -> Result<Vec<u32>> {
        let mut words = reserved(self.tiles.len() * TILE_WORDS, self.camera.resolution)?;
        for number in 0..self.tiles.len() {
            words.extend(self.tile(number).words());
        }
        Ok(words)
    }

    /// Puts what another picture of the same scene and seed had gathered in place of what is here.
    pub fn restore(&self, target: u32, words: &[u32]) -> Result<()> {
        self.each_saved(words, |tile, saved| *tile = saved)?;
        self.target.store(target, Ordering::Relaxed);
        Ok(())
    }

    /// Adds what another picture of the same scene has gathered, with another seed.
    pub fn merge(&self, words: &[u32]) -> Result<()> {
        self.each_saved(words, |tile, saved| tile.merge(&saved))
    }

    fn each_saved(&self, words: &[u32], take: impl Fn(&mut Tile, Tile)) -> Result<()> {
        let expected = self.tiles.len() * TILE_WORDS;
        if words.len() != expected {
            let problem = format!("has {} words, but must have {expected}", words.len());
            return Err(Error::invalid("samples", problem));
        }
        for (number, words) in words.chunks_exact(TILE_WORDS).enumerate() {
            take(&mut self.tile(number), Tile::from_words(words));
        }
        Ok(())
    }

    fn least<T: Ord + Default>(&self, of: impl Fn(&Tile) -> T) -> T {
        (0..self.tiles.len()).map(|number| of(&self.tile(number))).min().unwrap_or_default()
    }

    /// A tile is changed all at once, after all that could panic: one that a panic poisoned is whole.
    fn tile(&self, number: usize) -> MutexGuard<'_, Tile> {
        self.tiles[number].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many pixels a tile has: the last one may have fewer.
    fn pixels_of(&self, number: usize) -> usize {
        TILE.min(self.camera.resolution[0] * self.camera.resolution[1] - number * TILE)
    }
}

/// Lets the other threads end soon if this one panics.
struct StopIfPanicking<'a>(&'a Control);

impl Drop for StopIfPanicking<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.stop();
        }
    }
}

/// Room for `count` values, or an error that says what picture it was for.
fn reserved<T>(count: usize, [width, height]: [usize; 2]) -> Result<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| {
        let problem = format!("of {width} x {height} pixels does not fit into memory");
        Error::invalid("camera.resolution", problem)
    })?;
    Ok(values)
}
