//! Which kind of description a Python object is.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The name of a type, and how its instances are read.
pub type Kind<T> = (&'static str, fn(&Bound<'_, PyAny>) -> PyResult<T>);

/// Reads an object as the kind that its type is by name, or that its type extends.
///
/// What attributes it has does not matter: a thing that looks like a light need not be one. `place`
/// is where the user put it, for the error.
pub fn one_of<T>(place: &str, object: &Bound<'_, PyAny>, kinds: &[Kind<T>]) -> PyResult<T> {
    for class in object.get_type().mro() {
        let name = class.cast::<PyType>()?.name()?;
        if let Some((_, read)) = kinds.iter().find(|(kind, _)| name == *kind) {
            return read(object);
        }
    }
    let valid: Vec<&str> = kinds.iter().map(|(kind, _)| *kind).collect();
    let given = object.get_type().name()?;
    let problem = format!("{place} must be a {}, not a value of type {given}", valid.join(" or "));
    Err(PyTypeError::new_err(problem))
}
