//! What is in an OpenVDB file.

use super::Report;
use crate::failure::{Outcome, input};
use crate::output::bytes;
use crate::volume::{self, Measures};
use resolvent_vdb::{File, GridClass, GridInfo, Statistics};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Reads the file at `path`, its voxels included.
pub fn report(path: &Path) -> Outcome<Report> {
    let file = File::open(path).map_err(input)?;
    let [major, minor] = file.library();
    let mut text = format!(
        "{}: OpenVDB file, format {}, written by library {major}.{minor}, {}\n",
        path.display(),
        file.version(),
        bytes(file.size())
    );
    let mut grids = Vec::new();
    for info in file.grids() {
        let (json, lines) = grid(&file, info);
        grids.push(json);
        text += &lines;
    }
    if file.grids().is_empty() {
        text += "no grids\n";
    }
    if let Some(damage) = file.damage() {
        let _ = writeln!(text, "more grids may follow, but {}", damage.reason);
    }
    let json = json!({
        "file": path,
        "kind": "vdb",
        "bytes": file.size(),
        "format": file.version(),
        "library": file.library(),
        "grids": grids,
        "damage": file.damage().map(ToString::to_string),
    });
    Ok(Report { json, text })
}

/// One grid.
fn grid(file: &File, info: &GridInfo) -> (Value, String) {
    let kind = info
        .value_type
        .map_or(info.tree_type.as_str(), |t| t.name());
    let half = if info.saved_as_half {
        ", stored as half"
    } else {
        ""
    };
    let mut json = json!({
        "name": info.name,
        "unique_name": info.unique_name,
        "type": kind,
        "class": info.class.to_string(),
        "saved_as_half": info.saved_as_half,
        "compression": info.compression.to_string(),
        "instance_of": info.instance_of,
        "file_range": info.range,
    });
    let mut text = format!(
        "grid {} ({kind}{half}, {}, compression {})\n",
        info.unique_name.escape_debug(),
        info.class,
        info.compression
    );
    let statistics = match file.statistics(info, &volume::Rayon) {
        Ok(s) => s,
        Err(refused) => {
            json["refused"] = json!(refused.reason);
            let _ = writeln!(text, "  cannot be read: {}", refused.reason);
            return (json, text);
        }
    };
    describe(info, &statistics, &mut json, &mut text);
    if volume::is_scalar(info) && info.class != GridClass::LevelSet {
        match volume::measure(file, info) {
            Ok(Some(m)) => thickness(&m, &mut json, &mut text),
            Ok(None) => {}
            Err(e) => {
                json["refused"] = json!(e.reason);
                let _ = writeln!(text, "  cannot be read: {}", e.reason);
            }
        }
    }
    (json, text)
}

fn describe(info: &GridInfo, s: &Statistics, json: &mut Value, text: &mut String) {
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<18} {value}");
    };
    let voxel_size = info.transform.as_ref().map(|t| t.voxel_size());
    let leaf_bytes = volume::value_bytes(info) * 512 * s.node_counts[0] as u64;
    row("active voxels", s.active_voxels.to_string());
    row(
        "values",
        match (&s.min, &s.max) {
            (Some(min), Some(max)) => format!("{} to {}", numbers(min), numbers(max)),
            _ => "none".into(),
        },
    );
    if s.not_a_number + s.infinite > 0 {
        row(
            "bad values",
            format!("{} not a number, {} infinite", s.not_a_number, s.infinite),
        );
    }
    let world = match (&info.transform, s.active_bbox) {
        (Some(t), Some(b)) => Some(volume::world_box(t, b)),
        _ => None,
    };
    if let (Some([lo, hi]), Some(world), Some(t)) = (s.active_bbox, world, &info.transform) {
        row("bounds in index", format!("{lo:?} to {hi:?}"));
        row(
            "bounds in world",
            format!("{} to {}", point(world[0]), point(world[1])),
        );
        row("transform", t.map_type.clone());
    }
    if let Some(v) = voxel_size {
        row("voxel size", point(v));
    }
    row(
        "memory",
        format!("{} in {} leaves", bytes(leaf_bytes), s.node_counts[0]),
    );
    json["active_voxels"] = json!(s.active_voxels);
    json["min"] = json!(s.min);
    json["max"] = json!(s.max);
    json["not_a_number"] = json!(s.not_a_number);
    json["infinite"] = json!(s.infinite);
    json["bounds_index"] = json!(s.active_bbox);
    json["bounds_world"] = json!(world);
    json["voxel_size"] = json!(voxel_size);
    json["transform"] = info.transform.as_ref().map_or(
        Value::Null,
        |t| json!({"type": t.map_type, "index_to_world": t.index_to_world}),
    );
    json["nodes"] = json!(s.node_counts);
    json["memory_bytes"] = json!(leaf_bytes);
}

fn thickness(m: &Measures, json: &mut Value, text: &mut String) {
    let [x, y, z] = m.lines;
    let _ = writeln!(
        text,
        "  optical thickness  x {x:.4}, y {y:.4}, z {z:.4} times the density scale, through {}",
        point(m.centre)
    );
    json["optical_thickness"] = json!({
        "x": x, "y": y, "z": z,
        "through_world": m.centre,
        "density_scale": 1.0,
    });
}

fn numbers(all: &[f64]) -> String {
    match all {
        [one] => format!("{one:.6}"),
        _ => point_of(all),
    }
}

fn point(p: [f64; 3]) -> String {
    point_of(&p)
}

fn point_of(p: &[f64]) -> String {
    let parts: Vec<_> = p.iter().map(|x| short(*x)).collect();
    format!("[{}]", parts.join(", "))
}

/// Six significant digits at the most.
pub fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = (5 - x.abs().log10().floor() as i32).clamp(0, 17) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
