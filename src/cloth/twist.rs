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
        match *shape {
            YarnShape::Round { plies, pitch, .. } if plies > 1 => {
                let mean = spacing.iter().sum::<f64>() / spacing.len() as f64;
                let (per_crossing, phases) = rounded(mean / pitch * plies as f64, spacing.len());
                Self { plies: plies as i64, phases, per_crossing }
            }
            _ => Self { plies: 1, phases: 1, per_crossing: 0 },
        }
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

/// Steps per crossing as a fraction close to `wanted`, such that few repeats of `crossings` make whole
/// steps; and of such fractions that of least denominator.
fn rounded(wanted: f64, crossings: usize) -> (i64, i64) {
    let numerator = |denominator: usize| (wanted * denominator as f64).round();
    let off = |denominator: usize| (numerator(denominator) / denominator as f64 - wanted).abs();
    let is_close = |&denominator: &usize| {
        let steps = numerator(denominator) / denominator as f64;
        (wanted - steps).abs() <= PITCH_ERROR * steps.abs()
    };
    let most = (MOST_CROSSINGS / crossings).max(1);
    let repeats = || (1..=most).map(|repeats| repeats * crossings);
    let denominator = match repeats().find(is_close) {
        Some(whole) => (1..=whole).filter(|d| whole.is_multiple_of(*d)).find(is_close),
        None => repeats().min_by(|&a, &b| off(a).total_cmp(&off(b))),
    };
    let denominator = denominator.unwrap_or(crossings);
    (numerator(denominator) as i64, denominator as i64)
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
