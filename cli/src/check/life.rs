//! The life of instances: alike, independent of each other, used from many threads, and gone without a trace.

use super::Stages;
use super::integrators;
use super::media::segments;
use super::raw::{Failures, RawMedium};
use super::scatterers::closure;
use super::subject::Subject;
use crate::failure::{Outcome, input};
use resolvent_api::rng::Stream;
use resolvent_api::{Medium, Mode, PluginKind, Scatter, ScatterDraws, Spectrum};
use resolvent_conformance::scatter::directions;
use resolvent_conformance::{Suite, medium, property};
use resolvent_engine::plugin::Instance;
use std::sync::Barrier;
use std::time::{Duration, Instant};

/// Threads that share an instance.
const THREADS: usize = 8;
/// Time for which they do.
const TOGETHER: Duration = Duration::from_millis(50);
/// Instances made and ended between two looks at the memory.
const ROUND: usize = 512;
/// Time a round may take.
const PATIENCE: Duration = Duration::from_secs(2);
/// What the allocator's own caches may change in a round, bytes.
const CACHES: f64 = 8192.0;
/// Rounds at the most. A leak shows in every one of them.
const ROUNDS: usize = 8;

/// All of it, with the parameters every instance is made with.
pub fn check(suite: &mut Suite, subject: &Subject, stages: Stages) -> Outcome<()> {
    let make = || subject.make(&subject.base).map_err(input);
    // This one is asked by many threads first: what it prepares at its first question, it prepares then.
    let (first, second, fresh) = (make()?, make()?, make()?);

    stages(property::DETERMINISM, "two instances");
    suite.about(property::DETERMINISM);
    let truth = fingerprint(subject, &first, false);
    suite.claim(!truth.is_empty(), || "it gives no answers at all".into());
    let same = |suite: &mut Suite, what: &str, other: &[u32]| {
        let at = truth.iter().zip(other).position(|(a, b)| a != b);
        suite.claim(at.is_none() && truth.len() == other.len(), || {
            format!(
                "{what}: answer {} of {} differs",
                at.unwrap_or(0),
                truth.len()
            )
        });
    };
    same(suite, "asked again", &fingerprint(subject, &first, false));
    same(
        suite,
        "asked in reverse order",
        &fingerprint(subject, &first, true),
    );
    same(
        suite,
        "another instance",
        &fingerprint(subject, &second, false),
    );

    stages(property::THREADS, "one instance from eight threads");
    suite.about(property::THREADS);
    let start = Barrier::new(THREADS);
    let answers: Vec<Vec<u32>> = std::thread::scope(|scope| {
        let (start, fresh, truth) = (&start, &fresh, &truth);
        let ask = move |i: usize| {
            start.wait();
            let begun = Instant::now();
            loop {
                let answers = fingerprint(subject, fresh, i % 2 == 1);
                // Long enough for threads to meet, even where there are fewer processors.
                if answers != *truth || begun.elapsed() > TOGETHER {
                    return answers;
                }
            }
        };
        let workers: Vec<_> = (0..THREADS).map(|i| scope.spawn(move || ask(i))).collect();
        let answers = workers.into_iter().map(|w| w.join().unwrap_or_default());
        answers.collect()
    });
    drop(fresh);
    for (i, a) in answers.iter().enumerate() {
        let what = format!("thread {i} of {THREADS} that share an instance");
        same(suite, &what, a);
    }
    stages(
        property::THREADS,
        "instances made and ended by eight threads",
    );
    let answers: Vec<Option<Vec<u32>>> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..THREADS)
            .map(|_| {
                scope.spawn(|| {
                    let own = subject.make(&subject.base).ok()?;
                    Some(fingerprint(subject, &own, false))
                })
            })
            .collect();
        workers
            .into_iter()
            .map(|w| w.join().ok().flatten())
            .collect()
    });
    for (i, a) in answers.iter().enumerate() {
        suite.claim(a.is_some(), || {
            format!("thread {i} could make no instance of its own")
        });
        same(
            suite,
            &format!("the instance of thread {i}"),
            a.as_deref().unwrap_or_default(),
        );
    }

    stages(property::INSTANCES, "one is ended, the other goes on");
    suite.about(property::INSTANCES);
    drop(first);
    same(
        suite,
        "after another instance has ended",
        &fingerprint(subject, &second, false),
    );
    let third = make()?;
    drop(second);
    same(
        suite,
        "made while others end",
        &fingerprint(subject, &third, false),
    );
    drop(third);
    stages(property::INSTANCES, "memory");
    leaks(suite, subject)
}

/// Memory that stays when instances have ended. What a plugin keeps once, for all instances, is no leak.
fn leaks(suite: &mut Suite, subject: &Subject) -> Outcome<()> {
    let round = || -> Outcome<usize> {
        let start = Instant::now();
        for i in 0..ROUND {
            let instance = subject.make(&subject.base).map_err(input)?;
            if i == 0 {
                fingerprint(subject, &instance, false);
            }
            drop(instance);
            if start.elapsed() > PATIENCE {
                return Ok(i + 1);
            }
        }
        Ok(ROUND)
    };
    round()?;
    let (mut least, mut threshold) = (f64::INFINITY, 0.0);
    for _ in 0..ROUNDS {
        let Some(before) = memory_in_use() else {
            return Ok(());
        };
        let made = round()?;
        let after = memory_in_use().unwrap_or(before);
        least = least.min((after as f64 - before as f64).max(0.0) / made as f64);
        threshold = CACHES / made as f64;
        if least <= threshold {
            break;
        }
    }
    suite.at_most(least, threshold, || {
        format!("every instance leaves {least:.1} bytes behind")
    });
    Ok(())
}

/// Bytes that the process has allocated and not freed; `None` where the system does not say.
fn memory_in_use() -> Option<usize> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: it takes no arguments and only reads the allocator's counts.
        let m = unsafe { libc::mallinfo2() };
        Some(m.uordblks + m.hblkhd)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    None
}

/// Answers of an instance to some hundred questions, bit by bit, asked from the first to the last or the other way round.
fn fingerprint(subject: &Subject, instance: &Instance, backwards: bool) -> Vec<u32> {
    let failures = Failures::default();
    let mut order: Vec<usize> = (0..400).collect();
    if backwards {
        order.reverse();
    }
    let mut answers: Vec<(usize, Vec<u32>)> = match instance.plugin.kind {
        PluginKind::Medium => {
            let m = RawMedium::new(instance, &failures);
            let ways = segments(&m);
            let ask = |i: usize| {
                let (s, u) = (&ways[i % ways.len()], medium::draws(21, i, Spectrum::ONE));
                let (a, b) = (m.sample(s, &u), m.transmit(s, &u));
                let mut out = words(&[a, b]);
                out.extend(words(&[
                    m.depth(s),
                    m.coefficients(s.at(a.t.min(1e6))).sigma_t,
                ]));
                out
            };
            order.into_iter().map(|i| (i, ask(i))).collect()
        }
        PluginKind::Integrator => return integrators::fingerprint(subject, 1),
        _ => {
            let k = closure(instance, 0, &failures);
            let ways = directions(401, 0xf19e);
            let ask = |i: usize| {
                let mut stream = Stream::new(i as u64);
                let u = ScatterDraws {
                    lobe: stream.uniform(),
                    dir: stream.uniform2(),
                };
                let e = k.eval(ways[i], ways[i + 1], Mode::Radiance);
                let s = k.sample(ways[i], u, Mode::Importance).unwrap_or_default();
                let mut out = words(&[e]);
                out.extend(words(&[s]));
                out
            };
            order.into_iter().map(|i| (i, ask(i))).collect()
        }
    };
    answers.sort_by_key(|(i, _)| *i);
    answers.into_iter().flat_map(|(_, a)| a).collect()
}

fn words<T: bytemuck::NoUninit>(values: &[T]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(values)
}
