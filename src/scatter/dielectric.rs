//! The rough dielectric interface (Walter et al. 2007; Eqs. 8 to 10 of Montazeri et al. 2020).
//!
//! Local frame as in [`super::ggx`]; `wo` is on the upper side (z > 0), `eta` is the refractive
//! index below over that above. Every value includes the cosine of the direction scattered into.
//! Refraction is in the form that keeps energy: its integral over the directions below is the
//! transmitted part. (Transport of radiance would scale it by 1/eta^2 on the way in and by eta^2 on
//! the way out, which cancels over a whole ply.)

use glam::DVec3;

use super::fresnel::fresnel;
use super::ggx::Ggx;
use crate::math::dual::{Real, Vector, dot, normalized};

/// A rough interface between two media.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoughDielectric<T = f64> {
    /// Refractive index below over that above.
    pub eta: T,
    /// The roughness.
    pub ggx: Ggx<T>,
}

impl<T: Real> RoughDielectric<T> {
    /// F G2 D / (4 |wo.n|): reflection from `wo` into `wi`, both above.
    #[inline(always)]
    pub fn reflection(&self, wo: &Vector<T>, wi: &Vector<T>) -> T {
        if wi[2].re() <= 0.0 {
            return T::from(0.0);
        }
        let h = normalized(&[wo[0] + wi[0], wo[1] + wi[1], wo[2] + wi[2]]);
        let masking = self.ggx.masking(wo) * self.ggx.masking(wi);
        let fresnel = fresnel(dot(wo, &h), self.eta);
        fresnel * masking * self.ggx.density(&h) / (wo[2] * 4.0)
    }

    /// The density of [`RoughDielectric::sample_reflection`].
    #[inline(always)]
    pub fn reflection_pdf(&self, wo: &Vector<T>, wi: &Vector<T>) -> T {
        if wi[2].re() <= 0.0 {
            return T::from(0.0);
        }
        let h = normalized(&[wo[0] + wi[0], wo[1] + wi[1], wo[2] + wi[2]]);
        self.ggx.visible_normal_pdf(wo, &h) / (dot(wo, &h) * 4.0)
    }

    /// The refracting branch of Eq. 8: refraction from `wo` (above) into `wi` (below).
    #[inline(always)]
    pub fn refraction(&self, wo: &Vector<T>, wi: &Vector<T>) -> T {
        let Some(facet) = self.refracting_facet(wo, wi) else { return T::from(0.0) };
        let transmitted = T::from(1.0) - fresnel(facet.cos_o, self.eta);
        let masking = self.ggx.masking(wo) * self.ggx.masking(wi);
        let density = self.ggx.density(&facet.h) * facet.jacobian;
        let value = transmitted * masking * density * facet.cos_o / wo[2];
        if T::NDERIV == 0 { value } else { value * rising(facet.h[2]) }
    }

    /// The density of [`RoughDielectric::sample_refraction`].
    #[inline(always)]
    pub fn refraction_pdf(&self, wo: &Vector<T>, wi: &Vector<T>) -> T {
        let Some(facet) = self.refracting_facet(wo, wi) else { return T::from(0.0) };
        self.ggx.visible_normal_pdf(wo, &facet.h) * facet.jacobian
    }

    /// The microfacet that refracts `wo` into `wi`, if there is one.
    #[inline(always)]
    fn refracting_facet(&self, wo: &Vector<T>, wi: &Vector<T>) -> Option<Facet<T>> {
        if wi[2].re() >= 0.0 {
            return None;
        }
        let sum = [wo[0] + self.eta * wi[0], wo[1] + self.eta * wi[1], wo[2] + self.eta * wi[2]];
        let h = normalized(&sum);
        let h = if h[2].re() < 0.0 { h.map(|component| -component) } else { h };
        let (cos_o, cos_i) = (dot(wo, &h), dot(wi, &h));
        if cos_o.re() <= 0.0 || cos_i.re() >= 0.0 {
            return None;
        }
        let denominator = cos_o + self.eta * cos_i;
        let jacobian = self.eta * self.eta * -cos_i / (denominator * denominator);
        Some(Facet { h, cos_o, jacobian })
    }
}

/// One, with the derivatives of a step from 0 to 1 near the horizon.
///
/// The microfacets that refract between two given directions turn with eta, and where they pass the
/// horizon the lobe ends with a jump: D is not zero there. The derivative of an integral over it
/// includes what comes over the horizon, which no derivative of a value shows. So values near it carry
/// it for the horizon, by a kernel of width [`HORIZON`] whose first moment vanishes, as is usual for
/// densities near their ends (Gasser and Muller 1979): exact to second order in the width.
#[inline]
fn rising<T: Real>(height: T) -> T {
    let x = height / HORIZON;
    if x.re() >= 1.0 {
        return T::from(1.0);
    }
    let step = x * (x * -3.0 + 4.0);
    step + (1.0 - step.re())
}

/// The height, as a cosine, below which microfacets stand for those at the horizon in derivatives.
const HORIZON: f64 = 0.3;

/// A microfacet that refracts, with d(solid angle of h) / d(solid angle of wi).
struct Facet<T> {
    h: Vector<T>,
    cos_o: T,
    jacobian: T,
}

impl RoughDielectric {
    /// The direction that a visible microfacet mirrors `wo` into; `None` if it is below.
    #[inline(always)]
    pub fn sample_reflection(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        let h = self.ggx.sample_visible_normal(wo, u);
        let wi = 2.0 * wo.dot(h) * h - wo;
        (wi.z > 0.0).then_some(wi)
    }

    /// The direction that a visible microfacet refracts `wo` into; `None` if all is reflected or
    /// the direction is not below.
    #[inline(always)]
    pub fn sample_refraction(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        let h = self.ggx.sample_visible_normal(wo, u);
        let cos_o = wo.dot(h);
        let cos2_t = 1.0 - (1.0 - cos_o * cos_o) / (self.eta * self.eta);
        if cos2_t <= 0.0 {
            return None;
        }
        let wi = (cos_o / self.eta - cos2_t.sqrt()) * h - wo / self.eta;
        (wi.z < 0.0).then_some(wi.normalize())
    }
}
