//! A buffered little-endian reader over a byte range of a [`Source`].

use crate::error::{Fault, Parsed};
use crate::source::Source;

/// Reads forward from a position, never past `limit`, and never asks for memory that the bytes left
/// in the range do not justify.
pub(crate) struct Reader<'a> {
    source: &'a Source,
    buffer: Vec<u8>,
    /// File offset of `buffer[0]`.
    base: u64,
    /// Index of the next byte in `buffer`.
    next: usize,
    limit: u64,
    /// Reading ahead stops here, at or behind `limit`.
    ahead_limit: u64,
    /// How much to read at once, in bytes.
    ahead: usize,
}

impl<'a> Reader<'a> {
    /// A reader from `position` up to `limit` (exclusive) that reads `ahead` bytes at once.
    pub fn new(source: &'a Source, position: u64, limit: u64, ahead: usize) -> Self {
        let limit = limit.min(source.len());
        Self {
            source,
            buffer: Vec::new(),
            base: position,
            next: 0,
            limit,
            ahead_limit: limit,
            ahead,
        }
    }

    /// File offset of the next byte.
    pub fn position(&self) -> u64 {
        self.base + self.next as u64
    }

    /// Goes to `position` and reads up to `limit` from there (not beyond the first limit), using what
    /// is already in memory.
    pub fn seek(&mut self, position: u64, limit: u64) {
        self.limit = limit.min(self.ahead_limit);
        match position.checked_sub(self.base) {
            Some(next) if next <= self.buffer.len() as u64 => self.next = next as usize,
            _ => {
                self.buffer.clear();
                self.base = position;
                self.next = 0;
            }
        }
    }

    /// Bytes left in the range.
    pub fn left(&self) -> u64 {
        self.limit.saturating_sub(self.position())
    }

    /// The next `count` bytes; `what` names them if they are not there.
    pub fn bytes(&mut self, count: usize, what: &str) -> Parsed<&[u8]> {
        let buffered = self.buffer.len() - self.next;
        if buffered < count || self.left() < count as u64 {
            self.fill(count, what)?;
        }
        let start = self.next;
        self.next += count;
        Ok(&self.buffer[start..start + count])
    }

    #[cold]
    fn fill(&mut self, count: usize, what: &str) -> Parsed<()> {
        let left = self.left();
        if count as u64 > left {
            return Err(Fault::invalid(
                self.position(),
                format!(
                    "{what} needs {count} bytes where {left} are left; the file is cut short or damaged"
                ),
            ));
        }
        // Keep what is buffered, then read on: `want` is at most what the file holds.
        let kept = self.buffer.len() - self.next;
        let there = self.ahead_limit - self.position();
        let want = (count.max(self.ahead) as u64).min(there) as usize;
        self.buffer.copy_within(self.next.., 0);
        self.base += self.next as u64;
        self.next = 0;
        self.buffer.resize(want.max(kept), 0);
        if want > kept {
            let from = self.base + kept as u64;
            if let Err(fault) = self.source.read_exact_at(from, &mut self.buffer[kept..]) {
                self.buffer.truncate(kept);
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Passes over `count` bytes without reading them where possible.
    pub fn skip(&mut self, count: u64, what: &str) -> Parsed<()> {
        let left = self.left();
        if count > left {
            return Err(Fault::invalid(
                self.position(),
                format!(
                    "{what} needs {count} bytes where {left} are left; the file is cut short or damaged"
                ),
            ));
        }
        let buffered = (self.buffer.len() - self.next) as u64;
        if count <= buffered {
            self.next += count as usize;
        } else {
            self.base = self.position() + count;
            self.buffer.clear();
            self.next = 0;
        }
        Ok(())
    }

    /// The next `N` bytes by value.
    pub fn array<const N: usize>(&mut self, what: &str) -> Parsed<[u8; N]> {
        let mut out = [0; N];
        out.copy_from_slice(self.bytes(N, what)?);
        Ok(out)
    }

    pub fn u8(&mut self, what: &str) -> Parsed<u8> {
        Ok(self.array::<1>(what)?[0])
    }

    pub fn u32(&mut self, what: &str) -> Parsed<u32> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub fn i32(&mut self, what: &str) -> Parsed<i32> {
        self.array(what).map(i32::from_le_bytes)
    }

    pub fn i64(&mut self, what: &str) -> Parsed<i64> {
        self.array(what).map(i64::from_le_bytes)
    }

    pub fn f64(&mut self, what: &str) -> Parsed<f64> {
        self.array(what).map(f64::from_le_bytes)
    }

    /// Three consecutive `i32`.
    pub fn coordinate(&mut self, what: &str) -> Parsed<[i32; 3]> {
        Ok([self.i32(what)?, self.i32(what)?, self.i32(what)?])
    }

    /// The next `count` bytes, where `count` comes from the file.
    pub fn bytes_checked(&mut self, count: u32, what: &str) -> Parsed<&[u8]> {
        if u64::from(count) > self.left() {
            let reason = format!("{what} claims {count} bytes where {} are left", self.left());
            return Err(Fault::invalid(self.position() - 4, reason));
        }
        self.bytes(count as usize, what)
    }

    /// A string behind its 32-bit length. Bytes that are no UTF-8 become U+FFFD: names of grids are
    /// shown and compared, never written back.
    pub fn string(&mut self, what: &str) -> Parsed<String> {
        let length = self.u32(what)?;
        Ok(String::from_utf8_lossy(self.bytes_checked(length, what)?).into_owned())
    }
}
