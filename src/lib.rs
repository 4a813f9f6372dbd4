//! The core of plycloth: woven cloth from draft to picture.
//!
//! Floors, from the bottom up, each of which imports only from floors below it: [`math`] and
//! [`sampling`]; [`accel`]; [`weave`] and [`scatter`]; [`cloth`]; [`render`]; and the Python
//! bindings on top.

pub mod accel;
pub mod cloth;
pub mod control;
pub mod error;
pub mod image;
pub mod math;
pub mod memory;
pub mod render;
pub mod sampling;
pub mod scatter;
pub mod weave;

#[cfg(feature = "python")]
mod python;
