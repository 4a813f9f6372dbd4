//! Chi-square tests of directions against the density that they should have.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use plycloth::math::rng::Sampler;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Bins over the sphere, of equal angles: polar and azimuth.
const BINS: [usize; 2] = [24, 24];

/// Points per bin and axis at which the density is summed.
const POINTS: usize = 32;

/// Samples drawn.
const SAMPLES: usize = 100_000;

/// Bins that expect fewer samples are pooled.
const LEAST_EXPECTED: f64 = 5.0;

/// Fails unless `draws` directions of `sample` are distributed as `pdf` says, with the given
/// significance over `tests` tests together (Sidak). `None` is a loss: one more bin, with what the
/// density leaves.
pub fn check(
    name: &str,
    tests: usize,
    pdf: impl Fn(DVec3) -> f64,
    mut sample: impl FnMut(usize) -> Option<DVec3>,
) {
    let mut observed = vec![0.0; BINS[0] * BINS[1] + 1];
    for number in 0..SAMPLES {
        observed[sample(number).map_or(BINS[0] * BINS[1], bin)] += 1.0;
    }
    let mut expected: Vec<_> = (0..BINS[0] * BINS[1]).map(|bin| integrate(bin, &pdf)).collect();
    let total: f64 = expected.iter().sum();
    assert!(total < 1.002, "{name}: the density integrates to {total}");
    expected.push((1.0 - total).max(0.0));
    let p = p_value(&observed, &expected);
    let significance = 1.0 - 0.99f64.powf(1.0 / tests as f64);
    assert!(p > significance, "{name}: p = {p:.3e}, the density integrates to {total:.5}");
}

/// The integral of `f` over all directions.
pub fn sphere_integral(f: impl Fn(DVec3) -> f64) -> f64 {
    (0..BINS[0] * BINS[1]).map(|bin| integrate(bin, &f)).sum()
}

fn p_value(observed: &[f64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells, mut pooled) = (0.0, 0, [0.0; 2]);
    for (&observed, &expected) in observed.iter().zip(expected) {
        let expected = expected * SAMPLES as f64;
        if expected < LEAST_EXPECTED {
            pooled = [pooled[0] + observed, pooled[1] + expected];
        } else {
            statistic += (observed - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if pooled[1] >= LEAST_EXPECTED {
        statistic += (pooled[0] - pooled[1]).powi(2) / pooled[1];
        cells += 1;
    } else if pooled[0] > 12.0 * LEAST_EXPECTED {
        return 0.0;
    }
    1.0 - ChiSquared::new(f64::from(cells - 1)).unwrap().cdf(statistic)
}

fn bin(direction: DVec3) -> usize {
    let theta = direction.z.clamp(-1.0, 1.0).acos() / PI;
    let phi = direction.y.atan2(direction.x).rem_euclid(TAU) / TAU;
    let cell = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
    cell(theta, BINS[0]) * BINS[1] + cell(phi, BINS[1])
}

/// The integral of `f` over a bin, at jittered points: densities may end with a jump, which a regular
/// grid measures badly.
fn integrate(bin: usize, f: &impl Fn(DVec3) -> f64) -> f64 {
    let mut sampler = Sampler::new(17, bin as u64, 0);
    let mut place = |index: usize, cell: usize, n: usize| {
        ((index as f64 + sampler.next_1d()) / POINTS as f64 + cell as f64) / n as f64
    };
    let sum: f64 = (0..POINTS * POINTS)
        .map(|k| {
            let (sin, cos) = (PI * place(k / POINTS, bin / BINS[1], BINS[0])).sin_cos();
            let phi = TAU * place(k % POINTS, bin % BINS[1], BINS[1]);
            f(DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)) * sin
        })
        .sum();
    sum * PI * TAU / (BINS[0] * BINS[1] * POINTS * POINTS) as f64
}
