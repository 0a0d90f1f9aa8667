//! Samples of a closure against its density.

use super::{Density, draws};
use crate::chi2::chi2;
use crate::{Moments, Suite, samples};
use resolvent_api::operator::Measure;
use resolvent_api::rng::Stream;
use resolvent_api::{Scatter, Vec3};

/// χ² of sampled directions over the grid, one more bin counting what was absorbed.
pub fn histogram(suite: &mut Suite, name: &str, k: &impl Scatter, density: &Density) {
    let n = samples(1_000_000);
    let mut stream = Stream::new(0x5ca7);
    let mut observed = vec![0u64; density.bins.len() + 1];
    for _ in 0..n {
        let bin = match k.sample(density.wo, draws(&mut stream), density.mode) {
            Some(s) => density.bin(Vec3::from(s.wi)),
            None => density.bins.len(),
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

/// Every sample's weight and densities against `eval`; the mean weight and cosine against quadrature.
pub fn weights(suite: &mut Suite, name: &str, k: &impl Scatter, density: &Density, gain: f64) {
    let mut stream = Stream::new(0x3e19);
    let mut lanes = [Moments::default(); 4];
    let mut cosine = Moments::default();
    let wo = density.wo;
    for _ in 0..samples(200_000) {
        let Some(s) = k.sample(wo, draws(&mut stream), density.mode) else {
            lanes.iter_mut().for_each(|m| m.add(0.0));
            cosine.add(0.0);
            continue;
        };
        let wi = Vec3::from(s.wi);
        for (m, w) in lanes.iter_mut().zip(s.weight.0) {
            m.add(w.into());
        }
        cosine.add(f64::from(s.weight[0]) * density.cosine(wi));
        let e = k.eval(wo, wi, density.mode);
        suite.claim((wi.length_squared() - 1.0).abs() < 1e-5, || {
            format!("{name}: sampled {wi} of length {}", wi.length())
        });
        suite.claim(s.measure == Measure::SolidAngle as u32, || {
            format!("{name}: a delta sample of a smooth closure")
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
    for (i, m) in lanes.iter().enumerate() {
        suite.mean(
            format!("{name}: albedo, lane {i}"),
            m,
            density.albedo[i],
            1e-4,
        );
        suite.claim(density.albedo[i] <= 1.0 + gain, || {
            format!("{name}: makes energy, albedo {}", density.albedo[i])
        });
    }
    let expected = density.mean_cosine * density.albedo[0];
    suite.mean(format!("{name}: mean cosine"), &cosine, expected, 1e-4);
}
