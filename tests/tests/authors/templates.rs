//! Projects that `resolvent plugin new` writes.

use super::project::{Project, api, resolvent, run, scratch};

/// Every kind in a language.
fn all(language: &str, build: impl Fn(&Project)) {
    for kind in ["medium", "bsdf", "phase", "integrator"] {
        let name = format!("my-{kind}-{language}");
        let folder = scratch().join(&name);
        // A file may be left from an earlier run.
        drop(std::fs::remove_dir_all(&folder));
        let mut new = resolvent();
        new.args([
            "plugin", "new", &name, "--kind", kind, "--lang", language, "--to",
        ]);
        let said = run(new.arg(&folder).arg("--api").arg(api()));
        let project = Project { folder };
        build(&project);
        // The library that the command named.
        let words = said.split_whitespace();
        let library = words.skip_while(|w| *w != "check").nth(1);
        project.check(library.unwrap_or_else(|| panic!("{said}")));
        project.render(8);
    }
}

#[test]
fn rust() {
    all("rust", |p| {
        p.cargo("build");
        p.cargo("test");
    });
}

#[test]
fn c() {
    all("c", |p| {
        p.make(&["CFLAGS=-O2 -Werror"]);
        p.make(&["test"]);
    });
}

/// What can't be made is said, and nothing is overwritten.
#[test]
fn refused() {
    for (arguments, words) in [
        (["Fog", "--to", "x"], "no name for a plugin"),
        (["fog", "--to", "src"], "is there already"),
    ] {
        let mut new = resolvent();
        new.args(["plugin", "new", "--kind", "medium"])
            .args(arguments);
        let out = new.current_dir(env!("CARGO_MANIFEST_DIR")).output();
        let out = out.unwrap_or_else(|e| panic!("{e}"));
        let stderr = String::from_utf8_lossy(&out.stderr);
        assert!(
            out.status.code() == Some(2) && stderr.contains(words),
            "{stderr}"
        );
    }
}
