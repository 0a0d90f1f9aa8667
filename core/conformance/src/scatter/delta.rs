//! Delta lobes, which no density over the sphere shows.

use super::draws;
use crate::{Moments, Suite, property};
use resolvent_api::operator::Measure;
use resolvent_api::rng::Stream;
use resolvent_api::{Mode, Scatter, ScatterSample, Vec3};

/// Directions closer than this (squared distance) are the same.
const SAME: f32 = 1e-6;

/// The discrete directions found from `wo` are chosen as often as they say, and lead back to `wo` as often as they say; light
/// that goes there and back along them has η² in both weights (Veach 1997, eq. 5.14).
pub fn pairs(suite: &mut Suite, name: &str, k: &impl Scatter, wo: Vec3) {
    let n = suite.samples(20_000);
    let found = of(k, wo, n);
    for (s, there) in &found {
        let wi = Vec3::from(s.wi);
        suite.about(property::SAMPLING);
        suite.mean(
            format!("{name}: chance of the delta direction {wi}"),
            there,
            s.forward.into(),
            1e-4,
        );
        suite.about(property::ADJOINT);
        let back = of(k, wi, n);
        let back = back
            .iter()
            .find(|(b, _)| Vec3::from(b.wi).distance_squared(wo) < SAME);
        let Some((b, chance)) = back else {
            suite.claim(s.reverse < 1e-3, || {
                format!(
                    "{name}: the delta direction {wi} never leads back, but says {}",
                    s.reverse
                )
            });
            continue;
        };
        suite.mean(
            format!("{name}: chance of the way back from {wi}"),
            chance,
            s.reverse.into(),
            1e-4,
        );
        suite.close(
            &format!("{name}: index across the way back from {wi}"),
            (s.eta * b.eta).into(),
            1.0,
            1e-4,
            0.0,
        );
    }
}

/// The delta directions that `n` samples find from `wo` (no more than four), and how often each was chosen.
fn of(k: &impl Scatter, wo: Vec3, n: usize) -> Vec<(ScatterSample, Moments)> {
    let mut stream = Stream::new(0xde17a);
    let mut found: Vec<(ScatterSample, usize)> = Vec::new();
    for _ in 0..n {
        let Some(s) = k.sample(wo, draws(&mut stream), Mode::Radiance) else {
            continue;
        };
        if s.measure != Measure::Discrete as u32 {
            continue;
        }
        let near =
            |f: &(ScatterSample, usize)| Vec3::from(f.0.wi).distance_squared(s.wi.into()) < SAME;
        match found.iter().position(near) {
            Some(i) => found[i].1 += 1,
            None if found.len() < 4 => found.push((s, 1)),
            None => {}
        }
    }
    let chance = |count: usize| Moments::of((0..n).map(|i| f64::from(u8::from(i < count))));
    found.into_iter().map(|(s, c)| (s, chance(c))).collect()
}
