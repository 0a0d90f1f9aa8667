//! The grammar of JSON, with positions.
//!
//! `serde_json` gives no positions for values that are well-formed but wrong for a scene, and it
//! keeps the last of two equal keys in silence. This parser accepts exactly RFC 8259, with a limit
//! on nesting, and refuses equal keys in one object. A leading byte-order mark is skipped.

use std::collections::HashSet;

use crate::json::{Data, Member, Node, quoted};

/// How deeply lists and objects may be nested.
pub(crate) const MAX_DEPTH: usize = 64;

type Fallible<T> = Result<T, (usize, String)>;

struct Parser<'t> {
    text: &'t str,
    at: usize,
    depth: usize,
}

/// Parses a whole text; an error is a byte offset and what is wrong there.
pub(crate) fn parse(text: &str) -> Fallible<Node> {
    let mut parser = Parser {
        text,
        at: 0,
        depth: 0,
    };
    if text.starts_with('\u{feff}') {
        parser.at = '\u{feff}'.len_utf8();
    }
    parser.document()
}

impl Parser<'_> {
    fn document(&mut self) -> Fallible<Node> {
        let root = self.value()?;
        self.space();
        match self.peek() {
            None => Ok(root),
            Some(_) => Err(self.unexpected("the end of the file")),
        }
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn space(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\n' | b'\r')) {
            self.at += 1;
        }
    }

    fn unexpected(&self, expected: &str) -> (usize, String) {
        let rest = self.text.get(self.at..).unwrap_or("");
        let found = match rest.chars().next() {
            None => "the end of the file".to_string(),
            Some('/') => "\"/\" (JSON has no comments)".to_string(),
            Some('\'') => "\"'\" (JSON texts stand in double quotes)".to_string(),
            Some(c) if c.is_alphabetic() => {
                let word: String = rest.chars().take_while(|c| c.is_alphanumeric()).collect();
                quoted(&word)
            }
            Some(c) => quoted(&c.to_string()),
        };
        (self.at, format!("expected {expected}, found {found}"))
    }

    fn value(&mut self) -> Fallible<Node> {
        self.space();
        let start = self.at as u32;
        let data = match self.peek() {
            Some(b'{') => self.nested(Self::object)?,
            Some(b'[') => self.nested(Self::list)?,
            Some(b'"') => Data::Text(self.string()?.into_boxed_str()),
            Some(b'-' | b'0'..=b'9') => self.number()?,
            _ => {
                let words = [
                    ("null", Data::Null),
                    ("true", Data::Bool(true)),
                    ("false", Data::Bool(false)),
                ];
                let rest = self.text.get(self.at..).unwrap_or("");
                let word_end = rest
                    .find(|c: char| !c.is_alphanumeric())
                    .unwrap_or(rest.len());
                match words
                    .into_iter()
                    .find(|(word, _)| *word == &rest[..word_end])
                {
                    Some((word, data)) => {
                        self.at += word.len();
                        data
                    }
                    None => return Err(self.unexpected("a value")),
                }
            }
        };
        Ok(Node { start, data })
    }

    fn nested(&mut self, body: fn(&mut Self) -> Fallible<Data>) -> Fallible<Data> {
        if self.depth == MAX_DEPTH {
            return Err((self.at, format!("nested more than {MAX_DEPTH} deep")));
        }
        self.depth += 1;
        self.at += 1;
        let data = body(self);
        self.depth -= 1;
        data
    }

    fn list(&mut self) -> Fallible<Data> {
        let mut items = Vec::new();
        self.space();
        if self.peek() == Some(b']') {
            self.at += 1;
            return Ok(Data::List(items));
        }
        loop {
            items.push(self.value()?);
            self.space();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b']') => {
                    self.at += 1;
                    items.shrink_to_fit();
                    return Ok(Data::List(items));
                }
                _ => return Err(self.unexpected("\",\" or \"]\"")),
            }
        }
    }

    fn object(&mut self) -> Fallible<Data> {
        let mut members: Vec<Member> = Vec::new();
        let mut keys: HashSet<Box<str>> = HashSet::new();
        self.space();
        if self.peek() == Some(b'}') {
            self.at += 1;
            return Ok(Data::Object(members));
        }
        loop {
            self.space();
            let key_start = self.at;
            if self.peek() != Some(b'"') {
                let what = if self.peek() == Some(b'}') {
                    "a key (a comma must not end an object)"
                } else {
                    "a key in double quotes"
                };
                return Err(self.unexpected(what));
            }
            let key = self.string()?.into_boxed_str();
            if !keys.insert(key.clone()) {
                return Err((
                    key_start,
                    format!("the key {} appears twice in one object", quoted(&key)),
                ));
            }
            self.space();
            if self.peek() != Some(b':') {
                return Err(self.unexpected("\":\""));
            }
            self.at += 1;
            let value = self.value()?;
            members.push(Member {
                key,
                key_start: key_start as u32,
                value,
            });
            self.space();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b'}') => {
                    self.at += 1;
                    return Ok(Data::Object(members));
                }
                _ => return Err(self.unexpected("\",\" or \"}\"")),
            }
        }
    }

    /// number = [ "-" ] int [ frac ] [ exp ] (RFC 8259 §6).
    fn number(&mut self) -> Fallible<Data> {
        let start = self.at;
        if self.peek() == Some(b'-') {
            self.at += 1;
        }
        match self.peek() {
            Some(b'0') => {
                self.at += 1;
                if matches!(self.peek(), Some(b'0'..=b'9')) {
                    return Err((
                        start,
                        "a number must not start with a zero and go on with digits".into(),
                    ));
                }
            }
            Some(b'1'..=b'9') => self.digits()?,
            _ => return Err(self.unexpected("a digit")),
        }
        if self.peek() == Some(b'.') {
            self.at += 1;
            self.digits()?;
        }
        if matches!(self.peek(), Some(b'e' | b'E')) {
            self.at += 1;
            if matches!(self.peek(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            self.digits()?;
        }
        let token = &self.text[start..self.at];
        match token.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Data::Number(x)),
            _ => Err((
                start,
                format!(
                    "the number {} is out of range: at most 1.8e308 in magnitude",
                    quoted(token)
                ),
            )),
        }
    }

    fn digits(&mut self) -> Fallible<()> {
        if !matches!(self.peek(), Some(b'0'..=b'9')) {
            return Err(self.unexpected("a digit"));
        }
        while matches!(self.peek(), Some(b'0'..=b'9')) {
            self.at += 1;
        }
        Ok(())
    }

    /// A string; `at` is on its opening quote.
    fn string(&mut self) -> Fallible<String> {
        let open = self.at;
        self.at += 1;
        let mut out = String::new();
        loop {
            // All bytes looked for are ASCII, so every slice below ends on a character boundary.
            let plain = self.text.as_bytes()[self.at..]
                .iter()
                .position(|b| matches!(b, b'"' | b'\\') || *b < 0x20)
                .ok_or((open, "this text has no closing quote".to_string()))?;
            out.push_str(&self.text[self.at..self.at + plain]);
            self.at += plain;
            match self.peek() {
                Some(b'"') => {
                    self.at += 1;
                    return Ok(out);
                }
                Some(b'\\') => out.push(self.escape()?),
                Some(b'\n' | b'\r') => {
                    return Err((open, "this text has no closing quote on its line".into()));
                }
                other => {
                    let byte = other.unwrap_or(0);
                    return Err((
                        self.at,
                        format!(
                            "control character 0x{byte:02x} in a text (write it as \\u{byte:04x})"
                        ),
                    ));
                }
            }
        }
    }

    fn escape(&mut self) -> Fallible<char> {
        let start = self.at;
        self.at += 1;
        let escaped = match self.peek() {
            Some(b'"') => '"',
            Some(b'\\') => '\\',
            Some(b'/') => '/',
            Some(b'b') => '\u{8}',
            Some(b'f') => '\u{c}',
            Some(b'n') => '\n',
            Some(b'r') => '\r',
            Some(b't') => '\t',
            Some(b'u') => {
                self.at += 1;
                let high = self.hex4(start)?;
                return self.unicode(start, high);
            }
            _ => {
                return Err((
                    start,
                    "unknown escape: one of \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\uXXXX".into(),
                ));
            }
        };
        self.at += 1;
        Ok(escaped)
    }

    /// Joins a surrogate pair; a surrogate alone encodes no character.
    fn unicode(&mut self, start: usize, high: u32) -> Fallible<char> {
        let mut code = high;
        if (0xd800..0xdc00).contains(&high) && self.text.as_bytes()[self.at..].starts_with(b"\\u") {
            self.at += 2;
            let low = self.hex4(start)?;
            if (0xdc00..0xe000).contains(&low) {
                code = 0x10000 + ((high - 0xd800) << 10) + (low - 0xdc00);
            }
        }
        char::from_u32(code).ok_or_else(|| {
            (
                start,
                format!("\\u{high:04x} is half a surrogate pair, not a character"),
            )
        })
    }

    fn hex4(&mut self, start: usize) -> Fallible<u32> {
        let digits = self.text.as_bytes().get(self.at..self.at + 4);
        let digits = digits.filter(|d| d.iter().all(u8::is_ascii_hexdigit));
        let code = digits
            .and_then(|d| std::str::from_utf8(d).ok())
            .and_then(|d| u32::from_str_radix(d, 16).ok());
        self.at += 4;
        code.ok_or((
            start,
            "\\u must be followed by four hexadecimal digits".to_string(),
        ))
    }
}
