//! A fuzzer that needs no other tools: mutants of the test files, read in every way, watched for
//! panics, hangs and memory that the file's size does not justify.
//!
//! ```text
//! cargo run --release -p resolvent-vdb --example fuzz -- [--seconds N] [--seed N] [--out FOLDER]
//! cargo run --release -p resolvent-vdb --example fuzz -- --replay FILE
//! ```
//! A mutant that misbehaves is written to the folder (the current one if none is given).

#[path = "../tests/suite/hostile.rs"]
mod hostile;
#[path = "../tests/suite/memory.rs"]
mod memory;
#[path = "../tests/suite/mutate.rs"]
mod mutate;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use hostile::{Outcome, allowance, read_everything};
use mutate::{Random, mutate, seeds};

#[global_allocator]
static ALLOCATOR: memory::Counting = memory::Counting;

/// The mutant being read and when that began, for the watchdog.
static CURRENT: Mutex<Option<(Vec<u8>, Instant)>> = Mutex::new(None);

const HANG: Duration = Duration::from_secs(10);

fn main() -> ExitCode {
    let (mut seconds, mut seed, mut out) = (60, 1, PathBuf::from("."));
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().unwrap_or_default();
        match argument.as_str() {
            "--seconds" => seconds = value.parse().expect("--seconds takes a number"),
            "--seed" => seed = value.parse().expect("--seed takes a number"),
            "--out" => out = value.into(),
            "--replay" => {
                let bytes = std::fs::read(&value).expect("the file can be read");
                println!(
                    "{:?}, {} bytes held",
                    read_everything(&bytes),
                    memory::peak()
                );
                return ExitCode::SUCCESS;
            }
            other => panic!("unknown option {other}"),
        }
    }
    watch(out.clone());
    std::panic::set_hook(Box::new(|_| {}));
    let seeds = seeds();
    let mut random = Random(seed);
    let (mut runs, mut read, mut bad) = (0_u64, 0_u64, 0_u64);
    let (mut slowest, mut greediest) = (Duration::ZERO, 0.0_f64);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(seconds) {
        let (from, bytes) = mutate(&seeds, &mut random);
        let begin = Instant::now();
        *CURRENT.lock().unwrap() = Some((bytes.clone(), begin));
        let outcome = read_everything(&bytes);
        let took = begin.elapsed();
        *CURRENT.lock().unwrap() = None;
        greediest = greediest.max(memory::peak() as f64 / allowance(bytes.len()) as f64);
        slowest = slowest.max(took);
        runs += 1;
        match outcome {
            Ok(Outcome::Read) => read += 1,
            Ok(Outcome::Refused) => {}
            Err(what) => {
                bad += 1;
                let path = out.join(format!("bad-{seed}-{runs}.vdb"));
                let saved = std::fs::write(&path, &bytes);
                println!(
                    "{} (from {}): {what} {saved:?}",
                    path.display(),
                    seeds[from].name
                );
            }
        }
    }
    println!(
        "{runs} mutants in {seconds} s: {read} read, {} refused, {bad} bad; slowest {slowest:?}, memory at most {:.0} % of the allowance",
        runs - read - bad,
        100.0 * greediest
    );
    if bad == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn watch(out: PathBuf) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let current = CURRENT.lock().unwrap();
            if let Some((bytes, begin)) = &*current
                && begin.elapsed() > HANG
            {
                let path = out.join("hang.vdb");
                println!(
                    "hang: {} {:?}",
                    path.display(),
                    std::fs::write(&path, bytes)
                );
                std::process::exit(2);
            }
        }
    });
}
