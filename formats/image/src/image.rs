//! An image in memory.

use std::collections::BTreeMap;

/// Name of the layer that is the picture itself.
pub const BEAUTY: &str = "";

/// Named layers of the same size, and metadata.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Where the upper left pixel is in the full picture: not zero for a crop.
    pub origin: [i32; 2],
    /// Width and height of the full picture.
    pub full: [usize; 2],
    /// The layers.
    pub layers: Vec<Layer>,
    /// Texts such as the scene, the seed and the samples taken.
    pub metadata: BTreeMap<String, String>,
}

/// Channels that belong together: the picture, its variance, the depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// [`BEAUTY`], or a name such as `depth` or `variance`.
    pub name: String,
    /// The channels.
    pub channels: Vec<Channel>,
}

/// One number per pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// `R`, `G`, `B`, `A`, `X`, `Y`, `Z`, `N` …
    pub name: String,
    /// Values row by row from the top, each row from the left; width × height of them.
    pub data: Vec<f32>,
}

impl Image {
    /// An image without layers.
    pub fn new(width: usize, height: usize) -> Image {
        Image {
            width,
            height,
            full: [width, height],
            ..Image::default()
        }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Adds a layer, or channels to a layer that is there.
    pub fn push<'n>(
        &mut self,
        layer: &str,
        channels: impl IntoIterator<Item = (&'n str, Vec<f32>)>,
    ) {
        let channels = channels.into_iter().map(|(name, data)| Channel {
            name: name.into(),
            data,
        });
        match self.layers.iter_mut().find(|l| l.name == layer) {
            Some(present) => present.channels.extend(channels),
            None => self.layers.push(Layer {
                name: layer.into(),
                channels: channels.collect(),
            }),
        }
    }

    /// The layer of a name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|l| l.name == name)
    }

    /// Values of one channel of a layer.
    pub fn channel(&self, layer: &str, channel: &str) -> Option<&[f32]> {
        self.layer(layer)?.channel(channel)
    }

    /// Red, green and blue of the picture: of the layer [`BEAUTY`], or of the first layer that has them
    /// (`Combined.R` …). An image of luminance alone (`Y`) is grey.
    pub fn color(&self) -> Option<[&[f32]; 3]> {
        let rgb = |layer: &Layer| layer.rgb().is_some();
        let layer = self
            .layer(BEAUTY)
            .filter(|l| rgb(l) || l.channel("Y").is_some());
        let layer = layer.or_else(|| self.layers.iter().find(|l| rgb(l)))?;
        layer.rgb_or_grey()
    }

    /// Puts layers and channels into the order in which files are read: the picture first, then by name;
    /// channels as RGBA, then by name.
    pub(crate) fn sort(&mut self) {
        self.layers.sort_by(|a, b| a.name.cmp(&b.name));
        for layer in &mut self.layers {
            layer
                .channels
                .sort_by_key(|c| ("RGBA".find(&c.name).unwrap_or(4), c.name.clone()));
        }
    }
}

impl Layer {
    /// Values of the channel of a name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|c| c.name == name)
            .map(|c| c.data.as_slice())
    }

    /// The channels R, G and B.
    pub fn rgb(&self) -> Option<[&[f32]; 3]> {
        Some([self.channel("R")?, self.channel("G")?, self.channel("B")?])
    }

    /// The channels R, G and B, or three times Y.
    pub fn rgb_or_grey(&self) -> Option<[&[f32]; 3]> {
        self.rgb().or_else(|| self.channel("Y").map(|y| [y; 3]))
    }
}
