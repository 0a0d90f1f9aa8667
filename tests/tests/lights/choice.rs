//! The choice among many lights: a distribution that is what it says, and that starves no light.

use crate::build::{by_power, distant, mixed, point_in, with_tree};
use glam::Vec3;
use resolvent_api::math::warp;
use resolvent_api::rng::Stream;
use resolvent_engine::light::{Light, Lights, Reference, TREE_FROM, Tree};
use resolvent_tests::chi2::chi2;
use resolvent_tests::ztest::sidak;

/// On a surface, in a medium, and on neither.
fn references(s: &mut Stream, n: usize) -> Vec<Reference> {
    (0..n)
        .map(|i| Reference {
            p: point_in(s, if i % 5 == 0 { 50.0 } else { 5.0 }),
            normal: (i % 3 == 0).then(|| warp::sphere(s.uniform2())),
            in_medium: i % 3 == 1,
        })
        .collect()
}

/// A point light for every light with a place.
fn shines_everywhere(l: &Light) -> Light {
    Light::Point {
        position: place(l).unwrap_or(Vec3::splat(7.0)),
        intensity: resolvent_api::Spectrum::splat(l.power(1.0, 3)),
    }
}

/// All probabilities add up to 1, wherever one asks; to less where lights turn away.
#[test]
fn probabilities_add_up_to_one() {
    let mut s = Stream::new(11);
    for n in [2, 3, 10, 200, 3000] {
        for infinite in [false, true] {
            let mut all = mixed(n, n as u64);
            if infinite {
                all.extend(distant());
            }
            let count = all.len() as u32;
            let everywhere = with_tree(all.iter().map(shines_everywhere).collect());
            let lights = with_tree(all);
            for at in references(&mut s, 60) {
                let sum = |lights: &Lights| -> f64 {
                    (0..count)
                        .map(|i| f64::from(lights.probability(&at, i)))
                        .sum()
                };
                // A group may reach where none of its lights does: then nothing is chosen.
                let all = sum(&lights);
                assert!(all < 1.0 + 1e-5, "{n} lights: {all}, {at:?}");
                let round = sum(&everywhere);
                assert!((round - 1.0).abs() < 1e-5, "{n} lights: {round}, {at:?}");
            }
        }
    }
}

/// Choices come about as often as their stated probabilities say, sun and sky beside the tree included.
#[test]
fn choices_follow_their_probabilities() {
    let mut s = Stream::new(12);
    let mut all = mixed(150, 3);
    all.extend(distant());
    let count = all.len();
    let lights = with_tree(all);
    let places = references(&mut s, 12);
    let level = sidak(1e-3, places.len());
    let n = 200_000;
    for at in places {
        let mut counts = vec![0u64; count + 1];
        for _ in 0..n {
            match lights.choose(&at, s.uniform(), s.uniform2()) {
                Some((i, probability)) => {
                    counts[i as usize] += 1;
                    let again = lights.probability(&at, i);
                    assert!((again / probability - 1.0).abs() < 1e-6, "{at:?} {i}");
                    assert!(probability > 0.0);
                }
                None => counts[count] += 1,
            }
        }
        let mut expected: Vec<f64> = (0..count as u32)
            .map(|i| f64::from(n) * f64::from(lights.probability(&at, i)))
            .collect();
        expected.push((f64::from(n) - expected.iter().sum::<f64>()).max(0.0));
        let test = chi2(&counts, &expected);
        assert!(test.p > level, "{test:?} {at:?}");
    }
}

/// Every light that can send anything to a point is chosen for it by importance: behind surfaces, at lights and within them.
#[test]
fn no_light_is_starved() {
    let mut s = Stream::new(13);
    let all = mixed(300, 5);
    let anchors: Vec<Vec3> = all.iter().filter_map(place).collect();
    // Without the share of the choices that is uniform.
    let lights = Tree::new(&all, 3).unwrap();
    let mut lit = 0;
    for (k, mut at) in references(&mut s, 400).into_iter().enumerate() {
        // Some at lights themselves.
        if k % 4 == 0 {
            at.p = anchors[k % anchors.len()];
        }
        for (i, light) in (0..).zip(&all) {
            let Some(sample) = light.sample(at.p, s.uniform2()) else {
                continue;
            };
            let cosine = at
                .normal
                .map_or(1.0, |n| n.dot(Vec3::from(sample.wi)).abs());
            if sample.radiance.is_zero() || cosine == 0.0 {
                continue;
            }
            lit += 1;
            assert!(
                lights.descent(&at, i) > 0.0,
                "light {i} shines on {at:?} and is never chosen"
            );
        }
    }
    assert!(lit > 30_000, "{lit}");
}

fn place(l: &Light) -> Option<Vec3> {
    match l {
        Light::Point { position, .. } => Some(*position),
        Light::Spot(s) => Some(s.position),
        Light::Area(a) => a.point([0.3, 0.6]).map(|p| p.p),
        _ => None,
    }
}

/// The density stated with a sample is the density of finding its point.
#[test]
fn densities_agree() {
    let mut s = Stream::new(14);
    let mut all = mixed(70, 6);
    all.extend(distant());
    for lights in [with_tree(all), {
        let mut all = mixed(70, 6);
        all.extend(distant());
        by_power(all)
    }] {
        let mut found = [0; 3];
        for at in references(&mut s, 3000) {
            let Some(sample) = lights.sample(&at, s.uniform(), s.uniform2()) else {
                continue;
            };
            let again = match &lights.all[sample.light as usize] {
                Light::Area(_) => {
                    found[0] += 1;
                    lights.density(&at, sample.light, sample.p.into(), sample.ng.into())
                }
                Light::Constant { .. } | Light::Disc { .. } => {
                    found[1] += 1;
                    lights.environment(at.in_medium, sample.wi.into()).1
                }
                _ => {
                    found[2] += 1;
                    lights.probability(&at, sample.light)
                }
            };
            let ratio = f64::from(again) / f64::from(sample.density);
            // Cosines at the light are differences of coordinates.
            assert!((ratio - 1.0).abs() < 2e-3, "{ratio} light {}", sample.light);
        }
        assert!(found.iter().all(|n| *n > 100), "{found:?}");
    }
}

/// One light, of any kind, is chosen without a tree and with certainty; from the stated number on there is a tree.
#[test]
fn few_lights_have_no_tree() {
    let at = Reference {
        p: Vec3::ZERO,
        normal: None,
        in_medium: true,
    };
    for i in 0..7 {
        let one = mixed(7, 9).swap_remove(i);
        let lights = Lights::new(vec![one], crate::build::BOUNDS, 3);
        assert_eq!(lights.choose(&at, 0.3, [0.5; 2]), Some((0, 1.0)));
    }
    // A tree chooses by where the vertex is, power alone does not.
    let mut s = Stream::new(16);
    let places: Vec<_> = (0..200).map(|_| point_in(&mut s, 5.0)).collect();
    let looks = |lights: &Lights, n: usize| {
        places.iter().any(|&p| {
            let there = Reference { p, ..at };
            (0..n as u32).any(|i| lights.probability(&at, i) != lights.probability(&there, i))
        })
    };
    assert!(looks(&with_tree(mixed(20, 1)), 20) && !looks(&by_power(mixed(500, 1)), 500));
    for (n, tree) in [(TREE_FROM - 1, false), (TREE_FROM, true)] {
        let mut all = mixed(n, 1);
        all.extend(distant());
        assert_eq!(looks(&Lights::new(all, crate::build::BOUNDS, 3), n), tree);
    }
}

/// The same lights give the same tree: chosen alike, bit by bit.
#[test]
fn equal_lights_give_equal_choices() {
    let (a, b) = (with_tree(mixed(500, 4)), with_tree(mixed(500, 4)));
    let mut s = Stream::new(15);
    for at in references(&mut s, 2000) {
        let (choice, u) = (s.uniform(), s.uniform2());
        assert_eq!(a.choose(&at, choice, u), b.choose(&at, choice, u));
    }
}

/// Lights in one place, in a line, of one kind: degenerate trees work and stay shallow.
#[test]
fn degenerate_sets() {
    let point = |position: Vec3, intensity: f32| Light::Point {
        position,
        intensity: resolvent_api::Spectrum::splat(intensity),
    };
    let sets: [Vec<Light>; 4] = [
        (0..1000).map(|_| point(Vec3::ONE, 1.0)).collect(),
        (0..1000).map(|i| point(Vec3::X * i as f32, 1.0)).collect(),
        (0..120)
            .map(|i| point(Vec3::X * 2f32.powi(-i), 2f32.powi(-i)))
            .collect(),
        (0..200)
            .map(|i| point(Vec3::Y * i as f32, 10f32.powi(i % 60 - 30)))
            .collect(),
    ];
    for set in sets {
        let n = set.len() as u32;
        let tree = Tree::new(&set, 3).unwrap();
        assert!(tree.depth() <= 64, "{}", tree.depth());
        for p in [Vec3::ONE, Vec3::X, Vec3::splat(1e15), Vec3::ZERO] {
            let at = Reference {
                p,
                normal: Some(Vec3::Z),
                in_medium: false,
            };
            let sum: f64 = (0..n).map(|i| f64::from(tree.probability(&at, i))).sum();
            assert!((sum - 1.0).abs() < 1e-3, "{sum} at {p}");
        }
    }
}
