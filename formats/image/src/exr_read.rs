//! Reading OpenEXR, ours and that of other programs.
//!
//! The `exr` crate allocates whatever the header asks for. So the header is read first and compared with a
//! budget and with what the file's length can hold.

use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::block::reader::Reader;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, compute_chunk_count};
use exr::prelude::{Compression, FlatSamples, ReadChannels, ReadLayers, Vec2, read};

use crate::error::Error;
use crate::exr_info::{ExrInfo, layer_and_channel};
use crate::image::{Channel, Image, Layer};

/// What reading may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most values (pixels × channels) that are read; each costs 4 bytes.
    pub values: u64,
}

impl Default for Limits {
    /// 2²⁹ values, 2 GiB: an environment of 16384 × 8192 pixels with four channels.
    fn default() -> Limits {
        Limits { values: 1 << 29 }
    }
}

impl Image {
    /// Reads all layers and texts of an OpenEXR file: any part, channel type, compression and tiling, except
    /// deep data, subsampled channels and parts of different sizes. Of several resolutions the largest.
    pub fn read_exr(path: impl AsRef<Path>) -> Result<Image, Error> {
        Image::read_exr_within(path, Limits::default())
    }

    /// The same with other limits.
    pub fn read_exr_within(path: impl AsRef<Path>, limits: Limits) -> Result<Image, Error> {
        let path = path.as_ref();
        let io = |source| Error::io(path, "", source);
        let file = File::open(path).map_err(io)?;
        let found = file.metadata().map_err(io)?;
        if !found.is_file() {
            return Err(Error::invalid(path, "is not a file"));
        }
        decode(
            BufReader::with_capacity(1 << 16, file),
            found.len(),
            path,
            limits,
        )
    }

    /// Reads an OpenEXR file from memory; `name` stands for it in errors.
    pub fn parse_exr(bytes: &[u8], name: impl AsRef<Path>, limits: Limits) -> Result<Image, Error> {
        decode(
            Cursor::new(bytes),
            bytes.len() as u64,
            name.as_ref(),
            limits,
        )
    }
}

fn decode(
    source: impl Read + Seek,
    length: u64,
    path: &Path,
    limits: Limits,
) -> Result<Image, Error> {
    // The crate indexes tables by numbers from the file. Whatever it misses is an error here, not the end of
    // the program; nothing of the half-read state is used afterwards.
    catch_unwind(AssertUnwindSafe(|| {
        let reader = Reader::read_from_buffered(source, false).map_err(|e| Error::exr(path, e))?;
        check(reader.headers(), length, path, limits)?;
        pixels(reader, path)
    }))
    .unwrap_or_else(|_| {
        Err(Error::invalid(
            path,
            "damaged EXR file: its parts contradict each other",
        ))
    })
}

/// Refuses what is not read, and what is larger than it can be.
fn check(headers: &[Header], length: u64, path: &Path, limits: Limits) -> Result<(), Error> {
    let Some(first) = headers.first() else {
        return Err(Error::invalid(path, "an EXR file without parts"));
    };
    let mut values = 0u64;
    for (i, header) in headers.iter().enumerate() {
        let size = header.layer_size;
        let name = header
            .own_attributes
            .layer_name
            .as_ref()
            .map_or_else(|| format!("{i}"), |n| format!("{n:?}"));
        if header.deep {
            return Err(Error::unsupported(
                path,
                format!("part {name} has deep data, which is not read"),
            ));
        }
        if let Some(c) = header
            .channels
            .list
            .iter()
            .find(|c| c.sampling != Vec2(1, 1))
        {
            let what = format!("channel {} is subsampled, which is not read", c.name);
            return Err(Error::unsupported(path, what));
        }
        if size != first.layer_size
            || header.own_attributes.layer_position != first.own_attributes.layer_position
        {
            let what =
                format!("part {name} covers other pixels than the first part, which is not read");
            return Err(Error::unsupported(path, what));
        }
        let area = size.0 as u64 * size.1 as u64;
        values = values.saturating_add(area.saturating_mul(header.channels.list.len() as u64));
        let bytes = area.saturating_mul(header.channels.bytes_per_pixel as u64);
        if bytes
            > length
                .saturating_mul(expansion(header.compression))
                .saturating_add(1 << 16)
        {
            let what = format!(
                "the header promises {} × {} pixels, more than {length} bytes can hold",
                size.0, size.1
            );
            return Err(Error::invalid(path, what));
        }
        if let BlockDescription::Tiles(tiles) = header.blocks {
            // One tile is decoded at a time, whatever part of it is inside the picture.
            let tile = tiles.tile_size.0 as u64 * tiles.tile_size.1 as u64;
            if tile > area.saturating_mul(4).max(1 << 20) {
                return Err(Error::invalid(
                    path,
                    "tiles that are much larger than the picture",
                ));
            }
        }
        let chunks = compute_chunk_count(header.compression, size, header.blocks);
        if header.chunk_count != chunks {
            let what = format!("{} blocks where {chunks} are needed", header.chunk_count);
            return Err(Error::invalid(path, format!("damaged EXR file: {what}")));
        }
    }
    if values > limits.values {
        let what = format!(
            "has {values} values, more than the {} that are read",
            limits.values
        );
        return Err(Error::unsupported(path, what));
    }
    Ok(())
}

/// How many bytes of pixels one byte of a file can hold at most.
fn expansion(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        // A run of 128 bytes takes two.
        Compression::RLE => 64,
        // A constant block of 16 pixels takes 3 of its 32 bytes.
        Compression::B44 | Compression::B44A => 11,
        // Deflate's limit is 1032 (RFC 1951: 258 bytes per two bits).
        Compression::ZIP1 | Compression::ZIP16 => 1032,
        // The same, after one byte of four has been dropped.
        Compression::PXR24 => 1376,
        // Several stages, without a simple limit.
        _ => 1 << 20,
    }
}

fn pixels(reader: Reader<impl Read + Seek>, path: &Path) -> Result<Image, Error> {
    let headers: Vec<Header> = reader.headers().to_vec();
    let missing = || Error::invalid(path, "an EXR file without parts");
    let info = ExrInfo::from_headers(&headers).ok_or_else(missing)?;
    // Sequential: the parallel reader would run a panic of the crate on a thread where nobody catches it.
    let decoded = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)
        .map_err(|e| Error::exr(path, e))?;
    let mut image = Image::new(info.width, info.height);
    // Where each layer is, and the names of its channels: a small file may have very many.
    let mut known: HashMap<String, (usize, HashSet<String>)> = HashMap::new();
    (image.origin, image.full, image.metadata) = (info.origin, info.full, info.metadata);
    for (part, (layer, header)) in decoded.layer_data.into_iter().zip(&headers).enumerate() {
        for channel in layer.channel_data.list {
            let (layer, name) = layer_and_channel(part, header, &channel.name);
            let data = match channel.sample_data {
                FlatSamples::F32(data) => data,
                FlatSamples::F16(data) => data.into_iter().map(f32::from).collect(),
                FlatSamples::U32(data) => data.into_iter().map(|x| x as f32).collect(),
            };
            if data.len() != image.pixels() {
                return Err(Error::invalid(
                    path,
                    format!("channel {name:?} is not complete"),
                ));
            }
            let layers = &mut image.layers;
            let (at, names) = known.entry(layer.clone()).or_insert_with(|| {
                layers.push(Layer {
                    name: layer.clone(),
                    channels: Vec::new(),
                });
                (layers.len() - 1, HashSet::new())
            });
            if !names.insert(name.clone()) {
                return Err(Error::invalid(
                    path,
                    format!("two channels are named {name:?} in layer {layer:?}"),
                ));
            }
            layers[*at].channels.push(Channel { name, data });
        }
    }
    image.sort();
    Ok(image)
}
