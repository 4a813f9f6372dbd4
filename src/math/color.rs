//! Linear RGB colours as vectors.

use glam::DVec3;

/// A linear RGB triple.
pub type Rgb = DVec3;

/// The mean of the three channels: how much of a colour there is, to whichever eye. By luminance, what
/// is blue alone would be looked for one time in fourteen, and be as noisy.
#[inline]
pub fn mean(color: Rgb) -> f64 {
    color.element_sum() / 3.0
}
