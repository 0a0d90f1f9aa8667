//! Checks that every medium must pass.
//!
//! [`check`] runs all of them for some segments. The truth is quadrature of [`Medium::coefficients`] along the segment
//! ([`March`]), so a medium is compared with its own statement of what it is; that the statement is right is for the
//! plugin's own tests to say. Every estimate is weighed as an integrator does it: the hero lane is chosen uniformly, a path that
//! reached this point with density `prior` per lane goes on, and lane λ of a contribution is divided by the mean over lanes
//! of `prior · density` (single-sample balance heuristic; Veach 1997, §9.2.2, over lanes as in Wilkie et al. 2014).

mod edges;
mod emission;
mod flights;
mod majorant;
mod march;
mod replay;
mod reversal;
#[cfg(test)]
mod tests;

pub use edges::edges;
pub use emission::emission;
pub use flights::{collisions, transmittance};
pub use majorant::majorant;
pub use march::{March, Node};
pub use replay::replay;
pub use reversal::reversal;

use crate::{Suite, property};
use resolvent_api::rng::{Stream, derive};
use resolvent_api::{Flight, FlightDraws, Medium, Segment, Spectrum, Vec3};

/// Lanes in use in all checks.
pub const LANES: u32 = 3;

/// All checks on all segments, which must be finite; `floor` is the relative accuracy that quadrature with a few thousand panels
/// reaches on this medium (10⁻⁵ for smooth coefficients).
pub fn check(
    suite: &mut Suite,
    name: &str,
    medium: &impl Medium,
    segments: &[Segment],
    floor: f64,
) {
    edges(suite, name, medium);
    majorant(suite, name, medium);
    for (i, s) in segments.iter().enumerate() {
        along(
            suite,
            &format!("{name}, segment {i}"),
            medium,
            s,
            Some(floor),
        );
    }
}

/// All checks along one finite segment, against quadrature of the relative accuracy `floor`; unless given, that is found by
/// comparison with half as many panels.
pub fn along(suite: &mut Suite, name: &str, medium: &impl Medium, s: &Segment, floor: Option<f64>) {
    let truth = March::new(medium, s);
    let floor = floor.unwrap_or_else(|| truth.accuracy(medium));
    for prior in [Spectrum::ONE, Spectrum::rgb(0.6, 1.7, 0.3)] {
        transmittance(suite, name, medium, &truth, prior, floor);
        collisions(suite, name, medium, &truth, prior, floor);
        emission(suite, name, medium, &truth, prior, floor);
        reversal(suite, name, medium, &truth, prior, floor);
    }
    replay(suite, name, medium, s);
}

/// A segment from `from` towards `to`, over `length`.
pub fn segment(from: Vec3, to: Vec3, length: f32) -> Segment {
    Segment {
        o: from.into(),
        t0: 0.0,
        d: (to - from).normalize().into(),
        t1: length,
    }
}

/// The `i`-th draws of a sequence.
pub fn draws(sequence: u64, i: usize, prior: Spectrum) -> FlightDraws {
    let key = derive(derive(0x6d65_6469_756d, sequence), i as u64);
    let mut stream = Stream::new(key);
    let [tau, event] = stream.uniform2();
    FlightDraws {
        key: stream.bits(),
        tau,
        event,
        hero: (i % LANES as usize) as u32,
        lanes: LANES,
        flags: 0,
        reserved: 0,
        prior,
    }
}

/// Lane `lane` of a contribution over the lanes' mean density, times the hero's prior, with which it occurs at all.
fn weighed(u: &FlightDraws, contribution: f32, density: Spectrum) -> f64 {
    let mean = f64::from((density * u.prior).mean(u.lanes));
    f64::from(u.prior[u.hero as usize]) * f64::from(contribution) / mean
}

/// Files whether a flight is possible, and whether it met an extinction above its majorant.
fn inspect(suite: &mut Suite, f: &Flight, s: &Segment, name: impl Fn() -> String) {
    let verdict = sane(f, s);
    suite.claim_about(property::EDGES, verdict.is_ok(), || {
        format!("{}: {}", name(), verdict.unwrap_err())
    });
    suite.claim_about(property::MAJORANT, f.violations == 0, || {
        format!(
            "{}: {} times above the majorant on {s:?}",
            name(),
            f.violations
        )
    });
}

/// True if nothing about a flight is impossible.
fn sane(f: &Flight, s: &Segment) -> Result<(), String> {
    let parts = [
        ("value", f.value),
        ("track", f.track),
        ("ratio", f.ratio),
        ("sigma_t", f.sigma_t),
        ("sigma_s", f.sigma_s),
    ];
    for (what, v) in parts {
        if !v.is_finite() || v.0.iter().any(|&x| x < 0.0) {
            return Err(format!("{what} is {v:?}"));
        }
    }
    if f.emitted.0.iter().any(|&x| !(x >= 0.0)) {
        return Err(format!("emitted is {:?}", f.emitted));
    }
    match f.event {
        0 if f.t == s.t1 => Ok(()),
        1 if f.t >= s.t0 && f.t < s.t1 && f.sigma_t.max_lane() > 0.0 => {
            let above = (0..4).any(|i| f.sigma_s[i] > f.sigma_t[i] * 1.000_01);
            if above {
                Err(format!(
                    "sigma_s {:?} above sigma_t {:?}",
                    f.sigma_s, f.sigma_t
                ))
            } else {
                Ok(())
            }
        }
        e => Err(format!("event {e} at t = {} of {s:?}", f.t)),
    }
}
