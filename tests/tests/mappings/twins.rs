//! `f64` twins: the textbook formulas, in double precision, beside kernels in single precision that had to be arranged with care.

use crate::cases;
use proptest::prelude::*;
use resolvent_api::math::{Vec3, hg::Lobe};

/// Numbers over many decades.
fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low..high).prop_map(|log| 10f64.powf(log))
}

proptest! {
    #![proptest_config(cases(20_000))]

    /// The density near its peak and far from it.
    #[test]
    fn henyey_greenstein_density(one_minus_g in decades(-6.9, 0.0), back in any::<bool>(), angle in decades(-6.0, 0.49)) {
        let g = (1.0 - one_minus_g) * if back { -1.0 } else { 1.0 };
        let lobe = Lobe::new(g).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let one_minus_cos = 2.0 * (0.5 * angle).sin().powi(2);
        let one_plus_cos = 2.0 - one_minus_cos;
        let (a, b) = (one_minus_cos as f32, one_plus_cos as f32);
        // The twin sees the same rounded numbers; of the two, the smaller has all its digits.
        let (a64, b64) = if a < b { (f64::from(a), 2.0 - f64::from(a)) } else { (2.0 - f64::from(b), f64::from(b)) };
        let h = if g >= 0.0 { (1.0 - g).powi(2) + 2.0 * g * a64 } else { (1.0 + g).powi(2) - 2.0 * g * b64 };
        let exact = (1.0 - g) * (1.0 + g) / (4.0 * std::f64::consts::PI * h * h.sqrt());
        let got = f64::from(lobe.density(a, b));
        prop_assert!((got / exact - 1.0).abs() < 2e-6, "g = {g}, angle {angle}: {got:e} and {exact:e}");
    }

    /// Offsets leave the surface on the side they are sent to, and not farther than the error allows.
    #[test]
    fn offsets(log in -4f64..6.0, error in decades(-7.0, -6.0), d in [-1f32..1.0, -1f32..1.0, -1f32..1.0], n in [-1f32..1.0, -1f32..1.0, -1f32..1.0]) {
        let (w, n) = (Vec3::from(d), Vec3::from(n));
        prop_assume!(w.length() > 0.1 && n.length() > 0.1);
        let (w, n) = (w.normalize(), n.normalize());
        prop_assume!(w.dot(n).abs() > 1e-4);
        let size = 10f64.powf(log) as f32;
        let p = Vec3::new(size, -0.7 * size, 0.3 * size);
        let e = Vec3::splat(size * error as f32);
        let q = resolvent_engine::geometry::offset_origin(p, e, n, w);
        let side = if w.dot(n) > 0.0 { 1.0 } else { -1.0 };
        let (p, q, n, e) = (p.as_dvec3(), q.as_dvec3(), n.as_dvec3(), e.as_dvec3());
        let moved = (q - p).dot(n) * side;
        let needed = n.abs().dot(e);
        prop_assert!(moved >= needed, "moved {moved:e} of {needed:e}");
        let ulp = f64::from(f32::EPSILON) * f64::from(size);
        prop_assert!(moved <= 4.0 * needed + 8.0 * ulp, "moved {moved:e} of {needed:e}, ulp {ulp:e}");
    }
}
