//! The layers of an OpenEXR file: its parts, and within them the channels with a common prefix.

use std::fmt;

use exr::meta::header::Header;

use crate::error::{Error, Result};

/// Channels that belong together: those of a part whose names have the same prefix.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// The number of its part.
    pub part: usize,
    /// What its channels say.
    pub colors: Colors,
    part_name: String,
    prefix: String,
    /// Names of its channels, without the prefix.
    channels: Vec<String>,
}

/// The numbers of the channels that hold a layer's colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colors {
    /// Red, green and blue.
    Rgb([usize; 3]),
    /// Luminance Y, and (R - Y) / Y and (B - Y) / Y.
    LuminanceChroma([usize; 3]),
    /// Luminance alone.
    Grey(usize),
    /// None: a depth, a normal, a mask, or deep data.
    None,
}

impl Layer {
    /// Its part's name and its channels' prefix; empty for channels without either.
    pub fn name(&self) -> String {
        let (part, prefix) = (self.part_name.as_str(), self.prefix.as_str());
        let begins_with_part = prefix
            .strip_prefix(part)
            .is_some_and(|rest| part.is_empty() || rest.is_empty() || rest.starts_with('.'));
        match (part, prefix) {
            (part, "") => part.to_owned(),
            (_, prefix) if begins_with_part => prefix.to_owned(),
            (part, prefix) => format!("{part}.{prefix}"),
        }
    }

    /// Whether its channels have names with a prefix.
    pub fn is_prefixed(&self) -> bool {
        !self.prefix.is_empty()
    }

    /// Whether a user who asks for `name` can mean it.
    fn answers_to(&self, name: &str) -> bool {
        self.name() == name || self.prefix == name || self.part_name == name
    }

    fn has_chroma(&self) -> bool {
        matches!(self.colors, Colors::Rgb(_) | Colors::LuminanceChroma(_))
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}' ({})", self.name(), self.channels.join(", "))
    }
}

/// All layers, part by part; within one that without a prefix comes first.
pub fn layers(headers: &[Header]) -> Vec<Layer> {
    headers.iter().enumerate().flat_map(|(part, header)| layers_of(part, header)).collect()
}

/// The layer that is asked for by name, else the first with colours, else the first grey one.
pub fn choose<'a>(layers: &'a [Layer], name: Option<&str>) -> Result<&'a Layer> {
    let asked: Vec<&Layer> = match name {
        Some(name) => layers.iter().filter(|layer| layer.answers_to(name)).collect(),
        None => layers.iter().collect(),
    };
    if let (Some(name), []) = (name, &asked[..]) {
        let problem = format!("is '{name}', but must be one of {}", list(layers.iter()));
        return Err(Error::invalid("layer", problem));
    }
    let is_grey = |layer: &&&Layer| matches!(layer.colors, Colors::Grey(_));
    let with_chroma = asked.iter().find(|layer| layer.has_chroma());
    with_chroma.or_else(|| asked.iter().find(is_grey)).copied().ok_or_else(|| {
        let problem = format!(
            "has no colours in {}: needs flat channels R, G and B, or Y, or Y, RY and BY",
            list(asked.into_iter())
        );
        Error::invalid("channels", problem)
    })
}

/// The names of other layers with colours.
pub fn others(layers: &[Layer], chosen: &Layer) -> Vec<String> {
    let is_other = |layer: &&Layer| layer.has_chroma() && *layer != chosen;
    layers.iter().filter(is_other).map(Layer::name).collect()
}

fn list<'a>(layers: impl Iterator<Item = &'a Layer>) -> String {
    layers.map(Layer::to_string).collect::<Vec<_>>().join(", ")
}

fn layers_of(part: usize, header: &Header) -> Vec<Layer> {
    let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
    let mut layers: Vec<Layer> = Vec::new();
    let mut numbers: Vec<Vec<usize>> = Vec::new();
    for (number, channel) in header.channels.list.iter().enumerate() {
        let name = channel.name.to_string();
        let (prefix, channel) = name.rsplit_once('.').unwrap_or(("", &name));
        let at = layers.iter().position(|layer| layer.prefix == prefix).unwrap_or_else(|| {
            layers.push(Layer {
                part,
                colors: Colors::None,
                part_name: part_name.clone().unwrap_or_default(),
                prefix: prefix.to_owned(),
                channels: Vec::new(),
            });
            numbers.push(Vec::new());
            layers.len() - 1
        });
        layers[at].channels.push(channel.to_owned());
        numbers[at].push(number);
    }
    for (layer, numbers) in layers.iter_mut().zip(&numbers) {
        if !header.deep {
            layer.colors = colors(&layer.channels, numbers);
        }
    }
    layers.sort_by_key(Layer::is_prefixed);
    layers
}

fn colors(channels: &[String], numbers: &[usize]) -> Colors {
    let named = |wanted: &str| {
        channels.iter().position(|name| name.eq_ignore_ascii_case(wanted)).map(|at| numbers[at])
    };
    if let (Some(red), Some(green), Some(blue)) = (named("R"), named("G"), named("B")) {
        return Colors::Rgb([red, green, blue]);
    }
    match (named("Y"), named("RY"), named("BY")) {
        (Some(y), Some(ry), Some(by)) => Colors::LuminanceChroma([y, ry, by]),
        // X, Y and Z are a direction or a place.
        (Some(y), None, None) if named("X").is_none() => Colors::Grey(y),
        _ => Colors::None,
    }
}
