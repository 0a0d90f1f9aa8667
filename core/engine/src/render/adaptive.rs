//! Samples where the error is: every tile is sampled until its own error is small enough, without a bias.
//!
//! A number of samples that depends on their values biases their mean: a pixel that has not met its rare bright light looks
//! finished (Kirk & Arvo 1991). So the nets of a pixel are dealt to two halves in turn, and *each half's number of samples in the
//! picture is decided by the other half alone*. Given the second half, the number of samples of the first is fixed, and their mean is
//! unbiased; the picture is the mean of both means, with equal weights, since weights by number would tie them again.
//!
//! A half decides after the first net by which it has [`KNOWN`] of the samples that it takes to meet the goal, by its own estimate, and
//! the other half then gets as many as that: its last net may be cut, since what most tiles have too many is wasted, as long as one
//! has just enough. A half that has what the other allows it, but has not decided yet, is sampled further on the side (its
//! *probe*): for the decision, not for the picture. That is rare.
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

/// Share of the samples it takes that a half must have when it decides: fewer know the variance worse, more are often too many.
const KNOWN: f64 = 0.5;

/// Samples of a half in its first `rounds` nets. Nets of a round are of one size.
fn whole(rounds: u32) -> u32 {
    nets::nth(2 * rounds).start / 2
}

/// The samples of the picture that are the first `count` of a half, net by net.
fn samples_of(second: bool, count: u32) -> impl Iterator<Item = Range<u32>> {
    (0..).map_while(move |round| {
        let begin = whole(round);
        let net = nets::nth(2 * round + u32::from(second));
        (begin < count).then(|| net.start..net.end.min(net.start + (count - begin)))
    })
}

/// How far an adaptive render has come, beside its film.
#[derive(Clone, Debug)]
pub struct Adaptive {
    goal: f64,
    /// Rounds that all undecided tiles have done.
    round: u32,
    /// Tile by tile how many samples each half, by its own, has decided that the other shall have.
    decided: Vec<[Option<u32>; 2]>,
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
            decided: vec![[None; 2]; tiles],
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

    /// True if the tile's half goes on beside the picture: it has not decided, and its next net is more than the other allows it.
    fn is_probed(&self, tile: usize, half: usize) -> bool {
        let [own, other] = [half, 1 - half].map(|h| self.decided[tile][h]);
        own.is_none() && other.is_some_and(|most| most < whole(self.round + 1))
    }

    /// Lets halves decide after a round. Returns the largest error of a tile that has not.
    fn decide(&mut self, film: &mut Film) -> f64 {
        self.round += 1;
        let mut worst: f64 = 0.0;
        if self.round < FIRST {
            return f64::INFINITY;
        }
        let floors = *self
            .floors
            .get_or_insert_with(|| [false, true].map(|second| film.half(second).half_floor()));
        let own = whole(self.round);
        for tile in 0..self.decided.len() {
            for (half, floor) in floors.into_iter().enumerate() {
                if self.decided[tile][half].is_some() {
                    continue;
                }
                let second = half == 1;
                let error = match self.probes.get(&(tile, second)) {
                    Some(probe) => probe.half_error(0, floor),
                    None => film.half(second).half_error(tile, floor),
                };
                // The picture's variance is half of that of either half.
                let square = 0.5 * error.unwrap_or(f64::INFINITY);
                let needed = f64::from(own) * square / (self.goal * self.goal);
                if needed * KNOWN <= f64::from(own) {
                    self.decided[tile][half] = Some((needed.ceil() as u32).max(own));
                } else {
                    worst = worst.max(square);
                }
            }
            for half in 0..2 {
                let key = (tile, half == 1);
                if self.is_probed(tile, half) {
                    let goes_on = || film.half(key.1).cut(tile);
                    self.probes.entry(key).or_insert_with(goes_on);
                } else {
                    self.probes.remove(&key);
                }
            }
        }
        worst.sqrt()
    }

    /// Number of tiles that have not decided.
    fn undecided(&self) -> usize {
        let open = |d: &&[Option<u32>; 2]| d.contains(&None);
        self.decided.iter().filter(open).count()
    }

    /// The pieces that are not done yet, of the round and of what has been decided, in at most so many rounds.
    fn pieces(&self, film: &mut Film, most_rounds: u32) -> Vec<(Rect, usize, Range<u32>, Into)> {
        let mut out = Vec::new();
        let round = whole((self.round + 1).min(most_rounds));
        for (i, rect) in film.tiles().enumerate() {
            for (half, second) in [false, true].into_iter().enumerate() {
                let [own, other] = [half, 1 - half].map(|h| self.decided[i][h]);
                // Halves go on together until both have decided.
                let most = other.unwrap_or(u32::MAX).min(whole(most_rounds));
                let count = match (own, other) {
                    (Some(_), Some(_)) => most,
                    _ => most.min(round),
                };
                let have = film.half(second).coverage(i);
                let of_film = samples_of(second, count).flat_map(|r| have.missing(r));
                out.extend(of_film.map(|r| (rect, i, r, Into::Film { second })));
                if let Some(probe) = self.probes.get(&(i, second)) {
                    let have = probe.coverage(0);
                    let of_probe = samples_of(second, round).flat_map(|r| have.missing(r));
                    out.extend(of_probe.map(|r| (rect, i, r, Into::Probe { second })));
                }
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
            // No decision is for 0 samples.
            for n in self.decided.iter().flatten() {
                out.extend_from_slice(&n.unwrap_or(0).to_le_bytes());
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
        let mut number = || f.u32().map(|n| (n > 0).then_some(n));
        let decided = (rects.iter().map(|_| Ok([number()?, number()?])))
            .collect::<Result<Vec<_>, String>>()?;
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
        let out = Self {
            goal,
            round,
            decided,
            floors: has_floors.then_some(floors),
            probes,
        };
        for tile in 0..rects.len() {
            for (half, second) in [false, true].into_iter().enumerate() {
                let probed = has_floors && out.is_probed(tile, half);
                let wrong =
                    out.decided[tile][half].is_some_and(|n| !has_floors || n < whole(FIRST));
                if wrong || out.probes.contains_key(&(tile, second)) != probed {
                    return Err(format!("is damaged: tile {tile} has decided in part"));
                }
            }
        }
        Ok(out)
    }
}

/// Where the sections of a probe begin.
fn prefix(tile: usize, second: bool) -> String {
    format!("{tile}.{}/", u8::from(second))
}

/// Renders until no tile's error is above `goal`; true if it came to that, or to the end of the samples.
pub fn run(job: &Job, goal: f64) -> bool {
    let mut worst = f64::INFINITY;
    let most_rounds = nets::number(job.settings.samples.end) / 2;
    loop {
        let (pieces, tiles, left, is_over) = {
            let mut state = job.state();
            let state = &mut *state;
            let Some(a) = &state.adaptive else {
                return uniform::run(job);
            };
            let pieces = a.pieces(&mut state.film, most_rounds);
            let left = a.undecided();
            (
                pieces,
                a.decided.len(),
                left,
                left == 0 || a.round >= most_rounds,
            )
        };
        if is_over && pieces.is_empty() {
            return true;
        }
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
        if !is_over {
            worst = a.decide(&mut state.film);
        }
        if a.round == FIRST && state.film.has_splats() {
            state.adaptive = None;
            if let Err(why) = state.film.unite() {
                job.fail(why);
                return false;
            }
            continue;
        }
        let least = state.film.least_samples();
        job.samples.store(least.into(), Ordering::Relaxed);
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
    fn adaptive(window: [u32; 4], seed: u64, goal: f64, stops: bool) -> (Film, bool) {
        let mut probed = false;
        let mut film = Film::in_halves(window, false);
        let mut a = Adaptive::new(goal, film.tiles().len());
        loop {
            let mut pieces = a.pieces(&mut film, 1 << 16);
            if a.undecided() == 0 && pieces.is_empty() {
                assert!(a.probes.is_empty());
                return (film, probed);
            }
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
            if a.undecided() > 0 {
                a.decide(&mut film);
            }
            probed |= !a.probes.is_empty();
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
            let (film, _) = adaptive(TALL, seed, 0.3, false);
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

    /// Where halves disagree, on a tile of few pixels, the one that wants more goes on beside the picture, through checkpoints as well.
    #[test]
    fn halves_that_disagree_are_probed() {
        let mut all = 0;
        for seed in 0..60 {
            let (film, probed) = adaptive(WINDOW, seed, 0.7, false);
            if probed {
                all += 1;
                let (again, _) = adaptive(WINDOW, seed, 0.7, true);
                assert!((0..18).all(|i| film.estimate(i) == again.estimate(i)));
            }
        }
        assert!(all > 3, "{all}");
    }
}
