//! Writing files so that a crash leaves the old one or the new one, never half of one.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::Error;

/// Links that are followed one after the other: as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Calls `write` with a new file in the folder of `path`, syncs it to the disk and renames it to `path`.
///
/// If anything fails, the new file is removed and whatever was at `path` stays. After a crash at most a
/// file `.NAME.….tmp` is left over. A symbolic link is followed. Folders, devices and pipes are refused.
pub fn write_atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), Error>,
) -> Result<(), Error> {
    let path = path.as_ref();
    let target = destination(path)?;
    let (file, temporary) = create_beside(path, &target)?;
    let guard = RemoveOnDrop(Some(temporary));
    let mut buffered = BufWriter::with_capacity(1 << 16, file);
    write(&mut buffered)?;
    let io = |source| Error::io(path, "cannot write: ", source);
    let file = buffered.into_inner().map_err(|e| io(e.into_error()))?;
    file.sync_all().map_err(io)?;
    drop(file);
    guard
        .rename_to(&target)
        .map_err(|source| Error::io(path, "cannot rename the finished file: ", source))?;
    sync_folder(&target);
    Ok(())
}

/// The file that writing to `path` would replace: where links lead to, whether there is a file yet or not.
///
/// # Errors
/// If it is a folder, a device or a pipe, or a link that leads to itself.
pub fn destination(path: impl AsRef<Path>) -> Result<PathBuf, Error> {
    let path = path.as_ref();
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(Error::invalid(path, "is a folder, not a file")),
        Ok(found) if !found.is_file() => {
            return Err(Error::invalid(path, "is a device or a pipe, not a file"));
        }
        Ok(_) => {
            return std::fs::canonicalize(path).map_err(|source| Error::io(path, "", source));
        }
        Err(_) => {}
    }
    let mut missing = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match std::fs::read_link(&missing) {
            Ok(next) => missing = folder_of(&missing).join(next),
            // Where the folder is missing, too, making the file will say so.
            Err(_) => {
                return Ok(
                    match (folder_of(&missing).canonicalize(), missing.file_name()) {
                        (Ok(folder), Some(name)) => folder.join(name),
                        _ => missing,
                    },
                );
            }
        }
    }
    Err(Error::invalid(path, "is a link that leads to itself"))
}

/// Removes what writers of `path` left that were ended while they wrote it.
///
/// A temporary file's name has the number of its process, and files of processes that run stay. Where that cannot be told, all
/// stay. Nothing is reported: it is only tidying.
pub fn remove_leftovers(path: impl AsRef<Path>) {
    let processes = Path::new("/proc");
    let Ok(target) = destination(path) else {
        return;
    };
    let (Some(name), Ok(files)) = (target.file_name(), std::fs::read_dir(folder_of(&target)))
    else {
        return;
    };
    if !processes.join(std::process::id().to_string()).exists() {
        return;
    }
    let prefix = format!(".{}.", shown(name));
    for file in files.flatten() {
        let name = file.file_name().to_string_lossy().into_owned();
        let middle = name
            .strip_prefix(&prefix)
            .and_then(|n| n.strip_suffix(".tmp"));
        let numbers = middle.and_then(|m| m.split_once('-'));
        if let Some((process, count)) = numbers
            && process.parse::<u32>().is_ok()
            && count.parse::<u32>().is_ok()
            && !processes.join(process).exists()
        {
            let _ = std::fs::remove_file(file.path());
        }
    }
}

/// What a temporary file's name has of the target's: long names stay within the 255 bytes that file systems have.
fn shown(name: &std::ffi::OsStr) -> String {
    name.to_string_lossy().chars().take(40).collect()
}

/// A new file whose name no other process and no other thread uses.
fn create_beside(path: &Path, target: &Path) -> Result<(File, PathBuf), Error> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let Some(name) = target.file_name() else {
        return Err(Error::invalid(path, "is not the name of a file"));
    };
    let folder = folder_of(target);
    loop {
        let mut temporary = std::ffi::OsString::from(".");
        let shown = shown(name);
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        temporary.push(format!("{shown}.{}-{number}.tmp", std::process::id()));
        let temporary = folder.join(temporary);
        match OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary)
        {
            Ok(file) => return Ok((file, temporary)),
            // Left over from a crashed process with the same number.
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) if e.kind() == ErrorKind::NotFound => {
                return Err(Error::invalid(
                    path,
                    format!("the folder {folder:?} does not exist"),
                ));
            }
            Err(source) => {
                return Err(Error::io(
                    path,
                    "cannot create a file in its folder: ",
                    source,
                ));
            }
        }
    }
}

/// The folder that a file is in.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The rename itself must survive a power cut. Not all systems can sync folders; the file is safe anyway.
fn sync_folder(target: &Path) {
    if let Ok(folder) = File::open(folder_of(target)) {
        let _ = folder.sync_all();
    }
}

/// Removes the temporary file unless it has become the real one.
struct RemoveOnDrop(Option<PathBuf>);

impl RemoveOnDrop {
    fn rename_to(mut self, target: &Path) -> std::io::Result<()> {
        if let Some(temporary) = &self.0 {
            std::fs::rename(temporary, target)?;
        }
        self.0 = None;
        Ok(())
    }
}

impl Drop for RemoveOnDrop {
    fn drop(&mut self) {
        if let Some(temporary) = &self.0 {
            let _ = std::fs::remove_file(temporary);
        }
    }
}

/// Writes bytes, for writers that make them in one piece.
pub(crate) fn write_all(
    file: &mut BufWriter<File>,
    path: &Path,
    bytes: &[u8],
) -> Result<(), Error> {
    file.write_all(bytes)
        .map_err(|source| Error::io(path, "cannot write: ", source))
}
