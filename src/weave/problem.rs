//! What is to be relaxed: the pattern, and for each yarn its radius, stiffness and room.

use crate::error::{Error, Result};

use super::pattern::WeavePattern;

/// The yarns of one direction, one value per yarn, in the pattern's order.
#[derive(Debug, Clone, PartialEq)]
pub struct YarnData {
    /// Collision radius R of Eq. 3, in the unit of `spacing`.
    pub radius: Vec<f64>,
    /// Strain coefficient k of Eq. 2.
    pub stiffness: Vec<f64>,
    /// Width of the yarn's slot, across its own direction.
    pub spacing: Vec<f64>,
}

impl YarnData {
    /// `count` equal yarns.
    pub fn uniform(count: usize, radius: f64, stiffness: f64, spacing: f64) -> Self {
        Self {
            radius: vec![radius; count],
            stiffness: vec![stiffness; count],
            spacing: vec![spacing; count],
        }
    }

    fn check(&self, direction: &str, count: usize) -> Result<()> {
        let quantities =
            [("radius", &self.radius), ("stiffness", &self.stiffness), ("spacing", &self.spacing)];
        for (quantity, values) in quantities {
            let name = format!("{direction}_{quantity}");
            if values.len() != count {
                let problem = format!("has {} values for {count} yarns", values.len());
                return Err(Error::invalid(name, problem));
            }
            for (yarn, &value) in values.iter().enumerate() {
                check_positive(&format!("{name}[{yarn}]"), value)?;
            }
        }
        Ok(())
    }
}

/// A cell of cloth whose yarns are to find their heights.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxProblem {
    /// Which yarn is on top at each crossing.
    pub pattern: WeavePattern,
    /// The warp yarns, one per end.
    pub warp: YarnData,
    /// The weft yarns, one per pick.
    pub weft: YarnData,
    /// Collision coefficient k_c of Eq. 3.
    pub collision_stiffness: f64,
}

impl RelaxProblem {
    /// [`Error::Invalid`] for an empty pattern, a yarn set that does not fit it, or a number that
    /// is not finite and positive.
    pub fn check(&self) -> Result<()> {
        self.pattern.check()?;
        self.warp.check("warp", self.pattern.ends)?;
        self.weft.check("weft", self.pattern.picks)?;
        check_positive("collision_stiffness", self.collision_stiffness)
    }

    /// R_A + R_B of Eq. 3, signed: positive where the warp belongs above the weft.
    pub(super) fn contact(&self, pick: usize, end: usize) -> f64 {
        let distance = self.warp.radius[end] + self.weft.radius[pick];
        if self.pattern.is_warp_up(pick, end) { distance } else { -distance }
    }
}

fn check_positive(name: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::invalid(name, format!("is {value}, but must be finite and above 0")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> RelaxProblem {
        RelaxProblem {
            pattern: WeavePattern::new(2, 2, vec![true, false, false, true]).unwrap(),
            warp: YarnData::uniform(2, 0.4, 1.0, 1.0),
            weft: YarnData::uniform(2, 0.4, 1.0, 1.0),
            collision_stiffness: 1.0,
        }
    }

    #[test]
    fn every_bad_value_is_named() {
        type Spoil = fn(&mut RelaxProblem);
        let table: [(&str, Spoil); 7] = [
            ("warp_radius[1]: is NaN", |p| p.warp.radius[1] = f64::NAN),
            ("warp_stiffness[0]: is -1", |p| p.warp.stiffness[0] = -1.0),
            ("weft_spacing[1]: is 0", |p| p.weft.spacing[1] = 0.0),
            ("weft_radius[0]: is inf", |p| p.weft.radius[0] = f64::INFINITY),
            ("weft_stiffness: has 3 values for 2", |p| p.weft.stiffness.push(1.0)),
            ("collision_stiffness: is 0", |p| p.collision_stiffness = 0.0),
            ("pattern: has 3", |p| p.pattern.warp_up.truncate(3)),
        ];
        assert_eq!(plain().check(), Ok(()));
        for (message, spoil) in table {
            let mut problem = plain();
            spoil(&mut problem);
            let error = problem.check().unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }

    #[test]
    fn contact_is_signed_by_the_pattern() {
        assert_eq!(plain().contact(0, 0), 0.8);
        assert_eq!(plain().contact(0, 1), -0.8);
    }
}
