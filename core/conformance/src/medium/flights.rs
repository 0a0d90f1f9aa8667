//! Free flights and connections against quadrature.

use super::march::BINS;
use super::{LANES, March, draws, inspect, weighed};
use crate::chi2::chi2;
use crate::{Moments, Suite, property};
use resolvent_api::operator::flight_flags;
use resolvent_api::{Flight, Medium, Spectrum};

/// Survivals needed before their mean says anything.
const ENOUGH: f64 = 50.0;

/// A function of the share of the way.
type Weight = fn(f64) -> f64;

/// Transmittance four ways: by survival of free flights, by connections, by the hero lane of connections alone, and by the
/// balance heuristic over both techniques, which is exact only if all three densities are right.
pub fn transmittance(
    suite: &mut Suite,
    name: &str,
    medium: &impl Medium,
    truth: &March,
    prior: Spectrum,
    floor: f64,
) {
    suite.about(property::TRANSMITTANCE);
    let n = suite.samples(150_000);
    let s = &truth.segment;
    let mut survival = [Moments::default(); LANES as usize];
    let mut connection = survival;
    let mut own = survival;
    let mut both = survival;
    for i in 0..n {
        let (u, v) = (draws(1, i, prior), draws(2, i, prior));
        let (f, c) = (medium.sample(s, &u), medium.transmit(s, &v));
        for (what, f) in [("sample", &f), ("transmit", &c)] {
            inspect(suite, f, s, || format!("{name}: {what}"));
        }
        let passed = |f: &Flight, x: f32| if f.collided() { 0.0 } else { x };
        for lane in 0..LANES as usize {
            survival[lane].add(weighed(&u, passed(&f, f.value[lane]), f.track));
            connection[lane].add(weighed(&v, c.value[lane], c.ratio));
            let a = weighed(&u, passed(&f, f.value[lane]), f.track + f.ratio);
            let b = weighed(&v, c.value[lane], c.track + c.ratio);
            both[lane].add(a + b);
        }
        let hero = v.hero as usize;
        own[hero].add(f64::from(c.value[hero]) / f64::from(c.ratio[hero]));
    }
    for lane in 0..LANES as usize {
        let t = truth.transmittance(lane);
        let what = |how: &str| format!("{name}: transmittance of lane {lane} by {how}");
        // A transmittance of 10⁻³⁰ never shows in survivals; connections must still not exceed it by much.
        if t * n as f64 > ENOUGH {
            suite.mean(what("survival"), &survival[lane], t, floor);
            suite.mean(what("both"), &both[lane], t, floor);
            suite.mean(what("connection"), &connection[lane], t, floor);
            suite.mean(what("connection of its own"), &own[lane], t, floor);
        } else {
            let m = connection[lane].mean();
            suite.claim(m <= t + 1e-3, || {
                format!("{}: {m}, not {t}", what("connection"))
            });
        }
    }
}

/// Where flights collide (χ², hero by hero), and three moments of their contribution σ_s T over t: 1, the share of the way, and a
/// wave.
pub fn collisions(
    suite: &mut Suite,
    name: &str,
    medium: &impl Medium,
    truth: &March,
    prior: Spectrum,
    floor: f64,
) {
    suite.about(property::COLLISIONS);
    let n = suite.samples(150_000);
    let s = &truth.segment;
    let (a, b) = truth.range;
    let tests: [(&str, Weight); 3] = [
        ("collisions", |_| 1.0),
        ("mean of t", |x| x),
        ("wave of t", |x| 1.0 + (9.0 * x).sin()),
    ];
    let mut sums = [[Moments::default(); LANES as usize]; 3];
    let mut bins = [[0u64; BINS + 1]; LANES as usize];
    let mut inexact = 0;
    for i in 0..n {
        let mut u = draws(3, i, prior);
        if i % 2 == 0 {
            u.flags = flight_flags::EXACT;
        }
        let f = medium.sample(s, &u);
        let hero = u.hero as usize;
        if !f.collided() {
            bins[hero][BINS] += 1;
            sums.iter_mut().flatten().for_each(|m| m.add(0.0));
            continue;
        }
        bins[hero][truth.bin(f.t.into())] += 1;
        let share = (f64::from(f.t) - a) / (b - a);
        for (sums, (_, test)) in sums.iter_mut().zip(tests) {
            for (lane, m) in sums.iter_mut().enumerate() {
                let x = weighed(&u, f.value[lane] * f.sigma_s[lane], f.track * f.sigma_t);
                m.add(x * test(share));
            }
        }
        if i % 2 == 0 {
            let c = medium.coefficients(s.at(f.t));
            let off = |x: Spectrum, y: Spectrum| {
                (0..LANES as usize).any(|l| (x[l] - y[l]).abs() > 1e-3 * c.sigma_t.max_lane())
            };
            inexact += u32::from(off(f.sigma_t, c.sigma_t) || off(f.sigma_s, c.sigma_s));
        }
    }
    // A collision at the very boundary may round to a point outside, where there is nothing.
    suite.claim(f64::from(inexact) <= 2e-4 * n as f64, || {
        format!("{name}: {inexact} collisions whose exact coefficients are not those of the point")
    });
    for (sums, (what, test)) in sums.iter().zip(tests) {
        for (lane, m) in sums.iter().enumerate() {
            let expected = truth.integrate(lane, |n| {
                f64::from(n.at.sigma_s[lane]) * test((n.t - a) / (b - a))
            });
            if expected * n as f64 > ENOUGH || m.mean() > 0.0 {
                suite.mean(format!("{name}: {what}, lane {lane}"), m, expected, floor);
            }
        }
    }
    for (lane, observed) in bins.iter().enumerate() {
        let flights: u64 = observed.iter().sum();
        let mut expected = vec![0.0; BINS];
        for node in &truth.nodes {
            let rate = (-node.depth[lane]).exp() * f64::from(node.at.sigma_t[lane]);
            expected[truth.bin(node.t)] += rate * node.length * flights as f64;
        }
        expected.push(truth.transmittance(lane) * flights as f64);
        // The depth inside a panel is of second order: what is lost or gained over all bins is given back.
        let total: f64 = expected.iter().sum();
        expected
            .iter_mut()
            .for_each(|e| *e *= flights as f64 / total);
        let t = chi2(observed, &expected);
        suite.p_value(
            format!(
                "{name}: where lane {lane} collides, chi2 {:.1} of {}",
                t.statistic, t.freedom
            ),
            t.p,
        );
    }
}
