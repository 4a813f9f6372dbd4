//! Relaxed cloth, where its yarns overlap, and shapes with which they do not.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use super::describe::FabricDescription;
use super::gate;
use super::weave::{CurveArrays, curve_arrays};
use crate::cloth::clearance::Woven;
use crate::cloth::relaxed_cloth::{Curves, RelaxedCloth};
use crate::cloth::spec::YarnShape;
use crate::cloth::{digest, fitting};
use crate::memory;

/// A relaxed cloth, which scenes may share.
#[pyclass(frozen, weakref, module = "plycloth._plycloth")]
pub struct CompiledCloth(pub RelaxedCloth);

/// What a relaxation says of itself, and its curves.
type Heights<'py> = (f64, f64, u64, CurveArrays<'py>, CurveArrays<'py>);

#[pymethods]
impl CompiledCloth {
    /// Relaxes a fabric, unless it has heights; that is 100 units of progress.
    #[new]
    #[pyo3(signature = (fabric, threads=None, progress=None))]
    fn new(
        fabric: &Bound<'_, PyAny>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let spec = fabric.extract::<FabricDescription<'_>>()?.cloth()?;
        let heights = known_heights(fabric)?;
        let cloth = gate::run(fabric.py(), threads, progress, |control| match heights {
            Some(heights) => RelaxedCloth::with_heights(&spec, heights),
            None => RelaxedCloth::new(&spec, control),
        })?;
        Ok(Self(cloth))
    }

    /// Energy, gradient norm, iterations, and the curves of warp and weft in the pattern's order.
    fn heights<'py>(&self, py: Python<'py>) -> PyResult<Heights<'py>> {
        let (relaxed, pattern) = (&self.0.relaxed, &self.0.spec.pattern);
        let [warp, weft] = py.detach(|| self.0.heights())?;
        let warp = curve_arrays(py, warp, [pattern.ends, 2 * pattern.picks]);
        let weft = curve_arrays(py, weft, [pattern.picks, 2 * pattern.ends]);
        Ok((relaxed.energy, relaxed.gradient_norm, relaxed.iterations, warp, weft))
    }

    /// How deep yarns overlap at each crossing: picks x ends, in millimetres.
    #[pyo3(signature = (threads=None))]
    fn overlaps<'py>(
        &self,
        py: Python<'py>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let RelaxedCloth { spec, relaxed, .. } = &self.0;
        let depths = gate::run(py, threads, None, |control| {
            Woven::new(spec, relaxed, 1.0).overlaps(0.0, control)
        })?;
        let (picks, ends) = (spec.pattern.picks, spec.pattern.ends);
        let depths = depths.chunks_exact(ends).rev().collect::<Vec<_>>().concat();
        let array = Array2::from_shape_vec((picks, ends), depths);
        Ok(array.expect("there is a depth for each crossing").into_pyarray(py))
    }

    /// Whether yarns overlap anywhere by more than this part of the thinnest yarn's thickness: sooner
    /// found than how deep.
    #[pyo3(signature = (part, threads=None))]
    fn overlaps_beyond(&self, py: Python<'_>, part: f64, threads: Option<usize>) -> PyResult<bool> {
        let RelaxedCloth { spec, relaxed, .. } = &self.0;
        let (woven, depth) = (Woven::new(spec, relaxed, 1.0), part * spec.thinnest());
        let all = 0..spec.pattern.warp_up.len();
        Ok(!gate::run(py, threads, None, |control| woven.is_clear(all, depth, control))?)
    }
}

/// A number that fabrics share whose cloth is the same: optics and colours do not matter.
#[pyfunction]
pub fn cloth_digest(fabric: &Bound<'_, PyAny>) -> PyResult<u128> {
    let spec = fabric.extract::<FabricDescription<'_>>()?.cloth()?;
    Ok(digest::cloth_digest(&spec, known_heights(fabric)?.as_ref()))
}

/// The heights of warp and weft that a fabric has, in the pattern's order.
fn known_heights(fabric: &Bound<'_, PyAny>) -> PyResult<Option<[Curves; 2]>> {
    let heights = fabric.getattr("heights")?;
    if heights.is_none() {
        return Ok(None);
    }
    let values = |name: &str| -> PyResult<Vec<f64>> {
        let array: PyReadonlyArray2<'_, f64> = heights.getattr(name)?.extract()?;
        let array = array.as_array();
        let mut values = array.iter().copied();
        let next = || values.next().expect("as many as there are");
        Ok(memory::table("reading the heights of a fabric", array.len(), next)?)
    };
    Ok(Some([
        [values("warp_height")?, values("warp_slope")?],
        [values("weft_height")?, values("weft_slope")?],
    ]))
}

/// Of each kind of yarn.
type Measures = Vec<[f64; 3]>;

/// How wide and high the yarns are to be so that none overlap: for each kind of end and of pick half
/// the width, the thickness, and the collision radius, in millimetres; and whether none do.
#[pyfunction]
#[pyo3(signature = (fabric, threads=None, progress=None))]
pub fn fitted(
    py: Python<'_>,
    fabric: FabricDescription<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Measures, Measures, bool)> {
    let spec = fabric.cloth()?;
    let (fitted, clear) =
        gate::run(py, threads, progress, |control| fitting::fitted(&spec, control))?;
    let measures =
        |shape: &YarnShape| [shape.half_width(), shape.thickness(), shape.collision_radius()];
    let [warp, weft] =
        [fitted.warp, fitted.weft].map(|yarns| yarns.shapes().map(measures).collect());
    Ok((warp, weft, clear))
}
