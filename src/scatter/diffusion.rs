//! Jensen and Buhler's (2002) diffuse reflectance, and the medium that has a given one.

/// Newton's method takes at most ten steps from its start; more means rounding.
const MAX_STEPS: usize = 16;

/// The step in γ at which Newton's method has converged.
const CONVERGED: f64 = 1e-12;

/// A half-space of given diffuse reflectance and index of refraction.
#[derive(Clone, PartialEq, Debug)]
pub struct Diffusion {
    base_color: f64,
    alpha: f64,
    alpha_by_base_color: f64,
    alpha_by_eta: f64,
}

impl Diffusion {
    /// Inverts k = α/2 (1 + exp(−4/3 A √(3(1 − α)))) exp(−√(3(1 − α))) for the single-scattering
    /// albedo α. The unknown is γ = √(1 − α), in which k is smooth at both ends.
    pub fn new(base_color: f64, eta: f64) -> Self {
        let (a, a_by_eta) = internal_reflection(eta);
        let mut gamma = (1.0 - base_color) / (1.0 + base_color);
        for _ in 0..MAX_STEPS {
            let k = reflectance(gamma, a);
            let step = (base_color - k.value) / k.by_gamma;
            gamma = (gamma + step).clamp(0.0, 1.0);
            if step.abs() < CONVERGED {
                break;
            }
        }
        let k = reflectance(gamma, a);
        let alpha_by_base_color = -2.0 * gamma / k.by_gamma;
        Self {
            base_color,
            alpha: (1.0 - gamma) * (1.0 + gamma),
            alpha_by_base_color,
            alpha_by_eta: -alpha_by_base_color * k.by_a * a_by_eta,
        }
    }

    /// The diffuse reflectance k, which is also the albedo of the diffusion term of Eq. 12.
    pub fn base_color(&self) -> f64 {
        self.base_color
    }

    /// The (reduced) single-scattering albedo α.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// The derivative of α with respect to the diffuse reflectance.
    pub fn alpha_by_base_color(&self) -> f64 {
        self.alpha_by_base_color
    }

    /// The derivative of α with respect to the index of refraction.
    pub fn alpha_by_eta(&self) -> f64 {
        self.alpha_by_eta
    }
}

/// The diffuse reflectance, and its derivatives with respect to γ and A.
struct Reflectance {
    value: f64,
    by_gamma: f64,
    by_a: f64,
}

fn reflectance(gamma: f64, a: f64) -> Reflectance {
    let sqrt_3 = 3.0f64.sqrt();
    let half_alpha = 0.5 * (1.0 - gamma) * (1.0 + gamma);
    let direct = (-sqrt_3 * gamma).exp();
    let image = (-4.0 / 3.0 * a * sqrt_3 * gamma).exp() * direct;
    let direct_rate = sqrt_3;
    let image_rate = sqrt_3 * (1.0 + 4.0 / 3.0 * a);
    Reflectance {
        value: half_alpha * (direct + image),
        by_gamma: -gamma * (direct + image)
            - half_alpha * (direct_rate * direct + image_rate * image),
        by_a: -half_alpha * 4.0 / 3.0 * sqrt_3 * gamma * image,
    }
}

/// A = (1 + F_dr)/(1 − F_dr) and its derivative with respect to the index of refraction, with the
/// rational fit of the diffuse Fresnel reflectance F_dr in Jensen et al. (2001).
fn internal_reflection(eta: f64) -> (f64, f64) {
    let fresnel = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    let fresnel_by_eta = 2.880 / (eta * eta * eta) - 0.710 / (eta * eta) + 0.0636;
    let passed = 1.0 - fresnel;
    ((1.0 + fresnel) / passed, 2.0 * fresnel_by_eta / (passed * passed))
}
