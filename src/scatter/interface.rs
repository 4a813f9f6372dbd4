//! A rough interface as a function of two directions, each on either side: both branches of Eqs. 8
//! and 10 of Montazeri et al. 2020 in one.

use glam::DVec3;

use super::dielectric::RoughDielectric;
use super::fresnel::fresnel;
use crate::math::dual::{constant, dot, normalized};

/// A rough dielectric interface that light meets from above or from below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface(RoughDielectric);

impl Interface {
    /// The interface that `dielectric` describes as seen from above.
    pub fn new(dielectric: RoughDielectric) -> Self {
        Self(dielectric)
    }

    /// The scattering from `wo` into `wi` with the cosine of `wi`, in the form that keeps energy.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        let Some((side, [wo, wi])) = self.seen_from(wo, [wo, wi]) else { return 0.0 };
        let (wo, wi) = (constant(wo), constant(wi));
        side.reflection(&wo, &wi) + side.refraction(&wo, &wi)
    }

    /// The density of [`Interface::sample`].
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        let Some((side, [wo, wi])) = self.seen_from(wo, [wo, wi]) else { return 0.0 };
        let (o, i) = (constant(wo), constant(wi));
        if wi.z > 0.0 {
            let h = normalized(&[o[0] + i[0], o[1] + i[1], o[2] + i[2]]);
            return fresnel(dot(&o, &h), side.eta) * side.reflection_pdf(&o, &i);
        }
        let sum = constant(wo + side.eta * wi);
        let cosine = dot(&o, &normalized(&sum)).abs();
        (1.0 - fresnel(cosine, side.eta)) * side.refraction_pdf(&o, &i)
    }

    /// A direction in which a visible microfacet mirrors or refracts `wo`, in the proportions that
    /// its Fresnel term gives; `None` if the light meets the interface a second time.
    pub fn sample(&self, wo: DVec3, [choice, u, v]: [f64; 3]) -> Option<DVec3> {
        let (side, [local]) = self.seen_from(wo, [wo])?;
        let h = side.ggx.sample_visible_normal(local, [u, v]);
        let wi = if choice < fresnel(local.dot(h), side.eta) {
            side.sample_reflection(local, [u, v])
        } else {
            side.sample_refraction(local, [u, v])
        };
        wi.map(|wi| if wo.z > 0.0 { wi } else { mirrored(wi) })
    }

    /// The interface and `directions`, turned so that `wo` is above; `None` at grazing `wo`.
    fn seen_from<const N: usize>(
        &self,
        wo: DVec3,
        directions: [DVec3; N],
    ) -> Option<(RoughDielectric, [DVec3; N])> {
        if wo.z > 0.0 {
            Some((self.0, directions))
        } else if wo.z < 0.0 {
            let side = RoughDielectric { eta: self.0.eta.recip(), ..self.0 };
            Some((side, directions.map(mirrored)))
        } else {
            None
        }
    }
}

fn mirrored(w: DVec3) -> DVec3 {
    DVec3::new(w.x, w.y, -w.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Sampler;
    use crate::sampling::warp::{SPHERE_PDF, square_to_sphere};
    use crate::scatter::ggx::Ggx;

    /// Uniform samples of the sphere: the density integrates to the part of the samples that do
    /// not fail, and the value to the same as the sampled weights.
    #[test]
    fn value_and_density_agree_with_samples_on_both_sides() {
        let ggx = Ggx { along: 0.3, across: 0.6 };
        let interface = Interface::new(RoughDielectric { eta: 1.5, ggx });
        for wo in [DVec3::new(0.5, 0.3, 0.4), DVec3::new(0.5, 0.3, -0.9)].map(DVec3::normalize) {
            let n = 400_000;
            let (mut value, mut density, mut hits, mut weights) = (0.0, 0.0, 0.0, 0.0);
            for i in 0..n {
                let mut sampler = Sampler::new(1, 0, i);
                let wi = square_to_sphere(sampler.next_2d());
                value += interface.eval(wo, wi) / SPHERE_PDF;
                density += interface.pdf(wo, wi) / SPHERE_PDF;
                let [u, v] = sampler.next_2d();
                if let Some(wi) = interface.sample(wo, [sampler.next_1d(), u, v]) {
                    hits += 1.0;
                    weights += interface.eval(wo, wi) / interface.pdf(wo, wi);
                }
            }
            // Uniform samples of a peak of this width leave an error of about 0.005.
            let n = n as f64;
            assert!((density / n - hits / n).abs() < 0.02, "{} {}", density / n, hits / n);
            assert!((value / n - weights / n).abs() < 0.02, "{} {}", value / n, weights / n);
        }
    }
}
