//! The Blosc 1 container, as far as OpenVDB writes it: LZ4 blocks, bytes shuffled or not.
//!
//! Layout (c-blosc 1.21, README_HEADER.rst): a header of 16 bytes, then either the bytes as they are
//! or, per block, a 32-bit start offset. A block is one stream, or one per byte of the type ("split");
//! a stream is its 32-bit length and LZ4 data, or plain bytes if the length is that of the output.

use crate::value::part;

const HEADER: usize = 16;
const SHUFFLED: u8 = 0x01;
const PLAIN: u8 = 0x02;
const BIT_SHUFFLED: u8 = 0x04;
const NOT_SPLIT: u8 = 0x10;
const CODECS: [&str; 8] = ["BloscLZ", "LZ4", "Snappy", "zlib", "Zstd", "5", "6", "7"];
const LZ4: u8 = 1;

/// Decompresses `chunk` into `out`, which gets `padded` bytes at most, `expected` at least.
///
/// `shuffled` is working memory.
pub(crate) fn decompress(
    chunk: &[u8],
    expected: usize,
    padded: usize,
    out: &mut Vec<u8>,
    shuffled: &mut Vec<u8>,
) -> Result<(), String> {
    if chunk.len() < HEADER {
        return Err(format!(
            "a Blosc buffer of {} bytes is shorter than its header",
            chunk.len()
        ));
    }
    let (version, flags, type_size) = (chunk[0], chunk[2], usize::from(chunk[3]));
    let [size, block_size, stored] = [1, 2, 3].map(|i| u32::from_le_bytes(part(chunk, i)) as usize);
    if version == 0 || version > 2 || type_size == 0 {
        return Err(format!(
            "not a Blosc buffer (version {version}, type size {type_size})"
        ));
    }
    if size < expected || size > padded {
        return Err(format!(
            "a Blosc buffer holds {size} bytes where {expected} are expected"
        ));
    }
    let Some(chunk) = chunk.get(..stored) else {
        return Err(format!(
            "a Blosc buffer claims {stored} bytes where {} are stored",
            chunk.len()
        ));
    };
    out.clear();
    if flags & PLAIN != 0 {
        let bytes = chunk
            .get(HEADER..HEADER + size)
            .ok_or("a plain Blosc buffer is too short")?;
        out.extend_from_slice(bytes);
        return Ok(());
    }
    let codec = flags >> 5;
    if codec != LZ4 {
        return Err(format!(
            "Blosc codec {} is not supported, only LZ4 (what OpenVDB writes)",
            CODECS[usize::from(codec)]
        ));
    }
    if flags & BIT_SHUFFLED != 0 {
        return Err("Blosc's bit shuffle is not supported".into());
    }
    if block_size == 0 {
        return if size == 0 {
            Ok(())
        } else {
            Err("a Blosc buffer has blocks of no bytes".into())
        };
    }
    out.resize(size, 0);
    let shuffle = flags & SHUFFLED != 0 && type_size > 1;
    if shuffle {
        shuffled.resize(block_size.min(size), 0);
    }
    for (index, block) in out.chunks_mut(block_size).enumerate() {
        let entry = HEADER + 4 * index;
        let start = chunk
            .get(entry..entry + 4)
            .ok_or("a Blosc buffer lacks block offsets")?;
        let start = u32::from_le_bytes(part(start, 0)) as usize;
        let data = chunk
            .get(start..)
            .ok_or("a Blosc block starts behind its buffer")?;
        let whole = block.len() == block_size;
        // c-blosc 1: `dont_split`, MAX_SPLITS = 16, MIN_BUFFERSIZE = 128; a last, shorter block is
        // never split.
        let split =
            whole && flags & NOT_SPLIT == 0 && type_size <= 16 && block_size / type_size >= 128;
        let streams = if split { type_size } else { 1 };
        if shuffle {
            let bytes = &mut shuffled[..block.len()];
            streams_of(data, streams, bytes)?;
            unshuffle(bytes, type_size, block);
        } else {
            streams_of(data, streams, block)?;
        }
    }
    Ok(())
}

fn streams_of(mut data: &[u8], count: usize, block: &mut [u8]) -> Result<(), String> {
    if !block.len().is_multiple_of(count) {
        return Err("a Blosc block does not divide into its streams".into());
    }
    let each = block.len() / count;
    for out in block.chunks_exact_mut(each) {
        let (length, rest) = data
            .split_at_checked(4)
            .ok_or("a Blosc stream lacks its length")?;
        let length = u32::from_le_bytes(part(length, 0)) as usize;
        let (stream, rest) = rest
            .split_at_checked(length)
            .ok_or("a Blosc stream leaves its buffer")?;
        data = rest;
        if length == each {
            out.copy_from_slice(stream);
        } else {
            match lz4_flex::block::decompress_into(stream, out) {
                Ok(count) if count == each => {}
                Ok(count) => {
                    return Err(format!(
                        "an LZ4 stream gives {count} bytes instead of {each}"
                    ));
                }
                Err(error) => return Err(format!("LZ4: {error}")),
            }
        }
    }
    Ok(())
}

/// Undoes the byte shuffle: all first bytes, all second bytes, …; bytes left over stay at the end.
fn unshuffle(bytes: &[u8], type_size: usize, out: &mut [u8]) {
    let count = bytes.len() / type_size;
    let (planes, rest) = bytes.split_at(count * type_size);
    let (values, tail) = out.split_at_mut(count * type_size);
    tail.copy_from_slice(rest);
    if type_size == 4 {
        // The only size OpenVDB writes; this form compiles to vector interleaves.
        let (low, high) = planes.split_at(2 * count);
        let ((a, b), (c, d)) = (low.split_at(count), high.split_at(count));
        let values = values.as_chunks_mut::<4>().0;
        for ((((value, a), b), c), d) in values.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *value = [*a, *b, *c, *d];
        }
        return;
    }
    for (plane, bytes) in planes.chunks_exact(count.max(1)).enumerate() {
        for (value, byte) in values.chunks_exact_mut(type_size).zip(bytes) {
            value[plane] = *byte;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A container as c-blosc writes it, for the paths OpenVDB's own files do not take.
    fn pack(data: &[u8], type_size: usize, block_size: usize, flags: u8) -> Vec<u8> {
        let blocks = data.len().div_ceil(block_size);
        let mut out = vec![2, 1, flags | LZ4 << 5, type_size as u8];
        for n in [data.len(), block_size, 0] {
            out.extend((n as u32).to_le_bytes());
        }
        out.resize(HEADER + 4 * blocks, 0);
        for (index, block) in data.chunks(block_size).enumerate() {
            let start = out.len() as u32;
            out[HEADER + 4 * index..][..4].copy_from_slice(&start.to_le_bytes());
            let count = block.len() / type_size;
            let mut bytes = block.to_vec();
            if flags & SHUFFLED != 0 {
                for i in 0..count {
                    for k in 0..type_size {
                        bytes[k * count + i] = block[i * type_size + k];
                    }
                }
            }
            let split = block.len() == block_size
                && flags & NOT_SPLIT == 0
                && type_size <= 16
                && block_size / type_size >= 128;
            let each = if split {
                block.len() / type_size
            } else {
                block.len()
            };
            for stream in bytes.chunks(each) {
                let packed = lz4_flex::block::compress(stream);
                let stored = if packed.len() < stream.len() {
                    &packed
                } else {
                    stream
                };
                out.extend((stored.len() as u32).to_le_bytes());
                out.extend(stored);
            }
        }
        let length = out.len() as u32;
        out[12..16].copy_from_slice(&length.to_le_bytes());
        out
    }

    fn unpack(chunk: &[u8], size: usize) -> Result<Vec<u8>, String> {
        let (mut out, mut shuffled) = (Vec::new(), Vec::new());
        decompress(chunk, size, size, &mut out, &mut shuffled).map(|()| out)
    }

    #[test]
    fn all_block_layouts_come_back() {
        let data: Vec<u8> = (0..5000_u32).map(|i| (i * i / 97) as u8 & 0x3f).collect();
        for type_size in [1, 2, 3, 4, 8, 12, 16, 17, 255] {
            for block_size in [256, 512, 2048, 4080, 5000, 8192] {
                for flags in [0, SHUFFLED, NOT_SPLIT, SHUFFLED | NOT_SPLIT] {
                    if flags & NOT_SPLIT == 0 && block_size % type_size != 0 {
                        continue; // c-blosc rounds the block size to the type's
                    }
                    let chunk = pack(&data, type_size, block_size, flags);
                    let back = unpack(&chunk, data.len());
                    assert_eq!(
                        back.as_deref(),
                        Ok(&data[..]),
                        "{type_size} {block_size} {flags}"
                    );
                }
            }
        }
    }

    #[test]
    fn other_codecs_are_refused_by_name() {
        let mut chunk = pack(&[7; 600], 4, 256, SHUFFLED);
        for (codec, name) in [(0, "BloscLZ"), (2, "Snappy"), (3, "zlib"), (4, "Zstd")] {
            chunk[2] = codec << 5 | SHUFFLED;
            assert!(unpack(&chunk, 600).unwrap_err().contains(name));
        }
        chunk[2] = LZ4 << 5 | BIT_SHUFFLED;
        assert!(unpack(&chunk, 600).unwrap_err().contains("bit shuffle"));
    }

    #[test]
    fn cutting_it_anywhere_is_an_error() {
        let data: Vec<u8> = (0..2048_u32).map(|i| (i / 7) as u8).collect();
        let chunk = pack(&data, 4, 256, SHUFFLED);
        for length in 0..chunk.len() {
            assert!(unpack(&chunk[..length], data.len()).is_err(), "{length}");
        }
    }
}
