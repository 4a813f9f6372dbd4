//! ICC profiles: what the codes of a picture mean, told in codes of sRGB.

use moxcms::{ColorProfile, DataColorSpace, Layout, TransformOptions};
use rayon::prelude::*;

use crate::error::{Error, Result};

/// Pixels that are converted at a time.
const CHUNK: usize = 1 << 14;

/// Steps in which each channel is tried to see whether a profile changes anything.
const STEPS: usize = 16;

/// A profile that moves no code by more than a quarter of an 8-bit one is sRGB's own, rounded.
const SRGB_ROUNDING: f32 = 0.25 / 255.0;

/// The codes of sRGB, three per pixel in [0, 1], that look as `codes` do by an ICC profile.
///
/// `codes` are in [0, 1], with `channels` per pixel: 1 (grey) or 3 (RGB). Colours that sRGB cannot
/// show are clipped.
pub fn to_srgb(codes: &[f32], channels: usize, icc: &[u8]) -> Result<Vec<f32>> {
    let profile = ColorProfile::new_from_slice(icc)
        .map_err(|error| Error::invalid("profile", format!("cannot be read: {error}")))?;
    match (profile.color_space, channels) {
        (DataColorSpace::Gray, 1) => transformed(codes, &profile, Layout::Gray),
        (DataColorSpace::Rgb, 3) if keeps_srgb(&profile)? => Ok(codes.to_vec()),
        (DataColorSpace::Rgb, 3) => transformed(codes, &profile, Layout::Rgb),
        // Grey pictures often have the profile of the colours that they were made from.
        (DataColorSpace::Rgb, 1) => {
            let triples: Vec<f32> = codes.iter().flat_map(|&code| [code; 3]).collect();
            to_srgb(&triples, 3, icc)
        }
        (space, _) => {
            let problem = format!("is for {space:?}, but the picture has {channels} channels");
            Err(Error::invalid("profile", problem))
        }
    }
}

fn transformed(codes: &[f32], profile: &ColorProfile, layout: Layout) -> Result<Vec<f32>> {
    let options = TransformOptions {
        prefer_fixed_point: false,
        allow_extended_range_rgb_xyz: true,
        ..TransformOptions::default()
    };
    let unusable = |error| Error::invalid("profile", format!("cannot be used: {error}"));
    let transform = profile
        .create_transform_f32(layout, &ColorProfile::new_srgb(), Layout::Rgb, options)
        .map_err(unusable)?;
    let channels = layout.channels();
    let mut srgb = vec![0.0; codes.len() / channels * 3];
    let from = codes.par_chunks(channels * CHUNK);
    let into = srgb.par_chunks_mut(3 * CHUNK);
    from.zip(into).try_for_each(|(from, into)| {
        transform.transform(from, into).map_err(unusable)?;
        into.iter_mut().for_each(|code| *code = code.clamp(0.0, 1.0));
        Ok(())
    })?;
    Ok(srgb)
}

fn keeps_srgb(profile: &ColorProfile) -> Result<bool> {
    let code = |step: usize| step as f32 / STEPS as f32;
    let ramp = || 0..=STEPS;
    let tried: Vec<f32> = ramp()
        .flat_map(|red| ramp().flat_map(move |green| [[red, green, 0], [0, red, green], [red; 3]]))
        .flatten()
        .map(code)
        .collect();
    let changed = transformed(&tried, profile, Layout::Rgb)?;
    Ok(tried.iter().zip(&changed).all(|(a, b)| (a - b).abs() <= SRGB_ROUNDING))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(profile: &ColorProfile) -> Vec<u8> {
        profile.encode().unwrap()
    }

    /// White is white, and a red of Display P3 is redder in sRGB (CSS Color 4, example of
    /// `color(display-p3 0.7059 0.2353 0.1569)`).
    #[test]
    fn a_wide_gamut_is_brought_to_srgb() {
        let icc = encoded(&ColorProfile::new_display_p3());
        let srgb = to_srgb(&[1.0, 1.0, 1.0, 0.6, 0.3, 0.2], 3, &icc).unwrap();
        assert!(srgb[..3].iter().all(|white| (white - 1.0).abs() < 1e-4), "{srgb:?}");
        assert!(srgb[3] > 0.62 && srgb[4] < 0.3 && srgb[5] < 0.2, "{srgb:?}");
    }

    #[test]
    fn dark_codes_keep_their_precision() {
        let icc = encoded(&ColorProfile::new_display_p3());
        let codes: Vec<f32> = (0..3000).map(|step| step as f32 / 65_535.0).collect();
        let grey: Vec<f32> = codes.iter().flat_map(|&code| [code; 3]).collect();
        let srgb = to_srgb(&grey, 3, &icc).unwrap();
        for (a, b) in grey.iter().zip(&srgb) {
            assert!((a - b).abs() < 0.5 / 65_535.0, "{a} {b}");
        }
    }

    #[test]
    fn srgb_stays_bit_for_bit() {
        let icc = encoded(&ColorProfile::new_srgb());
        let codes: Vec<f32> = (0..3 * 4096).map(|code| code as f32 / (3.0 * 4095.0)).collect();
        assert_eq!(to_srgb(&codes, 3, &icc).unwrap(), codes);
    }

    #[test]
    fn grey_takes_the_profile_of_grey_or_of_colours() {
        let grey = encoded(&ColorProfile::new_gray_with_gamma(1.0));
        let srgb = to_srgb(&[0.5], 1, &grey).unwrap();
        assert!(srgb.iter().all(|code| (code - 0.7354).abs() < 2e-3), "{srgb:?}");
        let rgb = encoded(&ColorProfile::new_display_p3());
        let srgb = to_srgb(&[0.5], 1, &rgb).unwrap();
        assert!(srgb.iter().all(|code| (code - 0.5).abs() < 1e-3), "{srgb:?}");
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        let grey = encoded(&ColorProfile::new_gray_with_gamma(2.2));
        assert!(to_srgb(&[0.0; 3], 3, &grey).is_err());
        assert!(to_srgb(&[0.0; 3], 3, b"no profile").is_err());
    }
}
