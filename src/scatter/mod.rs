//! How light scatters off a ply: local frames only, one file per model.

pub mod aim;
pub mod body;
mod chandrasekhar;
pub mod dielectric;
mod diffusion;
pub mod facet;
pub mod fresnel;
pub mod ggx;
pub mod halo;
pub mod interface;
pub mod passage;
pub mod ply;
pub mod ribbon;
