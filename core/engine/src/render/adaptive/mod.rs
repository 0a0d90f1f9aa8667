//! Samples where the error is: every tile is sampled until its own error is small enough, without a bias.
//!
//! A number of samples that depends on their values biases their mean: a pixel that has not met its rare bright light looks
//! finished (Kirk & Arvo 1991). So the nets of a pixel are dealt to two halves in turn, and *each half's number of samples in the
//! picture is decided by the other half alone*. Given the second half, the number of samples of the first is fixed, and their mean is
//! unbiased; the picture is the mean of both means, with equal weights, since weights by number would tie them again.
//!
//! A half decides as soon as it has [`ENOUGH`] of the samples that the goal takes by its own estimate, and from then on the number
//! stands. To wait for all of them would cost whole nets, of which the last is mostly too much; and since a half that decides is seldom
//! beyond what the picture has of it, little is sampled for decisions alone. A half that is goes on beside the picture (its *probe*).
//! The last net of a half is cut, at a multiple of [`nets::SMALLEST`]: then the part is a net as good as the first.
//!
//! What a decision takes from beyond its tile, the picture's mean that scales errors, comes from the same half at the end of
//! the first rounds, which all tiles have.
//!
//! Walks from lights leave their light anywhere, and chains wander over the whole picture: no tile's samples are its own. If any
//! splat has come up in the first rounds, the halves are united, and all tiles sampled alike until none is above the goal.

mod store;
#[cfg(test)]
pub(crate) mod tests;

use super::job::{Into, Job};
use super::uniform;
use crate::film::{Film, Rect};
use rayon::prelude::*;
use resolvent_pathspace::nets;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Rounds, a net of each half, before the first decision. Of two nets, too many have missed what is rare: where a caustic is found
/// by chance, decisions by two take nearly twice the work for the same error.
const FIRST: u32 = 3;
/// Share of the samples by which their number is decided. More of them decide better and waste more: between a half and three
/// quarters the work for a given error hardly differs.
const ENOUGH: f64 = 2.0 / 3.0;

/// How far an adaptive render has come, beside its film.
#[derive(Clone, Debug)]
pub struct Adaptive {
    goal: f64,
    /// Rounds that all unfinished tiles have done.
    round: u32,
    /// Tile by tile the samples that each half has in the end, once the other half has decided it.
    counts: Vec<[Option<u32>; 2]>,
    /// What scales the errors of each half, once it is known.
    floors: Option<[f64; 2]>,
    /// Undecided halves that have samples beyond those in the picture, with them, by tile and half.
    probes: BTreeMap<(usize, bool), Film>,
}

/// Samples of a half after so many whole rounds.
fn after(rounds: u32) -> u32 {
    // Both nets of a round are of one size.
    nets::nth(2 * rounds).start / 2
}

/// Samples of each half that a tile takes, by those that one half has, and their error as [`Film::half_error`] tells it.
fn needed(goal: f64, samples: u32, error: Option<f64>) -> f64 {
    // The picture's variance is half of that of either half.
    0.5 * error.unwrap_or(f64::INFINITY) / (goal * goal) * f64::from(samples)
}

/// How many samples the other half shall have, if a half has enough of those needed to decide it.
fn count(samples: u32, needed: f64) -> Option<u32> {
    let net = f64::from(nets::SMALLEST);
    let whole = (needed / net).ceil() * net;
    (f64::from(samples) >= ENOUGH * needed).then(|| samples.max(whole as u32))
}

impl Adaptive {
    pub(crate) fn new(goal: f64, tiles: usize) -> Self {
        Self {
            goal,
            round: 0,
            counts: vec![[None; 2]; tiles],
            floors: None,
            probes: BTreeMap::new(),
        }
    }

    /// The error that no tile shall have more of.
    pub fn goal(&self) -> f64 {
        self.goal
    }

    /// The probe of a tile's half.
    pub(crate) fn probe(&mut self, tile: usize, second: bool) -> &mut Film {
        self.probes
            .entry((tile, second))
            .or_insert_with(|| Film::new([0, 0, 1, 1], false))
    }

    /// Tiles that are not finished.
    fn left(&self) -> usize {
        let done = after(self.round);
        let is_done = |n: &Option<u32>| n.is_some_and(|n| n <= done);
        let finished = |counts: &&[Option<u32>; 2]| counts.iter().all(is_done);
        self.counts.len() - self.counts.iter().filter(finished).count()
    }

    /// True if a half goes on beside the picture in the next round: it is undecided, and the picture has, or will have, enough of it.
    fn has_probe(&self, tile: usize, half: usize) -> bool {
        let counts = self.counts[tile];
        counts[1 - half].is_none() && counts[half].is_some_and(|n| n < after(self.round + 1))
    }

    /// Decides after a round what can be decided. The error of the worst tile, as far as it is known.
    fn decide(&mut self, film: &mut Film) -> f64 {
        self.round += 1;
        if self.round < FIRST {
            return f64::INFINITY;
        }
        let floors = *self
            .floors
            .get_or_insert_with(|| [false, true].map(|second| film.half(second).half_floor()));
        let samples = after(self.round);
        let mut worst: f64 = 0.0;
        for tile in 0..self.counts.len() {
            for (half, floor) in floors.into_iter().enumerate() {
                let (second, other) = (half == 1, 1 - half);
                let needed = match self.counts[tile][other] {
                    Some(count) => f64::from(count),
                    None => {
                        let error = match self.probes.get(&(tile, second)) {
                            Some(probe) => probe.half_error(0, floor),
                            None => film.half(second).half_error(tile, floor),
                        };
                        let needed = needed(self.goal, samples, error);
                        self.counts[tile][other] = count(samples, needed);
                        needed
                    }
                };
                worst = worst.max(needed / f64::from(samples));
            }
            for (half, second) in [false, true].into_iter().enumerate() {
                if self.has_probe(tile, half) {
                    let cut = || film.half(second).cut(tile);
                    self.probes.entry((tile, second)).or_insert_with(cut);
                } else {
                    self.probes.remove(&(tile, second));
                }
            }
        }
        self.goal * worst.sqrt()
    }

    /// The pieces of the round that are not done yet.
    fn pieces(&self, film: &mut Film) -> Vec<(Rect, usize, Range<u32>, Into)> {
        let mut out = Vec::new();
        let before = after(self.round);
        for (i, rect) in film.tiles().enumerate() {
            for (half, second) in [false, true].into_iter().enumerate() {
                let net = nets::nth(2 * self.round + u32::from(second));
                let end = self.counts[i][half].map_or(net.end, |n| {
                    let left = n.saturating_sub(before);
                    net.start.saturating_add(left).min(net.end)
                });
                let missing = film.half(second).coverage(i).missing(net.start..end);
                let into = Into::Film { second };
                out.extend(missing.into_iter().map(|r| (rect, i, r, into)));
                if let Some(probe) = self.probes.get(&(i, second)) {
                    let missing = probe.coverage(0).missing(net);
                    let into = Into::Probe { second };
                    out.extend(missing.into_iter().map(|r| (rect, i, r, into)));
                }
            }
        }
        out
    }
}

/// Renders until no tile's error is above `goal`; true if it came to that, or to the end of the samples.
pub fn run(job: &Job, goal: f64) -> bool {
    let mut worst = f64::INFINITY;
    loop {
        let (pieces, tiles, left) = {
            let mut state = job.state();
            let state = &mut *state;
            let Some(a) = &state.adaptive else { break };
            if a.round >= FIRST && state.film.is_faint() {
                job.fail(super::too_faint());
                return false;
            }
            let left = a.left();
            if left == 0 || nets::nth(2 * a.round + 1).end > job.settings.samples.end {
                return true;
            }
            (a.pieces(&mut state.film), a.counts.len(), left)
        };
        // Nothing is known before the first decision.
        let known = worst.is_finite().then_some(worst);
        let done = known.map_or(0.0, |e| (goal / e).powi(2));
        let done = done.min(1.0 - left as f64 / tiles as f64);
        pieces.par_iter().for_each(|(rect, i, samples, into)| {
            if job.piece(*rect, *i, samples.clone(), *into) {
                job.report(done, known);
            }
        });
        if job.is_stopped() {
            return false;
        }
        let mut state = job.state();
        let state = &mut *state;
        let Some(a) = &mut state.adaptive else { break };
        worst = a.decide(&mut state.film);
        if a.round <= FIRST && state.film.has_splats() {
            state.adaptive = None;
            if let Err(why) = state.film.unite() {
                job.fail(why);
                return false;
            }
        }
        let least = state.film.least_samples();
        job.samples.store(least.into(), Ordering::Relaxed);
    }
    // The film is one now, and its tiles are sampled alike.
    uniform::run(job)
}
