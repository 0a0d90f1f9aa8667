//! What is in an EXR image.

use super::Report;
use crate::failure::{Outcome, input};
use resolvent_image::{ChannelInfo, ExrInfo};
use serde_json::json;
use std::fmt::Write;
use std::path::Path;

/// Reads the header of `path`.
pub fn report(path: &Path) -> Outcome<Report> {
    let info = ExrInfo::read(path).map_err(input)?;
    let layers = layers(&info.channels);
    let mut text = format!(
        "{}: OpenEXR image, {} x {} pixels",
        path.display(),
        info.width,
        info.height
    );
    if (info.full, info.origin) != ([info.width, info.height], [0, 0]) {
        let [x, y] = info.origin;
        let [w, h] = info.full;
        let _ = write!(text, ", a part of {w} x {h} from ({x}, {y})");
    }
    let _ = writeln!(text, ", compression {}", info.compression);
    for (name, channels) in &layers {
        let shown = if name.is_empty() { "picture" } else { name };
        let channels: Vec<_> = channels.iter().map(|c| c.name.as_str()).collect();
        let _ = writeln!(text, "  layer {shown:<12} {}", channels.join(" "));
    }
    for (key, value) in &info.metadata {
        let _ = writeln!(text, "  {key:<18} {}", value.escape_debug());
    }
    let json = json!({
        "file": path,
        "kind": "exr",
        "size": [info.width, info.height],
        "origin": info.origin,
        "full_size": info.full,
        "compression": info.compression,
        "layers": layers.iter().map(|(name, channels)| json!({
            "name": name,
            "channels": channels.iter().map(|c| json!({"name": c.name, "type": c.kind})).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "metadata": info.metadata,
    });
    Ok(Report { json, text })
}

/// Channels by layer, in the order of the file.
fn layers(channels: &[ChannelInfo]) -> Vec<(&str, Vec<&ChannelInfo>)> {
    let mut out: Vec<(&str, Vec<&ChannelInfo>)> = Vec::new();
    for c in channels {
        match out.iter_mut().find(|(name, _)| *name == c.layer) {
            Some((_, list)) => list.push(c),
            None => out.push((&c.layer, vec![c])),
        }
    }
    out
}
