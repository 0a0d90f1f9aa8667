//! Results as a page.

use crate::results::{Fit, Results};
use std::fmt::Write;

/// The page; `stem` is the name of the plots beside it.
pub fn page(results: &Results, command: &str, stem: &str) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "# Benchmarks\n\nMade by `{command}` on {}, {}. Times are CPU seconds over all threads, of rendering alone; they vary by a few per cent from run to run, on a busy machine by more.\n",
        results.date, results.machine
    );
    if !results.scenes.is_empty() {
        scenes(&mut out, results, stem);
    }
    if !results.scaling.is_empty() {
        scaling(&mut out, results, stem);
    }
    out
}

fn scenes(out: &mut String, results: &Results, stem: &str) {
    let _ = writeln!(
        out,
        "## Time against error\n\n![relMSE over CPU time]({stem}.svg)\n"
    );
    out.push_str(
        "relMSE is the mean of (x − r)²/(r² + 0.01) over pixels and channels without the worst 0.1 % of the pixels, less the reference's own noise. \
         *Efficiency* is 1/(relMSE × CPU-s) of the longest run, *asymptotic* the same with the variance that the picture states instead of the error, which cannot \
         saturate and knows no reference. *Slope* is the exponent of relMSE over CPU-s: −1 without bias. *Floor* is the relMSE that no noise explains, and *mean* how far the \
         picture's mean is from the reference's, both with standard errors. Efficiencies depend on the number of pixels: compare them within a row of the same size.\n\n",
    );
    out.push_str("| scene | renderer | size | µs a sample | efficiency | asymptotic | relMSE at 10 CPU-s | CPU-s to 0.01 | slope | floor / 1e-4 | mean | memory | load |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for s in &results.scenes {
        for l in &s.lines {
            let Some(f) = &l.fit else { continue };
            let _ = writeln!(
                out,
                "| {} | {} | {} × {} | {} |",
                s.name,
                l.renderer,
                s.resolution[0],
                s.resolution[1],
                cells(f).join(" | ")
            );
        }
        for (renderer, why) in &s.skipped {
            let _ = writeln!(out, "| {} | {renderer} | not done: {why} |", s.name);
        }
    }
    out.push_str("\n| scene | what it is for | reference |\n|---|---|---|\n");
    for s in &results.scenes {
        let _ = writeln!(out, "| {} | {} | {} |", s.name, s.purpose, s.reference);
    }
    out.push('\n');
}

fn cells(f: &Fit) -> Vec<String> {
    let number = |v: Option<f64>| v.map_or("–".to_owned(), significant);
    let pair = |v: [f64; 2], scale: f64, digits: usize| {
        format!("{:+.digits$} ± {:.digits$}", v[0] * scale, v[1] * scale)
    };
    vec![
        significant(f.microseconds_per_sample),
        if f.saturated {
            "saturated".into()
        } else {
            number(f.efficiency)
        },
        number(f.asymptote),
        number(f.error_at_10),
        number(f.seconds_to_1e2),
        f.slope
            .map_or("–".into(), |s| format!("{:.2} ± {:.2}", s[0], s[1])),
        f.floor.map_or("–".into(), |v| pair(v, 1e4, 1)),
        if f.asymptote.is_some() {
            format!("{} %", pair(f.mean_off, 100.0, 2))
        } else {
            // A picture that states no variance: its mean has an unknown error.
            format!("{:+.2} %", 100.0 * f.mean_off[0])
        },
        format!("{:.0} MB", f.memory / 1e6),
        format!("{:.0} ms", 1e3 * f.load),
    ]
}

fn scaling(out: &mut String, results: &Results, stem: &str) {
    let _ = writeln!(
        out,
        "## Scaling\n\n![costs]({stem}-scaling.svg)\n\nThe exponent e of y ~ x^e, over all points and over their upper half.\n\n| x | from … to | y | exponent | of the upper half |\n|---|---|---|---|---|"
    );
    let exponent =
        |e: Option<[f64; 2]>| e.map_or("–".to_owned(), |e| format!("{:.2} ± {:.2}", e[0], e[1]));
    for s in &results.scaling {
        let (Some(a), Some(b)) = (s.points.first(), s.points.last()) else {
            continue;
        };
        let _ = writeln!(
            out,
            "| {} | {} … {} | {}: {} … {} | {} | {} |",
            s.x,
            significant(a.x),
            significant(b.x),
            s.y,
            significant(a.y),
            significant(b.y),
            exponent(s.exponent),
            exponent(s.upper)
        );
    }
    out.push_str("\n| series | x | µs a sample | look-ups a sample | flights a sample | load, ms | memory, MB |\n|---|---|---|---|---|---|---|\n");
    for s in &results.scaling {
        for p in &s.points {
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} | {:.1} | {:.1} |",
                s.name,
                significant(p.x),
                significant(p.microseconds),
                significant(p.lookups),
                significant(p.flights),
                1e3 * p.load,
                p.memory / 1e6
            );
        }
    }
    out.push('\n');
}

/// Three significant digits, without an exponent where that is short.
pub fn significant(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let e = v.abs().log10().floor() as i32;
    match e {
        -4..=2 => {
            let text = format!("{v:.*}", (2 - e) as usize);
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
        3..=5 => format!("{v:.0}"),
        _ => format!("{v:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn three_digits() {
        for (v, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.01234, "0.0123"),
            (12.345, "12.3"),
            (999.9, "1000"),
            (54321.0, "54321"),
            (1e8, "1.00e8"),
            (1.5e-6, "1.50e-6"),
        ] {
            assert_eq!(super::significant(v), text);
        }
    }
}
