//! Random numbers and directions for the integration tests.

use glam::DVec3;
use plycloth::math::rng::Sampler;
use plycloth::sampling::warp::square_to_sphere;

/// A direction, uniform over the sphere.
pub fn direction(sampler: &mut Sampler) -> DVec3 {
    square_to_sphere(sampler.next_2d())
}

/// A number between two positive ones, uniform in its logarithm.
pub fn draw(sampler: &mut Sampler, [low, high]: [f64; 2]) -> f64 {
    low * (high / low).powf(sampler.next_1d())
}
