//! Thin wrappers: each turns Python values into the core's, calls it, and turns the answer back.

use pyo3::prelude::*;

mod cloth;
mod describe;
mod gate;
mod image;
mod kind;
mod render;
mod scatter;
mod weave;

#[pymodule]
mod _plycloth {
    use super::*;

    #[pymodule_export]
    use super::cloth::{CompiledCloth, cloth_digest, fitted};
    #[pymodule_export]
    use super::gate::ConvergenceError;
    #[pymodule_export]
    use super::image::{decode_codes, decode_exr, decode_radiance, encode_exr, to_srgb};
    #[pymodule_export]
    use super::render::{CompiledFilm, CompiledScene, CompiledTape};
    #[pymodule_export]
    use super::scatter::{CompiledInterface, CompiledRibbon, body_reflection};
    #[pymodule_export]
    use super::weave::relax;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
