//! Scenes, pictures and recorded paths.

use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray1, PyArray3, PyReadonlyArray1};
use pyo3::prelude::*;

use super::cloth::CompiledCloth;
use super::describe::{self, FabricDescription, PlyBsdfDescription};
use super::gate;
use crate::error::Result;
use crate::math::color::Rgb;
use crate::math::rng::Sampler;
use crate::render::camera::Camera;
use crate::render::cells::Cells;
use crate::render::driver::Film;
use crate::render::light::Lights;
use crate::render::path::PathLimits;
use crate::render::scene::Scene;
use crate::render::tape::{Tape, parameter};

/// Segments before Russian roulette sets in, as in Mitsuba.
const ROULETTE_DEPTH: u32 = 5;

/// How likely every lobe is at least in paths that are evaluated for other parameters.
const LOBE_FLOOR: f64 = 0.05;

/// Without a depth, roulette alone ends paths.
fn limits(max_depth: Option<u32>, both_sides: bool, lobe_floor: f64) -> PathLimits {
    let max_depth = max_depth.unwrap_or(u32::MAX);
    PathLimits { max_depth, roulette_depth: ROULETTE_DEPTH, both_sides, lobe_floor }
}

/// A scene, ready for rays.
#[pyclass(frozen, module = "plycloth._plycloth")]
pub struct CompiledScene {
    scene: Scene,
    camera: Camera,
}

#[pymethods]
impl CompiledScene {
    /// `cloth` is that of the scene's fabric.
    #[new]
    #[pyo3(signature = (scene, cloth, threads=None))]
    fn new(
        scene: &Bound<'_, PyAny>,
        cloth: &CompiledCloth,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let swatch = scene.getattr("swatch")?;
        let size: [f64; 2] = swatch.getattr("extent_mm")?.extract()?;
        let fabric_object = swatch.getattr("fabric")?;
        let fabric: FabricDescription<'_> = fabric_object.extract()?;
        let palette = fabric.palette();
        let camera = describe::camera("Scene.camera", &scene.getattr("camera")?)?;
        let lights = scene.getattr("lights")?;
        let light = |(number, light): (usize, PyResult<Bound<'_, PyAny>>)| {
            describe::light(&format!("Scene.lights[{number}]"), &light?)
        };
        let lights = lights.try_iter()?.enumerate().map(light).collect::<PyResult<_>>()?;
        let background = describe::background(scene)?;
        let (swatch, materials) = gate::run(scene.py(), threads, None, |control| {
            Ok((cloth.0.swatch(size)?, palette.materials(control)?))
        })?;
        let lights = Lights::new(lights);
        Ok(Self { scene: Scene { swatch, materials, lights, background }, camera })
    }

    /// Averages of the cells of a grid (columns, rows) over the picture: rows x columns x 3.
    #[pyo3(signature = (grid, paths, seed, max_depth, threads=None))]
    fn cell_averages<'py>(
        &self,
        py: Python<'py>,
        grid: [usize; 2],
        paths: u32,
        seed: u64,
        max_depth: Option<u32>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let cells = self.cells(grid, paths, seed, max_depth).checked()?;
        let averages =
            gate::run(py, threads, None, |control| cells.averages(&self.scene, control))?;
        let values = averages.iter().flat_map(Rgb::to_array).collect();
        let array = Array3::from_shape_vec((grid[1], grid[0], 3), values);
        Ok(array.expect("there is an average for each cell").into_pyarray(py))
    }
}

impl CompiledScene {
    /// Paths that may be evaluated for other parameters.
    fn cells(&self, grid: [usize; 2], paths: u32, seed: u64, max_depth: Option<u32>) -> Cells {
        let limits = limits(max_depth, true, LOBE_FLOOR);
        Cells { camera: self.camera, grid, paths, seed, limits }
    }
}

/// Means and variances of a picture.
type Picture<'py> = (Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<f32>>);

/// A picture in the making.
#[pyclass(frozen, module = "plycloth._plycloth")]
pub struct CompiledFilm {
    film: Film,
    resolution: [usize; 2],
}

#[pymethods]
impl CompiledFilm {
    #[new]
    #[pyo3(signature = (scene, seed, max_depth, both_sides))]
    fn new(
        scene: &CompiledScene,
        seed: u64,
        max_depth: Option<u32>,
        both_sides: bool,
    ) -> Result<Self> {
        let film = Film::new(scene.camera, seed, limits(max_depth, both_sides, 0.0))?;
        Ok(Self { film, resolution: scene.camera.resolution })
    }

    #[pyo3(signature = (scene, spp, threads=None, progress=None))]
    fn run(
        &self,
        py: Python<'_>,
        scene: &CompiledScene,
        spp: u32,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        gate::run(py, threads, progress, |control| self.film.run(&scene.scene, spp, control))
    }

    /// The means of the samples and the variances of these means, H x W x 3 each.
    fn image<'py>(&self, py: Python<'py>) -> PyResult<Picture<'py>> {
        let [width, height] = self.resolution;
        let [means, variances] = py.detach(|| self.film.image())?;
        let array = |values| {
            let array = Array3::from_shape_vec((height, width, 3), values);
            array.expect("a film has a pixel for each place").into_pyarray(py)
        };
        Ok((array(means), array(variances)))
    }

    /// Samples that every pixel has at least.
    #[getter]
    fn samples(&self, py: Python<'_>) -> u64 {
        py.detach(|| self.film.samples())
    }

    /// How many samples a run of `spp` would take: those of a run that was stopped, too.
    fn remaining(&self, py: Python<'_>, spp: u32) -> u64 {
        py.detach(|| self.film.remaining(spp))
    }

    /// Samples per pixel asked for so far, and all that was gathered.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<(u32, Bound<'py, PyArray1<u32>>)> {
        let words = py.detach(|| self.film.words())?;
        Ok((self.film.target(), words.into_pyarray(py)))
    }

    /// Takes over what a film of the same scene and seed had gathered.
    fn restore(&self, target: u32, words: PyReadonlyArray1<'_, u32>) -> PyResult<()> {
        Ok(self.film.restore(target, words.as_slice()?)?)
    }

    /// Adds what a film of the same scene, but another seed, has gathered.
    fn merge(&self, words: PyReadonlyArray1<'_, u32>) -> PyResult<()> {
        Ok(self.film.merge(words.as_slice()?)?)
    }
}

/// Cell averages, and their derivatives.
type Averages<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>);

/// Recorded paths.
#[pyclass(frozen, module = "plycloth._plycloth")]
pub struct CompiledTape(Tape);

#[pymethods]
impl CompiledTape {
    /// Numbers per material in a Jacobian.
    #[classattr]
    const PARAMETERS: usize = parameter::COUNT;

    /// The most paths per cell.
    #[classattr]
    const MAX_PATHS: u32 = Sampler::MAX_LOW_DISCREPANCY;

    #[new]
    #[pyo3(signature = (scene, grid, paths, seed, max_depth, threads=None, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        py: Python<'_>,
        scene: &CompiledScene,
        grid: [usize; 2],
        paths: u32,
        seed: u64,
        max_depth: Option<u32>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let cells = scene.cells(grid, paths, seed, max_depth);
        let tape =
            gate::run(py, threads, progress, |control| Tape::record(&scene.scene, cells, control))?;
        Ok(Self(tape))
    }

    /// Cell averages (rows x columns x 3) and their derivatives (cells * 3 x materials x
    /// parameters) for one `PlyBsdf` per material.
    #[pyo3(signature = (bsdfs, threads=None))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        bsdfs: Vec<PlyBsdfDescription>,
        threads: Option<usize>,
    ) -> PyResult<Averages<'py>> {
        let parameters =
            bsdfs.iter().map(|bsdf| bsdf.parameters(Rgb::ONE)).collect::<Result<Vec<_>>>()?;
        let averages =
            gate::run(py, threads, None, |control| self.0.evaluate(&parameters, control))?;
        let [columns, rows] = self.0.cells.grid;
        let shape = (3 * columns * rows, parameters.len(), parameter::COUNT);
        let values = Array3::from_shape_vec((rows, columns, 3), averages.values);
        let jacobian = Array3::from_shape_vec(shape, averages.jacobian);
        let well_formed = "averages have a row for each cell and channel";
        Ok((
            values.expect(well_formed).into_pyarray(py),
            jacobian.expect(well_formed).into_pyarray(py),
        ))
    }

    /// Memory of the recorded paths in bytes.
    #[getter]
    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}
