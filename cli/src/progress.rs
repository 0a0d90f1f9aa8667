//! How far the rendering is: a bar on a terminal, lines elsewhere.

use crate::console;
use indicatif::{ProgressBar, ProgressStyle};
use resolvent_engine::{Goal, Progress};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};

/// Steps of the bar.
const STEPS: u64 = 1000;
/// Milliseconds between updates of the bar.
const BAR_INTERVAL: u64 = 100;
/// Milliseconds between lines where there is no bar.
const LINE_INTERVAL: u64 = 5000;

/// Shows progress.
pub struct Display {
    goal: Goal,
    /// Samples per pixel to be taken.
    samples: u32,
    bar: Option<ProgressBar>,
    /// When to show something next, milliseconds since the start.
    next: AtomicU64,
}

impl Display {
    /// Shows a bar if standard error is a terminal, lines otherwise, nothing if quiet.
    pub fn new(goal: Goal, samples: u32) -> Self {
        let bar = (std::io::stderr().is_terminal() && !console::is_quiet()).then(|| {
            let bar = ProgressBar::new(STEPS);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
                bar.set_style(style);
            }
            bar
        });
        console::set_bar(bar.clone());
        let next = if bar.is_some() { 0 } else { LINE_INTERVAL };
        Self {
            goal,
            samples,
            bar,
            next: AtomicU64::new(next),
        }
    }

    /// Takes a report; called from many threads, it shows few of them.
    pub fn report(&self, p: Progress) {
        if console::is_quiet() {
            return;
        }
        let now = p.elapsed.as_millis() as u64;
        let next = self.next.load(Ordering::Relaxed);
        let interval = if self.bar.is_some() {
            BAR_INTERVAL
        } else {
            LINE_INTERVAL
        };
        if now < next
            || self
                .next
                .compare_exchange(next, now + interval, Ordering::Relaxed, Ordering::Relaxed)
                .is_err()
        {
            return;
        }
        let done = self.done(&p);
        let samples = match self.goal {
            // Passes are long: what is taken of the one in progress counts too.
            Goal::Samples => (p.done * f64::from(self.samples)) as u32,
            _ => p.samples,
        };
        let left = remaining(done, p.elapsed.as_secs_f64());
        let text = describe(samples, p.error, left);
        match &self.bar {
            Some(bar) => {
                bar.set_position((done * STEPS as f64) as u64);
                bar.set_message(text);
            }
            None => console::line(&format!("{:.0} %  {text}", 100.0 * done)),
        }
    }

    /// The share of the work that is done. Errors fall with the square root of the samples.
    fn done(&self, p: &Progress) -> f64 {
        match (self.goal, p.error) {
            (Goal::Error(goal), Some(e)) if e > 0.0 => (goal / e).powi(2).max(p.done).min(1.0),
            _ => p.done,
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        console::set_bar(None);
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Seconds left, once enough is done to tell.
fn remaining(done: f64, elapsed: f64) -> Option<f64> {
    (done > 0.002).then(|| elapsed * (1.0 - done) / done)
}

fn describe(samples: u32, error: Option<f64>, left: Option<f64>) -> String {
    let mut text = format!("{samples} spp");
    if let Some(e) = error {
        text += &format!(", error {}", percent(e));
    }
    if let Some(left) = left {
        text += &format!(", {} left", duration(left));
    }
    text
}

/// A relative error for people.
pub fn percent(e: f64) -> String {
    format!(
        "{:.*} %",
        if e < 0.1 { 2 } else { 1 },
        (100.0 * e).min(9999.0)
    )
}

/// Seconds for people.
pub fn duration(seconds: f64) -> String {
    if seconds < 9.95 {
        return format!("{seconds:.1} s");
    }
    let s = seconds.round() as u64;
    match s {
        0..=119 => format!("{s} s"),
        120..=7199 => format!("{} min {} s", s / 60, s % 60),
        _ => format!("{} h {} min", s / 3600, s % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_shares() {
        assert_eq!(duration(3.21), "3.2 s");
        assert_eq!(duration(9.99), "10 s");
        assert_eq!(duration(150.2), "2 min 30 s");
        assert_eq!(duration(7323.0), "2 h 2 min");
        assert_eq!(percent(0.0123), "1.23 %");
        assert_eq!(percent(0.5), "50.0 %");
        assert_eq!(remaining(0.25, 10.0), Some(30.0));
        assert_eq!(remaining(0.0, 10.0), None);
    }
}
