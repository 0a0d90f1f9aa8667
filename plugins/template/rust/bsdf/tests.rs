//! A test of the plugin; `resolvent plugin check` has more.

use super::*;
use resolvent_api::rng::Stream;

/// Samples say what `eval` says of them.
#[test]
fn samples_agree_with_eval() {
    let k = Reflector {
        albedo: Spectrum::rgb(0.9, 0.5, 0.1),
    };
    let mut stream = Stream::new(1);
    for wo in [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, -0.6)] {
        for _ in 0..1000 {
            let u = ScatterDraws {
                lobe: stream.uniform(),
                dir: stream.uniform2(),
            };
            let s = k.sample(wo, u, Mode::Radiance).unwrap();
            let wi = Vec3::from(s.wi);
            let e = k.eval(wo, wi, Mode::Radiance);
            assert!((s.forward - e.forward).abs() < 1e-6 && s.reverse == e.reverse);
            for (weight, f) in s.weight.0.iter().zip(e.f.0) {
                assert!((weight * s.forward - f * wi.z.abs()).abs() < 1e-6);
            }
        }
    }
}
