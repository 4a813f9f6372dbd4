//! Where the yarns of a fabric overlap, and shapes with which they do not.

use std::borrow::Borrow;

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;

use super::describe::FabricDescription;
use super::gate;
use crate::cloth::clearance::Woven;
use crate::cloth::fitting;
use crate::cloth::spec::{ClothSpec, YarnShape};
use crate::control::Control;
use crate::error::Result;
use crate::weave::relax::{Relaxed, relax};

/// How deep yarns overlap at each crossing: picks x ends, in millimetres.
#[pyfunction]
#[pyo3(signature = (fabric, threads=None))]
pub fn overlaps<'py>(
    py: Python<'py>,
    fabric: FabricDescription<'_>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let spec = fabric.cloth()?.bottom_up();
    depths(py, threads, &spec, |control| relax(&spec.relax_problem(), control))
}

/// How wide and high the yarns are to be so that none overlap: for each kind of end and of pick half
/// the width, the thickness, and the collision radius, in millimetres.
#[pyfunction]
#[pyo3(signature = (fabric, threads=None, progress=None))]
pub fn fitted(
    py: Python<'_>,
    fabric: FabricDescription<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<[Vec<[f64; 3]>; 2]> {
    let spec = fabric.cloth()?;
    let fitted = gate::run(py, threads, progress, |control| fitting::fitted(&spec, control))?;
    let measures =
        |shape: &YarnShape| [shape.half_width(), shape.thickness(), shape.collision_radius()];
    Ok([fitted.warp, fitted.weft].map(|yarns| yarns.shapes().map(measures).collect()))
}

/// The depths of a cloth whose picks are counted from the bottom, in the order of its pattern.
pub fn depths<'py, R: Borrow<Relaxed>>(
    py: Python<'py>,
    threads: Option<usize>,
    spec: &ClothSpec,
    relaxed: impl FnOnce(&Control) -> Result<R> + Send,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mut depths = gate::run(py, threads, None, |control| {
        let relaxed = relaxed(control)?;
        Woven::new(spec, relaxed.borrow(), 1.0).overlaps(0.0, control)
    })?;
    let (picks, ends) = (spec.pattern.picks, spec.pattern.ends);
    depths = depths.chunks_exact(ends).rev().collect::<Vec<_>>().concat();
    let array = Array2::from_shape_vec((picks, ends), depths);
    Ok(array.expect("there is a depth for each crossing").into_pyarray(py))
}
