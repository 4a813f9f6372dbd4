//! Reflection at a smooth dielectric interface.

use crate::math::dual::Real;

/// The fraction of unpolarised light that an interface reflects (Fresnel's equations).
///
/// `cos_i` >= 0 is the cosine on the side of incidence, `eta` the refractive index of the far side
/// over that of the near side. One beyond the critical angle.
#[inline(always)]
pub fn fresnel<T: Real>(cos_i: T, eta: T) -> T {
    let sin2_t = (T::from(1.0) - cos_i * cos_i) / (eta * eta);
    if sin2_t.re() >= 1.0 {
        return T::from(1.0);
    }
    let cos_t = (T::from(1.0) - sin2_t).sqrt();
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    (perpendicular * perpendicular + parallel * parallel) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_brewster_angle_and_total_reflection() {
        assert!((fresnel(1.0, 1.5) - 0.04f64).abs() < 1e-15);
        assert_eq!(fresnel(0.0, 1.5), 1.0);
        // At Brewster's angle only the perpendicular part is reflected: ((eta^2-1)/(eta^2+1))^2 / 2.
        let brewster = 1.0 / (1.0 + 1.5f64 * 1.5).sqrt();
        let expected = ((1.5f64 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0)).powi(2) / 2.0;
        assert!((fresnel(brewster, 1.5) - expected).abs() < 1e-15);
        assert_eq!(fresnel(0.5, 1.0 / 1.5), 1.0);
    }

    #[test]
    fn both_sides_of_the_interface_agree() {
        let cos_i: f64 = 0.4;
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / 2.25).sqrt();
        assert!((fresnel(cos_i, 1.5) - fresnel(cos_t, 1.0 / 1.5)).abs() < 1e-14);
    }
}
