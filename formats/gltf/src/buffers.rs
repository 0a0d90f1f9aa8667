//! Buffers and images: the binary chunk, data URIs, and files beside the model.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::json;
use resolvent_scene::{ImageSource, MemoryImage};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use crate::container::Container;
use crate::error::Fallible;

/// The largest buffer file that is read, bytes.
const MAX_BUFFER: u64 = 4 << 30;

/// The bytes that accessors and images refer to.
pub(crate) struct Buffers<'c> {
    root: &'c json::Root,
    all: Vec<Vec<u8>>,
    /// Sum of the lengths of the buffers.
    pub bytes: usize,
}

impl<'c> Buffers<'c> {
    /// Reads all buffers that the model names; `folder` is where the model stands.
    pub fn read(container: &'c Container, folder: &Path) -> Fallible<Buffers<'c>> {
        let mut all = Vec::new();
        for (i, buffer) in container.root.buffers.iter().enumerate() {
            let at = |what: String| format!("buffers[{i}]: {what}");
            let mut bytes = match (&buffer.uri, container.binary) {
                (Some(uri), _) => read_uri(uri, folder).map_err(at)?,
                (None, Some(binary)) if i == 0 => binary.to_vec(),
                (None, _) => return Err(at("has no data".into())),
            };
            let promised = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
            if bytes.len() < promised {
                return Err(at(format!(
                    "promises {promised} bytes and has {}",
                    bytes.len()
                )));
            }
            bytes.truncate(promised);
            all.push(bytes);
        }
        Ok(Buffers {
            root: &container.root,
            bytes: all.iter().map(Vec::len).sum(),
            all,
        })
    }

    /// The bytes of a buffer view, and the distance between its elements if it states one.
    pub fn view(&self, index: usize) -> Fallible<(&[u8], Option<usize>)> {
        let at = |what: &str| format!("bufferViews[{index}]: {what}");
        let view = self.root.buffer_views.get(index);
        let view = view.ok_or_else(|| at("does not exist"))?;
        let buffer = self.all.get(view.buffer.value());
        let buffer = buffer.ok_or_else(|| at("its buffer does not exist"))?;
        let offset = view.byte_offset.map_or(0, |o| o.0);
        let end = offset.checked_add(view.byte_length.0);
        let range = end.and_then(|end| {
            let range = usize::try_from(offset).ok()?..usize::try_from(end).ok()?;
            buffer.get(range)
        });
        let bytes = range.ok_or_else(|| at("reaches beyond the end of its buffer"))?;
        Ok((bytes, view.byte_stride.map(|s| s.0)))
    }

    /// Where the image of an index is; files are named from the model's folder.
    pub fn image(&self, index: usize) -> Fallible<ImageSource> {
        let at = |what: String| format!("images[{index}]: {what}");
        let image = self.root.images.get(index);
        let image = image.ok_or_else(|| at("does not exist".into()))?;
        let memory = |bytes: Arc<[u8]>| {
            let name = image.name.as_deref().map(|n| format!(" {n:?}"));
            ImageSource::Memory(MemoryImage {
                name: format!("image {index}{} of the model", name.unwrap_or_default()),
                bytes,
            })
        };
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                Ok(memory(data_uri(uri).map_err(at)?.into()))
            }
            (Some(uri), _) => Ok(ImageSource::File(relative(uri).map_err(at)?)),
            (None, Some(view)) => Ok(memory(self.view(view.value()).map_err(at)?.0.into())),
            (None, None) => Err(at("has neither a URI nor a buffer view".into())),
        }
    }
}

fn read_uri(uri: &str, folder: &Path) -> Fallible<Vec<u8>> {
    if uri.starts_with("data:") {
        return data_uri(uri);
    }
    let path = folder.join(relative(uri)?);
    let failed = |e: std::io::Error| format!("{}: {e}", path.display());
    let file = std::fs::File::open(&path).map_err(failed)?;
    if !file.metadata().map_err(failed)?.is_file() {
        return Err(format!("{}: is not a file", path.display()));
    }
    let mut bytes = Vec::new();
    file.take(MAX_BUFFER)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    Ok(bytes)
}

/// The bytes of `data:type;base64,…` (RFC 2397).
fn data_uri(uri: &str) -> Fallible<Vec<u8>> {
    let data = uri.split_once(";base64,").map(|(_, data)| data);
    let data = data.ok_or("has a data URI that is not base64")?;
    STANDARD
        .decode(data)
        .map_err(|e| format!("has a damaged data URI: {e}"))
}

/// A relative path from a URI; other schemes are not fetched.
pub(crate) fn relative(uri: &str) -> Fallible<String> {
    let scheme = uri.split_once(':').map(|(scheme, _)| scheme);
    if let Some(scheme) = scheme
        && scheme.len() > 1
        && scheme
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b))
    {
        return Err(format!(
            "has the URI {uri:?}; only files and data URIs are read"
        ));
    }
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(b) = rest.next() {
        if b != b'%' {
            bytes.push(b);
            continue;
        }
        let mut digit = || (rest.next()? as char).to_digit(16);
        let code = digit().zip(digit()).map(|(h, l)| (h * 16 + l) as u8);
        bytes.push(code.ok_or_else(|| format!("has the damaged URI {uri:?}"))?);
    }
    String::from_utf8(bytes)
        .ok()
        .filter(|p| !p.is_empty() && !p.contains('\0'))
        .ok_or_else(|| format!("has the damaged URI {uri:?}"))
}
