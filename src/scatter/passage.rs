//! What light meets on its way through a ply: the interface at x, the fibers, the interface at y
//! (Montazeri et al. 2020, Eqs. 8 to 11 and 14), without colours. Written once, over numbers that may
//! carry derivatives.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::dielectric::RoughDielectric;
use super::facet::DrawnFacet;
use super::fresnel::fresnel;
use crate::math::dual::{Real, constant};

/// The parameters that are not colours, as numbers that may carry derivatives.
#[derive(Debug, Clone, Copy)]
pub struct PlyOptics<T> {
    /// The interface at x, seen from outside.
    pub entry: RoughDielectric<T>,
    /// The interface at y, seen from inside.
    pub exit: RoughDielectric<T>,
    /// sigma_t, per millimetre.
    pub extinction: T,
}

/// The way of a refracted ray through the ply, and one microfacet where it comes out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// Whether light meets an interface at x and at y: not where the ply touches another.
    pub interfaces: [bool; 2],
    /// The refracted direction in the frame at x (z < 0).
    pub refracted: DVec3,
    /// The density with which it was chosen.
    pub refracted_pdf: f64,
    /// A microfacet at y, and the direction back along the ray there (frame at y, z > 0).
    pub facet: DrawnFacet,
    /// The length of the way in millimetres.
    pub length: f64,
}

/// What a passage lets through, as expectations over its random choices.
#[derive(Debug, Clone, Copy)]
pub struct PassageTerms<T> {
    /// The part of the light that is refracted at x, over the density of the refracted ray.
    pub entered: T,
    /// tau, the part of it that is not scattered on the way to y (Eq. 11).
    pub transmittance: T,
    /// 1 - tau (1 - F_y), the part of it that the body scatters (Eq. 14).
    pub body: T,
}

impl<T: Real> PlyOptics<T> {
    /// What `passage` lets through of the light that is scattered into `wo`, whichever parameters it
    /// was drawn by. The body's part alone may come out negative; its expectation does not.
    #[inline]
    pub fn passage(&self, wo: DVec3, passage: &Passage) -> PassageTerms<T> {
        let facet = &passage.facet;
        let seen = || [facet.visible(&self.exit), facet.passed(&self.exit)];
        self.terms(wo, passage, passage.interfaces[1].then(seen))
    }

    /// The terms of a passage; `facet`: how much of the microfacet at y is seen, and how much light
    /// passes through it, if there is an interface.
    #[inline(always)]
    fn terms(&self, wo: DVec3, passage: &Passage, facet: Option<[T; 2]>) -> PassageTerms<T> {
        let entered = if passage.interfaces[0] {
            let refraction = self.entry.refraction(&constant(wo), &constant(passage.refracted));
            refraction / passage.refracted_pdf
        } else {
            T::from(1.0)
        };
        let transmittance = (-self.extinction * passage.length).exp();
        let [visible, passed] = facet.unwrap_or([T::from(1.0); 2]);
        PassageTerms { entered, transmittance, body: visible - transmittance * passed }
    }

    /// The two parts of scattering at x from `wo` into `wi` (with the cosine, without colours): the
    /// mirrored part, and the factor of the body's BRDF.
    #[inline(always)]
    pub fn at_entry(
        &self,
        wo: DVec3,
        wi: DVec3,
        passage: Option<&(Passage, PassageTerms<T>)>,
    ) -> [T; 2] {
        let mirrored = if passage.is_none_or(|(passage, _)| passage.interfaces[0]) {
            self.entry.reflection(&constant(wo), &constant(wi))
        } else {
            T::from(0.0)
        };
        let body = passage.map_or(T::from(0.0), |(_, terms)| terms.entered * terms.body);
        [mirrored, body * wi.z.max(0.0)]
    }

    /// The two parts of scattering at y into `wi`: the refracted part, and the body's.
    #[inline(always)]
    pub fn at_exit(&self, passage: &Passage, terms: &PassageTerms<T>, wi: DVec3) -> [T; 2] {
        let lambert = (-wi.z).max(0.0) * FRAC_1_PI;
        let body = terms.entered * terms.body * lambert;
        if !passage.interfaces[1] {
            return [T::from(0.0), body];
        }
        let refraction = self.exit.refraction(&constant(passage.facet.incident), &constant(wi));
        [terms.entered * terms.transmittance * refraction, body]
    }
}

impl PlyOptics<f64> {
    /// [`PlyOptics::passage`] for the parameters that it was drawn by.
    #[inline(always)]
    pub(super) fn drawn_passage(&self, wo: DVec3, passage: &Passage) -> PassageTerms<f64> {
        let DrawnFacet { incident, normal, .. } = passage.facet;
        let passed = || 1.0 - fresnel(incident.dot(normal), self.exit.eta);
        self.terms(wo, passage, passage.interfaces[1].then(|| [1.0, passed()]))
    }
}
