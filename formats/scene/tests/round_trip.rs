//! Reading fills the description; writing it and reading it back gives an equal one.

mod common;

use std::path::{Path, PathBuf};

use common::{FULL, LEAST, decls};
use resolvent_scene::*;

fn parse(text: &str) -> Scene {
    Scene::parse(text.as_bytes(), "scenes/full.json").unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_key_arrives() {
    let s = parse(FULL);
    assert_eq!(s.units.meters_per_unit, 0.01);
    assert_eq!(
        s.camera.pose,
        Pose::LookAt {
            origin: [1.5, 2.0, 10.0],
            target: [0.0, 1.0, 0.0],
            up: [0.0, 1.0, 0.1]
        }
    );
    assert_eq!(
        (
            s.camera.projection,
            s.camera.lens_radius,
            s.camera.focus_distance
        ),
        (Projection::Perspective { fov_x_deg: 44.0 }, 0.05, 9.5)
    );
    assert_eq!((s.camera.shift, s.camera.exposure), ([0.25, -0.1], -1.5));
    assert_eq!(s.film.resolution, [320, 200]);
    assert_eq!(s.film.pixel_aspect, 1.5);
    assert_eq!(s.film.window(), [10, 20, 300, 180]);
    assert_eq!(
        s.film.filter,
        Filter::Gaussian {
            radius: 2.0,
            sigma: 0.6
        }
    );
    assert_eq!(s.film.aovs[..6], Aov::NAMED);
    assert_eq!(s.film.aovs[6..], [Aov::Orders(4)]);
    assert_eq!(s.film.order_layers(), 6);
    assert_eq!(
        s.sampling,
        Sampling {
            budget: Budget::Spp(128),
            seed: u64::MAX
        }
    );
    assert_eq!(s.integrator, PluginBlock::new("pt").with("max_depth", 12.0));

    assert_eq!(s.lights.len(), 7);
    assert_eq!(
        s.lights[5],
        Light::Spot {
            position: [1.0, 6.0, 0.0],
            direction: [0.0, -2.0, 0.0],
            intensity: [9.0, 8.0, 7.0],
            angle_deg: 50.0,
            inner_angle_deg: 20.0
        }
    );
    let Light::Environment(Environment::Image {
        file,
        mapping,
        scale,
        rotation,
    }) = &s.lights[0]
    else {
        panic!()
    };
    assert_eq!((file.as_str(), *scale), ("sky.exr", [1.0, 0.9, 0.8]));
    assert_eq!(*mapping, Mapping::Angular);
    assert!((rotation.vector([0.0, 0.0, 1.0])[0] - 0.5).abs() < 1e-12);
    assert_eq!(
        s.lights[1],
        Light::Environment(Environment::Constant { radiance: [0.1; 3] })
    );
    let Light::Distant {
        angle_deg,
        irradiance,
        ..
    } = &s.lights[2]
    else {
        panic!()
    };
    assert_eq!((*angle_deg, *irradiance), (0.53, [3.0, 3.0, 2.5]));
    assert_eq!(
        s.lights[3],
        Light::Point {
            position: [0.0, 5.0, 0.0],
            intensity: [40.0; 3]
        }
    );
    assert!(matches!(
        s.lights[4],
        Light::Rectangle {
            two_sided: true,
            ..
        }
    ));

    assert_eq!(
        s.materials["floor"].block.params["reflectance"]
            .value
            .as_spectrum(),
        Some([0.6, 0.55, 0.5])
    );
    assert!(s.materials["with a blank"].block.is_path() && !s.materials["floor"].block.is_path());
    let cloud = &s.media["cloud"];
    let phase = cloud.block.params["phase"].value.as_plugin().unwrap();
    assert_eq!(
        (phase.plugin.as_str(), phase.params["g"].value.as_number()),
        ("hg", Some(0.85))
    );
    assert_eq!(cloud.transform.point([1.0, 1.0, 1.0]), [3.0, -1.0, 2.0]);
    assert_eq!(
        cloud.block.params.keys().collect::<Vec<_>>(),
        ["file", "grid", "density_scale", "albedo", "phase"]
    );
    assert_eq!(
        s.free_standing().map(|(name, _)| name).collect::<Vec<_>>(),
        ["cloud"]
    );

    assert_eq!(s.shapes.len(), 6);
    assert_eq!(s.shapes[0].interior.as_deref(), Some("fog"));
    assert_eq!(s.shapes[1].emission, Some([0.1, 0.0, 0.0]));
    let sides: Vec<bool> = s.shapes.iter().map(|s| s.two_sided).collect();
    assert_eq!(sides, [false, false, false, false, true, false]);
    assert_eq!(
        s.shapes[4].geometry,
        Geometry::Disk {
            center: [0.0, 4.0, 0.0],
            normal: [0.0, -2.0, 0.0],
            radius: 0.5
        }
    );
    assert_eq!(
        s.shapes[5].geometry,
        Geometry::Cylinder {
            base: [1.0, 0.0, 0.0],
            axis: [0.0, 2.0, 0.0],
            radius: 0.25
        }
    );
    let Geometry::Mesh(mesh) = &s.shapes[2].geometry else {
        panic!()
    };
    assert_eq!(
        (mesh.positions[2], mesh.indices[0], mesh.uvs[1]),
        ([0.0, 1e-3, 0.0], [0, 1, 2], [1.0, 0.0])
    );
    // Scale by 2, turn [1, 1, 0] → itself, move.
    let moved = mesh.transform.point([1.0, 1.0, 0.0]);
    assert!(
        moved
            .iter()
            .zip([2.0, 2.0, 5.0])
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{moved:?}"
    );
    assert_eq!(
        s.shapes[3].geometry,
        Geometry::Ply {
            file: "bunny.ply".into(),
            transform: Transform::IDENTITY
        }
    );
    let priorities: Vec<i32> = s.all_shapes().map(|s| s.priority).collect();
    assert_eq!(priorities, [0, 0, 0, -2, 0, 0, 0, 3]);
    assert_eq!(s.prototypes["stone"].len(), 2);
    assert_eq!(
        s.instances[0],
        Instance {
            prototype: "stone".into(),
            transform: Transform::IDENTITY,
            transforms: None,
            material: None
        }
    );
    assert_eq!(s.instances[2].transforms.as_deref(), Some("stones.npy"));
    assert_eq!(s.instances[1].material.as_deref(), Some("floor"));
    let moved = s.instances[1].transform.point([1.0; 3]);
    assert_eq!(moved, [6.0, -2.0, 3.0]);
    assert_eq!(s.resolve("bunny.ply"), PathBuf::from("scenes/bunny.ply"));
    assert_eq!(
        s.resolve("/data/bunny.ply"),
        PathBuf::from("/data/bunny.ply")
    );
}

#[test]
fn what_is_left_out_has_its_default() {
    let s = parse(LEAST);
    assert_eq!(s.film, Film::default());
    assert_eq!(s.film.window(), [0, 0, 1280, 720]);
    assert_eq!(s.sampling, Sampling::default());
    assert_eq!(s.integrator, PluginBlock::new("pt"));
    assert!(s.lights.is_empty() && s.shapes.is_empty() && s.media.is_empty());
    assert!(s.prototypes.is_empty() && s.instances.is_empty());
    assert_eq!(s.camera.to_world().point([0.0, 0.0, -1.0]), [0.0, 0.0, 4.0]);
}

#[test]
fn the_focus_is_on_the_target_unless_told() {
    let text = LEAST.replace(
        r#""transform": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]"#,
        r#""origin": [0, 0, 3], "target": [4, 0, 0]"#,
    );
    assert_eq!(parse(&text).camera.focus_distance, 5.0);
}

#[test]
fn writing_and_reading_give_an_equal_scene() {
    for text in [FULL, LEAST] {
        let scene = parse(text);
        let written = scene.to_text().unwrap();
        let again = parse(&written);
        assert_eq!(scene, again, "{written}");
        assert_eq!(written, again.to_text().unwrap());
    }
    let other = parse(&FULL.replace(
        "\"seed\": 18446744073709551615",
        "\"seed\": 18446744073709551614",
    ));
    assert_ne!(parse(FULL), other);
}

#[test]
fn odd_numbers_and_texts_survive() {
    let mut scene = parse(LEAST);
    let odd = [
        0.1 + 0.2,
        f64::MIN_POSITIVE,
        5e-324,
        -0.0,
        f64::MAX,
        1.0 / 3.0,
        123456789.0,
    ];
    scene.integrator = PluginBlock::new("pt")
        .with("numbers", odd.to_vec())
        .with("quote\" \\ \u{1} ☁ 𝄞\n", "\u{7f}\t\"\\/😀");
    scene.sampling.budget = Budget::Error(1e-3);
    let again = parse(&scene.to_text().unwrap());
    assert_eq!(scene, again);
    let numbers = again.integrator.params["numbers"]
        .value
        .as_numbers()
        .unwrap();
    assert!(
        numbers
            .iter()
            .zip(odd)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
}

#[test]
fn a_description_that_breaks_the_rules_is_not_written() {
    let mut scene = parse(LEAST);
    scene.lights.push(Light::Point {
        position: [f64::NAN, 0.0, 0.0],
        intensity: [1.0; 3],
    });
    let error = scene.to_text().unwrap_err().to_string();
    assert!(
        error.contains("$.lights[0].position[0]: expected a number"),
        "{error}"
    );
    scene.lights.clear();
    scene.camera.projection = Projection::Perspective { fov_x_deg: 180.0 };
    assert!(scene.to_text().is_err());
    scene.camera.projection = Projection::Orthographic { width: 0.0 };
    assert!(scene.to_text().is_err());
}

#[test]
fn parallel_rays() {
    let text = LEAST
        .replace("perspective", "orthographic")
        .replace("fov_x_deg", "width");
    let scene = parse(&text);
    let width = 40.0;
    assert_eq!(scene.camera.projection, Projection::Orthographic { width });
    assert_eq!(parse(&scene.to_text().unwrap()), scene);
    // A lens is of perspective cameras.
    let wrong = text.replace("\"width\"", "\"lens_radius\": 1, \"width\"");
    let error = Scene::parse(wrong.as_bytes(), "a.json").unwrap_err();
    assert!(error.to_string().contains("lens_radius"), "{error}");
}

#[test]
fn large_meshes_are_written_line_by_line() {
    let mut scene = parse(LEAST);
    let n = 20_000;
    let positions: Vec<Vec3> = (0..n)
        .map(|i| [f64::from(i), f64::from(i) * 0.1, -f64::from(i)])
        .collect();
    let indices = (0..n as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
    let mesh = Mesh {
        positions,
        indices,
        ..Mesh::default()
    };
    let shape = Shape {
        geometry: Geometry::Mesh(mesh),
        material: None,
        emission: Some([1.0; 3]),
        emission_texture: None,
        two_sided: false,
        shaping: None,
        interior: None,
        priority: 0,
    };
    scene.shapes.push(shape);
    let text = scene.to_text().unwrap();
    assert!(text.lines().all(|l| l.len() < 120));
    assert_eq!(scene, parse(&text));
}

/// Colours and tangents of vertices, and the textures that use them.
#[test]
fn colours_of_vertices() {
    let text = r#"{
      "resolvent": 1,
      "camera": {"type": "perspective", "origin": [0, 0, 9], "target": [0, 0, 0], "fov_x_deg": 40},
      "textures": {
        "paint": {"vertex_color": true, "scale": 0.5},
        "wood": {"file": "wood.png", "vertex_color": true}
      },
      "materials": {"m": {"plugin": "diffuse", "params": {"reflectance": {"texture": "paint"}}}},
      "shapes": [{
        "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]],
        "colors": [[1, 0, 0], [0, 1, 0, 0.5], [0, 0, 4]],
        "tangents": [[1, 0, 0, 1], [1, 0, 0, 1], [1, 0, 0, -1]], "material": "m"
      }]
    }"#;
    let scene = parse(text);
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else {
        panic!()
    };
    assert_eq!(mesh.colors[0], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(mesh.colors[1], [0.0, 1.0, 0.0, 0.5]);
    assert_eq!(mesh.tangents[2], [1.0, 0.0, 0.0, -1.0]);
    let paint = &scene.textures["paint"];
    assert!(paint.vertex_color && paint.image == ImageSource::White);
    assert!(scene.textures["wood"].vertex_color);
    assert_eq!(scene, parse(&scene.to_text().unwrap()));
    for (good, bad, error) in [
        (
            "[0, 0, 4]]",
            "[0, 0]]",
            "three numbers (RGB) or four (RGBA)",
        ),
        (
            ", [0, 0, 4]]",
            "]",
            "expected one per position (3), found 2",
        ),
        (
            "\"vertex_color\": true, \"scale\"",
            "\"scale\"",
            "vertex_color",
        ),
    ] {
        let text = text.replacen(good, bad, 1);
        let found = Scene::parse(text.as_bytes(), "a.json")
            .unwrap_err()
            .to_string();
        assert!(found.contains(error), "{found}");
    }
}

#[test]
fn files_are_written_read_and_moved() {
    let dir = std::env::temp_dir().join(format!("resolvent-scene-{}", std::process::id()));
    std::fs::create_dir_all(dir.join("sub")).unwrap();
    let mut scene = Scene::parse(FULL.as_bytes(), dir.join("sub/full.json")).unwrap();
    scene.write(dir.join("sub/full.json")).unwrap();
    assert_eq!(Scene::read(dir.join("sub/full.json")).unwrap(), scene);

    scene.rebase(dir.join("moved.json"), &decls()).unwrap();
    scene.write(dir.join("moved.json")).unwrap();
    let moved = Scene::read(dir.join("moved.json")).unwrap();
    let Geometry::Ply { file, .. } = &moved.shapes[3].geometry else {
        panic!()
    };
    assert_eq!(file, "sub/bunny.ply");
    assert_eq!(
        moved.media["cloud"].block.params["file"].value.as_text(),
        Some("sub/cloud.vdb")
    );
    assert_eq!(
        moved.materials["with a blank"].block.plugin,
        "sub/./my/libglass.so"
    );
    assert_eq!(moved.resolve(file), dir.join("sub/bunny.ply"));
    let Geometry::Ply { file, .. } = &moved.prototypes["stone"][0].geometry else {
        panic!()
    };
    assert_eq!(file, "sub/stone.ply");

    // Out of the folder: no relative path is known to lead back, so it becomes absolute.
    scene
        .rebase(dir.join("sub/deep/moved.json"), &decls())
        .unwrap();
    let Geometry::Ply { file, .. } = &scene.shapes[3].geometry else {
        panic!()
    };
    assert_eq!(Path::new(file), dir.join("sub/bunny.ply"));

    let missing = Scene::read(dir.join("none.json")).unwrap_err();
    assert!(
        missing.to_string().contains("none.json: No such file"),
        "{missing}"
    );
    std::fs::remove_dir_all(dir).unwrap();
}
