//! What red, green and blue of a file are, and how to bring them to those of this crate.

use glam::{DMat3, DVec3};

use crate::error::{Error, Result};

/// CIE 1931 chromaticities (x, y) of the three primaries and of white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Primaries {
    /// Of red, green and blue.
    pub rgb: [[f64; 2]; 3],
    /// Of equal parts of them.
    pub white: [f64; 2],
}

/// Those of Rec. ITU-R BT.709 and sRGB, which all colours of this crate have.
pub const REC_709: Primaries =
    Primaries { rgb: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], white: [0.3127, 0.3290] };

/// How far chromaticities may be rounded and still be the same ones.
const ROUNDING: f64 = 5e-4;

/// XYZ to the responses of the cones, after Bradford (ICC.1:2010, annex E); by columns.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

impl Primaries {
    /// The matrix from these to [`REC_709`]: white stays white, after Bradford's adaptation; None if
    /// they are the same.
    pub fn to_rec_709(self) -> Result<Option<DMat3>> {
        if self.is_close_to(REC_709) {
            return Ok(None);
        }
        let cones = |white: [f64; 2]| BRADFORD * xyz(white);
        let gain = cones(REC_709.white) / cones(self.white);
        let adapt = BRADFORD.inverse() * DMat3::from_diagonal(gain) * BRADFORD;
        let matrix = REC_709.to_xyz().inverse() * adapt * self.to_xyz();
        if matrix.is_finite() {
            return Ok(Some(matrix));
        }
        Err(Error::invalid("data", format!("has chromaticities that span no colours: {self:?}")))
    }

    /// The shares of red, green and blue in the luminance.
    pub fn luminance_weights(self) -> DVec3 {
        self.to_xyz().row(1)
    }

    /// Linear RGB to CIE XYZ, in which white has Y = 1.
    fn to_xyz(self) -> DMat3 {
        let [red, green, blue] = self.rgb.map(xyz);
        let primaries = DMat3::from_cols(red, green, blue);
        primaries * DMat3::from_diagonal(primaries.inverse() * xyz(self.white))
    }

    fn is_close_to(self, other: Self) -> bool {
        let places = |p: Self| p.rgb.into_iter().chain([p.white]).flatten().collect::<Vec<_>>();
        let pairs = places(self).into_iter().zip(places(other));
        pairs.into_iter().all(|(a, b)| (a - b).abs() <= ROUNDING)
    }
}

/// The colour of this chromaticity with Y = 1.
fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Academy Color Encoding System, SMPTE ST 2065-1.
    const AP0: Primaries = Primaries {
        rgb: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770]],
        white: [0.32168, 0.33767],
    };

    #[test]
    fn luminance_is_that_of_rec_709() {
        let weights = REC_709.luminance_weights();
        assert!(weights.abs_diff_eq(DVec3::new(0.2126, 0.7152, 0.0722), 1e-4), "{weights}");
    }

    #[test]
    fn equal_primaries_need_no_matrix() {
        let mut rounded = REC_709;
        rounded.white = [0.31271, 0.32902];
        assert_eq!(rounded.to_rec_709().unwrap(), None);
    }

    /// As the ACES project prints it (ACEScsc, ACES2065-1 to linear BT.709, Bradford).
    #[test]
    fn aces_is_converted_as_its_makers_do() {
        let matrix = AP0.to_rec_709().unwrap().unwrap();
        let printed = DMat3::from_cols(
            DVec3::new(2.52169, -0.27648, -0.01538),
            DVec3::new(-1.13413, 1.37272, -0.15298),
            DVec3::new(-0.38756, -0.09624, 1.16835),
        );
        assert!(matrix.abs_diff_eq(printed, 2e-4), "{matrix}");
        assert!((matrix * DVec3::ONE).abs_diff_eq(DVec3::ONE, 1e-9));
    }

    #[test]
    fn what_spans_no_colours_is_an_error() {
        let flat = Primaries { rgb: [[0.3, 0.3]; 3], ..AP0 };
        assert!(flat.to_rec_709().is_err());
    }
}
