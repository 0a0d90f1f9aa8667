//! A Markov chain in the space of primary samples (Kelemen et al. 2002).
//!
//! Numbers are made when they are asked for, and brought up to date when they are asked for again: a large step draws all of
//! them anew, a small step moves each a little around the torus: by how much is drawn for each step, since what is narrow and what is
//! wide want different ones. Keys of streams, and the lane that leads, change with large steps alone, so that small steps move a
//! flight's distance smoothly while its tail stays.

use crate::bidirectional::{Draws, End, NetDraws};
use crate::sampler::Purpose;
use resolvent_api::rng::Stream;

/// A group of four numbers and the key of the stream behind them.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    value: [f32; 4],
    key: u64,
    /// Step at which the value was last brought up to date; 0: never.
    time: u64,
    /// What [`Chain::moved`] was then.
    moved: f64,
}

/// The step at which a chain starts: its first state counts as a large one.
const START: u64 = 1;

/// Standard deviations of small steps, of the unit interval: each step's is drawn between the two, uniformly in the logarithm.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Smallest.
    pub least: f32,
    /// Largest.
    pub most: f32,
}

/// The numbers of an independent sample, as the state that a chain starts from.
#[derive(Clone, Copy, Debug)]
pub struct Origin {
    /// Its numbers.
    pub draws: NetDraws,
    /// Those of the camera, which a sample counts within its pixel and a chain over the whole film.
    pub camera: [f32; 4],
}

/// The chain.
pub struct Chain {
    numbers: Stream,
    origin: Option<Origin>,
    entries: Vec<Entry>,
    /// Entries changed in the step in progress, as they were.
    changed: Vec<(u32, Entry)>,
    hero: (u32, u32),
    lanes: u32,
    sizes: Sizes,
    /// Variance of all small steps of each walk since the last large one, and before the step in progress.
    moved: [f64; 2],
    moved_before: [f64; 2],
    step: u64,
    last_large: u64,
    /// The last large step before the one in progress.
    large_before: u64,
    is_large: bool,
}

impl Chain {
    /// A chain with small steps of these sizes.
    pub fn new(sizes: Sizes, lanes: u32) -> Self {
        Self {
            numbers: Stream::new(0),
            origin: None,
            entries: Vec::new(),
            changed: Vec::new(),
            hero: (0, 0),
            lanes,
            sizes,
            moved: [0.0; 2],
            moved_before: [0.0; 2],
            step: 0,
            last_large: 0,
            large_before: 0,
            is_large: true,
        }
    }

    /// Starts anew, from a sample or, without one, anywhere: everything that follows is a function of both.
    pub fn start(&mut self, key: u64, origin: Option<Origin>) {
        self.numbers = Stream::new(key);
        self.origin = origin;
        self.entries.clear();
        self.changed.clear();
        self.step = START;
        self.moved = [0.0; 2];
        self.moved_before = [0.0; 2];
        self.last_large = START;
        self.large_before = START;
        self.is_large = true;
        let hero = match &self.origin {
            Some(origin) => origin.draws.hero(),
            None => self.draw_hero(),
        };
        self.hero = (hero, 0);
    }

    fn draw_hero(&mut self) -> u32 {
        ((self.numbers.uniform() * self.lanes as f32) as u32).min(self.lanes - 1)
    }

    /// A number that belongs to no state: for decisions about the chain itself.
    pub fn uniform(&mut self) -> f32 {
        self.numbers.uniform()
    }

    /// Proposes the next state, all anew.
    pub fn leap(&mut self) {
        self.propose(true);
        self.last_large = self.step;
        self.moved = [0.0; 2];
        self.hero.0 = self.draw_hero();
    }

    /// Proposes the next state, a small step away in the numbers of these walks, by [`End`]; those of the other stay.
    pub fn nudge(&mut self, walks: [bool; 2]) {
        self.propose(false);
        let Sizes { least, most } = self.sizes;
        let sigma = least * (most / least).powf(self.numbers.uniform());
        for (moved, walk) in self.moved.iter_mut().zip(walks) {
            if walk {
                *moved += f64::from(sigma).powi(2);
            }
        }
    }

    fn propose(&mut self, large: bool) {
        self.changed.clear();
        self.step += 1;
        self.is_large = large;
        self.large_before = self.last_large;
        self.moved_before = self.moved;
        self.hero.1 = self.hero.0;
    }

    /// Keeps the proposal.
    pub fn accept(&mut self) {
        self.changed.clear();
    }

    /// Goes back to the state before the proposal.
    pub fn reject(&mut self) {
        for (i, old) in self.changed.drain(..) {
            self.entries[i as usize] = old;
        }
        self.hero.0 = self.hero.1;
        self.last_large = self.large_before;
        self.moved = self.moved_before;
        self.step -= 1;
    }

    /// The entry of a purpose, up to date.
    fn entry(&mut self, end: End, bounce: u32, purpose: Purpose) -> Entry {
        let i = ((bounce as usize) << 4) | (purpose as usize) << 1 | end as usize;
        if i >= self.entries.len() {
            self.entries.resize(i + 1, Entry::default());
        }
        let old = self.entries[i];
        if old.time == self.step {
            return old;
        }
        let proposes = self.step > START;
        let mut new = old;
        if proposes && !self.is_large {
            // First the state before the step: what it becomes must not depend on whether the step is kept, or numbers would be
            // drawn until they please.
            self.renew(&mut new, end, bounce, purpose);
            self.drift(&mut new, self.step - 1, self.moved_before[end as usize]);
        }
        self.changed.push((i as u32, new));
        self.renew(&mut new, end, bounce, purpose);
        self.drift(&mut new, self.step, self.moved[end as usize]);
        self.entries[i] = new;
        new
    }

    /// Draws an entry anew that is older than the last large step.
    fn renew(&mut self, e: &mut Entry, end: End, bounce: u32, purpose: Purpose) {
        if e.time >= self.last_large {
            return;
        }
        match &mut self.origin {
            Some(origin) if self.last_large == START => {
                e.value = match (end, bounce, purpose) {
                    (End::Sensor, 0, Purpose::Camera) => origin.camera,
                    _ => origin.draws.four(end, bounce, purpose),
                };
                e.key = origin.draws.key(end, bounce, purpose);
            }
            _ => {
                let (a, b) = (self.numbers.uniform2(), self.numbers.uniform2());
                e.value = [a[0], a[1], b[0], b[1]];
                e.key = self.numbers.bits();
            }
        }
        e.time = self.last_large;
        e.moved = 0.0;
    }

    /// Moves an entry by the small steps it has missed; they add up to one of their joint variance.
    fn drift(&mut self, e: &mut Entry, step: u64, moved: f64) {
        e.time = step;
        if moved > e.moved {
            let spread = (moved - e.moved).sqrt() as f32;
            let [a, b, c, d] = e.value;
            let [p, q] = normals(&mut self.numbers);
            let [r, s] = normals(&mut self.numbers);
            e.value = [
                around(a + spread * p),
                around(b + spread * q),
                around(c + spread * r),
                around(d + spread * s),
            ];
            e.moved = moved;
        }
    }
}

/// Wraps onto [0, 1).
fn around(v: f32) -> f32 {
    let w = v - v.floor();
    if w < 1.0 { w } else { 0.0 }
}

/// Two standard normal variates (Box & Muller 1958).
fn normals(s: &mut Stream) -> [f32; 2] {
    let [a, b] = s.uniform2();
    let r = (-2.0 * (1.0 - a).ln()).sqrt();
    let (sin, cos) = (core::f32::consts::TAU * b).sin_cos();
    [r * cos, r * sin]
}

impl Draws for Chain {
    fn four(&mut self, end: End, bounce: u32, purpose: Purpose) -> [f32; 4] {
        self.entry(end, bounce, purpose).value
    }

    fn key(&mut self, end: End, bounce: u32, purpose: Purpose) -> u64 {
        self.entry(end, bounce, purpose).key
    }

    fn hero(&self) -> u32 {
        self.hero.0
    }

    fn lanes(&self) -> u32 {
        self.lanes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(least: f32, most: f32) -> Sizes {
        Sizes { least, most }
    }

    fn propose(c: &mut Chain, large: bool) {
        match large {
            true => c.leap(),
            false => c.nudge([true, true]),
        }
    }

    fn state(c: &mut Chain) -> Vec<[f32; 4]> {
        (0..5)
            .map(|b| c.four(End::Light, b, Purpose::Flight))
            .collect()
    }

    /// A number that the target depends on, first used after steps that did not: it must not settle where proposals are
    /// accepted. The chain visits two kinds of states, one blind to the number, with a density of 1 + cos 2πx in the other.
    #[test]
    fn late_numbers_are_not_chosen() {
        let mut c = Chain::new(sizes(0.02, 0.3), 1);
        let density = |c: &mut Chain| {
            let kind = c.four(End::Sensor, 0, Purpose::Branch)[0];
            if kind < 0.5 {
                return (1.0, None);
            }
            let x = c.four(End::Light, 4, Purpose::Scatter)[0];
            (1.0 + (core::f64::consts::TAU * f64::from(x)).cos(), Some(x))
        };
        // Batches of independent chains: time in the second kind, and there below a quarter or above three.
        let mut shares = [const { Vec::new() }; 2];
        for key in 0..200 {
            c.start(key, None);
            let (mut f, mut x) = density(&mut c);
            let (mut second, mut near) = (0.0, 0.0);
            let n = 4000;
            for step in 0..n {
                propose(&mut c, step % 50 == 49);
                let (g, y) = density(&mut c);
                if f64::from(c.uniform()) * f < g {
                    c.accept();
                    (f, x) = (g, y);
                } else {
                    c.reject();
                }
                second += f64::from(u8::from(x.is_some()));
                near += f64::from(u8::from(x.is_some_and(|x| !(0.25..0.75).contains(&x))));
            }
            shares[0].push(second / f64::from(n));
            shares[1].push(near / f64::from(n));
        }
        // ∫ over the two quarters of (1 + cos 2πx)/2 = 1/4 + 1/(2π).
        for (v, expected) in shares
            .iter()
            .zip([0.5, 0.25 + 0.5 * core::f64::consts::FRAC_1_PI])
        {
            let m = v.iter().sum::<f64>() / 200.0;
            let s = (v.iter().map(|x| (x - m).powi(2)).sum::<f64>() / 199.0 / 200.0).sqrt();
            assert!((m - expected).abs() < 4.0 * s, "{m} +- {s}, {expected}");
        }
    }

    /// The first state is the sample's, also of numbers that are asked for late; and a walk that is not moved stays.
    #[test]
    fn a_chain_starts_as_its_sample() {
        let mut draws = NetDraws::new(3, 5, 7, 3);
        let camera = [0.1, 0.2, 0.3, 0.4];
        let mut c = Chain::new(sizes(0.02, 0.02), 3);
        c.start(8, Some(Origin { draws, camera }));
        assert_eq!(c.hero(), draws.hero());
        assert_eq!(c.four(End::Sensor, 0, Purpose::Camera), camera);
        let places = [(End::Sensor, 3), (End::Light, 1), (End::Light, 6)];
        for (k, (end, bounce)) in places.into_iter().enumerate() {
            let p = Purpose::Scatter;
            let expected = draws.four(end, bounce, p);
            assert_eq!(c.four(end, bounce, p), expected);
            assert_eq!(c.key(end, bounce, p), draws.key(end, bounce, p));
            c.nudge([true, false]);
            assert_eq!(c.four(end, bounce, p) == expected, end == End::Light);
            c.reject();
            assert_eq!(c.four(end, bounce, p), expected, "place {k}");
            // A large step that fails leaves the sample in place for what is still to be asked for.
            c.leap();
            assert_ne!(c.four(end, bounce, p), expected);
            c.reject();
        }
    }

    #[test]
    fn rejection_restores_everything() {
        let mut c = Chain::new(sizes(0.02, 0.02), 3);
        c.start(5, None);
        let before = state(&mut c);
        let key = c.key(End::Light, 2, Purpose::Flight);
        for k in 0..100 {
            propose(&mut c, k % 3 == 0);
            let moved = state(&mut c);
            assert_ne!(before, moved);
            let _ = c.four(End::Sensor, 7 + k, Purpose::Scatter);
            c.reject();
            assert_eq!(before, state(&mut c));
            assert_eq!(key, c.key(End::Light, 2, Purpose::Flight));
        }
        propose(&mut c, false);
        let moved = state(&mut c);
        c.accept();
        assert_eq!(moved, state(&mut c));
        assert_eq!(key, c.key(End::Light, 2, Purpose::Flight));
    }

    /// A chain that accepts everything stays uniform: mean and variance of a number over small and large steps, also of one
    /// that is asked for now and then.
    #[test]
    fn states_stay_uniform() {
        let mut c = Chain::new(sizes(0.01, 0.2), 3);
        c.start(11, None);
        let n = 400_000;
        let mut sums = [[0f64; 2]; 2];
        let mut rare = 0;
        for i in 0..n {
            let large = c.uniform() < 0.2;
            propose(&mut c, large);
            let a = f64::from(c.four(End::Sensor, 1, Purpose::Light)[2]);
            sums[0][0] += a;
            sums[0][1] += (a - 0.5).powi(2);
            if i % 7 == 0 {
                let b = f64::from(c.four(End::Light, 3, Purpose::Flight)[0]);
                sums[1][0] += b;
                sums[1][1] += (b - 0.5).powi(2);
                rare += 1;
            }
            c.accept();
        }
        for (s, n) in sums.iter().zip([n, rare]) {
            let n = f64::from(n);
            // Correlation over about 5 steps between large ones.
            let error = (10.0 / n).sqrt();
            assert!((s[0] / n - 0.5).abs() < 4.0 * 0.289 * error, "{s:?}");
            assert!((s[1] / n - 1.0 / 12.0).abs() < 4.0 * 0.075 * error, "{s:?}");
        }
    }
}
