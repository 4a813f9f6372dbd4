//! The twist of plies, counted so that blocks of cloth repeat.
//!
//! Turning a yarn of n plies by 1/n of a turn leaves it as it was: a step. The twist from crossing to
//! crossing is rounded, by little, to a fraction of a step such that after few repeats of the weave
//! whole steps are made: then the yarn looks the same again, and few blocks are stored.

use std::f64::consts::TAU;

use super::spec::YarnShape;

/// The pitch is rounded by no more than this part of it, unless the blocks became too many.
pub const PITCH_ERROR: f64 = 0.02;

/// Crossings after which a yarn repeats at the latest, unless the weave itself is larger.
pub const MOST_CROSSINGS: usize = 512;

/// Segments that a full turn of the plies is made of, at least.
const SEGMENTS_PER_TURN: f64 = 16.0;

/// Segments of a ply from one crossing to the next, at least: the yarn itself bends.
const LEAST_SEGMENTS: usize = 8;

/// The twist of a yarn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Twist {
    plies: i64,
    /// Phases that a step is divided in.
    phases: i64,
    /// Phases advanced from one crossing to the next.
    per_crossing: i64,
}

impl Twist {
    /// The twist of a yarn that crosses others of the given spacing, over and over. It is as large
    /// from crossing to crossing wherever they are.
    pub fn new(shape: &YarnShape, spacing: &[f64]) -> Self {
        Self::together(&[*shape], spacing)[0]
    }

    /// The same for yarns side by side: few repeats of the weave are whole steps of all of them.
    pub fn together(shapes: &[YarnShape], spacing: &[f64]) -> Vec<Self> {
        let mean = spacing.iter().sum::<f64>() / spacing.len() as f64;
        let steps = |shape: &YarnShape| match *shape {
            YarnShape::Round { plies, pitch, .. } if plies > 1 => mean / pitch * plies as f64,
            _ => 0.0,
        };
        let steps: Vec<_> = shapes.iter().map(steps).collect();
        let fractions = rounded(&steps, spacing.len());
        let twist = |(shape, (per_crossing, phases)): (&YarnShape, (i64, i64))| match *shape {
            YarnShape::Round { plies, .. } if plies > 1 => {
                Self { plies: plies as i64, phases, per_crossing }
            }
            _ => Self { plies: 1, phases: 1, per_crossing: 0 },
        };
        shapes.iter().zip(fractions).map(twist).collect()
    }

    /// Turns of the plies from one crossing to the next.
    pub fn turns_per_crossing(&self) -> f64 {
        self.per_crossing as f64 / (self.plies * self.phases) as f64
    }

    /// Segments of a ply from one crossing to the next, an even number.
    pub fn segments_per_crossing(&self) -> usize {
        let turns = self.turns_per_crossing().abs();
        LEAST_SEGMENTS.max(2 * (0.5 * SEGMENTS_PER_TURN * turns).ceil() as usize)
    }

    /// The phase at the start of a crossing's slot.
    pub fn phase(&self, crossing: i64) -> i64 {
        (crossing * self.per_crossing).rem_euclid(self.phases)
    }

    /// The angle of ply `ply` at `crossings` after a slot that starts with `phase`.
    pub fn angle(&self, phase: i64, crossings: f64, ply: usize) -> f64 {
        let phases = phase as f64 + crossings * self.per_crossing as f64;
        TAU * (phases / self.phases as f64 + ply as f64) / self.plies as f64
    }

    /// After how many repeats of `crossings` the yarn looks the same again.
    pub fn repeats(&self, crossings: usize) -> usize {
        let advance = self.phase(crossings as i64);
        (1..self.phases).find(|n| (n * advance) % self.phases == 0).unwrap_or(self.phases) as usize
    }
}

/// The least number that both divide.
pub fn common_multiple(a: usize, b: usize) -> usize {
    let (mut divisor, mut rest) = (a, b);
    while rest > 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    a / divisor * b
}

/// Steps per crossing as fractions close to those `wanted`, such that few repeats of `crossings` make
/// whole steps of all; and of such fractions those of least denominators.
fn rounded(wanted: &[f64], crossings: usize) -> Vec<(i64, i64)> {
    let most = (MOST_CROSSINGS / crossings).max(1);
    let repeats = || (1..=most).map(|repeats| repeats * crossings);
    let all_close = |&whole: &usize| wanted.iter().all(|&wanted| is_close(wanted, whole));
    let worst = |whole: usize| wanted.iter().map(|&wanted| off(wanted, whole)).fold(0.0, f64::max);
    let fraction = |wanted: f64, denominator: usize| {
        (numerator(wanted, denominator) as i64, denominator as i64)
    };
    if let Some(whole) = repeats().find(all_close) {
        let divisors: Vec<_> = (1..=whole).filter(|d| whole.is_multiple_of(*d)).collect();
        let least = |wanted: f64| divisors.iter().copied().find(|&d| is_close(wanted, d));
        return wanted.iter().map(|&w| fraction(w, least(w).unwrap_or(whole))).collect();
    }
    let nearest = repeats().min_by(|&a, &b| worst(a).total_cmp(&worst(b))).unwrap_or(crossings);
    wanted.iter().map(|&w| fraction(w, nearest)).collect()
}

fn numerator(wanted: f64, denominator: usize) -> f64 {
    (wanted * denominator as f64).round()
}

/// How far the nearest fraction of this denominator is off.
fn off(wanted: f64, denominator: usize) -> f64 {
    (numerator(wanted, denominator) / denominator as f64 - wanted).abs()
}

/// Whether it is off by little.
fn is_close(wanted: f64, denominator: usize) -> bool {
    let steps = numerator(wanted, denominator) / denominator as f64;
    (wanted - steps).abs() <= PITCH_ERROR * steps.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yarn(plies: usize, pitch: f64) -> YarnShape {
        YarnShape::round(0.4, plies, 0.15, pitch)
    }

    fn pitch_error(plies: usize, pitch: f64, crossings: usize) -> f64 {
        let turns = Twist::new(&yarn(plies, pitch), &vec![1.0; crossings]).turns_per_crossing();
        1.0 / (turns * pitch) - 1.0
    }

    /// From the least that a fabric may have to hundreds of crossings.
    fn pitches(most: f64) -> impl Iterator<Item = f64> {
        let count = 1000;
        (0..=count).map(move |i| 0.125 * (most / 0.125).powf(f64::from(i) / f64::from(count)))
    }

    #[test]
    fn pitch_is_kept_within_2_percent() {
        for plies in 2..=12 {
            for crossings in [1, 2, 3, 4, 5, 7, 8, 12, 15, 16] {
                for pitch in pitches(100.0 * plies as f64) {
                    for pitch in [pitch, -pitch] {
                        let error = pitch_error(plies, pitch, crossings);
                        assert!(error.abs() < 0.0200001, "{plies} {pitch} {crossings}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn large_weaves_keep_all_but_long_pitches() {
        for plies in 2..=12 {
            for crossings in [32, 41, 100, 127, 400, 1000] {
                for pitch in pitches(10.0 * plies as f64) {
                    let error = pitch_error(plies, pitch, crossings);
                    assert!(error.abs() < 0.0200001, "{plies} {pitch} {crossings}: {error}");
                }
            }
        }
    }

    #[test]
    fn common_pitches_repeat_soon() {
        for (pitch, repeats) in [(3.0, 1), (4.0, 2), (6.0, 1), (12.0, 2), (2.4, 2)] {
            let twist = Twist::new(&yarn(3, pitch), &[1.0, 1.0]);
            assert_eq!(twist.repeats(2), repeats, "{pitch} {twist:?}");
        }
    }

    #[test]
    fn none_repeats_too_late() {
        for plies in [2, 3, 12] {
            for crossings in [1, 2, 5, 24, 300, 700] {
                for pitch in pitches(1e9) {
                    let twist = Twist::new(&yarn(plies, pitch), &vec![1.0; crossings]);
                    let period = crossings * twist.repeats(crossings);
                    assert!(period <= MOST_CROSSINGS.max(crossings), "{plies} {pitch} {period}");
                }
            }
        }
    }

    #[test]
    fn yarns_side_by_side_repeat_together() {
        for pitches in [[1.7, 2.9, 5.3], [0.9, 7.1, -3.3]] {
            for crossings in [2, 5, 12, 16, 300] {
                let shapes = pitches.map(|pitch| yarn(3, pitch));
                let twists = Twist::together(&shapes, &vec![1.0; crossings]);
                let repeats = twists.iter().map(|twist| twist.repeats(crossings));
                let period = crossings * repeats.fold(1, common_multiple);
                assert!(period <= MOST_CROSSINGS.max(crossings), "{pitches:?} {period}");
                for (twist, pitch) in twists.iter().zip(pitches) {
                    let error = 1.0 / (twist.turns_per_crossing() * pitch) - 1.0;
                    assert!(error.abs() < 0.0200001, "{pitches:?} {crossings}: {error}");
                }
            }
        }
    }

    #[test]
    fn the_mean_spacing_counts() {
        let twist = Twist::new(&yarn(3, 3.0), &[0.5, 1.0, 1.5]);
        assert_eq!(twist.turns_per_crossing(), 1.0 / 3.0);
    }

    #[test]
    fn a_turn_is_round_whatever_the_pitch() {
        for pitch in [0.2, 0.45, 1.0, 4.0, -0.3] {
            let segments = Twist::new(&yarn(3, pitch), &[1.0]).segments_per_crossing();
            assert!(segments >= 8 && segments.is_multiple_of(2));
            assert!(segments as f64 * pitch.abs() >= 0.9 * SEGMENTS_PER_TURN, "{pitch} {segments}");
        }
    }

    #[test]
    fn the_yarn_looks_the_same_after_its_repeats() {
        let twist = Twist { plies: 3, phases: 8, per_crossing: 3 };
        assert_eq!(twist.repeats(2), 4);
        assert_eq!(twist.phase(8), 0);
        // Half way through a step ply 0 stands between plies 0 and 1.
        assert!((twist.angle(4, 0.0, 0) - TAU / 6.0).abs() < 1e-15);
    }
}
