//! The checks every medium must pass, on one voxel grid in all its kernels, and majorants over millions of look-ups.

use super::bench::inner_segments;
use super::file::Voxels;
use super::{data, draws, medium, of};
use crate::Vdb;
use crate::settings::{Choice, Settings};
use resolvent_api::rng::{Stream, mix};
use resolvent_api::{Affine, Medium, Segment, Spectrum, Vec3};
use resolvent_tests::medium::{check, segment};
use resolvent_tests::{Suite, samples};

/// Rough noise with holes, across brick borders and the origin.
fn noise() -> Voxels {
    let mut voxels = Voxels::new([-7, -3, 2], [9, 12, 14], |[x, y, z]| {
        let bits = mix((x * 131 + y * 17 + z + 100_000) as u64) >> 40;
        let v = bits as f32 / (1u64 << 24) as f32;
        if v < 0.3 { 0.0 } else { v * v }
    });
    // Sheared and mirrored.
    voxels.matrix = [
        [0.5, 0.1, 0.0, 0.0],
        [0.0, -0.4, 0.1, 0.0],
        [0.05, 0.0, 0.6, 0.0],
        [3.0, -2.0, 1.0, 1.0],
    ];
    voxels
}

/// Through the middle, along an axis, and from inside.
fn segments(medium: &dyn Medium) -> Vec<Segment> {
    let bounds = medium.info().bounds;
    let (centre, size) = (bounds.centre(), bounds.extent());
    vec![
        segment(
            Vec3::from(bounds.min) - 0.1 * size,
            centre,
            1.3 * size.length(),
        ),
        segment(centre - Vec3::X * size.x, centre, 2.0 * size.x),
        segment(
            centre + 0.11 * size,
            centre + Vec3::new(0.3, 1.0, -0.7) * size,
            0.4 * size.length(),
        ),
    ]
}

#[test]
fn every_kernel() {
    let chromatic = Spectrum::rgb(0.3, 1.0, 4.0);
    let mut suite = Suite::new();
    for half in [false, true] {
        let mut voxels = noise();
        voxels.half = half;
        for trilinear in [true, false] {
            for sigma in [Spectrum::rgb(1.5, 1.5, 1.5), chromatic] {
                for transmittance in [Choice::Ratio, Choice::Survival] {
                    // Half of the combinations hold everything twice.
                    if half != trilinear && transmittance == Choice::Ratio {
                        continue;
                    }
                    let m = of(&voxels, |s| {
                        s.sigma_t = sigma;
                        s.albedo = Spectrum::rgb(0.9, 0.5, 0.2);
                        s.trilinear = trilinear;
                        s.transmittance = transmittance;
                    });
                    let name =
                        format!("half {half}, trilinear {trilinear}, {sigma:?}, {transmittance:?}");
                    let segments = segments(&*m);
                    // Quadrature meets a kink, or with nearest voxels a jump, at each voxel's face.
                    check(
                        &mut suite,
                        &name,
                        &Vdb(m),
                        &segments,
                        if trilinear { 1e-4 } else { 3e-3 },
                    );
                }
            }
        }
    }
    suite.assert();
}

#[test]
fn rough_bricks() {
    let mut voxels = noise();
    for (at, v) in &mut voxels.voxels {
        *v *= 10f32.powi((at[0] + at[1]).rem_euclid(5) - 1);
    }
    let mut suite = Suite::new();
    for transmittance in [Choice::Ratio, Choice::Survival] {
        let m = of(&voxels, |s| {
            s.sigma_t = Spectrum::rgb(1.0, 0.02, 0.3);
            s.transmittance = transmittance;
        });
        let segments = segments(&*m);
        check(
            &mut suite,
            &format!("{transmittance:?}"),
            &Vdb(m),
            &segments,
            1e-3,
        );
    }
    suite.assert();
}

#[test]
fn placed_by_the_scene() {
    let voxels = noise();
    let turn = Affine::from_rows([
        [0.0, -2.0, 0.0, 10.0],
        [2.0, 0.0, 0.3, -4.0],
        [0.1, 0.0, 2.0, 7.0],
    ]);
    let (plain, placed) = (of(&voxels, |_| {}), of(&voxels, |s| s.to_world = turn));
    let bounds = plain.info().bounds;
    let mut stream = Stream::new(8);
    for _ in 0..1000 {
        let at = |u: f32, i: usize| {
            f64::from(bounds.min[i]) + f64::from(u) * f64::from(bounds.extent()[i])
        };
        let p = [0, 1, 2].map(|i| at(stream.uniform(), i));
        let q = turn.point(p.into()).as_vec3();
        let (a, b) = (
            plain.coefficients(Vec3::from(p.map(|c| c as f32))),
            placed.coefficients(q),
        );
        assert!(
            (a.sigma_t[0] - b.sigma_t[0]).abs() < 2e-5,
            "{p:?}: {a:?} {b:?}"
        );
        assert!(a.sigma_t[0] == 0.0 || placed.info().bounds.contains(q));
    }
}

#[test]
fn no_violations_in_millions_of_look_ups() {
    for (file, sigma) in [
        ("cloud_s.vdb", 24.56),
        ("cloud_s.vdb", 3000.0),
        ("real/smoke.vdb", 1.492),
    ] {
        let mut settings = Settings::new(data(file).to_string_lossy(), "density");
        settings.sigma_t = Spectrum::rgb(sigma, sigma, sigma);
        settings.transmittance = Choice::Ratio;
        let m = medium(&settings);
        let mut stream = Stream::new(77);
        let (mut lookups, mut most) = (0u64, 0);
        for s in inner_segments(&*m, samples(100_000)) {
            for f in [
                m.sample(&s, &draws(&mut stream)),
                m.transmit(&s, &draws(&mut stream)),
            ] {
                assert_eq!(f.violations, 0, "{s:?}");
                lookups += u64::from(f.lookups);
                most = most.max(f.lookups);
            }
        }
        assert!(lookups as usize > samples(1_000_000), "{file}: {lookups}");
        assert!(most < 5000, "{file}: {most} look-ups of one flight");
    }
}

#[test]
fn depth_is_near() {
    let mut settings = Settings::new(data("cloud_s.vdb").to_string_lossy(), "density");
    settings.sigma_t = Spectrum::rgb(24.56, 24.56, 24.56);
    let m = medium(&settings);
    // The densest line of the cloud has an optical thickness of 60.0.
    let bounds = m.info().bounds;
    let mut stream = Stream::new(5);
    let (mut sum, mut exact) = (0.0f64, 0.0f64);
    for _ in 0..200 {
        let [u, v] = stream.uniform2();
        let size = bounds.extent();
        let o = Vec3::from(bounds.min) + Vec3::new(u * size.x, v * size.y, -1.0);
        let s = Segment {
            o: o.into(),
            t0: 0.0,
            d: [0.0, 0.0, 1.0],
            t1: size.z + 2.0,
        };
        sum += f64::from(m.depth(&s)[0]);
        exact += (0..2000)
            .map(|i| {
                f64::from(
                    m.coefficients(s.at((i as f32 + 0.5) * s.t1 / 2000.0))
                        .sigma_t[0],
                )
            })
            .sum::<f64>()
            * f64::from(s.t1)
            / 2000.0;
    }
    assert!((sum / exact - 1.0).abs() < 0.05, "{sum} {exact}");
}
