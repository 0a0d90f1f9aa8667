//! Converted stages, kept as long as nothing that they were made of changes.
//!
//! An entry is a folder, named by a hash of the stage's path, the options and the converter's fingerprint. It holds the scene with its
//! files, what the converter said, and the list of all layers that were read with hashes of their bytes: it counts only while
//! all of these are the same. So there is one entry for each stage and choice of options, however often the stage changes.

use crate::failure::{Outcome, failed};
use blake2::digest::consts::U16;
use blake2::{Blake2b, Digest};
use serde_json::Value;
use std::ffi::OsString;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// The scene of an entry.
pub const SCENE: &str = "scene.json";
/// The layers that it was made of.
pub const LAYERS: &str = "layers.json";
/// All that was lost.
pub const REPORT: &str = "report.json";
/// What the converter said.
const LOSSES: &str = "losses.txt";

/// The place of one conversion in the cache.
pub struct Entry {
    folder: PathBuf,
    /// Where it is made.
    draft: PathBuf,
}

impl Entry {
    /// The place of a stage's conversion with these options by this converter.
    pub fn new(stage: &Path, options: &[OsString], converter: &str) -> Outcome<Self> {
        let stage = std::path::absolute(stage).map_err(failed)?;
        let mut key = Blake2b::<U16>::new();
        let parts = [stage.as_os_str(), converter.as_ref()];
        for part in parts
            .into_iter()
            .chain(options.iter().map(|o| o.as_os_str()))
        {
            // The length first, so that no two lists of parts look alike.
            key.update((part.len() as u64).to_le_bytes());
            key.update(part.as_bytes());
        }
        let name = hex(&key.finalize());
        let cache = cache();
        Ok(Self {
            draft: cache.join(format!("{name}.{}.tmp", std::process::id())),
            folder: cache.join(name),
        })
    }

    /// The scene and what was said of it, if nothing has changed since.
    pub fn find(&self) -> Option<(PathBuf, String)> {
        let layers = std::fs::read(self.folder.join(LAYERS)).ok()?;
        let layers: Value = serde_json::from_slice(&layers).ok()?;
        let same = layers.as_object()?.iter().all(|(path, hash)| {
            std::fs::read(path).is_ok_and(|bytes| Some(hash_of(&bytes).as_str()) == hash.as_str())
        });
        let scene = self.folder.join(SCENE);
        let losses = std::fs::read_to_string(self.folder.join(LOSSES)).ok()?;
        (same && scene.is_file()).then_some((scene, losses))
    }

    /// The files that the kept conversion was made of.
    pub fn layers(&self) -> Vec<PathBuf> {
        layers(&self.folder)
    }

    /// A folder to convert into.
    pub fn begin(&self) -> Outcome<&Path> {
        let _ = std::fs::remove_dir_all(&self.draft);
        self.remove_leftovers();
        std::fs::create_dir_all(&self.draft)
            .map_err(|e| failed(format!("{}: {e}", self.draft.display())))?;
        Ok(&self.draft)
    }

    /// Removes what processes that were ended have begun and left.
    fn remove_leftovers(&self) {
        let (Some(name), Ok(all)) = (self.folder.file_name(), std::fs::read_dir(cache())) else {
            return;
        };
        let prefix = format!("{}.", name.to_string_lossy());
        let running = Path::new("/proc");
        if !running.join(std::process::id().to_string()).exists() {
            return;
        }
        for found in all.flatten() {
            let name = found.file_name().to_string_lossy().into_owned();
            let process = name.strip_prefix(&prefix);
            let process = process.and_then(|p| p.strip_suffix(".tmp")?.parse::<u32>().ok());
            if process.is_some_and(|p| !running.join(p.to_string()).exists()) {
                let _ = std::fs::remove_dir_all(found.path());
            }
        }
    }

    /// Forgets what was begun.
    pub fn discard(&self) {
        let _ = std::fs::remove_dir_all(&self.draft);
    }

    /// Keeps what was begun, and returns its scene.
    pub fn keep(&self, losses: &str) -> Outcome<PathBuf> {
        let save = || {
            std::fs::write(self.draft.join(LOSSES), losses)?;
            // The old one goes; another process may have made the same in the meantime.
            let _ = std::fs::remove_dir_all(&self.folder);
            std::fs::rename(&self.draft, &self.folder)
        };
        match save() {
            Ok(()) => Ok(self.folder.join(SCENE)),
            Err(_) if self.find().is_some() => {
                self.discard();
                Ok(self.folder.join(SCENE))
            }
            Err(e) => Err(failed(format!("{}: {e}", self.folder.display()))),
        }
    }
}

/// The files that the conversion in a folder was made of, as far as it got.
pub fn layers(folder: &Path) -> Vec<PathBuf> {
    let layers = std::fs::read(folder.join(LAYERS)).ok();
    let layers = layers.and_then(|l| serde_json::from_slice::<Value>(&l).ok());
    let layers = layers.as_ref().and_then(Value::as_object);
    layers.map_or_else(Vec::new, |all| all.keys().map(PathBuf::from).collect())
}

/// The folder of all entries.
fn cache() -> PathBuf {
    let given = |name| std::env::var_os(name).filter(|v: &OsString| !v.is_empty());
    given("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(given("HOME")?).join(".cache")))
        .unwrap_or_else(std::env::temp_dir)
        .join("resolvent/usd")
}

/// BLAKE2b with 16 bytes, as the converter writes it.
fn hash_of(bytes: &[u8]) -> String {
    hex(&Blake2b::<U16>::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
