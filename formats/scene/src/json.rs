//! JSON values that know where they stand.

use crate::error::Place;
use crate::parse::parse;

/// The largest text that is read, in bytes. Larger meshes belong into PLY files.
///
/// A list of one-digit numbers takes 32 bytes in memory per two bytes of text: at most 1.4 GiB at the
/// peak (measured), while the list grows.
pub(crate) const MAX_BYTES: u64 = 64 << 20;

/// Longer paths are shown by their beginning and end: a place is kept for every parameter of a plugin,
/// and must stay small whatever the keys are.
const MAX_PATH: usize = 300;

/// Distance in bytes between the offsets whose count of characters is remembered.
const BLOCK: usize = 512;

/// One JSON value and the byte offset of its first character.
#[derive(Debug)]
pub(crate) struct Node {
    pub start: u32,
    pub data: Data,
}

#[derive(Debug)]
pub(crate) enum Data {
    Null,
    Bool(bool),
    Number(f64),
    Text(Box<str>),
    List(Vec<Node>),
    Object(Vec<Member>),
}

/// One `"key": value` of an object.
#[derive(Debug)]
pub(crate) struct Member {
    pub key: Box<str>,
    pub key_start: u32,
    pub value: Node,
}

impl Node {
    /// The value under `key`, if this is an object that has it.
    pub fn get(&self, key: &str) -> Option<&Node> {
        match &self.data {
            Data::Object(members) => members.iter().find(|m| &*m.key == key).map(|m| &m.value),
            _ => None,
        }
    }

    /// What an error message says was found here.
    pub fn found(&self) -> String {
        match &self.data {
            Data::Null => "null".into(),
            Data::Bool(b) => format!("{b}"),
            Data::Number(x) => format!("{x:?}"),
            Data::Text(t) => quoted(t),
            Data::List(items) if items.is_empty() => "an empty list".into(),
            Data::List(items) => format!("a list of {}", items.len()),
            Data::Object(_) => "an object".into(),
        }
    }
}

/// `text` in double quotes, escaped, and cut if long: errors must stay one readable line.
pub(crate) fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(40).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    format!("{shown:?}")
}

/// A parsed text: its values and what is needed to say where they are.
#[derive(Debug)]
pub(crate) struct Document<'t> {
    text: &'t str,
    line_starts: Vec<u32>,
    /// Number of characters before each multiple of [`BLOCK`] bytes, so that columns cost no scan of
    /// their whole line, which may be the whole text.
    chars_before: Vec<u32>,
    pub root: Node,
}

/// A syntax error: where, and what is wrong there.
#[derive(Debug)]
pub(crate) struct SyntaxError {
    pub place: Place,
    pub what: String,
}

impl<'t> Document<'t> {
    /// Parses a whole text.
    pub fn parse(bytes: &'t [u8]) -> Result<Document<'t>, SyntaxError> {
        if bytes.len() as u64 > MAX_BYTES {
            return Err(SyntaxError {
                place: Place::new("$".into(), 1, 1),
                what: format!(
                    "the text has {} MiB, more than the {} MiB that are read (put large meshes into PLY files)",
                    bytes.len() >> 20,
                    MAX_BYTES >> 20
                ),
            });
        }
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text,
            Err(e) => {
                let valid = &bytes[..e.valid_up_to()];
                let line = valid.iter().filter(|b| **b == b'\n').count() + 1;
                let last = valid.rsplit(|b| *b == b'\n').next().unwrap_or(&[]);
                let column = String::from_utf8_lossy(last).chars().count() + 1;
                return Err(SyntaxError {
                    place: Place::new("$".into(), line, column),
                    what: format!("byte 0x{:02x} is not UTF-8 text", bytes[e.valid_up_to()]),
                });
            }
        };
        let root = parse(text);
        let mut document = Document::index(text);
        match root {
            Ok(root) => {
                document.root = root;
                Ok(document)
            }
            Err((at, what)) => {
                let (line, column) = document.line_column(at);
                Err(SyntaxError {
                    place: Place::new("$".into(), line, column),
                    what,
                })
            }
        }
    }

    /// Lines and characters of a text, without its values.
    fn index(text: &str) -> Document<'_> {
        let mut line_starts = vec![0];
        let mut chars_before = Vec::with_capacity(text.len() / BLOCK + 1);
        let mut chars = 0;
        for (i, byte) in text.bytes().enumerate() {
            if i % BLOCK == 0 {
                chars_before.push(chars);
            }
            chars += u32::from(starts_char(byte));
            if byte == b'\n' {
                line_starts.push(i as u32 + 1);
            }
        }
        // The end of the text is a place, too, and may be the start of a block.
        chars_before.push(chars);
        let root = Node {
            start: 0,
            data: Data::Null,
        };
        Document {
            text,
            line_starts,
            chars_before,
            root,
        }
    }

    /// Number of characters that start before an offset.
    fn chars_to(&self, offset: usize) -> usize {
        let offset = offset.min(self.text.len());
        let block = offset / BLOCK;
        let before = self.chars_before.get(block).map_or(0, |n| *n as usize);
        let rest = &self.text.as_bytes()[block * BLOCK..offset];
        before + rest.iter().filter(|b| starts_char(**b)).count()
    }

    fn line_column(&self, offset: usize) -> (usize, usize) {
        let line = self
            .line_starts
            .partition_point(|s| *s as usize <= offset)
            .max(1);
        let start = self.line_starts[line - 1] as usize;
        // No editor counts the byte-order mark as a column.
        let mark = usize::from(line == 1 && offset > 0 && self.text.starts_with('\u{feff}'));
        (
            line,
            self.chars_to(offset) - self.chars_to(start) + 1 - mark,
        )
    }

    /// Path, line and column of a value of this document.
    ///
    /// The path is found by walking down from the root to the value with this start, so that nothing
    /// needs to carry paths around while all is well.
    pub fn place(&self, node: &Node) -> Place {
        self.place_of(node.start, None)
    }

    /// The place of a key itself: its path, and the position of the key rather than of its value.
    pub fn place_of_key(&self, member: &Member) -> Place {
        self.place_of(member.value.start, Some(member.key_start))
    }

    fn place_of(&self, start: u32, shown: Option<u32>) -> Place {
        let mut path = String::from("$");
        let mut node = &self.root;
        while node.start != start {
            let child = match &node.data {
                Data::List(items) => {
                    let i = items
                        .partition_point(|n| n.start <= start)
                        .saturating_sub(1);
                    path.push_str(&format!("[{i}]"));
                    items.get(i)
                }
                Data::Object(members) => {
                    let i = members
                        .partition_point(|m| m.value.start <= start)
                        .saturating_sub(1);
                    if let Some(m) = members.get(i) {
                        path.push_str(&key_step(&m.key));
                    }
                    members.get(i).map(|m| &m.value)
                }
                _ => None,
            };
            match child {
                Some(child) => node = child,
                None => break,
            }
        }
        if path.len() > MAX_PATH {
            let head: String = path.chars().take(MAX_PATH / 4).collect();
            let tail: Vec<char> = path.chars().rev().take(MAX_PATH / 4).collect();
            path = head + "…" + &tail.into_iter().rev().collect::<String>();
        }
        let (line, column) = self.line_column(shown.unwrap_or(start) as usize);
        Place::new(path, line, column)
    }

    /// The value as an integer, exactly: `f64` holds integers only up to 2⁵³, seeds use all 64 bits.
    pub fn integer(&self, node: &Node) -> Option<i128> {
        let Data::Number(x) = node.data else {
            return None;
        };
        let rest = self.text.get(node.start as usize..)?;
        let end = rest.find(|c: char| !matches!(c, '0'..='9' | '-' | '+' | '.' | 'e' | 'E'));
        let token = &rest[..end.unwrap_or(rest.len())];
        if let Ok(i) = token.parse::<i128>() {
            return Some(i);
        }
        (x.fract() == 0.0 && x.abs() <= 9_007_199_254_740_992.0).then_some(x as i128)
    }
}

/// One step of a JSON path: `.key`, or `["odd key"]`.
pub(crate) fn key_step(key: &str) -> String {
    let plain = !key.is_empty()
        && key.len() <= MAX_PATH
        && key
            .chars()
            .all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    if plain {
        format!(".{key}")
    } else {
        format!("[{}]", quoted(key))
    }
}

fn starts_char(byte: u8) -> bool {
    byte & 0xc0 != 0x80
}
