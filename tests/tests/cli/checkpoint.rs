//! Checkpoints: nothing is lost, nothing changes, nothing foreign gets in.

use crate::program::{Run, bits, changed, folder, json, path, picture, render, scene};
use resolvent_engine::checkpoint::Checkpoint;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const LAYERS: [&str; 2] = ["--aov", "depth,albedo,normal,variance,samples"];

/// A render and what it needs beside its input.
struct Shot {
    scene: &'static str,
    options: &'static [&'static str],
}

/// Walks from the sensor, from both ends, and chains.
const SHOTS: [Shot; 3] = [
    Shot {
        scene: "overlap/overlap.json",
        options: &["--resolution", "40x24"],
    },
    Shot {
        scene: "caustic/caustic.json",
        options: &["--resolution", "40x24", "--integrator", "bdpt"],
    },
    Shot {
        scene: "pinhole/pinhole.json",
        options: &["--resolution", "40x24", "--integrator", "mlt"],
    },
];

impl Shot {
    /// Renders without checkpoints.
    fn plain(&self, at: &Path, more: &[&str]) -> Vec<(String, Vec<u32>)> {
        let all = [self.options, &LAYERS, more].concat();
        bits(&render(at, &scene(self.scene), "plain.exr", &all))
    }

    fn args(&self, file: &str, more: &[&str]) -> Vec<String> {
        let input = scene(self.scene).to_string_lossy().into_owned();
        let fixed = ["render", &input, "--quiet", "--checkpoint", file];
        let all = [&fixed[..], self.options, &LAYERS, more].concat();
        all.into_iter().map(str::to_owned).collect()
    }

    /// Renders into a checkpoint.
    fn keep(&self, at: &Path, file: &str, more: &[&str]) -> Run {
        let _ = std::fs::remove_file(at.join(file));
        Run::new(at, self.args(file, more)).done()
    }
}

fn merge(at: &Path, parts: &[&str], out: &str) -> Run {
    let args = [&["merge", "--quiet", "-o", out], parts].concat();
    Run::new(at, args)
}

/// All layers of a merged picture have the bits of one render: where ranges divide no net for everybody, anywhere for walks that
/// stay on their pixel. The order of the parts does not matter.
#[test]
fn parts_merge_to_one_run() {
    let at = folder("merge");
    for (i, shot) in SHOTS.iter().enumerate() {
        let whole = shot.plain(&at, &["--spp", "100"]);
        let cuts = if i == 0 { ["7", "41"] } else { ["16", "64"] };
        let ranges = [
            format!("0..{}", cuts[0]),
            format!("{}..{}", cuts[0], cuts[1]),
            format!("{}..100", cuts[1]),
        ];
        for (k, range) in ranges.iter().enumerate() {
            shot.keep(&at, &format!("{k}.ckpt"), &["--sample-range", range]);
        }
        let merged = merge(&at, &["1.ckpt", "0.ckpt", "2.ckpt"], "m.exr").done();
        assert_eq!(merged.stderr, "");
        let image = picture(&at.join("m.exr"));
        assert!(bits(&image) == whole, "{}", shot.scene);
        let range = image.metadata.get("sample_range").map(String::as_str);
        assert_eq!(range, Some("0..100"));
        // A gap is no fault, but it is told.
        merge(&at, &["0.ckpt", "2.ckpt"], "gap.exr").done();
        let image = picture(&at.join("gap.exr"));
        let range = image.metadata.get("sample_range").cloned();
        assert_eq!(range, Some(format!("0..{},{}..100", cuts[0], cuts[1])));
    }
}

/// A render goes on to more samples, and a merged checkpoint fills its gaps.
#[test]
fn renders_go_on() {
    let at = folder("go-on");
    let shot = &SHOTS[0];
    shot.keep(&at, "a.ckpt", &["--sample-range", "0..30"]);
    shot.keep(&at, "b.ckpt", &["--sample-range", "64..80"]);
    let out = ["merge", "a.ckpt", "b.ckpt", "--checkpoint", "c.ckpt"];
    Run::new(&at, out).done();
    let more = ["--resume", "--spp", "130", "-o", "c.exr"];
    let run = Run::new(&at, shot.args("c.ckpt", &more)).done();
    assert_eq!(run.stderr, "");
    let whole = shot.plain(&at, &["--spp", "130"]);
    assert!(bits(&picture(&at.join("c.exr"))) == whole);
    // What is finished is not done again, and a picture with other layers can be made of it.
    let more = [
        "--resume", "--spp", "130", "-o", "d.exr", "--stats", "s.json",
    ];
    Run::new(&at, shot.args("c.ckpt", &more)).done();
    assert!(bits(&picture(&at.join("d.exr"))) == whole);
}

/// Sums cannot be taken apart: who asks for less than there is hears what is there, and how to have its picture.
#[test]
fn fewer_samples_than_are_there() {
    let at = folder("fewer");
    let shot = &SHOTS[0];
    shot.keep(&at, "k.ckpt", &["--spp", "24"]);
    for (option, value, asked) in [
        ("--spp", "10", "only 0..10 are"),
        ("--sample-range", "8..32", "only 8..32 are"),
    ] {
        let run = Run::new(&at, shot.args("k.ckpt", &["--resume", option, value]));
        assert_eq!(run.code, Some(2), "{run:?}");
        let remedy = "`resolvent merge k.ckpt -o FILE`";
        for part in ["k.ckpt: ", "has samples 0..24", asked, remedy] {
            assert!(run.stderr.contains(part), "{part:?} is not in {run:?}");
        }
    }
    merge(&at, &["k.ckpt"], "m.exr").done();
    let whole = shot.plain(&at, &["--spp", "24"]);
    assert!(bits(&picture(&at.join("m.exr"))) == whole);
}

/// A picture cannot be merged, and neither can what is not of one picture: the message says what differs.
#[test]
fn what_differs_is_named() {
    let at = folder("differs");
    let base = ["--spp", "16", "--checkpoint"];
    let size = ["--resolution", "24x16"];
    let input = |name: &str| scene(name).to_string_lossy().into_owned();
    let keep = |input: &str, file: &str, more: &[&str]| {
        let given = more.contains(&size[0]);
        let size = if given { &[] } else { &size[..] };
        let args = [&["render", input, "-q"], size, &base[..], &[file], more].concat();
        Run::new(&at, args)
    };
    let overlap = input("overlap/overlap.json");
    keep(&overlap, "a.ckpt", &["-o", "a.exr"]).done();
    let refused = |run: Run, parts: &[&str]| {
        assert_eq!(run.code, Some(2), "{run:?}");
        for part in parts {
            assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
        }
    };
    refused(keep(&overlap, "a.ckpt", &[]), &["a.ckpt", "--resume"]);
    refused(merge(&at, &["a.exr"], "x.exr"), &["a.exr", "--checkpoint"]);
    refused(
        merge(&at, &["a.ckpt", "a.ckpt"], "x.exr"),
        &["samples 0..16", "(0, 0)"],
    );
    let cases: [(&[&str], &[&str]); 5] = [
        (&["--seed", "5"], &["scene.sampling.seed is 0 there and 5"]),
        (
            &["--resolution", "25x16"],
            &["scene.film.resolution[0]", "24"],
        ),
        (
            &["--integrator", "bdpt"],
            &["scene.integrator.plugin", "bdpt"],
        ),
        (&["--aov", "depth"], &["layers", "true"]),
        (
            &["--aov", "orders:2"],
            &["layers by scattering order is nothing there and orders:2 here"],
        ),
    ];
    for (change, parts) in cases {
        let more = [&["--resume"], change].concat();
        refused(keep(&overlap, "a.ckpt", &more), parts);
        let _ = std::fs::remove_file(at.join("b.ckpt"));
        keep(&overlap, "b.ckpt", change).done();
        let place = parts[0].split(" is ").next().unwrap_or_default();
        refused(merge(&at, &["a.ckpt", "b.ckpt"], "x.exr"), &[place]);
    }
    // Another scene under the same name; then another file under the same name.
    let copy = changed(&at, "bench/cloud_sun.json", |_| {});
    let copy = copy.to_string_lossy().into_owned();
    keep(&copy, "c.ckpt", &[]).done();
    changed(&at, "bench/cloud_sun.json", |s| {
        s["lights"][0]["irradiance"] = 4.into()
    });
    refused(
        keep(&copy, "c.ckpt", &["--resume"]),
        &["scene.lights[0].irradiance"],
    );
    let vdb = at.join("cloud_s.vdb");
    std::fs::copy(scene("cloud/cloud_s.vdb"), &vdb).unwrap_or_else(|e| panic!("{e}"));
    changed(&at, "bench/cloud_sun.json", |s| {
        s["media"]["cloud"]["params"]["file"] = vdb.to_string_lossy().into();
    });
    keep(&copy, "c.ckpt", &["--resume"]).done();
    let other = crate::program::vdb("real/densityAndHeat.vdb");
    std::fs::copy(other, &vdb).unwrap_or_else(|e| panic!("{e}"));
    refused(
        keep(&copy, "c.ckpt", &["--resume"]),
        &["files.cloud_s.vdb", "CRC-32"],
    );
    // A plugin of another version.
    let file = at.join("a.ckpt");
    let mut old = Checkpoint::read(&file).unwrap_or_else(|e| panic!("{e}"));
    old.identity["plugins"]["integrator pt"] = "0.0.1".into();
    let bytes = old.state.to_bytes(&old.identity, &old.about);
    std::fs::write(&file, bytes).unwrap_or_else(|e| panic!("{e}"));
    refused(
        keep(&overlap, "a.ckpt", &["--resume"]),
        &["plugins.integrator pt", "0.0.1"],
    );
}

/// Damaged files are refused with their name, whatever the damage.
#[test]
fn damaged_checkpoints_are_refused() {
    let at = folder("damaged");
    let shot = &SHOTS[0];
    shot.keep(&at, "a.ckpt", &["--spp", "16"]);
    let good = std::fs::read(at.join("a.ckpt")).unwrap_or_else(|e| panic!("{e}"));
    let mut middle = good.clone();
    middle[good.len() / 2] ^= 4;
    let mut version = good.clone();
    version[8] = 9;
    let cases = [
        (b"".to_vec(), "no checkpoint"),
        (b"RSLVCKPT".to_vec(), "cut short"),
        (good[..good.len() - 1].to_vec(), "cut short"),
        (middle, "damaged"),
        (version, "version 9"),
        ([good, b"x".to_vec()].concat(), "damaged"),
    ];
    for (bytes, part) in cases {
        std::fs::write(at.join("b.ckpt"), bytes).unwrap_or_else(|e| panic!("{e}"));
        let resume = Run::new(&at, shot.args("b.ckpt", &["--resume", "--spp", "16"]));
        for run in [merge(&at, &["b.ckpt"], "x.exr"), resume] {
            assert_eq!(run.code, Some(2), "{run:?}");
            assert!(
                run.stderr.contains("b.ckpt") && run.stderr.contains(part),
                "{run:?}"
            );
        }
    }
    assert!(!at.join("x.exr").exists());
}

/// A generator of delays that need not be good.
struct Delays(u64);

impl Delays {
    fn next(&mut self, most: Duration) -> Duration {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        most.mul_f64((self.0 >> 33) as f64 / (1u64 << 31) as f64)
    }
}

fn start(at: &Path, args: &[String]) -> Child {
    Command::new(path())
        .args(args)
        .current_dir(at)
        .stderr(Stdio::null())
        .spawn()
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Samples that a checkpoint has, over all pixels; none if there is no checkpoint. It must be whole at any time.
fn kept(file: &Path) -> u64 {
    if !file.exists() {
        return 0;
    }
    let c = Checkpoint::read(file).unwrap_or_else(|e| panic!("{e}"));
    let film = &c.state.film;
    let [w, h] = film.size();
    (0..(w * h) as usize)
        .map(|i| u64::from(film.estimate(i).samples))
        .sum()
}

/// Killed at random moments and started again with the same command until it is done: the checkpoint is always whole, never has less
/// than before, and the picture has the bits of a render that was left alone.
#[test]
fn killed_renders_lose_nothing() {
    let full = std::env::var_os("RESOLVENT_FULL").is_some_and(|v| v == "1");
    let (kills, longer) = if full { (14, 6) } else { (2, 1) };
    let budgets = [("256", "0.06"), ("128", ""), ("256", "")];
    let mut delays = Delays(1);
    let mut cases = Vec::new();
    for (shot, (spp, error)) in SHOTS.iter().zip(budgets) {
        let spp = (spp.parse::<u32>().unwrap_or(0) * longer).to_string();
        cases.push((shot, vec!["--spp".to_owned(), spp]));
        if !error.is_empty() {
            cases.push((shot, vec!["--error".to_owned(), error.to_owned()]));
        }
    }
    for (i, (shot, budget)) in cases.iter().enumerate() {
        let at = folder(&format!("kill-{i}"));
        let budget: Vec<&str> = budget.iter().map(String::as_str).collect();
        let begin = std::time::Instant::now();
        let whole = shot.plain(&at, &budget);
        let alone = begin.elapsed();
        let more = [&["--resume", "--every", "0.02", "-o", "k.exr"], &budget[..]].concat();
        let args = shot.args("k.ckpt", &more);
        let mut before = 0;
        for _ in 0..kills {
            let mut child = start(&at, &args);
            std::thread::sleep(delays.next(alone));
            let _ = child.kill();
            let _ = child.wait();
            let now = kept(&at.join("k.ckpt"));
            assert!(now >= before, "{} {now} {before}", shot.scene);
            before = now;
        }
        Run::new(&at, &args).done();
        let image = picture(&at.join("k.exr"));
        assert!(bits(&image) == whole, "{} {budget:?}", shot.scene);
        let rubbish: Vec<_> = std::fs::read_dir(&at)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|f| f.file_name().to_string_lossy().starts_with(".k.ckpt"))
            .collect();
        assert!(rubbish.is_empty(), "{rubbish:?}");
    }
}

/// The statistics of a render that went on count what came before.
#[test]
fn counts_and_seconds_add_up() {
    let at = folder("counts");
    let shot = &SHOTS[0];
    shot.keep(&at, "a.ckpt", &["--spp", "20", "--stats", "1.json"]);
    let more = ["--resume", "--spp", "64", "--stats", "2.json"];
    Run::new(&at, shot.args("a.ckpt", &more)).done();
    shot.keep(&at, "b.ckpt", &["--spp", "64", "--stats", "3.json"]);
    let [first, second, whole] = ["1.json", "2.json", "3.json"].map(|f| json(&at.join(f)));
    assert_eq!(second["counts"], whole["counts"]);
    let seconds = |s: &serde_json::Value| s["seconds"]["render"].as_f64().unwrap_or(0.0);
    assert!(seconds(&second) > seconds(&first));
    for key in [
        "mean",
        "estimated_error",
        "worst_tile_error",
        "sample_range",
    ] {
        assert_eq!(second["sampling"][key], whole["sampling"][key], "{key}");
    }
}
