//! Copies of libraries, for those whose files may be overwritten while they are in use: the system maps a file, it does not read it.

use std::fs::OpenOptions;
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Calls `load` with a copy of a library under a name that no other has. The name is gone afterwards; what was mapped stays.
///
/// # Errors
/// If there can be no copy.
pub(super) fn with<R>(library: &Path, load: impl FnOnce(&Path) -> R) -> Result<R> {
    // Beside the library if that can be: what it finds relative to its own place (`$ORIGIN`), its copy finds as well.
    let beside = library.parent().filter(|p| !p.as_os_str().is_empty());
    let copy = copy(library, beside.unwrap_or(Path::new(".")))
        .or_else(|_| copy(library, &std::env::temp_dir()))?;
    Ok(load(&copy.0))
}

/// A file that goes when this does.
struct Copy(PathBuf);

impl Drop for Copy {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The copy's name begins with a dot and the number of this process: what is left after a crash can be told.
fn copy(library: &Path, folder: &Path) -> Result<Copy> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let name = library.file_name().ok_or(ErrorKind::InvalidInput)?;
    let mut from = std::fs::File::open(library)?;
    for _ in 0..100 {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let mut own = std::ffi::OsString::from(format!(".{}-{number}.", std::process::id()));
        own.push(name);
        let path = folder.join(own);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(mut to) => {
                let copy = Copy(path);
                std::io::copy(&mut from, &mut to)?;
                return Ok(copy);
            }
            // Left over from a process of the same number that was ended.
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
    Err(Error::from(ErrorKind::AlreadyExists))
}
