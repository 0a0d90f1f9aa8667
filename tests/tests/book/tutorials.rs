//! The tutorials, done word for word by somebody who has the program and the crate or the header, and not the sources.
//!
//! In the order of the page: commands (`sh`) run in an empty folder, and in the folder that earlier ones changed to; changes
//! (`diff`) and whole files are made in the file that the line before the block names; what a command says (`text`) has the
//! lines shown, in their order, `…` standing for anything. Commands of a block `sh fails` end with a failure, all others don't.

use super::pages::{Block, blocks};
use super::program::{NAME, built, kept, read, repository, run, said, succeed};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::Instant;

/// A folder outside of the repository that is gone afterwards.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

impl Scratch {
    fn new(name: &str) -> Self {
        let name = format!("resolvent-book-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(path.join("work")).unwrap_or_else(|e| panic!("{e}"));
        Self(path)
    }

    /// The program and its plugins, with no sources about.
    fn install(&self) -> PathBuf {
        let bin = self.0.join("bin");
        std::fs::create_dir(&bin).unwrap_or_else(|e| panic!("{e}"));
        let entries = std::fs::read_dir(built()).unwrap_or_else(|e| panic!("{e}"));
        for path in entries.map(|e| e.unwrap_or_else(|e| panic!("{e}")).path()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let plugin = path.extension() == Some(std::env::consts::DLL_EXTENSION.as_ref());
            if name == NAME || plugin {
                std::fs::copy(&path, bin.join(&*name))
                    .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            }
        }
        bin
    }

    /// Lets cargo find `resolvent-api` as it will be on crates.io: the files of the package alone.
    fn publish(&self) {
        let config = format!(
            "[patch.crates-io]\nresolvent-api = {{ path = {:?} }}\n",
            package().display().to_string()
        );
        let folder = self.0.join(".cargo");
        std::fs::create_dir(&folder).unwrap_or_else(|e| panic!("{e}"));
        std::fs::write(folder.join("config.toml"), config).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// The unpacked package of `resolvent-api`.
fn package() -> &'static Path {
    static PACKAGE: OnceLock<PathBuf> = OnceLock::new();
    PACKAGE.get_or_init(|| {
        let target = kept("package");
        let mut pack = Command::new(cargo());
        pack.args(["package", "-p", "resolvent-api", "--no-verify", "--quiet"]);
        pack.args(["--allow-dirty", "--target-dir"]).arg(&target);
        offline(&mut pack);
        succeed(pack.current_dir(repository()));
        let folder = target.join("package");
        let name = format!("resolvent-api-{}", env!("CARGO_PKG_VERSION"));
        drop(std::fs::remove_dir_all(folder.join(&name)));
        let archive = format!("{name}.crate");
        succeed(
            Command::new("tar")
                .args(["xzf", &archive])
                .current_dir(&folder),
        );
        folder.join(name)
    })
}

fn cargo() -> std::ffi::OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// What the renderer was built with needs no download.
fn offline(command: &mut Command) {
    command.env("CARGO_NET_OFFLINE", "true");
}

/// Somebody at work on a page.
struct Reader {
    page: String,
    bin: PathBuf,
    folder: PathBuf,
    said: String,
}

impl Reader {
    fn follow(&mut self, block: &Block) {
        match (block.language.as_str(), &block.file) {
            ("sh", None) => self.run(block),
            ("text", None) => self.compare(block),
            ("diff", Some(file)) => self.change(block, file),
            (_, Some(file)) => {
                let path = self.folder.join(file);
                std::fs::write(&path, &block.text)
                    .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            }
            (language, None) => assert!(
                !matches!(language, "diff" | "sh" | "text"),
                "{}: which file?",
                self.at(block)
            ),
        }
    }

    fn at(&self, block: &Block) -> String {
        format!("docs/{}:{}", self.page, block.line)
    }

    /// Runs commands, in several parts if they change the folder.
    fn run(&mut self, block: &Block) {
        self.said.clear();
        let mut part = String::new();
        let mut lines = block.text.lines().peekable();
        while let Some(line) = lines.next() {
            part += &format!("{line}\n");
            let last = lines.peek().is_none();
            if last || line.starts_with("cd ") {
                let fails = last && block.note == "fails";
                self.shell(&self.at(block), &std::mem::take(&mut part), fails);
            }
        }
    }

    /// Runs commands in the folder that earlier ones changed to. All projects share what cargo builds, so `resolvent-api` is compiled
    /// once.
    fn shell(&mut self, at: &str, commands: &str, fails: bool) {
        let target = self.folder.join("target");
        if self.folder.join("Cargo.toml").exists() && !target.exists() {
            std::os::unix::fs::symlink(kept("target"), &target).unwrap_or_else(|e| panic!("{e}"));
        }
        let there = self.bin.join("folder");
        let path = std::env::var("PATH").unwrap_or_default();
        let mut shell = Command::new("sh");
        shell.args(["-e", "-c"]);
        shell.arg(format!("{commands}pwd > {:?}", there.display().to_string()));
        shell.env("PATH", format!("{}:{path}", self.bin.display()));
        // What cargo told this test is not meant for the one it runs.
        for (name, _) in std::env::vars().filter(|(n, _)| n.starts_with("CARGO_")) {
            if name != "CARGO_HOME" {
                shell.env_remove(name);
            }
        }
        offline(&mut shell);
        let start = Instant::now();
        let out = run(shell.current_dir(&self.folder));
        let (seconds, text) = (start.elapsed().as_secs_f64(), said(&out));
        println!("{at}: {seconds:.1} s\n{commands}{text}");
        assert_eq!(out.status.success(), !fails, "{at}:\n{commands}\n{text}");
        self.said += &text;
        if !fails {
            self.folder = read(&there).trim_end().into();
        }
    }

    /// The lines shown are among those that the last commands said.
    fn compare(&self, block: &Block) {
        let mut lines = self.said.lines();
        for shown in block.text.lines().filter(|l| *l != "…") {
            assert!(
                lines.any(|line| matches(shown, line)),
                "{}: nobody says\n{shown}\n(in this place), but\n{}",
                self.at(block),
                self.said
            );
        }
    }

    /// Replaces the lines of a diff that it takes away by those that it adds.
    fn change(&self, block: &Block, file: &str) {
        let path = self.folder.join(file);
        let side = |sign: char| -> String {
            let lines = block.text.lines().filter_map(|l| {
                let kept = l.strip_prefix([' ', sign]);
                // An editor may have taken a space away from the end of an empty line.
                kept.or_else(|| l.is_empty().then_some(""))
            });
            lines.map(|l| format!("{l}\n")).collect()
        };
        let (text, old) = (read(&path), side('-'));
        assert_eq!(
            text.matches(&old).count(),
            1,
            "{}: is not once in {}:\n{old}",
            self.at(block),
            path.display()
        );
        std::fs::write(&path, text.replace(&old, &side('+')))
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}

/// `…` stands for anything.
fn matches(shown: &str, line: &str) -> bool {
    let mut parts = shown.split('…');
    let Some(mut rest) = parts.next().and_then(|first| line.strip_prefix(first)) else {
        return false;
    };
    let parts: Vec<&str> = parts.collect();
    let Some((last, middle)) = parts.split_last() else {
        return rest.is_empty();
    };
    for part in middle {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[test]
fn ellipses() {
    assert!(matches("ok", "ok") && !matches("ok", "ok."));
    assert!(matches("a … c …", "a b c d") && matches("…", "") && matches("a…a", "aa"));
    assert!(!matches("a … c", "a b c d") && !matches("ab…bc", "abc"));
}

/// Does everything that a page says.
fn work_through(page: &str) {
    let name = page.trim_end_matches(".md").replace('/', "-");
    let scratch = Scratch::new(&name);
    scratch.publish();
    let mut reader = Reader {
        page: page.into(),
        bin: scratch.install(),
        folder: scratch.0.join("work"),
        said: String::new(),
    };
    let blocks = blocks(page);
    let commands = blocks.iter().filter(|b| b.language == "sh");
    assert!(commands.count() > 0, "docs/{page} has no commands");
    blocks.iter().for_each(|b| reader.follow(b));
}

#[test]
fn from_an_empty_folder() {
    work_through("plugins.md");
}

#[test]
fn media() {
    work_through("tutorials/medium.md");
}

#[test]
fn bsdfs() {
    work_through("tutorials/bsdf.md");
}

#[test]
fn phase_functions() {
    work_through("tutorials/phase.md");
}

#[test]
fn integrators() {
    work_through("tutorials/integrator.md");
}
