//! Tests of the film.

use super::*;
use crate::checkpoint::sections::Writer;
use crate::checkpoint::{Checkpoint, State};
use resolvent_api::Spectrum;
use resolvent_api::abi::PixelSample;
use resolvent_api::rng::{Stream, mix};
use serde_json::json;

const BOX: Filter = Filter::Box(0.5);

fn sample(v: f32) -> PixelSample {
    PixelSample {
        radiance: Spectrum::rgb(v, 2.0 * v, -v),
        alpha: 1.0,
        depth: 1.0 + v.abs(),
        albedo: [v.abs(), 0.5, 0.0],
        ..Default::default()
    }
}

/// A film of 20 × 18 pixels, nine tiles, with samples that depend on pixel and number alone; some of them splats.
const WINDOW: [u32; 4] = [3, 4, 23, 22];

fn take(film: &mut Film, samples: Range<u32>, splats: bool) {
    let mut begin = samples.start;
    while begin < samples.end {
        let end = nets::around(begin).end.min(samples.end);
        for t in film.tiles() {
            let mut b = Buffer::new(t.min, t.max, begin..end, true);
            for (x, y) in
                (t.min[1]..t.max[1]).flat_map(|y| (t.min[0]..t.max[0]).map(move |x| (x, y)))
            {
                for i in begin..end {
                    let key = u64::from(x) << 40 | u64::from(y) << 20 | u64::from(i);
                    let mut s = Stream::new(mix(key));
                    b.add(x, y, &sample(s.uniform() * 10.0)).unwrap();
                    if splats {
                        let at = [s.uniform() * 24.0, s.uniform() * 24.0];
                        assert!(b.splats.add(at, Spectrum::splat(s.uniform())));
                    }
                }
            }
            film.merge(b, &Filter::Tent(1.2)).unwrap();
        }
        begin = end;
    }
}

fn film(samples: Range<u32>, splats: bool) -> Film {
    let mut film = Film::new(WINDOW, true);
    take(&mut film, samples, splats);
    film
}

/// All sums, as they stand in a checkpoint.
fn bytes(film: &Film) -> Vec<u8> {
    State::new(film.clone()).to_bytes(&json!(null), &json!(null))
}

/// Mean and variance of nets against the textbook formulas.
#[test]
fn variance_is_that_of_nets() {
    let film = film(0..64, false);
    let at = |i: u32| {
        let (x, y) = (3u64, 4u64);
        let mut s = Stream::new(mix(x << 40 | y << 20 | u64::from(i)));
        f64::from(s.uniform() * 10.0)
    };
    let means: Vec<f64> = (0..4)
        .map(|b| (16 * b..16 * b + 16).map(at).sum::<f64>() / 16.0)
        .collect();
    let mean = means.iter().sum::<f64>() / 4.0;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 3.0 / 4.0;
    let e = film.estimate(0);
    assert!((e.mean[0] - mean).abs() < 1e-12);
    assert!((e.variance.unwrap()[0] / variance - 1.0).abs() < 1e-9);
    assert!((e.variance.unwrap()[1] / (4.0 * variance) - 1.0).abs() < 1e-9);
    assert_eq!((e.samples, e.degrees, e.alpha), (64, [3.0; 3], 1.0));
}

/// Parts in any order, cut anywhere, join to the same bits, variances included.
#[test]
fn parts_join_to_the_whole() {
    let whole = film(0..200, false);
    for cuts in [[0, 16, 64, 200], [0, 7, 77, 200], [0, 65, 66, 200]] {
        let parts: Vec<Film> = cuts.windows(2).map(|w| film(w[0]..w[1], false)).collect();
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
            let mut all = Film::new(WINDOW, true);
            for k in order {
                all.join(&parts[k]).unwrap();
            }
            assert!(
                bytes_but_pieces(&all) == bytes_but_pieces(&whole),
                "{cuts:?} {order:?}"
            );
            for i in [0, 100, 359] {
                assert_eq!(all.estimate(i), whole.estimate(i));
                assert_eq!(all.features(i), whole.features(i));
            }
            assert_eq!(all.interval(), whole.interval());
        }
        // One render in three goes.
        let mut all = Film::new(WINDOW, true);
        cuts.windows(2)
            .for_each(|w| take(&mut all, w[0]..w[1], false));
        assert!(bytes_but_pieces(&all) == bytes_but_pieces(&whole));
    }
}

/// The number of pieces matters for the variance of splats alone.
fn bytes_but_pieces(film: &Film) -> Vec<u8> {
    let mut film = film.clone();
    film.pieces.0 = 0;
    bytes(&film)
}

/// With splats, the picture's bits are the same for any cut, and those of its variance for cuts between nets.
#[test]
fn splats_join_as_well() {
    let whole = film(0..80, true);
    for (cuts, all_bits) in [([0, 16, 64, 80], true), ([0, 20, 50, 80], false)] {
        let mut all = film(cuts[1]..cuts[2], true);
        all.join(&film(cuts[2]..cuts[3], true)).unwrap();
        all.join(&film(cuts[0]..cuts[1], true)).unwrap();
        // Sample 80 cuts a net as well, but in both.
        assert_eq!(bytes(&all) == bytes(&whole), all_bits);
        for i in [0, 33, 359] {
            let (a, b) = (all.estimate(i), whole.estimate(i));
            assert_eq!(a.mean, b.mean);
            let (a, b) = (a.variance.unwrap()[0], b.variance.unwrap()[0]);
            assert!((a / b - 1.0).abs() < 0.3, "{a} {b}");
        }
    }
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let mut a = film(0..40, false);
    let before = bytes(&a);
    let why = a.join(&film(36..64, false)).unwrap_err();
    assert!(why.contains("36..40 of the tile at (3, 4)"), "{why}");
    assert!(a.join(&Film::new([0, 0, 20, 18], true)).is_err());
    assert!(a.join(&Film::new(WINDOW, false)).is_err());
    assert!(a.join(&Film::in_halves(WINDOW, true)).is_err());
    let b = Buffer::new([3, 4], [11, 12], 8..16, true);
    assert!(a.merge(b, &BOX).unwrap_err().contains("8..16"));
    let b = Buffer::new([3, 4], [11, 12], 60..70, true);
    assert!(a.merge(b, &BOX).is_err());
    let b = Buffer::new([4, 4], [19, 20], 48..64, true);
    assert!(a.merge(b, &BOX).is_err());
    assert!(bytes(&a) == before);
}

#[test]
fn bad_samples_are_refused_and_left_out() {
    let mut b = Buffer::new([0, 0], [2, 1], 4..7, false);
    b.add(0, 0, &sample(1.0)).unwrap();
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let why = b.add(0, 0, &sample(bad)).unwrap_err();
        assert!(why.contains("sample 5 of pixel (0, 0)"), "{why}");
    }
    assert!(b.add(2, 0, &sample(1.0)).is_err());
    assert_eq!(b.uneven(), Some(([0, 0], 1)));
}

/// What is read is what was written: halves, parts, splats and all.
#[test]
fn checkpoints_bring_everything_back() {
    for splats in [false, true] {
        let film = film(5..70, splats);
        let written = State::new(film).to_bytes(&json!({"a": 1}), &json!("b"));
        let read = Checkpoint::from_bytes(&written).unwrap();
        assert_eq!(
            (&read.identity, &read.about),
            (&json!({"a": 1}), &json!("b"))
        );
        assert!(read.state.to_bytes(&read.identity, &read.about) == written);
    }
}

/// A checkpoint's samples rise and leave gaps, as they are written. Files with very many ranges take no longer than they are long.
#[test]
fn ranges_are_read_in_order() {
    const COUNT: u32 = 300_000;
    let read = |tiles: &[u8], parts: &[u8]| {
        let mut out = Writer::new(br#"{"window": [0, 0, 1, 1], "halves": 1, "counters": []}"#);
        out.section("pixels", |out| out.resize(out.len() + 136, 0));
        out.section("tiles", |out| out.extend_from_slice(tiles));
        out.section("parts", |out| out.extend_from_slice(parts));
        Checkpoint::from_bytes(&out.finish()).err().unwrap()
    };
    let tiles = |ranges: &mut dyn Iterator<Item = Range<u32>>| {
        let (mut bytes, mut count, mut samples) = (Vec::new(), 0u32, 0u64);
        for r in ranges {
            bytes.extend([r.start.to_le_bytes(), r.end.to_le_bytes()].concat());
            count += 1;
            samples += u64::from(r.end - r.start);
        }
        let pieces = [1u64, samples].map(u64::to_le_bytes).concat();
        [&pieces, &count.to_le_bytes()[..], &bytes, &[0; 120]].concat()
    };
    let start = std::time::Instant::now();
    let falling = tiles(&mut (0..COUNT).rev().map(|i| 8 * i..8 * i + 1));
    let why = read(&falling, &[]);
    assert!(why.contains("cannot have samples"), "{why}");
    for wrong in [
        [4..8, 8..12],
        [4..8, 7..12],
        [4..8, 4..4],
        [4..8, 9..MOST_SAMPLES + 1],
    ] {
        let why = read(&tiles(&mut wrong.iter().cloned()), &[]);
        assert!(why.contains("cannot have samples"), "{wrong:?}: {why}");
    }
    let rising = tiles(&mut (0..COUNT).map(|i| 8 * i..8 * i + 1));
    let why = read(&rising, &[]);
    assert!(
        why.contains("misses its part of the net from sample 0"),
        "{why}"
    );
    let seconds = start.elapsed().as_secs_f64();
    println!("{seconds} s");
    assert!(seconds < 2.0, "{seconds} s");
}

/// What squares cannot carry is unknown, not zero.
#[test]
fn faint_pictures_have_no_error() {
    let with = |exposure: f32, halves: bool| {
        let mut film = match halves {
            true => Film::in_halves(WINDOW, false),
            false => Film::new(WINDOW, false),
        };
        for (rect, number) in film.tiles().flat_map(|r| (0..4).map(move |n| (r, n))) {
            let samples = nets::nth(number);
            let mut b = Buffer::new(rect.min, rect.max, samples.clone(), false);
            for (x, y) in (rect.min[1]..rect.max[1])
                .flat_map(|y| (rect.min[0]..rect.max[0]).map(move |x| (x, y)))
            {
                for i in samples.clone() {
                    let key = u64::from(x) << 40 | u64::from(y) << 20 | u64::from(i);
                    let sample = PixelSample {
                        radiance: Spectrum::splat(exposure * Stream::new(mix(key)).uniform()),
                        ..PixelSample::default()
                    };
                    b.add(x, y, &sample).unwrap();
                }
            }
            film.half(number % 2 == 1).merge(b, &BOX).unwrap();
        }
        film
    };
    let truth = with(1.0, true).errors().unwrap().picture;
    let mut widths = Vec::new();
    for halves in [false, true] {
        // Powers of two, which change no bit but the exponent's: 1.2e-10, 7.3e-12, 5.6e-17 and 4.3e-19.
        for (exponent, faint) in [(-32, false), (-36, true), (-53, true), (-60, true)] {
            let film = with(2f32.powi(exponent), halves);
            assert_eq!(film.is_faint(), faint);
            assert_eq!(film.errors().is_none(), faint);
            let interval = film.interval().unwrap();
            assert!(interval.half_width.iter().all(|h| h.is_nan() == faint));
            assert!(
                film.half_widths()
                    .iter()
                    .flatten()
                    .all(|h| h.is_nan() == faint)
            );
            // The mean is good for much less.
            let mean = 2f64.powi(-exponent) * film.interval().unwrap().mean[0];
            assert!((mean - 0.5).abs() < 0.01, "{mean}");
            if let Some(e) = film.errors() {
                assert!((e.picture / truth - 1.0).abs() < if halves { 1e-3 } else { 0.1 });
                widths.push(interval.half_width[0] / interval.mean[0]);
            }
        }
        // Black is known.
        let black = with(0.0, halves);
        assert!(!black.is_faint());
        assert_eq!(black.errors().unwrap().picture, 0.0);
        assert_eq!(black.interval().unwrap().half_width, [0.0; 3]);
    }
    let bright = with(1.0, true).interval().unwrap();
    let width = bright.half_width[0] / bright.mean[0];
    assert!((widths[1] / width - 1.0).abs() < 1e-3, "{widths:?} {width}");
}
