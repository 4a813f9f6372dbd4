//! A ribbon: a ply whose x and y are one point (Montazeri et al. 2020, section 4.3), and so a
//! function of two directions, averaged over the passages between them.

use glam::DVec3;

use super::ply::{Choice, Crossing, PlyBsdf};
use crate::math::color::Rgb;
use crate::math::rng::Sampler;

/// A ribbon of the ply BSDF; it looks the same from above and from below.
#[derive(Debug)]
pub struct Ribbon {
    bsdf: PlyBsdf,
    /// h of Eq. 15, in millimetres.
    thickness: f64,
}

impl Ribbon {
    /// A ribbon of the given thickness.
    pub fn new(bsdf: PlyBsdf, thickness: f64) -> Self {
        Self { bsdf, thickness }
    }

    /// The scattering from `wo` into `wi` with the cosine of `wi`, and the density of
    /// [`Ribbon::sample`]: both averaged over `passages` (at least 1) random passages.
    pub fn eval(&self, wo: DVec3, wi: DVec3, passages: u32, sampler: &mut Sampler) -> (Rgb, f64) {
        let Some([wo, wi]) = seen_from(wo, [wo, wi]) else { return (Rgb::ZERO, 0.0) };
        let (mut value, mut pdf) = (Rgb::ZERO, 0.0);
        for _ in 0..passages {
            let crossing = self.crossing(wo, sampler);
            value += self.value(wo, &crossing, wi);
            pdf += self.pdf(wo, &crossing, wi);
        }
        let scale = 1.0 / f64::from(passages);
        (value * scale, pdf * scale)
    }

    /// A direction, and the value over the density given the passage that was taken: the expectation
    /// of that weight is what the ribbon scatters in all. `None` if the light is lost.
    pub fn sample(&self, wo: DVec3, sampler: &mut Sampler) -> Option<(DVec3, Rgb)> {
        let [local] = seen_from(wo, [wo])?;
        let crossing = self.crossing(local, sampler);
        let wi = match self.bsdf.sample_entry(local, &crossing, sampler) {
            Choice::Scatter(wi) => wi,
            Choice::Lost => return None,
            Choice::Pass => {
                let (passage, _) = crossing.passage.as_ref()?;
                match self.bsdf.sample_exit(passage, &crossing, sampler) {
                    Choice::Scatter(wi) => wi,
                    Choice::Pass | Choice::Lost => return None,
                }
            }
        };
        let pdf = self.pdf(local, &crossing, wi);
        let weight = self.value(local, &crossing, wi) / pdf;
        let [wi] = seen_from(wo, [wi])?;
        (pdf > 0.0).then_some((wi, weight))
    }

    fn crossing(&self, wo: DVec3, sampler: &mut Sampler) -> Crossing {
        let (entry, facet) = (sampler.next_2d(), sampler.next_2d());
        let passage = self.bsdf.sample_refracted(wo, None, 0.0, entry).map(|refracted| {
            let length = self.thickness / -refracted.0.z;
            self.bsdf.sample_passage([true; 2], refracted, -refracted.0, length, facet)
        });
        self.bsdf.crossing(wo, passage, Rgb::ONE, 0.0)
    }

    fn value(&self, wo: DVec3, crossing: &Crossing, wi: DVec3) -> Rgb {
        let entry = self.bsdf.eval_entry(wo, crossing, wi);
        let exit = crossing.passage.as_ref();
        exit.map_or(entry, |(passage, terms)| entry + self.bsdf.eval_exit(passage, terms, wi))
    }

    fn pdf(&self, wo: DVec3, crossing: &Crossing, wi: DVec3) -> f64 {
        let entry = self.bsdf.pdf_entry(wo, crossing, wi);
        let through = crossing.entry_probabilities[2];
        let exit = crossing.passage.as_ref();
        exit.map_or(entry, |(passage, _)| {
            entry + through * self.bsdf.pdf_exit(passage, crossing, wi)
        })
    }
}

/// `directions` with the ribbon turned so that `wo` is above; `None` at grazing `wo`.
fn seen_from<const N: usize>(wo: DVec3, directions: [DVec3; N]) -> Option<[DVec3; N]> {
    let flip = DVec3::new(1.0, 1.0, wo.z.signum());
    (wo.z != 0.0).then(|| directions.map(|w| w * flip))
}
