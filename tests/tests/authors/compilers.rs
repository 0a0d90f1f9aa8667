//! One algorithm in Rust and in C, by every compiler that is there: all load, and the pictures agree bit for bit.
//!
//! Without `RESOLVENT_COMPILERS` compilers that are not installed are left out; `RESOLVENT_COMPILERS=all` asks for all of them.

use super::project::{Project, api, resolvent, run, scratch};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where distributions put a Rust compiler that is not rustup's.
const OTHER_RUSTC: &str = "/usr/bin/rustc";
/// The oldest that `resolvent-api` compiles with.
const OLDEST: u32 = 88;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/twins")
}

/// What a compiler says it is, if it is there.
fn version(compiler: &str) -> Option<String> {
    let out = Command::new(compiler).arg("--version").output().ok()?;
    let text = String::from_utf8_lossy(&out.stdout);
    let first = text.lines().next()?.to_owned();
    out.status.success().then_some(first)
}

/// The number after `rustc 1.`.
fn minor(version: &str) -> Option<u32> {
    version
        .strip_prefix("rustc 1.")?
        .split('.')
        .next()?
        .parse()
        .ok()
}

/// The Rust plugin by a compiler, or by the one that built these tests.
fn in_rust(name: &str, rustc: Option<&str>) -> PathBuf {
    let folder = scratch().join(name);
    drop(std::fs::remove_dir_all(&folder));
    std::fs::create_dir_all(folder.join("src")).unwrap_or_else(|e| panic!("{e}"));
    for file in ["Cargo.toml", "src/lib.rs"] {
        let text = std::fs::read_to_string(fixtures().join("rust").join(file));
        let text = text.unwrap_or_else(|e| panic!("{file}: {e}"));
        let text = text.replace("@API@", &api().display().to_string());
        std::fs::write(folder.join(file), text).unwrap_or_else(|e| panic!("{e}"));
    }
    let project = Project { folder };
    project.cargo_with("build", |c| {
        if let Some(rustc) = rustc {
            // Wrappers and flags are for the usual one.
            c.env("RUSTC", rustc)
                .env("CARGO_TARGET_DIR", scratch().join("target-other"));
            c.env_remove("RUSTC_WRAPPER").env_remove("RUSTFLAGS");
        }
    });
    let target = scratch().join(if rustc.is_some() {
        "target-other"
    } else {
        "target"
    });
    let library = project.folder.join(format!("{name}.so"));
    std::fs::copy(target.join("release/libtwin.so"), &library).unwrap_or_else(|e| panic!("{e}"));
    library
}

fn in_c(name: &str, compiler: &str, more: &[&str]) -> PathBuf {
    let library = scratch().join(format!("{name}.so"));
    let mut cc = Command::new(compiler);
    // The one thing that compilers may decide about plain arithmetic.
    cc.args([
        "-std=c11",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        "-ffp-contract=off",
    ]);
    cc.args(more)
        .args(["-shared", "-fPIC", "-I"])
        .arg(api().join("include"));
    cc.arg(fixtures().join("twin.c"))
        .arg("-o")
        .arg(&library)
        .arg("-lm");
    run(&mut cc);
    library
}

/// The picture of a fog that scatters by a plugin.
fn picture(library: &Path, k: f64) -> Vec<u8> {
    let scene = json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": [0, 0.5, 4], "target": [0, 0, 0], "fov_x_deg": 40},
        "film": {"resolution": [48, 36]},
        "sampling": {"spp": 64},
        "lights": [
            {"type": "distant", "to_light": [1, 1, 0.3], "irradiance": 3},
            {"type": "environment", "radiance": [0.1, 0.2, 0.3]}
        ],
        "media": {"fog": {"plugin": "homogeneous", "params": {
            "sigma_t": 2, "albedo": 0.95, "bounds": [-1, -1, -1, 1, 1, 1],
            "phase": {"plugin": library, "params": {"k": k}}}}}
    });
    let file = scratch().join("twins.json");
    std::fs::write(&file, scene.to_string()).unwrap_or_else(|e| panic!("{e}"));
    let out = scratch().join("twins.exr");
    let mut render = resolvent();
    run(render
        .arg("render")
        .arg(&file)
        .arg("--quiet")
        .arg("-o")
        .arg(&out));
    let image = resolvent_image::Image::read_exr(&out).unwrap_or_else(|e| panic!("{e}"));
    let rgb = image.color().unwrap_or_else(|| panic!("no colour"));
    let values = rgb.iter().flat_map(|c| c.iter());
    values.flat_map(|v| v.to_bits().to_ne_bytes()).collect()
}

#[test]
fn pictures_agree_bit_for_bit() {
    let all = std::env::var_os("RESOLVENT_COMPILERS").is_some_and(|v| v == "all");
    let own = in_rust("twin-own", None);
    let mut check = resolvent();
    run(check.args(["plugin", "check", "--isolate"]).arg(&own));
    let reference = picture(&own, 0.5);
    assert!(reference != picture(&own, 0.51), "the plugin has an effect");

    let mut built = Vec::new();
    let usual = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let other = version(OTHER_RUSTC);
    assert!(!all || other.is_some(), "{OTHER_RUSTC} is asked for");
    // One that is too old is of no use, and the same one is no other.
    if let Some(v) = other
        && Some(&v) != version(&usual).as_ref()
        && minor(&v) >= Some(OLDEST)
    {
        built.push((v, in_rust("twin-other", Some(OTHER_RUSTC))));
    }
    for compiler in ["gcc", "clang"] {
        let Some(v) = version(compiler) else {
            assert!(!all, "{compiler} is asked for");
            continue;
        };
        for level in ["-O0", "-O2", "-O3"] {
            let library = in_c(&format!("twin{level}-{compiler}"), compiler, &[level]);
            built.push((format!("{v} {level}"), library));
        }
    }
    assert!(!built.is_empty(), "no other compiler was found");
    for (compiler, library) in built {
        assert!(
            picture(&library, 0.5) == reference,
            "the picture by {compiler} differs"
        );
        println!("{compiler}: the same bits");
    }
}
