//! PNG files, 8 bits, sRGB.

use std::path::Path;

use crate::atomic::{write_all, write_atomically};
use crate::error::Error;
use crate::image::Image;
use crate::tone::ToneMap;

impl Image {
    /// Writes the picture as a PNG of 8-bit sRGB, by the tone map given. Alpha is left out: what is behind a
    /// cloud is black, as in the EXR. The metadata becomes text chunks.
    pub fn write_png(&self, path: impl AsRef<Path>, tone: &ToneMap) -> Result<(), Error> {
        let path = path.as_ref();
        let bytes = self.to_png(path, tone)?;
        write_atomically(path, |file| write_all(file, path, &bytes))
    }

    fn to_png(&self, path: &Path, tone: &ToneMap) -> Result<Vec<u8>, Error> {
        self.check(path)?;
        let Some(rgb) = self.color() else {
            return Err(Error::invalid(
                path,
                "the image has no layer with the channels R, G and B",
            ));
        };
        let size =
            |n: usize| u32::try_from(n).map_err(|_| Error::invalid(path, "too large for a PNG"));
        let invalid =
            |e: png::EncodingError| Error::invalid(path, format!("cannot encode as PNG: {e}"));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size(self.width)?, size(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        for (key, value) in &self.metadata {
            // Keywords are 1 to 79 Latin-1 characters (PNG §11.3.4.2); texts are UTF-8 in iTXt.
            let keyword: String = key
                .chars()
                .filter(|c| (' '..='~').contains(c))
                .take(79)
                .collect();
            if !keyword.trim().is_empty() {
                encoder
                    .add_itxt_chunk(keyword.trim().into(), value.clone())
                    .map_err(invalid)?;
            }
        }
        let mut writer = encoder.write_header().map_err(invalid)?;
        let mut pixels = Vec::with_capacity(3 * self.pixels());
        for ((r, g), b) in rgb[0].iter().zip(rgb[1]).zip(rgb[2]) {
            pixels.extend([tone.apply(*r), tone.apply(*g), tone.apply(*b)]);
        }
        writer.write_image_data(&pixels).map_err(invalid)?;
        writer.finish().map_err(invalid)?;
        Ok(bytes)
    }
}
