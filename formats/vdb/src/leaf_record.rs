//! A leaf's buffer in the file: finding its end, and decoding it.

use half::f16;

use crate::encoding::{Code, Codec, Encoding, Scratch, chunk_length};
use crate::error::{Fault, Parsed};
use crate::leaf_values::{Halves, LEAF_VOXELS, LeafValues};
use crate::topology::{LeafNode, leaf_mask};
use crate::value::{ValueType, part};

/// The bytes of one leaf, taken apart.
struct Record<'a> {
    mask: [u64; 8],
    /// Bits of a `bool` leaf.
    bits: [u64; 8],
    code: Code,
    /// The inactive values stored behind the code.
    inactive: &'a [u8],
    selection: [u64; 8],
    /// How many values the buffer holds.
    count: usize,
    chunk: &'a [u8],
    raw: bool,
    length: usize,
}

/// Why a record could not be taken apart.
enum Stop {
    /// The bytes at hand end before it does.
    More,
    Fault(Fault),
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

struct Cursor<'a> {
    bytes: &'a [u8],
    next: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Stop> {
        let end = self.next.checked_add(count).ok_or(Stop::More)?;
        let bytes = self.bytes.get(self.next..end).ok_or(Stop::More)?;
        self.next = end;
        Ok(bytes)
    }

    fn mask(&mut self) -> Result<[u64; 8], Stop> {
        Ok(leaf_mask(
            self.take(64)?
                .as_chunks::<64>()
                .0
                .first()
                .ok_or(Stop::More)?,
        ))
    }
}

/// Fewest bytes a leaf's record can take: a check of the number of leaves against the file's size.
pub(crate) fn shortest(encoding: &Encoding) -> u64 {
    match encoding.kind {
        ValueType::Mask => 64 + 12,
        ValueType::Bool => 64 + 12 + 64,
        _ => {
            let head = if encoding.has_code() {
                64 + 1
            } else {
                64 + 12 + 1
            };
            let all = !encoding.has_code() || !encoding.compression.active_mask;
            let values = match encoding.compression.codec {
                Codec::None if all => LEAF_VOXELS * encoding.stored_size(),
                Codec::None => 0,
                Codec::Zip | Codec::Blosc if encoding.has_length(0) || all => 8,
                Codec::Zip | Codec::Blosc => 0,
            };
            head + values as u64
        }
    }
}

/// Length of the record at the start of `bytes`, which lie at `offset` in the file; `None` if they
/// end before the record does.
pub(crate) fn length(encoding: &Encoding, bytes: &[u8], offset: u64) -> Parsed<Option<usize>> {
    match record(encoding, bytes, offset) {
        Ok(record) => Ok(Some(record.length)),
        Err(Stop::More) => Ok(None),
        Err(Stop::Fault(fault)) => Err(fault),
    }
}

fn record<'a>(encoding: &Encoding, bytes: &'a [u8], offset: u64) -> Result<Record<'a>, Stop> {
    let mut cursor = Cursor { bytes, next: 0 };
    let mut record = Record {
        mask: cursor.mask()?,
        bits: [0; 8],
        code: Code::ALL,
        inactive: &[],
        selection: [0; 8],
        count: 0,
        chunk: &[],
        raw: true,
        length: 0,
    };
    if matches!(encoding.kind, ValueType::Bool | ValueType::Mask) {
        cursor.take(12)?; // the origin, known from the topology
        record.bits = if encoding.kind == ValueType::Bool {
            cursor.mask()?
        } else {
            record.mask
        };
        record.length = cursor.next;
        return Ok(record);
    }
    let mut buffers = 1;
    if encoding.has_code() {
        let at = offset + cursor.next as u64;
        record.code = Code::new(cursor.take(1)?[0], at)?;
        record.inactive = cursor.take(record.code.values() * encoding.kind.size())?;
        if record.code.has_selection() {
            record.selection = cursor.mask()?;
        }
    } else {
        cursor.take(12)?;
        buffers = cursor.take(1)?[0];
        if buffers == 0 || buffers > 127 {
            let at = offset + cursor.next as u64 - 1;
            return Err(Fault::invalid(at, format!("a leaf with {buffers} buffers")).into());
        }
    }
    let sparse = encoding.compression.active_mask && record.code != Code::ALL;
    record.count = if sparse {
        record
            .mask
            .iter()
            .map(|word| word.count_ones() as usize)
            .sum()
    } else {
        LEAF_VOXELS
    };
    (record.chunk, record.raw) = chunk(encoding, &mut cursor, record.count, offset)?;
    // Format 221 could store more buffers per leaf (one per time sample); they are not used.
    for _ in 1..buffers {
        chunk(encoding, &mut cursor, LEAF_VOXELS, offset)?;
    }
    record.length = cursor.next;
    Ok(record)
}

fn chunk<'a>(
    encoding: &Encoding,
    cursor: &mut Cursor<'a>,
    count: usize,
    offset: u64,
) -> Result<(&'a [u8], bool), Stop> {
    if !encoding.has_length(count) {
        return Ok((cursor.take(count * encoding.stored_size())?, true));
    }
    let at = offset + cursor.next as u64;
    let prefix = i64::from_le_bytes(part(cursor.take(8)?, 0));
    let (length, raw) = chunk_length(encoding, prefix, count, at)?;
    Ok((cursor.take(length)?, raw))
}

/// Decodes the record at the start of `bytes` (which lie at `offset` in the file) and passes its
/// values on.
pub(crate) fn decode(
    encoding: &Encoding,
    background: &[u8],
    leaf: &LeafNode,
    halves: Halves,
    (bytes, offset): (&[u8], u64),
    scratch: &mut Scratch,
    emit: impl FnOnce(LeafValues<'_>),
) -> Parsed<()> {
    let record = match record(encoding, bytes, offset) {
        Ok(record) => record,
        Err(Stop::Fault(fault)) => return Err(fault),
        Err(Stop::More) => return Err(Fault::invalid(offset, "a leaf is cut short")),
    };
    if record.mask != leaf.mask {
        let reason = format!(
            "the leaf at {:?} has another mask here than in the topology",
            leaf.origin
        );
        return Err(Fault::invalid(offset, reason));
    }
    if matches!(encoding.kind, ValueType::Bool | ValueType::Mask) {
        emit(LeafValues::Bool(&record.bits));
        return Ok(());
    }
    record.code.inactive(
        encoding.kind,
        background,
        record.inactive,
        &mut scratch.inactive,
    );
    let expected = record.count * encoding.stored_size();
    let packed = !record.raw && record.count > 0;
    if packed {
        scratch
            .unpack(encoding.compression.codec, record.chunk, expected)
            .map_err(|reason| {
                Fault::invalid(offset, format!("the leaf at {:?}: {reason}", leaf.origin))
            })?;
    }
    let values = if packed {
        &scratch.bytes[..expected]
    } else {
        &record.chunk[..expected]
    };
    let inactive = [&scratch.inactive[0][..], &scratch.inactive[1][..]];

    let half = encoding.half && encoding.kind.is_real();
    let keep = half && halves == Halves::Keep;
    let f32_of = |b: &[u8; 4]| f32::from_le_bytes(*b);
    let f64_of = |b: &[u8; 8]| f64::from_le_bytes(*b);
    let i32_of = |b: &[u8; 4]| i32::from_le_bytes(*b);
    let i64_of = |b: &[u8; 8]| i64::from_le_bytes(*b);
    let half_of = |b: &[u8; 2]| f16::from_le_bytes(*b);
    macro_rules! emit {
        ($variant:ident, $full:expr, $stored:expr) => {{
            let pair = inactive.map(|bytes| bytes.first_chunk().map($full).unwrap_or_default());
            let mut out = [pair[0]; LEAF_VOXELS];
            fill(&mut out, &record, pair, values, $stored);
            emit(LeafValues::$variant(&out))
        }};
    }
    match (encoding.kind, half, keep) {
        (ValueType::Float, false, _) => emit!(F32, f32_of, f32_of),
        (ValueType::Float, true, false) => emit!(F32, f32_of, |b: &[u8; 2]| half_of(b).to_f32()),
        (ValueType::Float, true, true) => emit!(F16, |b| f16::from_f32(f32_of(b)), half_of),
        (ValueType::Double, false, _) => emit!(F64, f64_of, f64_of),
        (ValueType::Double, true, false) => emit!(F64, f64_of, |b: &[u8; 2]| half_of(b).to_f64()),
        (ValueType::Double, true, true) => emit!(F16, |b| f16::from_f64(f64_of(b)), half_of),
        (ValueType::Int32, ..) => emit!(I32, i32_of, i32_of),
        (ValueType::Int64, ..) => emit!(I64, i64_of, i64_of),
        (ValueType::Vec3s, false, _) => {
            emit!(Vec3F32, |b: &[u8; 12]| three(b, f32_of), |b: &[u8; 12]| {
                three(b, f32_of)
            })
        }
        (ValueType::Vec3s, true, false) => {
            emit!(Vec3F32, |b: &[u8; 12]| three(b, f32_of), |b: &[u8; 6]| {
                three(b, half_of).map(f16::to_f32)
            });
        }
        (ValueType::Vec3s, true, true) => {
            emit!(
                Vec3F16,
                |b: &[u8; 12]| three(b, f32_of).map(f16::from_f32),
                |b: &[u8; 6]| three(b, half_of)
            );
        }
        (ValueType::Vec3d, false, _) => {
            emit!(Vec3F64, |b: &[u8; 24]| three(b, f64_of), |b: &[u8; 24]| {
                three(b, f64_of)
            })
        }
        (ValueType::Vec3d, true, false) => {
            emit!(Vec3F64, |b: &[u8; 24]| three(b, f64_of), |b: &[u8; 6]| {
                three(b, half_of).map(f16::to_f64)
            });
        }
        (ValueType::Vec3d, true, true) => {
            emit!(
                Vec3F16,
                |b: &[u8; 24]| three(b, f64_of).map(f16::from_f64),
                |b: &[u8; 6]| three(b, half_of)
            );
        }
        (ValueType::Vec3i, ..) => {
            emit!(Vec3I32, |b: &[u8; 12]| three(b, i32_of), |b: &[u8; 12]| {
                three(b, i32_of)
            })
        }
        (ValueType::Bool | ValueType::Mask, ..) => {}
    }
    Ok(())
}

fn three<T, const N: usize>(bytes: &[u8], of: impl Fn(&[u8; N]) -> T) -> [T; 3] {
    let parts = bytes.as_chunks::<N>().0;
    [of(&parts[0]), of(&parts[1]), of(&parts[2])]
}

/// Puts stored values where they belong; `out` is already full of the first inactive value.
fn fill<T: Copy, const N: usize>(
    out: &mut [T; LEAF_VOXELS],
    record: &Record<'_>,
    inactive: [T; 2],
    values: &[u8],
    of: impl Fn(&[u8; N]) -> T,
) {
    let values = values.as_chunks::<N>().0;
    if record.count == LEAF_VOXELS {
        for (out, value) in out.iter_mut().zip(values) {
            *out = of(value);
        }
        return;
    }
    let mut values = values.iter();
    for ((out, mask), selection) in out
        .as_chunks_mut::<64>()
        .0
        .iter_mut()
        .zip(record.mask)
        .zip(record.selection)
    {
        let mut second = selection & !mask;
        while second != 0 {
            out[second.trailing_zeros() as usize] = inactive[1];
            second &= second - 1;
        }
        if mask == u64::MAX {
            for (out, value) in out.iter_mut().zip(values.by_ref()) {
                *out = of(value);
            }
            continue;
        }
        let mut bits = mask;
        while bits != 0 {
            if let Some(value) = values.next() {
                out[bits.trailing_zeros() as usize] = of(value);
            }
            bits &= bits - 1;
        }
    }
}
