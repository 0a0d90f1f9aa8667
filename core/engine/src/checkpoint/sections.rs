//! The file format of checkpoints: a header in JSON, and named sections of numbers, each with its checksum.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | 4 | length of the header |
//! | … | header |
//! | 4 | CRC-32 of all that |
//!
//! Then sections: 32 bytes of name, filled with zeros, 8 bytes of length, that many bytes, and 4 of the CRC-32 of all three. The
//! last one is named `end` and is empty. All numbers are little-endian. A reader refuses sections that it does not know: they hold
//! sums that it would lose.

use std::collections::BTreeMap;

/// First bytes of a checkpoint.
pub const MAGIC: [u8; 8] = *b"RSLVCKPT";
/// Version of the format: any change of what sections hold is another one.
pub const VERSION: u32 = 4;
const NAME: usize = 32;

/// Writes a checkpoint into memory.
pub struct Writer(Vec<u8>);

impl Writer {
    /// Begins with a header.
    pub fn new(header: &[u8]) -> Self {
        let mut bytes = MAGIC.to_vec();
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(header);
        let sum = crc32fast::hash(&bytes);
        bytes.extend_from_slice(&sum.to_le_bytes());
        Self(bytes)
    }

    /// Adds a section.
    pub fn section(&mut self, name: &str, fill: impl FnOnce(&mut Vec<u8>)) {
        let bytes = &mut self.0;
        let begin = bytes.len();
        bytes.extend_from_slice(name.as_bytes());
        bytes.resize(begin + NAME + 8, 0);
        fill(bytes);
        let length = (bytes.len() - begin - NAME - 8) as u64;
        bytes[begin + NAME..begin + NAME + 8].copy_from_slice(&length.to_le_bytes());
        let sum = crc32fast::hash(&bytes[begin..]);
        bytes.extend_from_slice(&sum.to_le_bytes());
    }

    /// The whole file.
    pub fn finish(mut self) -> Vec<u8> {
        self.section("end", |_| {});
        self.0
    }
}

/// The sections of a file, checked.
pub struct Reader<'a>(BTreeMap<&'a str, &'a [u8]>);

impl<'a> Reader<'a> {
    /// Finds header and sections.
    ///
    /// # Errors
    /// What is wrong with the file, in words that follow its name.
    pub fn new(bytes: &'a [u8]) -> Result<(&'a [u8], Self), String> {
        let mut f = Fields(bytes);
        if f.bytes(MAGIC.len()) != Ok(&MAGIC[..]) {
            return Err("is no checkpoint".into());
        }
        let version = f.u32()?;
        if version != VERSION {
            return Err(format!(
                "is a checkpoint of version {version}, and this program knows version {VERSION}: use the program that wrote it"
            ));
        }
        let length = f.u32()? as usize;
        let header = f.bytes(length)?;
        checked(bytes, &mut f, "header")?;
        let mut sections = BTreeMap::new();
        loop {
            let rest = f.0;
            let name = f.bytes(NAME)?;
            let name = name.split(|b| *b == 0).next().unwrap_or_default();
            let name =
                std::str::from_utf8(name).map_err(|_| "is damaged: a section has no name")?;
            let length = usize::try_from(f.u64()?).unwrap_or(usize::MAX);
            let payload = f.bytes(length)?;
            checked(rest, &mut f, name)?;
            if name == "end" {
                f.end()?;
                return Ok((header, Self(sections)));
            }
            if sections.insert(name, payload).is_some() {
                return Err(format!("is damaged: section '{name}' is there twice"));
            }
        }
    }

    /// True if there is a section of this name.
    pub fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// Takes a section, which must have a given length if it is known.
    ///
    /// # Errors
    /// If there is none, or it has another.
    pub fn take(&mut self, name: &str, length: Option<usize>) -> Result<Fields<'a>, String> {
        let bytes = self
            .0
            .remove(name)
            .ok_or(format!("has no section '{name}'"))?;
        match length {
            Some(n) if n != bytes.len() => Err(format!(
                "is damaged: section '{name}' has {} bytes instead of {n}",
                bytes.len()
            )),
            _ => Ok(Fields(bytes)),
        }
    }

    /// All sections must have been taken.
    ///
    /// # Errors
    /// The name of one that was not.
    pub fn finish(self) -> Result<(), String> {
        match self.0.first_key_value() {
            None => Ok(()),
            Some((name, _)) => Err(format!(
                "has a section '{name}' that this program does not know: use the program that wrote it"
            )),
        }
    }
}

/// Compares the checksum that follows with that of everything since `begin`.
fn checked(begin: &[u8], f: &mut Fields, what: &str) -> Result<(), String> {
    let length = begin.len() - f.0.len();
    let sum = crc32fast::hash(&begin[..length]);
    if f.u32()? == sum {
        Ok(())
    } else {
        Err(format!("is damaged: the checksum of '{what}' is wrong"))
    }
}

/// Numbers one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    /// The next bytes.
    ///
    /// # Errors
    /// If there are not so many left.
    pub fn bytes(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (head, tail) = self.0.split_at_checked(n).ok_or("is cut short")?;
        self.0 = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut out = [0; N];
        out.copy_from_slice(self.bytes(N)?);
        Ok(out)
    }

    /// The next number.
    ///
    /// # Errors
    /// If there is none.
    pub fn u32(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    /// The next number.
    ///
    /// # Errors
    /// If there is none.
    pub fn u64(&mut self) -> Result<u64, String> {
        self.array().map(u64::from_le_bytes)
    }

    /// The next number.
    ///
    /// # Errors
    /// If there is none.
    pub fn i128(&mut self) -> Result<i128, String> {
        self.array().map(i128::from_le_bytes)
    }

    /// The next three numbers.
    ///
    /// # Errors
    /// If there are not so many.
    pub fn three(&mut self) -> Result<[i128; 3], String> {
        Ok([self.i128()?, self.i128()?, self.i128()?])
    }

    /// True if none are left.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// None may be left.
    ///
    /// # Errors
    /// If some are.
    pub fn end(&self) -> Result<(), String> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err("is damaged: there is more than there should be".into())
        }
    }
}
