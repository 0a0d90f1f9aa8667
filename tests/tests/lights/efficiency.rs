//! What choosing costs and gains: error at equal time among uniform choice, choice by power, and the tree.

use crate::build::{by_power, mixed, with_tree};
use glam::Vec3;
use resolvent_api::Spectrum;
use resolvent_api::rng::Stream;
use resolvent_engine::geometry::Quad;
use resolvent_engine::light::{Area, Light, Lights, Reference};
use resolvent_tests::Moments;
use std::time::Instant;

/// A hall: `n` lamps under the ceiling, one-sided squares and points of strengths over a decade.
fn hall(n: usize) -> Vec<Light> {
    let mut s = Stream::new(31);
    let side = (n as f32).sqrt().ceil();
    (0..n)
        .map(|i| {
            let at = Vec3::new(i as f32 % side, (i as f32 / side).floor(), 0.0) * (10.0 / side);
            let p = at - Vec3::new(5.0, 5.0, -1.5) + Vec3::Z * s.uniform();
            let strength = Spectrum::splat(10f32.powf(s.uniform()));
            if i % 2 == 0 {
                Light::Point {
                    position: p,
                    intensity: strength * 0.01,
                }
            } else {
                let quad = Quad {
                    corner: p,
                    edge_u: Vec3::Y * 0.1,
                    edge_v: Vec3::X * 0.1,
                };
                Light::Area(Area::quad(i as u32, quad, strength, false))
            }
        })
        .collect()
}

fn references(seed: u64, in_medium: bool) -> Vec<Reference> {
    let mut s = Stream::new(seed);
    (0..200)
        .map(|_| Reference {
            p: Vec3::new(
                10.0 * s.uniform() - 5.0,
                10.0 * s.uniform() - 5.0,
                if in_medium { 2.5 * s.uniform() } else { 0.0 },
            ),
            normal: (!in_medium).then_some(Vec3::Z),
            in_medium,
        })
        .collect()
}

enum How<'a> {
    Uniform(&'a [Light]),
    Chosen(&'a Lights),
}

/// Relative variance of the light received and seconds a connection, medians over the places, with visibility rays of `ray`
/// seconds.
fn measure(how: &How<'_>, places: &[Reference], ray: f64) -> (f64, f64) {
    let mut s = Stream::new(7);
    let per_place = 1000;
    let (mut relative, mut seconds) = (Vec::new(), Vec::new());
    for at in places {
        let start = Instant::now();
        let mut m = Moments::default();
        for _ in 0..per_place {
            let (choice, u) = (s.uniform(), s.uniform2());
            let value = match how {
                How::Uniform(all) => {
                    let i = (choice * all.len() as f32) as usize;
                    all[i].sample(at.p, u).map_or(0.0, |p| {
                        f64::from(p.radiance[0] * cosine(at, p.wi) / p.density) * all.len() as f64
                    })
                }
                How::Chosen(lights) => lights.sample(at, choice, u).map_or(0.0, |p| {
                    f64::from(p.radiance[0] * cosine(at, p.wi) / p.density)
                }),
            };
            m.add(value);
        }
        seconds.push(start.elapsed().as_secs_f64() / f64::from(per_place));
        if m.mean() > 0.0 {
            relative.push(m.variance() / (m.mean() * m.mean()));
        }
    }
    (median(relative), median(seconds) + ray)
}

/// Robust against places that touch a light, and against a busy machine.
fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

fn cosine(at: &Reference, wi: [f32; 3]) -> f32 {
    at.normal.map_or(1.0, |n| n.dot(Vec3::from(wi)).max(0.0))
}

/// At equal time, with a visibility ray of half a microsecond, the tree has a fraction of the variance of power and uniform
/// choice on a thousand lights, on surfaces and in media; the means agree.
#[test]
fn a_thousand_lights() {
    for (name, all) in [
        ("hall", hall as fn(usize) -> Vec<Light>),
        ("mixed", |n| mixed(n, 77)),
    ] {
        for in_medium in [false, true] {
            let places = references(3, in_medium);
            let (tree, power) = (with_tree(all(1000)), by_power(all(1000)));
            let uniform = all(1000);
            let ray = 0.5e-6;
            let cost = |how: &How<'_>| {
                let (variance, seconds) = measure(how, &places, ray);
                (variance, seconds, variance * seconds)
            };
            let u = cost(&How::Uniform(&uniform));
            let p = cost(&How::Chosen(&power));
            let t = cost(&How::Chosen(&tree));
            println!(
                "{name}, {}: relative variance uniform {:.1}, power {:.1}, tree {:.2}; ns {:.0}, {:.0}, {:.0}; equal-time error of uniform {:.1}, of power {:.1} times the tree's",
                if in_medium { "media" } else { "surfaces" },
                u.0,
                p.0,
                t.0,
                u.1 * 1e9,
                p.1 * 1e9,
                t.1 * 1e9,
                (u.2 / t.2).sqrt(),
                (p.2 / t.2).sqrt()
            );
            // Variances alone: seconds depend on the machine's load. Where half of the light comes from spots that look anywhere,
            // groups know no direction any more, and the tree gains little over power.
            let least = if name == "hall" { 4.0 } else { 0.8 };
            assert!(t.0 < p.0 / least && t.0 < u.0 / 2.0, "{name} {in_medium}");
        }
    }
}

/// From which number of lights on a tree pays; informs `TREE_FROM`.
#[test]
fn where_a_tree_pays() {
    for in_medium in [false, true] {
        let places = references(3, in_medium);
        for n in [2, 4, 8, 16, 64, 256] {
            let (tree, power) = (with_tree(hall(n)), by_power(hall(n)));
            let (vt, st) = measure(&How::Chosen(&tree), &places, 0.5e-6);
            let (vp, sp) = measure(&How::Chosen(&power), &places, 0.5e-6);
            println!(
                "{n} lights, {}: variance power {vp:.2} tree {vt:.2}, ns {:.0} {:.0}, gain {:.2}",
                if in_medium { "media" } else { "surfaces" },
                sp * 1e9,
                st * 1e9,
                vp * sp / (vt * st)
            );
            assert!(vt < 1.5 * vp, "{n}");
        }
    }
}

/// The mean does not depend on how lights are chosen: lights behind the surface, at the vertex, and touching it.
#[test]
fn means_agree() {
    let mut s = Stream::new(33);
    let (tree, power) = (with_tree(mixed(60, 8)), by_power(mixed(60, 8)));
    let exact = mixed(60, 8);
    let mut z = Vec::new();
    for (k, at) in references(9, false)
        .into_iter()
        .take(20)
        .chain(references(10, true).into_iter().take(20))
        .enumerate()
    {
        // All lights, each alone: what the sum must be.
        let n = 4000;
        let mut sum = (0.0, 0.0);
        for light in &exact {
            let m = Moments::of((0..n).map(|_| {
                light.sample(at.p, s.uniform2()).map_or(0.0, |p| {
                    f64::from(p.radiance[0] * cosine(&at, p.wi))
                        / if p.flags & 2 != 0 {
                            1.0
                        } else {
                            f64::from(p.density)
                        }
                })
            }));
            sum.0 += m.mean();
            sum.1 += m.standard_error().powi(2);
        }
        for lights in [&tree, &power] {
            let m = Moments::of((0..100_000).map(|_| {
                lights
                    .sample(&at, s.uniform(), s.uniform2())
                    .map_or(0.0, |p| {
                        f64::from(p.radiance[0] * cosine(&at, p.wi) / p.density)
                    })
            }));
            let error = m.standard_error().hypot(sum.1.sqrt());
            z.push((
                k,
                resolvent_tests::ztest::z_test(m.mean(), error, sum.0, 1e-6),
            ));
        }
    }
    let level = resolvent_tests::ztest::sidak(1e-3, z.len());
    for (k, test) in &z {
        assert!(test.p > level, "place {k}: {test:?}");
    }
}
