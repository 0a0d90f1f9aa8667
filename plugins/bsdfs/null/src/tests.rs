//! Tests of the plugin.

use super::*;
use resolvent_tests::host::create;
use resolvent_tests::scatter::directions;

#[test]
fn light_passes_unchanged() {
    let k: Null = create("{}").unwrap();
    assert_eq!(k.traits() & bsdf_traits::NULL, bsdf_traits::NULL);
    let closure = k.closure(&SurfacePoint::default());
    assert_eq!(closure.lobes(), lobes::PASSES);
    for wo in directions(50, 1) {
        for mode in [Mode::Radiance, Mode::Importance] {
            let s = closure.sample(wo, ScatterDraws::default(), mode).unwrap();
            assert_eq!(Vec3::from(s.wi), -wo);
            assert_eq!((s.weight, s.eta), (Spectrum::ONE, 1.0));
            assert_eq!((s.forward, s.reverse), (1.0, 1.0));
            assert_eq!(s.measure, Measure::Discrete as u32);
            // A delta lobe has no value between given directions, not even the one it would sample.
            assert_eq!(closure.eval(wo, -wo, mode), ScatterEval::default());
        }
    }
}
