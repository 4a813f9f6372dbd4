//! The twist of plies, counted so that blocks of cloth repeat.
//!
//! Turning a yarn of n plies by 1/n of a turn leaves it as it was. The twist from crossing to
//! crossing is therefore rounded to eighths (or quarters or halves, where that is close enough) of
//! 1/n of a turn: then few different phases occur, and blocks that look the same are stored once.

use std::f64::consts::TAU;

use super::spec::YarnShape;

/// Phases per symmetry of the yarn.
pub const PHASES: i64 = 8;

/// Segments that a full turn of the plies is made of, at least.
const SEGMENTS_PER_TURN: f64 = 16.0;

/// Segments of a ply from one crossing to the next, at least: the yarn itself bends.
const LEAST_SEGMENTS: usize = 8;

/// A rounding of the pitch by less than this is taken for the sake of fewer phases.
const ACCEPTED_ERROR: f64 = 0.05;

/// The twist of a yarn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Twist {
    plies: i64,
    /// Phases advanced from one crossing to the next.
    pub per_crossing: i64,
}

impl Twist {
    /// The twist of a yarn that meets a crossing every `spacing`.
    pub fn new(shape: &YarnShape, spacing: f64) -> Self {
        match *shape {
            YarnShape::Round { plies, pitch, .. } if plies > 1 => {
                let plies = plies as i64;
                let wanted = spacing / pitch * (plies * PHASES) as f64;
                Self { plies, per_crossing: rounded(wanted) }
            }
            _ => Self { plies: 1, per_crossing: 0 },
        }
    }

    /// Segments of a ply from one crossing to the next, an even number.
    pub fn segments_per_crossing(&self) -> usize {
        let turns = self.per_crossing.unsigned_abs() as f64 / (self.plies * PHASES) as f64;
        LEAST_SEGMENTS.max(2 * (0.5 * SEGMENTS_PER_TURN * turns).ceil() as usize)
    }

    /// The phase, one of [`PHASES`], at the start of a crossing's slot.
    pub fn phase(&self, crossing: i64) -> i64 {
        (crossing * self.per_crossing).rem_euclid(PHASES)
    }

    /// The angle of ply `ply` at `crossings` after a slot that starts with `phase`.
    pub fn angle(&self, phase: i64, crossings: f64, ply: usize) -> f64 {
        let phases = phase as f64 + crossings * self.per_crossing as f64;
        TAU * (phases / PHASES as f64 + ply as f64) / self.plies as f64
    }

    /// After how many repeats of `crossings` the yarn looks the same again.
    pub fn repeats(&self, crossings: usize) -> usize {
        let advance = self.phase(crossings as i64);
        (1..=PHASES).find(|n| (n * advance) % PHASES == 0).unwrap_or(PHASES) as usize
    }
}

/// `wanted` rounded to a multiple of 4, 2 or 1, the largest that is close enough.
fn rounded(wanted: f64) -> i64 {
    let round_to = |step: f64| (wanted / step).round() * step;
    let close = |value: &f64| (value - wanted).abs() <= ACCEPTED_ERROR * wanted.abs();
    [4.0, 2.0].into_iter().map(round_to).find(close).unwrap_or(wanted.round()) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yarn(plies: usize, pitch: f64) -> YarnShape {
        YarnShape::round(0.4, plies, 0.15, pitch)
    }

    #[test]
    fn pitch_is_kept_within_the_rounding() {
        for plies in 2..=12 {
            for pitch in [-3.0, 0.7, 1.5, 3.2] {
                let twist = Twist::new(&yarn(plies, pitch), 1.0);
                let turns = twist.per_crossing as f64 / (plies as i64 * PHASES) as f64;
                let worst =
                    (0.5 / (plies as i64 * PHASES) as f64).max(ACCEPTED_ERROR / pitch.abs());
                assert!((turns - 1.0 / pitch).abs() <= worst, "{plies} {pitch} {turns}");
            }
        }
    }

    #[test]
    fn a_turn_is_round_whatever_the_pitch() {
        for pitch in [0.2, 0.45, 1.0, 4.0, -0.3] {
            let segments = Twist::new(&yarn(3, pitch), 1.0).segments_per_crossing();
            assert!(segments >= 8 && segments.is_multiple_of(2));
            assert!(segments as f64 * pitch.abs() >= 0.9 * SEGMENTS_PER_TURN, "{pitch} {segments}");
        }
    }

    #[test]
    fn the_yarn_looks_the_same_after_its_repeats() {
        let twist = Twist { plies: 3, per_crossing: 3 };
        assert_eq!(twist.repeats(2), 4);
        assert_eq!(twist.phase(8), 0);
        // Half way through its symmetry ply 0 stands between plies 0 and 1.
        assert!((twist.angle(4, 0.0, 0) - TAU / 6.0).abs() < 1e-15);
    }
}
