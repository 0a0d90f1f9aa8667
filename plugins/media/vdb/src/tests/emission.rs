//! Emission, colour and their grids.

use super::file::Voxels;
use super::{data, draws, made, medium};
use crate::Vdb;
use crate::blackbody::Blackbody;
use crate::channel::Source;
use crate::settings::{Choice, Settings};
use resolvent_api::medium::medium_traits;
use resolvent_api::rng::Stream;
use resolvent_api::{Affine, Segment, Spectrum, Vec3};
use resolvent_tests::medium::{check, segment};
use resolvent_tests::{Moments, Suite, samples};

fn source(grid: &str, scale: f64, offset: f64) -> Option<Source> {
    Some(Source {
        scale,
        offset,
        ..Source::new(grid)
    })
}

fn fire() -> Settings {
    let mut s = Settings::new(data("corpus/multi_fire.vdb").to_string_lossy(), "density");
    s.flame = source("flame", 2.0, 0.0);
    s.emission = Spectrum::rgb(1.0, 0.5, 0.1);
    s
}

#[test]
fn flights_pick_up_what_quadrature_says() {
    let mut suite = Suite::new();
    for sigma in [Spectrum::rgb(0.8, 0.8, 0.8), Spectrum::rgb(0.2, 0.8, 3.0)] {
        let mut s = fire();
        s.sigma_t = sigma;
        s.transmittance = Choice::Survival;
        let m = medium(&s);
        assert!(m.info().traits & medium_traits::EMISSIVE != 0);
        assert_eq!(m.info().grids_read, 2);
        let centre = m.info().bounds.centre();
        let from = Vec3::from(m.info().bounds.min) - Vec3::splat(0.2);
        check(
            &mut suite,
            &format!("{sigma:?}"),
            &Vdb(m),
            &[segment(from, centre, 6.0)],
            1e-3,
        );
    }
    suite.assert();
}

/// A grid of another file, at another place: emission there is what it was where it came from, and the density stays.
#[test]
fn grids_of_other_files_have_their_own_place() {
    let plain = medium(&fire());
    let mut s = fire();
    let moved = s.flame.as_mut().unwrap();
    moved.file = Some(data("corpus/multi_fire.vdb").to_string_lossy().into_owned());
    moved.transform = Affine::from_rows([
        [0.0, -2.0, 0.0, 0.3],
        [2.0, 0.0, 0.0, -0.2],
        [0.0, 0.0, 2.0, 0.1],
    ]);
    let place = moved.transform;
    let m = medium(&s);
    let (mut stream, bounds) = (Stream::new(4), plain.info().bounds);
    let mut bright = 0;
    for _ in 0..2000 {
        let u = [stream.uniform(), stream.uniform(), stream.uniform()];
        let from = Vec3::from(bounds.min) + bounds.extent() * Vec3::from(u);
        let to = place.point(from.as_dvec3()).as_vec3();
        let (a, b) = (plain.coefficients(from), m.coefficients(to));
        let scale = a.emission[0].max(1e-3);
        assert!(
            (a.emission[0] - b.emission[0]).abs() < 1e-3 * scale,
            "{from}"
        );
        assert_eq!(plain.coefficients(to).sigma_t, b.sigma_t);
        bright += u32::from(a.emission[0] > 0.0);
    }
    assert!(bright > 20, "{bright}");
}

/// Emission in voxels so large, or so far away, that the density could not be told apart from nothing beside it.
#[test]
fn emission_out_of_all_proportion_is_an_error() {
    let voxels = Voxels::new([0; 3], [8; 3], |_| 1.0);
    let corpus = data("corpus/multi_fire.vdb").to_string_lossy().into_owned();
    let with = |scale: f64, offset: f64| {
        made(&voxels, |s| {
            s.emission = Spectrum::rgb(1.0, 0.5, 0.1);
            s.flame = source("flame", 1.0, 0.0);
            let flame = s.flame.as_mut().unwrap();
            flame.file = Some(corpus.clone());
            let row = |i: usize| {
                let mut row = [0.0, 0.0, 0.0, offset];
                row[i] = scale;
                row
            };
            flame.transform = Affine::from_rows([row(0), row(1), row(2)]);
        })
    };
    let (m, _) = with(1.0, 0.0).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(m.coefficients(Vec3::splat(4.0)).sigma_t[0], 1.0);
    for scale in [1e8, 1e13, 1e19, 1e22, 1e60] {
        let error = with(scale, 0.0).err().unwrap_or_else(|| panic!("{scale}"));
        for part in [&corpus, "'flame'", "'density' of voxels.vdb", "one scale"] {
            assert!(error.contains(part), "{scale}: {error}");
        }
    }
    for offset in [1e8, 1e30] {
        let error = with(1.0, offset)
            .err()
            .unwrap_or_else(|| panic!("{offset}"));
        assert!(error.contains("'density'"), "{offset}: {error}");
    }
}

#[test]
fn emission_without_density() {
    // No extinction at all: what is picked up is the integral of the emission, wherever it is.
    let mut s = fire();
    s.density.scale = 0.0;
    let m = medium(&s);
    let t = m.info().traits;
    assert!(t & medium_traits::EMPTY == 0 && t & medium_traits::EMISSIVE != 0);
    let flame = {
        let mut s = fire();
        s.density.grid = "flame".into();
        s.flame = None;
        medium(&s)
    };
    let bounds = flame.info().bounds;
    let mut suite = Suite::new();
    for d in [Vec3::new(0.3, 1.0, 0.2), Vec3::new(-1.0, 0.1, 0.05)] {
        let o = bounds.centre() - 6.0 * d.normalize();
        let ray = Segment {
            o: o.into(),
            t0: 0.0,
            d: d.normalize().into(),
            t1: 12.0,
        };
        let exact = (0..20_000)
            .map(|i| {
                f64::from(
                    flame
                        .coefficients(ray.at((i as f32 + 0.5) * 12.0 / 20_000.0))
                        .sigma_t[0],
                )
            })
            .sum::<f64>()
            * 12.0
            / 20_000.0;
        let mut stream = Stream::new(21);
        let picked: Vec<_> = (0..samples(50_000))
            .map(|_| m.sample(&ray, &draws(&mut stream)).emitted)
            .collect();
        for (lane, factor) in [2.0, 1.0, 0.2].into_iter().enumerate() {
            let moments = Moments::of(picked.iter().map(|e| f64::from(e[lane])));
            suite.mean(format!("{d}, lane {lane}"), &moments, factor * exact, 1e-4);
        }
    }
    suite.assert();
}

#[test]
fn black_body() {
    let mut s = fire();
    s.flame = None;
    s.temperature = source("temperature", 1500.0, 600.0);
    s.emission_scale = 0.25;
    let m = medium(&s);
    let temperature = {
        let mut s = fire();
        s.flame = None;
        s.density = Source {
            scale: 1500.0,
            offset: 600.0,
            ..Source::new("temperature")
        };
        medium(&s)
    };
    let table = Blackbody::default();
    let mut stream = Stream::new(31);
    let bounds = temperature.info().bounds;
    let mut seen = 0;
    for _ in 0..1000 {
        let p = Vec3::from(bounds.min)
            + bounds.extent() * Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let kelvin = temperature.coefficients(p).sigma_t[0];
        let (got, expected) = (m.coefficients(p).emission, table.radiance(kelvin));
        for lane in 0..3 {
            let e = 0.25 * expected[lane];
            // A position off by an ulp is a temperature off by more.
            assert!(
                (got[lane] - e).abs() <= 2e-2 * e + 1e-9,
                "{kelvin} K at {p}: {got:?} {expected:?}"
            );
        }
        seen += u32::from(got[0] > 1.0);
    }
    assert!(seen > 50, "{seen} positions glow");
}

#[test]
fn tints_multiply_the_albedo() {
    let mut s = fire();
    s.flame = None;
    s.albedo = Spectrum::rgb(0.9, 0.6, 0.3);
    s.tints = vec![Source {
        scale: 0.5,
        offset: 0.25,
        ..Source::new("flame")
    }];
    let m = medium(&s);
    let flame = {
        let mut s = fire();
        s.flame = None;
        s.density = Source {
            scale: 0.5,
            offset: 0.25,
            ..Source::new("flame")
        };
        medium(&s)
    };
    let bounds = flame.info().bounds;
    let mut stream = Stream::new(41);
    for _ in 0..1000 {
        let p = Vec3::from(bounds.min)
            + bounds.extent() * Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let (c, tint) = (m.coefficients(p), flame.coefficients(p).sigma_t[0].min(1.0));
        for lane in 0..3 {
            let expected = c.sigma_t[lane] * s.albedo[lane] * tint;
            assert!(
                (c.sigma_s[lane] - expected).abs() < 1e-4,
                "{p}: {c:?} {tint}"
            );
        }
    }
}

#[test]
fn rough_bricks_emit_where_they_hold_nothing() {
    // So dense that bricks are walked voxel by voxel: the flame's own voxels of no density must not be passed over.
    let mut suite = Suite::new();
    let mut s = fire();
    s.sigma_t = Spectrum::rgb(30_000.0, 30_000.0, 30_000.0);
    s.density.offset = -1.0;
    s.transmittance = Choice::Survival;
    let services = crate::load::Services {
        parallel: &resolvent_vdb::Serial,
        warn: &|_| {},
    };
    let m = crate::build::build(&s, services).unwrap();
    // Past the few voxels that are left, through the flame's edge.
    let from = Vec3::new(0.5, -2.5, 1.875);
    let ray = segment(from, from + Vec3::X, 5.0);
    check(&mut suite, "rough", &Vdb(m), &[ray], 1e-2);
    suite.assert();
}
