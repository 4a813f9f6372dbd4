//! OpenEXR in and out of memory: what stores linear light without loss.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels,
    ReadLayers, SpecificChannels, WritableImage,
};

use crate::error::{Error, Result};

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

/// Decodes the first flat layer of an OpenEXR file, whatever its compression and sample type.
///
/// Takes the channels `R`, `G` and `B`, or `Y` alone for a grey picture; alpha and all others are
/// left out. The picture is the layer's data window.
pub fn decode_exr(data: &[u8]) -> Result<RgbImage> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(data))
        .map_err(|error| Error::invalid("data", format!("not a readable OpenEXR: {error}")))?;
    let layer = image.layer_data;
    let (width, height) = (layer.size.width(), layer.size.height());
    let channels = rgb_channels(&layer.channel_data)?;
    let mut values = vec![0.0; 3 * width * height];
    for (offset, samples) in channels.into_iter().enumerate() {
        for (value, sample) in values[offset..].iter_mut().step_by(3).zip(samples.values_as_f32()) {
            *value = sample;
        }
    }
    RgbImage::new(width, height, values)
}

fn rgb_channels(channels: &AnyChannels<FlatSamples>) -> Result<[&FlatSamples; 3]> {
    let named = |name: &str| -> Option<&FlatSamples> {
        let is_it = |channel: &&AnyChannel<FlatSamples>| channel.name.eq_case_insensitive(name);
        channels.list.iter().find(is_it).map(|channel| &channel.sample_data)
    };
    if let (Some(red), Some(green), Some(blue)) = (named("R"), named("G"), named("B")) {
        return Ok([red, green, blue]);
    }
    if let Some(grey) = named("Y") {
        return Ok([grey; 3]);
    }
    let found: Vec<String> = channels.list.iter().map(|channel| channel.name.to_string()).collect();
    let problem = format!("has the channels {}, but needs R, G and B, or Y", found.join(", "));
    Err(Error::invalid("data", problem))
}

/// Encodes a picture as OpenEXR: channels `R`, `G`, `B` as 32-bit floats, compressed without loss.
pub fn encode_exr(image: &RgbImage) -> Result<Vec<u8>> {
    let pixel = |position: exr::math::Vec2<usize>| {
        let start = 3 * (position.y() * image.width + position.x());
        (image.values[start], image.values[start + 1], image.values[start + 2])
    };
    let layer = Layer::new(
        (image.width, image.height),
        LayerAttributes::default(),
        Encoding::SMALL_FAST_LOSSLESS,
        SpecificChannels::rgb(pixel),
    );
    let mut data = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut data)
        .map_err(|error| Error::invalid("pixels", format!("cannot be encoded: {error}")))?;
    Ok(data.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> RgbImage {
        let values = (0..3 * 5 * 3).map(|i| (i as f32 * 0.37).exp() * 1e-3 - 0.5).collect();
        RgbImage::new(5, 3, values).unwrap()
    }

    fn grey(name: &str) -> Vec<u8> {
        let samples = FlatSamples::F32(vec![0.25, 0.5]);
        let channel = AnyChannel::new(name, samples);
        let layer = Layer::new(
            (2, 1),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(exr::prelude::SmallVec::from_vec(vec![channel])),
        );
        let mut data = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut data).unwrap();
        data.into_inner()
    }

    #[test]
    fn comes_back_bit_for_bit() {
        let mut image = picture();
        image.values[0] = f32::INFINITY;
        assert_eq!(decode_exr(&encode_exr(&image).unwrap()).unwrap(), image);
    }

    #[test]
    fn grey_fills_all_three_channels() {
        let image = decode_exr(&grey("Y")).unwrap();
        assert_eq!(image.values, [0.25, 0.25, 0.25, 0.5, 0.5, 0.5]);
    }

    #[test]
    fn unknown_channels_are_named() {
        let message = decode_exr(&grey("depth")).unwrap_err().to_string();
        assert!(message.contains("depth") && message.contains("R, G and B"), "{message}");
    }

    #[test]
    fn what_is_not_exr_is_an_error() {
        let whole = encode_exr(&picture()).unwrap();
        for data in [&b"GIF89a"[..], &[], &whole[..whole.len() / 2], &whole[..whole.len() - 9]] {
            assert!(decode_exr(data).is_err());
        }
    }

    #[test]
    fn sizes_must_agree() {
        assert!(RgbImage::new(2, 2, vec![0.0; 11]).is_err());
        assert!(RgbImage::new(0, 2, vec![]).is_err());
    }
}
