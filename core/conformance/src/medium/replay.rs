//! Flights depend on their draws alone, and a flight cut short is its own beginning.

use super::{draws, sane};
use crate::{Suite, property};
use bytemuck::bytes_of;
use resolvent_api::rng::Stream;
use resolvent_api::{Flight, Medium, Segment, Spectrum};

/// Repeats flights and connections, and repeats flights on a segment cut short at random and right at the collision.
///
/// Overlapping media need the second: once the nearest collision is known, the others' flights are replayed up to there.
pub fn replay(suite: &mut Suite, name: &str, medium: &impl Medium, s: &Segment) {
    suite.about(property::REPLAY);
    let mut stream = Stream::new(0x4e9);
    for i in 0..suite.samples(20_000) {
        let u = draws(5, i, Spectrum::ONE);
        let full = medium.sample(s, &u);
        suite.claim(bytes_of(&full) == bytes_of(&medium.sample(s, &u)), || {
            format!("{name}: flight {i} differs when repeated")
        });
        let (a, b) = (medium.transmit(s, &u), medium.transmit(s, &u));
        suite.claim(bytes_of(&a) == bytes_of(&b), || {
            format!("{name}: connection {i} differs when repeated")
        });
        let end = s.t1.min(full.t.max(s.t0 + 1e-3) * 2.0);
        let anywhere = s.t0 + (end - s.t0) * stream.uniform();
        for cut in [anywhere, full.t, full.t.next_up()] {
            if !(cut > s.t0 && cut <= s.t1) {
                continue;
            }
            let short = Segment { t1: cut, ..*s };
            let part = medium.sample(&short, &u);
            let verdict = sane(&part, &short).and_then(|()| agrees(&full, &part, cut));
            suite.claim_about(property::PREFIX, verdict.is_ok(), || {
                format!("{name}: flight {i} cut at {cut}: {}", verdict.unwrap_err())
            });
        }
    }
}

/// The same collision if it came before the cut, survival otherwise.
fn agrees(full: &Flight, part: &Flight, cut: f32) -> Result<(), String> {
    if !(full.collided() && full.t < cut) {
        return if part.collided() {
            Err(format!("collides at {}, whole at {}", part.t, full.t))
        } else {
            Ok(())
        };
    }
    let same = part.collided()
        && part.t == full.t
        && part.sigma_t == full.sigma_t
        && part.sigma_s == full.sigma_s
        && part.phase == full.phase;
    if !same {
        return Err(format!("is {part:?}, whole {full:?}"));
    }
    // Densities share an arbitrary scale, so their ratios are compared.
    let ratios = |f: &Flight| {
        let top = f.track.max_lane();
        [f.value, f.track, f.ratio].map(|x| x / top)
    };
    for (a, b) in ratios(full).iter().zip(ratios(part)) {
        for (x, y) in a.0.iter().zip(b.0) {
            if (x - y).abs() > 1e-4 * x.abs().max(y.abs()) {
                return Err(format!("has densities {part:?}, whole {full:?}"));
            }
        }
    }
    Ok(())
}
