//! A yarn from one crossing with a yarn that holds it to the next, however many it passes between.

/// Cubic segments between two crossings, all knots in between eliminated.
///
/// A segment of length L, pulled by a tension T, takes the slopes s at its ends for the least of its
/// strain less T times its rise: a quadratic form of (T, s, s) that all segments of a row share T in.
/// Adding a segment eliminates the slope at the joint, a single unknown, and nothing cancels however
/// long the row is. The cost grows with the number of segments.
pub(super) struct Float {
    /// The form at stiffness 1 over rise and slopes: rise², rise times each slope, and slope by slope.
    pub rise: f64,
    pub rise_slope: [f64; 2],
    pub slope: [[f64; 2]; 2],
    pub length: f64,
    segments: Vec<f64>,
    joints: Vec<Joint>,
}

/// The slope at the joint before a segment: what it is a multiple of T, the slope at the start of
/// the float, and that at the end of the segment.
struct Joint {
    tension: f64,
    first: f64,
    next: f64,
}

/// The form of (T, slope at the start, slope at the end), symmetric.
#[derive(Clone, Copy)]
struct Form {
    tension: f64,
    tension_slope: [f64; 2],
    slope: [f64; 2],
    slopes: f64,
}

impl Form {
    /// Of one cubic segment (Eq. 2, integrated).
    fn segment(length: f64) -> Self {
        Self {
            tension: -length / 1.2,
            tension_slope: [-length / 12.0; 2],
            slope: [length / 8.0; 2],
            slopes: -length / 24.0,
        }
    }
}

impl Float {
    /// The float of these segments, two at least.
    pub fn new(segments: Vec<f64>) -> Self {
        let mut form = Form::segment(segments[0]);
        let mut joints = Vec::with_capacity(segments.len() - 1);
        for &length in &segments[1..] {
            let next = Form::segment(length);
            let pivot = form.slope[1] + next.slope[0];
            let tension = form.tension_slope[1] + next.tension_slope[0];
            joints.push(Joint {
                tension: -tension / pivot,
                first: -form.slopes / pivot,
                next: -next.slopes / pivot,
            });
            form = Form {
                tension: form.tension + next.tension - tension * tension / pivot,
                tension_slope: [
                    form.tension_slope[0] - tension * form.slopes / pivot,
                    next.tension_slope[1] - tension * next.slopes / pivot,
                ],
                slope: [
                    form.slope[0] - form.slopes * form.slopes / pivot,
                    next.slope[1] - next.slopes * next.slopes / pivot,
                ],
                slopes: -form.slopes * next.slopes / pivot,
            };
        }
        let [a, b] = form.tension_slope;
        Self {
            rise: -1.0 / form.tension,
            rise_slope: [-a / form.tension, -b / form.tension],
            slope: [
                [form.slope[0] - a * a / form.tension, form.slopes - a * b / form.tension],
                [form.slopes - a * b / form.tension, form.slope[1] - b * b / form.tension],
            ],
            length: segments.iter().sum(),
            segments,
            joints,
        }
    }

    /// Height and slope at each joint, from the first to the last, for the least strain between
    /// these heights and slopes.
    pub fn joints(&self, heights: [f64; 2], slopes: [f64; 2]) -> Vec<(f64, f64)> {
        let rise = heights[1] - heights[0];
        let tension =
            self.rise * rise + self.rise_slope[0] * slopes[0] + self.rise_slope[1] * slopes[1];
        let mut found = vec![(0.0, 0.0); self.joints.len()];
        let mut next = slopes[1];
        for (joint, (_, slope)) in self.joints.iter().zip(&mut found).rev() {
            next = joint.tension * tension + joint.first * slopes[0] + joint.next * next;
            *slope = next;
        }
        let (mut height, mut before) = (heights[0], slopes[0]);
        for ((joint, slope), length) in found.iter_mut().zip(&self.segments) {
            height += length / 1.2 * (tension + 0.1 * (before + *slope));
            *joint = height;
            before = *slope;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The strain at stiffness 1 of segments between knots (Eq. 18 with its prefactor put right).
    fn strain(segments: &[f64], knots: &[(f64, f64)]) -> f64 {
        let pairs = segments.iter().zip(knots.windows(2));
        pairs
            .map(|(length, pair)| {
                let [(h0, s0), (h1, s1)] = [pair[0], pair[1]];
                let rise = h1 - h0;
                0.5 * (1.2 * rise * rise / length - 0.2 * rise * (s0 + s1)
                    + length / 7.5 * (s0 * s0 + s1 * s1)
                    - length / 15.0 * s0 * s1)
            })
            .sum()
    }

    #[test]
    fn joints_have_the_least_strain_and_the_form_is_its_value() {
        for segments in [vec![0.5, 0.7], vec![0.3, 0.2, 0.9, 0.1, 0.4], vec![0.5; 60]] {
            let float = Float::new(segments.clone());
            let (heights, slopes) = ([0.3, -0.9], [0.8, -0.2]);
            let mut knots = vec![(heights[0], slopes[0])];
            knots.extend(float.joints(heights, slopes));
            knots.push((heights[1], slopes[1]));
            let least = strain(&segments, &knots);
            let rise = heights[1] - heights[0];
            let mut form = 0.5 * float.rise * rise * rise;
            for i in 0..2 {
                form += rise * float.rise_slope[i] * slopes[i];
                for j in 0..2 {
                    form += 0.5 * float.slope[i][j] * slopes[i] * slopes[j];
                }
            }
            assert!((form - least).abs() < 1e-13 * (1.0 + least), "{form} {least}");
            for joint in 1..segments.len() {
                for change in [-1e-3, 1e-3] {
                    let mut moved = knots.clone();
                    moved[joint].0 += change;
                    assert!(strain(&segments, &moved) > least);
                    moved = knots.clone();
                    moved[joint].1 += change;
                    assert!(strain(&segments, &moved) > least);
                }
            }
        }
    }

    #[test]
    fn a_long_float_is_as_stiff_as_a_straight_one_and_no_less_exact() {
        let float = Float::new(vec![0.5; 20_000]);
        assert!((float.rise * float.length - 1.0).abs() < 1e-4);
        let middle = float.joints([0.0, 1.0], [0.0, 0.0])[9_999].0;
        assert!((middle - 0.5).abs() < 1e-12);
    }
}
