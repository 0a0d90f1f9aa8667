//! Unbiased, as good as asked, and the same through checkpoints.

use super::*;
use crate::checkpoint::{Checkpoint, State};
use crate::film::Buffer;
use crate::filter::Filter;
use resolvent_api::Spectrum;
use resolvent_api::abi::PixelSample;
use resolvent_api::rng::{Stream, mix};
use serde_json::json;

/// Tiles of 8, 8 and 2 pixels.
const WINDOW: [u32; 4] = [0, 0, 18, 1];
/// Two rows of tiles of 64, 64 and 16 pixels.
const TALL: [u32; 4] = [0, 0, 18, 16];
const BOX: Filter = Filter::Box(0.5);

/// Rare bright light on the first tiles, calm light on the others; of the halves' seeds.
fn buffer(seeds: [u64; 2], rect: Rect, samples: Range<u32>) -> Buffer {
    let mut b = Buffer::new(rect.min, rect.max, samples.clone(), false);
    let seed = seeds[nets::number(samples.start) as usize % 2];
    for y in rect.min[1]..rect.max[1] {
        for x in rect.min[0]..rect.max[0] {
            let pixel = mix(mix(seed).wrapping_add(u64::from(x) << 32 | u64::from(y)));
            for sample in samples.clone() {
                let mut s = Stream::new(mix(pixel.wrapping_add(u64::from(sample))));
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

/// A render that begins.
fn begin(window: [u32; 4], goal: f64) -> State {
    let film = Film::in_halves(window, false);
    let adaptive = Adaptive::new(goal, film.tiles().len());
    State {
        adaptive: Some(adaptive),
        ..State::new(film)
    }
}

/// Does a round and decides, through checkpoints after every piece if asked.
fn round(mut state: State, seeds: [u64; 2], stops: bool) -> State {
    let mut pieces = state.adaptive.as_mut().unwrap().pieces(&mut state.film);
    pieces.reverse();
    for (rect, tile, samples, into) in pieces {
        let b = buffer(seeds, rect, samples);
        let (film, a) = (&mut state.film, state.adaptive.as_mut().unwrap());
        match into {
            Into::Film { second } => film.half(second).merge(b, &BOX).unwrap(),
            Into::Probe { second } => a.probe(tile, second).merge(b, &BOX).unwrap(),
        }
        if stops {
            let bytes = state.to_bytes(&json!(1), &json!(2));
            state = Checkpoint::from_bytes(&bytes).unwrap().state;
        }
    }
    state.adaptive.as_mut().unwrap().decide(&mut state.film);
    state
}

/// Renders rounds until no tile is left.
fn adaptive(window: [u32; 4], seeds: [u64; 2], goal: f64, stops: bool) -> (Film, Adaptive) {
    let mut state = begin(window, goal);
    while state.adaptive.as_ref().unwrap().left() > 0 {
        state = round(state, seeds, stops);
    }
    (state.film, state.adaptive.unwrap())
}

/// A render of 18 × 5 pixels that is not finished, with cut nets and probes.
pub(crate) fn unfinished() -> State {
    let has_all = |s: &State| {
        let a = s.adaptive.as_ref().unwrap();
        let last = |i| s.film.coverage(i).ranges().last().unwrap().end;
        let cut = |i| nets::around(last(i) - 1).end != last(i);
        !a.probes.is_empty() && (0..a.counts.len()).any(cut)
    };
    for seed in 0..1000 {
        let mut state = begin([0, 0, 18, 5], 0.5);
        while state.adaptive.as_ref().unwrap().left() > 0 {
            state = round(state, [seed; 2], false);
            if has_all(&state) {
                return state;
            }
        }
    }
    panic!("no probe in 1000 renders");
}

/// A half whose own values decide its number of samples: what must not be done.
fn naive(seed: u64, goal: f64) -> f64 {
    let mut film = Film::new(WINDOW, false);
    let rect = film.tiles().next().unwrap();
    let mut end = None;
    for round in 0.. {
        let (net, before) = (nets::nth(2 * round), after(round));
        let left = end.map_or(u32::MAX, |n: u32| n.saturating_sub(before));
        let part = net.start..net.end.min(net.start.saturating_add(left));
        if part.is_empty() {
            break;
        }
        film.merge(buffer([seed; 2], rect, part), &BOX).unwrap();
        if round + 1 >= FIRST && end.is_none() {
            let samples = after(round + 1);
            let needed = needed(goal, samples, film.half_error(0, 0.0));
            end = count(samples, needed);
        }
    }
    tile_mean(&film)
}

fn z(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let all: Vec<f64> = values.collect();
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let variance = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (mean - MEAN) / (variance / n).sqrt())
}

/// A mean over many renders is the truth, where numbers of samples decided by themselves are far from it.
#[test]
fn the_mean_is_not_biased() {
    let (n, goal) = (600, 0.7);
    let (mean, ours) = z((0..n).map(|s| tile_mean(&adaptive(WINDOW, [s; 2], goal, false).0)));
    println!("{mean}, z = {ours}");
    assert!(ours.abs() < 3.5, "{mean}, z = {ours}");
    let (mean, theirs) = z((0..n).map(|s| naive(s, goal)));
    println!("{mean}, z = {theirs}");
    assert!(theirs < -6.0, "the test has no power: {mean}, z = {theirs}");
}

/// Whatever a half's own values are, it has the same number of samples.
#[test]
fn no_half_decides_for_itself() {
    let all: Vec<_> = (0..40)
        .map(|s| adaptive(TALL, [s + 1000, 7], 0.3, false))
        .collect();
    let counts = |(_, a): &(_, Adaptive), half| [0, 1].map(|tile| a.counts[tile][half]);
    let mut others = std::collections::BTreeSet::new();
    for render in &all {
        assert_eq!(counts(render, 0), counts(&all[0], 0));
        others.insert(counts(render, 1));
        for (half, film) in render.0.halves().enumerate() {
            for (tile, count) in counts(render, half).into_iter().enumerate() {
                assert_eq!(Some(film.coverage(tile).samples()), count);
            }
        }
    }
    println!("{:?}, others {others:?}", counts(&all[0], 0));
    assert!(others.len() > 5, "{others:?}");
}

/// Every tile meets the goal by both halves' estimates, calm ones with the least samples; going through checkpoints after every piece
/// changes nothing.
#[test]
fn tiles_get_what_they_need() {
    let (mut most, mut squares) = (0, 0.0);
    for seed in 0..8 {
        let (film, a) = adaptive(TALL, [seed; 2], 0.3, false);
        assert!(a.probes.is_empty());
        let samples = [0, 17].map(|i| film.estimate(i).samples);
        assert_eq!(samples[1], 2 * after(FIRST));
        most = most.max(samples[0]);
        let worst = film.errors().unwrap().worst_tile;
        println!("{seed}: {samples:?} samples, worst tile {worst:.3}");
        squares += worst.powi(2) / 8.0;
        let (again, _) = adaptive(TALL, [seed; 2], 0.3, true);
        for i in 0..18 * 16 {
            assert_eq!(film.estimate(i), again.estimate(i));
        }
    }
    println!("{}", squares.sqrt());
    assert!(squares.sqrt() < 0.3, "{}", squares.sqrt());
    assert!(most > 500, "{most}");
}

/// Layers that only one half has, or that a probe has, would be lost or worse.
#[test]
fn layers_must_agree() {
    let why = |state: &State| {
        let bytes = state.to_bytes(&json!(1), &json!(2));
        Checkpoint::from_bytes(&bytes).err()
    };
    let mut state = begin(TALL, 0.3);
    state.film = state.film.with_orders(4);
    assert_eq!(why(&state), None);
    for other in [0, 2, 9] {
        let twin = Film::new(TALL, false).with_orders(other);
        state.film.set_twin(twin);
        let text = why(&state).unwrap();
        assert!(text.contains("halves differ"), "{text}");
    }
    let mut state = unfinished();
    assert_eq!(why(&state), None);
    for probe in state.adaptive.as_mut().unwrap().probes.values_mut() {
        *probe = probe.clone().with_orders(2);
    }
    let text = why(&state).unwrap();
    assert!(text.contains("has layers"), "{text}");
}
