//! What flights pick up on their way, against quadrature.

use super::{LANES, March, draws};
use crate::{Moments, Suite, property};
use resolvent_api::medium::medium_traits;
use resolvent_api::operator::flight_flags;
use resolvent_api::rng::{Stream, exponential};
use resolvent_api::{FlightDraws, Medium, Segment, Spectrum};

/// ∫ j T dt by `emitted`: as it is, with the promise that no other medium is there, and under the collisions of another
/// medium as the host plays them.
pub fn emission(
    suite: &mut Suite,
    name: &str,
    medium: &impl Medium,
    truth: &March,
    prior: Spectrum,
    floor: f64,
) {
    let n = suite.samples(100_000);
    with(suite, name, medium, truth, prior, floor, n);
}

/// As [`emission`], with `n` flights.
pub(super) fn with(
    suite: &mut Suite,
    name: &str,
    medium: &impl Medium,
    truth: &March,
    prior: Spectrum,
    floor: f64,
    n: usize,
) {
    suite.about(property::EMISSION);
    let s = &truth.segment;
    let emits = medium.info().traits & medium_traits::EMISSIVE != 0;
    let rate = 2.0 / (truth.range.1 - truth.range.0) as f32;
    let mut sums = [[Moments::default(); LANES as usize]; 4];
    let mut stream = Stream::new(0xe715);
    for i in 0..if emits { n } else { 100 } {
        let u = draws(6, i, prior);
        let chance = f64::from(prior[u.hero as usize]);
        let plain = medium.sample(s, &u).emitted;
        let alone = FlightDraws {
            flags: flight_flags::ALONE,
            ..u
        };
        let expected = medium.sample(s, &alone).emitted;
        suite.claim(emits || (plain.is_zero() && expected.is_zero()), || {
            format!("{name}: emits {plain:?} without the trait")
        });
        let cut = truth.range.0 as f32 + exponential(stream.uniform()) / rate;
        let with_other = beside(medium, s, &u, cut);
        // As the host does where several lanes and media meet: only the hero's prior counts, and its lane.
        let mut alone_in_lane = u;
        alone_in_lane.prior = Spectrum::ZERO;
        alone_in_lane.prior[u.hero as usize] = u.prior[u.hero as usize];
        let hero = beside(medium, s, &alone_in_lane, cut);
        for lane in 0..LANES as usize {
            sums[0][lane].add(chance * f64::from(plain[lane]));
            sums[1][lane].add(chance * f64::from(expected[lane]));
            sums[2][lane].add(chance * f64::from(with_other[lane]));
            let own = if lane == u.hero as usize {
                hero[lane]
            } else {
                0.0
            };
            sums[3][lane].add(chance * f64::from(own));
        }
    }
    if !emits {
        return;
    }
    let start = f64::from(truth.range.0 as f32);
    let [plain, alone, beside, by_hero] = sums;
    for lane in 0..LANES as usize {
        let whole = truth.integrate(lane, |n| n.at.emission[lane].into());
        let dimmed = truth.integrate(lane, |n| {
            f64::from(n.at.emission[lane]) * (-f64::from(rate) * (n.t - start)).exp()
        });
        for (how, m, expected) in [
            ("as it is", plain[lane], whole),
            ("alone", alone[lane], whole),
            ("beside another medium", beside[lane], dimmed),
            ("by its hero alone", by_hero[lane], dimmed),
        ] {
            suite.mean(
                format!("{name}: emission of lane {lane} {how}"),
                &m,
                expected,
                floor,
            );
        }
    }
}

/// Emission found when another, grey medium collides at `cut`: the flight as it is if its own collision comes first, and its
/// beginning if not.
fn beside(medium: &impl Medium, s: &Segment, u: &FlightDraws, cut: f32) -> Spectrum {
    let full = medium.sample(s, u);
    if full.t <= cut {
        return full.emitted;
    }
    if cut <= s.t0 {
        return Spectrum::ZERO;
    }
    medium.sample(&Segment { t1: cut, ..*s }, u).emitted
}
