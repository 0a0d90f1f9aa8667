//! `resolvent plugin new`: a complete plugin to start from.

use crate::args::{Language, New, NewKind};
use crate::failure::{Code, Outcome, failed, input};
use resolvent_api::PluginKind;
use resolvent_engine::plugin::Registry;
use std::path::{Path, PathBuf};

/// A file of the templates.
macro_rules! template {
    ($path:literal) => {
        include_str!(concat!("../../plugins/template/", $path))
    };
}

/// The header that C plugins are compiled with: the file's text is part of the program, so both always agree.
const HEADER: &str = include_str!("../../core/api/include/resolvent.h");

/// Names of a project's files and their contents, placeholders and all.
fn files(kind: NewKind, language: Language, name: &str) -> Vec<(String, &'static str)> {
    let (rust, c, scene) = match kind {
        NewKind::Medium => (
            [
                template!("rust/medium/lib.rs"),
                template!("rust/medium/tests.rs"),
            ],
            [template!("c/medium/plugin.c"), template!("c/medium/test.c")],
            template!("scene/medium.json"),
        ),
        NewKind::Bsdf => (
            [
                template!("rust/bsdf/lib.rs"),
                template!("rust/bsdf/tests.rs"),
            ],
            [template!("c/bsdf/plugin.c"), template!("c/bsdf/test.c")],
            template!("scene/bsdf.json"),
        ),
        NewKind::Phase => (
            [
                template!("rust/phase/lib.rs"),
                template!("rust/phase/tests.rs"),
            ],
            [template!("c/phase/plugin.c"), template!("c/phase/test.c")],
            template!("scene/phase.json"),
        ),
        NewKind::Integrator => (
            [
                template!("rust/integrator/lib.rs"),
                template!("rust/integrator/tests.rs"),
            ],
            [
                template!("c/integrator/plugin.c"),
                template!("c/integrator/test.c"),
            ],
            template!("scene/integrator.json"),
        ),
    };
    let mut out = vec![("scene.json".to_owned(), scene)];
    match language {
        Language::Rust => {
            out.push(("Cargo.toml".into(), template!("rust/Cargo.toml.in")));
            out.push(("README.md".into(), template!("rust/README.md.in")));
            out.push((".gitignore".into(), template!("rust/gitignore")));
            out.push(("src/lib.rs".into(), rust[0]));
            out.push(("src/tests.rs".into(), rust[1]));
        }
        Language::C => {
            out.push(("Makefile".into(), template!("c/Makefile.in")));
            out.push(("README.md".into(), template!("c/README.md.in")));
            out.push(("resolvent.h".into(), HEADER));
            out.push((format!("{name}.c"), c[0]));
            out.push(("test.c".into(), c[1]));
        }
    }
    out
}

/// Runs `plugin new`.
pub fn run(a: &New) -> Outcome {
    let name = a.name.as_str();
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(plain) {
        return Err(input(format!(
            "'{name}' is no name for a plugin: small letters, digits and '-', a letter first"
        )));
    }
    let folder = a.to.clone().unwrap_or_else(|| PathBuf::from(name));
    let taken = std::fs::read_dir(&folder).is_ok_and(|mut entries| entries.next().is_some());
    if taken || folder.is_file() {
        return Err(input(format!(
            "{}: is there already; choose another folder with --to",
            folder.display()
        )));
    }
    let kind = match a.kind {
        NewKind::Medium => PluginKind::Medium,
        NewKind::Phase => PluginKind::Phase,
        NewKind::Bsdf => PluginKind::Bsdf,
        NewKind::Integrator => PluginKind::Integrator,
    };
    let library = Registry::file_name(kind, name);
    let library = match a.lang {
        Language::Rust => format!("target/release/{library}"),
        Language::C => library,
    };
    let api = dependency(a.api.as_deref())?;
    for (path, text) in files(a.kind, a.lang, name) {
        let text = text
            .replace("@NAME@", name)
            .replace("@KIND@", kind.name())
            .replace("@PACKAGE@", &format!("resolvent-{}-{name}", kind.name()))
            .replace("@LIBRARY@", &library)
            .replace("@API@", &api);
        write(&folder.join(path), &text)?;
    }
    let build = match a.lang {
        Language::Rust => "cargo build --release",
        Language::C => "make",
    };
    println!(
        "{} holds the {} plugin {name}. Next:\n  cd {}\n  {build}\n  resolvent plugin check {library} --isolate\n  resolvent render scene.json -o picture.png",
        folder.display(),
        kind.name(),
        folder.display(),
    );
    Ok(Code::Done)
}

fn write(path: &Path, text: &str) -> Outcome<()> {
    let failed = |e: std::io::Error| failed(format!("{}: {e}", path.display()));
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::write(path, text).map_err(failed)
}

/// Where Cargo finds `resolvent-api`: where `--api` says, beside a program that runs where it was built, or on crates.io.
fn dependency(api: Option<&Path>) -> Outcome<String> {
    let is_api = |p: &Path| p.join("Cargo.toml").is_file() && p.join("src/abi.rs").is_file();
    let found = match api {
        Some(path) if is_api(path) => Some(path.canonicalize().map_err(failed)?),
        Some(path) => {
            return Err(input(format!(
                "--api {}: is not the folder of resolvent-api",
                path.display()
            )));
        }
        None => std::env::current_exe().ok().and_then(|exe| {
            let folders = exe.ancestors().map(|f| f.join("core/api"));
            folders.into_iter().find(|f| is_api(f))
        }),
    };
    Ok(match found {
        Some(path) => format!("{{ path = {:?} }}", path.display().to_string()),
        None => format!("{:?}", env!("CARGO_PKG_VERSION")),
    })
}
