//! The weave pattern: which of two crossing yarns lies on the face of the cloth.

use crate::error::{Error, Result};

/// One repeat of a weave: a grid of `picks` x `ends` crossings, stored row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WeavePattern {
    /// Number of weft yarns in the repeat.
    pub picks: usize,
    /// Number of warp yarns in the repeat.
    pub ends: usize,
    /// Row-major, `picks` x `ends`: true where the warp is on the face.
    pub warp_up: Vec<bool>,
}

impl WeavePattern {
    /// The pattern of these crossings; [`Error::Invalid`] if it is empty or their number is not
    /// `picks * ends`.
    pub fn new(picks: usize, ends: usize, warp_up: Vec<bool>) -> Result<Self> {
        let pattern = Self { picks, ends, warp_up };
        pattern.check()?;
        Ok(pattern)
    }

    /// Whether the warp yarn `end` lies above the weft yarn `pick`.
    pub fn is_warp_up(&self, pick: usize, end: usize) -> bool {
        self.warp_up[pick * self.ends + end]
    }

    /// [`Error::Invalid`] unless there is at least one crossing, and as many as the shape says.
    pub fn check(&self) -> Result<()> {
        let (picks, ends, crossings) = (self.picks, self.ends, self.warp_up.len());
        if crossings == 0 || Some(crossings) != picks.checked_mul(ends) {
            return Err(Error::invalid(
                "pattern",
                format!(
                    "has {crossings} crossings for {picks} picks x {ends} ends, but must have at \
                     least one pick and one end, and a crossing for each pair"
                ),
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_picks() {
        let pattern = WeavePattern::new(2, 3, vec![true, false, false, false, false, true]);
        let pattern = pattern.unwrap();
        assert!(pattern.is_warp_up(0, 0) && pattern.is_warp_up(1, 2));
        assert!(!pattern.is_warp_up(0, 2) && !pattern.is_warp_up(1, 0));
    }

    #[test]
    fn empty_or_ragged_patterns_are_refused() {
        for (picks, ends, crossings) in [(0, 0, 0), (0, 3, 0), (2, 2, 3), (1, 2, 4)] {
            let error = WeavePattern::new(picks, ends, vec![true; crossings]).unwrap_err();
            assert!(error.to_string().starts_with("pattern: has"), "{error}");
        }
    }
}
