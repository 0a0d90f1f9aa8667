//! The same samples for every pixel: net after net, all tiles each.

use super::Goal;
use super::job::{Into, Job};
use rayon::prelude::*;
use resolvent_pathspace::nets;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Renders what is missing; true if it came to its goal.
pub fn run(job: &Job) -> bool {
    let range = job.settings.samples.clone();
    let mut begin = range.start;
    let mut error = None;
    while begin < range.end {
        let net = nets::around(begin);
        let end = net.end.min(range.end);
        let pieces: Vec<_> = {
            let state = job.state();
            let missing = |i| state.film.coverage(i).missing(begin..end);
            let tiles = state.film.tiles().enumerate();
            tiles
                .flat_map(|(i, rect)| missing(i).into_iter().map(move |r| (rect, i, r)))
                .collect()
        };
        let finished = AtomicUsize::new(0);
        pieces.par_iter().for_each(|(rect, i, samples)| {
            if !job.piece(*rect, *i, samples.clone(), Into::Film { second: false }) {
                return;
            }
            let part = finished.fetch_add(1, Ordering::Relaxed) + 1;
            let taken = f64::from(begin - range.start)
                + f64::from(end - begin) * part as f64 / pieces.len() as f64;
            job.report(taken / f64::from(range.end - range.start), error);
        });
        if job.is_out_of_time() {
            return true;
        }
        let all = finished.into_inner() == pieces.len() && end == range.end;
        if job.is_stopped() && !all {
            return false;
        }
        begin = end;
        let state = job.state();
        job.samples
            .store(state.film.least_samples().into(), Ordering::Relaxed);
        if pieces.is_empty() && begin < range.end {
            continue;
        }
        let errors = state.film.errors();
        match (job.settings.goal, errors) {
            (Goal::Error(goal), Some(e)) if e.worst_tile <= goal => return true,
            (Goal::Error(_), None) if state.film.is_faint() => {
                job.fail(super::too_faint());
                return false;
            }
            (Goal::Error(_), _) => error = errors.map(|e| e.worst_tile),
            _ => error = errors.map(|e| e.picture),
        }
    }
    true
}
