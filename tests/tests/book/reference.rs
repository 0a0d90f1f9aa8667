//! The reference pages: what follows the mark in each is what the code says.

use super::pages::docs;
use super::program::{NAME, built, read, repository, succeed};
use resolvent_api::PluginKind;
use resolvent_engine::plugin::Registry;
use std::process::Command;

/// What stands before it in a page is written by hand.
const MARK: &str = "<!-- What follows is generated: RESOLVENT_WRITE_BOOK=1 cargo test --release -p resolvent-tests --test book -->\n";

/// The page ends with what is generated, or is made to.
fn agrees(page: &str, generated: &str) {
    let path = docs().join("reference").join(page);
    let text = read(&path);
    let (by_hand, there) = text
        .split_once(MARK)
        .unwrap_or_else(|| panic!("{} lacks its mark: {MARK}", path.display()));
    if std::env::var_os("RESOLVENT_WRITE_BOOK").is_some() {
        std::fs::write(&path, format!("{by_hand}{MARK}{generated}"))
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        return;
    }
    let before = by_hand.lines().count() + 1;
    let differs = there
        .lines()
        .zip(generated.lines())
        .position(|(a, b)| a != b);
    assert!(
        there == generated,
        "{} is not what the code says, from line {:?} on; write it anew with RESOLVENT_WRITE_BOOK=1",
        path.display(),
        differs.map(|line| before + line + 1)
    );
}

#[test]
fn scenes() {
    agrees("scene.md", &resolvent_scene::scene_reference());
}

/// The plugins that come with the program.
#[test]
fn plugins() {
    let registry = Registry::new(&[built()]);
    let mut decls = Vec::new();
    for found in registry.found() {
        if found.path.parent() == Some(&built()) {
            let plugin = registry.load(found.kind, &found.path);
            let plugin = plugin.unwrap_or_else(|e| panic!("{e}"));
            decls.push(plugin.decl.clone());
        }
    }
    let rank = |kind: &str| PluginKind::ALL.iter().position(|k| k.name() == kind);
    decls.sort_by(|a, b| rank(&a.kind).cmp(&rank(&b.kind)).then(a.name.cmp(&b.name)));
    agrees("plugins.md", &resolvent_scene::plugin_reference(&decls));
}

/// What every command says of itself.
#[test]
fn commands() {
    let mut text = String::new();
    help(&mut Vec::new(), &mut text);
    agrees("cli.md", &text);
}

fn help(command: &mut Vec<String>, text: &mut String) {
    let mut run = Command::new(built().join(NAME));
    let said = succeed(run.args(&*command).arg("--help"));
    let said: Vec<&str> = said.trim_end().lines().map(str::trim_end).collect();
    let name = [&["resolvent".to_owned()], &command[..]].concat().join(" ");
    *text += &format!("\n## {name}\n\n```text\n{}\n```\n", said.join("\n"));
    let rest = said.iter().skip_while(|l| **l != "Commands:").skip(1);
    for line in rest.take_while(|l| !l.is_empty()) {
        let name = line.split_whitespace().next().unwrap_or_default();
        if line.starts_with("  ") && !line.starts_with("   ") && name != "help" {
            command.push(name.into());
            help(command, text);
            command.pop();
        }
    }
}

/// The header's constants and types, with its comments.
#[test]
fn abi() {
    let header = read(&repository().join("core/api/include/resolvent.h"));
    agrees("abi.md", &header_reference(&header));
}

fn header_reference(header: &str) -> String {
    let (mut constants, mut types) = (String::new(), String::new());
    let (mut comment, mut group) = (String::new(), String::new());
    let mut lines = header.lines();
    while let Some(line) = lines.next() {
        if line.starts_with("/*") {
            let mut whole = vec![line];
            while whole.last().is_some_and(|l| !l.ends_with("*/")) {
                whole.extend(lines.next());
            }
            comment = words(&whole);
            continue;
        }
        let define = line
            .strip_prefix("#define ")
            .and_then(|d| d.split_once(' '));
        if let Some((name, value)) = define.filter(|(n, _)| !n.contains('(') && !comment.is_empty())
        {
            if group_of(name) != group {
                group = group_of(name);
                constants +=
                    &format!("\n### {group}\n\n| constant | value | meaning |\n|---|---|---|\n");
            }
            constants += &format!("| `{name}` | {value} | {} |\n", comment.replace('|', "\\|"));
        } else if line.starts_with("typedef ") {
            let mut whole = vec![line];
            while whole
                .last()
                .is_some_and(|l| !l.ends_with(';') || l.starts_with(' '))
            {
                whole.extend(lines.next());
            }
            types += &type_section(&whole, &comment);
        }
        comment.clear();
    }
    assert!(!constants.is_empty() && !types.is_empty());
    format!("\n## Constants\n{constants}\n## Types\n{types}")
}

/// The text of a comment.
fn words(lines: &[&str]) -> String {
    let plain = lines.iter().map(|l| {
        let l = l.trim().trim_start_matches("/*").trim_end_matches("*/");
        l.trim().trim_start_matches('*').trim()
    });
    plain.collect::<Vec<_>>().join(" ").trim().to_owned()
}

/// `RESOLVENT_PARAM_FLAGS` of `RESOLVENT_PARAM_FLAGS_MIN`, `RESOLVENT_MODE` of `RESOLVENT_MODE_RADIANCE`.
fn group_of(name: &str) -> String {
    let parts: Vec<&str> = name.split('_').collect();
    let long = matches!(parts.get(2), Some(&"KIND" | &"FLAGS" | &"TRAITS"));
    parts[..parts.len().min(if long { 3 } else { 2 })].join("_")
}

/// A type with its comment, as C has it, and what it refers to.
fn type_section(lines: &[&str], comment: &str) -> String {
    let text = lines.join("\n");
    let names = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    let mut names: Vec<&str> = names.filter(|n| n.starts_with("resolvent_")).collect();
    let last = lines.last().copied().unwrap_or_default();
    let own = match last.strip_prefix("} ") {
        Some(own) => own.trim_end_matches(';'),
        // `typedef int32_t resolvent_status;`, `typedef void (*resolvent_task)(...);`
        None => names.first().copied().unwrap_or_default(),
    };
    let own = own.to_owned();
    names.sort_unstable();
    names.dedup();
    let links: Vec<String> = names
        .iter()
        .filter(|n| **n != own && **n != "resolvent_plugin")
        .map(|n| format!("[`{n}`](#{n})"))
        .collect();
    let mut out = format!("\n### {own}\n\n");
    if !comment.is_empty() {
        out += &format!("{comment}\n\n");
    }
    out += &format!("```c\n{text}\n```\n");
    if !links.is_empty() {
        out += &format!("\nSee {}.\n", links.join(", "));
    }
    out
}
