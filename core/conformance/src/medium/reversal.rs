//! Densities of a path from its other end.

use super::{LANES, March, draws};
use crate::{Moments, Suite, property};
use resolvent_api::operator::flight_flags;
use resolvent_api::rng::Stream;
use resolvent_api::{Coefficients, Flight, FlightDraws, Medium, Segment, Spectrum};

/// Light that scatters in one stretch of the segment and then in another, ∫∫ σ_s(a) T(a, b) σ_s(b) da db, by flights from both ends
/// under the balance heuristic.
///
/// A flight from a that collides at b has the density `track · σ_t(b)`; the flight from b that would have come by the same null
/// collisions to a has `track · σ_t(a)`. The two techniques add up to the integral only if a medium's `track` says the same of a
/// path from both of its ends, which is what bidirectional weights rest on (Miller et al. 2019, §4.2).
pub fn reversal(
    suite: &mut Suite,
    name: &str,
    medium: &impl Medium,
    truth: &March,
    prior: Spectrum,
    floor: f64,
) {
    suite.about(property::REVERSAL);
    let s = &truth.segment;
    let (begin, end) = truth.range;
    let at = |share: f64| begin + share * (end - begin);
    // Two stretches with a gap between them.
    let (near, far) = ((at(0.05), at(0.45)), (at(0.5), at(0.95)));
    let length = |(a, b): (f64, f64)| (b - a) as f32;
    let (from_near, from_far) = (1.0 / length(near), 1.0 / length(far));
    let mut stream = Stream::new(0x4e5e);
    let mut both = [Moments::default(); LANES as usize];
    let n = suite.samples(100_000);
    for i in 0..n {
        let (mut u, mut v) = (draws(9, i, prior), draws(10, i, prior));
        u.flags = flight_flags::EXACT;
        v.flags = flight_flags::EXACT;
        let [x, y] = stream.uniform2();
        let a = near.0 as f32 + x * length(near);
        let b = far.0 as f32 + y * length(far);
        let there = medium.sample(
            &Segment {
                t0: a,
                t1: s.t1,
                ..*s
            },
            &u,
        );
        let back = Segment {
            o: s.at(b).into(),
            t0: 0.0,
            d: s.d.map(|d| -d),
            t1: b - s.t0,
        };
        let here = medium.sample(&back, &v);
        let mut sum = [0.0; LANES as usize];
        let within = |(lo, hi): (f64, f64), t: f32| f64::from(t) >= lo && f64::from(t) < hi;
        if there.collided() && within(far, there.t) {
            let start = medium.coefficients(s.at(a));
            add(&mut sum, &u, &there, &start, [from_near, from_far]);
        }
        if here.collided() && within(near, b - here.t) {
            let start = medium.coefficients(s.at(b));
            add(&mut sum, &v, &here, &start, [from_far, from_near]);
        }
        both.iter_mut().zip(sum).for_each(|(m, x)| m.add(x));
    }
    for (lane, m) in both.iter().enumerate() {
        let expected = integral(truth, lane, near, far);
        // With too few of them there is nothing to tell.
        if expected > 1e-3 && m.variance() > 0.0 {
            let what = format!("{name}: paths of lane {lane} from both ends");
            suite.mean(what, m, expected, floor.max(1e-3));
        }
    }
}

/// What a flight from `start` contributes; `chances` are the densities of its start here and of the other technique's.
fn add(
    sum: &mut [f64; LANES as usize],
    u: &FlightDraws,
    f: &Flight,
    start: &Coefficients,
    chances: [f32; 2],
) {
    let density = f.track * (f.sigma_t * chances[0] + start.sigma_t * chances[1]);
    let mean = f64::from((density * u.prior).mean(u.lanes));
    if !(mean > 0.0) {
        return;
    }
    for (lane, sum) in sum.iter_mut().enumerate() {
        let f = f.value[lane] * f.sigma_s[lane] * start.sigma_s[lane];
        *sum += f64::from(u.prior[u.hero as usize]) * f64::from(f) / mean;
    }
}

/// ∫∫ σ_s(a) T(a, b) σ_s(b) = ∫ σ_s(a)/T(0, a) da · ∫ σ_s(b) T(0, b) db, with depths counted from the gap, so that nothing
/// overflows.
fn integral(truth: &March, lane: usize, near: (f64, f64), far: (f64, f64)) -> f64 {
    let within = |(lo, hi): (f64, f64)| {
        truth
            .nodes
            .iter()
            .filter(move |n| n.t >= lo && n.t < hi)
            .map(move |n| (n.depth[lane], f64::from(n.at.sigma_s[lane]) * n.length))
    };
    let Some(gap) = within(far).map(|(depth, _)| depth).next() else {
        return 0.0;
    };
    let first: f64 = within(near).map(|(d, m)| (d - gap).exp() * m).sum();
    let second: f64 = within(far).map(|(d, m)| (gap - d).exp() * m).sum();
    first * second
}
