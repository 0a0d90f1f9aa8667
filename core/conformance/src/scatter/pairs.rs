//! What must hold for every pair of directions.

use super::{directions, draws};
use crate::{Suite, property};
use resolvent_api::rng::Stream;
use resolvent_api::{Mode, Scatter, Vec3};

/// How the values of the two senses of a pair of directions hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// f(wo, wi) = η² f(wi, wo), with the index of the side of `wi` over that of `wo` (see [`Mode`]).
    Reciprocal,
    /// The same, with the other mode on the right (`bsdf_traits::OWN_NORMALS`).
    Adjoint,
    /// Not at all (`bsdf_traits::NON_RECIPROCAL`).
    None,
}

/// That [`Symmetry`], and that the reverse density is the forward density of the swapped pair.
/// Closures that have none, and say so, still answer for their densities.
pub fn symmetry(suite: &mut Suite, name: &str, k: &impl Scatter, wo: Vec3, symmetry: Symmetry) {
    let back = match symmetry {
        Symmetry::Adjoint => Mode::Importance,
        Symmetry::Reciprocal | Symmetry::None => Mode::Radiance,
    };
    for wi in directions(500, 0xd12) {
        let (a, b) = (k.eval(wo, wi, Mode::Radiance), k.eval(wi, wo, back));
        let eta2 = match (wo.z > 0.0, wi.z > 0.0) {
            (true, false) => k.eta().powi(2),
            (false, true) => k.eta().powi(-2),
            _ => 1.0,
        };
        let swapped = b.f * eta2;
        for (property, x, y, what) in [
            (property::RECIPROCITY, a.f[0], swapped[0], "f, lane 0"),
            (property::RECIPROCITY, a.f[1], swapped[1], "f, lane 1"),
            (property::RECIPROCITY, a.f[2], swapped[2], "f, lane 2"),
            (
                property::ADJOINT,
                a.forward,
                b.reverse,
                "forward and reverse density",
            ),
            (
                property::ADJOINT,
                a.reverse,
                b.forward,
                "reverse and forward density",
            ),
        ] {
            suite.claim_about(property::EDGES, x.is_finite() && x >= 0.0, || {
                format!("{name}: {what} is {x} at wi = {wi}")
            });
            if property == property::RECIPROCITY && symmetry == Symmetry::None {
                continue;
            }
            let agree = (x - y).abs() <= 1e-4 * x.abs().max(y.abs()) + 1e-12;
            suite.claim_about(property, agree, || {
                format!("{name}: {what} is {x} for wi = {wi}, swapped {y}")
            });
        }
    }
}

/// Both modes agree: what differs between them is the core's to apply.
pub fn modes(suite: &mut Suite, name: &str, k: &impl Scatter, wo: Vec3) {
    suite.about(property::ADJOINT);
    for wi in directions(100, 0x30de) {
        let (a, b) = (
            k.eval(wo, wi, Mode::Radiance),
            k.eval(wo, wi, Mode::Importance),
        );
        suite.claim(a == b, || format!("{name}: modes differ at wi = {wi}"));
    }
    let mut stream = Stream::new(0x5a3d);
    for _ in 0..100 {
        let u = draws(&mut stream);
        let (a, b) = (
            k.sample(wo, u, Mode::Radiance),
            k.sample(wo, u, Mode::Importance),
        );
        suite.claim(a == b, || {
            format!("{name}: samples differ between modes, {a:?} {b:?}")
        });
    }
}
