//! The one error type of the core: every variant names the culprit and the valid choice.

use thiserror::Error;

/// What can go wrong in the core.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Error {
    /// A number outside its range, NaN, or an array of the wrong shape.
    #[error("{name}: {problem}")]
    Invalid {
        /// The argument at fault, as the user spells it.
        name: String,
        /// What is wrong with it and what would be right.
        problem: String,
    },
    /// An iteration did not reach the accuracy that it stands for.
    #[error(
        "no convergence in {iterations} iterations (gradient norm {gradient_norm:.3e}): check for \
         values that are many orders of magnitude apart"
    )]
    NotConverged {
        /// Iterations taken.
        iterations: u64,
        /// Norm of the gradient that was left.
        gradient_norm: f64,
    },
    /// Memory that the work needs and that the process or the machine cannot give.
    #[error("{work} takes {:.1} GB of memory, which is more than there is", *bytes as f64 / 1e9)]
    OutOfMemory {
        /// What was to be done.
        work: String,
        /// How much it takes.
        bytes: u64,
    },
    /// The stop flag was raised while work was under way.
    #[error("stopped")]
    Stopped,
}

impl Error {
    /// An [`Error::Invalid`] for the argument `name`.
    pub fn invalid(name: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Invalid { name: name.into(), problem: problem.into() }
    }
}

/// The result of anything in the core that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// Passes `value` on if it is finite and inside `[low, high]`.
pub fn check_range(name: &str, value: f64, low: f64, high: f64) -> Result<f64> {
    if value.is_finite() && (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(Error::invalid(name, format!("is {value}, but must be within [{low}, {high}]")))
}
