//! What must hold for every pair of directions.

use super::directions;
use crate::Suite;
use resolvent_api::{Mode, Scatter, Vec3};

/// Helmholtz reciprocity, and that the reverse density is the forward density of the swapped pair.
pub fn symmetry(suite: &mut Suite, name: &str, k: &impl Scatter, wo: Vec3) {
    for wi in directions(500, 0xd12) {
        let (a, b) = (
            k.eval(wo, wi, Mode::Radiance),
            k.eval(wi, wo, Mode::Radiance),
        );
        for (x, y, what) in [
            (a.f[0], b.f[0], "f, lane 0"),
            (a.f[1], b.f[1], "f, lane 1"),
            (a.f[2], b.f[2], "f, lane 2"),
            (a.forward, b.reverse, "forward and reverse density"),
            (a.reverse, b.forward, "reverse and forward density"),
        ] {
            suite.claim(x.is_finite() && x >= 0.0, || {
                format!("{name}: {what} is {x} at wi = {wi}")
            });
            suite.claim((x - y).abs() <= 1e-4 * x.abs().max(y.abs()), || {
                format!("{name}: {what} is {x} for wi = {wi}, swapped {y}")
            });
        }
    }
}

/// Without refraction and shading normals both modes agree.
pub fn modes(suite: &mut Suite, name: &str, k: &impl Scatter, wo: Vec3) {
    for wi in directions(100, 0x30de) {
        let (a, b) = (
            k.eval(wo, wi, Mode::Radiance),
            k.eval(wo, wi, Mode::Importance),
        );
        suite.claim(a == b, || format!("{name}: modes differ at wi = {wi}"));
    }
}
