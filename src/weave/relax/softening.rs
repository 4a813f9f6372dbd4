//! Collisions that begin soft and harden from step to step.
//!
//! Where long floats lie on each other, most contacts begin closed and end open, and Newton's method
//! on the energy itself opens them rim by rim: its steps grow in number with the floats. Soft
//! contacts (see `Push`) push a little wherever they are, so that all of them feel at once where the
//! cloth is going; the steps to harder and harder ones are few and need no accuracy. This is the path
//! that interior-point methods follow to an active set (B. Chen and P. Harker 1993; C. Kanzow 1996).

/// Softness at the start, relative to the mean squared push.
const FIRST: f64 = 10.0;
/// Softness from one step to the next.
const HARDENING: f64 = 0.1;
/// Softness, relative to the mean squared push, below which contacts are taken as they are.
const LAST: f64 = 1e-10;

/// How soft collisions are now.
pub(super) struct Softening {
    softness: f64,
    least: f64,
}

impl Softening {
    /// Collisions as they are, for heights close to the minimum.
    pub fn none() -> Self {
        Self { softness: 0.0, least: 0.0 }
    }

    /// Collisions soft enough for heights with this mean squared push.
    pub fn of(mean_square: f64) -> Self {
        Self { softness: FIRST * mean_square, least: LAST * mean_square }
    }

    /// The softness of [`Push::softened`](crate::weave::energy::Push::softened); 0 at the end.
    pub fn softness(&self) -> f64 {
        self.softness
    }

    pub fn harden(&mut self) {
        self.softness *= HARDENING;
        if self.softness < self.least {
            self.end();
        }
    }

    pub fn end(&mut self) {
        self.softness = 0.0;
    }
}
