//! Cloth as geometry: relaxed yarns, their plies, and the walk of a ray through a swatch.

pub mod block;
mod blocks;
mod center_line;
pub mod clearance;
pub mod digest;
pub mod fitting;
pub mod grid;
pub mod inside;
mod layout;
pub mod relaxed_cloth;
pub mod spec;
pub mod swatch;
pub mod tile;
pub mod twist;
pub mod yarn_path;
