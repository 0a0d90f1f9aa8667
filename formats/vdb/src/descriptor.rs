//! The descriptor of a grid, its metadata and its transform.

use std::collections::HashMap;
use std::path::Path;

use crate::encoding::{Codec, Compression, Encoding, NODE_CODES};
use crate::error::{Fault, Parsed};
use crate::grid::{GridClass, GridInfo, TreePlace};
use crate::header::Archive;
use crate::leaves;
use crate::metadata::Metadata;
use crate::reader::Reader;
use crate::source::Source;
use crate::topology::Topology;
use crate::transform::{self, Map};
use crate::value::ValueType;

/// Between a name and the number that tells grids of one name apart.
const SEPARATOR: char = '\x1e';

/// A grid before names are made unique and instances are tied to their parents.
pub(crate) struct RawGrid {
    /// The descriptor's name, with separator and number.
    full_name: String,
    /// The descriptor's name of the parent, with separator and number.
    parent: String,
    info: GridInfo,
    refusal: Option<Fault>,
}

/// Where the next descriptor starts.
pub(crate) type Next = Parsed<u64>;

/// Reads the descriptor at `position`, then the grid's metadata and transform. Beside the grid comes
/// where the next descriptor starts.
pub(crate) fn next_grid(
    source: &Source,
    archive: &Archive,
    reader: &mut Reader<'_>,
    position: u64,
) -> Parsed<(RawGrid, Next)> {
    reader.seek(position, source.len());
    let full_name = reader.string("a grid's name")?;
    let tree_name = reader.string("a grid's type")?;
    let parent = reader.string("a grid's instance parent")?;
    let at = reader.position();
    let offsets = [(); 3].map(|()| reader.i64("a grid's descriptor"));
    let [start, _, end] = offsets;
    let (mut start, mut end) = (start?, end?);
    if !archive.has_offsets {
        (start, end) = (reader.position() as i64, source.len() as i64);
    }

    // Old writers mark halves in the type's name, all mark them in the metadata.
    let (tree_type, half_name) = match tree_name.strip_suffix("_HalfFloat") {
        Some(tree) => (tree.to_owned(), true),
        None => (tree_name, false),
    };
    let name = full_name
        .split(SEPARATOR)
        .next()
        .unwrap_or_default()
        .to_owned();
    let value_type = ValueType::from_tree(&tree_type);
    let mut grid = RawGrid {
        parent,
        refusal: None,
        info: GridInfo {
            name,
            unique_name: String::new(),
            value_type,
            tree_type,
            class: GridClass::Unknown,
            saved_as_half: half_name,
            compression: Compression {
                codec: Codec::None,
                active_mask: false,
            },
            metadata: Metadata::default(),
            transform: None,
            instance_of: None,
            range: [start.max(0) as u64, end.max(0) as u64],
            refusal: None,
            tree: None,
        },
        full_name,
    };
    let place = check_offsets(start, end, reader.position(), source.len(), at);
    if let Err(fault) = place {
        grid.refusal = Some(fault.clone());
        // A grid cut short at the end of the file still tells where it ends; no descriptor follows.
        return Ok((grid, Err(fault)));
    }
    let (start, end) = (start as u64, end as u64);

    reader.seek(start, end);
    let read = describe(reader, archive, &mut grid);
    if archive.has_offsets {
        if let Err(fault) = read {
            grid.refusal = Some(fault);
        }
        return Ok((grid, Ok(end)));
    }
    let next = read.and_then(|()| pass_stream_grid(source, reader.position(), &mut grid));
    if let Err(fault) = &next {
        grid.refusal.get_or_insert_with(|| fault.clone());
    }
    let next = next.map_err(|fault| {
        let name = grid.full_name.replace(SEPARATOR, "#");
        let reason = format!(
            "the grids behind '{name}' cannot be found, as the file is a stream without offsets: {}",
            fault.reason
        );
        Fault { reason, ..fault }
    });
    Ok((grid, next))
}

fn check_offsets(start: i64, end: i64, after: u64, length: u64, at: u64) -> Parsed<()> {
    let wrong = |what: String| Err(Fault::invalid(at, what));
    if start < 0 || (start as u64) < after || start as u64 > length {
        return wrong(format!(
            "the grid is said to start at byte {start}, which cannot be"
        ));
    }
    if end < start {
        return wrong(format!(
            "the grid is said to end at byte {end}, before its start at {start}"
        ));
    }
    if end as u64 > length {
        return wrong(format!(
            "the grid is said to end at byte {end}, but the file ends at {length}; it is cut short or damaged"
        ));
    }
    Ok(())
}

/// Compression, metadata and transform, in front of the tree.
fn describe(body: &mut Reader<'_>, archive: &Archive, grid: &mut RawGrid) -> Parsed<()> {
    let info = &mut grid.info;
    let at = body.position();
    let flags = if archive.version >= NODE_CODES {
        body.u32("a grid's compression")?
    } else {
        u32::from(archive.zip)
    };
    info.compression = Compression::from_flags(flags, at)?;
    info.metadata = Metadata::read(body)?;
    info.class = GridClass::from_name(info.metadata.string("class").unwrap_or_default());
    if let Some(half) = info.metadata.bool("is_saved_as_half_float") {
        info.saved_as_half = half;
    }
    if let Some(name) = info.metadata.string("name") {
        info.name = name.to_owned();
    }
    match transform::read(body)? {
        Map::Linear(transform) => info.transform = Some(transform),
        Map::Refused(fault) => grid.refusal = Some(fault),
    }
    let start = body.position();
    let limit = info.range[1];
    match info.value_type {
        Some(kind) => {
            let encoding = Encoding {
                kind,
                half: info.saved_as_half,
                compression: info.compression,
                version: archive.version,
            };
            info.tree = Some(TreePlace {
                encoding,
                start,
                limit,
            });
        }
        None => grid.refusal = Some(Fault::unsupported(at, unsupported_tree(&info.tree_type))),
    }
    Ok(())
}

/// As much of a tree's type as a message has room for.
fn shown(tree: &str) -> String {
    tree.chars().take(60).collect()
}

fn unsupported_tree(tree: &str) -> String {
    let shown = shown(tree);
    let what = match tree {
        "Tree_ptdataidx32_5_4_3" | "Tree_ptdataidx64_5_4_3" => {
            "a grid of points, which is not a volume; rasterise the points to a float grid"
        }
        "Tree_ptidx32_5_4_3" | "Tree_ptidx64_5_4_3" => "an index of points, which is not a volume",
        _ => {
            "not supported; supported are Tree_*_5_4_3 of float, double, vec3s, vec3d, vec3i, int32, int64, bool and mask"
        }
    };
    format!("the tree type {shown} is {what}")
}

/// In a stream, finds where a grid ends by walking its tree.
fn pass_stream_grid(source: &Source, behind: u64, grid: &mut RawGrid) -> Next {
    if !grid.parent.is_empty() {
        grid.info.range[1] = behind;
        return Ok(behind);
    }
    let Some(place) = &mut grid.info.tree else {
        let at = grid.info.range[0];
        return Err(Fault::unsupported(
            at,
            unsupported_tree(&grid.info.tree_type),
        ));
    };
    let mut reader = Reader::new(source, place.start, place.limit, 1 << 16);
    let topology = Topology::read(&mut reader, &place.encoding, false)?;
    leaves::check_room(&topology, &place.encoding, place.limit)?;
    place.limit = leaves::skip(source, &place.encoding, &topology, place.limit)?;
    grid.info.range[1] = place.limit;
    Ok(place.limit)
}

/// Makes names unique, gives instances their parents' trees, and names refusals.
pub(crate) fn connect(raw: Vec<RawGrid>, path: &Path) -> Vec<GridInfo> {
    let mut parents = HashMap::new();
    for grid in raw.iter().filter(|grid| grid.parent.is_empty()) {
        let info = &grid.info;
        let tree = (info.tree, info.tree_type.clone(), info.saved_as_half);
        parents.entry(grid.full_name.clone()).or_insert(tree);
    }
    let finish = |mut grid: RawGrid| {
        grid.info.unique_name = unique(&grid.full_name);
        if !grid.parent.is_empty() {
            let parent = unique(&grid.parent);
            let fault = |reason| Fault::invalid(grid.info.range[0], reason);
            grid.info.tree = None;
            match parents.get(&grid.parent) {
                Some((tree, kind, half)) if *kind == grid.info.tree_type => {
                    grid.info.tree = *tree;
                    grid.info.saved_as_half = *half;
                }
                Some((_, kind, _)) => {
                    // Many grids may share one tree: what they say of it has to be short.
                    let kind = shown(kind);
                    let reason =
                        format!("the grid shares the tree of '{parent}', which is a {kind}");
                    grid.refusal.get_or_insert(fault(reason));
                }
                None => {
                    let reason = format!(
                        "the grid shares the tree of '{parent}', which the file does not have"
                    );
                    grid.refusal.get_or_insert(fault(reason));
                }
            }
            if grid.info.tree.is_none() {
                let reason =
                    format!("the grid shares the tree of '{parent}', which cannot be read");
                grid.refusal.get_or_insert(fault(reason));
            }
            grid.info.instance_of = Some(parent);
        }
        let name = grid.info.unique_name.clone();
        grid.info.refusal = grid.refusal.map(|fault| fault.at(path, Some(&name)));
        grid.info
    };
    raw.into_iter().map(finish).collect()
}

/// `name[3]` for a name with separator and number.
fn unique(full_name: &str) -> String {
    match full_name.split_once(SEPARATOR) {
        Some((name, number)) => format!("{name}[{number}]"),
        None => full_name.to_owned(),
    }
}
