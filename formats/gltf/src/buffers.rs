//! Buffers and images: the binary chunk, data URIs, and files beside the model.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::json;
use resolvent_scene::{ImageSource, MemoryImage};
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use crate::container::Container;
use crate::error::Fallible;
use crate::values::short;

/// Most bytes that are read of the files of buffers, all together.
const MAX_BUFFERS: u64 = 4 << 30;
/// The longest path that systems take, bytes.
const MAX_PATH: usize = 4096;

/// The bytes that accessors and images refer to.
pub(crate) struct Buffers<'c> {
    root: &'c json::Root,
    /// Bytes and how many of them are the buffer's: several buffers may be of one file.
    all: Vec<(Rc<Vec<u8>>, usize)>,
    /// Sum of the lengths of the buffers, each file counted once.
    pub bytes: usize,
}

impl<'c> Buffers<'c> {
    /// Reads all buffers that the model names; `folder` is where the model stands.
    pub fn read(container: &'c Container, folder: &Path) -> Fallible<Buffers<'c>> {
        let mut out = Buffers {
            root: &container.root,
            all: Vec::new(),
            bytes: 0,
        };
        let mut files = Files::default();
        for (i, buffer) in container.root.buffers.iter().enumerate() {
            let at = |what: String| format!("buffers[{i}]: {what}");
            let (bytes, is_new) = match (&buffer.uri, container.binary) {
                (Some(uri), _) if uri.starts_with("data:") => {
                    (Rc::new(data_uri(uri).map_err(at)?), true)
                }
                (Some(uri), _) => files.read(uri, folder).map_err(at)?,
                (None, Some(binary)) if i == 0 => (Rc::new(binary.to_vec()), true),
                (None, _) => return Err(at("has no data".into())),
            };
            let promised = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
            if bytes.len() < promised {
                return Err(at(format!(
                    "promises {promised} bytes and has {}",
                    bytes.len()
                )));
            }
            if is_new {
                out.bytes += bytes.len();
            }
            out.all.push((bytes, promised));
        }
        Ok(out)
    }

    /// The bytes of a buffer view, and the distance between its elements if it states one.
    pub fn view(&self, index: usize) -> Fallible<(&[u8], Option<usize>)> {
        let at = |what: &str| format!("bufferViews[{index}]: {what}");
        let view = self.root.buffer_views.get(index);
        let view = view.ok_or_else(|| at("does not exist"))?;
        let buffer = self.all.get(view.buffer.value());
        let (buffer, length) = buffer.ok_or_else(|| at("its buffer does not exist"))?;
        let offset = view.byte_offset.map_or(0, |o| o.0);
        let end = offset.checked_add(view.byte_length.0);
        let range = end.and_then(|end| {
            let range = usize::try_from(offset).ok()?..usize::try_from(end).ok()?;
            buffer.get(..*length)?.get(range)
        });
        let bytes = range.ok_or_else(|| at("reaches beyond the end of its buffer"))?;
        Ok((bytes, view.byte_stride.map(|s| s.0)))
    }

    /// Where the images are; files are named from the model's folder.
    pub fn images(&self) -> Vec<Fallible<ImageSource>> {
        let mut views = Views {
            known: HashMap::new(),
            left: self.bytes,
        };
        let all = 0..self.root.images.len();
        all.map(|i| {
            self.image(i, &mut views)
                .map_err(|what| format!("images[{i}]: {what}"))
        })
        .collect()
    }

    fn image(&self, index: usize, views: &mut Views) -> Fallible<ImageSource> {
        let image = &self.root.images[index];
        let memory = |bytes: Arc<[u8]>| {
            let name = image.name.as_deref().map(|n| format!(" {:?}", short(n)));
            ImageSource::Memory(MemoryImage {
                name: format!("image {index}{} of the model", name.unwrap_or_default()),
                bytes,
            })
        };
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => Ok(memory(data_uri(uri)?.into())),
            (Some(uri), _) => Ok(ImageSource::File(relative(uri)?)),
            (None, Some(view)) => Ok(memory(views.copy(self.view(view.value())?.0)?)),
            (None, None) => Err("has neither a URI nor a buffer view".into()),
        }
    }
}

/// Copies of parts of buffers, each made once.
struct Views {
    /// By where the bytes are.
    known: HashMap<(*const u8, usize), Arc<[u8]>>,
    /// Bytes that may still be copied: there are not more than in the buffers, unless images overlap.
    left: usize,
}

impl Views {
    fn copy(&mut self, bytes: &[u8]) -> Fallible<Arc<[u8]>> {
        let key = (bytes.as_ptr(), bytes.len());
        if let Some(copy) = self.known.get(&key) {
            return Ok(copy.clone());
        }
        let left = self.left.checked_sub(bytes.len());
        self.left =
            left.ok_or("overlaps with others: with it images take more than all buffers")?;
        let copy: Arc<[u8]> = bytes.into();
        self.known.insert(key, copy.clone());
        Ok(copy)
    }
}

/// The files of buffers, each read once, under whatever names.
#[derive(Default)]
struct Files {
    known: HashMap<PathBuf, Rc<Vec<u8>>>,
    read: u64,
}

impl Files {
    /// The bytes of a file, and whether it had not been read before.
    fn read(&mut self, uri: &str, folder: &Path) -> Fallible<(Rc<Vec<u8>>, bool)> {
        let path = folder.join(relative(uri)?);
        let failed = |e: std::io::Error| format!("{}: {e}", path.display());
        let file = std::fs::File::open(&path).map_err(failed)?;
        if !file.metadata().map_err(failed)?.is_file() {
            return Err(format!("{}: is not a file", path.display()));
        }
        let key = path.canonicalize().map_err(failed)?;
        if let Some(bytes) = self.known.get(&key) {
            return Ok((bytes.clone(), false));
        }
        let mut bytes = Vec::new();
        let taken = file.take(MAX_BUFFERS - self.read).read_to_end(&mut bytes);
        self.read += taken.map_err(failed)? as u64;
        let bytes = Rc::new(bytes);
        self.known.insert(key, bytes.clone());
        Ok((bytes, true))
    }
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
    if uri.len() > 3 * MAX_PATH {
        return Err(format!(
            "has a URI of {} bytes; no path is so long",
            uri.len()
        ));
    }
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
