//! Chandrasekhar's H function of an isotropically scattering half-space, by its hemispherical
//! albedo.
//!
//! With α the single-scattering albedo and γ = √(1 − α), H solves (Chandrasekhar 1960, chapter V)
//!
//! 1/H(μ) = γ + α/2 ∫₀¹ μ′H(μ′)/(μ + μ′) dμ′,
//!
//! and the half-space returns the fraction k = 1 − 2γ ∫₀¹ μH(μ) dμ of diffuse light. Everything is
//! smooth in γ, also at the conservative end γ = 0, where it is not in α; hence γ is the unknown.

use std::num::NonZeroUsize;
use std::sync::LazyLock;

use gauss_quad::GaussLegendre;
use num_dual::{Dual64, DualNum};

/// Nodes of the quadrature over μ. Forty leave a relative error of at most 2e-10 in H.
const NODES: NonZeroUsize = NonZeroUsize::new(40).unwrap();

/// Intervals of the table over μ^¼. Interpolation adds a relative error of at most 2e-9 to H.
const INTERVALS: u32 = 128;

/// Newton's method takes at most five steps from Hapke's approximation; more means rounding.
const MAX_STEPS: usize = 12;

/// The relative step at which Newton's method has converged.
const CONVERGED: f64 = 1e-12;

/// A node of the quadrature ∫₀¹ μ f(μ) dμ ≈ Σ `weight` f(`mu`).
struct Node {
    mu: f64,
    weight: f64,
}

/// Gauss-Legendre in t = μ^¼, in which the μ log μ of H at grazing angles is three times
/// continuously differentiable.
static RULE: LazyLock<Vec<Node>> = LazyLock::new(|| {
    let node = |&(x, w): &(f64, f64)| {
        let t = 0.5 * (x + 1.0);
        let mu = t.powi(4);
        Node { mu, weight: mu * 4.0 * t.powi(3) * 0.5 * w }
    };
    GaussLegendre::new(NODES).iter().map(node).collect()
});

/// A value at a knot of the table, and its slope per interval.
#[derive(Clone, Copy)]
struct Knot {
    value: Dual64,
    slope: Dual64,
}

/// The coefficients of a cubic in the offset into an interval, the constant first.
type Cubic = [f64; 4];

/// H of the half-space with a given hemispherical albedo, tabulated.
///
/// Cubic Hermite interpolation over μ^¼; the derivative with respect to the albedo is tabulated on
/// the same knots, so that it is the derivative of the interpolated function itself.
#[derive(Clone, PartialEq, Debug)]
pub struct HFunction {
    alpha: Dual64,
    gamma: f64,
    values: Vec<Cubic>,
    by_albedo: Vec<Cubic>,
}

impl HFunction {
    /// Solves for the half-space of hemispherical (bi-hemispherical) `albedo`, within [0, 1].
    pub fn new(albedo: f64) -> Self {
        let moments = Moments::solve(albedo);
        let knots: Vec<Knot> = (0..=INTERVALS).map(|i| moments.knot(i)).collect();
        let cubics = knots.windows(2).map(|pair| hermite(pair[0], pair[1]));
        let (values, by_albedo) = cubics.map(|c| (c.map(|x| x.re), c.map(|x| x.eps))).unzip();
        Self { alpha: moments.half_alpha() * 2.0, gamma: moments.gamma.re, values, by_albedo }
    }

    /// The single-scattering albedo α; its dual part is the derivative with respect to the
    /// hemispherical albedo.
    pub fn alpha(&self) -> Dual64 {
        self.alpha
    }

    /// γ = √(1 − α), without the cancellation.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// H(μ) for μ in [0, 1].
    pub fn value(&self, mu: f64) -> f64 {
        Place::of(mu).evaluate(&self.values)
    }

    /// H(μ); its dual part is the derivative with respect to the hemispherical albedo.
    pub fn dual(&self, mu: f64) -> Dual64 {
        let place = Place::of(mu);
        Dual64::new(place.evaluate(&self.values), place.evaluate(&self.by_albedo))
    }
}

/// Where a cosine lies in the table: the interval, and how far into it.
struct Place {
    interval: usize,
    offset: f64,
}

impl Place {
    fn of(mu: f64) -> Self {
        let x = mu.sqrt().sqrt() * f64::from(INTERVALS);
        let interval = (x as u32).min(INTERVALS - 1);
        Self { interval: interval as usize, offset: x - f64::from(interval) }
    }

    fn evaluate(&self, cubics: &[Cubic]) -> f64 {
        let [a, b, c, d] = cubics[self.interval];
        a + self.offset * (b + self.offset * (c + self.offset * d))
    }
}

/// The cubic that takes the values and slopes of the knots at both ends of an interval.
fn hermite(left: Knot, right: Knot) -> [Dual64; 4] {
    let rise = right.value - left.value;
    let curvature = rise * 3.0 - left.slope * 2.0 - right.slope;
    let twist = left.slope + right.slope - rise * 2.0;
    [left.value, left.slope, curvature, twist]
}

/// The solution of the discretised equation: γ, and the summands mⱼ = cⱼHⱼ of ∫₀¹ μH(μ) dμ, cⱼ the
/// weights. The dual part is the derivative with respect to the hemispherical albedo.
struct Moments {
    gamma: Dual64,
    summands: Vec<Dual64>,
}

impl Moments {
    /// Newton's method for γ and H together, given the hemispherical albedo.
    fn solve(albedo: f64) -> Self {
        let mut moments = Self::guess(albedo);
        for _ in 0..MAX_STEPS {
            if moments.improve(albedo) < CONVERGED {
                break;
            }
        }
        moments
    }

    /// Hapke's (1981) approximation, which is exact where α is 0.
    fn guess(albedo: f64) -> Self {
        let gamma = (1.0 - albedo) / (1.0 + albedo);
        let h = |mu: f64| (1.0 + 2.0 * mu) / (1.0 + 2.0 * mu * gamma);
        let summand = |node: &Node| Dual64::from_re(node.weight * h(node.mu));
        Self { gamma: Dual64::from_re(gamma), summands: RULE.iter().map(summand).collect() }
    }

    /// One step of Newton's method; returns its length relative to the solution.
    ///
    /// Along B p = F and B q = ∂F/∂γ (see [`Moments::linearise`]) the step is −p − q Δγ, and what
    /// is left is one equation for Δγ: k = 1 − γ Σ mⱼ/Σ cⱼ, in which Σ cⱼ = 1/2 up to
    /// rounding; written so, both ends of the range of k come out exactly.
    fn improve(&mut self, albedo: f64) -> f64 {
        let solutions = solve_positive_definite(self.linearise());
        let [residual, border] =
            solutions.iter().fold([0.0; 2], |sum, [p, q]| [sum[0] + p, sum[1] + q]);
        let total: f64 = self.summands.iter().map(|m| m.re).sum();
        let weight: f64 = RULE.iter().map(|node| node.weight).sum();

        let gamma = self.gamma.re;
        let missing = albedo - (1.0 - gamma * (total / weight));
        let albedo_by_gamma = (gamma * border - total) / weight;
        let gamma_step = (missing - gamma * residual / weight) / albedo_by_gamma;
        self.gamma = Dual64::new((gamma + gamma_step).clamp(0.0, 1.0), 1.0 / albedo_by_gamma);

        let mut length = gamma_step.abs();
        for (m, [p, q]) in self.summands.iter_mut().zip(solutions) {
            let step = -p - q * gamma_step;
            length = length.max((step / m.re).abs());
            *m = Dual64::new(m.re + step, -q * self.gamma.eps);
        }
        length
    }

    /// The equations Fᵢ = γ + α/2 Σⱼ mⱼ/(μᵢ + μⱼ) − cᵢ/mᵢ = 0, linearised: each row holds the
    /// derivatives B by the mⱼ, δᵢⱼ cᵢ/mᵢ² + α/2 · 1/(μᵢ + μⱼ), which are symmetric and positive
    /// definite, then Fᵢ, then ∂Fᵢ/∂γ.
    fn linearise(&self) -> Vec<Vec<f64>> {
        let half_alpha = self.half_alpha().re;
        let row = |(i, (at, summand)): (usize, (&Node, &Dual64))| {
            let mut row = Vec::with_capacity(RULE.len() + 2);
            row.extend(RULE.iter().map(|node| 1.0 / (at.mu + node.mu)));
            let integral: f64 = row.iter().zip(&self.summands).map(|(r, m)| r * m.re).sum();
            row.iter_mut().for_each(|entry| *entry *= half_alpha);
            let inverse_h = at.weight / summand.re;
            row[i] += inverse_h / summand.re;
            row.push(self.gamma.re + half_alpha * integral - inverse_h);
            row.push(1.0 - self.gamma.re * integral);
            row
        };
        RULE.iter().zip(&self.summands).enumerate().map(row).collect()
    }

    /// α/2, from α = 1 − γ².
    fn half_alpha(&self) -> Dual64 {
        (-self.gamma + 1.0) * (self.gamma + 1.0) * 0.5
    }

    /// H at a knot of the table, from the equation 1/H = γ + α/2 Σⱼ mⱼ/(μ + μⱼ) that it solves, and
    /// its derivative with respect to the albedo.
    fn knot(&self, index: u32) -> Knot {
        let t = f64::from(index) / f64::from(INTERVALS);
        let mu = t.powi(4);
        let mu_per_interval = 4.0 * t.powi(3) / f64::from(INTERVALS);
        let (mut integral, mut falloff) = (Dual64::from_re(0.0), Dual64::from_re(0.0));
        for (node, &m) in RULE.iter().zip(&self.summands) {
            let inverse = 1.0 / (mu + node.mu);
            integral += m * inverse;
            falloff += m * (inverse * inverse);
        }
        let h = (self.gamma + self.half_alpha() * integral).recip();
        let slope = h * h * self.half_alpha() * falloff * mu_per_interval;
        Knot { value: h, slope }
    }
}

/// Solves a symmetric positive definite system for two right-hand sides, the last two columns of
/// `rows`, by elimination in the upper triangle; such a system needs no pivoting.
fn solve_positive_definite(mut rows: Vec<Vec<f64>>) -> Vec<[f64; 2]> {
    let n = rows.len();
    for k in 0..n {
        let (above, below) = rows.split_at_mut(k + 1);
        let pivot = &above[k];
        for (i, row) in (k + 1..).zip(below) {
            let factor = pivot[i] / pivot[k];
            row[i..].iter_mut().zip(&pivot[i..]).for_each(|(x, p)| *x -= factor * p);
        }
    }
    let mut solution = vec![[0.0; 2]; n];
    for (i, row) in rows.iter().enumerate().rev() {
        for side in 0..2 {
            let known: f64 = (i + 1..n).map(|j| row[j] * solution[j][side]).sum();
            solution[i][side] = (row[n + side] - known) / row[i];
        }
    }
    solution
}

#[cfg(test)]
mod tests;
