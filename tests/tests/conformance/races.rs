//! `plugin check --brief` under ThreadSanitizer: plugins are instrumented, the program is not, and finds the sanitizer preloaded. What
//! the two share is handed over when threads start and end, which the sanitizer sees.
//!
//! Where gcc has no `libtsan`, or the system's address layout does not suit it, there is nothing to be tested; likewise, for plugins in Rust,
//! where the toolchain does not know `-Zsanitizer`.

use super::builtin::params;
use super::program::{package, resolvent};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn folder() -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("races");
    std::fs::create_dir_all(&path).unwrap_or_else(|e| panic!("{e}"));
    path
}

fn run(command: &mut Command) -> Output {
    command
        .output()
        .unwrap_or_else(|e| panic!("{command:?}: {e}"))
}

/// Builds a library with gcc; false if it can't.
fn gcc(output: &Path, arguments: &[&str]) -> bool {
    let mut gcc = Command::new("gcc");
    gcc.args(["-g", "-O1", "-shared", "-fPIC", "-I"]);
    gcc.arg(package().join("../core/api/include"));
    gcc.args(arguments).arg("-o").arg(output).arg("-lm");
    gcc.output().is_ok_and(|o| o.status.success())
}

/// The library of a C fixture, instrumented.
fn fixture(kind: &str, mistake: &str) -> Option<PathBuf> {
    let path = folder().join(format!("{kind}_{}.so", mistake.to_lowercase()));
    let source = package().join(format!("fixtures/broken/{kind}.c"));
    let definition = format!("-D{mistake}");
    let source = source.display().to_string();
    gcc(&path, &["-fsanitize=thread", &definition, &source]).then_some(path)
}

/// What the sanitizer says of a plugin; `None` where it can't run.
fn reports(library: &Path, preload: &str, more: &[&str]) -> Option<String> {
    let program = resolvent();
    let check = |wrapper: &[&str]| {
        let mut line: Vec<_> = wrapper.iter().map(|w| (*w).into()).collect();
        line.push(program.get_program().to_owned());
        let mut command = Command::new(&line[0]);
        command
            .args(&line[1..])
            .args(["plugin", "check", "--brief"]);
        command.arg(library).args(more);
        command.env("LD_PRELOAD", preload);
        run(command.env("TSAN_OPTIONS", "exitcode=66"))
    };
    let unfit = |o: &Output| String::from_utf8_lossy(&o.stderr).contains("FATAL: ThreadSanitizer");
    let mut out = check(&[]);
    if unfit(&out) {
        // Addresses at random do not leave it room on some systems.
        out = check(&["setarch", "-R"]);
    }
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    if unfit(&out) || text.contains("cannot be preloaded") || text.contains("setarch:") {
        println!("ThreadSanitizer does not run here: {text}");
        return None;
    }
    let stdout = String::from_utf8_lossy(&out.stdout);
    assert!(
        stdout.contains("threads"),
        "{}: {stdout}{text}",
        library.display()
    );
    Some(text)
}

const RUNTIME: &str = "libtsan.so.2";

/// Those without a mistake are clean; those with a race are found, also where every answer is right.
#[test]
fn of_plugins_in_c() {
    let cases = [
        ("phase", "NO_MISTAKE", false),
        ("bsdf", "NO_MISTAKE", false),
        ("medium", "NO_MISTAKE", false),
        ("phase", "COUNTS", true),
        ("phase", "LAZY", true),
    ];
    for (kind, mistake, racy) in cases {
        let Some(library) = fixture(kind, mistake) else {
            return println!("gcc builds nothing with -fsanitize=thread here");
        };
        let Some(text) = reports(&library, RUNTIME, &[]) else {
            return;
        };
        let found = text.contains("WARNING: ThreadSanitizer: data race");
        assert_eq!(found, racy, "{kind} with {mistake}:\n{text}");
        assert!(!racy || text.contains(&format!("{kind}.c:")), "{text}");
    }
}

/// Built-in plugins, their code and that of `resolvent-api` in them instrumented. Those that divide work among the host's threads
/// (`vdb`, `procedural`, integrators) are not among them: how the host, which is not instrumented, hands work over is not seen, and
/// everything that is handed over would look like a race.
#[test]
fn of_plugins_in_rust() {
    let plugins = [
        ("medium", "homogeneous"),
        ("phase", "tabulated"),
        ("bsdf", "mix"),
        ("bsdf", "principled"),
    ];
    let target = folder().join("target");
    let triple = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--release", "--offline", "--target", &triple]);
    build.args(["--config", "profile.release.opt-level=1"]);
    build.args(["--config", "profile.release.codegen-units=16"]);
    for (kind, name) in plugins {
        build.arg("-p").arg(format!("resolvent-{kind}-{name}"));
    }
    build
        .current_dir(package().join(".."))
        .arg("--target-dir")
        .arg(&target);
    // The flag is of the nightly toolchain; a stable one has it, too, if it is told that this is meant.
    build.env("RUSTC_BOOTSTRAP", "1");
    build.env(
        "RUSTFLAGS",
        "-Zsanitizer=thread -Cunsafe-allow-abi-mismatch=sanitizer",
    );
    let built = run(&mut build);
    if !built.status.success() {
        let why = String::from_utf8_lossy(&built.stderr);
        return println!("this toolchain builds nothing with -Zsanitizer=thread: {why}");
    }
    // LLVM's names for what gcc's runtime does under those of the C library.
    let source = folder().join("names.c");
    let text = "#include <string.h>\n\
        void *__tsan_memcpy(void *d, const void *s, size_t n) { return memcpy(d, s, n); }\n\
        void *__tsan_memmove(void *d, const void *s, size_t n) { return memmove(d, s, n); }\n\
        void *__tsan_memset(void *d, int c, size_t n) { return memset(d, c, n); }\n";
    std::fs::write(&source, text).unwrap_or_else(|e| panic!("{e}"));
    let names = folder().join("names.so");
    if !gcc(&names, &["-fno-builtin", &source.display().to_string()]) {
        return println!("there is no gcc");
    }
    let preload = format!("{}:{RUNTIME}", names.display());
    for (kind, name) in plugins {
        let library = format!(
            "{triple}/release/libresolvent_{kind}_{}.so",
            name.replace('-', "_")
        );
        let given = params(kind, name);
        let more: Vec<&str> = given.iter().flat_map(|p| ["--params", p]).collect();
        let Some(text) = reports(&target.join(library), &preload, &more) else {
            return;
        };
        assert!(
            !text.contains("WARNING: ThreadSanitizer"),
            "{name}:\n{text}"
        );
    }
}
