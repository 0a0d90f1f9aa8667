//! Samples where the error is: every tile is sampled until its own error is small enough, without a bias.
//!
//! A number of samples that depends on their values biases their mean: a pixel that has not met its rare bright light looks
//! finished (Kirk & Arvo 1991). So the nets of a pixel are dealt to two halves in turn, and *each half's number of samples is
//! decided by the other half alone*: the first in the picture is sampled until the second's estimate of the error meets the goal, and
//! the other way round. Given the second half, the number of samples of the first is fixed, and their mean is unbiased;
//! the picture is the mean of both means, with equal weights, since weights by number would tie them again. A half that has as many
//! samples as it may have in the picture, but does not meet the goal yet, is sampled further on the side (its *probe*): for the
//! decision, not for the picture. The halves agree closely on what a tile needs, so that little is lost by that.
//!
//! What a decision takes from beyond its tile, the picture's mean that scales errors, comes from the same half at the end of
//! the first rounds, which all tiles have.
//!
//! Walks from lights leave their light anywhere, and chains wander over the whole picture: no tile's samples are its own. If any
//! splat has come up in the first rounds, the halves are united, and all tiles sampled alike until none is above the goal.

use super::job::{Into, Job};
use super::uniform;
use crate::checkpoint::sections::{Fields, Reader, Writer};
use crate::film::{Film, Rect};
use rayon::prelude::*;
use resolvent_pathspace::nets;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rounds, a net of each half, before the first decision: with two nets a half has an estimate of its error.
const FIRST: u32 = 2;
/// More rounds than any render has.
const MOST_ROUNDS: u32 = 1 << 24;

/// How far an adaptive render has come, beside its film.
#[derive(Clone, Debug)]
pub struct Adaptive {
    goal: f64,
    /// Rounds that all unfinished tiles have done.
    round: u32,
    /// Tile by tile whether each half, by its own samples, has met the goal.
    met: Vec<[bool; 2]>,
    /// What scales the errors of each half, once it is known.
    floors: Option<[f64; 2]>,
    /// Samples of a half beyond those in the picture, with them, by tile and half.
    probes: BTreeMap<(usize, bool), Film>,
}

impl Adaptive {
    pub(crate) fn new(goal: f64, tiles: usize) -> Self {
        Self {
            goal,
            round: 0,
            met: vec![[false; 2]; tiles],
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

    /// Decides after a round which halves have met the goal; true if no tile is left.
    fn decide(&mut self, film: &mut Film) -> (bool, f64) {
        self.round += 1;
        let mut worst: f64 = 0.0;
        if self.round < FIRST {
            return (false, f64::INFINITY);
        }
        let floors = *self
            .floors
            .get_or_insert_with(|| [false, true].map(|second| film.half(second).half_floor()));
        for (tile, met) in self.met.iter_mut().enumerate() {
            if *met == [true; 2] {
                continue;
            }
            let before = *met;
            for (half, floor) in floors.into_iter().enumerate() {
                if before[half] {
                    continue;
                }
                let second = half == 1;
                let error = match self.probes.get(&(tile, second)) {
                    Some(probe) => probe.half_error(0, floor),
                    None => film.half(second).half_error(tile, floor),
                };
                // The picture's variance is half of that of either half.
                let square = 0.5 * error.unwrap_or(f64::INFINITY);
                met[half] = square <= self.goal * self.goal;
                worst = worst.max(square);
            }
            for half in 0..2 {
                let second = half == 1;
                if met[half] {
                    self.probes.remove(&(tile, second));
                } else if met[1 - half] && !before[1 - half] {
                    // What the picture has of this half is decided.
                    let probe = film.half(second).cut(tile);
                    self.probes.insert((tile, second), probe);
                }
            }
        }
        (self.met.iter().all(|m| *m == [true; 2]), worst.sqrt())
    }

    /// The pieces of the round that are not done yet.
    fn pieces(&self, film: &mut Film) -> Vec<(Rect, usize, Range<u32>, Into)> {
        let mut out = Vec::new();
        for (i, rect) in film.tiles().enumerate() {
            if self.met[i] == [true; 2] {
                continue;
            }
            for second in [false, true] {
                let net = nets::nth(2 * self.round + u32::from(second));
                let (missing, into) = match self.probes.get(&(i, second)) {
                    Some(probe) => (probe.coverage(0).missing(net), Into::Probe { second }),
                    None => (
                        film.half(second).coverage(i).missing(net),
                        Into::Film { second },
                    ),
                };
                out.extend(missing.into_iter().map(|r| (rect, i, r, into)));
            }
        }
        out
    }

    pub(crate) fn write(&self, out: &mut Writer) {
        out.section("adaptive", |out| {
            out.extend_from_slice(&self.goal.to_bits().to_le_bytes());
            out.extend_from_slice(&self.round.to_le_bytes());
            out.extend_from_slice(&u32::from(self.floors.is_some()).to_le_bytes());
            for f in self.floors.unwrap_or_default() {
                out.extend_from_slice(&f.to_bits().to_le_bytes());
            }
            for [a, b] in &self.met {
                let flags = u32::from(*a) | u32::from(*b) << 1;
                out.extend_from_slice(&flags.to_le_bytes());
            }
            for (tile, second) in self.probes.keys() {
                for v in [*tile as u32, u32::from(*second)] {
                    out.extend_from_slice(&v.to_le_bytes());
                }
            }
        });
        for ((tile, second), probe) in &self.probes {
            probe.write(&prefix(*tile, *second), out);
        }
    }

    /// Reads what [`Adaptive::write`] wrote for `film`.
    pub(crate) fn read(film: &Film, from: &mut Reader) -> Result<Self, String> {
        let mut f: Fields = from.take("adaptive", None)?;
        let goal = f64::from_bits(f.u64()?);
        let (round, has_floors) = (f.u32()?, f.u32()? == 1);
        let floors = [f64::from_bits(f.u64()?), f64::from_bits(f.u64()?)];
        if !(goal > 0.0) || round > MOST_ROUNDS || has_floors != (round >= FIRST) {
            return Err("is damaged: its progress does not agree with itself".into());
        }
        let rects: Vec<Rect> = film.tiles().collect();
        let met = (rects
            .iter()
            .map(|_| f.u32().map(|m| [m & 1 == 1, m & 2 == 2])))
        .collect::<Result<Vec<_>, _>>()?;
        let mut probes = BTreeMap::new();
        while !f.is_empty() {
            let (tile, second) = (f.u32()? as usize, f.u32()? == 1);
            let Some(Rect { min, max }) = rects.get(tile) else {
                return Err(format!("is damaged: there is no tile {tile}"));
            };
            let window = [min[0], min[1], max[0], max[1]];
            let probe = Film::read(&prefix(tile, second), window, false, from)?;
            probes.insert((tile, second), probe);
        }
        // A half has a probe if it has not met the goal and the other has.
        for (tile, met) in met.iter().enumerate() {
            for (half, second) in [false, true].into_iter().enumerate() {
                if probes.contains_key(&(tile, second)) != (!met[half] && met[1 - half]) {
                    return Err(format!("is damaged: tile {tile} has met its goal in part"));
                }
            }
        }
        Ok(Self {
            goal,
            round,
            met,
            floors: has_floors.then_some(floors),
            probes,
        })
    }
}

/// Where the sections of a probe begin.
fn prefix(tile: usize, second: bool) -> String {
    format!("{tile}.{}/", u8::from(second))
}

/// Renders until no tile's error is above `goal`; true if it came to that, or to the end of the samples.
pub fn run(job: &Job, goal: f64) -> bool {
    let mut worst = f64::INFINITY;
    loop {
        let (pieces, tiles, left) = {
            let mut state = job.state();
            let state = &mut *state;
            let Some(a) = &state.adaptive else {
                return uniform::run(job);
            };
            if nets::nth(2 * a.round + 1).end > job.settings.samples.end {
                return true;
            }
            let left = a.met.iter().filter(|m| **m != [true; 2]).count();
            if left == 0 {
                return true;
            }
            (a.pieces(&mut state.film), a.met.len(), left)
        };
        let finished = AtomicUsize::new(0);
        pieces.par_iter().for_each(|(rect, i, samples, into)| {
            if job.piece(*rect, *i, samples.clone(), *into) {
                finished.fetch_add(1, Ordering::Relaxed);
                let done = if worst.is_finite() {
                    (goal / worst).powi(2)
                } else {
                    0.0
                };
                let known = worst.is_finite().then_some(worst);
                job.report(done.min(1.0 - left as f64 / tiles as f64), known);
            }
        });
        if job.is_stopped() {
            return false;
        }
        let mut state = job.state();
        let state = &mut *state;
        let Some(a) = &mut state.adaptive else {
            continue;
        };
        let (end, error) = a.decide(&mut state.film);
        if a.round == FIRST && state.film.has_splats() {
            state.adaptive = None;
            if let Err(why) = state.film.unite() {
                job.fail(why);
                return false;
            }
            continue;
        }
        worst = error;
        let least = state.film.least_samples();
        job.samples.store(least.into(), Ordering::Relaxed);
        if end {
            return true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checkpoint::{Checkpoint, State};
    use crate::film::Buffer;
    use crate::filter::Filter;
    use resolvent_api::Spectrum;
    use resolvent_api::abi::PixelSample;
    use resolvent_api::rng::{Stream, mix};
    use serde_json::json;

    /// Two tiles, of 16 pixels and of 2.
    const WINDOW: [u32; 4] = [0, 0, 18, 1];
    /// Two tiles, of 256 pixels and of 32.
    const TALL: [u32; 4] = [0, 0, 18, 16];
    const BOX: Filter = Filter::Box(0.5);

    /// Rare bright light on the first tile, calm light on the second.
    fn buffer(seed: u64, rect: Rect, samples: Range<u32>) -> Buffer {
        let mut b = Buffer::new(rect.min, rect.max, samples.clone(), false);
        for y in rect.min[1]..rect.max[1] {
            for x in rect.min[0]..rect.max[0] {
                let place = u64::from(x) << 40 | u64::from(y) << 32 | u64::from(samples.start);
                let mut s = Stream::new(mix(mix(seed).wrapping_add(place)));
                for _ in samples.clone() {
                    let rare = rect.min[0] == 0 && s.uniform() < 0.001;
                    let v = if rare { 300.0 } else { s.uniform() };
                    let sample = PixelSample {
                        radiance: Spectrum::splat(v),
                        ..PixelSample::default()
                    };
                    b.add(x, y, &sample).unwrap();
                }
            }
        }
        b
    }

    /// Mean of the first tile, which is 0.999·0.5 + 0.001·300.
    const MEAN: f64 = 0.7995;

    fn tile_mean(film: &Film) -> f64 {
        let first = film.tiles().next().unwrap();
        let all = first.indices(WINDOW).map(|i| film.estimate(i).mean[0]);
        all.sum::<f64>() / first.pixels() as f64
    }

    /// Renders rounds until no tile is left, through checkpoints if asked.
    fn adaptive(window: [u32; 4], seed: u64, goal: f64, stops: bool) -> (Film, Adaptive) {
        let mut film = Film::in_halves(window, false);
        let mut a = Adaptive::new(goal, film.tiles().len());
        loop {
            let mut pieces = a.pieces(&mut film);
            pieces.reverse();
            for (rect, tile, samples, into) in pieces {
                let b = buffer(seed, rect, samples);
                match into {
                    Into::Film { second } => film.half(second).merge(b, &BOX).unwrap(),
                    Into::Probe { second } => a.probe(tile, second).merge(b, &BOX).unwrap(),
                }
                if stops {
                    let state = State {
                        adaptive: Some(a),
                        ..State::new(film)
                    };
                    let bytes = state.to_bytes(&json!(1), &json!(2));
                    let read = Checkpoint::from_bytes(&bytes).unwrap().state;
                    (film, a) = (read.film, read.adaptive.unwrap());
                }
            }
            if a.decide(&mut film).0 {
                return (film, a);
            }
        }
    }

    /// Samples until the pixels' own variances meet the goal: what must not be done.
    fn naive(seed: u64, goal: f64) -> f64 {
        let mut film = Film::new(WINDOW, false);
        for net in 0.. {
            for rect in film.tiles().take(1) {
                film.merge(buffer(seed, rect, nets::nth(net)), &BOX)
                    .unwrap();
            }
            let error = film.half_error(0, 0.0).map(f64::sqrt);
            if net >= 3 && error.is_some_and(|e| e <= goal) {
                return tile_mean(&film);
            }
        }
        f64::NAN
    }

    fn z(values: impl Iterator<Item = f64>) -> (f64, f64) {
        let all: Vec<f64> = values.collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let variance = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (mean - MEAN) / (variance / n).sqrt())
    }

    /// A mean over many renders is the truth, where stopping by the samples themselves is far from it.
    #[test]
    fn the_mean_is_not_biased() {
        let (n, goal) = (600, 0.7);
        let (mean, ours) = z((0..n).map(|s| tile_mean(&adaptive(WINDOW, s, goal, false).0)));
        assert!(ours.abs() < 3.5, "{mean}, z = {ours}");
        let (mean, theirs) = z((0..n).map(|s| naive(s, goal)));
        assert!(theirs < -6.0, "the test has no power: {mean}, z = {theirs}");
    }

    /// Every tile meets the goal by both halves' estimates, calm ones with the least samples; going through checkpoints after every piece
    /// changes nothing.
    #[test]
    fn tiles_get_what_they_need() {
        let (mut most, mut squares) = (0, 0.0);
        for seed in 0..8 {
            let (film, a) = adaptive(TALL, seed, 0.3, false);
            assert!(a.met.iter().all(|m| *m == [true; 2]) && a.probes.is_empty());
            let samples = [0, 17].map(|i| film.estimate(i).samples);
            assert_eq!(samples[1], 64);
            most = most.max(samples[0]);
            let worst = film.errors().unwrap().worst_tile;
            println!("{seed}: {samples:?} samples, worst tile {worst:.3}");
            squares += worst.powi(2) / 8.0;
            let (again, _) = adaptive(TALL, seed, 0.3, true);
            for i in 0..18 * 16 {
                assert_eq!(film.estimate(i), again.estimate(i));
            }
        }
        assert!(squares.sqrt() < 0.3, "{}", squares.sqrt());
        assert!(most > 500, "{most}");
    }
}
