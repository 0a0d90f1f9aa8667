//! Samples of a closure against its density.

use super::{Density, draws};
use crate::chi2::chi2;
use crate::property;
use crate::{Moments, Suite};
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::rng::Stream;
use resolvent_api::{Scatter, Vec3};

/// χ² of sampled directions over the grid, one more bin counting what was absorbed or scattered by a delta lobe.
pub fn histogram(suite: &mut Suite, name: &str, k: &impl Scatter, density: &Density) {
    let n = suite.samples(1_000_000);
    let mut stream = Stream::new(0x5ca7);
    let mut observed = vec![0u64; density.bins.len() + 1];
    for _ in 0..n {
        let bin = match k.sample(density.wo, draws(&mut stream), density.mode) {
            Some(s) if s.measure != Measure::Discrete as u32 => density.bin(Vec3::from(s.wi)),
            _ => density.bins.len(),
        };
        observed[bin] += 1;
    }
    let mut expected: Vec<f64> = density.bins.iter().map(|m| m * n as f64).collect();
    expected.push((1.0 - density.total).max(0.0) * n as f64);
    let t = chi2(&observed, &expected);
    suite.p_value(
        format!(
            "{name}: sampled directions, chi2 = {:.1} at {} degrees of freedom",
            t.statistic, t.freedom
        ),
        t.p,
    );
}

/// Every sample's weight and densities against `eval`; the mean weight and cosine against quadrature. `gain` is what the albedo
/// may exceed 1 by.
pub fn weights(suite: &mut Suite, name: &str, k: &impl Scatter, density: &Density, gain: f64) {
    suite.about(property::WEIGHTS);
    let mut stream = Stream::new(0x3e19);
    let (mut smooth, mut all) = ([Moments::default(); 4], [Moments::default(); 4]);
    let mut cosine = Moments::default();
    let wo = density.wo;
    let has_delta = k.lobes() & (lobes::DELTA | lobes::PASSES) != 0;
    for _ in 0..suite.samples(200_000) {
        let sample = k.sample(wo, draws(&mut stream), density.mode);
        let weight = sample.map_or([0.0; 4], |s| s.weight.0);
        let is_delta = sample.is_some_and(|s| s.measure == Measure::Discrete as u32);
        for ((s, a), w) in smooth.iter_mut().zip(&mut all).zip(weight) {
            s.add(if is_delta { 0.0 } else { w.into() });
            a.add(w.into());
        }
        let Some(s) = sample else {
            cosine.add(0.0);
            continue;
        };
        let wi = Vec3::from(s.wi);
        suite.claim((wi.length_squared() - 1.0).abs() < 1e-5, || {
            format!("{name}: sampled {wi} of length {}", wi.length())
        });
        if is_delta {
            cosine.add(0.0);
            suite.claim(has_delta, || {
                format!("{name}: a delta sample of a smooth closure")
            });
            let share = |p: f32| p > 0.0 && p <= 1.0;
            suite.claim(share(s.forward) && share(s.reverse), || {
                format!(
                    "{name}: probabilities {} and {} of the delta sample {wi}",
                    s.forward, s.reverse
                )
            });
            continue;
        }
        cosine.add(f64::from(s.weight[0]) * density.cosine(wi));
        let e = k.eval(wo, wi, density.mode);
        suite.claim(s.measure == Measure::SolidAngle as u32, || {
            format!("{name}: a sample of measure {}", s.measure)
        });
        // A direction in f32 is off by 10⁻⁷, over which a narrow peak's density changes: allow for it.
        let slack = 1e-4 + 1e-6 * e.forward.sqrt();
        for (what, a, b) in [
            ("forward", s.forward, e.forward),
            ("reverse", s.reverse, e.reverse),
        ] {
            suite.claim((a - b).abs() <= slack * b, || {
                format!("{name}: sample {what} {a}, eval {b} at wi = {wi}")
            });
        }
        let cos = density.measured.cosine(wi) as f32;
        for (w, f) in s.weight.0.iter().zip(e.f.0) {
            suite.claim(
                (w * e.forward - f * cos).abs() <= 2.0 * slack * f * cos,
                || {
                    format!(
                        "{name}: weight {w} of {wi}, but f cos / density = {}",
                        f * cos / e.forward
                    )
                },
            );
        }
    }
    for (i, m) in smooth.iter().enumerate() {
        suite.mean(
            format!("{name}: albedo, lane {i}"),
            m,
            density.albedo[i],
            1e-4,
        );
    }
    let expected = density.mean_cosine * density.albedo[0];
    suite.mean(format!("{name}: mean cosine"), &cosine, expected, 1e-4);
    suite.about(property::ENERGY);
    for (i, (smooth, all)) in smooth.iter().zip(&all).enumerate() {
        // Quadrature of what is smooth, and the delta lobes by sampling, with the room that needs.
        let delta = all.mean() - smooth.mean();
        let noise = if delta > 0.0 {
            5.0 * all.standard_error()
        } else {
            0.0
        };
        let albedo = density.albedo[i] + delta;
        suite.at_most(albedo, 1.0 + gain + noise, || {
            format!("{name}: makes energy, albedo {albedo:.5} in lane {i}")
        });
    }
}
