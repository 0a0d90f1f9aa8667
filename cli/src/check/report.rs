//! What was found, for people and for programs.

use resolvent_conformance::{Failure, Verdict};
use serde_json::{Value, json};

/// Failures printed of each property.
const SHOWN: usize = 3;

/// The outcome of a check.
pub struct Report {
    /// Kind, name and library.
    pub title: String,
    /// The plugin's version.
    pub version: String,
    /// Sets of parameters that were checked in full.
    pub variants: Vec<String>,
    /// Values that the plugin did not accept, and its reason: no fault, but worth knowing.
    pub refused: Vec<(String, String)>,
    /// Property by property.
    pub verdicts: Vec<Verdict>,
}

impl Report {
    /// Names of the properties that don't hold.
    pub fn broken(&self) -> impl Iterator<Item = &str> {
        let failed = self.verdicts.iter().filter(|v| v.failed > 0);
        failed.map(|v| v.property)
    }

    /// For people.
    pub fn print(&self) {
        println!("{} {}", self.title, self.version);
        if !self.variants.is_empty() {
            println!("checked in full with: {}", self.variants.join("; "));
        } else {
            println!("checked in brief, without statistics");
        }
        for (reason, values) in self.refused_by_reason() {
            println!("refused: {}: {reason}", values.join(", "));
        }
        for v in &self.verdicts {
            if v.failed == 0 {
                println!("  ok      {:<14} {} findings", v.property, v.findings);
                continue;
            }
            println!(
                "  FAILED  {:<14} {} of {} findings",
                v.property, v.failed, v.findings
            );
            for f in v.failures.iter().take(SHOWN) {
                println!("            {}", f.what);
                if let Some(figure) = against(f) {
                    println!("            {figure}");
                }
            }
        }
    }

    /// Values that were refused, by the plugin's reason.
    fn refused_by_reason(&self) -> Vec<(&str, Vec<&str>)> {
        let mut out: Vec<(&str, Vec<&str>)> = Vec::new();
        for (value, reason) in &self.refused {
            match out.iter_mut().find(|(r, _)| r == reason) {
                Some((_, values)) => values.push(value),
                None => out.push((reason, vec![value])),
            }
        }
        out
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        json!({
            "plugin": self.title,
            "version": self.version,
            "conforms": self.broken().next().is_none(),
            "checked": self.variants,
            "refused": self.refused.iter().map(|(value, reason)| json!([value, reason])).collect::<Vec<_>>(),
            "properties": self.verdicts.iter().map(|v| json!({
                "property": v.property,
                "holds": v.failed == 0,
                "findings": v.findings,
                "failed": v.failed,
                "failures": v.failures.iter().map(|f| json!({
                    "what": f.what,
                    "figure": number(f.figure),
                    "threshold": number(f.threshold),
                })).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        })
    }
}

/// JSON has no infinities.
fn number(v: f64) -> Value {
    if v.is_finite() {
        json!(v)
    } else {
        json!(v.to_string())
    }
}

/// The figure and what it was compared with; counts of false claims stand beside the property's name.
fn against(f: &Failure) -> Option<String> {
    let figures = format!("figure {:.4e}, threshold {:.4e}", f.figure, f.threshold);
    (f.threshold != 0.0).then_some(figures)
}
