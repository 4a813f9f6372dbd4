//! The energy of a woven cell and its gradient at the knots (Montazeri et al. 2020, Eqs. 2-4).

use super::curve::{HeightCurve, Segment};
use super::problem::RelaxProblem;

/// Value and first two derivatives of Eq. 3's potential with respect to the ratio
/// u = |h_A - h_B| / (R_A + R_B): f(u^2) = u^-4 + u^4 - 2 below u = 1, zero from there on.
pub(super) struct Repulsion {
    pub value: f64,
    pub slope: f64,
    pub curvature: f64,
}

impl Repulsion {
    pub fn at(ratio: f64) -> Self {
        if ratio >= 1.0 {
            return Self { value: 0.0, slope: 0.0, curvature: 0.0 };
        }
        let square = ratio * ratio;
        let inverse = 1.0 / square;
        // (u^-2 - u^2)^2 is u^-4 + u^4 - 2 without its cancellation near u = 1.
        let root = inverse - square;
        Self {
            value: root * root,
            slope: -4.0 * root * (inverse + square) / ratio,
            curvature: 20.0 * inverse * inverse * inverse + 12.0 * square,
        }
    }
}

/// The derivatives of the energy with respect to one curve's heights and slopes at its knots.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveGradient {
    /// dE/dh at each knot.
    pub height: Vec<f64>,
    /// dE/d(dh/ds) at each knot.
    pub slope: Vec<f64>,
}

/// Energy of one cell, Eq. 4, and its gradient for every warp and every weft curve.
pub struct Energy {
    /// E of Eq. 4.
    pub value: f64,
    /// One per warp yarn.
    pub warp: Vec<CurveGradient>,
    /// One per weft yarn.
    pub weft: Vec<CurveGradient>,
}

impl Energy {
    /// The energy of these curves, whose odd knots are the crossings in pattern order.
    ///
    /// It is infinite if the yarns of a crossing are not in the order that the pattern wants.
    pub fn of(problem: &RelaxProblem, warp: &[HeightCurve], weft: &[HeightCurve]) -> Self {
        let mut energy = Self { value: 0.0, warp: Vec::new(), weft: Vec::new() };
        for (curve, &stiffness) in warp.iter().zip(&problem.warp.stiffness) {
            let gradient = energy.add_strain(curve, stiffness);
            energy.warp.push(gradient);
        }
        for (curve, &stiffness) in weft.iter().zip(&problem.weft.stiffness) {
            let gradient = energy.add_strain(curve, stiffness);
            energy.weft.push(gradient);
        }
        for (pick, weft) in weft.iter().enumerate() {
            for (end, warp) in warp.iter().enumerate() {
                let (a, b) = (2 * pick + 1, 2 * end + 1);
                let contact = problem.contact(pick, end);
                let ratio = (warp.height[a] - weft.height[b]) / contact;
                if ratio <= 0.0 {
                    energy.value = f64::INFINITY;
                }
                let repulsion = Repulsion::at(ratio);
                energy.value += problem.collision_stiffness * repulsion.value;
                let force = problem.collision_stiffness * repulsion.slope / contact;
                energy.warp[end].height[a] += force;
                energy.weft[pick].height[b] -= force;
            }
        }
        energy
    }

    /// Euclidean norm of the gradient with respect to every height and slope.
    pub fn gradient_norm(&self) -> f64 {
        let curves = self.warp.iter().chain(&self.weft);
        let squares = curves.flat_map(|curve| curve.height.iter().chain(&curve.slope));
        squares.map(|derivative| derivative * derivative).sum::<f64>().sqrt()
    }

    fn add_strain(&mut self, curve: &HeightCurve, stiffness: f64) -> CurveGradient {
        let count = curve.knots.len();
        let mut gradient = CurveGradient { height: vec![0.0; count], slope: vec![0.0; count] };
        for index in 0..count {
            let next = curve.after(index);
            let strain = SegmentStrain::of(&curve.segment(index), stiffness);
            self.value += strain.value;
            gradient.height[index] -= strain.by_rise;
            gradient.height[next] += strain.by_rise;
            gradient.slope[index] += strain.by_slope[0];
            gradient.slope[next] += strain.by_slope[1];
        }
        gradient
    }
}

/// Strain energy of one cubic segment (Eq. 18 with its prefactor put right), and its derivatives.
struct SegmentStrain {
    value: f64,
    /// With respect to h1 - h0.
    by_rise: f64,
    /// With respect to the slopes at both ends.
    by_slope: [f64; 2],
}

impl SegmentStrain {
    fn of(segment: &Segment, stiffness: f64) -> Self {
        let d = segment.height[1] - segment.height[0];
        let [m0, m1] = segment.slope.map(|slope| slope * segment.length);
        let scale = stiffness / (30.0 * segment.length);
        let bracket = 18.0 * d * d - 3.0 * d * (m0 + m1) + 2.0 * (m0 * m0 + m1 * m1) - m0 * m1;
        Self {
            value: scale * bracket,
            by_rise: scale * (36.0 * d - 3.0 * (m0 + m1)),
            by_slope: [
                scale * segment.length * (4.0 * m0 - m1 - 3.0 * d),
                scale * segment.length * (4.0 * m1 - m0 - 3.0 * d),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weave::pattern::WeavePattern;
    use crate::weave::problem::YarnData;

    fn problem() -> RelaxProblem {
        RelaxProblem {
            pattern: WeavePattern::new(2, 3, vec![true, false, true, false, true, true]).unwrap(),
            warp: YarnData {
                radius: vec![0.3, 0.5, 0.4],
                stiffness: vec![1.0, 2.5, 0.6],
                spacing: vec![1.0, 1.4, 0.7],
            },
            weft: YarnData {
                radius: vec![0.35, 0.45],
                stiffness: vec![1.2, 0.8],
                spacing: vec![0.9, 1.3],
            },
            collision_stiffness: 1.7,
        }
    }

    /// Curves in the pattern's order, some contacts closed and some open.
    fn curves(problem: &RelaxProblem) -> [Vec<HeightCurve>; 2] {
        let wave = |yarn: usize, knot: usize| (1.0 + 2.3 * yarn as f64 + 3.1 * knot as f64).sin();
        let curve = |yarn: usize, slots: &[f64], side: &dyn Fn(usize) -> f64| {
            let mut knots = Vec::new();
            let mut period = 0.0;
            for slot in slots {
                knots.extend([period, period + slot / 2.0]);
                period += slot;
            }
            HeightCurve {
                height: (0..knots.len())
                    .map(|knot| 0.15 * wave(yarn, knot) + 0.35 * side(knot / 2))
                    .collect(),
                slope: (0..knots.len()).map(|knot| wave(yarn + 5, knot)).collect(),
                knots: knots.into(),
                period,
            }
        };
        let side = |pick, end| problem.contact(pick, end).signum();
        let warp =
            (0..3).map(|end| curve(end, &problem.weft.spacing, &|pick| side(pick, end))).collect();
        let weft = (0..2)
            .map(|pick| curve(pick + 9, &problem.warp.spacing, &|end| -side(pick, end)))
            .collect();
        [warp, weft]
    }

    #[test]
    fn gradient_is_that_of_central_differences() {
        let problem = problem();
        let [warp, weft] = curves(&problem);
        let energy = Energy::of(&problem, &warp, &weft);
        let gradients = [&energy.warp, &energy.weft];
        let step = 1e-6;
        for (set, gradients) in gradients.into_iter().enumerate() {
            for (yarn, gradient) in gradients.iter().enumerate() {
                for knot in 0..gradient.height.len() {
                    let value = |height_change: f64, slope_change: f64| {
                        let mut curves = [warp.clone(), weft.clone()];
                        curves[set][yarn].height[knot] += height_change;
                        curves[set][yarn].slope[knot] += slope_change;
                        Energy::of(&problem, &curves[0], &curves[1]).value
                    };
                    let by_height = (value(step, 0.0) - value(-step, 0.0)) / (2.0 * step);
                    let by_slope = (value(0.0, step) - value(0.0, -step)) / (2.0 * step);
                    for (exact, difference) in
                        [(gradient.height[knot], by_height), (gradient.slope[knot], by_slope)]
                    {
                        let error = (exact - difference).abs();
                        assert!(error < 1e-6 * (1.0 + exact.abs()), "{exact} {difference}");
                    }
                }
            }
        }
    }

    #[test]
    fn strain_is_the_integral_of_the_squared_slope() {
        let problem = problem();
        let [warp, _] = curves(&problem);
        let curve = &warp[1];
        let mut energy = Energy { value: 0.0, warp: Vec::new(), weft: Vec::new() };
        energy.add_strain(curve, 2.5);
        // Simpson's rule is exact for cubics only, and the squared slope is a quartic: refine.
        let parts = 400;
        let mut integral = 0.0;
        for index in 0..curve.knots.len() {
            let width = curve.segment(index).length / f64::from(parts);
            for part in 0..parts {
                let start = curve.knots[index] + width * f64::from(part);
                let square = |fraction: f64| curve.eval(start + fraction * width).1.powi(2);
                // Just inside the piece: eval would take its end for the start of the next.
                let sum = square(0.0) + 4.0 * square(0.5) + square(1.0 - 1e-13);
                integral += width / 6.0 * sum;
            }
        }
        assert!((energy.value - 1.25 * integral).abs() < 1e-9 * energy.value);
    }

    #[test]
    fn repulsion_is_the_printed_potential_and_ends_smoothly_at_one() {
        for ratio in [0.05, 0.3, 0.7, 0.99] {
            let d: f64 = ratio * ratio;
            let expected = d.powi(-2) + d.powi(2) - 2.0;
            let repulsion = Repulsion::at(ratio);
            assert!((repulsion.value - expected).abs() < 1e-12 * (1.0 + expected));
            let step = 1e-6 * ratio;
            let [less, more] = [ratio - step, ratio + step].map(Repulsion::at);
            let slope = (more.value - less.value) / (2.0 * step);
            let curvature = (more.slope - less.slope) / (2.0 * step);
            assert!((repulsion.slope / slope - 1.0).abs() < 1e-7);
            assert!((repulsion.curvature / curvature - 1.0).abs() < 1e-7);
        }
        let last = Repulsion::at(1.0 - 1e-9);
        assert!(last.value < 1e-15 && last.slope.abs() < 1e-7);
        assert_eq!(Repulsion::at(1.0).value, 0.0);
    }

    #[test]
    fn swapped_yarns_have_no_finite_energy() {
        let problem = problem();
        let [mut warp, weft] = curves(&problem);
        warp[0].height[1] = weft[0].height[1] - 0.1;
        assert_eq!(Energy::of(&problem, &warp, &weft).value, f64::INFINITY);
    }
}
