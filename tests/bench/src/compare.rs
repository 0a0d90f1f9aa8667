//! Regressions against earlier results, with their significance.

use crate::error::{Error, Result};
use crate::fit::log_mean;
use serde_json::{Value, json};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::path::Path;

/// Two-sided probability below which a change is more than chance.
const LEVEL: f64 = 0.01;
/// Changes smaller than this are not worth a word, however certain.
const SMALL: f64 = 0.02;
/// A run that is shorter has no usable time.
const SHORTEST: f64 = 0.05;

/// How a figure changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// New over old.
    pub ratio: f64,
    /// Standard error of its logarithm.
    pub error: f64,
    /// Probability of a change as large if there was none (Welch's t-test of logarithms).
    pub p: f64,
}

impl Change {
    fn of(old: Option<(f64, f64, f64)>, new: Option<(f64, f64, f64)>) -> Option<Self> {
        let ((a, ea, fa), (b, eb, fb)) = (old?, new?);
        let error = ea.hypot(eb);
        let freedom = if error > 0.0 {
            error.powi(4) / (ea.powi(4) / fa + eb.powi(4) / fb)
        } else {
            fa + fb
        };
        let p = if error > 0.0 {
            let t = StudentsT::new(0.0, 1.0, freedom.max(1.0)).ok()?;
            2.0 * t.sf(((b - a) / error).abs())
        } else {
            f64::from(u8::from(a == b))
        };
        Some(Self {
            ratio: (b - a).exp(),
            error,
            p,
        })
    }

    /// Larger or smaller, by more than chance and by an amount that matters.
    pub fn certain(&self) -> bool {
        self.p < LEVEL && self.ratio.ln().abs() > SMALL
    }

    fn json(&self) -> Value {
        json!({"ratio": self.ratio, "log_error": self.error, "p": self.p, "certain": self.certain()})
    }
}

/// Changes of one renderer on one scene.
#[derive(Clone, Debug)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Renderer.
    pub renderer: String,
    /// CPU time of a sample.
    pub time: Option<Change>,
    /// Stated relative variance of a sample.
    pub variance: Option<Change>,
    /// Time × variance: what the same error costs.
    pub cost: Option<Change>,
    /// Largest memory, new over old.
    pub memory: f64,
    /// Time to the first sample, new over old.
    pub load: f64,
}

impl Row {
    /// True if the same error certainly costs more.
    pub fn worse(&self) -> bool {
        self.cost.is_some_and(|c| c.certain() && c.ratio > 1.0)
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let change = |c: &Option<Change>| c.map(|c| c.json());
        json!({
            "scene": self.scene, "renderer": self.renderer,
            "cpu_per_sample": change(&self.time), "variance_per_sample": change(&self.variance),
            "cost_of_same_error": change(&self.cost),
            "memory_ratio": self.memory, "load_ratio": self.load, "worse": self.worse(),
        })
    }
}

/// Reads results.
pub fn read(path: &Path) -> Result<Value> {
    let text = std::fs::read(path).map_err(Error::io(path))?;
    let v: Value = serde_json::from_slice(&text)
        .map_err(|e| Error::invalid(format!("{}: {e}", path.display())))?;
    if v["resolvent_bench"] != 1 {
        return Err(Error::invalid(format!(
            "{}: is not a result of `resolvent bench`",
            path.display()
        )));
    }
    Ok(v)
}

/// What changed from `old` to `new`, for the renderers and scenes that both have.
pub fn compare(old: &Value, new: &Value) -> Vec<Row> {
    let mut out = Vec::new();
    for scene in list(&new["scenes"]) {
        let Some(before) = find(&old["scenes"], "name", &scene["name"]) else {
            continue;
        };
        // Costs of a sample depend on what a pixel covers.
        if before["resolution"] != scene["resolution"] {
            continue;
        }
        for line in list(&scene["renderers"]) {
            let Some(base) = find(&before["renderers"], "renderer", &line["renderer"]) else {
                continue;
            };
            let of = |f: fn(&Value) -> Option<f64>| {
                let values =
                    |l: &Value| log_mean(&list(&l["runs"]).filter_map(f).collect::<Vec<_>>());
                Change::of(values(base), values(line))
            };
            let ratio = |k: &str| match (line["fit"][k].as_f64(), base["fit"][k].as_f64()) {
                (Some(a), Some(b)) if b > 0.0 => a / b,
                _ => f64::NAN,
            };
            out.push(Row {
                scene: scene["name"].as_str().unwrap_or_default().to_owned(),
                renderer: line["renderer"].as_str().unwrap_or_default().to_owned(),
                time: of(time),
                variance: of(variance),
                cost: of(|r| Some(time(r)? * variance(r)?)),
                memory: ratio("memory_bytes"),
                load: ratio("load_seconds"),
            });
        }
    }
    out
}

fn list(v: &Value) -> impl Iterator<Item = &Value> {
    v.as_array().into_iter().flatten()
}

fn find<'a>(all: &'a Value, key: &str, value: &Value) -> Option<&'a Value> {
    list(all).find(|v| v[key] == *value)
}

fn time(run: &Value) -> Option<f64> {
    let cpu = run["cpu_seconds"].as_f64()?;
    (cpu >= SHORTEST).then_some(cpu / run["samples"].as_f64()?)
}

fn variance(run: &Value) -> Option<f64> {
    Some(run["stated_noise"].as_f64()? * run["spp"].as_f64()?)
}

/// As a table in words.
pub fn text(rows: &[Row], old: &Value, new: &Value) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    if old["machine"] != new["machine"] {
        let _ = writeln!(
            out,
            "times are not comparable: {} then, {} now",
            old["machine"], new["machine"]
        );
    }
    let _ = writeln!(
        out,
        "{:14} {:22} {:>20} {:>20} {:>20} {:>7}",
        "scene", "renderer", "CPU a sample", "variance a sample", "cost of an error", "memory"
    );
    let cell = |c: &Option<Change>| {
        c.map_or("-".to_owned(), |c| {
            let mark = if c.certain() { "!" } else { " " };
            format!("x {:.3} ±{:3.0} %{mark}", c.ratio, 100.0 * c.error)
        })
    };
    for r in rows {
        let _ = writeln!(
            out,
            "{:14} {:22} {:>20} {:>20} {:>20} {:>7.2}{}",
            r.scene,
            r.renderer,
            cell(&r.time),
            cell(&r.variance),
            cell(&r.cost),
            r.memory,
            match (r.worse(), &r.cost) {
                (true, Some(c)) => format!("  WORSE (p = {:.1e})", c.p),
                (false, Some(c)) if c.certain() => format!("  better (p = {:.1e})", c.p),
                _ => String::new(),
            }
        );
    }
    let _ = writeln!(
        out,
        "!: more than chance (p < {LEVEL}) and more than {:.0} %",
        100.0 * SMALL
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(cpu: &[f64], noise: f64) -> Value {
        let runs: Vec<_> = cpu
            .iter()
            .enumerate()
            .map(|(k, c)| {
                let spp = 32 << k;
                json!({"cpu_seconds": c * f64::from(spp), "samples": 1000.0 * f64::from(spp), "spp": spp,
                       "stated_noise": noise / f64::from(spp) * (1.0 + 0.01 * k as f64)})
            })
            .collect();
        json!({"machine": "m", "scenes": [{"name": "s", "resolution": [10, 100], "renderers": [
            {"renderer": "r", "runs": runs, "fit": {"memory_bytes": 1e6, "load_seconds": 0.1}}]}]})
    }

    #[test]
    fn slower_is_found_and_noise_is_not() {
        let base = results(&[1.0, 1.01, 0.99, 1.0], 0.1);
        let same = results(&[1.01, 0.99, 1.0, 1.01], 0.1);
        let slow = results(&[1.2, 1.21, 1.19, 1.2], 0.1);
        let noisy = results(&[0.8, 1.3, 0.9, 1.25], 0.1);
        let worse = |new: &Value| compare(&base, new)[0].worse();
        assert!(!worse(&same) && worse(&slow) && !worse(&noisy));
        let row = &compare(&base, &slow)[0];
        assert!((row.time.unwrap().ratio - 1.2).abs() < 0.01);
        assert!((row.variance.unwrap().ratio - 1.0).abs() < 1e-9);
        // Noisier at the same speed costs as much more.
        assert!(worse(&results(&[1.0, 1.01, 0.99, 1.0], 0.15)));
    }

    #[test]
    fn only_what_both_have() {
        let base = results(&[1.0, 1.0], 0.1);
        let mut other = base.clone();
        other["scenes"][0]["resolution"] = json!([20, 50]);
        assert!(compare(&base, &other).is_empty());
        other["scenes"][0]["name"] = json!("t");
        assert!(compare(&base, &other).is_empty());
    }
}
