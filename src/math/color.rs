//! Linear RGB colours as vectors.

use glam::DVec3;

/// A linear RGB triple.
pub type Rgb = DVec3;

/// The relative luminance of linear sRGB primaries (ITU-R BT.709).
#[inline]
pub fn luminance(color: Rgb) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}
