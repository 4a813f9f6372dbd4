//! Picture files between bytes and arrays.

use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::Error;
use crate::image::{self, Format, RgbImage};

type Pixels<'py> = Bound<'py, PyArray3<f32>>;

/// The pixels, and the names of other layers that could have been meant.
#[pyfunction]
#[pyo3(signature = (data, layer=None))]
pub fn decode_exr<'py>(
    py: Python<'py>,
    data: &[u8],
    layer: Option<&str>,
) -> PyResult<(Pixels<'py>, String, Vec<String>)> {
    let decoded = py.detach(|| image::decode_exr(data, layer))?;
    Ok((rgb(py, decoded.image), decoded.layer, decoded.others))
}

#[pyfunction]
#[pyo3(signature = (pixels, dpi=None))]
pub fn encode_exr<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'py, f32>,
    dpi: Option<f32>,
) -> PyResult<Bound<'py, PyBytes>> {
    let pixels = pixels.as_array();
    let (height, width, channels) = pixels.dim();
    if channels != 3 {
        let problem = format!("has {channels} channels, but must be H x W x 3");
        return Err(Error::invalid("pixels", problem).into());
    }
    let image = RgbImage::new(width, height, pixels.iter().copied().collect())?;
    let data = py.detach(|| image::encode_exr(&image, dpi))?;
    Ok(PyBytes::new(py, &data))
}

#[pyfunction]
pub fn decode_radiance<'py>(py: Python<'py>, data: &[u8]) -> PyResult<Pixels<'py>> {
    Ok(rgb(py, py.detach(|| image::decode_radiance(data))?))
}

/// Codes (height x width x 1 or 3), and whether they were floats.
#[pyfunction]
pub fn decode_codes<'py>(
    py: Python<'py>,
    data: &[u8],
    format: &str,
) -> PyResult<(Pixels<'py>, bool)> {
    let format = match format {
        "PNG" => Format::Png,
        "TIFF" => Format::Tiff,
        other => {
            let problem = format!("is '{other}', but must be 'PNG' or 'TIFF'");
            return Err(Error::invalid("format", problem).into());
        }
    };
    let codes = py.detach(|| image::decode_codes(data, format))?;
    let pixels = array(py, [codes.height, codes.width, codes.channels], codes.values);
    Ok((pixels, codes.is_float))
}

/// Codes of sRGB (height x width x 3) for codes of 1 or 3 channels with an ICC profile.
#[pyfunction]
pub fn to_srgb<'py>(
    py: Python<'py>,
    codes: PyReadonlyArray3<'py, f32>,
    profile: &[u8],
) -> PyResult<Pixels<'py>> {
    let codes = codes.as_array();
    let (height, width, channels) = codes.dim();
    let values: Vec<f32> = codes.iter().copied().collect();
    let srgb = py.detach(|| image::to_srgb(&values, channels, profile))?;
    Ok(array(py, [height, width, 3], srgb))
}

fn rgb(py: Python<'_>, image: RgbImage) -> Pixels<'_> {
    array(py, [image.height, image.width, 3], image.values)
}

fn array(py: Python<'_>, shape: [usize; 3], values: Vec<f32>) -> Pixels<'_> {
    let pixels = Array3::from_shape_vec(shape, values);
    pixels.expect("a picture holds a value per pixel and channel").into_pyarray(py)
}
