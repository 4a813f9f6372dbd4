//! A yarn's height as a periodic, continuously differentiable, piecewise-cubic function.

/// The heights of all yarns of a direction, whose knots are at the same places.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightCurves {
    /// Where along the yarns the knots are: increasing from 0, all below `period`.
    pub knots: Vec<f64>,
    /// The length after which the curves repeat.
    pub period: f64,
    /// h at each knot, yarn by yarn.
    pub height: Vec<f64>,
    /// dh/ds at each knot, yarn by yarn.
    pub slope: Vec<f64>,
}

impl HeightCurves {
    /// Flat yarns at height 0, as many as `yarns`, whose knots are the boundaries and the middles of
    /// `slots`.
    pub fn flat(yarns: usize, slots: &[f64]) -> Self {
        let mut period = 0.0;
        let mut knots = Vec::with_capacity(2 * slots.len());
        for slot in slots {
            knots.extend([period, period + slot / 2.0]);
            period += slot;
        }
        let zeros = || vec![0.0; yarns * knots.len()];
        Self { height: zeros(), slope: zeros(), period, knots }
    }

    /// Number of yarns.
    pub fn len(&self) -> usize {
        self.height.len() / self.knots.len()
    }

    /// Whether there are no yarns.
    pub fn is_empty(&self) -> bool {
        self.height.is_empty()
    }

    /// The curve of one yarn.
    pub fn yarn(&self, yarn: usize) -> HeightCurve<'_> {
        let own = yarn * self.knots.len()..(yarn + 1) * self.knots.len();
        HeightCurve {
            knots: &self.knots,
            period: self.period,
            height: &self.height[own.clone()],
            slope: &self.slope[own],
        }
    }

    /// The curves, yarn by yarn.
    pub fn iter(&self) -> impl Iterator<Item = HeightCurve<'_>> {
        (0..self.len()).map(|yarn| self.yarn(yarn))
    }
}

/// The height h(s) of a yarn over the plane of the cloth, by its values and slopes at knots
/// (Montazeri et al. 2020, Eq. 17, with slope times interval as the tangent terms).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightCurve<'a> {
    /// Where along the yarn the knots are: increasing from 0, all below `period`.
    pub knots: &'a [f64],
    /// The length after which the curve repeats.
    pub period: f64,
    /// h at each knot.
    pub height: &'a [f64],
    /// dh/ds at each knot.
    pub slope: &'a [f64],
}

impl HeightCurve<'_> {
    /// Height and slope, (h, dh/ds), at any `s`, inside the period or not.
    pub fn eval(&self, s: f64) -> (f64, f64) {
        let s = s.rem_euclid(self.period);
        let index = self.knots.partition_point(|&knot| knot <= s) - 1;
        let segment = self.segment(index);
        segment.eval((s - self.knots[index]) / segment.length)
    }

    /// The cubic between knot `index` and the next, the last one closing the period.
    pub fn segment(&self, index: usize) -> Segment {
        let next = self.after(index);
        let end = if next == 0 { self.period } else { self.knots[next] };
        Segment {
            length: end - self.knots[index],
            height: [self.height[index], self.height[next]],
            slope: [self.slope[index], self.slope[next]],
        }
    }

    /// The knot after `index`, round the period.
    pub(super) fn after(&self, index: usize) -> usize {
        if index + 1 == self.knots.len() { 0 } else { index + 1 }
    }
}

/// One cubic piece of a [`HeightCurve`], by what it is at its two ends.
pub struct Segment {
    /// Its length.
    pub length: f64,
    /// Height at its start and end.
    pub height: [f64; 2],
    /// Slope at its start and end.
    pub slope: [f64; 2],
}

impl Segment {
    /// Height and slope at the fraction `t` of the segment, by the cubic Hermite basis.
    pub fn eval(&self, t: f64) -> (f64, f64) {
        let rise = self.height[1] - self.height[0];
        let [m0, m1] = self.slope.map(|slope| slope * self.length);
        let smoothstep = t * t * (3.0 - 2.0 * t);
        let height = self.height[0]
            + rise * smoothstep
            + m0 * t * (1.0 - t) * (1.0 - t)
            + m1 * t * t * (t - 1.0);
        let derivative = rise * 6.0 * t * (1.0 - t)
            + m0 * (1.0 - t) * (1.0 - 3.0 * t)
            + m1 * t * (3.0 * t - 2.0);
        (height, derivative / self.length)
    }

    /// The height as a polynomial of the distance from the start, the constant first.
    pub fn coefficients(&self) -> [f64; 4] {
        let [[start, end], [m0, m1]] = [self.height, self.slope];
        let mean = (end - start) / self.length;
        let square = (3.0 * mean - 2.0 * m0 - m1) / self.length;
        let cube = (m0 + m1 - 2.0 * mean) / (self.length * self.length);
        [start, m0, square, cube]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> HeightCurve<'static> {
        HeightCurve {
            knots: &[0.0, 0.5, 0.8, 2.0],
            period: 2.5,
            height: &[0.1, -0.4, 0.3, 0.2],
            slope: &[0.5, -0.3, 0.7, -1.1],
        }
    }

    #[test]
    fn passes_through_its_knots_in_every_period() {
        let curve = curve();
        for (index, &knot) in curve.knots.iter().enumerate() {
            for turns in [-2.0, 0.0, 3.0] {
                let (height, slope) = curve.eval(knot + 1e-12 + turns * curve.period);
                assert!((height - curve.height[index]).abs() < 1e-10);
                assert!((slope - curve.slope[index]).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn is_a_cubic_where_the_data_are_of_one() {
        let cubic = |s: f64| 1.0 - 2.0 * s + 0.5 * s * s + 0.25 * s * s * s;
        let slope = |s: f64| -2.0 + s + 0.75 * s * s;
        let knots = [0.0, 0.4, 1.5];
        let curve = HeightCurve {
            knots: &knots,
            period: 2.0,
            height: &knots.map(cubic),
            slope: &knots.map(slope),
        };
        for s in [0.0, 0.1, 0.39, 0.4, 0.9, 1.49] {
            let (h, d) = curve.eval(s);
            assert!((h - cubic(s)).abs() < 1e-14 && (d - slope(s)).abs() < 1e-14);
        }
    }

    #[test]
    fn coefficients_are_those_of_the_same_cubic() {
        let segment = Segment { length: 0.7, height: [0.2, -0.9], slope: [1.3, 0.4] };
        let [a, b, c, d] = segment.coefficients();
        for t in [0.0, 0.3, 0.8, 1.0] {
            let x = t * segment.length;
            let (height, slope) = segment.eval(t);
            assert!((a + x * (b + x * (c + x * d)) - height).abs() < 1e-14);
            assert!((b + x * (2.0 * c + 3.0 * d * x) - slope).abs() < 1e-14);
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_height() {
        let (curve, step) = (curve(), 1e-6);
        for index in 0..250 {
            let s = 0.0137 + f64::from(index) * 0.01;
            let difference = (curve.eval(s + step).0 - curve.eval(s - step).0) / (2.0 * step);
            assert!((curve.eval(s).1 - difference).abs() < 1e-5);
        }
    }

    #[test]
    fn a_hair_below_zero_is_the_end_of_the_period() {
        let (height, _) = curve().eval(-1e-300);
        assert!((height - 0.1).abs() < 1e-12);
    }
}
