//! Body reflection: light scattered many times among a ply's fibers that leaves where it entered
//! (Montazeri et al. 2020, Eq. 12), without the factors r, B and G_f in front of the bracket.
//!
//! The paper approximates an isotropically scattering half-space by a single-scattering
//! (Lommel-Seeliger) term plus a diffusion term that holds all scattering, the single one included;
//! the sum creates energy. [`BodyKind::Printed`] is that sum, [`BodyKind::Conserving`] the exact
//! solution for the same medium, whose first order is the Lommel-Seeliger term. By itself it is
//! reciprocal and returns no more than it receives, from wherever that comes.

use std::f64::consts::PI;

use super::chandrasekhar::HFunction;
use super::diffusion::Diffusion;

/// Which form of the body reflection.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum BodyKind {
    /// Chandrasekhar's solution, α/(4π) H(μᵢ) H(μₒ)/(μᵢ + μₒ). The base colour is the hemispherical
    /// albedo of the half-space; the index of refraction plays no part.
    Conserving,
    /// The bracket of Eq. 12 as printed. The base colour is the diffuse reflectance of Jensen and
    /// Buhler (2002). The albedo exceeds the base colour, and for bright colours 1.
    Printed,
}

/// The body reflection in one colour channel, prepared once and evaluated often.
#[derive(Clone, PartialEq, Debug)]
pub struct Body(Form);

#[derive(Clone, PartialEq, Debug)]
enum Form {
    Conserving(HFunction),
    Printed(Diffusion),
}

/// The value of the body reflection, per steradian, and its derivatives.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BodyValue {
    /// The value itself.
    pub value: f64,
    /// Its derivative with respect to the base colour.
    pub by_base_color: f64,
    /// Its derivative with respect to the index of refraction.
    pub by_eta: f64,
}

impl Body {
    /// Prepares the form `kind` for a `base_color` within [0, 1] and an index of refraction `eta`
    /// within [1, 3]. The caller has checked the ranges.
    pub fn new(kind: BodyKind, base_color: f64, eta: f64) -> Self {
        Self(match kind {
            BodyKind::Conserving => Form::Conserving(HFunction::new(base_color)),
            BodyKind::Printed => Form::Printed(Diffusion::new(base_color, eta)),
        })
    }

    /// The BRDF, per steradian and without a cosine, between two directions given by their cosines
    /// with the normal, both within (0, 1].
    #[inline]
    pub fn eval(&self, mu_i: f64, mu_o: f64) -> f64 {
        let single = lommel_seeliger(mu_i, mu_o);
        match &self.0 {
            Form::Conserving(h) => single * h.alpha().re * (h.value(mu_i) * h.value(mu_o)),
            Form::Printed(diffusion) => single * diffusion.alpha() + diffusion.base_color() / PI,
        }
    }

    /// [`Body::eval`] and its derivatives with respect to the parameters of [`Body::new`].
    pub fn eval_with_gradient(&self, mu_i: f64, mu_o: f64) -> BodyValue {
        let single = lommel_seeliger(mu_i, mu_o);
        match &self.0 {
            Form::Conserving(h) => {
                let brdf = h.alpha() * single * (h.dual(mu_i) * h.dual(mu_o));
                BodyValue { value: brdf.re, by_base_color: brdf.eps, by_eta: 0.0 }
            }
            Form::Printed(diffusion) => BodyValue {
                value: single * diffusion.alpha() + diffusion.base_color() / PI,
                by_base_color: single * diffusion.alpha_by_base_color() + 1.0 / PI,
                by_eta: single * diffusion.alpha_by_eta(),
            },
        }
    }

    /// The directional albedo: the fraction of the light arriving at the cosine `mu`, within (0, 1],
    /// that is reflected, ∫ f cos over the hemisphere, in closed form.
    pub fn albedo(&self, mu: f64) -> f64 {
        match &self.0 {
            Form::Conserving(h) => 1.0 - h.gamma() * h.value(mu),
            Form::Printed(diffusion) => {
                let single = 1.0 - mu * (1.0 / mu).ln_1p();
                diffusion.base_color() + 0.5 * diffusion.alpha() * single
            }
        }
    }
}

/// The light scattered once in a half-space, per steradian and per single-scattering albedo.
fn lommel_seeliger(mu_i: f64, mu_o: f64) -> f64 {
    1.0 / (4.0 * PI * (mu_i + mu_o))
}

#[cfg(test)]
mod tests;
