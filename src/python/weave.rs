//! Weave patterns and their relaxation.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::gate;
use crate::cloth::relaxed_cloth::Curves;
use crate::weave::curve::HeightCurves;
use crate::weave::pattern::WeavePattern;
use crate::weave::problem::{RelaxProblem, YarnData};
use crate::weave::relax::relax as relax_cell;

/// Radius, stiffness and spacing, one value per yarn.
type YarnArrays<'py> =
    (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);

/// Heights and slopes, yarns x knots.
pub type CurveArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Relaxes one cell, which is 100 units of progress: (energy, gradient norm, iterations, warp curves, weft curves).
#[pyfunction]
#[pyo3(signature = (warp_up, warp, weft, collision_stiffness, progress=None))]
pub fn relax<'py>(
    py: Python<'py>,
    warp_up: PyReadonlyArray2<'py, bool>,
    warp: YarnArrays<'py>,
    weft: YarnArrays<'py>,
    collision_stiffness: f64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(f64, f64, u64, CurveArrays<'py>, CurveArrays<'py>)> {
    let warp_up = warp_up.as_array();
    let (picks, ends) = warp_up.dim();
    let problem = RelaxProblem {
        pattern: WeavePattern::new(picks, ends, warp_up.iter().copied().collect())?,
        warp: yarn_set(warp),
        weft: yarn_set(weft),
        collision_stiffness,
    };
    let relaxed = gate::run(py, None, progress, |control| relax_cell(&problem, control))?;
    let arrays = |curves: HeightCurves| {
        let shape = [curves.len(), curves.knots.len()];
        curve_arrays(py, [curves.height, curves.slope], shape)
    };
    let (warp, weft) = (arrays(relaxed.warp), arrays(relaxed.weft));
    Ok((relaxed.energy, relaxed.gradient_norm, relaxed.iterations, warp, weft))
}

fn yarn_set((radius, stiffness, spacing): YarnArrays<'_>) -> YarnData {
    let values = |array: PyReadonlyArray1<'_, f64>| array.as_array().to_vec();
    YarnData { radius: values(radius), stiffness: values(stiffness), spacing: values(spacing) }
}

/// Heights and slopes as arrays of yarns x knots.
pub fn curve_arrays(py: Python<'_>, [height, slope]: Curves, shape: [usize; 2]) -> CurveArrays<'_> {
    let array = |values| {
        let array = Array2::from_shape_vec(shape, values);
        array.expect("one value for each yarn and knot").into_pyarray(py)
    };
    (array(height), array(slope))
}
