//! Files that a render depends on, and whether they have changed.

use resolvent_engine::plugin::Registry;
use resolvent_scene::{PluginBlock, Scene, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What changes when a file does: its device and number there, size, and time of its last change in seconds and nanoseconds.
pub type Stamp = [i64; 5];

/// The stamp of a file; `None` if there is no such file.
pub fn stamp(path: &Path) -> Option<Stamp> {
    let m = std::fs::metadata(path).ok().filter(|m| m.is_file())?;
    Some([
        m.dev() as i64,
        m.ino() as i64,
        m.size() as i64,
        m.mtime(),
        m.mtime_nsec(),
    ])
}

struct Known {
    stamp: Option<Stamp>,
    /// Of the last render that read it.
    round: u64,
}

/// All files that are watched.
pub struct Files {
    known: BTreeMap<PathBuf, Known>,
    round: u64,
    spared: BTreeSet<PathBuf>,
}

impl Files {
    /// None yet. Files that a render writes are spared: it would never end.
    pub fn sparing<'p>(written: impl Iterator<Item = &'p Path>) -> Self {
        Self {
            known: BTreeMap::new(),
            round: 0,
            spared: written.map(whole).collect(),
        }
    }

    /// Another render begins.
    pub fn next_round(&mut self) {
        self.round += 1;
    }

    /// The render in progress reads a file, which it found in this state.
    pub fn note(&mut self, path: PathBuf, stamp: Option<Stamp>) {
        if !self.spared.contains(&whole(&path)) {
            let round = self.round;
            self.known.insert(path, Known { stamp, round });
        }
    }

    /// Files that the last render did not read are not watched any more.
    pub fn forget_earlier_rounds(&mut self) {
        self.known.retain(|_, k| k.round == self.round);
    }

    /// Removes what an ended process has left beside these files: hidden files whose name begins with its mark.
    pub fn sweep(&self, mark: &str) {
        let folders: BTreeSet<_> = self.known.keys().filter_map(|p| p.parent()).collect();
        for folder in folders {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            for left in entries.filter(|e| e.file_name().to_string_lossy().starts_with(mark)) {
                let _ = std::fs::remove_file(left.path());
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.known.values().filter(|k| k.stamp.is_some()).count()
    }

    /// One that has changed since the last look, if any.
    pub fn changed(&mut self) -> Option<PathBuf> {
        let mut changed = None;
        for (path, known) in &mut self.known {
            let now = stamp(path);
            if now != known.stamp {
                known.stamp = now;
                changed = changed.or_else(|| Some(path.clone()));
            }
        }
        changed
    }
}

/// A path by which the same file is known wherever it is named.
fn whole(path: &Path) -> PathBuf {
    path.canonicalize()
        .or_else(|_| std::path::absolute(path))
        .unwrap_or_else(|_| path.to_path_buf())
}

/// The files that a scene depends on besides its own, whether they are there or not: whatever a text in it may name.
pub fn of_scene(scene: &Scene, registry: &Registry) -> BTreeSet<PathBuf> {
    let mut out = BTreeSet::new();
    for path in crate::info::files_of_parts(scene) {
        if resolvent_gltf::is_model(&path) {
            out.extend(resolvent_gltf::named_files(&path));
        }
        match path.to_string_lossy().split_once("<UDIM>") {
            Some((before, after)) => out.extend(tiles(Path::new(before), after)),
            None => drop(out.insert(path)),
        }
    }
    let mut texts = BTreeSet::new();
    let materials = scene.materials.values().map(|m| &m.block);
    let media = scene.media.values().map(|m| &m.block);
    for block in materials.chain(media).chain([&scene.integrator]) {
        of_block(block, &mut texts);
    }
    // Which parameters are files, and which are names of plugins, only the plugins know; and those may not even load.
    for text in texts {
        out.insert(scene.resolve(text));
        out.extend(registry.places(text));
    }
    out
}

fn of_block<'b>(block: &'b PluginBlock, texts: &mut BTreeSet<&'b str>) {
    texts.insert(&block.plugin);
    for param in block.params.values() {
        of_value(&param.value, texts);
    }
}

fn of_value<'b>(value: &'b Value, texts: &mut BTreeSet<&'b str>) {
    match value {
        Value::Text(text) => drop(texts.insert(text)),
        Value::List(all) => all.iter().for_each(|v| of_value(v, texts)),
        Value::Object(block) => of_block(block, texts),
        Value::Bool(_) | Value::Number(_) | Value::Texture(_) => {}
    }
}

/// The files of a tiled image; one that is added later is seen when the scene is read again.
fn tiles(before: &Path, after: &str) -> Vec<PathBuf> {
    let folder = before.parent().filter(|p| !p.as_os_str().is_empty());
    let prefix = before.file_name().unwrap_or_default().to_string_lossy();
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new(".")));
    let paths = entries.into_iter().flatten().flatten().map(|e| e.path());
    let is_tile = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(&*prefix) && name.ends_with(after)
    };
    paths.filter(is_tile).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_engine::plugin::Registry;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("resolvent-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        path
    }

    #[test]
    fn changes_are_seen_once() {
        let at = folder("changes");
        let (a, out) = (at.join("a"), at.join("out"));
        let mut files = Files::sparing([out.as_path()].into_iter());
        files.next_round();
        files.note(a.clone(), stamp(&a));
        std::fs::write(&out, "").unwrap();
        files.note(out.clone(), None);
        assert_eq!(
            (files.len(), files.changed()),
            (0, None),
            "outputs are spared"
        );
        // Appears, grows, is replaced by one of the same size, goes.
        std::fs::write(&a, "1").unwrap();
        assert_eq!(files.changed(), Some(a.clone()));
        assert_eq!(files.changed(), None);
        std::fs::write(&a, "22").unwrap();
        assert_eq!(files.changed(), Some(a.clone()));
        std::fs::write(at.join("b"), "33").unwrap();
        std::fs::rename(at.join("b"), &a).unwrap();
        assert_eq!(files.changed(), Some(a.clone()));
        std::fs::remove_file(&a).unwrap();
        assert_eq!(files.changed(), Some(a.clone()));
        files.next_round();
        files.forget_earlier_rounds();
        std::fs::write(&a, "1").unwrap();
        assert_eq!(files.changed(), None);
        std::fs::remove_dir_all(&at).unwrap();
    }

    #[test]
    fn what_a_scene_names() {
        let at = folder("names");
        std::fs::write(at.join("skin.1001.png"), "").unwrap();
        let scene = r#"{"resolvent": 1,
            "camera": {"type": "perspective", "origin": [0, 0, 4], "target": [0, 0, 0], "fov_x_deg": 40},
            "film": {"resolution": [8, 8]}, "integrator": {"plugin": "./own.so"},
            "lights": [{"type": "environment", "image": "sky.exr"}],
            "textures": {"skin": {"file": "skin.<UDIM>.png"}},
            "materials": {"m": {"plugin": "mix", "params": {"a": "diffuse", "b": {"plugin": "gold"}}}},
            "media": {"c": {"plugin": "vdb", "params": {"file": "cloud.vdb"}}},
            "shapes": [{"type": "ply", "file": "sub/mesh.ply", "material": "m"}]}"#;
        let scene = Scene::parse(scene.as_bytes(), at.join("s.json")).unwrap();
        let plugins = at.join("plugins");
        let found = of_scene(&scene, &Registry::new(std::slice::from_ref(&plugins)));
        for name in [
            "own.so",
            "sky.exr",
            "skin.1001.png",
            "cloud.vdb",
            "sub/mesh.ply",
        ] {
            assert!(found.contains(&at.join(name)), "{name}: {found:?}");
        }
        for name in ["bsdf_mix", "bsdf_diffuse", "bsdf_gold", "medium_vdb"] {
            let file = plugins.join(format!(
                "libresolvent_{name}{}",
                std::env::consts::DLL_SUFFIX
            ));
            assert!(found.contains(&file), "{name}: {found:?}");
        }
        std::fs::remove_dir_all(&at).unwrap();
    }
}
