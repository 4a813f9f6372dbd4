//! The scattering models, evaluated for arrays of directions.

use glam::DVec3;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use super::describe::{PlyBsdfDescription, body_kind};
use super::gate;
use crate::error::{Error, Result};
use crate::math::color::Rgb;
use crate::math::rng::Sampler;
use crate::scatter::body::Body;
use crate::scatter::dielectric::RoughDielectric;
use crate::scatter::ggx::Ggx;
use crate::scatter::interface::Interface;
use crate::scatter::ply::PlyBsdf;
use crate::scatter::ribbon::Ribbon;

type Column<'py> = Bound<'py, PyArray1<f64>>;
type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// A rough dielectric interface.
#[pyclass(frozen, module = "plycloth._plycloth")]
pub struct CompiledInterface(Interface);

#[pymethods]
impl CompiledInterface {
    #[new]
    fn new(eta: f64, roughness: [f64; 2]) -> Self {
        let [along, across] = roughness;
        Self(Interface::new(RoughDielectric { eta, ggx: Ggx { along, across } }))
    }

    fn eval<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f64>,
        wi: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Column<'py>> {
        let pairs = pairs(&wo, &wi)?;
        Ok(for_each(py, &pairs, |_, &[wo, wi]| self.0.eval(wo, wi))?.into_pyarray(py))
    }

    fn pdf<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f64>,
        wi: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Column<'py>> {
        let pairs = pairs(&wo, &wi)?;
        Ok(for_each(py, &pairs, |_, &[wo, wi]| self.0.pdf(wo, wi))?.into_pyarray(py))
    }

    /// Directions (n x 3) and their densities (n), both zero where the sample failed.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Rows<'py>, Column<'py>)> {
        let pairs = pairs(&wo, &u)?;
        let samples = for_each(py, &pairs, |_, &[wo, u]| {
            let wi = self.0.sample(wo, u.to_array());
            wi.map_or((DVec3::ZERO, 0.0), |wi| (wi, self.0.pdf(wo, wi)))
        })?;
        let (directions, densities): (Vec<_>, Vec<_>) = samples.into_iter().unzip();
        Ok((to_rows(py, directions), densities.into_pyarray(py)))
    }
}

/// A ribbon of the ply BSDF.
#[pyclass(frozen, module = "plycloth._plycloth")]
pub struct CompiledRibbon(Ribbon);

#[pymethods]
impl CompiledRibbon {
    #[new]
    fn new(bsdf: PlyBsdfDescription, thickness_mm: f64) -> PyResult<Self> {
        let bsdf = PlyBsdf::new(bsdf.parameters(Rgb::ONE)?)?;
        Ok(Self(Ribbon::new(bsdf, thickness_mm)))
    }

    /// Values (n x 3) and densities (n), averaged over `passages`.
    fn eval<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f64>,
        wi: PyReadonlyArray2<'py, f64>,
        passages: u32,
        seed: u64,
    ) -> PyResult<(Rows<'py>, Column<'py>)> {
        let pairs = pairs(&wo, &wi)?;
        let values = for_each(py, &pairs, |row, &[wo, wi]| {
            self.0.eval(wo, wi, passages, &mut Sampler::new(seed, row as u64, 0))
        })?;
        let (values, densities): (Vec<_>, Vec<_>) = values.into_iter().unzip();
        Ok((to_rows(py, values), densities.into_pyarray(py)))
    }

    /// Directions and weights (n x 3), both zero where the light is lost.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f64>,
        seed: u64,
    ) -> PyResult<(Rows<'py>, Rows<'py>)> {
        let wo = vectors(&wo)?;
        let samples = for_each(py, &wo, |row, &wo| {
            let sample = self.0.sample(wo, &mut Sampler::new(seed, row as u64, 0));
            sample.unwrap_or((DVec3::ZERO, Rgb::ZERO))
        })?;
        let (directions, weights): (Vec<_>, Vec<_>) = samples.into_iter().unzip();
        Ok((to_rows(py, directions), to_rows(py, weights)))
    }
}

/// The body reflection (n x 3), per steradian, for pairs of cosines.
#[pyfunction]
pub fn body_reflection<'py>(
    py: Python<'py>,
    base_color: [f64; 3],
    cos_o: PyReadonlyArray1<'py, f64>,
    cos_i: PyReadonlyArray1<'py, f64>,
    eta: f64,
    body: &str,
) -> PyResult<Rows<'py>> {
    let kind = body_kind(body)?;
    let channels = base_color.map(|color| Body::new(kind, color, eta));
    let (cos_o, cos_i) = (cos_o.as_array(), cos_i.as_array());
    same_length(cos_o.len(), "cos_i", cos_i.len())?;
    let cosines: Vec<_> = cos_o.iter().copied().zip(cos_i.iter().copied()).collect();
    let values = for_each(py, &cosines, |_, &(cos_o, cos_i)| {
        Rgb::from_array([0, 1, 2].map(|channel| channels[channel].eval(cos_o, cos_i)))
    })?;
    Ok(to_rows(py, values))
}

/// `work` on each of `items` and its number, in parallel and without the GIL.
fn for_each<T: Sync, U: Send>(
    py: Python<'_>,
    items: &[T],
    work: impl Fn(usize, &T) -> U + Sync + Send,
) -> PyResult<Vec<U>> {
    gate::run(py, None, None, |control| {
        let each = |(row, item)| control.check().map(|()| work(row, item));
        items.par_iter().enumerate().map(each).collect()
    })
}

fn vectors(rows: &PyReadonlyArray2<'_, f64>) -> Result<Vec<DVec3>> {
    let rows = rows.as_array();
    if rows.ncols() != 3 {
        let problem = format!("have {} columns, but must be n x 3", rows.ncols());
        return Err(Error::invalid("directions", problem));
    }
    Ok(rows.rows().into_iter().map(|row| DVec3::new(row[0], row[1], row[2])).collect())
}

/// The rows of two arrays of `n` x 3 side by side.
fn pairs(
    first: &PyReadonlyArray2<'_, f64>,
    second: &PyReadonlyArray2<'_, f64>,
) -> Result<Vec<[DVec3; 2]>> {
    let (first, second) = (vectors(first)?, vectors(second)?);
    same_length(first.len(), "the second array", second.len())?;
    Ok(first.into_iter().zip(second).map(|(a, b)| [a, b]).collect())
}

fn same_length(expected: usize, name: &str, given: usize) -> Result<()> {
    if given == expected {
        return Ok(());
    }
    Err(Error::invalid(name, format!("has {given} rows, but must have {expected}")))
}

fn to_rows(py: Python<'_>, rows: Vec<DVec3>) -> Rows<'_> {
    let values = rows.iter().flat_map(|row| row.to_array()).collect();
    let array = Array2::from_shape_vec((rows.len(), 3), values);
    array.expect("a vector has three components").into_pyarray(py)
}
