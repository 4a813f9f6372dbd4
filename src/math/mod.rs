//! Numbers and frames that everything else stands on.

pub mod color;
pub mod dual;
pub mod extremes;
pub mod frame;
pub mod rng;
