//! The files that a model consists of besides its own.

use std::path::{Path, PathBuf};

use crate::buffers::relative;
use crate::container;

/// True if a file is a model by its name.
pub fn is_model(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    matches!(extension.as_deref(), Some("gltf" | "glb"))
}

/// The files that a model's buffers and images are in, whether they are there or not. A model that cannot be read names none.
pub fn named_files(path: impl AsRef<Path>) -> Vec<PathBuf> {
    let path = path.as_ref();
    let folder = path.parent().unwrap_or(Path::new(""));
    let Ok(bytes) = std::fs::read(path) else {
        return Vec::new();
    };
    let Ok(container) = container::parse(&bytes) else {
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
        std::fs::write(&model, &text[..50]).unwrap();
        assert!(named_files(&model).is_empty() && is_model(&model) && !is_model(&folder));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
