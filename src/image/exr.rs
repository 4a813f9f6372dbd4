//! OpenEXR in and out of memory: what stores linear light without loss.

use std::io::Cursor;

use exr::block::UncompressedBlock;
use exr::block::lines::LineRef;
use exr::block::reader::ChunksReader;
use exr::image::write::WritableImage;
use exr::image::{Encoding, Image, Layer, SpecificChannels};
use exr::io::Data;
use exr::meta::attribute::{Chromaticities, SampleType};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::f16;
use glam::DVec3;

use super::RgbImage;
use super::layer::{self, Colors};
use super::primaries::{Primaries, REC_709};
use crate::error::{Error, Result};

/// What was read of an OpenEXR file.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrImage {
    /// The colours, with the primaries of Rec. 709.
    pub image: RgbImage,
    /// The layer that they are from; empty if it has no name.
    pub layer: String,
    /// Other layers that could have been meant, if none was asked for and none is without a name.
    pub others: Vec<String>,
}

/// Decodes a flat layer of an OpenEXR file, whatever its compression and sample type.
///
/// Takes the layer named, or else the first that has colours: channels `R`, `G` and `B`, or luminance
/// and chroma, or as a last choice `Y` alone for a grey picture. Alpha and all other channels are left
/// out. Subsampled channels are an error. The picture is the layer's data window. Other primaries than those of Rec. 709 are converted.
pub fn decode_exr(data: &[u8], name: Option<&str>) -> Result<ExrImage> {
    let reader = exr::block::read(Cursor::new(data), false).map_err(unreadable)?;
    let layers = layer::layers(reader.headers());
    let chosen = layer::choose(&layers, name)?;
    let ambiguous = name.is_none() && chosen.is_prefixed();
    let others = if ambiguous { layer::others(&layers, chosen) } else { Vec::new() };

    let header = reader.headers()[chosen.part].clone();
    let channels = match chosen.colors {
        Colors::Rgb(channels) | Colors::LuminanceChroma(channels) => channels,
        Colors::Grey(channel) => [channel; 3],
        Colors::None => unreachable!("a layer without colours is not chosen"),
    };
    let mut canvas = Canvas::new(&header, channels);
    reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == chosen.part && tile.is_largest_resolution_level()
        })
        .and_then(|chunks| {
            chunks.decompress_parallel(false, |_, block| canvas.insert(&header, &block))
        })
        .map_err(unreadable)?;
    let mut values = canvas.values;

    let primaries = header.shared_attributes.chromaticities.map_or(REC_709, primaries);
    if let Colors::LuminanceChroma(_) = chosen.colors {
        let weights = primaries.luminance_weights();
        for_each_pixel(&mut values, |pixel| without_luminance(pixel, weights));
    }
    if !matches!(chosen.colors, Colors::Grey(_))
        && let Some(matrix) = primaries.to_rec_709()?
    {
        for_each_pixel(&mut values, |pixel| matrix * pixel);
    }
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    Ok(ExrImage { image: RgbImage::new(width, height, values)?, layer: chosen.name(), others })
}

/// The picture while blocks of it arrive.
struct Canvas {
    width: usize,
    /// The numbers of the channels that go to red, green and blue.
    channels: [usize; 3],
    types: Vec<SampleType>,
    values: Vec<f32>,
}

impl Canvas {
    fn new(header: &Header, channels: [usize; 3]) -> Self {
        let width = header.layer_size.width();
        Self {
            width,
            channels,
            types: header.channels.list.iter().map(|channel| channel.sample_type).collect(),
            values: vec![0.0; 3 * width * header.layer_size.height()],
        }
    }

    fn insert(&mut self, header: &Header, block: &UncompressedBlock) -> exr::error::UnitResult {
        for line in block.lines(&header.channels) {
            let channel = line.location.channel;
            if !self.channels.contains(&channel) {
                continue;
            }
            let samples = match self.types[channel] {
                SampleType::F16 => read(&line, f16::to_f32),
                SampleType::F32 => read(&line, |sample: f32| sample),
                SampleType::U32 => read(&line, |sample: u32| sample as f32),
            }?;
            let start = line.location.position.y() * self.width + line.location.position.x();
            for offset in (0..3).filter(|&offset| self.channels[offset] == channel) {
                let places = self.values[3 * start + offset..].iter_mut().step_by(3);
                places.zip(&samples).for_each(|(place, sample)| *place = *sample);
            }
        }
        Ok(())
    }
}

fn read<T: Data>(line: &LineRef<'_>, to_f32: impl Fn(T) -> f32) -> exr::error::Result<Vec<f32>> {
    line.read_samples().map(|sample| sample.map(&to_f32)).collect()
}

fn primaries(stored: Chromaticities) -> Primaries {
    let place = |place: exr::math::Vec2<f32>| [f64::from(place.0), f64::from(place.1)];
    Primaries {
        rgb: [stored.red, stored.green, stored.blue].map(place),
        white: place(stored.white),
    }
}

fn for_each_pixel(values: &mut [f32], change: impl Fn(DVec3) -> DVec3) {
    for pixel in values.as_chunks_mut::<3>().0 {
        *pixel = change(DVec3::from_array(pixel.map(f64::from))).as_vec3().to_array();
    }
}

/// Red, green and blue of Y, (R - Y) / Y and (B - Y) / Y, as OpenEXR's RgbaYca defines them.
fn without_luminance(
    DVec3 { x: y, y: red_chroma, z: blue_chroma }: DVec3,
    weights: DVec3,
) -> DVec3 {
    let (red, blue) = ((red_chroma + 1.0) * y, (blue_chroma + 1.0) * y);
    let green = (y - weights.x * red - weights.z * blue) / weights.y;
    DVec3::new(red, green, blue)
}

fn unreadable(error: exr::error::Error) -> Error {
    Error::invalid("data", format!("not a readable OpenEXR: {error}"))
}

/// Encodes a picture as OpenEXR: channels `R`, `G`, `B` as 32-bit floats, compressed without loss;
/// `dpi` is its resolution in pixels per inch, if it has one.
pub fn encode_exr(image: &RgbImage, dpi: Option<f32>) -> Result<Vec<u8>> {
    let pixel = |position: exr::math::Vec2<usize>| {
        let start = 3 * (position.y() * image.width + position.x());
        (image.values[start], image.values[start + 1], image.values[start + 2])
    };
    let layer = Layer::new(
        (image.width, image.height),
        LayerAttributes { horizontal_density: dpi, ..LayerAttributes::default() },
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
    use exr::image::{AnyChannel, AnyChannels, FlatSamples};
    use exr::meta::attribute::Text;
    use exr::prelude::{IntegerBounds, SmallVec};

    use super::*;

    fn picture() -> RgbImage {
        let values = (0..3 * 5 * 3).map(|i| (i as f32 * 0.37).exp() * 1e-3 - 0.5).collect();
        RgbImage::new(5, 3, values).unwrap()
    }

    /// A layer of 2 x 1 pixels whose channels hold 0.25 and 0.5, each times its number from 1.
    fn part(name: Option<&str>, channels: &[&str]) -> Layer<AnyChannels<FlatSamples>> {
        let channel = |(number, name): (usize, &&str)| {
            let factor = 1.0 + number as f32;
            AnyChannel::new(*name, FlatSamples::F32(vec![0.25 * factor, 0.5 * factor]))
        };
        let list: SmallVec<[_; 4]> = channels.iter().enumerate().map(channel).collect();
        let attributes =
            LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
        Layer::new((2, 1), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list))
    }

    fn file(parts: Vec<Layer<AnyChannels<FlatSamples>>>, stored: Option<Primaries>) -> Vec<u8> {
        let window = IntegerBounds::from_dimensions((2, 1));
        let mut attributes = exr::meta::header::ImageAttributes::new(window);
        let place = |[x, y]: [f64; 2]| exr::math::Vec2(x as f32, y as f32);
        attributes.chromaticities =
            stored.map(|Primaries { rgb: [red, green, blue], white }| Chromaticities {
                red: place(red),
                green: place(green),
                blue: place(blue),
                white: place(white),
            });
        let mut data = Cursor::new(Vec::new());
        Image { attributes, layer_data: SmallVec::from_vec(parts) }
            .write()
            .to_buffered(&mut data)
            .unwrap();
        data.into_inner()
    }

    fn message(data: &[u8], name: Option<&str>) -> String {
        decode_exr(data, name).unwrap_err().to_string()
    }

    #[test]
    fn comes_back_bit_for_bit() {
        let mut image = picture();
        image.values[0] = f32::INFINITY;
        assert_eq!(decode_exr(&encode_exr(&image, None).unwrap(), None).unwrap().image, image);
    }

    #[test]
    fn grey_fills_all_three_channels() {
        let decoded = decode_exr(&file(vec![part(None, &["Y"])], None), None).unwrap();
        assert_eq!(decoded.image.values, [0.25, 0.25, 0.25, 0.5, 0.5, 0.5]);
    }

    #[test]
    fn a_part_without_colours_is_passed_over() {
        let parts = vec![part(Some("depth"), &["Z"]), part(Some("beauty"), &["R", "G", "B"])];
        let decoded = decode_exr(&file(parts, None), None).unwrap();
        assert_eq!(decoded.layer, "beauty");
        assert_eq!(decoded.image.values, [0.25, 0.5, 0.75, 0.5, 1.0, 1.5]);
    }

    #[test]
    fn colour_goes_before_grey_and_channels_without_a_prefix_before_others() {
        let parts = vec![part(Some("mask"), &["Y"]), part(Some("main"), &["R", "G", "B"])];
        assert_eq!(decode_exr(&file(parts, None), None).unwrap().layer, "main");
        let mixed = part(None, &["AO.R", "AO.G", "AO.B", "R", "G", "B"]);
        let decoded = decode_exr(&file(vec![mixed], None), None).unwrap();
        assert_eq!((decoded.layer.as_str(), &decoded.others[..]), ("", &[][..]));
        assert_eq!(decoded.image.values[..3], [1.0, 1.25, 1.5]);
    }

    #[test]
    fn a_layer_is_found_by_its_name() {
        let channels = ["a.R", "a.G", "a.B", "a.b.R", "a.b.G", "a.b.B"];
        let data = file(vec![part(Some("main"), &channels)], None);
        assert_eq!(decode_exr(&data, Some("a.b")).unwrap().layer, "main.a.b");
        assert_eq!(decode_exr(&data, Some("main.a")).unwrap().image.values[..3], [0.25, 0.5, 0.75]);
        let first = decode_exr(&data, None).unwrap();
        assert_eq!((first.layer.as_str(), &first.others[..]), ("main.a", &["main.a.b".into()][..]));
        let message = message(&data, Some("c"));
        assert!(message.contains("'c'") && message.contains("'main.a.b' (B, G, R)"), "{message}");
    }

    #[test]
    fn unknown_channels_are_named() {
        for (channels, shown) in [
            (&["depth"][..], "'' (depth)"),
            (&["N.X", "N.Y", "N.Z"], "'N' (X, Y, Z)"),
            (&["RY", "Y"], "'' (RY, Y)"),
        ] {
            let message = message(&file(vec![part(None, channels)], None), None);
            assert!(message.contains(shown) && message.contains("R, G and B"), "{message}");
        }
        let parts = vec![part(Some("depth"), &["Z"]), part(Some("main"), &["R", "G", "B"])];
        let message = message(&file(parts, None), Some("depth"));
        assert!(message.contains("no colours in 'depth' (Z)"), "{message}");
    }

    /// Y = 0.25, (R - Y) / Y = 0.5, (B - Y) / Y = 0.75.
    #[test]
    fn luminance_and_chroma_are_taken_apart() {
        let data = file(vec![part(None, &["Y", "RY", "BY"])], None);
        let pixel = decode_exr(&data, None).unwrap().image.values;
        let (red, blue) = (0.375, 0.4375);
        let green = (0.25 - 0.2126 * red - 0.0722 * blue) / 0.7152;
        for (value, expected) in pixel.into_iter().zip([red, green, blue]) {
            assert!((value - expected).abs() < 1e-4, "{value} {expected}");
        }
    }

    #[test]
    fn other_primaries_are_converted() {
        let swapped = Primaries { rgb: [1, 0, 2].map(|i| REC_709.rgb[i]), ..REC_709 };
        let data = file(vec![part(None, &["R", "G", "B"])], Some(swapped));
        let pixel = decode_exr(&data, None).unwrap().image.values;
        for (value, expected) in pixel.into_iter().zip([0.5, 0.25, 0.75]) {
            assert!((value - expected).abs() < 1e-6, "{value} {expected}");
        }
        let flat = Primaries { rgb: [[0.3, 0.3]; 3], ..REC_709 };
        let data = file(vec![part(None, &["R", "G", "B"])], Some(flat));
        assert!(message(&data, None).contains("chromaticities"));
    }

    #[test]
    fn resolution_is_written() {
        let data = encode_exr(&picture(), Some(300.0)).unwrap();
        let reader = exr::block::read(Cursor::new(&data[..]), false).unwrap();
        assert_eq!(reader.headers()[0].own_attributes.horizontal_density, Some(300.0));
    }

    #[test]
    fn what_is_not_exr_is_an_error() {
        let whole = encode_exr(&picture(), None).unwrap();
        for data in [&b"GIF89a"[..], &[], &whole[..whole.len() / 2], &whole[..whole.len() - 9]] {
            assert!(decode_exr(data, None).is_err());
        }
    }
}
