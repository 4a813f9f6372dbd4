//! The minimum of a convex energy along a line that a barrier may end.

const TOLERANCE: f64 = 0.1;
const EVALUATIONS: usize = 60;

/// A step in (0, `longest`) at which the slope's size has fallen to a tenth of its size at 0.
///
/// `derivatives(step)` gives slope and curvature; the slope grows with the step and is
/// `initial_slope` < 0 at 0. Newton's method, kept inside a bracket by bisection; 1 is tried first.
pub(super) fn search(
    initial_slope: f64,
    longest: f64,
    derivatives: impl Fn(f64) -> [f64; 2],
) -> f64 {
    let (mut low, mut high) = (0.0, longest);
    let mut step = f64::min(1.0, 0.9 * longest);
    for _ in 0..EVALUATIONS {
        let [slope, curvature] = derivatives(step);
        if slope.abs() <= -TOLERANCE * initial_slope {
            return step;
        }
        if slope < 0.0 {
            low = step;
        } else {
            high = step;
        }
        let newton = step - slope / curvature;
        step = if low < newton && newton < high {
            newton
        } else if high.is_finite() {
            (low + high) / 2.0
        } else {
            2.0 * step
        };
    }
    // Rounding hides the minimum: the energy still falls as far as the lower end.
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_minima_before_at_and_behind_the_full_step() {
        for minimum in [1e-3, 0.3, 1.0, 7.0] {
            let step = search(-minimum, f64::INFINITY, |step| [step - minimum, 1.0]);
            assert!((step - minimum).abs() <= TOLERANCE * minimum);
        }
    }

    #[test]
    fn stays_before_the_barrier() {
        // 1 / (1 - t) - 3 t: its minimum is at 1 - 3^(-1/2).
        let derivatives = |t: f64| {
            assert!(t < 1.0);
            [(1.0 - t).powi(-2) - 3.0, 2.0 * (1.0 - t).powi(-3)]
        };
        let step = search(-2.0, 1.0, derivatives);
        assert!(derivatives(step)[0].abs() <= 0.2);
    }
}
