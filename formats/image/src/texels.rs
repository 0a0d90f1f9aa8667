//! Images as textures need them: PNG, JPEG, Radiance HDR and OpenEXR, in the precision that the file has.
//!
//! What a file asks for is compared with what its length can hold before anything is allocated.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use half::f16;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::error::Error;
use crate::exr_read::Limits;
use crate::image::{BEAUTY, Image, Layer};

/// A decoded image. Values are as the file has them: neither its colour space nor its gamma is applied.
#[derive(Debug, Clone, PartialEq)]
pub struct Texels {
    /// Width in texels, at least 1.
    pub width: usize,
    /// Height in texels, at least 1.
    pub height: usize,
    /// 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA.
    pub channels: usize,
    /// Values row by row from the top, each row from the left, the channels of a texel together.
    pub data: TexelData,
}

/// The values of an image.
#[derive(Debug, Clone, PartialEq)]
pub enum TexelData {
    /// 255 is 1.
    U8(Vec<u8>),
    /// 65535 is 1.
    U16(Vec<u16>),
    /// Half precision: floating-point images none of whose values would change by it.
    F16(Vec<f16>),
    /// Single precision.
    F32(Vec<f32>),
}

impl TexelData {
    /// How many values.
    pub fn len(&self) -> usize {
        match self {
            TexelData::U8(v) => v.len(),
            TexelData::U16(v) => v.len(),
            TexelData::F16(v) => v.len(),
            TexelData::F32(v) => v.len(),
        }
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        self.len()
            * match self {
                TexelData::U8(_) => 1,
                TexelData::U16(_) | TexelData::F16(_) => 2,
                TexelData::F32(_) => 4,
            }
    }

    /// True for floating-point values, which are linear unless someone says otherwise.
    pub fn is_float(&self) -> bool {
        matches!(self, TexelData::F16(_) | TexelData::F32(_))
    }
}

/// The largest image file that is read, bytes.
const MAX_FILE: u64 = 1 << 30;

/// No format packs more than this many bytes of values into a byte of file: deflate reaches 1032, a JPEG block whose
/// coefficients are all zero 64 × 3 values in a few bits, a run of Radiance pixels 127 × 12 bytes in 8.
const EXPANSION: u64 = 2048;

impl Texels {
    /// Reads an image file, and says how many bytes that took.
    ///
    /// # Errors
    /// If it cannot be read, is none of the formats, or is damaged.
    pub fn read(path: impl AsRef<Path>) -> Result<(Texels, u64), Error> {
        let path = path.as_ref();
        let io = |source| Error::io(path, "", source);
        let file = std::fs::File::open(path).map_err(io)?;
        if !file.metadata().map_err(io)?.is_file() {
            return Err(Error::invalid(path, "is not a file"));
        }
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut std::io::Read::take(file, MAX_FILE + 1), &mut bytes)
            .map_err(io)?;
        if bytes.len() as u64 > MAX_FILE {
            let what = format!("is larger than the {MAX_FILE} bytes that are read of an image");
            return Err(Error::invalid(path, what));
        }
        let texels = Texels::parse(&bytes, path, Limits::default())?;
        Ok((texels, bytes.len() as u64))
    }

    /// Decodes the bytes of an image file; `name` stands for it in errors.
    ///
    /// # Errors
    /// If they are none of the formats, damaged, or more than the limits allow.
    pub fn parse(bytes: &[u8], name: impl AsRef<Path>, limits: Limits) -> Result<Texels, Error> {
        let name = name.as_ref();
        let format = match bytes {
            [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
            [0xff, 0xd8, 0xff, ..] => ImageFormat::Jpeg,
            [b'#', b'?', ..] => ImageFormat::Hdr,
            [0x76, 0x2f, 0x31, 0x01, ..] => {
                return exr(&Image::parse_exr(bytes, name, limits)?, name);
            }
            _ => {
                let what =
                    "is no image that can be read: neither PNG, JPEG, OpenEXR nor Radiance HDR";
                return Err(Error::unsupported(name, what));
            }
        };
        // The decoders compute with numbers from the file. Whatever they miss is an error here, not the end of the program.
        catch_unwind(AssertUnwindSafe(|| decode(bytes, format, name, limits))).unwrap_or_else(
            |_| {
                Err(Error::invalid(
                    name,
                    "damaged image: its parts contradict each other",
                ))
            },
        )
    }
}

fn decode(bytes: &[u8], format: ImageFormat, name: &Path, limits: Limits) -> Result<Texels, Error> {
    let damaged = |e: image::ImageError| match e {
        image::ImageError::Unsupported(e) => Error::unsupported(name, e.to_string()),
        e => Error::invalid(name, format!("damaged image: {e}")),
    };
    let reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let promised = decoder.total_bytes();
    if width == 0 || height == 0 {
        return Err(Error::invalid(name, "has no pixels"));
    }
    let budget = (bytes.len() as u64).saturating_mul(EXPANSION);
    if promised > budget.saturating_add(1 << 16) {
        let what = format!(
            "the header promises {width} × {height} pixels, more than {} bytes can hold",
            bytes.len()
        );
        return Err(Error::invalid(name, what));
    }
    let values =
        u64::from(width) * u64::from(height) * u64::from(decoder.color_type().channel_count());
    if values > limits.values {
        let what = format!(
            "has {values} values, more than the {} that are read",
            limits.values
        );
        return Err(Error::invalid(name, what));
    }
    let mut allowed = image::Limits::default();
    allowed.max_alloc = Some(promised.saturating_mul(2).saturating_add(64 << 20));
    decoder.set_limits(allowed).map_err(damaged)?;
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let channels = usize::from(image.color().channel_count());
    let data = match image {
        DynamicImage::ImageLuma8(i) => TexelData::U8(i.into_raw()),
        DynamicImage::ImageLumaA8(i) => TexelData::U8(i.into_raw()),
        DynamicImage::ImageRgb8(i) => TexelData::U8(i.into_raw()),
        DynamicImage::ImageRgba8(i) => TexelData::U8(i.into_raw()),
        DynamicImage::ImageLuma16(i) => TexelData::U16(i.into_raw()),
        DynamicImage::ImageLumaA16(i) => TexelData::U16(i.into_raw()),
        DynamicImage::ImageRgb16(i) => TexelData::U16(i.into_raw()),
        DynamicImage::ImageRgba16(i) => TexelData::U16(i.into_raw()),
        DynamicImage::ImageRgb32F(i) => floats(i.into_raw(), name)?,
        DynamicImage::ImageRgba32F(i) => floats(i.into_raw(), name)?,
        _ => {
            return Err(Error::unsupported(
                name,
                "has a pixel type that is not read",
            ));
        }
    };
    Ok(Texels {
        width: width as usize,
        height: height as usize,
        channels,
        data,
    })
}

/// The picture of an OpenEXR image, with its alpha if it has one.
fn exr(image: &Image, name: &Path) -> Result<Texels, Error> {
    let color = image
        .color()
        .ok_or_else(|| Error::unsupported(name, "has no colour channels R, G, B or Y"))?;
    let layer = image.layer(BEAUTY);
    let grey = layer.is_some_and(|l| l.rgb().is_none());
    let mut planes: Vec<&[f32]> = color[..if grey { 1 } else { 3 }].to_vec();
    planes.extend(layer.and_then(|l: &Layer| l.channel("A")));
    let values = (0..image.pixels())
        .flat_map(|i| planes.iter().map(move |p| p[i]))
        .collect();
    Ok(Texels {
        width: image.width,
        height: image.height,
        channels: planes.len(),
        data: floats(values, name)?,
    })
}

/// Half precision if that changes nothing. No parameter can be infinite or no number.
fn floats(values: Vec<f32>, name: &Path) -> Result<TexelData, Error> {
    if values.iter().any(|v| !v.is_finite()) {
        return Err(Error::invalid(
            name,
            "has a value that is infinite or no number",
        ));
    }
    let exact = |v: &f32| f16::from_f32(*v).to_f32() == *v;
    if values.iter().all(exact) {
        return Ok(TexelData::F16(
            values.into_iter().map(f16::from_f32).collect(),
        ));
    }
    Ok(TexelData::F32(values))
}
