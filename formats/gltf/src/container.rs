//! The container: JSON alone or with a binary chunk (GLB), and what the file demands of its readers.

use gltf::json;
use serde_json::Value;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::Fallible;

/// Extensions whose meaning is part of the conversion.
pub(crate) const EXTENSIONS: [&str; 12] = [
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// A parsed file.
pub(crate) struct Container<'b> {
    /// Checked: indices lead somewhere.
    pub root: json::Root,
    /// The same as it is written, for what the typed form does not have.
    pub raw: Value,
    /// The binary chunk.
    pub binary: Option<&'b [u8]>,
    /// Extensions in use that are not known.
    pub unknown: Vec<String>,
}

/// Parses the bytes of a `.gltf` or `.glb` file.
pub(crate) fn parse(bytes: &[u8]) -> Fallible<Container<'_>> {
    let (text, binary) = if bytes.starts_with(b"glTF") {
        chunks(bytes)?
    } else {
        (bytes, None)
    };
    let mut raw: Value =
        serde_json::from_slice(text).map_err(|e| format!("is no JSON that can be read: {e}"))?;
    let names = |raw: &Value, key: &str| -> Vec<String> {
        let all = raw.get(key).and_then(Value::as_array);
        let all = all.into_iter().flatten().filter_map(Value::as_str);
        all.map(str::to_owned).collect()
    };
    let unknown = |names: Vec<String>| -> Vec<String> {
        let known = |n: &String| EXTENSIONS.contains(&n.as_str());
        names.into_iter().filter(|n| !known(n)).collect()
    };
    let required = unknown(names(&raw, "extensionsRequired"));
    if !required.is_empty() {
        return Err(format!(
            "requires the extension{} {}, which {} not supported; supported are {}",
            if required.len() > 1 { "s" } else { "" },
            required.join(", "),
            if required.len() > 1 { "are" } else { "is" },
            EXTENSIONS.join(", ")
        ));
    }
    let mut unknown = unknown(names(&raw, "extensionsUsed"));
    unknown.dedup();
    // The crate knows fewer extensions than are converted here.
    if let Some(object) = raw.as_object_mut() {
        object.remove("extensionsRequired");
    }
    let root: json::Root = json::deserialize::from_value(raw.clone())
        .map_err(|e| format!("is no glTF 2.0 that can be read: {e}"))?;
    // The crate's validation uses these indices before it checks them.
    for (i, mesh) in root.meshes.iter().enumerate() {
        let all = mesh.primitives.iter().flat_map(|p| p.attributes.values());
        if let Some(a) = all.map(|a| a.value()).find(|a| *a >= root.accessors.len()) {
            return Err(format!(
                "is damaged: meshes[{i}]: accessors[{a}] does not exist"
            ));
        }
    }
    // Whatever else it misses is an error here, not the end of the program.
    let validate = AssertUnwindSafe(|| gltf::Document::from_json(root));
    let document = catch_unwind(validate)
        .map_err(|_| "is damaged: its parts contradict each other".to_owned())?
        .map_err(|e| format!("is damaged: {e}"))?;
    Ok(Container {
        root: document.into_json(),
        raw,
        binary,
        unknown,
    })
}

/// JSON and binary chunk of a GLB file (glTF 2.0, §4.4).
fn chunks(bytes: &[u8]) -> Fallible<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| -> Fallible<u32> {
        let four = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        four.map(u32::from_le_bytes)
            .ok_or_else(|| format!("ends at byte {} within its binary header", bytes.len()))
    };
    match word(4)? {
        2 => {}
        version => return Err(format!("is GLB version {version}; version 2 can be read")),
    }
    let chunk = |at: usize| -> Fallible<(u32, &[u8])> {
        let (length, kind) = (word(at)? as usize, word(at + 4)?);
        let data = bytes.get(at + 8..).and_then(|rest| rest.get(..length));
        let data = data.ok_or_else(|| {
            format!(
                "a chunk at byte {at} has {length} bytes, but the file ends at byte {}",
                bytes.len()
            )
        })?;
        Ok((kind, data))
    };
    let (kind, text) = chunk(12)?;
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err("its first chunk is not JSON".into());
    }
    // Chunks start at multiples of four; unknown ones are skipped.
    let mut at = 20 + text.len().next_multiple_of(4);
    while at + 8 <= bytes.len() {
        let (kind, data) = chunk(at)?;
        if kind == u32::from_le_bytes(*b"BIN\0") {
            return Ok((text, Some(data)));
        }
        at += 8 + data.len().next_multiple_of(4);
    }
    Ok((text, None))
}
