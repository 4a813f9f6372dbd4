//! Paths through the cells of a grid that divides a picture.

use rayon::prelude::*;

use super::camera::Camera;
use super::path::{PathLimits, radiance};
use super::recorder::{NoRecorder, Recorder};
use super::scene::Scene;
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::color::Rgb;
use crate::math::rng::Sampler;

/// Paths between two looks at whether to stop.
const PATHS_PER_CHECK: u32 = 1024;

/// Which paths go through the cells of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    /// Whose picture it is.
    pub camera: Camera,
    /// Columns and rows.
    pub grid: [usize; 2],
    /// Paths through each cell.
    pub paths: u32,
    /// Grids with different seeds have independent paths.
    pub seed: u64,
    /// How far paths are followed.
    pub limits: PathLimits,
}

impl Cells {
    /// Passes the cells on if they have 1 to [`Sampler::MAX_LOW_DISCREPANCY`] paths each.
    pub fn checked(self) -> Result<Self> {
        let (paths, most) = (self.paths, Sampler::MAX_LOW_DISCREPANCY);
        if paths == 0 || paths > most {
            return Err(Error::invalid("paths", format!("must be 1 to {most}, not {paths}")));
        }
        Ok(self)
    }

    /// How many cells there are.
    pub fn count(&self) -> usize {
        self.grid[0] * self.grid[1]
    }

    /// Traces one of the paths through a cell, and answers what arrives along it.
    pub fn trace<R: Recorder>(
        &self,
        scene: &Scene,
        cell: usize,
        path: u32,
        recorder: &mut R,
    ) -> Rgb {
        let [width, height] = self.camera.resolution;
        let size = [width as f64 / self.grid[0] as f64, height as f64 / self.grid[1] as f64];
        let corner = [cell % self.grid[0], cell / self.grid[0]];
        let mut sampler = Sampler::low_discrepancy(self.seed, cell as u64, path);
        let within = sampler.next_2d();
        let [x, y] = [0, 1].map(|axis| (corner[axis] as f64 + within[axis]) * size[axis]);
        radiance(scene, self.camera.ray(x, y), self.limits, sampler, recorder)
    }

    /// The average of each cell, row by row.
    pub fn averages(&self, scene: &Scene, control: &Control) -> Result<Vec<Rgb>> {
        let cells = (0..self.count()).into_par_iter();
        cells.map(|cell| self.average(scene, cell, control)).collect()
    }

    fn average(&self, scene: &Scene, cell: usize, control: &Control) -> Result<Rgb> {
        let mut sum = Rgb::ZERO;
        for path in 0..self.paths {
            if path % PATHS_PER_CHECK == 0 {
                control.check()?;
            }
            sum += self.trace(scene, cell, path, &mut NoRecorder);
        }
        Ok(sum / f64::from(self.paths))
    }
}
