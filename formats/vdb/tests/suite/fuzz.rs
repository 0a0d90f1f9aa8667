//! A short run of the fuzzer (the long one is `examples/fuzz.rs`), and files made to cost much.

use std::time::{Duration, Instant};

use crate::hostile::{Outcome, allowance, read_everything};
use crate::memory;
use crate::mutate::{Random, mutate, seeds};

#[test]
fn mutants_end_well() {
    let seeds = seeds();
    assert!(seeds.len() > 180);
    let mut random = Random(0x5eed);
    let (mut read, mut refused) = (0, 0);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(3) {
        let (seed, bytes) = mutate(&seeds, &mut random);
        let begin = Instant::now();
        match read_everything(&bytes) {
            Ok(Outcome::Read) => read += 1,
            Ok(Outcome::Refused) => refused += 1,
            Err(what) => panic!(
                "a mutant of {} (number {}): {what}",
                seeds[seed].name,
                read + refused
            ),
        }
        assert!(
            begin.elapsed() < Duration::from_secs(5),
            "a mutant of {} hangs",
            seeds[seed].name
        );
    }
    // The mutations neither break everything at once nor spare everything.
    assert!(read > 20 && refused > 20, "{read} read, {refused} refused");
}

#[test]
fn every_cut_is_refused_or_read_within_its_means() {
    for name in [
        "seed_blosc",
        "seed_zip",
        "stream_multi_bloscmask",
        "version_221_zip",
        "version_222_blosc_multi",
    ] {
        let seeds = seeds();
        let seed = seeds
            .iter()
            .find(|seed| seed.name.starts_with(name))
            .unwrap();
        for length in (0..seed.bytes.len()).step_by(if seed.bytes.len() > 20_000 { 37 } else { 7 })
        {
            let outcome = read_everything(&seed.bytes[..length])
                .unwrap_or_else(|what| panic!("{name} cut at {length}: {what}"));
            assert_eq!(outcome, Outcome::Refused, "{name} cut at {length} was read");
        }
    }
}

/// A small file may not make the reader ask for megabytes, whatever it claims.
#[test]
fn lies_about_sizes_cost_nothing() {
    let seeds = seeds();
    let seed = &seeds
        .iter()
        .find(|seed| seed.name == "seed_blosc.vdb")
        .unwrap()
        .bytes;
    for length in [20, 57, 61, 65, 100, 120, 200, 400, 600, 700] {
        for at in (0..length).step_by(4) {
            for word in [u32::MAX, i32::MAX as u32, 0x1000_0000, 0x10_0000] {
                let mut bytes = seed[..length].to_vec();
                let end = (at + 4).min(length);
                bytes[at..end].copy_from_slice(&word.to_le_bytes()[..end - at]);
                read_everything(&bytes).unwrap();
                assert!(
                    memory::peak() < 64 << 10,
                    "{} bytes for a file of {length}",
                    memory::peak()
                );
            }
        }
    }
}

/// The sound files stay below the same bound, most of them far below.
#[test]
fn sound_files_stay_within_their_means() {
    for seed in seeds() {
        read_everything(&seed.bytes).unwrap_or_else(|what| panic!("{}: {what}", seed.name));
        assert!(
            memory::peak() <= allowance(seed.bytes.len()),
            "{}",
            seed.name
        );
    }
}
