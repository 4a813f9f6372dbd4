//! The energy of a woven cell and its gradient at the knots (Montazeri et al. 2020, Eqs. 2-4).

use rayon::prelude::*;

use super::curve::{HeightCurve, HeightCurves, Segment};
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

/// How hard a crossing pushes its yarns apart (less the potential's slope), and how much harder if
/// they come closer (its curvature); both with respect to the ratio u.
#[derive(Clone, Copy)]
pub(super) struct Push {
    pub force: f64,
    pub curvature: f64,
}

impl Push {
    /// The push p of a contact that opens smoothly: p (p - q) is `softness`, where q is the push of
    /// [`Repulsion`] below u = 1 and the same function, less than nil, beyond.
    ///
    /// The potential of p is convex and has all derivatives; at softness 0 it is Eq. 3's.
    pub fn softened(ratio: f64, softness: f64) -> Self {
        if softness == 0.0 {
            let Repulsion { slope, curvature, .. } = Repulsion::at(ratio);
            return Self { force: -slope, curvature };
        }
        let square = ratio * ratio;
        let inverse = 1.0 / square;
        let hard = 4.0 * (inverse - square) * (inverse + square) / ratio;
        let root = (hard * hard + 4.0 * softness).sqrt();
        // The form without cancellation.
        let force = if hard > 0.0 { (hard + root) / 2.0 } else { 2.0 * softness / (root - hard) };
        let stiffness = 20.0 * inverse * inverse * inverse + 12.0 * square;
        Self { force, curvature: stiffness * force / root }
    }
}

/// Energy of one cell, Eq. 4, and how far from a minimum it is.
pub struct Energy {
    /// E of Eq. 4.
    pub value: f64,
    /// Euclidean norm of the gradient with respect to every height and slope of the curves.
    pub gradient_norm: f64,
}

impl Energy {
    /// The energy of these curves, whose odd knots are the crossings in pattern order.
    ///
    /// It is infinite if the yarns of a crossing are not in the order that the pattern wants.
    pub fn of(problem: &RelaxProblem, warp: &HeightCurves, weft: &HeightCurves) -> Self {
        let ends = (0..warp.len()).into_par_iter().map(|end| {
            let own = YarnEnergy::of_warp(problem, [warp, weft], end);
            [own.strain + own.collisions, own.squared_gradient()]
        });
        // Either yarn of a crossing knows of its collision: it counts once.
        let picks = (0..weft.len()).into_par_iter().map(|pick| {
            let own = YarnEnergy::of_weft(problem, [warp, weft], pick);
            [own.strain, own.squared_gradient()]
        });
        let all: Vec<[f64; 2]> = ends.chain(picks).collect();
        let [value, square] = all.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        Self { value, gradient_norm: square.sqrt() }
    }
}

/// What the energy gets from one yarn.
struct YarnEnergy {
    strain: f64,
    collisions: f64,
    /// dE/dh at each knot.
    by_height: Vec<f64>,
    /// dE/d(dh/ds) at each knot.
    by_slope: Vec<f64>,
}

impl YarnEnergy {
    fn of_warp(problem: &RelaxProblem, [warp, weft]: [&HeightCurves; 2], end: usize) -> Self {
        let mut energy = Self::of_strain(&warp.yarn(end), problem.warp.stiffness[end]);
        for pick in 0..weft.len() {
            let own = warp.yarn(end).height[2 * pick + 1];
            let over = own - weft.yarn(pick).height[2 * end + 1];
            energy.collide(problem, 2 * pick + 1, over, problem.contact(pick, end));
        }
        energy
    }

    fn of_weft(problem: &RelaxProblem, [warp, weft]: [&HeightCurves; 2], pick: usize) -> Self {
        let mut energy = Self::of_strain(&weft.yarn(pick), problem.weft.stiffness[pick]);
        for end in 0..warp.len() {
            let own = weft.yarn(pick).height[2 * end + 1];
            let over = own - warp.yarn(end).height[2 * pick + 1];
            energy.collide(problem, 2 * end + 1, over, -problem.contact(pick, end));
        }
        energy
    }

    fn of_strain(curve: &HeightCurve, stiffness: f64) -> Self {
        let count = curve.knots.len();
        let (mut by_height, mut by_slope) = (vec![0.0; count], vec![0.0; count]);
        let mut value = 0.0;
        for index in 0..count {
            let next = curve.after(index);
            let strain = SegmentStrain::of(&curve.segment(index), stiffness);
            value += strain.value;
            by_height[index] -= strain.by_rise;
            by_height[next] += strain.by_rise;
            by_slope[index] += strain.by_slope[0];
            by_slope[next] += strain.by_slope[1];
        }
        Self { strain: value, collisions: 0.0, by_height, by_slope }
    }

    /// Adds a crossing at a knot, where this yarn is higher than the other by `over` and collides
    /// within `contact`, which is negative if it belongs below.
    fn collide(&mut self, problem: &RelaxProblem, knot: usize, over: f64, contact: f64) {
        let ratio = over / contact;
        if ratio <= 0.0 {
            self.collisions = f64::INFINITY;
        }
        let repulsion = Repulsion::at(ratio);
        self.collisions += problem.collision_stiffness * repulsion.value;
        self.by_height[knot] += problem.collision_stiffness * repulsion.slope / contact;
    }

    fn squared_gradient(&self) -> f64 {
        self.by_height.iter().chain(&self.by_slope).map(|derivative| derivative * derivative).sum()
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
    fn curves(problem: &RelaxProblem) -> [HeightCurves; 2] {
        let wave = |yarn: usize, knot: usize| (1.0 + 2.3 * yarn as f64 + 3.1 * knot as f64).sin();
        let curves = |first, count, slots: &[f64], side: &dyn Fn(usize, usize) -> f64| {
            let mut curves = HeightCurves::flat(count, slots);
            let knots = curves.knots.len();
            for (index, height) in curves.height.iter_mut().enumerate() {
                let (yarn, knot) = (index / knots, index % knots);
                *height = 0.15 * wave(first + yarn, knot) + 0.35 * side(yarn, knot / 2);
            }
            for (index, slope) in curves.slope.iter_mut().enumerate() {
                *slope = wave(first + index / knots + 5, index % knots);
            }
            curves
        };
        let side = |pick, end| problem.contact(pick, end).signum();
        let warp = curves(0, 3, &problem.weft.spacing, &|end, pick| side(pick, end));
        let weft = curves(9, 2, &problem.warp.spacing, &|pick, end| -side(pick, end));
        [warp, weft]
    }

    #[test]
    fn gradient_is_that_of_central_differences() {
        let problem = problem();
        let [warp, weft] = curves(&problem);
        let both = [&warp, &weft];
        let gradients: Vec<_> = (0..3)
            .map(|end| (0, end, YarnEnergy::of_warp(&problem, both, end)))
            .chain((0..2).map(|pick| (1, pick, YarnEnergy::of_weft(&problem, both, pick))))
            .collect();
        let step = 1e-6;
        let mut squares = 0.0;
        for (set, yarn, gradient) in gradients {
            for knot in 0..gradient.by_height.len() {
                let value = |height_change: f64, slope_change: f64| {
                    let mut curves = [warp.clone(), weft.clone()];
                    let index = yarn * gradient.by_height.len() + knot;
                    curves[set].height[index] += height_change;
                    curves[set].slope[index] += slope_change;
                    Energy::of(&problem, &curves[0], &curves[1]).value
                };
                let by_height = (value(step, 0.0) - value(-step, 0.0)) / (2.0 * step);
                let by_slope = (value(0.0, step) - value(0.0, -step)) / (2.0 * step);
                squares += by_height * by_height + by_slope * by_slope;
                for (exact, difference) in
                    [(gradient.by_height[knot], by_height), (gradient.by_slope[knot], by_slope)]
                {
                    let error = (exact - difference).abs();
                    assert!(error < 1e-6 * (1.0 + exact.abs()), "{exact} {difference}");
                }
            }
        }
        let norm = Energy::of(&problem, &warp, &weft).gradient_norm;
        assert!((norm / squares.sqrt() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn strain_is_the_integral_of_the_squared_slope() {
        let [warp, _] = curves(&problem());
        let curve = warp.yarn(1);
        let energy = YarnEnergy::of_strain(&curve, 2.5);
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
        assert!((energy.strain - 1.25 * integral).abs() < 1e-9 * energy.strain);
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
    fn soft_pushes_keep_their_equation_and_harden_to_the_printed_potential() {
        for ratio in [0.3, 0.9, 1.0, 1.1, 3.0] {
            let hard = -4.0 * (f64::powi(ratio, 3) - f64::powi(ratio, -5));
            for softness in [1e-6, 1e-2, 10.0] {
                let push = Push::softened(ratio, softness);
                let product = push.force * (push.force - hard);
                assert!(push.force > 0.0 && (product / softness - 1.0).abs() < 1e-4);
                let step = 1e-6 * ratio;
                let [less, more] =
                    [ratio - step, ratio + step].map(|ratio| Push::softened(ratio, softness).force);
                let curvature = (less - more) / (2.0 * step);
                assert!((push.curvature / curvature - 1.0).abs() < 1e-5, "{ratio} {softness}");
            }
            let [softest, none] = [1e-20, 0.0].map(|softness| Push::softened(ratio, softness));
            assert!((softest.force - none.force).abs() < 1e-9);
            assert_eq!(none.force, -Repulsion::at(ratio).slope);
        }
    }

    #[test]
    fn swapped_yarns_have_no_finite_energy() {
        let problem = problem();
        let [mut warp, weft] = curves(&problem);
        warp.height[1] = weft.height[1] - 0.1;
        assert_eq!(Energy::of(&problem, &warp, &weft).value, f64::INFINITY);
    }
}
