//! What the header of an OpenEXR file says.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::meta::attribute::{AttributeValue, SampleType, Text};
use exr::meta::header::Header;

use crate::error::Error;
use crate::exr_write::PREFIX;

/// What the header of an OpenEXR file says, without its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrInfo {
    /// Width of the pixels of the first part.
    pub width: usize,
    /// Height of the pixels of the first part.
    pub height: usize,
    /// Position of its upper left pixel in the full picture.
    pub origin: [i32; 2],
    /// Size of the full picture.
    pub full: [usize; 2],
    /// All channels of all parts.
    pub channels: Vec<ChannelInfo>,
    /// Compression of the first part.
    pub compression: String,
    /// All texts.
    pub metadata: BTreeMap<String, String>,
}

/// One channel of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelInfo {
    /// The layer as [`crate::Image::layer`] names it.
    pub layer: String,
    /// The channel within the layer.
    pub name: String,
    /// `half`, `float` or `uint`.
    pub kind: &'static str,
}

impl ExrInfo {
    /// Reads the header of a file.
    pub fn read(path: impl AsRef<Path>) -> Result<ExrInfo, Error> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|source| Error::io(path, "", source))?;
        let reader = exr::block::reader::Reader::read_from_buffered(BufReader::new(file), false);
        let reader = reader.map_err(|e| Error::exr(path, e))?;
        ExrInfo::from_headers(reader.headers())
            .ok_or_else(|| Error::invalid(path, "an EXR file without parts"))
    }

    pub(crate) fn from_headers(headers: &[Header]) -> Option<ExrInfo> {
        let first = headers.first()?;
        let display = first.shared_attributes.display_window;
        let position = first.own_attributes.layer_position;
        let mut metadata = BTreeMap::new();
        let mut channels = Vec::new();
        for (part, header) in headers.iter().enumerate() {
            texts(header, &mut metadata);
            for channel in &header.channels.list {
                let (layer, name) = layer_and_channel(part, header, &channel.name);
                let kind = match channel.sample_type {
                    SampleType::F16 => "half",
                    SampleType::F32 => "float",
                    SampleType::U32 => "uint",
                };
                channels.push(ChannelInfo { layer, name, kind });
            }
        }
        Some(ExrInfo {
            width: first.layer_size.0,
            height: first.layer_size.1,
            origin: [
                position.0.saturating_sub(display.position.0),
                position.1.saturating_sub(display.position.1),
            ],
            full: [display.size.0, display.size.1],
            channels,
            compression: first.compression.to_string(),
            metadata,
        })
    }
}

pub(crate) fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Layer and channel of a channel's full name. Groups are layers; the plain channels of the first part are the
/// picture, those of others belong to a layer of the part's name.
pub(crate) fn layer_and_channel(part: usize, header: &Header, full: &Text) -> (String, String) {
    let full = utf8(full);
    let (group, name) = full.rsplit_once('.').unwrap_or(("", &full));
    let part_name = match &header.own_attributes.layer_name {
        _ if part == 0 => String::new(),
        Some(name) => utf8(name),
        None => format!("part{part}"),
    };
    let layer = match (part_name.as_str(), group) {
        ("", group) => group.to_string(),
        (part_name, "") => part_name.to_string(),
        // Many programs repeat the part's name in its channels.
        (part_name, group) if group == part_name || group.starts_with(&format!("{part_name}.")) => {
            group.to_string()
        }
        (part_name, group) => format!("{part_name}.{group}"),
    };
    (layer, name.to_string())
}

/// Collects the texts of a part; ours without their prefix, and before those of others.
fn texts(header: &Header, metadata: &mut BTreeMap<String, String>) {
    let own = &header.own_attributes;
    let standard = [
        ("software", &own.software_name),
        ("owner", &own.owner),
        ("comments", &own.comments),
        ("capDate", &own.capture_date),
    ];
    let mut ours = Vec::new();
    for (name, value) in standard {
        if let Some(value) = value {
            metadata.entry(name.into()).or_insert_with(|| utf8(value));
        }
    }
    for (name, value) in own.other.iter().chain(&header.shared_attributes.other) {
        if let AttributeValue::Text(value) = value {
            let name = utf8(name);
            match name.strip_prefix(PREFIX) {
                Some(key) => ours.push((key.to_string(), utf8(value))),
                None => {
                    metadata.entry(name).or_insert_with(|| utf8(value));
                }
            }
        }
    }
    metadata.extend(ours);
}
