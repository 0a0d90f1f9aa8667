//! Links of the book and of the README, and the table of contents.

use super::pages::docs;
use super::program::{read, repository};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// All pages below a folder.
fn pages(folder: &Path, out: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for path in entries.map(|e| e.unwrap_or_else(|e| panic!("{e}")).path()) {
        if path.is_dir() {
            pages(&path, out);
        } else if path.extension() == Some("md".as_ref()) {
            out.push(path);
        }
    }
}

/// Text without what stands between fences, and without code in lines.
fn prose(markdown: &str) -> String {
    let (mut out, mut fenced) = (String::new(), false);
    for line in markdown.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced && !line.starts_with("    ") {
            let parts = line.split('`').enumerate();
            parts.for_each(|(i, part)| out.push_str(if i % 2 == 0 { part } else { "code" }));
            out.push('\n');
        }
    }
    out
}

/// Targets of links and images.
fn targets(markdown: &str) -> Vec<String> {
    let text = prose(markdown);
    let ends = text.match_indices("](").map(|(at, _)| &text[at + 2..]);
    ends.filter_map(|rest| rest.split([')', ' ', '\n']).next())
        .map(str::to_owned)
        .collect()
}

/// Anchors that mdbook makes of headings: small letters, digits, `-` and `_`, a hyphen for each space.
fn anchors(markdown: &str) -> BTreeSet<String> {
    let (mut out, mut fenced) = (BTreeSet::new(), false);
    for line in markdown.lines() {
        fenced ^= line.starts_with("```");
        let heading = line.trim_start_matches('#');
        if !fenced && heading.len() < line.len() && heading.starts_with(' ') {
            let kept = heading.trim().chars().filter_map(|c| match c {
                ' ' => Some('-'),
                c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c.to_ascii_lowercase()),
                _ => None,
            });
            out.insert(kept.collect());
        }
    }
    out
}

#[test]
fn links_lead_somewhere() {
    let mut all = vec![repository().join("README.md")];
    pages(&docs(), &mut all);
    let (mut broken, mut checked) = (Vec::new(), 0);
    for page in &all {
        let text = read(page);
        let folder = page.parent().unwrap_or(Path::new("."));
        for target in targets(&text) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            checked += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let path = if file.is_empty() {
                page.clone()
            } else {
                folder.join(file)
            };
            let sound =
                path.exists() && (anchor.is_empty() || anchors(&read(&path)).contains(anchor));
            if !sound {
                broken.push(format!("{}: {target}", page.display()));
            }
        }
    }
    assert!(checked > 20, "{checked} links: are they read at all?");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// A page that is not in the table of contents is not in the book.
#[test]
fn every_page_is_in_the_table_of_contents() {
    let summary = read(&docs().join("SUMMARY.md"));
    let listed: BTreeSet<PathBuf> = targets(&summary).iter().map(|t| docs().join(t)).collect();
    let mut all = Vec::new();
    pages(&docs(), &mut all);
    for page in all.iter().filter(|p| !p.ends_with("SUMMARY.md")) {
        assert!(listed.contains(page), "SUMMARY.md lacks {}", page.display());
    }
    for page in listed {
        assert!(page.is_file(), "SUMMARY.md names {}", page.display());
    }
}

/// Pages that are part of others, and the folders they include from, exist.
#[test]
fn included_files_exist() {
    let mut all = Vec::new();
    pages(&docs(), &mut all);
    for page in all {
        let text = read(&page);
        for (at, _) in text.match_indices("{{#include ") {
            let rest = &text[at + "{{#include ".len()..];
            let name = rest.split("}}").next().unwrap_or_default().trim();
            let path = page.parent().unwrap_or(Path::new(".")).join(name);
            assert!(path.is_file(), "{} includes {name}", page.display());
        }
    }
}

#[test]
fn targets_and_anchors() {
    let page =
        "# One, two\n[a](b.md#c) `[no](x)` ![i](d.png)\n```\n[no](y)\n# no\n```\n## `f` of x\n";
    assert_eq!(targets(page), ["b.md#c", "d.png"]);
    assert_eq!(
        anchors(page),
        BTreeSet::from(["one-two".into(), "f-of-x".into()])
    );
}
