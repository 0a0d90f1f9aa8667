//! `plugins/examples`, from a copy outside of the workspace.

use super::project::{Project, api, resolvent, run, scratch};
use std::path::Path;

/// A copy of an example, its path to `core/api` replaced.
fn copy(name: &str) -> Project {
    let from = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../plugins/examples")
        .join(name);
    let folder = scratch().join(name);
    drop(std::fs::remove_dir_all(&folder));
    files(&from, &folder);
    Project { folder }
}

fn files(from: &Path, to: &Path) {
    let fail = |e: std::io::Error| panic!("{}: {e}", from.display());
    std::fs::create_dir_all(to).unwrap_or_else(fail);
    for entry in std::fs::read_dir(from).unwrap_or_else(|e| panic!("{}: {e}", from.display())) {
        let path = entry.unwrap_or_else(|e| panic!("{e}")).path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() {
            if name != "target" {
                files(&path, &to.join(&name));
            }
        } else if !name.ends_with(".so") && name != "Cargo.lock" {
            let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{e}"));
            let text = text.replace("../../../core/api", &api().display().to_string());
            std::fs::write(to.join(&name), text).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

#[test]
fn in_rust() {
    let cloud = copy("perlin-worley");
    cloud.cargo("build");
    cloud.check("target/release/libresolvent_medium_perlin_worley.so");
    cloud.render(8);
    let once = copy("single-scattering");
    once.cargo("build");
    once.check("target/release/libresolvent_integrator_single_scattering.so");
    once.render(64);
    // The same light by the path tracer.
    let mut scene = resolvent_scene::Scene::read(once.folder.join("scene.json"))
        .unwrap_or_else(|e| panic!("{e}"));
    scene.integrator = resolvent_scene::PluginBlock::new("pt").with("max_depth", 1.0);
    let reference = once.folder.join("reference.json");
    scene.write(&reference).unwrap_or_else(|e| panic!("{e}"));
    let mut render = resolvent();
    render.args([
        "render",
        "reference.json",
        "--quiet",
        "--resolution",
        "96x72",
        "--spp",
        "64",
    ]);
    render.args(["--seed", "5", "--aov", "variance", "-o", "reference.exr"]);
    run(render.current_dir(&once.folder));
    let mut compare = resolvent();
    compare.args(["compare", "picture.exr", "reference.exr", "--fail"]);
    run(compare.current_dir(&once.folder));
}

#[test]
fn in_c_and_cpp() {
    for (name, library) in [
        ("oren-nayar", "libresolvent_bsdf_oren_nayar.so"),
        ("schlick", "libresolvent_phase_schlick.so"),
        ("smoke-ring", "libresolvent_medium_smoke_ring.so"),
    ] {
        let p = copy(name);
        p.make(&[]);
        p.check(library);
        p.render(8);
    }
}
