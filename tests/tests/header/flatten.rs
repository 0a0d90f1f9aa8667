//! From the Rust sources of the ABI to what cbindgen reads, and from what it writes to what C authors read.

use resolvent_api::closure::CLOSURE_BYTES;
use std::collections::BTreeMap;
use std::path::Path;

/// The files that hold the ABI.
const FILES: [&str; 13] = [
    "abi.rs",
    "abi/params.rs",
    "abi/scattering.rs",
    "abi/scene.rs",
    "closure.rs",
    "operator.rs",
    "medium.rs",
    "phase.rs",
    "surface.rs",
    "vertex.rs",
    "spectrum.rs",
    "math/aabb.rs",
    "math/frame.rs",
];

/// Constants that C gets from the preamble, or has no use for.
const DROPPED: [&str; 5] = ["MAGIC", "SYMBOL", "LANES", "TABLE", "WITH_MEDIA"];

/// All structures, and constants named by their path.
pub fn sources(folder: &Path, types: &[(&str, &str)]) -> String {
    let mut out = String::new();
    for file in FILES {
        let path = folder.join(file);
        let text = std::fs::read_to_string(&path);
        let text = text.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for item in items(&text) {
            out.push_str(&translate(&item, types));
        }
    }
    let closure = format!("[u64; {}]", CLOSURE_BYTES / 8);
    // C warns of pointers to arrays whose elements are const on one side only; pointers to structures are plain.
    for (rust, c) in [
        ("*const [f32; 2]", "*const Float2"),
        ("*mut [f32; 2]", "*mut Float2"),
        ("*mut [f32; 4]", "*mut Float4"),
        ("*const [u32; 2]", "*const Uint2"),
        // cbindgen does not compute lengths.
        ("[MaybeUninit<u64>; CLOSURE_BYTES / 8]", &closure),
    ] {
        out = out.replace(rust, c);
    }
    out
}

/// An item of a file with its comments and attributes.
struct Item {
    docs: Vec<String>,
    lines: Vec<String>,
}

/// The items at the top level of a file that is formatted as rustfmt does.
fn items(text: &str) -> Vec<Item> {
    let (mut out, mut docs) = (Vec::new(), Vec::new());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.starts_with("///") || line.starts_with("#[") {
            docs.push(line.to_owned());
            continue;
        }
        if line.starts_with("pub ") {
            let mut item = vec![line.to_owned()];
            let ends = |l: &str| l == "}" || l.ends_with(';') && !l.starts_with(' ');
            while !ends(item.last().map_or("", String::as_str)) {
                match lines.next() {
                    Some(l) => item.push(l.to_owned()),
                    None => break,
                }
            }
            out.push(Item {
                docs: std::mem::take(&mut docs),
                lines: item,
            });
        }
        docs.clear();
    }
    out
}

/// What cbindgen gets of an item.
fn translate(item: &Item, types: &[(&str, &str)]) -> String {
    let first = item.lines[0].as_str();
    let word = |prefix: &str| {
        let rest = first.strip_prefix(prefix)?;
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        Some(&rest[..end])
    };
    let whole = || {
        let docs = item.docs.iter().filter(|d| !d.contains("derive"));
        let lines: Vec<&str> = docs.chain(&item.lines).map(String::as_str).collect();
        lines.join("\n") + "\n\n"
    };
    let known = |name: &str| types.iter().any(|(rust, _)| *rust == name);
    if let Some(name) = word("pub struct ").or(word("pub type ")) {
        return if known(name) { whole() } else { String::new() };
    }
    if let Some(name) = word("pub enum ").or(word("pub mod ")) {
        return constants(&upper(name), &item.lines[1..]);
    }
    if let Some(name) = word("pub const ") {
        if first.contains(" fn ") || DROPPED.contains(&name) {
            return String::new();
        }
        return whole().replacen("pub const ", "pub const RESOLVENT_", 1);
    }
    String::new()
}

/// The constants of a module, or the variants of an enum.
fn constants(of: &str, body: &[String]) -> String {
    let mut out = String::new();
    for line in body.iter().map(|l| l.trim()) {
        if line.starts_with("///") {
            out.push_str(line);
            out.push('\n');
        } else if let Some(rest) = line.strip_prefix("pub const ") {
            out.push_str(&format!("pub const RESOLVENT_{of}_{rest}\n"));
        } else if let Some((name, value)) = line.trim_end_matches(',').split_once(" = ") {
            out.push_str(&format!(
                "pub const RESOLVENT_{of}_{}: u32 = {value};\n",
                upper(name)
            ));
        }
    }
    out
}

/// `PluginKind` and `param_flags` as `PLUGIN_KIND` and `PARAM_FLAGS`.
fn upper(name: &str) -> String {
    let mut out = String::new();
    for (i, c) in name.chars().enumerate() {
        if i > 0 && c.is_uppercase() {
            out.push('_');
        }
        out.extend(c.to_uppercase());
    }
    out
}

/// Comments as C authors read them: names of C in place of Rust's links, short ones in one line.
pub fn comments(text: &str, types: &[(&str, &str)], given: &[(&str, &str)]) -> String {
    let names: BTreeMap<&str, &str> = types.iter().chain(given).copied().collect();
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("[`") {
        let (before, link) = rest.split_at(at);
        out.push_str(before);
        let Some(end) = link.find("`]") else {
            break;
        };
        out.push_str(&in_c(&link[2..end], &names, text));
        rest = &link[end + 2..];
        // The target of a link with a text of its own.
        if rest.starts_with('(')
            && let Some(close) = rest.find(')')
        {
            rest = &rest[close + 1..];
        }
    }
    out.push_str(rest);
    for (rust, c) in names {
        let (size, sizeof) = (
            format!("size_of::<{rust}>()"),
            format!("sizeof(resolvent_{c})"),
        );
        out = out.replace(&size, &sizeof);
    }
    joined(&out)
}

/// Comments with their delimiters on the lines of the text.
fn joined(text: &str) -> String {
    let mut out = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.trim() != "/*" {
            out.push_str(line);
            out.push('\n');
            continue;
        }
        let indent = line.trim_end_matches("/*");
        let mut open = "/* ";
        while let Some(text) = lines.next() {
            out.push_str(&format!("{indent}{open}{}", text.trim()));
            open = " * ";
            if lines.next_if(|l| l.trim() == "*/").is_some() {
                out.push_str(" */\n");
                break;
            }
            out.push('\n');
        }
    }
    out
}

/// `crate::abi::HostTable::fail` as `resolvent_host.fail`, `param_flags::MIN` as `RESOLVENT_PARAM_FLAGS_MIN`, `ParamKind` as
/// `RESOLVENT_PARAM_KIND_*`.
fn in_c(path: &str, names: &BTreeMap<&str, &str>, header: &str) -> String {
    let parts: Vec<&str> = path
        .split("::")
        .filter(|p| !matches!(*p, "crate" | "super" | "operator" | "medium" | "surface"))
        .collect();
    let c = match parts[..] {
        ["Status", code] => format!("RESOLVENT_STATUS_{code}"),
        [name] if names.contains_key(name) => format!("resolvent_{}", names[name]),
        [name, field] if names.contains_key(name) => format!("resolvent_{}.{field}", names[name]),
        [constant] if constant.chars().all(|c| c.is_uppercase() || c == '_') => {
            format!("RESOLVENT_{constant}")
        }
        [name, constant] => {
            let whole = format!(
                "RESOLVENT_{}_{}",
                upper(name),
                upper(constant).replace("__", "_")
            );
            let plain = format!("RESOLVENT_{}_{constant}", upper(name));
            if header.contains(&plain) {
                plain
            } else {
                whole
            }
        }
        [name] => format!("RESOLVENT_{}_*", upper(name)),
        _ => String::new(),
    };
    let known = c.starts_with("resolvent_") || header.contains(c.trim_end_matches('*'));
    if known && !c.is_empty() {
        format!("`{c}`")
    } else {
        // What only Rust has is named as Rust names it.
        format!("`{}`", parts.join("::"))
    }
}
