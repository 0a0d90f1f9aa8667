//! A test of the plugin; `resolvent plugin check` has more.

use super::*;
use resolvent_api::rng::Stream;

/// The mean cosine of samples is a/3.
#[test]
fn mean_cosine() {
    for a in [-1.0, 0.0, 0.7] {
        let (k, n) = (Linear { a }, 40_000);
        let mut stream = Stream::new(1);
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let mut sum = 0.0;
        for _ in 0..n {
            let u = ScatterDraws {
                lobe: stream.uniform(),
                dir: stream.uniform2(),
            };
            let s = k.sample(wo, u, Mode::Radiance).unwrap();
            sum += f64::from(-wo.dot(s.wi.into()));
        }
        // The cosine's standard deviation is at most 0.58.
        let (mean, error) = (sum / f64::from(n), 0.58 / f64::from(n).sqrt());
        assert!((mean - f64::from(a) / 3.0).abs() < 4.0 * error, "{mean}");
    }
}
