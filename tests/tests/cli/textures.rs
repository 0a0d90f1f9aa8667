//! Textures through the whole program: what is shown, what is read, and what goes wrong.

use crate::program::{Run, folder, json, render};
use image::{ExtendedColorType, ImageEncoder};
use resolvent_image::{Image, compare};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Texels of a side of the test image.
const SIDE: usize = 8;

/// Any colours, all different.
fn colors() -> Vec<[u8; 3]> {
    (0..SIDE * SIDE)
        .map(|i| {
            [
                (i * 37 % 256) as u8,
                (255 - i * 3) as u8,
                (i * 101 % 256) as u8,
            ]
        })
        .collect()
}

fn write_png(path: &Path, rgb: &[[u8; 3]], width: usize) {
    let mut out = Vec::new();
    let height = (rgb.len() / width) as u32;
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(&rgb.concat(), width as u32, height, ExtendedColorType::Rgb8)
        .unwrap_or_else(|e| panic!("{e}"));
    std::fs::write(path, out).unwrap_or_else(|e| panic!("{e}"));
}

/// A square that fills the picture of 16 × 16 pixels exactly, with the material `paint`.
fn square(textures: Value, paint: Value, light: Value) -> Value {
    json!({
        "resolvent": 1,
        "camera": {
            "type": "perspective", "origin": [0, 0, 1], "target": [0, 0, 0],
            "fov_x_deg": 2.0 * 0.5f64.atan().to_degrees()
        },
        "film": {"resolution": [16, 16]},
        "lights": [light],
        "textures": textures,
        "materials": {"paint": paint},
        "shapes": [{
            "type": "rectangle", "corner": [-0.5, -0.5, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0],
            "material": "paint"
        }]
    })
}

fn written(at: &Path, scene: &Value) -> PathBuf {
    let path = at.join("scene.json");
    std::fs::write(&path, scene.to_string()).unwrap_or_else(|e| panic!("{e}"));
    path
}

fn uniform() -> Value {
    json!({"type": "environment", "radiance": 1})
}

fn painted(texture: &str) -> Value {
    json!({"plugin": "diffuse", "params": {"reflectance": {"texture": texture}}})
}

/// The curve of IEC 61966-2-1, written down a second time.
fn linear(code: u8) -> f32 {
    let e = f64::from(code) / 255.0;
    (if e <= 0.04045 {
        e / 12.92
    } else {
        ((e + 0.055) / 1.055).powf(2.4)
    }) as f32
}

/// Under light of radiance 1 from everywhere, a diffuse surface shows its reflectance: every pixel is the linear value of its
/// texel, the first texel in the upper left corner.
#[test]
fn a_square_shows_its_texture() {
    let at = folder("textures-square");
    write_png(&at.join("colors.png"), &colors(), SIDE);
    let textures = json!({"colors": {"file": "colors.png", "filter": "nearest"}});
    let input = written(&at, &square(textures, painted("colors"), uniform()));
    let found = render(
        &at,
        &input,
        "out.exr",
        &["--spp", "256", "--aov", "variance"],
    );
    let mut expected = Image::new(16, 16);
    let texel = |pixel: usize| colors()[pixel / 16 / 2 * SIDE + pixel % 16 / 2];
    let plane = |c: usize| (0..256).map(|i| linear(texel(i)[c])).collect::<Vec<f32>>();
    expected.push("", [("R", plane(0)), ("G", plane(1)), ("B", plane(2))]);
    let c = compare(&found, &expected, [SIDE, SIDE]).unwrap_or_else(|e| panic!("{e}"));
    let regions = c.regions.unwrap_or_else(|| panic!("no variance"));
    assert!(
        regions.passed(),
        "{:?} {}",
        regions.worst(),
        regions.p_value
    );
    // The noise that the test allows is small.
    assert!(c.rel_mse < 1e-3, "{}", c.rel_mse);
}

/// A texture's transform moves the picture, and its channel, factor and offset act on its values, clamped to what a
/// reflectance can be.
#[test]
fn settings_act_on_what_is_shown() {
    let at = folder("textures-settings");
    // Columns of red 0, 51, 102 … and alpha-free blue 255.
    let row: Vec<[u8; 3]> = (0..4).map(|i| [i * 51, 7, 255]).collect();
    write_png(&at.join("row.png"), &row, 4);
    let shown = |settings: Value| {
        let mut texture = json!({"file": "row.png", "filter": "nearest", "color_space": "raw"});
        for (k, v) in settings.as_object().into_iter().flatten() {
            texture[k] = v.clone();
        }
        let scene = square(json!({"t": texture}), painted("t"), uniform());
        let image = render(&at, &written(&at, &scene), "out.exr", &["--spp", "64"]);
        let [r, g, b] = image
            .color()
            .unwrap_or_else(|| panic!("no colour"))
            .map(<[f32]>::to_vec);
        // The middle of each column of texels, averaged over rows.
        [0, 1, 2, 3].map(|x| {
            [&r, &g, &b].map(|c| (0..16).map(|y| c[y * 16 + x * 4 + 2]).sum::<f32>() / 16.0)
        })
    };
    let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02);
    let plain = shown(json!({}));
    let moved = shown(json!({"uv_transform": {"offset": [0.25, 0]}}));
    let scaled = shown(json!({"channel": "r", "scale": [1, -1, 4], "bias": [0, 1, -0.5]}));
    for x in 0..4 {
        let red = 0.2 * x as f32;
        assert!(close(plain[x], [red, 7.0 / 255.0, 1.0]), "{plain:?}");
        let next = 0.2 * ((x + 1) % 4) as f32;
        assert!(close(moved[x], [next, 7.0 / 255.0, 1.0]), "{moved:?}");
        let blue = (4.0 * red - 0.5).clamp(0.0, 1.0);
        assert!(close(scaled[x], [red, 1.0 - red, blue]), "{scaled:?}");
    }
}

/// The square lit from one direction has radiance ρ/π · E · cos θ with the turned normal, without noise.
#[test]
fn normal_maps_turn_the_shading_normal() {
    let at = folder("textures-normals");
    // (0.6, 0, 0.8) and (0, -0.6, 0.8) as far as 8 bits go.
    let code = |x: f64| ((x + 1.0) * 127.5).round() as u8;
    for (n, scale) in [
        ([0.6, 0.0, 0.8], 1.0),
        ([0.0, -0.6, 0.8], 1.0),
        ([0.6, 0.0, 0.8], 0.5),
    ] {
        write_png(&at.join("n.png"), &[n.map(code)], 1);
        let to_light = [0.48, -0.36, 0.8];
        let light = json!({"type": "distant", "to_light": to_light, "irradiance": 2});
        let textures = json!({"n": {"file": "n.png", "color_space": "linear"}});
        let paint = json!({
            "plugin": "diffuse", "params": {"reflectance": 0.5},
            "normal_map": {"texture": "n", "scale": scale}
        });
        let image = render(
            &at,
            &written(&at, &square(textures, paint, light)),
            "out.exr",
            &["--spp", "4"],
        );
        let decoded = n.map(|x| f64::from(code(x)) / 127.5 - 1.0);
        let turned = [decoded[0] * scale, decoded[1] * scale, decoded[2]];
        let length = turned.iter().map(|x| x * x).sum::<f64>().sqrt();
        let cosine: f64 = turned.iter().zip(to_light).map(|(a, b)| a * b).sum::<f64>() / length;
        let expected = 0.5 / std::f64::consts::PI * 2.0 * cosine;
        let red = image.color().unwrap_or_else(|| panic!("no colour"))[0];
        for v in red {
            assert!(
                (f64::from(*v) / expected - 1.0).abs() < 1e-4,
                "{n:?}: {v} {expected}"
            );
        }
    }
}

/// One file for two textures is read once; what no surface uses is not read at all, not even looked for.
#[test]
fn images_are_read_once_and_only_if_used() {
    let at = folder("textures-stats");
    write_png(&at.join("colors.png"), &colors(), SIDE);
    let textures = json!({
        "a": {"file": "colors.png"},
        "b": {"file": "./colors.png", "color_space": "raw", "scale": 0.5},
        "spare": {"file": "colors.png", "wrap": "clamp"},
        "elsewhere": {"file": "nowhere.png"},
    });
    let mut scene = square(textures, painted("a"), uniform());
    scene["materials"]["other"] = painted("b");
    scene["materials"]["unused"] = painted("elsewhere");
    let second = json!({"type": "sphere", "center": [0, 0, -5], "radius": 1, "material": "other"});
    scene["shapes"] = json!([scene["shapes"][0], second]);
    let input = written(&at, &scene);
    let stats = |scene: &Path| {
        render(&at, scene, "out.exr", &["--spp", "1", "--stats", "s.json"]);
        json(&at.join("s.json"))["textures"].clone()
    };
    let s = stats(&input);
    let size = std::fs::metadata(at.join("colors.png")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        (&s["read"], &s["bytes_read"]),
        (&json!(1), &json!(size.len())),
        "{s:#}"
    );
    assert_eq!(s["memory_bytes"], json!(SIDE * SIDE * 3));
    assert_eq!(s["images"][0]["size"], json!([SIDE, SIDE]));
    scene["shapes"][0]["material"] = json!("plain");
    scene["shapes"][1]["material"] = json!("plain");
    scene["materials"]["plain"] = json!({"plugin": "diffuse"});
    let s = stats(&written(&at, &scene));
    assert_eq!(
        (&s["read"], &s["bytes_read"]),
        (&json!(0), &json!(0)),
        "{s:#}"
    );
}

#[test]
fn a_missing_or_damaged_image_is_named() {
    let at = folder("textures-errors");
    std::fs::write(at.join("broken.png"), b"\x89PNG\r\n\x1a\nnothing else")
        .unwrap_or_else(|e| panic!("{e}"));
    for (file, why) in [
        ("nowhere.png", "No such file"),
        ("broken.png", "damaged image"),
    ] {
        let textures = json!({"bark": {"file": file}});
        let input = written(&at, &square(textures, painted("bark"), uniform()));
        let run = Run::new(&at, ["render", &input.to_string_lossy(), "-o", "x.exr"]);
        assert_eq!(run.code, Some(2), "{run:?}");
        for part in ["$.textures.bark", "texture 'bark'", file, why] {
            assert!(run.stderr.contains(part), "{part}: {run:?}");
        }
    }
    // Media and integrators take no textures.
    let mut scene = square(
        json!({"bark": {"file": "x.png"}}),
        painted("bark"),
        uniform(),
    );
    scene["media"] =
        json!({"fog": {"plugin": "homogeneous", "params": {"sigma_t": {"texture": "bark"}}}});
    scene["shapes"][0] =
        json!({"type": "sphere", "center": [0, 0, 0], "radius": 1, "interior": "fog"});
    let input = written(&at, &scene);
    let run = Run::new(&at, ["render", &input.to_string_lossy(), "-o", "x.exr"]);
    assert!(
        run.code == Some(2) && run.stderr.contains("$.media.fog.params.sigma_t"),
        "{run:?}"
    );
}
