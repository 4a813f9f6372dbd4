//! Recorded paths: a picture's cell averages as a smooth function of the optical parameters.
//!
//! Paths are drawn once, from the parameters that the tape was recorded with, together with all that
//! their vertices need. For other parameters every factor is f(new) / p(recorded): the averages then
//! are those of the new parameters in expectation, and their derivatives come from the same paths
//! without tracing a ray. By all parameters but eta they are the derivatives of these very averages. By
//! eta single paths jump where microfacets pass the horizon, and the derivatives are those of the
//! expectation instead (`scatter::dielectric`, `scatter::facet`).
//!
//! Memory grows with the number of path vertices.

mod differentiable;
pub mod parameter;
mod record;
mod replay;

use rayon::prelude::*;

use self::differentiable::Differentiable;
use self::record::{PATHS_PER_STRIP, Strip};
use self::replay::Sums;
use super::cells::Cells;
use super::scene::{Material, Scene};
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::color::Rgb;
use crate::scatter::ply::PlyParameters;

/// The recorded paths of a picture, cell by cell.
#[derive(Debug)]
pub struct Tape {
    /// Which paths were recorded.
    pub cells: Cells,
    materials: usize,
    /// For each cell in turn, [`Tape::strips_per_cell`].
    strips: Vec<Strip>,
}

/// Cell averages and their derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Averages {
    /// Cells (row by row) x 3.
    pub values: Vec<f64>,
    /// Cells x 3 x materials x [`parameter::COUNT`].
    pub jacobian: Vec<f64>,
}

impl Tape {
    /// Traces the paths through all cells; every material of the scene must be a ply. The paths of
    /// a cell are spread best if there are a power of two of them.
    pub fn record(scene: &Scene, cells: Cells, control: &Control) -> Result<Self> {
        if scene.materials.list.iter().any(|m| !matches!(m, Material::Ply(_))) {
            return Err(Error::invalid("scene", "has a yarn whose BSDF is not a PlyBsdf"));
        }
        let cells = cells.checked()?;
        let per_cell = cells.paths.div_ceil(PATHS_PER_STRIP) as usize;
        let strips = (0..cells.count() * per_cell)
            .into_par_iter()
            .map(|strip| {
                control.check()?;
                let first = (strip % per_cell) as u32 * PATHS_PER_STRIP;
                let range = first..cells.paths.min(first + PATHS_PER_STRIP);
                let strip = Strip::record(scene, &cells, strip / per_cell, range);
                control.advance(1);
                Ok(strip)
            })
            .collect::<Result<_>>()?;
        Ok(Self { cells, materials: scene.materials.list.len(), strips })
    }

    /// The cell averages for the given parameters of each material, and their derivatives.
    pub fn evaluate(&self, parameters: &[PlyParameters], control: &Control) -> Result<Averages> {
        if parameters.len() != self.materials {
            let problem = format!("has {} rows, not {}", parameters.len(), self.materials);
            return Err(Error::invalid("parameters", problem));
        }
        let models =
            parameters.iter().map(|p| Differentiable::new(*p)).collect::<Result<Vec<_>>>()?;
        let columns = models.len() * parameter::COUNT;
        let strips = self
            .strips
            .par_iter()
            .map(|strip| {
                control.check()?;
                let sums = Sums::over(strip, &models, 1.0 / f64::from(self.cells.paths));
                control.advance(1);
                Ok(sums)
            })
            .collect::<Result<Vec<_>>>()?;
        let mut averages = Averages {
            values: Vec::with_capacity(3 * self.cells.count()),
            jacobian: Vec::with_capacity(3 * columns * self.cells.count()),
        };
        for of_cell in strips.chunks_exact(self.strips_per_cell()) {
            averages.values.extend(of_cell.iter().map(|sums| sums.value).sum::<Rgb>().to_array());
            for channel in 0..3 {
                averages.jacobian.extend((0..columns).map(|column| {
                    of_cell.iter().map(|sums| sums.rows[channel][column]).sum::<f64>()
                }));
            }
        }
        Ok(averages)
    }

    fn strips_per_cell(&self) -> usize {
        self.cells.paths.div_ceil(PATHS_PER_STRIP) as usize
    }

    /// How many bytes the recorded paths take.
    pub fn bytes(&self) -> usize {
        self.strips.iter().map(Strip::bytes).sum()
    }
}
