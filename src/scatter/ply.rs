//! The ply BSDF (Montazeri et al. 2020, section 4).
//!
//! Light meets a ply twice: it enters at x, where it is partly mirrored and partly handed to the
//! body, and what is refracted leaves at y. Each meeting has its own local frame with z towards the
//! side that the light comes from: outwards at x, *inwards* at y. x runs along the fiber.
//!
//! # What the paper leaves open
//!
//! The share B (Eq. 14) of the light that goes to the body depends on where the refracted ray comes
//! out. Here a [`Passage`] samples that ray, and one microfacet at y whose Fresnel term is F_y; so
//! the expectation of B is exactly what is refracted at x and not refracted again at y, whatever the
//! roughness, and no parameters make a ply return more than it receives of light that is the same from
//! all sides. F and B are those of the camera's side, as in the paper: of one directional light a ply
//! may return more than all.

use std::array;

use glam::DVec3;

use super::aim::Aim;
use super::body::{Body, BodyKind};
use super::dielectric::RoughDielectric;
use super::facet::DrawnFacet;
use super::fresnel::fresnel;
use super::ggx::Ggx;
use super::passage::{Passage, PassageTerms, PlyOptics};
use crate::error::{Result, check_range};
use crate::math::color::Rgb;
use crate::math::dual::constant;
use crate::math::rng::Sampler;
use crate::sampling::warp::{square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf};

/// The optical parameters of a ply, named as in the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlyParameters {
    /// Refractive index eta, 1.01 to 3.
    pub eta: f64,
    /// k_x^S.
    pub specular_tint: Rgb,
    /// k_y^S.
    pub transmission_tint: Rgb,
    /// k_x^B.
    pub base_color: Rgb,
    /// k_y.
    pub transmitted_color: Rgb,
    /// r, the part of the body's light that leaves at x.
    pub body_reflection: f64,
    /// sigma_t, per millimetre.
    pub extinction: f64,
    /// beta_x.
    pub roughness: Ggx,
    /// beta_y.
    pub exit_roughness: Ggx,
    /// The form of the body term at x.
    pub body: BodyKind,
}

impl PlyParameters {
    /// Passes the parameters on if all are inside their ranges.
    pub fn checked(self) -> Result<Self> {
        check_range("eta", self.eta, 1.01, 3.0)?;
        check_range("body_reflection", self.body_reflection, 0.0, 1.0)?;
        check_range("extinction", self.extinction, 0.0, 1e6)?;
        for (name, ggx) in [("roughness", self.roughness), ("exit_roughness", self.exit_roughness)]
        {
            check_range(name, ggx.along, 1e-3, 1.0)?;
            check_range(name, ggx.across, 1e-3, 1.0)?;
        }
        for (name, color) in [
            ("specular_tint", self.specular_tint),
            ("transmission_tint", self.transmission_tint),
            ("base_color", self.base_color),
            ("transmitted_color", self.transmitted_color),
        ] {
            for channel in color.to_array() {
                check_range(name, channel, 0.0, 1.0)?;
            }
        }
        Ok(self)
    }
}

/// The ply BSDF, prepared for evaluation.
#[derive(Debug)]
pub struct PlyBsdf {
    parameters: PlyParameters,
    optics: PlyOptics<f64>,
    body: [Body; 3],
}

/// A passage with what it lets through, and how likely the lobes should be chosen.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// The way through the ply; `None` if nothing was refracted.
    pub passage: Option<(Passage, PassageTerms<f64>)>,
    /// The probabilities of going on with the mirrored lobe, the body at x, and the passage.
    pub entry_probabilities: [f64; 3],
    /// The probabilities, given the passage, of the refracted lobe and the body at y.
    pub exit_probabilities: [f64; 2],
}

/// The refracted lobe at y stays this likely although the sampled microfacet reflects everything.
const LEAST_TRANSMISSION: f64 = 0.3;

impl PlyBsdf {
    /// Prepares the model.
    pub fn new(parameters: PlyParameters) -> Result<Self> {
        let p = parameters.checked()?;
        let optics = PlyOptics {
            entry: RoughDielectric { eta: p.eta, ggx: p.roughness },
            exit: RoughDielectric { eta: p.eta.recip(), ggx: p.exit_roughness },
            extinction: p.extinction,
        };
        let body = p.base_color.to_array().map(|color| Body::new(p.body, color, p.eta));
        Ok(Self { parameters, optics, body })
    }

    /// The parameters.
    pub fn parameters(&self) -> &PlyParameters {
        &self.parameters
    }

    /// The body term at x, a channel each.
    pub fn body(&self) -> &[Body; 3] {
        &self.body
    }

    /// A refracted direction in the frame at x and its density; `None` if nothing is refracted.
    ///
    /// Half of the directions are chosen by `aim`, if there is one: with rough lobes at x and narrow
    /// ones at y, few others meet the lamp. The part `floor` of the directions is chosen whatever the
    /// interface, so that none is left out which another index would refract into.
    #[inline]
    pub fn sample_refracted(
        &self,
        wo: DVec3,
        aim: Option<&Aim>,
        floor: f64,
        [u, v]: [f64; 2],
    ) -> Option<(DVec3, f64)> {
        let entry = &self.optics.entry;
        let onwards = (u - floor) / (1.0 - floor);
        let refracted = match aim {
            _ if u < floor => -square_to_cosine_hemisphere([u / floor, v]),
            None => entry.sample_refraction(wo, [onwards, v])?,
            Some(_) if onwards < 0.5 => entry.sample_refraction(wo, [2.0 * onwards, v])?,
            Some(aim) => aim.sample([2.0 * onwards - 1.0, v])?,
        };
        let pdf = self.refracted_pdf(wo, aim, floor, refracted);
        (pdf > 0.0).then_some((refracted, pdf))
    }

    /// The density of [`PlyBsdf::sample_refracted`].
    #[inline(always)]
    pub fn refracted_pdf(&self, wo: DVec3, aim: Option<&Aim>, floor: f64, refracted: DVec3) -> f64 {
        if refracted.z >= 0.0 {
            return 0.0;
        }
        let anywhere = square_to_cosine_hemisphere_pdf(-refracted);
        let onwards = self.optics.entry.refraction_pdf(&constant(wo), &constant(refracted));
        let chosen = aim.map_or(onwards, |aim| 0.5 * (onwards + aim.pdf(refracted)));
        floor * anywhere + (1.0 - floor) * chosen
    }

    /// The interface at y, seen from outside.
    #[inline]
    pub fn exit_from_outside(&self) -> RoughDielectric {
        RoughDielectric { eta: self.optics.entry.eta, ggx: self.optics.exit.ggx }
    }

    /// Completes a passage that comes out along `-incident` (in the frame at y) after `length`.
    #[inline(always)]
    pub fn sample_passage(
        &self,
        interfaces: [bool; 2],
        (refracted, refracted_pdf): (DVec3, f64),
        incident: DVec3,
        length: f64,
        u: [f64; 2],
    ) -> Passage {
        let exit = &self.optics.exit;
        let normal = exit.ggx.sample_visible_normal(incident, u);
        let pdf = exit.ggx.visible_normal_pdf(&constant(incident), &constant(normal));
        let facet = DrawnFacet { incident, normal, pdf, eta: self.parameters.eta };
        Passage { interfaces, refracted, refracted_pdf, facet, length }
    }

    /// What `passage` lets through, and how likely each lobe should be chosen by a path of this
    /// throughput: about `floor` at least if there is such a lobe for any parameters.
    #[inline]
    pub fn crossing(
        &self,
        wo: DVec3,
        passage: Option<Passage>,
        throughput: Rgb,
        floor: f64,
    ) -> Crossing {
        let p = &self.parameters;
        // By all channels alike, a path that is red already would go on too seldom in red cloth, and
        // so with a weight that grows.
        let sum = throughput.element_sum();
        let shares = if sum > 0.0 { throughput / sum } else { Rgb::splat(1.0 / 3.0) };
        let mean = |color: Rgb| color.dot(shares);
        let mirror = mean(p.specular_tint) * fresnel(wo.z, p.eta);
        let Some(passage) = passage else {
            let entry_probabilities = [1.0, 0.0, 0.0];
            return Crossing { passage: None, entry_probabilities, exit_probabilities: [0.0; 2] };
        };
        let [mirrors, leaves] = passage.interfaces;
        let mirror = if mirrors { mirror } else { 0.0 };
        let terms = self.optics.drawn_passage(wo, &passage);
        let body_albedo = Rgb::from_array([0, 1, 2].map(|c| self.body[c].albedo(wo.z)));
        let body = p.body_reflection * terms.entered * terms.body * mean(body_albedo);
        let passed = if leaves {
            1.0 - terms.body + LEAST_TRANSMISSION * terms.transmittance
        } else {
            terms.transmittance
        };
        let exit = [
            mean(p.transmission_tint) * passed,
            mean(p.transmitted_color) * (1.0 - p.body_reflection) * terms.body,
        ];
        let through = mean(p.specular_tint) * terms.entered * (exit[0] + exit[1]);
        Crossing {
            passage: Some((passage, terms)),
            entry_probabilities: probabilities(
                [mirror, body, through],
                [mirrors, true, true],
                floor,
            ),
            exit_probabilities: probabilities(exit, [true, true], floor),
        }
    }

    /// The scattering at x from `wo` into `wi`, with the cosine: f_x of Eq. 6.
    #[inline(always)]
    pub fn eval_entry(&self, wo: DVec3, crossing: &Crossing, wi: DVec3) -> Rgb {
        if wi.z <= 0.0 {
            return Rgb::ZERO;
        }
        let [mirrored, body] = self.optics.at_entry(wo, wi, crossing.passage.as_ref());
        let mut value = self.parameters.specular_tint * mirrored;
        if body > 0.0 {
            let brdf = Rgb::from_array([0, 1, 2].map(|c| self.body[c].eval(wo.z, wi.z)));
            value += self.parameters.body_reflection * body * brdf;
        }
        value
    }

    /// The density of [`PlyBsdf::sample_entry`], which misses the passage's share.
    #[inline(always)]
    pub fn pdf_entry(&self, wo: DVec3, crossing: &Crossing, wi: DVec3) -> f64 {
        if wi.z <= 0.0 {
            return 0.0;
        }
        let [mirror, body, _] = crossing.entry_probabilities;
        let mirrored = if mirror > 0.0 {
            self.optics.entry.reflection_pdf(&constant(wo), &constant(wi))
        } else {
            0.0
        };
        mirror * mirrored + body * square_to_cosine_hemisphere_pdf(wi)
    }

    /// A direction at x, or word that the light goes on along the passage, or is lost.
    #[inline]
    pub fn sample_entry(&self, wo: DVec3, crossing: &Crossing, sampler: &mut Sampler) -> Choice {
        let [mirror, body, through] = crossing.entry_probabilities;
        let (u, direction) = (sampler.next_1d(), sampler.next_2d());
        if u < mirror {
            return Choice::from(self.optics.entry.sample_reflection(wo, direction));
        }
        if u < mirror + body {
            return Choice::Scatter(square_to_cosine_hemisphere(direction));
        }
        if through > 0.0 { Choice::Pass } else { Choice::Lost }
    }

    /// The scattering into `wi` (frame at y, z < 0) of light that took the passage, with everything
    /// that it met since x, over the density of the passage: f_x^S f_y of Eqs. 8 and 7.
    #[inline(always)]
    pub fn eval_exit(&self, passage: &Passage, terms: &PassageTerms<f64>, wi: DVec3) -> Rgb {
        if wi.z >= 0.0 {
            return Rgb::ZERO;
        }
        let p = &self.parameters;
        let [refracted, body] = self.optics.at_exit(passage, terms, wi);
        let scattered = p.transmitted_color * ((1.0 - p.body_reflection) * body);
        p.specular_tint * (p.transmission_tint * refracted + scattered)
    }

    /// What goes straight on at y into another ply, over the density of the passage.
    #[inline]
    pub fn eval_straight(&self, terms: &PassageTerms<f64>) -> Rgb {
        let p = &self.parameters;
        p.specular_tint * p.transmission_tint * (terms.entered * terms.transmittance)
    }

    /// The density of [`PlyBsdf::sample_exit`], which misses the share that goes straight on.
    #[inline(always)]
    pub fn pdf_exit(&self, passage: &Passage, crossing: &Crossing, wi: DVec3) -> f64 {
        let [refract, body] = crossing.exit_probabilities;
        let lambert = body * square_to_cosine_hemisphere_pdf(-wi);
        if !passage.interfaces[1] {
            return lambert;
        }
        let refracted =
            self.optics.exit.refraction_pdf(&constant(passage.facet.incident), &constant(wi));
        refract * refracted + lambert
    }

    /// A direction at y, or word that the light passes straight on, or is lost.
    #[inline]
    pub fn sample_exit(
        &self,
        passage: &Passage,
        crossing: &Crossing,
        sampler: &mut Sampler,
    ) -> Choice {
        let (u, direction) = (sampler.next_1d(), sampler.next_2d());
        if u < crossing.exit_probabilities[0] {
            if !passage.interfaces[1] {
                return Choice::Pass;
            }
            return Choice::from(
                self.optics.exit.sample_refraction(passage.facet.incident, direction),
            );
        }
        if crossing.exit_probabilities[1] > 0.0 {
            return Choice::Scatter(-square_to_cosine_hemisphere(direction));
        }
        Choice::Lost
    }
}

/// Where light goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice {
    /// Into this local direction.
    Scatter(DVec3),
    /// At x: along the passage, to be scattered at y. At y: straight on into another ply.
    Pass,
    /// Nowhere.
    Lost,
}

impl Choice {
    /// The direction into which light is scattered, if it is.
    #[inline]
    pub fn direction(self) -> Option<DVec3> {
        match self {
            Self::Scatter(direction) => Some(direction),
            Self::Pass | Self::Lost => None,
        }
    }
}

impl From<Option<DVec3>> for Choice {
    fn from(direction: Option<DVec3>) -> Self {
        direction.map_or(Self::Lost, Self::Scatter)
    }
}

/// `weights` scaled to sum to one (all zero if they are). Those that are possible are raised first, to
/// `floor` of the sum at least: the others hardly notice.
#[inline]
fn probabilities<const N: usize>(weights: [f64; N], possible: [bool; N], floor: f64) -> [f64; N] {
    let sum: f64 = weights.iter().sum();
    let shares = if sum > 0.0 { weights.map(|weight| weight / sum) } else { weights };
    if floor == 0.0 {
        return shares;
    }
    let raised: [f64; N] = array::from_fn(|i| if possible[i] { shares[i].max(floor) } else { 0.0 });
    let total: f64 = raised.iter().sum();
    raised.map(|share| share / total)
}
