//! Views, microfacets and averages that tests of lobes share.

use glam::DVec3;
use plycloth::math::dual::constant;
use plycloth::math::rng::Sampler;
use plycloth::scatter::dielectric::RoughDielectric;
use plycloth::scatter::ggx::Ggx;

use super::chi2::sphere_integral;

/// Chi-square tests of all lobes, for the common significance.
pub const TESTS: usize = 160;

/// Microfacets of these widths.
pub fn ggx([along, across]: [f64; 2]) -> Ggx {
    Ggx { along, across }
}

/// From the normal almost down to the horizon, at several azimuths.
pub fn views() -> [DVec3; 4] {
    [(0.0, 0.0), (0.6, 1.0), (1.1, 2.5), (1.45, -0.7)].map(|(theta, phi): (f64, f64)| {
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    })
}

/// The numbers of one sample.
pub fn random(number: usize) -> Sampler {
    Sampler::new(3, number as u64, 0)
}

/// The density of visible normals, over the whole sphere.
pub fn visible(ggx: &Ggx, w: DVec3, h: DVec3) -> f64 {
    let facing = h.z > 0.0 && w.dot(h) > 0.0;
    if facing { ggx.visible_normal_pdf(&constant(w), &constant(h)) } else { 0.0 }
}

/// Mean and standard error.
pub fn mean(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let values: Vec<_> = values.collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (variance / n).sqrt()]
}

pub fn agree([mean, error]: [f64; 2], expected: f64, name: &str) {
    let off = (mean - expected).abs();
    assert!(off < 4.5 * error + 1e-3 * expected, "{name}: {mean} +- {error}, not {expected}");
}

/// What is reflected and refracted of light that is seen from `wo`.
pub fn albedos(interface: &RoughDielectric, wo: DVec3) -> [f64; 2] {
    let wo = constant(wo);
    [
        sphere_integral(|wi| interface.reflection(&wo, &constant(wi))),
        sphere_integral(|wi| interface.refraction(&wo, &constant(wi))),
    ]
}
