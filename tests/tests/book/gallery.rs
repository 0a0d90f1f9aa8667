//! The gallery's commands run as they stand, but for fewer pixels and samples, and every picture has its command.

use super::pages::{blocks, docs};
use super::program::{NAME, built, kept, read, repository, run, said};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// The words of a command, with lines that end with a backslash joined.
fn commands(text: &str) -> Vec<Vec<String>> {
    let text = text.replace("\\\n", " ");
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect();
    text.lines().map(words).collect()
}

/// Pictures of a folder.
fn pictures(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let names = entries.map(|e| e.unwrap_or_else(|e| panic!("{e}")).file_name());
    names.map(|n| n.to_string_lossy().into_owned()).collect()
}

#[test]
fn every_picture_has_its_command() {
    let page = read(&docs().join("gallery.md"));
    let mut made = BTreeSet::new();
    for block in blocks("gallery.md").iter().filter(|b| b.language == "sh") {
        for mut words in commands(&block.text) {
            assert_eq!(
                words.remove(0),
                "resolvent",
                "docs/gallery.md:{}",
                block.line
            );
            let mut set = |option: &str, value: &str| {
                let at = words.iter().position(|w| w == option);
                let at =
                    at.unwrap_or_else(|| panic!("docs/gallery.md:{}: no {option}", block.line));
                std::mem::replace(&mut words[at + 1], value.to_owned())
            };
            let out = kept("gallery").join("picture.png");
            let picture = set("-o", &out.display().to_string());
            set("--resolution", "24x16");
            set("--spp", "1");
            let mut render = Command::new(built().join(NAME));
            render.env("XDG_CACHE_HOME", kept("cache"));
            let done = run(render.args(&words).current_dir(repository()));
            // Its stage is also rendered by the tests of the command, which install the converter.
            let unread = words[1].ends_with(".usda") && said(&done).contains("no Python has it");
            assert!(
                done.status.success() || unread,
                "docs/gallery.md:{}:\n{}",
                block.line,
                said(&done)
            );
            let name = picture.strip_prefix("docs/gallery/");
            let name = name.unwrap_or_else(|| panic!("docs/gallery.md:{}: {picture}", block.line));
            assert!(
                page.contains(&format!("](gallery/{name})")),
                "{name} is not shown"
            );
            made.insert(name.to_owned());
        }
    }
    assert_eq!(made, pictures(&docs().join("gallery")));
}
