use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;

use super::*;

const KINDS: [BodyKind; 2] = [BodyKind::Conserving, BodyKind::Printed];
const COSINES: [f64; 8] = [1e-6, 1e-3, 0.01, 0.1, 0.37, 0.5, 0.83, 1.0];
const BASE_COLORS: [f64; 8] = [0.0, 0.001, 0.1, 0.37, 0.5, 0.8, 0.999, 1.0];

/// ∫₀¹ f(μ) dμ, in t = μ^¼ for the logarithms at grazing angles.
fn integrate(f: impl Fn(f64) -> f64) -> f64 {
    let rule = GaussLegendre::new(NonZeroUsize::new(16).unwrap());
    let panel = |i: u32| {
        let (from, to) = (f64::from(i) / 128.0, f64::from(i + 1) / 128.0);
        rule.integrate(from, to, |t| 4.0 * t.powi(3) * f(t.powi(4)))
    };
    (0..128).map(panel).sum()
}

fn grid(intervals: u32) -> impl Iterator<Item = f64> {
    (0..=intervals).map(move |i| f64::from(i) / f64::from(intervals))
}

#[track_caller]
fn assert_close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected}");
}

#[test]
fn swapping_the_directions_changes_nothing() {
    for kind in KINDS {
        for base_color in BASE_COLORS {
            let body = Body::new(kind, base_color, 1.5);
            for mu_i in COSINES {
                for mu_o in COSINES {
                    assert_eq!(body.eval(mu_i, mu_o), body.eval(mu_o, mu_i));
                }
            }
        }
    }
}

#[test]
fn albedo_is_the_integral_of_the_brdf() {
    for kind in KINDS {
        for base_color in BASE_COLORS {
            let body = Body::new(kind, base_color, 1.46);
            for mu in COSINES {
                let reflected = 2.0 * PI * integrate(|mu_o| body.eval(mu, mu_o) * mu_o);
                assert_close(body.albedo(mu), reflected, 1e-9);
            }
        }
    }
}

#[test]
fn base_color_is_the_hemispherical_albedo_of_the_conserving_form() {
    for base_color in grid(1000) {
        let body = Body::new(BodyKind::Conserving, base_color, 1.5);
        let hemispherical = 2.0 * integrate(|mu| body.albedo(mu) * mu);
        assert_close(hemispherical, base_color, 1e-10);
    }
}

#[test]
fn conserving_form_never_creates_energy() {
    for base_color in grid(200) {
        let body = Body::new(BodyKind::Conserving, base_color, 1.5);
        for t in grid(1000) {
            let albedo = body.albedo(t.powi(4));
            assert!((0.0..=1.0).contains(&albedo), "{albedo} at {base_color}, {t}");
        }
    }
}

#[test]
fn white_conserving_body_returns_everything() {
    let body = Body::new(BodyKind::Conserving, 1.0, 1.5);
    assert!(COSINES.iter().all(|&mu| body.albedo(mu) == 1.0));
}

#[test]
fn black_body_returns_nothing() {
    for kind in KINDS {
        let body = Body::new(kind, 0.0, 1.5);
        for mu in COSINES {
            assert_eq!(body.albedo(mu), 0.0);
            assert_eq!(body.eval(mu, 0.5), 0.0);
        }
    }
}

#[test]
fn dark_conserving_body_scatters_once() {
    let base_color = 1e-7;
    let body = Body::new(BodyKind::Conserving, base_color, 1.5);
    let alpha = base_color / (2.0 / 3.0 * (1.0 - 2.0f64.ln()));
    for mu in COSINES {
        let single = alpha / (4.0 * PI * (mu + 0.5));
        assert_close(body.eval(mu, 0.5) / single, 1.0, 1e-6);
    }
}

/// Albedos of the bracket of Eq. 12 at η = 1.46, computed independently.
#[test]
fn printed_form_has_the_known_albedos() {
    let table = [
        (0.2, [0.325, 0.384, 0.511, 0.590]),
        (0.5, [0.650, 0.721, 0.873, 0.967]),
        (0.8, [0.953, 1.025, 1.180, 1.276]),
        (1.0, [1.153, 1.225, 1.380, 1.477]),
    ];
    for (base_color, albedos) in table {
        let body = Body::new(BodyKind::Printed, base_color, 1.46);
        for (mu, albedo) in [1.0, 0.5, 0.1, 0.01].into_iter().zip(albedos) {
            assert_close(body.albedo(mu), albedo, 5.01e-4);
        }
    }
}

/// α of the printed form for base colours at η = 1.46, computed independently.
#[test]
fn printed_form_has_the_known_single_scattering_albedos() {
    for (base_color, alpha) in [(0.2, 0.81713), (0.5, 0.98010), (0.8, 0.99844), (1.0, 1.0)] {
        assert_close(Diffusion::new(base_color, 1.46).alpha(), alpha, 5.01e-6);
    }
}

/// The bracket of Eq. 12, term by term, with F_dr from its rational fit.
fn bracket(alpha: f64, eta: f64, mu_i: f64, mu_o: f64) -> f64 {
    let fresnel = -1.440 / eta.powi(2) + 0.710 / eta + 0.668 + 0.0636 * eta;
    let a = (1.0 + fresnel) / (1.0 - fresnel);
    let exponent = (3.0 * (1.0 - alpha)).sqrt();
    alpha / (4.0 * PI * (mu_i + mu_o))
        + alpha / (2.0 * PI) * (1.0 + (-4.0 / 3.0 * a * exponent).exp()) * (-exponent).exp()
}

#[test]
fn printed_form_is_the_bracket_as_printed() {
    for eta in [1.0, 1.33, 1.5, 2.2, 3.0] {
        for base_color in grid(500) {
            let alpha = Diffusion::new(base_color, eta).alpha();
            let expected = bracket(alpha, eta, 0.7, 0.2);
            let actual = Body::new(BodyKind::Printed, base_color, eta).eval(0.7, 0.2);
            // √(1 − α) in the bracket loses half of the digits where α is near 1.
            assert_close(actual, expected, 1e-7);
        }
    }
}

/// (f(x + h) − f(x − h))/2h, extrapolated once to h = 0.
fn central_difference(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    let slope = |h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
    (4.0 * slope(0.5 * h) - slope(h)) / 3.0
}

#[test]
fn gradient_is_the_derivative_of_eval() {
    for kind in KINDS {
        for base_color in [0.001, 0.01, 0.1, 0.37, 0.5, 0.8, 0.95, 0.999] {
            for eta in [1.1, 1.46, 2.0, 2.9] {
                for mu_i in COSINES {
                    let f = |k, eta| Body::new(kind, k, eta).eval(mu_i, 0.6);
                    let by_base_color = central_difference(|k| f(k, eta), base_color, 4e-4);
                    let by_eta = central_difference(|eta| f(base_color, eta), eta, 1e-3);
                    let at = Body::new(kind, base_color, eta).eval_with_gradient(mu_i, 0.6);
                    assert_eq!(at.value, f(base_color, eta));
                    assert_close(at.by_base_color / by_base_color, 1.0, 1e-7);
                    // What depends on η falls below the rounding of dark bodies' values.
                    assert_close(at.by_eta, by_eta, 1e-7 * by_eta.abs() + 1e-12);
                }
            }
        }
    }
}

#[test]
fn gradient_at_the_ends_is_one_sided() {
    let h = 1e-4;
    for kind in KINDS {
        for (end, inwards) in [(0.0, h), (1.0, -h)] {
            let f = |k| Body::new(kind, k, 1.5).eval(0.3, 0.8);
            let (one, two) = (f(end + inwards), f(end + 2.0 * inwards));
            let difference = (4.0 * one - 3.0 * f(end) - two) / (2.0 * inwards);
            let at = Body::new(kind, end, 1.5).eval_with_gradient(0.3, 0.8);
            assert_close(at.by_base_color / difference, 1.0, 1e-5);
            assert_close(at.by_eta, 0.0, 0.0);
        }
    }
}
