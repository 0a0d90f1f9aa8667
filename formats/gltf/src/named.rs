//! The files that a model consists of besides its own.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::buffers::relative;
use crate::container;
use crate::model::MAX_FILE;

/// True if a file is a model by its name.
pub fn is_model(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    matches!(extension.as_deref(), Some("gltf" | "glb"))
}

/// The files that a model's buffers and images are in, whether they are there or not. A model that cannot be read names none.
pub fn named_files(path: impl AsRef<Path>) -> Vec<PathBuf> {
    let path = path.as_ref();
    let folder = path.parent().unwrap_or(Path::new(""));
    let Some(text) = json(path) else {
        return Vec::new();
    };
    let Ok(container) = container::parse(&text) else {
        return Vec::new();
    };
    let buffers = container.root.buffers.iter().filter_map(|b| b.uri.as_ref());
    let images = container.root.images.iter().filter_map(|i| i.uri.as_ref());
    let files = buffers
        .chain(images)
        .filter(|uri| !uri.starts_with("data:"));
    let mut out: Vec<_> = files
        .filter_map(|uri| Some(folder.join(relative(uri).ok()?)))
        .collect();
    out.sort();
    out.dedup();
    out
}

/// The JSON of a model, without the binary chunk that may follow it in a GLB file (glTF 2.0, §4.4).
fn json(path: &Path) -> Option<Vec<u8>> {
    let mut file = File::open(path).ok()?;
    if !file.metadata().ok()?.is_file() {
        return None;
    }
    let mut text = Vec::new();
    file.by_ref().take(20).read_to_end(&mut text).ok()?;
    let mut length = MAX_FILE;
    if text.starts_with(b"glTF") {
        length = u32::from_le_bytes(text.get(12..16)?.try_into().ok()?).into();
        text.clear();
    }
    file.take(length).read_to_end(&mut text).ok()?;
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_and_images() {
        let folder = std::env::temp_dir().join(format!("resolvent-named-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let model = folder.join("m.gltf");
        let text = r#"{"asset": {"version": "2.0"},
            "buffers": [{"uri": "a%20b.bin", "byteLength": 4}, {"uri": "data:x;base64,AAAA", "byteLength": 3}],
            "images": [{"uri": "skin.png"}, {"uri": "skin.png"}]}"#;
        std::fs::write(&model, text).unwrap();
        assert_eq!(
            named_files(&model),
            ["a b.bin", "skin.png"].map(|f| folder.join(f))
        );
        let length = (text.len() as u32).to_le_bytes();
        let glb = [b"glTF\x02\0\0\0\xff\xff\0\0", &length[..], b"JSON"].concat();
        let glb = [&glb, text.as_bytes(), b"\x09\0\0\0BIN\0what is it"].concat();
        std::fs::write(folder.join("m.glb"), glb).unwrap();
        assert_eq!(named_files(folder.join("m.glb")), named_files(&model));
        assert!(named_files("/dev/zero").is_empty());
        std::fs::write(&model, &text[..50]).unwrap();
        assert!(named_files(&model).is_empty() && is_model(&model) && !is_model(&folder));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
