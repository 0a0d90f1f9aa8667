//! Where the bytes come from: a file read at positions, or bytes already in memory.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Fault, Parsed};

enum Store {
    Disk(fs::File),
    Memory(Vec<u8>),
}

/// A store of known length that threads may read at once, and a count of what was read.
pub(crate) struct Source {
    store: Store,
    length: u64,
    read: AtomicU64,
}

impl Source {
    pub fn open(path: &Path) -> Parsed<Self> {
        // Looked at before it is opened: opening a pipe would wait for its other end.
        let about = fs::metadata(path).map_err(|e| Fault::io(None, e))?;
        if !about.is_file() {
            let error = io::Error::new(io::ErrorKind::InvalidInput, "not a regular file");
            return Err(Fault::io(None, error));
        }
        let file = fs::File::open(path).map_err(|e| Fault::io(None, e))?;
        Ok(Self {
            store: Store::Disk(file),
            length: about.len(),
            read: AtomicU64::new(0),
        })
    }

    pub fn from_bytes(bytes: Vec<u8>) -> Self {
        let length = bytes.len() as u64;
        Self {
            store: Store::Memory(bytes),
            length,
            read: AtomicU64::new(0),
        }
    }

    /// The length in bytes when the file was opened; nothing is read beyond it.
    pub fn len(&self) -> u64 {
        self.length
    }

    /// How many bytes have been read so far, read-ahead included.
    pub fn bytes_read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Fills `buffer` from `offset`. The caller has checked the range against [`len`](Self::len).
    pub fn read_exact_at(&self, offset: u64, buffer: &mut [u8]) -> Parsed<()> {
        match &self.store {
            Store::Disk(file) => read_exact_at(file, offset, buffer)
                .map_err(|error| Fault::io(Some(offset), error))?,
            Store::Memory(bytes) => {
                let part = usize::try_from(offset)
                    .ok()
                    .and_then(|start| bytes.get(start..start.checked_add(buffer.len())?))
                    .ok_or_else(|| Fault::invalid(offset, "the file ends here"))?;
                buffer.copy_from_slice(part);
            }
        }
        self.read.fetch_add(buffer.len() as u64, Ordering::Relaxed);
        Ok(())
    }
}

#[cfg(unix)]
fn read_exact_at(file: &fs::File, offset: u64, buffer: &mut [u8]) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &fs::File, mut offset: u64, mut buffer: &mut [u8]) -> io::Result<()> {
    while !buffer.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, buffer, offset) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                buffer = &mut buffer[count..];
                offset += count as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
