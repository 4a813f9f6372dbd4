//! Rays against shapes, and the hierarchy that finds the shapes.

pub mod bilinear;
pub mod bounds;
pub mod bvh;
pub mod cylinder;
pub mod cylinder_pair;
pub mod ray;
