//! How a grid's buffers are encoded: compression, precision and the codes for inactive values.

use flate2::{Decompress, FlushDecompress, Status};

use crate::blosc;
use crate::error::{Fault, Parsed};
use crate::value::ValueType;

/// The compression of a grid's buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Codec {
    /// Values as they are.
    None,
    /// zlib.
    Zip,
    /// Blosc with LZ4.
    Blosc,
}

/// What a grid's compression flags say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Compression {
    /// How buffers are packed.
    pub codec: Codec,
    /// Whether only active values are stored ("active mask" compression).
    pub active_mask: bool,
}

impl Compression {
    const ZIP: u32 = 1;
    const ACTIVE_MASK: u32 = 2;
    const BLOSC: u32 = 4;

    /// From the flags of the file; several codecs at once mean Blosc, as in OpenVDB.
    pub(crate) fn from_flags(flags: u32, offset: u64) -> Parsed<Self> {
        if flags & !(Self::ZIP | Self::ACTIVE_MASK | Self::BLOSC) != 0 {
            return Err(Fault::unsupported(
                offset,
                format!("unknown compression flags {flags:#x}"),
            ));
        }
        let codec = if flags & Self::BLOSC != 0 {
            Codec::Blosc
        } else if flags & Self::ZIP != 0 {
            Codec::Zip
        } else {
            Codec::None
        };
        Ok(Self {
            codec,
            active_mask: flags & Self::ACTIVE_MASK != 0,
        })
    }
}

impl std::fmt::Display for Compression {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match (self.codec, self.active_mask) {
            (Codec::None, false) => "none",
            (Codec::Zip, false) => "zip",
            (Codec::Blosc, false) => "blosc",
            (Codec::None, true) => "active values",
            (Codec::Zip, true) => "zip + active values",
            (Codec::Blosc, true) => "blosc + active values",
        })
    }
}

/// Everything needed to decode the buffers of one grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Encoding {
    pub kind: ValueType,
    pub half: bool,
    pub compression: Compression,
    pub version: u32,
}

/// Format 222: compression flags per grid, a code for inactive values before each buffer.
pub(crate) const NODE_CODES: u32 = 222;

impl Encoding {
    /// Bytes of one value in a buffer.
    pub fn stored_size(&self) -> usize {
        self.kind.stored_size(self.half)
    }

    /// Whether a node of this format carries a code for its inactive values.
    pub fn has_code(&self) -> bool {
        self.version >= NODE_CODES
    }

    /// Whether a buffer of `count` values has a 64-bit length in front. OpenVDB's reader of halves
    /// returns early when there is nothing to read; the others do not.
    pub fn has_length(&self, count: usize) -> bool {
        self.compression.codec != Codec::None && !(count == 0 && self.half && self.kind.is_real())
    }

    /// The most bytes a packed buffer of `count` values may take. Writers store a buffer as it is
    /// if packing does not shrink it, so this is generous.
    pub fn longest_chunk(&self, count: usize) -> usize {
        2 * count * self.stored_size() + 1024
    }
}

/// The code in front of a buffer: how inactive values are rebuilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Code(u8);

impl Code {
    /// All values are stored, inactive ones too.
    pub const ALL: Self = Self(6);

    pub fn new(byte: u8, offset: u64) -> Parsed<Self> {
        if byte > 6 {
            let reason = format!("unknown code {byte} for inactive values (0 to 6 exist)");
            return Err(Fault::invalid(offset, reason));
        }
        Ok(Self(byte))
    }

    /// How many inactive values (0, 1 or 2) follow the code.
    pub fn values(self) -> usize {
        match self.0 {
            2 | 4 => 1,
            5 => 2,
            _ => 0,
        }
    }

    /// Whether a mask that selects between two inactive values follows.
    pub fn has_selection(self) -> bool {
        matches!(self.0, 3..=5)
    }

    /// The inactive values for unset and set bits of the selection mask, given the `stored` ones
    /// (`values()` of them, at full precision).
    pub fn inactive(
        self,
        kind: ValueType,
        background: &[u8],
        stored: &[u8],
        out: &mut [Vec<u8>; 2],
    ) {
        let size = background.len();
        out.iter_mut().for_each(Vec::clear);
        match self.0 {
            1 | 3 => kind.negate(background, &mut out[0]),
            2 | 4 | 5 => out[0].extend_from_slice(&stored[..size]),
            _ => out[0].extend_from_slice(background),
        }
        match self.0 {
            5 => out[1].extend_from_slice(&stored[size..2 * size]),
            _ => out[1].extend_from_slice(background),
        }
    }
}

/// Working memory for decoding, reused from buffer to buffer.
#[derive(Default)]
pub(crate) struct Scratch {
    pub bytes: Vec<u8>,
    pub inactive: [Vec<u8>; 2],
    shuffled: Vec<u8>,
    inflate: Option<Decompress>,
}

impl Scratch {
    /// Unpacks `chunk` into `self.bytes`, which then has at least `expected` bytes.
    pub fn unpack(&mut self, codec: Codec, chunk: &[u8], expected: usize) -> Result<(), String> {
        match codec {
            Codec::None => {
                self.bytes.clear();
                self.bytes.extend_from_slice(chunk);
            }
            Codec::Zip => {
                let inflate = self.inflate.get_or_insert_with(|| Decompress::new(true));
                inflate.reset(true);
                self.bytes.clear();
                self.bytes.resize(expected, 0);
                let status = inflate
                    .decompress(chunk, &mut self.bytes, FlushDecompress::Finish)
                    .map_err(|error| format!("zip: {error}"))?;
                let got = inflate.total_out();
                if status != Status::StreamEnd || got != expected as u64 {
                    return Err(format!("zip: {got} bytes instead of {expected}, or no end"));
                }
            }
            // OpenVDB pads what it compresses to 128 bytes.
            Codec::Blosc => {
                let padded = expected.max(128);
                blosc::decompress(chunk, expected, padded, &mut self.bytes, &mut self.shuffled)?;
            }
        }
        if self.bytes.len() < expected {
            return Err(format!(
                "{} bytes where {expected} are expected",
                self.bytes.len()
            ));
        }
        Ok(())
    }
}

/// The length in front of a buffer: `Ok((bytes, raw))`. Negative or zero means "as it is".
pub(crate) fn chunk_length(
    encoding: &Encoding,
    prefix: i64,
    count: usize,
    offset: u64,
) -> Parsed<(usize, bool)> {
    let expected = count * encoding.stored_size();
    let raw = prefix <= 0;
    let bytes = prefix.unsigned_abs();
    if raw && bytes != expected as u64 {
        let reason = format!("a buffer stores {bytes} plain bytes where {expected} are expected");
        return Err(Fault::invalid(offset, reason));
    }
    let most = encoding.longest_chunk(count);
    if bytes > most as u64 {
        let reason = format!(
            "a buffer claims {bytes} packed bytes where {expected} plain ones are expected"
        );
        return Err(Fault::invalid(offset, reason));
    }
    Ok((bytes as usize, raw))
}
