//! The archive's header, and the walk along the list of grids.

use std::path::Path;

use crate::descriptor::{connect, next_grid};
use crate::encoding::NODE_CODES;
use crate::error::{Error, Fault, Parsed};
use crate::grid::GridInfo;
use crate::metadata::Metadata;
use crate::reader::Reader;
use crate::source::Source;

const MAGIC: i64 = 0x5644_4220;
/// The oldest format current OpenVDB reads, and the newest there is.
const VERSIONS: std::ops::RangeInclusive<u32> = 221..=225;
/// Read ahead while reading descriptions: they are short and lie far apart.
pub(crate) const AHEAD: usize = 4096;
/// Shortest descriptor of a grid: three empty strings and three offsets.
const SHORTEST: u64 = 3 * 4 + 3 * 8;

/// What the header says about the file as a whole.
pub(crate) struct Archive {
    pub version: u32,
    pub library: [u32; 2],
    pub metadata: Metadata,
    pub has_offsets: bool,
    /// Compression of all grids, before the flags became the grids' own.
    pub zip: bool,
}

/// The header, the grids, and why there may be more.
pub(crate) struct Listing {
    pub archive: Archive,
    pub grids: Vec<GridInfo>,
    pub damage: Option<Error>,
}

pub(crate) fn read(source: &Source, path: &Path) -> Parsed<Listing> {
    let mut reader = Reader::new(source, 0, source.len(), AHEAD);
    let archive = archive(&mut reader)?;
    let at = reader.position();
    let count = reader.i32("the number of grids")?;
    if count < 0 || count as u64 * SHORTEST > reader.left() {
        let reason = format!("the file claims {count} grids in {} bytes", reader.left());
        return Err(Fault::invalid(at, reason));
    }
    let mut raw = Vec::new();
    let mut position = reader.position();
    let mut damage = None;
    for index in 0..count {
        let next = next_grid(source, &archive, &mut reader, position);
        match next {
            Ok((grid, Ok(end))) => {
                raw.push(grid);
                position = end;
            }
            // The grid is known, but not where the next one is; that matters if there is one.
            Ok((grid, Err(fault))) => {
                raw.push(grid);
                if index + 1 < count {
                    damage = Some(fault.at(path, None));
                }
                break;
            }
            Err(fault) if index == 0 => return Err(fault),
            Err(fault) => {
                damage = Some(fault.at(path, None));
                break;
            }
        }
    }
    let grids = connect(raw, path);
    Ok(Listing {
        archive,
        grids,
        damage,
    })
}

fn archive(reader: &mut Reader<'_>) -> Parsed<Archive> {
    if reader.left() < 8 || reader.i64("the magic number")? != MAGIC {
        return Err(Fault::invalid(
            0,
            "not an OpenVDB file: it does not start with the magic number",
        ));
    }
    let version = reader.u32("the version")?;
    if !VERSIONS.contains(&version) {
        let remedy = if version < *VERSIONS.start() {
            "convert it with an OpenVDB that reads it and writes a newer format"
        } else {
            "write it with an OpenVDB that uses format 224, as versions 7 to 12 do"
        };
        let reason = format!("file format {version} is not supported, only 221 to 225; {remedy}");
        return Err(Fault::unsupported(8, reason));
    }
    let library = [
        reader.u32("the library's version")?,
        reader.u32("the library's version")?,
    ];
    let has_offsets = reader.u8("the offsets flag")? != 0;
    let zip = version < NODE_CODES && reader.u8("the compression flag")? != 0;
    reader.skip(36, "the file's UUID")?;
    let metadata = Metadata::read(reader)?;
    Ok(Archive {
        version,
        library,
        metadata,
        has_offsets,
        zip,
    })
}
