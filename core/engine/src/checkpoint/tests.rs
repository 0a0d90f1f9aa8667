//! Damaged and hostile checkpoints.

use super::sections::{MAGIC, VERSION};
use super::*;
use crate::film::Buffer;
use crate::filter::Filter;
use crate::render::unfinished;
use resolvent_api::Spectrum;
use resolvent_api::abi::PixelSample;
use resolvent_api::rng::Stream;

const WINDOW: [u32; 4] = [0, 0, 18, 5];

/// A checkpoint with everything: features, splats, parts of nets; or halves, parts and probes.
fn sample(adaptive: bool) -> Vec<u8> {
    let state = if adaptive {
        unfinished()
    } else {
        State::new(film())
    };
    state.to_bytes(&json!({"scene": [1, 2]}), &json!({}))
}

fn film() -> Film {
    let mut film = Film::new(WINDOW, true);
    let mut s = Stream::new(1);
    for samples in [0..16, 16..32, 32..40] {
        for rect in film.tiles() {
            let mut b = Buffer::new(rect.min, rect.max, samples.clone(), true);
            for y in rect.min[1]..rect.max[1] {
                for x in rect.min[0]..rect.max[0] {
                    for _ in samples.clone() {
                        let sample = PixelSample {
                            radiance: Spectrum::splat(s.uniform()),
                            depth: 2.0,
                            ..PixelSample::default()
                        };
                        b.add(x, y, &sample).unwrap();
                    }
                }
            }
            b.splats.add([4.0, 3.0], Spectrum::ONE);
            film.merge(b, &Filter::Box(0.5)).unwrap();
        }
    }
    film
}

/// Makes all checksums right that can be found by the lengths in the file.
fn mend(bytes: &mut [u8]) {
    let number = |b: &[u8], at: usize, n: usize| -> Option<usize> {
        let digits = b.get(at..at + n)?;
        Some(
            digits
                .iter()
                .rev()
                .fold(0usize, |v, d| v.wrapping_mul(256).wrapping_add(*d as usize)),
        )
    };
    let put = |b: &mut [u8], from: usize, at: usize| -> Option<()> {
        let sum = crc32fast::hash(b.get(from..at)?);
        b.get_mut(at..at.checked_add(4)?)?
            .copy_from_slice(&sum.to_le_bytes());
        Some(())
    };
    let mut at = 0;
    let mut end = number(bytes, 12, 4).map(|n| 16 + n);
    while let Some(e) = end {
        if put(bytes, at, e).is_none() {
            return;
        }
        at = e + 4;
        end = number(bytes, at + 32, 8).and_then(|n| (at + 40).checked_add(n));
    }
}

/// Whatever is read without an error can be used.
fn use_it(c: &Checkpoint) {
    let film = &c.state.film;
    let [w, h] = film.size();
    for i in 0..(w * h) as usize {
        let _ = (film.estimate(i), film.features(i));
    }
    let _ = (film.errors(), film.interval());
    let _ = c.state.to_bytes(&c.identity, &c.about);
    let Ok(mut other) = Checkpoint::from_bytes(&sample(false)) else {
        return;
    };
    let _ = other.join(c);
}

/// Bytes changed, lost, doubled and swapped, with checksums as they were and with right ones: an error or a checkpoint, never a
/// panic, and no more memory than the file is large.
#[test]
fn damage_is_an_error() {
    let mut s = Stream::new(77);
    let mut below = move |n: usize| ((s.uniform() * n as f32) as usize).min(n - 1);
    for adaptive in [false, true] {
        let good = sample(adaptive);
        use_it(&Checkpoint::from_bytes(&good).unwrap());
        for n in (0..good.len()).step_by(97).chain(0..400) {
            assert!(Checkpoint::from_bytes(&good[..n]).is_err());
        }
        let (mut refused, mut accepted) = (0, 0);
        for round in 0..4000 {
            let mut bad = good.clone();
            for _ in 0..1 + below(3) {
                // Half of the damage hits the first bytes, where lengths and the header are.
                let reach = if below(2) == 0 {
                    bad.len()
                } else {
                    bad.len().min(900)
                };
                let at = below(reach);
                match below(5) {
                    0 => bad[at] ^= 1 << below(8),
                    1 => bad[at] = [0, 0xff, 0x7f, 0x80][below(4)],
                    2 => drop(bad.drain(at..(at + 1 + below(60)).min(bad.len()))),
                    3 => {
                        let piece = bad[at..(at + 60).min(bad.len())].to_vec();
                        bad.splice(at..at, piece);
                    }
                    _ => {
                        let end = (at + 8).min(bad.len());
                        bad[at..end].fill(if below(2) == 0 { 0 } else { 0xff });
                    }
                }
            }
            let mended = round % 4 != 0;
            if mended {
                mend(&mut bad);
            } else if bad == good {
                continue;
            }
            match Checkpoint::from_bytes(&bad) {
                Ok(c) => {
                    assert!(mended, "a wrong checksum passed");
                    use_it(&c);
                    accepted += 1;
                }
                Err(why) => {
                    assert!(!why.is_empty());
                    refused += 1;
                }
            }
        }
        // Sums may be anything; what has a meaning is checked.
        assert!(refused > 2000 && accepted > 100, "{refused} {accepted}");
    }
}

#[test]
fn what_is_foreign_is_told_apart() {
    let why = |bytes: &[u8]| Checkpoint::from_bytes(bytes).err().unwrap();
    assert!(why(b"\x76\x2f\x31\x01 an image").contains("no checkpoint"));
    let endless = Checkpoint::read("/dev/zero".as_ref()).err().unwrap();
    assert!(endless.to_string().contains("regular"), "{endless}");
    let mut newer = sample(false);
    newer[8] = VERSION as u8 + 1;
    assert!(why(&newer).contains(&format!("version {VERSION}")));
    assert_eq!(newer[..8], MAGIC);
    // Sums that this program does not know would be lost.
    let mut out = sections::Writer::new(b"{\"window\": [0, 0, 1, 1], \"halves\": 1}");
    Film::new([0, 0, 1, 1], false).write("", &mut out);
    out.section("depths", |out| out.push(1));
    let text = why(&out.finish());
    assert!(
        text.contains("'depths'") && text.contains("use the program"),
        "{text}"
    );
}
