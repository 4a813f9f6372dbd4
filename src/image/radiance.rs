//! Radiance pictures (.hdr): three mantissas with a common exponent.

use std::io::Cursor;

use ::image::codecs::hdr::{HdrDecoder, HdrMetadata};
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageResult};

use super::primaries::{Primaries, REC_709};
use super::{MAX_PIXELS, RgbImage};
use crate::error::{Error, Result};
use crate::memory::claim;

/// Decodes a Radiance picture into light, before any exposure and with the primaries of Rec. 709.
///
/// As Radiance's manual (Ward, "Radiance file formats") has it: values are divided by all exposures
/// and colour corrections, and primaries that the header names are the picture's.
pub fn decode_radiance(data: &[u8]) -> Result<RgbImage> {
    let (metadata, picture) = decode(data)?;
    let matrix = primaries(&metadata)?.to_rec_709()?;
    let exposure = metadata.exposure.unwrap_or(1.0);
    let (red, green, blue) = metadata.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let gain = [red, green, blue].map(|correction| f64::from(correction * exposure).recip());
    if !gain.iter().all(|gain| gain.is_finite() && *gain > 0.0) {
        let problem = format!(
            "has the exposure {exposure} and the colour correction {red} {green} {blue}, but they \
             must be positive"
        );
        return Err(Error::invalid("data", problem));
    }
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let mut values = picture.into_rgb32f().into_raw();
    for pixel in values.as_chunks_mut::<3>().0 {
        let light = glam::DVec3::from_array(pixel.map(f64::from)) * glam::DVec3::from_array(gain);
        *pixel = matrix.map_or(light, |matrix| matrix * light).as_vec3().to_array();
    }
    RgbImage::new(width, height, values)
}

fn decode(data: &[u8]) -> Result<(HdrMetadata, DynamicImage)> {
    let decoder = decoder(data).map_err(unreadable)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS {
        let problem = format!("has too many pixels: {width} x {height}");
        return Err(Error::invalid("data", problem));
    }
    // As decoded, and as put into one array.
    claim("reading the picture", 24 * pixels as usize)?;
    let picture = |decoder| DynamicImage::from_decoder(decoder).map_err(unreadable);
    Ok((decoder.metadata(), picture(decoder)?))
}

fn decoder(data: &[u8]) -> ImageResult<HdrDecoder<Cursor<&[u8]>>> {
    // Other programs begin with other words than RADIANCE behind the two signs.
    match data.strip_prefix(b"#?") {
        Some(rest) if !rest.starts_with(b"RADIANCE") => {
            HdrDecoder::new_nonstrict(Cursor::new(data))
        }
        _ => HdrDecoder::new(Cursor::new(data)),
    }
}

fn unreadable(error: ImageError) -> Error {
    Error::invalid("data", format!("not a readable Radiance picture: {error}"))
}

fn primaries(metadata: &HdrMetadata) -> Result<Primaries> {
    let mut lines = metadata.custom_attributes.iter();
    let Some((_, text)) = lines.find(|(key, _)| key == "PRIMARIES") else { return Ok(REC_709) };
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let (&[red, green, blue, white], []) = numbers.as_chunks::<2>() else {
        let problem = format!("has the primaries '{text}', but they must be 8 numbers");
        return Err(Error::invalid("data", problem));
    };
    Ok(Primaries { rgb: [red, green, blue], white })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One pixel: 64, 128 and 192 of 256 at the exponent 2.
    fn file(header: &str) -> Vec<u8> {
        let head = format!("#?RADIANCE\n{header}\n-Y 1 +X 1\n");
        [head.as_bytes(), &[64, 128, 192, 130]].concat()
    }

    fn light(header: &str) -> Vec<f32> {
        decode_radiance(&file(header)).unwrap().values
    }

    #[test]
    fn mantissas_share_their_exponent() {
        assert_eq!(light("FORMAT=32-bit_rle_rgbe\n"), [1.0, 2.0, 3.0]);
        let rgbe = [b"#?RGBE\n\n-Y 1 +X 1\n", &[64u8, 128, 192, 130][..]].concat();
        assert_eq!(decode_radiance(&rgbe).unwrap().values, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn exposures_are_undone() {
        assert_eq!(light("EXPOSURE=2\nEXPOSURE=0.25\n"), [2.0, 4.0, 6.0]);
        assert_eq!(light("COLORCORR=1 2 4\n"), [1.0, 1.0, 0.75]);
        assert!(decode_radiance(&file("EXPOSURE=0\n")).is_err());
    }

    #[test]
    fn primaries_are_converted() {
        let swapped = "PRIMARIES=0.30 0.60 0.64 0.33 0.15 0.06 0.3127 0.3290\n";
        for (value, expected) in light(swapped).into_iter().zip([2.0, 1.0, 3.0]) {
            assert!((value - expected).abs() < 1e-6);
        }
        assert!(decode_radiance(&file("PRIMARIES=0.3 0.6\n")).is_err());
    }

    #[test]
    fn what_is_not_read_is_an_error() {
        let message = decode_radiance(&file("FORMAT=32-bit_rle_xyze\n")).unwrap_err().to_string();
        assert!(message.contains("xyze"), "{message}");
        let whole = file("");
        for data in [&b"GIF89a"[..], &[], b"#?", &whole[..whole.len() - 1]] {
            assert!(decode_radiance(data).is_err());
        }
    }
}
