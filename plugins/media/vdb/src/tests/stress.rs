//! Closed forms, and densities chosen to break trackers.

use super::file::Voxels;
use super::{draws, made, of, ray};
use crate::settings::Choice;
use resolvent_api::rng::Stream;
use resolvent_api::{Medium, Segment, Spectrum};
use resolvent_tests::{Moments, Suite, samples};

/// Mean of `transmit`, and the most look-ups of any.
fn transmittance(medium: &dyn Medium, s: &Segment, count: usize) -> (Moments, u32) {
    let mut stream = Stream::new(0x57_2e55);
    let mut most = 0;
    let moments = Moments::of((0..count).map(|_| {
        let f = medium.transmit(s, &draws(&mut stream));
        assert_eq!(f.violations, 0, "{s:?}");
        most = most.max(f.lookups);
        f64::from(f.value[0] / f.ratio[0])
    }));
    (moments, most)
}

/// Free flights: share that survives, and the most look-ups.
fn survival(medium: &dyn Medium, s: &Segment, count: usize) -> (Moments, u32) {
    let mut stream = Stream::new(0x51_2e55);
    let mut most = 0;
    let moments = Moments::of((0..count).map(|_| {
        let f = medium.sample(s, &draws(&mut stream));
        assert_eq!(f.violations, 0, "{s:?}");
        most = most.max(f.lookups);
        f64::from(u8::from(!f.collided()))
    }));
    (moments, most)
}

/// Both estimators of a transmittance against its value.
fn check(suite: &mut Suite, what: &str, medium: &dyn Medium, s: &Segment, expected: f64) {
    let (moments, _) = transmittance(medium, s, samples(40_000));
    suite.mean(format!("{what}, transmit"), &moments, expected, 2e-6);
    let (moments, _) = survival(medium, s, samples(40_000));
    suite.mean(format!("{what}, sample"), &moments, expected, 2e-6);
}

const MODES: [Choice; 2] = [Choice::Ratio, Choice::Survival];

#[test]
fn one_voxel() {
    let mut voxels = Voxels::new([4, 5, 6], [5, 6, 7], |_| 3.0);
    voxels.matrix = super::file::scale(0.5);
    let mut suite = Suite::new();
    let centre = [2.0, 2.5, 3.0];
    let r3 = 3f64.sqrt();
    for mode in MODES {
        for (trilinear, taus) in [
            (true, [1.5, 3.0 * 0.5 * r3 / 2.0]),
            (false, [1.5, 3.0 * 0.5 * r3]),
        ] {
            let m = of(&voxels, |s| {
                s.transmittance = mode;
                s.trilinear = trilinear;
            });
            for (d, tau) in [([1.0f32, 0.0, -0.0], taus[0]), ([1.0, 1.0, 1.0], taus[1])] {
                let n = d.iter().map(|c| c * c).sum::<f32>().sqrt();
                let o = [0, 1, 2].map(|i| centre[i] - 3.0 * d[i] / n);
                check(
                    &mut suite,
                    &format!("{mode:?} {trilinear} {d:?}"),
                    &*m,
                    &ray(o, d, 10.0),
                    (-tau).exp(),
                );
            }
        }
    }
    suite.assert();
}

#[test]
fn rays_on_faces_edges_corners() {
    let (n, sigma) = (32.0f32, 0.05f64);
    let voxels = Voxels::new([0; 3], [32; 3], |_| 0.05);
    let mut suite = Suite::new();
    let (r2, r3, n64) = (2f64.sqrt(), 3f64.sqrt(), 32f64);
    for trilinear in [true, false] {
        let m = of(&voxels, |s| {
            s.trilinear = trilinear;
            s.transmittance = Choice::Ratio;
        });
        // Lines through the lattice point `p`; its voxel's centre, or with a half, its corners, edges and faces.
        let (first, last) = if trilinear {
            (0.0, n - 1.0)
        } else {
            (-0.5, n - 0.5)
        };
        let axis = sigma * n64;
        let (face, main) = if trilinear {
            (r2 * sigma * (n64 - 1.0 / 3.0), r3 * sigma * (n64 - 0.5))
        } else {
            (r2 * axis, r3 * axis)
        };
        for (d, tau, lines) in [
            (
                [1.0f32, 0.0, 0.0],
                axis,
                vec![
                    [0.0f32, 8.0, 16.0],
                    [0.0, 7.5, 9.0],
                    [0.0, 16.0 + 1e-7, 8.0],
                ],
            ),
            (
                [1.0, -0.0, -0.0],
                axis,
                vec![[0.0, 8.0, 16.0], [0.0, 15.5, 15.5], [0.0, 7.999_999, 24.0]],
            ),
            (
                [0.0, -1.0, -0.0],
                axis,
                vec![[8.0, 31.0, 16.0], [7.5, 31.0, 23.5]],
            ),
            (
                [-0.0, 0.0, 1.0],
                axis,
                vec![[24.0, 8.0, 0.0], [24.5, 8.5, 0.0]],
            ),
            (
                [1.0, 1.0, 0.0],
                face,
                vec![[first, first, 8.0], [first, first, 7.5]],
            ),
            ([-1.0, 0.0, -1.0], face, vec![[last, 16.0, last]]),
            ([1.0, 1.0, 1.0], main, vec![[first; 3]]),
            ([-1.0, -1.0, -1.0], main, vec![[last; 3]]),
        ] {
            for line in lines {
                let length = d.iter().map(|c| c * c).sum::<f32>().sqrt();
                let o = [0, 1, 2].map(|i| line[i] - 64.0 * d[i] / length);
                let s = ray(o, d, 256.0);
                let what = format!("trilinear {trilinear}: {d:?} through {line:?}");
                check(&mut suite, &what, &*m, &s, (-tau).exp());
                if !trilinear {
                    let (moments, most) = transmittance(&*m, &s, 10);
                    // 64 voxels away, t has an ulp of 8e-6: that is what the length inside can be off by.
                    suite.close(&what, moments.mean(), (-tau).exp(), 4e-6, 0.0);
                    suite.claim(most == 0, || {
                        format!("{what}: {most} look-ups in a constant grid")
                    });
                }
            }
        }
    }
    suite.assert();
}

#[test]
fn twelve_decades_in_one_grid() {
    let value = |k: i32| 10f32.powi(k - 6);
    let voxels = Voxels::new([0, 0, 0], [6, 5, 13], |[_, _, z]| value(z));
    let mut suite = Suite::new();
    for trilinear in [true, false] {
        for mode in MODES {
            let m = of(&voxels, |s| {
                s.trilinear = trilinear;
                s.transmittance = mode;
            });
            for k in 0..13 {
                // Four voxels in x, at least one from the ends.
                let s = ray([0.5, 2.0, k as f32], [1.0, 0.0, 0.0], 4.0);
                let expected = (-4.0 * f64::from(value(k))).exp();
                let what = format!("layer {k}, trilinear {trilinear}, {mode:?}");
                let (moments, most) = transmittance(&*m, &s, 2000);
                suite.claim(most <= 1000, || format!("{what}: {most} look-ups"));
                let (free, most) = survival(&*m, &s, 2000);
                suite.claim(most <= 1000, || {
                    format!("{what}: {most} look-ups of a flight")
                });
                for moments in [moments, free] {
                    if (0.01..0.998).contains(&expected) {
                        suite.mean(&what, &moments, expected, 2e-6);
                    } else {
                        suite.close(&what, moments.mean(), expected, 0.0, 1.5e-3);
                    }
                }
            }
        }
    }
    suite.assert();
}

#[test]
fn one_hot_voxel() {
    let voxels = Voxels::new(
        [0; 3],
        [64; 3],
        |v| if v == [30, 31, 32] { 1e6 } else { 1e-6 },
    );
    let m = of(&voxels, |s| s.transmittance = Choice::Ratio);
    let mut suite = Suite::new();
    for (name, o, d) in [
        ("x", [-2.0f32, 34.0, 32.0], [1.0f32, 0.0, 0.0]),
        ("z", [30.0, 28.0, -2.0], [0.0, 0.0, 1.0]),
        ("y", [33.0, -2.0, 35.0], [0.0, 1.0, 0.0]),
    ] {
        let s = ray(o, d, 68.0);
        let (moments, most) = transmittance(&*m, &s, 100_000);
        // The last brick holds voxels of the outside: null collisions at a rate of 8e-6 make the noise of rare events.
        suite.close(
            name,
            moments.mean(),
            0.999_936_002_048,
            0.0,
            4.0 * (8e-6f64 / 1e5).sqrt(),
        );
        suite.claim(most <= 1000, || format!("{name}: {most} look-ups"));
    }
    // Rays close to it, where the interpolant spans twelve decades inside a voxel.
    let mut stream = Stream::new(3);
    for _ in 0..300 {
        let o = [
            30.0 + 4.0 * (stream.uniform() - 0.5),
            31.0 + 4.0 * (stream.uniform() - 0.5),
            -5.0,
        ];
        let d = [
            0.02 * (stream.uniform() - 0.5),
            0.02 * (stream.uniform() - 0.5),
            1.0,
        ];
        let f = m.transmit(&ray(o, d, 100.0), &draws(&mut stream));
        let g = m.sample(&ray(o, d, 100.0), &draws(&mut stream));
        suite.claim(f.violations + g.violations == 0, || "violated".into());
        suite.claim(f.lookups.max(g.lookups) <= 1000, || {
            format!("{o:?}: {} and {} look-ups", f.lookups, g.lookups)
        });
    }
    suite.assert();
}

#[test]
fn constant_equals_majorant() {
    // The cells between -24 and 24 see nothing but this value.
    let voxels = Voxels::new([-24; 3], [32; 3], |_| 0.37);
    let m = of(&voxels, |s| s.transmittance = Choice::Ratio);
    let mut stream = Stream::new(5);
    for _ in 0..samples(20_000) {
        let d = resolvent_api::math::warp::sphere(stream.uniform2());
        let s = ray([1.0, -2.0, 3.0], d.into(), 18.0);
        let u = draws(&mut stream);
        let (f, g) = (m.sample(&s, &u), m.transmit(&s, &u));
        assert_eq!((f.nulls, f.lookups, g.nulls, g.lookups), (0, 0, 0, 0));
        assert!((g.value[0] / g.ratio[0] - (-0.37f32 * 18.0).exp()).abs() < 1e-8);
    }
}

#[test]
fn half_precision_range() {
    let tiny = half::f16::from_f32(6e-8).to_f32();
    let mut voxels = Voxels::new(
        [0; 3],
        [16, 16, 16],
        |[x, ..]| if x < 8 { 65504.0 } else { 6e-8 },
    );
    voxels.half = true;
    let mut suite = Suite::new();
    for trilinear in [true, false] {
        let m = of(&voxels, |s| {
            s.transmittance = Choice::Ratio;
            s.trilinear = trilinear;
        });
        let thin = ray([10.0, 2.0, 7.0], [0.0, 1.0, 0.0], 1.0);
        suite.close(
            "thin",
            transmittance(&*m, &thin, 10).0.mean(),
            (-f64::from(tiny)).exp(),
            2e-6,
            0.0,
        );
        let c = m.coefficients([10.0, 2.0, 7.0].into());
        suite.close("tiny", f64::from(c.sigma_t[0]), f64::from(tiny), 1e-6, 0.0);
        suite.claim(
            m.coefficients([2.0, 2.0, 7.0].into()).sigma_t[0] == 65504.0,
            || "largest half".into(),
        );
        let thick = ray([2.0, 2.0, 7.0], [0.0, 1.0, 0.0], 1e-5);
        suite.close(
            "thick",
            transmittance(&*m, &thick, 10).0.mean(),
            (-0.65504f64).exp(),
            2e-6,
            0.0,
        );
    }
    // Scaling happens in full precision.
    let m = of(&voxels, |s| s.density.scale = 1e-3);
    suite.close(
        "scaled",
        f64::from(m.coefficients([2.0, 2.0, 7.0].into()).sigma_t[1]),
        65.504,
        1e-6,
        0.0,
    );
    suite.assert();
}

#[test]
fn sheared_grid_and_transforms() {
    let mut voxels = Voxels::new([0; 3], [8; 3], |_| 0.5);
    // Row vectors: index axes go to these world vectors. Shear, mirror, scales 1 : 1000.
    voxels.matrix = [
        [1.0, 0.5, 0.0, 0.0],
        [0.0, -2.0, 0.3, 0.0],
        [10.0, 0.0, 1000.0, 0.0],
        [5.0, -7.0, 11.0, 1.0],
    ];
    let m = of(&voxels, |s| {
        s.trilinear = false;
        s.transmittance = Choice::Ratio;
    });
    // Along the index axes through the middle: eight voxels each.
    let middle = [5.0 + 3.5 + 35.0, -7.0 + 1.75 - 7.0, 11.0 + 1.05 + 3500.0f32];
    for axis in [[1.0f32, 0.5, 0.0], [0.0, -2.0, 0.3], [10.0, 0.0, 1000.0]] {
        let length = axis.iter().map(|c| c * c).sum::<f32>().sqrt();
        let o = [0, 1, 2].map(|i| middle[i] - 6.0 * axis[i]);
        let s = ray(o, axis, 100.0 * length);
        let sigma = 0.5 / length;
        let m = of(&voxels, |s| {
            s.sigma_t = Spectrum::splat(1.0 / length);
            s.trilinear = false;
            s.transmittance = Choice::Ratio;
        });
        let (moments, _) = transmittance(&*m, &s, 3);
        let expected = (-8.0 * f64::from(sigma) * f64::from(length)).exp();
        assert!(
            (moments.mean() / expected - 1.0).abs() < 2e-5,
            "{axis:?}: {} {expected}",
            moments.mean()
        );
    }
    assert_eq!(m.info().voxels, 512);
}

#[test]
fn bad_voxels() {
    for (bad, word) in [
        (f32::NAN, "no numbers"),
        (-1.0, "negative"),
        (-1e-9, "negative"),
        (1e38, "above"),
    ] {
        let voxels = Voxels::new([0; 3], [12; 3], |v| if v == [9, 2, 3] { bad } else { 0.25 });
        let (m, warnings) = made(&voxels, |_| {}).unwrap();
        assert_eq!(warnings.len(), 1, "{bad}: {warnings:?}");
        let text = &warnings[0];
        assert!(
            text.contains(word)
                && text.contains("density")
                && text.contains("[9, 2, 3]")
                && text.contains("1 voxel"),
            "{text}"
        );
        let c = m.coefficients([9.0, 2.0, 3.0].into()).sigma_t[0];
        assert_eq!(c, if bad > 0.0 { 1e6 } else { 0.0 });
        let mut stream = Stream::new(9);
        for _ in 0..500 {
            let s = ray([-3.0, 2.0, 3.0], [1.0, 0.1 * stream.uniform(), 0.0], 30.0);
            let f = m.sample(&s, &draws(&mut stream));
            assert!(
                f.value.is_finite() && f.t.is_finite() && f.violations == 0 && f.lookups < 10_000
            );
        }
    }
    for bad in [f32::INFINITY, f32::NEG_INFINITY] {
        let voxels = Voxels::new([0; 3], [12; 3], |v| if v == [9, 2, 3] { bad } else { 0.25 });
        let error = made(&voxels, |_| {}).err().unwrap();
        assert!(
            error.contains("infinite") && error.contains("[9, 2, 3]") && error.contains("density"),
            "{error}"
        );
    }
    let subnormal = Voxels::new([0; 3], [2; 3], |_| 1e-40);
    assert_eq!(
        of(&subnormal, |_| {}).coefficients([0.5; 3].into()).sigma_t[0],
        1e-40
    );
}

#[test]
fn zero_density_is_empty() {
    use resolvent_api::medium::medium_traits::EMPTY;
    let zeros = Voxels::new([0; 3], [12; 3], |_| 0.0);
    assert!(of(&zeros, |_| {}).info().traits & EMPTY != 0);
    let some = Voxels::new([0; 3], [12; 3], |_| 1.0);
    assert!(of(&some, |s| s.density.scale = 0.0).info().traits & EMPTY != 0);
    assert!(of(&some, |s| s.sigma_t = Spectrum::ZERO).info().traits & EMPTY != 0);
    assert!(of(&some, |_| {}).info().traits & EMPTY == 0);
    let none = Voxels::new([0; 3], [0; 3], |_| 0.0);
    assert!(of(&none, |_| {}).info().traits & EMPTY != 0);
}
