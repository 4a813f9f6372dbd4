//! Warps of the unit square, each beside its density.

pub mod distribution;
pub mod warp;
