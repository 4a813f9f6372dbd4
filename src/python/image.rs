//! OpenEXR between bytes and arrays.

use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::image::{self, RgbImage};

#[pyfunction]
pub fn decode_exr<'py>(py: Python<'py>, data: &[u8]) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let image = py.detach(|| image::decode_exr(data))?;
    let pixels = Array3::from_shape_vec((image.height, image.width, 3), image.values)
        .expect("an RgbImage holds three values per pixel");
    Ok(pixels.into_pyarray(py))
}

#[pyfunction]
pub fn encode_exr<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyBytes>> {
    let pixels = pixels.as_array();
    let (height, width, channels) = pixels.dim();
    if channels != 3 {
        let problem = format!("has {channels} channels, but must be H x W x 3");
        return Err(crate::error::Error::invalid("pixels", problem).into());
    }
    let image = RgbImage::new(width, height, pixels.iter().copied().collect())?;
    let data = py.detach(|| image::encode_exr(&image))?;
    Ok(PyBytes::new(py, &data))
}
