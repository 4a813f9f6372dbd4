use std::f64::consts::{FRAC_PI_2, PI};

use super::*;

/// Σ over panels of a Gauss-Legendre rule.
fn integrate(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let rule = GaussLegendre::new(NonZeroUsize::new(16).unwrap());
    let width = (to - from) / panels as f64;
    let edge = |i: usize| from + width * i as f64;
    (0..panels).map(|i| rule.integrate(edge(i), edge(i + 1), &f)).sum()
}

/// 1 − φ cot φ, by its series where the difference would cancel.
fn one_minus_x_cot_x(x: f64) -> f64 {
    if x < 1e-2 { x * x * (1.0 / 3.0 + x * x / 45.0) } else { 1.0 - x / x.tan() }
}

/// H(μ) = exp(−μ/π ∫₀^{π/2} ln(1 − α φ cot φ)/(cos²φ + μ² sin²φ) dφ), the closed form.
///
/// With tan ψ = μ tan φ the denominator goes: dφ/(cos²φ + μ² sin²φ) = dψ/μ. With ψ = π/2 e^{-x}
/// the logarithm at ψ = 0 and the width μ of its surroundings are resolved at every μ.
fn closed_form(gamma: f64, mu: f64) -> f64 {
    let alpha = 1.0 - gamma * gamma;
    let integrand = |x: f64| {
        let psi = FRAC_PI_2 * (-x).exp();
        let phi = psi.sin().atan2(mu * psi.cos());
        psi * (gamma * gamma + alpha * one_minus_x_cot_x(phi)).ln()
    };
    (-integrate(0.0, 45.0, 90, integrand) / PI).exp()
}

/// The half-space whose single-scattering albedo is `alpha`, by bisection.
fn with_alpha(alpha: f64) -> HFunction {
    let (mut low, mut high) = (0.0, 1.0);
    while high - low > 1e-15 {
        let middle = 0.5 * (low + high);
        if HFunction::new(middle).alpha().re < alpha {
            low = middle;
        } else {
            high = middle;
        }
    }
    HFunction::new(high)
}

#[track_caller]
fn assert_close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected}");
}

/// Cosines between the knots as well as on them, from grazing to normal.
fn cosines() -> impl Iterator<Item = f64> {
    (1..=500).map(|i| (f64::from(i) / 500.0).powi(6))
}

/// ∫₀¹ f(μ) dμ in t = μ^¼, panel by panel of the table.
fn integrate_mu(f: impl Fn(f64) -> f64) -> f64 {
    integrate(0.0, 1.0, INTERVALS as usize, |t| 4.0 * t.powi(3) * f(t.powi(4)))
}

#[test]
fn agrees_with_the_closed_form() {
    for albedo in [0.0, 1e-6, 0.001, 0.1, 0.5, 0.8, 0.95, 0.999, 1.0] {
        let h = HFunction::new(albedo);
        for mu in cosines() {
            assert_close(h.value(mu) / closed_form(h.gamma(), mu), 1.0, 3e-9);
        }
    }
}

/// Chandrasekhar (1960), table XI, and the closed form at other single-scattering albedos.
#[test]
fn agrees_with_published_values() {
    let white = HFunction::new(1.0);
    for (mu, h) in [(0.0, 1.0), (0.1, 1.2474), (0.5, 2.0128), (1.0, 2.9078)] {
        assert_close(white.value(mu), h, 5.01e-5);
    }
    for (alpha, h) in [(0.5, 1.25126), (0.8, 1.59822), (0.9, 1.85010)] {
        assert_close(with_alpha(alpha).value(1.0), h, 5.01e-6);
    }
}

/// ∫ H dμ = 2 and ∫ μH dμ = 2/√3 where nothing is absorbed.
#[test]
fn conservative_moments_are_exact() {
    let h = HFunction::new(1.0);
    assert_close(integrate_mu(|mu| h.value(mu)), 2.0, 1e-9);
    assert_close(integrate_mu(|mu| mu * h.value(mu)), 2.0 / 3.0f64.sqrt(), 1e-9);
}

/// Single-scattering albedos by hemispherical albedo, computed independently.
#[test]
fn inverts_the_hemispherical_albedo() {
    let checked =
        [(0.1, 0.379087), (0.2, 0.609675), (0.5, 0.911336), (0.8, 0.990585), (0.95, 0.999505)];
    for (albedo, alpha) in checked {
        assert_close(HFunction::new(albedo).alpha().re, alpha, 5.01e-7);
    }
}

#[test]
fn ends_are_exact() {
    let black = HFunction::new(0.0);
    assert_eq!((black.gamma(), black.alpha().re), (1.0, 0.0));
    assert!(cosines().all(|mu| black.value(mu) == 1.0));
    let white = HFunction::new(1.0);
    assert_eq!((white.gamma(), white.alpha().re), (0.0, 1.0));
}

#[test]
fn gamma_falls_all_the_way() {
    let gammas: Vec<f64> =
        (0..=10_000).map(|i| HFunction::new(f64::from(i) / 10_000.0).gamma()).collect();
    assert!(gammas.windows(2).all(|pair| pair[1] < pair[0]));
}

#[test]
fn newton_needs_few_steps() {
    for i in 0..=1000 {
        let albedo = f64::from(i) / 1000.0;
        let mut moments = Moments::guess(albedo);
        let steps = 1 + (0..20).take_while(|_| moments.improve(albedo) >= CONVERGED).count();
        assert!(steps <= 5, "{steps} at {albedo}");
    }
}

/// The central difference of step 2 `step`, extrapolated once to step 0.
fn slope(f: impl Fn(f64) -> f64, x: f64, step: f64) -> f64 {
    let central = |step: f64| (f(x + step) - f(x - step)) / (2.0 * step);
    (4.0 * central(0.5 * step) - central(step)) / 3.0
}

#[test]
fn dual_part_is_the_derivative() {
    for albedo in [0.001, 0.1, 0.5, 0.9, 0.999] {
        let h = HFunction::new(albedo);
        let alpha_by_albedo = slope(|k| HFunction::new(k).alpha().re, albedo, 4e-4);
        assert_close(h.alpha().eps / alpha_by_albedo, 1.0, 1e-8);
        for mu in cosines().step_by(20) {
            let expected = slope(|k| HFunction::new(k).value(mu), albedo, 4e-4);
            assert_close(h.dual(mu).eps, expected, 1e-8 * expected + 1e-11);
            assert_eq!(h.dual(mu).re, h.value(mu));
        }
    }
}

#[test]
fn elimination_solves_both_sides() {
    let rows = vec![
        vec![4.0, 1.0, 2.0, 13.0, 8.0],
        vec![1.0, 3.0, 0.0, -1.0, -5.0],
        vec![2.0, 0.0, 5.0, 19.0, 17.0],
    ];
    let expected = [[2.0, 1.0], [-1.0, -2.0], [3.0, 3.0]];
    for (found, expected) in solve_positive_definite(rows).iter().zip(expected) {
        assert_close(found[0], expected[0], 1e-14);
        assert_close(found[1], expected[1], 1e-14);
    }
}
