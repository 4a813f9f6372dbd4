//! PNG and TIFF of 16 bits per channel, and TIFF of floats, of which Pillow keeps 8 bits or nothing.

use std::io::Cursor;

use ::image::codecs::png::PngDecoder;
use ::image::codecs::tiff::TiffDecoder;
use ::image::error::{LimitError, LimitErrorKind};
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageResult, Limits};

use super::MAX_PIXELS;
use crate::error::{Error, Result};

/// A kind of file that [`decode_codes`] reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// Tagged Image File Format.
    Tiff,
}

/// A picture as its file has it: upright, without alpha, before its codes are turned into light.
#[derive(Debug, Clone, PartialEq)]
pub struct Codes {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 for grey, 3 for red, green and blue.
    pub channels: usize,
    /// `channels * width * height` values: codes from 0 to 1, or floats as they are.
    pub values: Vec<f32>,
    /// Whether they were floats.
    pub is_float: bool,
}

/// What a picture may take in memory: as much as the greatest at 8 bytes per pixel.
const MAX_BYTES: u64 = 8 * MAX_PIXELS;

/// Decodes a PNG or TIFF with the precision that it has.
pub fn decode_codes(data: &[u8], format: Format) -> Result<Codes> {
    let data = Cursor::new(data);
    let decoded = match format {
        Format::Png => PngDecoder::new(data).and_then(decode),
        Format::Tiff => TiffDecoder::new(data).and_then(decode),
    };
    decoded.map_err(unreadable)
}

fn decode(mut decoder: impl ImageDecoder) -> ImageResult<Codes> {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(2 * MAX_BYTES);
    decoder.set_limits(limits)?;
    if decoder.total_bytes() > MAX_BYTES {
        return Err(ImageError::Limits(LimitError::from_kind(LimitErrorKind::DimensionError)));
    }
    let orientation = decoder.orientation()?;
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let is_grey = !picture.color().has_color();
    let is_float = matches!(picture, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let (channels, values) = if is_grey {
        (1, codes(&picture.into_luma16()))
    } else if is_float {
        (3, picture.into_rgb32f().into_raw())
    } else {
        (3, codes(&picture.into_rgb16()))
    };
    Ok(Codes { width, height, channels, values, is_float })
}

fn codes(stored: &[u16]) -> Vec<f32> {
    stored.iter().map(|&code| f32::from(code) / f32::from(u16::MAX)).collect()
}

fn unreadable(error: ImageError) -> Error {
    let problem = match error {
        ImageError::Limits(_) => "has too many pixels".to_owned(),
        other => format!("not a readable picture: {other}"),
    };
    Error::invalid("data", problem)
}

#[cfg(test)]
mod tests {
    use ::image::{ImageBuffer, ImageFormat, Luma, Rgb, Rgba};

    use super::*;

    fn file(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut data = Cursor::new(Vec::new());
        picture.into().write_to(&mut data, format).unwrap();
        data.into_inner()
    }

    #[test]
    fn sixteen_bits_are_kept() {
        let pixels = vec![0, 1, 256, 40_000, 65_534, 65_535];
        let expected: Vec<f32> = pixels.iter().map(|&code| code as f32 / 65_535.0).collect();
        let picture: ImageBuffer<Rgb<u16>, _> = ImageBuffer::from_raw(2, 1, pixels).unwrap();
        for (format, ours) in [(ImageFormat::Png, Format::Png), (ImageFormat::Tiff, Format::Tiff)] {
            let read = decode_codes(&file(picture.clone(), format), ours).unwrap();
            assert_eq!((read.width, read.height, read.channels), (2, 1, 3));
            assert_eq!(read.values, expected);
        }
    }

    #[test]
    fn alpha_is_left_out_and_grey_is_one_channel() {
        let clear: ImageBuffer<Rgba<u16>, _> =
            ImageBuffer::from_raw(1, 1, vec![1, 2, 3, 0]).unwrap();
        let read = decode_codes(&file(clear, ImageFormat::Png), Format::Png).unwrap();
        assert_eq!(read.values, [1.0, 2.0, 3.0].map(|code: f32| code / 65_535.0));
        let grey: ImageBuffer<Luma<u16>, _> = ImageBuffer::from_raw(1, 1, vec![300]).unwrap();
        let read = decode_codes(&file(grey, ImageFormat::Tiff), Format::Tiff).unwrap();
        assert_eq!((read.channels, read.values[0]), (1, 300.0 / 65_535.0));
    }

    #[test]
    fn floats_stay_as_they_are() {
        let values = vec![-0.5, 0.25, 70.0];
        let picture: ImageBuffer<Rgb<f32>, _> =
            ImageBuffer::from_raw(1, 1, values.clone()).unwrap();
        let read = decode_codes(&file(picture, ImageFormat::Tiff), Format::Tiff).unwrap();
        assert!(read.is_float);
        assert_eq!(read.values, values);
    }

    #[test]
    fn what_is_no_picture_is_an_error() {
        let picture: ImageBuffer<Rgb<u16>, _> = ImageBuffer::new(9, 9);
        for (format, ours) in [(ImageFormat::Png, Format::Png), (ImageFormat::Tiff, Format::Tiff)] {
            let whole = file(picture.clone(), format);
            for data in [&b"GIF89a"[..], &[], &whole[..whole.len() / 2]] {
                assert!(decode_codes(data, ours).is_err());
            }
        }
    }
}
