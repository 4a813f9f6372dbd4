//! Picture files in memory: those that hold more than 8 bits per channel.
//!
//! Python's Pillow reads and writes the others.

mod codes;
mod exr;
mod layer;
mod primaries;
mod profile;
mod radiance;

pub use self::codes::{Codes, Format, decode_codes};
pub use self::exr::{ExrImage, decode_exr, encode_exr};
pub use self::profile::to_srgb;
pub use self::radiance::decode_radiance;
use crate::error::{Error, Result};

/// The most pixels of a picture, about as many as Pillow reads without a word.
const MAX_PIXELS: u64 = 179_000_000;

/// A linear RGB picture, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct RgbImage {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each pixel, `3 * width * height` values.
    pub values: Vec<f32>,
}

impl RgbImage {
    /// A picture of at least one pixel whose `values` fill it exactly.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Result<Self> {
        if width == 0 || height == 0 || values.len() != 3 * width * height {
            let problem = format!(
                "{} values do not fill {height} x {width} x 3, with both sizes at least 1",
                values.len()
            );
            return Err(Error::invalid("pixels", problem));
        }
        Ok(Self { width, height, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_must_agree() {
        assert!(RgbImage::new(2, 2, vec![0.0; 11]).is_err());
        assert!(RgbImage::new(0, 2, vec![]).is_err());
    }
}
