//! Writing OpenEXR.
//!
//! One part, so that every program finds the picture as the plain channels R, G, B, A; other layers are
//! channel groups (`depth.Z`, `variance.R`). Samples are f32 and come back bit for bit; ZIP compression of 16
//! scan lines. Metadata becomes string attributes whose names begin with [`PREFIX`]: OpenEXR reserves plain
//! names such as `version` and `type`, and gives them other types.

use std::collections::HashSet;
use std::path::Path;

use exr::meta::attribute::{AttributeValue, Chromaticities};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage,
    ImageAttributes, IntegerBounds, Layer as ExrLayer, LayerAttributes, LineOrder, Text, Vec2,
    WritableImage,
};

use crate::atomic::write_atomically;
use crate::error::Error;
use crate::image::Image;

/// What the names of our string attributes begin with.
pub(crate) const PREFIX: &str = "resolvent.";

/// OpenEXR's limit on the names of channels and attributes.
const MAX_NAME: usize = 255;

impl Image {
    /// Writes all layers and the metadata.
    pub fn write_exr(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let image = self.to_exr(path)?;
        write_atomically(path, |file| {
            image
                .write()
                .to_buffered(file)
                .map_err(|e| Error::exr(path, e))
        })
    }

    fn to_exr(&self, path: &Path) -> Result<ExrImage<ExrLayer<AnyChannels<FlatSamples>>>, Error> {
        self.check(path)?;
        let size = Vec2(self.width, self.height);
        let mut channels = Vec::new();
        for layer in &self.layers {
            for channel in &layer.channels {
                let name = if layer.name.is_empty() {
                    channel.name.clone()
                } else {
                    format!("{}.{}", layer.name, channel.name)
                };
                channels.push(AnyChannel::new(
                    text(path, &name)?,
                    FlatSamples::F32(channel.data.clone()),
                ));
            }
        }
        let mut own = LayerAttributes {
            layer_position: Vec2(self.origin[0], self.origin[1]),
            ..Default::default()
        };
        let mut shared = ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(
            self.full[0],
            self.full[1],
        )));
        shared.chromaticities = Some(REC709);
        for (key, value) in &self.metadata {
            // Values have no limit of their own; OpenEXR strings are bytes, and UTF-8 by custom.
            let value = Text::from_slice_unchecked(value.as_bytes());
            if key == "software" {
                own.software_name = Some(value);
                continue;
            }
            own.other.insert(
                text(path, &format!("{PREFIX}{key}"))?,
                AttributeValue::Text(value),
            );
        }
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let layer = ExrLayer::new(size, own, encoding, AnyChannels::sort(channels.into()));
        let mut image = ExrImage::from_layer(layer);
        image.attributes = shared;
        Ok(image)
    }

    /// Checks what files demand of an image: a size, channels of that size, names that are names.
    pub(crate) fn check(&self, path: &Path) -> Result<(), Error> {
        let refuse = |what: String| Err(Error::invalid(path, what));
        if self.pixels() == 0
            || self
                .width
                .max(self.height)
                .max(self.full[0])
                .max(self.full[1])
                > 1 << 24
        {
            return refuse(format!(
                "an image of {} × {} pixels cannot be written",
                self.width, self.height
            ));
        }
        let mut names = HashSet::new();
        for layer in &self.layers {
            for channel in &layer.channels {
                let (name, count) = (
                    (layer.name.as_str(), channel.name.as_str()),
                    channel.data.len(),
                );
                if count != self.pixels() {
                    return refuse(format!(
                        "channel {name:?} has {count} values for {} pixels",
                        self.pixels()
                    ));
                }
                if !names.insert(name) {
                    return refuse(format!("two channels are named {name:?}"));
                }
                if channel.name.is_empty() || channel.name.contains('.') {
                    return refuse(format!(
                        "{:?} cannot be the name of a channel",
                        channel.name
                    ));
                }
            }
        }
        if names.is_empty() {
            refuse("the image has no channels".into())
        } else {
            Ok(())
        }
    }
}

/// A name that OpenEXR can have.
fn text(path: &Path, name: &str) -> Result<Text, Error> {
    if name.is_empty() || name.len() > MAX_NAME || name.contains('\0') {
        return Err(Error::invalid(
            path,
            format!("{name:?} cannot be a name in an EXR file"),
        ));
    }
    Ok(Text::from_slice_unchecked(name.as_bytes()))
}

/// Primaries and white of linear Rec. 709 (ITU-R BT.709-6, table 1), which are sRGB's.
const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};
