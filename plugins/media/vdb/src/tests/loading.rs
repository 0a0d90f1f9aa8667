//! What is read, what is refused, and what it costs.

use super::file::Voxels;
use super::{data, made, medium, of};
use crate::build::build;
use crate::channel::Source;
use crate::load::Services;
use crate::settings::Settings;
use resolvent_api::medium::medium_traits;
use resolvent_api::{Affine, Spectrum};
use resolvent_vdb::Serial;

fn error(settings: &Settings) -> String {
    let services = Services {
        parallel: &Serial,
        warn: &|_| {},
    };
    build(settings, services).err().expect("an error").0
}

fn corpus(name: &str, grid: &str) -> Settings {
    Settings::new(data("corpus").join(name).to_string_lossy(), grid)
}

#[test]
fn errors_say_what_is_wrong() {
    let list = error(&corpus("multi_fire.vdb", "smoke"));
    for word in ["multi_fire.vdb", "smoke", "density", "flame", "temperature"] {
        assert!(list.contains(word), "{list}");
    }
    for (file, grid, words) in [
        ("no_grids.vdb", "density", ["no_grids.vdb", "density"]),
        ("xform_frustum.vdb", "density", ["Frustum", "density"]),
        ("xform_affine_sdf.vdb", "surface", ["level set", "fog"]),
        (
            "type_vec3s_bloscmask.vdb",
            "velocity",
            ["vector", "velocity"],
        ),
        ("points_fixed.vdb", "points", ["points", "not"]),
    ] {
        let info = resolvent_vdb::File::open(data("corpus").join(file)).unwrap();
        let grid = if file == "no_grids.vdb" {
            grid
        } else {
            info.grids()[0].name.as_str()
        };
        let text = error(&corpus(file, grid));
        let first = if words[1] == "fog" || words[0] == "no_grids.vdb" || words[0] == "Frustum" {
            words[0]
        } else {
            grid
        };
        assert!(text.contains(first), "{file}: {text}");
    }
    let mut s = corpus("multi_fire.vdb", "density");
    s.to_world = Affine::from_rows([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0],
    ]);
    assert!(error(&s).contains("no inverse"));
    s = corpus("multi_fire.vdb", "density");
    s.albedo = Spectrum::rgb(1.5, 0.0, 0.0);
    assert!(error(&s).contains("albedo"));
    s = corpus("multi_fire.vdb", "density");
    s.tints = vec![Source::new("colour")];
    assert!(error(&s).contains("colour"));
    s.tints[0].file = Some("/no/such/tints.vdb".into());
    assert!(error(&s).contains("/no/such/tints.vdb"));
    assert!(error(&Settings::new("/no/such/file.vdb", "density")).contains("/no/such/file.vdb"));
}

#[test]
fn unnamed_grids_are_not_read() {
    let all = {
        let mut s = corpus("multi_fire.vdb", "density");
        s.flame = Some(Source::new("flame"));
        s.temperature = Some(Source {
            scale: 1000.0,
            offset: 0.0,
            ..Source::new("temperature")
        });
        medium(&s).info()
    };
    let one = medium(&corpus("multi_fire.vdb", "density")).info();
    assert_eq!((one.grids_read, all.grids_read), (1, 3));
    assert!(one.bytes_read > 0 && one.bytes_read < all.bytes_read);
    assert!(one.memory < all.memory);
}

#[test]
fn scale_and_offset() {
    let voxels = Voxels::new([0; 3], [9; 3], |[x, ..]| x as f32 * 0.25);
    let value = |scale: f64, offset: f64, p: [f32; 3]| {
        let (m, _) = made(&voxels, |s| {
            (s.density.scale, s.density.offset) = (scale, offset)
        })
        .unwrap();
        m.coefficients(p.into()).sigma_t[0]
    };
    assert_eq!(value(2.0, 0.0, [4.0, 4.0, 4.0]), 2.0);
    assert_eq!(value(2.0, 1.0, [4.0, 4.0, 4.0]), 3.0);
    assert_eq!(value(-1.0, 1.5, [4.0, 4.0, 4.0]), 0.5);
    assert_eq!(value(-1.0, 0.5, [4.0, 4.0, 4.0]), 0.0);
    // The background is a value like others: outside the voxels it is the offset.
    assert_eq!(value(1.0, 0.5, [4.0, 4.0, -1.0]), 0.5);
    // Traits follow.
    let of = |s: Spectrum| of(&voxels, |set| set.sigma_t = s).info().traits;
    assert!(of(Spectrum::rgb(1.0, 1.0, 1.0)) & medium_traits::GREY != 0);
    assert!(of(Spectrum::rgb(1.0, 1.0, 2.0)) & medium_traits::GREY == 0);
}

#[test]
fn memory_is_the_bricks_and_little_more() {
    for name in ["cloud_s.vdb", "real/smoke.vdb"] {
        let info = medium(&Settings::new(data(name).to_string_lossy(), "density")).info();
        let file = resolvent_vdb::File::open(data(name)).unwrap();
        let grid = file.grid("density").unwrap();
        let leaves = file.read_topology(grid).unwrap().leaves().len() as u64;
        let bricks = leaves * 512 * if grid.saved_as_half { 2 } else { 4 };
        assert!(
            info.memory >= bricks && info.memory < bricks + bricks / 4 + (1 << 20) + (1 << 17),
            "{name}: {} {bricks}",
            info.memory
        );
        // Tight: active voxels and one more.
        let [lo, hi] = file.read_topology(grid).unwrap().active_bbox().unwrap();
        let t = grid.transform.as_ref().unwrap();
        let (lo, hi) = (
            t.to_world(lo.map(|c| f64::from(c) - 1.0)),
            t.to_world(hi.map(|c| f64::from(c) + 1.0)),
        );
        for i in 0..3 {
            assert!(
                (f64::from(info.bounds.min[i]) - lo[i].min(hi[i])).abs() < 1e-4,
                "{name}"
            );
            assert!(
                (f64::from(info.bounds.max[i]) - lo[i].max(hi[i])).abs() < 1e-4,
                "{name}"
            );
        }
    }
}

#[test]
fn made_from_parameters() {
    let path = data("corpus/multi_fire.vdb");
    let with = |more: &str| {
        let json = format!("{{\"file\": {:?}{more}}}", path.to_string_lossy());
        resolvent_tests::host::create::<crate::Vdb>(&json)
    };
    use resolvent_api::Medium;
    let p = [2.75, -1.75, 1.875].into();
    let plain = with("").unwrap().coefficients(p);
    let changed = with(
        ", \"sigma_t\": [1, 2, 4], \"albedo\": 0.5, \"density_scale\": 3, \"emission_grid\": \"flame\", \"emission_grid_scale\": 2, \"emission\": [1, 0, 0]",
    )
    .unwrap();
    let c = changed.coefficients(p);
    assert_eq!(plain.sigma_s.to_rgb(), plain.sigma_t.to_rgb());
    for (lane, factor) in [3.0f32, 6.0, 12.0].into_iter().enumerate() {
        assert!((c.sigma_t[lane] / plain.sigma_t[lane] - factor).abs() < 1e-5 * factor);
        assert_eq!(c.sigma_s[lane], 0.5 * c.sigma_t[lane]);
    }
    assert!(c.emission[0] >= 0.0 && c.emission[1] == 0.0);
    assert_eq!(changed.info().grids_read, 2);
    assert!(
        with(", \"grid\": \"smoke\"")
            .err()
            .unwrap()
            .contains("flame")
    );
    assert!(with(", \"albedo\": 1.5").is_err());
    assert!(with(", \"interpolation\": \"cubic\"").is_err());
}
