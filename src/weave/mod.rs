//! From a weave pattern to relaxed yarn heights (Montazeri et al. 2020, section 3.1).

pub mod curve;
pub mod energy;
pub mod pattern;
pub mod problem;
pub mod relax;
