//! Pages of the book, and the blocks in them.

use super::program::{read, repository};
use std::path::PathBuf;

/// A fenced block of a page.
#[derive(Debug, PartialEq)]
pub struct Block {
    /// The first word after the fence.
    pub language: String,
    /// What follows it there.
    pub note: String,
    /// The file it belongs to: the last name in code type of a line before it that ends with a colon.
    pub file: Option<String>,
    /// What stands between the fences.
    pub text: String,
    /// Line of the opening fence, from 1.
    pub line: usize,
}

/// The folder of the book.
pub fn docs() -> PathBuf {
    repository().join("docs")
}

/// The blocks of a page of the book.
pub fn blocks(page: &str) -> Vec<Block> {
    parse(&read(&docs().join(page)))
}

fn parse(markdown: &str) -> Vec<Block> {
    let (mut out, mut before) = (Vec::new(), "");
    let mut lines = markdown.lines().enumerate();
    while let Some((i, line)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else {
            if !line.trim().is_empty() {
                before = line;
            }
            continue;
        };
        let mut text = String::new();
        for (_, line) in lines.by_ref().take_while(|(_, l)| *l != "```") {
            text.push_str(line);
            text.push('\n');
        }
        let (language, note) = info.split_once(' ').unwrap_or((info, ""));
        out.push(Block {
            language: language.into(),
            note: note.into(),
            file: file(before),
            text,
            line: i + 1,
        });
        before = "";
    }
    out
}

/// `src/lib.rs` of "In `src/lib.rs`:".
fn file(before: &str) -> Option<String> {
    let start = before.strip_suffix("`:")?;
    Some(start[start.rfind('`')? + 1..].to_owned())
}

#[test]
fn blocks_and_their_files() {
    let page = "Words.\n\n```sh fails\na\nb\n```\nIn `x.c`, change `y` in `z/w.c`:\n\n```diff\n-a\n```\n```\n```\n";
    let block = |language: &str, note: &str, file: Option<&str>, text: &str, line| Block {
        language: language.into(),
        note: note.into(),
        file: file.map(Into::into),
        text: text.into(),
        line,
    };
    let expected = [
        block("sh", "fails", None, "a\nb\n", 3),
        block("diff", "", Some("z/w.c"), "-a\n", 9),
        block("", "", None, "", 12),
    ];
    assert_eq!(parse(page), expected);
}
