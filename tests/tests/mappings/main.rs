//! Properties of every mapping, on random inputs (proptest): inverses, frames, transforms, offsets; and `f64` twins of
//! kernels whose rounding matters.
//!
//! `RESOLVENT_RAYS=100000000` traces that many rays instead of a few hundred thousand, `RESOLVENT_FULL=1` tries a hundred times
//! as many inputs.

mod frames;
mod rays;
mod twins;
mod warps;

use proptest::test_runner::Config;

/// How many inputs are tried; the sequence is the same in every run.
pub fn cases(few: u32) -> Config {
    let all = std::env::var_os("RESOLVENT_FULL").is_some_and(|v| v == "1");
    Config {
        cases: if all { 100 * few } else { few },
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(0x5e_ed),
        ..Config::default()
    }
}
