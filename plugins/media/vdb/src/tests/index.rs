//! The index: tiles of every size, far-apart data, and what it costs.

use super::file::Voxels;
use super::{draws, of, ray};
use crate::index::{Found, Index, UNIFORM};
use crate::settings::Choice;
use resolvent_api::rng::Stream;
use resolvent_tests::{Moments, samples};

/// Transmittance along a ray against a sum over its voxels' values with nearest sampling.
fn transmittance(voxels: &Voxels, o: [f32; 3], d: [f32; 3], t1: f32, tau: f64) {
    let m = of(voxels, |s| {
        s.trilinear = false;
        s.transmittance = Choice::Ratio;
        s.sigma_t = resolvent_api::Spectrum::rgb(0.001, 0.001, 0.001);
    });
    let mut stream = Stream::new(12);
    let t = Moments::of((0..samples(20_000)).map(|_| {
        let f = m.transmit(&ray(o, d, t1), &draws(&mut stream));
        assert_eq!(f.violations, 0);
        f64::from(f.value[0] / f.ratio[0])
    }));
    let expected = (-tau * 0.001).exp();
    let error = (t.mean() - expected).abs();
    assert!(
        error <= 4.0 * t.standard_error() + 2e-5 * expected,
        "{o:?} {d:?}: {} {expected}",
        t.mean()
    );
}

#[test]
fn tiles_of_all_sizes() {
    let mut voxels = Voxels::new([0; 3], [8; 3], |_| 5.0);
    voxels.tiles = vec![([128, 0, 0], 2.0), ([0, 128, 0], 3.0)];
    voxels.root_tiles = vec![([4096, 0, 0], 0.5), ([-8192, 0, 0], 0.25)];
    // Across everything along x, y = z = 4: 4096 · 0.25, 8 · 5, 128 · 2, 4096 · 0.5.
    let tau = 1024.0 + 40.0 + 256.0 + 2048.0;
    transmittance(&voxels, [-9000.0, 4.0, 4.0], [1.0, 0.0, 0.0], 20_000.0, tau);
    transmittance(&voxels, [9000.0, 4.0, 4.0], [-1.0, 0.0, 0.0], 20_000.0, tau);
    // Along y at x = 64: the tile of 3 alone.
    transmittance(&voxels, [64.0, -50.0, 64.0], [0.0, 1.0, 0.0], 1000.0, 384.0);
    let m = of(&voxels, |_| {});
    // Two tiles of 4096 cubed: only their surface costs anything, and not much.
    assert!(m.info().memory < 4 << 20, "{} bytes", m.info().memory);
    assert_eq!(
        m.info().voxels,
        512 + 2 * 128u64.pow(3) + 2 * 4096u64.pow(3)
    );
    let at = |x: f32, y: f32, z: f32| m.coefficients([x, y, z].into()).sigma_t[0];
    assert_eq!(at(5000.0, 2000.0, 2000.0), 0.5);
    assert_eq!(at(4095.5, 2000.0, 2000.0), 0.25);
    assert_eq!(at(127.25, 64.0, 64.0), 0.5);
    assert_eq!(at(200.0, 64.0, 64.0), 2.0);
    assert_eq!(at(300.0, 64.0, 64.0), 0.0);
}

#[test]
fn trilinear_bounds_hold_at_the_faces_of_tiles() {
    let mut voxels = Voxels::new([0; 3], [8; 3], |_| 5.0);
    voxels.tiles = vec![([128, 0, 0], 2.0), ([0, 128, 0], 3.0)];
    voxels.root_tiles = vec![([4096, 0, 0], 0.5)];
    let m = of(&voxels, |s| s.transmittance = Choice::Ratio);
    let mut stream = Stream::new(13);
    for _ in 0..samples(50_000) {
        let o = [0, 1, 2].map(|_| 300.0 * (stream.uniform() - 0.1));
        let x = if stream.uniform() < 0.3 {
            4096.0 + 10.0 * (stream.uniform() - 0.5)
        } else {
            o[0]
        };
        let d = resolvent_api::math::warp::sphere(stream.uniform2());
        let s = ray([x, o[1], o[2]], d.into(), 50.0);
        let f = m.transmit(&s, &draws(&mut stream));
        // `tap` limits itself to the cell, so bounds that miss a neighbour show here.
        assert_eq!(f.violations, 0, "{s:?}");
    }
}

#[test]
fn far_apart_data_take_little_memory() {
    let mut voxels = Voxels::new([0; 3], [4; 3], |_| 1.0);
    for at in [[1_000_000, 900_000, -800_000], [-1_000_000, 3, 500_000]] {
        voxels.voxels.insert(at, 2.0);
    }
    let m = of(&voxels, |s| {
        s.trilinear = false;
        s.transmittance = Choice::Ratio;
    });
    assert!(m.info().memory < 4 << 20, "{} bytes", m.info().memory);
    let at = |p: [f32; 3]| m.coefficients(p.into()).sigma_t[0];
    assert_eq!(
        (
            at([1e6, 9e5, -8e5]),
            at([-1e6, 3.0, 5e5]),
            at([1.0, 2.0, 3.0])
        ),
        (2.0, 2.0, 1.0)
    );
    assert_eq!(at([1e6, 9e5 + 9.0, -8e5]), 0.0);
    let mut stream = Stream::new(14);
    let t = |o, d, t1| {
        let f = m.transmit(&ray(o, d, t1), &draws(&mut Stream::new(stream.bits())));
        (f.value[0] / f.ratio[0], f.lookups)
    };
    let mut t = t;
    // Across all of it, through the middle block.
    let (value, lookups) = t([-1.1e6, 1.0, 1.0], [1.0, 0.0, 0.0], 3e6);
    assert!(
        (0.0..=1.0).contains(&value) && lookups < 100,
        "{value} {lookups}"
    );
    let wide = Voxels::new([0; 3], [1; 3], |_| 1.0);
    let mut wide = wide;
    wide.voxels.insert([1 << 30, 0, 0], 1.0);
    let error = super::made(&wide, |_| {}).err().unwrap();
    assert!(
        error.contains("density") && error.contains("spread"),
        "{error}"
    );
}

#[test]
fn every_brick_is_found_again() {
    let mut stream = Stream::new(15);
    for spread in [200i64, 5000, 400_000] {
        let mut bricks = std::collections::HashMap::new();
        let hi = [spread; 3];
        let mut index = Index::new([[-spread; 3], hi], 100).unwrap();
        for i in 0..100u32 {
            let v = [0, 1, 2].map(|_| ((stream.uniform() * 2.0 - 1.0) * spread as f32) as i64);
            let brick = index.brick_of(v).map(|c| c as i32);
            index.set(brick, i);
            bricks.insert(brick, i);
        }
        index.dilate();
        for (brick, i) in &bricks {
            assert_eq!(index.slot(*brick), *i);
            // Interpolation reaches over to here: there must be cells of their own.
            for side in 1..8 {
                let near = [0, 1, 2].map(|a| brick[a] - (side >> a & 1));
                assert!(
                    !matches!(index.find(near), Some(Found::Uniform(..))),
                    "{brick:?} {near:?}"
                );
            }
        }
        let outside = index.extent();
        assert_eq!(index.slot(outside), UNIFORM);
        assert!(index.memory() < 4 << 20, "{spread}: {}", index.memory());
    }
}

/// Widths that no integer of 64 bits holds, too.
#[test]
fn domains_that_are_too_wide_are_errors() {
    let (most, wide) = (i64::MAX, 1 << 22);
    assert!(Index::new([[0; 3], [wide; 3]], 1).is_ok());
    for (lo, hi) in [
        (0, wide + 1),
        (-most - 1, most),
        (-1, most),
        (1, 0),
        (most, -most),
    ] {
        for axis in 0..3 {
            let mut domain = [[0; 3]; 2];
            (domain[0][axis], domain[1][axis]) = (lo, hi);
            let error = Index::new(domain, 1).err().expect("too wide");
            assert!(error.contains("spread over more than"), "{error}");
        }
    }
}
