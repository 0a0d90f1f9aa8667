//! `resolvent render` with scenes.

use crate::program::{Run, bits, changed, folder, json, mean, picture, render, scene};
use resolvent_image::BEAUTY;

const TINY: [&str; 4] = ["--resolution", "24x16", "--spp", "32"];

#[test]
fn every_example_renders() {
    let at = folder("examples");
    let with_light = |name: &str| {
        let image = render(
            &at,
            &scene(name),
            "out.exr",
            &[&TINY[..2], &["--spp", "32"]].concat(),
        );
        assert_eq!((image.width, image.height), (24, 16), "{name}");
        assert!(mean(&image) > 0.005, "{name}: {}", mean(&image));
    };
    for name in [
        "ajar/ajar.json",
        "caustic/caustic.json",
        "cloud/cloud.json",
        "fog-room/fog-room.json",
        "lampshade/lampshade.json",
        "materials/materials.json",
        "overlap/overlap.json",
        "pinhole/pinhole.json",
    ] {
        with_light(name);
    }
    for name in [
        "absorb_env",
        "cloud_env",
        "cloud_sun",
        "smoke_area",
        "chromatic",
        "box_fog",
        "surface_only",
    ] {
        with_light(&format!("bench/{name}.json"));
    }
}

/// A white furnace: with albedo 1 in a constant environment every pixel shows that environment.
#[test]
fn a_furnace_shows_nothing() {
    let at = folder("furnace");
    let options = ["--resolution", "16x12", "--spp", "64"];
    let image = render(&at, &scene("bench/cloud_env.json"), "out.exr", &options);
    let rgb = image.color().unwrap_or_else(|| panic!("no colour"));
    // Connections and scattering share the light, so single pixels are noisy; their mean is not.
    assert!((mean(&image) - 1.0).abs() < 0.05, "{}", mean(&image));
    assert!(
        rgb.iter()
            .flat_map(|c| c.iter())
            .all(|v| *v > 0.2 && *v < 3.0)
    );
}

#[test]
fn the_picture_is_named_after_the_scene_unless_told() {
    let at = folder("default-name");
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let run = Run::new(&at, [&["render", &input], &TINY[..]].concat()).done();
    assert!(
        run.stderr.contains("no -o given: writing surface_only.exr"),
        "{run:?}"
    );
    assert!(run.stderr.contains("wrote surface_only.exr"), "{run:?}");
    picture(&at.join("surface_only.exr"));
}

#[test]
fn several_pictures_of_one_rendering() {
    let at = folder("several");
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let outputs = ["-o", "a.exr", "-o", "b.PNG", "-o", "c.exr", "--quiet"];
    let run = Run::new(&at, [&["render", &input], &outputs[..], &TINY[..]].concat()).done();
    assert_eq!(run.stdout, "");
    let (a, c) = (picture(&at.join("a.exr")), picture(&at.join("c.exr")));
    assert_eq!(bits(&a), bits(&c));
    let png = std::fs::read(at.join("b.PNG")).unwrap_or_default();
    assert_eq!(&png[1..4], b"PNG");
    let names: Vec<_> = std::fs::read_dir(&at)
        .map(|d| d.flatten().map(|e| e.file_name()).collect())
        .unwrap_or_default();
    assert_eq!(names.len(), 3, "nothing else is left: {names:?}");
}

#[test]
fn exposure_makes_png_brighter_and_leaves_exr_alone() {
    let at = folder("exposure");
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let shot = |stops: &str, name: &str| {
        let (exr, png) = (format!("{name}.exr"), format!("{name}.png"));
        let args = ["render", &input, "--quiet", "-o", &exr, "-o", &png];
        let tone = ["--exposure", stops, "--tone-map", "srgb"];
        Run::new(&at, [&args[..], &tone[..], &TINY[..]].concat()).done();
        let size = std::fs::read(at.join(&png)).unwrap_or_default();
        (bits(&picture(&at.join(&exr))), size)
    };
    let (plain, plain_png) = shot("0", "plain");
    let (dark, dark_png) = shot("-20", "dark");
    assert_eq!(plain, dark);
    // Twenty stops down everything is black, which packs to next to nothing.
    assert!(dark_png.len() < plain_png.len() / 2);
}

#[test]
fn a_window_is_a_part_of_the_whole() {
    let at = folder("crop");
    let input = scene("overlap/overlap.json");
    let options = ["--resolution", "48x32", "--spp", "16"];
    let whole = render(&at, &input, "whole.exr", &options);
    let crop = ["--crop", "5,7,29,20"];
    let part = render(&at, &input, "part.exr", &[&options[..], &crop].concat());
    assert_eq!((part.width, part.height), (24, 13));
    assert_eq!((part.origin, part.full), ([5, 7], [48, 32]));
    for channel in ["R", "G", "B", "A"] {
        let (w, p) = (
            whole.channel(BEAUTY, channel),
            part.channel(BEAUTY, channel),
        );
        let (w, p) = (w.unwrap_or_default(), p.unwrap_or_default());
        for y in 0..13 {
            let from = (y + 7) * 48 + 5;
            assert_eq!(w[from..from + 24], p[y * 24..(y + 1) * 24], "{channel} {y}");
        }
    }
}

/// Layers by scattering order leave the picture as it is, bit for bit, and sum to it: up to the rounding to f32 of each layer and
/// of the picture, 2⁻²⁴ relative.
#[test]
fn orders_sum_to_the_picture() {
    let at = folder("orders");
    let size = ["--resolution", "40x30", "--spp", "16"];
    for (name, integrator) in [
        // Branches towards the sun; chromatic fog around glass; media that overlap.
        ("bench/cloud_sun.json", "pt"),
        ("caustic/caustic.json", "bdpt"),
        ("overlap/overlap.json", "light"),
        ("pinhole/pinhole.json", "mlt"),
        ("overlap/overlap.json", "bdpt"),
    ] {
        let with = ["--integrator", integrator];
        let plain = render(&at, &scene(name), "plain.exr", &[&size[..], &with].concat());
        let aov = ["--aov", "orders:2"];
        let options = [&size[..], &with, &aov].concat();
        let image = render(&at, &scene(name), "orders.exr", &options);
        for (k, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let of = |layer: &str| {
                let found = image.channel(layer, channel);
                found.unwrap_or_else(|| panic!("no {layer}.{channel}"))
            };
            let beauty = of(BEAUTY);
            assert_eq!(Some(beauty), plain.channel(BEAUTY, channel), "{name} {k}");
            let layers = ["order0", "order1", "order2", "order_rest"].map(of);
            for (i, whole) in beauty.iter().enumerate() {
                let values = layers.map(|l| f64::from(l[i]));
                let sum: f64 = values.iter().sum();
                let size: f64 = values.iter().map(|v| v.abs()).sum();
                let whole = f64::from(*whole);
                assert!(
                    (sum - whole).abs() <= 2f64.powi(-24) * (size + whole.abs()) * 1.001,
                    "{name} {integrator} {channel} {i}: {sum} {whole}"
                );
            }
            // No light reaches the room behind the pinhole by one scattering: the others' layers all show something.
            let lit = |l: &[f32]| l.iter().any(|v| *v > 0.0);
            let first = if integrator == "mlt" { 3 } else { 1 };
            assert!(
                layers[first..].iter().all(|l| lit(l)),
                "{name} {integrator}"
            );
        }
    }
}

#[test]
fn layers_and_metadata() {
    let at = folder("layers");
    let input = scene("bench/box_fog.json");
    let options = ["--aov", "depth,albedo", "--aov", "normal,samples,variance"];
    let rest = ["--resolution", "24x24", "--spp", "48", "--seed", "9"];
    let image = render(&at, &input, "out.exr", &[&options[..], &rest].concat());
    let channel = |l: &str, c: &str| {
        let found = image.channel(l, c);
        found.unwrap_or_else(|| panic!("no {l}.{c}")).to_vec()
    };
    let alpha = channel(BEAUTY, "A");
    let depth = channel("depth", "Z");
    for i in 0..image.pixels() {
        // The camera stands outside of the box, 3.9 from its front and 5.9 from its back.
        if alpha[i] == 1.0 {
            assert!(depth[i] > 3.8 && depth[i] < 6.5, "{}", depth[i]);
        }
        let n = ["X", "Y", "Z"].map(|c| channel("normal", c)[i]);
        assert!(n.iter().map(|x| x * x).sum::<f32>() < 1.0001);
        let albedo = channel("albedo", "R")[i];
        assert!((0.0..=1.0).contains(&albedo));
        assert_eq!(channel("samples", "N")[i], 48.0);
        assert!(channel("variance", "G")[i] >= 0.0);
    }
    let meta = |key: &str| image.metadata.get(key).map(String::as_str);
    assert_eq!(meta("seed"), Some("9"));
    assert_eq!(meta("samples"), Some("48"));
    assert_eq!(meta("sample_range"), Some("0..48"));
    assert!(meta("scene").is_some_and(|s| s.ends_with("box_fog.json")));
    assert!(
        meta("version").is_some() && meta("software").is_some_and(|s| s.starts_with("resolvent"))
    );
    assert!(meta("integrator").is_some_and(|s| s.contains("'pt'")));
    for number in ["seconds", "estimated_error"] {
        let value: f64 = meta(number).unwrap_or("").parse().unwrap_or(-1.0);
        assert!(value > 0.0, "{number}: {value}");
    }
}

/// The estimated error must fall below what is asked for, and be estimated well enough to be met by another seed.
#[test]
fn error_and_time_budgets() {
    let at = folder("budgets");
    let input = scene("bench/surface_only.json");
    let size = ["--resolution", "24x24", "--stats", "s.json"];
    render(
        &at,
        &input,
        "e.exr",
        &[&size[..], &["--error", "0.1"]].concat(),
    );
    let s = json(&at.join("s.json"));
    let error = s["sampling"]["estimated_error"].as_f64().unwrap_or(9.0);
    assert!(error <= 0.1, "{s:#}");
    assert!(
        s["sampling"]["samples_per_pixel"].as_u64().unwrap_or(0) >= 32,
        "{s:#}"
    );
    render(
        &at,
        &input,
        "t.exr",
        &[&size[..], &["--time", "0.5"]].concat(),
    );
    let s = json(&at.join("s.json"));
    let seconds = s["seconds"]["render"].as_f64().unwrap_or(0.0);
    assert!((0.4..20.0).contains(&seconds), "{seconds}");
    assert!(s["sampling"]["samples"].as_u64().unwrap_or(0) > 0);
}

#[test]
fn options_go_into_the_saved_scene() {
    let at = folder("save");
    let input = scene("overlap/overlap.json");
    let options = [
        "--save-scene",
        "saved.json",
        "--seed",
        "5",
        "--aov",
        "depth",
    ];
    let first = render(&at, &input, "a.exr", &[&options[..], &TINY].concat());
    let saved = json(&at.join("saved.json"));
    assert_eq!(saved["film"]["resolution"], serde_json::json!([24, 16]));
    assert_eq!(saved["sampling"], serde_json::json!({"spp": 32, "seed": 5}));
    let second = render(&at, &at.join("saved.json"), "b.exr", &[]);
    assert_eq!(bits(&first), bits(&second));
    assert!(first.layer("depth").is_some());
}

#[test]
fn another_seed_is_another_picture() {
    let at = folder("seed");
    let input = scene("bench/surface_only.json");
    let one = render(
        &at,
        &input,
        "1.exr",
        &[&TINY[..], &["--seed", "1"]].concat(),
    );
    let two = render(
        &at,
        &input,
        "2.exr",
        &[&TINY[..], &["--seed", "2"]].concat(),
    );
    assert_ne!(bits(&one), bits(&two));
}

/// An integrator with its parameters, and the same by the path of its library.
/// `--reuse` is the parameter of `pt`; parts of shared paths make the same picture as one render.
#[test]
fn paths_are_shared_on_request() {
    let at = folder("reuse");
    let plain = scene("bench/box_fog.json");
    let asks = changed(&at, "bench/box_fog.json", |s| {
        s["integrator"]["params"]["reuse"] = 3.into();
    });
    let options = ["--resolution", "40x24", "--spp", "32"];
    let with = [&options[..], &["--reuse", "3"]].concat();
    let shared = bits(&render(&at, &plain, "flag.exr", &with));
    assert!(shared == bits(&render(&at, &asks, "scene.exr", &options)));
    assert!(shared != bits(&render(&at, &plain, "alone.exr", &options)));
    for range in ["0..11", "11..32"] {
        let part = [
            "--sample-range",
            range,
            "--checkpoint",
            &format!("{range}.ckpt"),
        ];
        let part = [&with[..2], &with[4..], &part].concat();
        render(&at, &plain, "part.exr", &part);
    }
    let merge = ["merge", "0..11.ckpt", "11..32.ckpt", "-o", "merged.exr"];
    Run::new(&at, merge).done();
    assert!(shared == bits(&picture(&at.join("merged.exr"))));
}

#[test]
fn integrators_by_path() {
    let at = folder("integrator");
    let list = Run::new(&at, ["plugin", "info", "pt", "--json"])
        .done()
        .json();
    let library = list["path"].as_str().unwrap_or_default().to_owned();
    let input = changed(&at, "bench/surface_only.json", |_| {});
    let one = render(
        &at,
        &input,
        "1.exr",
        &[&TINY[..], &["--integrator", "pt"]].concat(),
    );
    let two = render(
        &at,
        &input,
        "2.exr",
        &[&TINY[..], &["--integrator", &library]].concat(),
    );
    assert_eq!(bits(&one), bits(&two));
}
