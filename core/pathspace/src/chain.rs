//! A Markov chain in the space of primary samples (Kelemen et al. 2002).
//!
//! Numbers are made when they are asked for, and brought up to date when they are asked for again: a large step draws all of
//! them anew, a small step moves each a little around the torus: by how much is drawn for each step, since what is narrow and what is
//! wide want different ones. Keys of streams, and the lane that leads, change with large steps alone, so that small steps move a
//! flight's distance smoothly while its tail stays.

use crate::bidirectional::{Draws, End};
use crate::sampler::Purpose;
use resolvent_api::rng::{Stream, derive};

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

/// Standard deviations of small steps, of the unit interval: each step's is drawn between the two, uniformly in the logarithm.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Smallest.
    pub least: f32,
    /// Largest.
    pub most: f32,
}

/// The chain.
pub struct Chain {
    numbers: Stream,
    entries: Vec<Entry>,
    /// Entries changed in the step in progress, as they were.
    changed: Vec<(u32, Entry)>,
    hero: (u32, u32),
    lanes: u32,
    sizes: Sizes,
    /// Variance of all small steps since the last large one, and before the step in progress.
    moved: f64,
    moved_before: f64,
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
            entries: Vec::new(),
            changed: Vec::new(),
            hero: (0, 0),
            lanes,
            sizes,
            moved: 0.0,
            moved_before: 0.0,
            step: 0,
            last_large: 0,
            large_before: 0,
            is_large: true,
        }
    }

    /// Starts anew: everything that follows is a function of `key`.
    pub fn start(&mut self, key: u64) {
        self.numbers = Stream::new(key);
        self.entries.clear();
        self.changed.clear();
        self.step = 1;
        self.moved = 0.0;
        self.moved_before = 0.0;
        self.last_large = 1;
        self.large_before = 1;
        self.is_large = true;
        self.hero = (self.draw_hero(), 0);
    }

    fn draw_hero(&mut self) -> u32 {
        ((self.numbers.uniform() * self.lanes as f32) as u32).min(self.lanes - 1)
    }

    /// A number that belongs to no state: for decisions about the chain itself.
    pub fn uniform(&mut self) -> f32 {
        self.numbers.uniform()
    }

    /// Proposes the next state.
    pub fn propose(&mut self, large: bool) {
        self.changed.clear();
        self.step += 1;
        self.is_large = large;
        self.large_before = self.last_large;
        self.moved_before = self.moved;
        self.hero.1 = self.hero.0;
        if large {
            self.last_large = self.step;
            self.moved = 0.0;
            self.hero.0 = self.draw_hero();
        } else {
            let Sizes { least, most } = self.sizes;
            let sigma = least * (most / least).powf(self.numbers.uniform());
            self.moved += f64::from(sigma).powi(2);
        }
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
        let proposes = self.step > 1;
        let mut new = old;
        if proposes && !self.is_large {
            // First the state before the step: what it becomes must not depend on whether the step is kept, or numbers would be
            // drawn until they please.
            self.renew(&mut new);
            self.drift(&mut new, self.step - 1, self.moved_before);
        }
        self.changed.push((i as u32, new));
        self.renew(&mut new);
        self.drift(&mut new, self.step, self.moved);
        self.entries[i] = new;
        new
    }

    /// Draws an entry anew that is older than the last large step.
    fn renew(&mut self, e: &mut Entry) {
        if e.time < self.last_large {
            let (a, b) = (self.numbers.uniform2(), self.numbers.uniform2());
            e.value = [a[0], a[1], b[0], b[1]];
            e.key = self.numbers.bits();
            e.time = self.last_large;
            e.moved = 0.0;
        }
    }

    /// Moves an entry by the small steps it has missed; they add up to one of their joint variance.
    fn drift(&mut self, e: &mut Entry, step: u64, moved: f64) {
        if step > e.time {
            let spread = (moved - e.moved).max(0.0).sqrt() as f32;
            for v in &mut e.value {
                *v = around(*v + spread * normal(&mut self.numbers));
            }
            e.time = step;
            e.moved = moved;
        }
    }
}

/// Wraps onto [0, 1).
fn around(v: f32) -> f32 {
    let w = v - v.floor();
    if w < 1.0 { w } else { 0.0 }
}

/// A standard normal variate (Box & Muller 1958).
fn normal(s: &mut Stream) -> f32 {
    let [a, b] = s.uniform2();
    (-2.0 * (1.0 - a).ln()).sqrt() * (core::f32::consts::TAU * b).cos()
}

impl Draws for Chain {
    fn four(&mut self, end: End, bounce: u32, purpose: Purpose) -> [f32; 4] {
        self.entry(end, bounce, purpose).value
    }

    fn key(&mut self, end: End, bounce: u32, purpose: Purpose) -> u64 {
        let key = self.entry(end, bounce, purpose).key;
        derive(key, u64::from(bounce) * 8 + purpose as u64)
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
            c.start(key);
            let (mut f, mut x) = density(&mut c);
            let (mut second, mut near) = (0.0, 0.0);
            let n = 4000;
            for step in 0..n {
                c.propose(step % 50 == 49);
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

    #[test]
    fn rejection_restores_everything() {
        let mut c = Chain::new(sizes(0.02, 0.02), 3);
        c.start(5);
        let before = state(&mut c);
        let key = c.key(End::Light, 2, Purpose::Flight);
        for k in 0..100 {
            c.propose(k % 3 == 0);
            let moved = state(&mut c);
            assert_ne!(before, moved);
            let _ = c.four(End::Sensor, 7 + k, Purpose::Scatter);
            c.reject();
            assert_eq!(before, state(&mut c));
            assert_eq!(key, c.key(End::Light, 2, Purpose::Flight));
        }
        c.propose(false);
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
        c.start(11);
        let n = 400_000;
        let mut sums = [[0f64; 2]; 2];
        let mut rare = 0;
        for i in 0..n {
            let large = c.uniform() < 0.2;
            c.propose(large);
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
