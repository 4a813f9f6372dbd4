//! The parameters of a ply as one row of numbers: where each starts, and how many there are.

/// eta.
pub const ETA: usize = 0;
/// k_x^S, three channels.
pub const SPECULAR_TINT: usize = 1;
/// k_y^S, three channels.
pub const TRANSMISSION_TINT: usize = 4;
/// k_x^B, three channels.
pub const BASE_COLOR: usize = 7;
/// k_y, three channels.
pub const TRANSMITTED_COLOR: usize = 10;
/// r.
pub const BODY_REFLECTION: usize = 13;
/// sigma_t.
pub const EXTINCTION: usize = 14;
/// beta_x, along and across.
pub const ROUGHNESS: usize = 15;
/// beta_y, along and across.
pub const EXIT_ROUGHNESS: usize = 17;
/// How many.
pub const COUNT: usize = 19;
