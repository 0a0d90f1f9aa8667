//! Judges all rows of a table together.

use crate::harness::Measured;
use resolvent_tests::ztest::{sidak, z_test};
use statrs::function::gamma::{gamma_lr, gamma_ur};
use std::time::Instant;

/// Family-wise level of each criterion.
const LEVEL: f64 = 1e-3;
/// Relative accuracy of a radiance in `f32` along a path.
const ARITHMETIC: f64 = 2e-6;

/// The rows of a table and what came out.
pub struct Table {
    name: &'static str,
    start: Instant,
    rows: Vec<Row>,
    failures: Vec<String>,
    samples: f64,
    claims: usize,
}

struct Row {
    text: String,
    z: f64,
    p: f64,
    /// Independent of all other rows that say so.
    alone: bool,
}

impl Table {
    /// An empty table.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            start: Instant::now(),
            rows: Vec::new(),
            failures: Vec::new(),
            samples: 0.0,
            claims: 0,
        }
    }

    /// Lanes of one rendering against exact values, with standard errors no larger than `precise`. The first lane given
    /// counts in the χ² test: lanes of a rendering share their paths.
    pub fn row(
        &mut self,
        what: &str,
        m: &Measured,
        lanes: &[(usize, f64)],
        precise: &crate::harness::Precision,
    ) {
        self.samples += m.samples;
        for (k, &(lane, exact)) in lanes.iter().enumerate() {
            let (mean, error) = (m.mean[lane], m.error[lane]);
            let z = z_test(mean, error, exact, ARITHMETIC);
            let text = format!(
                "{what} [{lane}]: {mean:.6e} ± {error:.1e}, exact {exact:.6e}, z = {:.2}",
                z.z
            );
            if !(error <= precise.error[lane]) {
                self.failures.push(format!(
                    "{text}: the standard error is above {:.1e} after {:.1e} samples",
                    precise.error[lane], m.samples
                ));
            }
            self.rows.push(Row {
                text,
                z: z.z,
                p: z.p,
                // Rows without noise say nothing about the size of standard errors.
                alone: k == 0 && error > 10.0 * ARITHMETIC * exact.abs(),
            });
        }
    }

    /// Two renderings of what must look the same, lane by lane.
    pub fn same(&mut self, what: &str, a: &Measured, b: &Measured) {
        self.samples += a.samples + b.samples;
        for lane in 0..3 {
            let error = a.error[lane].hypot(b.error[lane]);
            let z = z_test(a.mean[lane], error, b.mean[lane], ARITHMETIC);
            self.rows.push(Row {
                text: format!(
                    "{what} [{lane}]: {:.6e} and {:.6e} ± {error:.1e}, z = {:.2}",
                    a.mean[lane], b.mean[lane], z.z
                ),
                z: z.z,
                p: z.p,
                alone: false,
            });
        }
    }

    /// Something that must hold.
    pub fn claim(&mut self, holds: bool, what: impl FnOnce() -> String) {
        self.claims += 1;
        if !holds {
            self.failures.push(what());
        }
    }

    /// A value that must be met to `absolute`.
    pub fn near(&mut self, what: &str, value: f64, exact: f64, absolute: f64) {
        self.claim((value - exact).abs() <= absolute, || {
            format!("{what}: {value:.9e}, exact {exact:.9e} ± {absolute:.1e}")
        });
    }

    /// Prints the figures.
    ///
    /// # Panics
    /// If a row or all of them together do not pass.
    #[track_caller]
    pub fn assert(mut self) {
        let level = sidak(LEVEL, self.rows.len());
        // Written so that a NaN fails.
        for r in self.rows.iter().filter(|r| !(r.p > level)) {
            self.failures
                .push(format!("{} (level {level:.1e})", r.text));
        }
        let alone = || self.rows.iter().filter(|r| r.alone);
        let n = alone().count();
        let chi2: f64 = alone().map(|r| r.z * r.z).sum();
        // Too large: means are off. Too small: standard errors are overestimated.
        let (high, low) = if n > 0 && chi2 > 0.0 {
            let (a, x) = (0.5 * n as f64, 0.5 * chi2);
            (gamma_ur(a, x), gamma_lr(a, x))
        } else {
            (1.0, 1.0)
        };
        let worst = self.rows.iter().map(|r| r.z.abs()).fold(0.0, f64::max);
        println!(
            "{}: {} rows and {} claims, {n} independent, {:.2e} samples, worst |z| {worst:.2}, chi2 {chi2:.1}/{n} (p {high:.3}), {:.1} s",
            self.name,
            self.rows.len(),
            self.claims,
            self.samples,
            self.start.elapsed().as_secs_f64()
        );
        crate::report::line(
            "physics.md",
            &format!(
                "| {} | {} | {} | {:.1e} | {worst:.2} | {} |",
                self.name,
                self.rows.len(),
                self.claims,
                self.samples,
                if n > 0 {
                    format!("{chi2:.1} / {n}")
                } else {
                    "–".into()
                }
            ),
        );
        if high < LEVEL {
            self.failures.push(format!(
                "chi2 {chi2:.1} of {n} is too large: p = {high:.1e}"
            ));
        }
        if low < LEVEL {
            self.failures
                .push(format!("chi2 {chi2:.1} of {n} is too small: p = {low:.1e}"));
        }
        let shown = self.failures.len().min(20);
        assert!(
            self.failures.is_empty(),
            "{}: {} findings fail:\n{}",
            self.name,
            self.failures.len(),
            self.failures[..shown].join("\n")
        );
    }
}
