//! Plots in logarithmic axes, one panel beside the other.

use crate::canvas::{Anchor, Canvas, Color};
use crate::results::{Results, SceneResult};
use crate::scaling::Series;

const PANEL: [f64; 2] = [300.0, 230.0];
const COLUMNS: usize = 4;
const INK: Color = [40, 40, 40];
const FAINT: Color = [215, 215, 215];
/// Okabe and Ito's colours, which colour-blind readers can tell apart.
const COLORS: [Color; 5] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
];

/// Points and lines of one panel.
#[derive(Default)]
struct Panel {
    title: String,
    x: &'static str,
    y: String,
    /// Points of a renderer, and a name for the legend.
    points: Vec<(String, Vec<[f64; 2]>)>,
    /// Dashed lines, by the index of their colour.
    dashed: Vec<(usize, [[f64; 2]; 2])>,
}

/// Error over CPU time of every scene.
pub fn errors(results: &Results) -> Canvas {
    draw(&results.scenes.iter().map(error_panel).collect::<Vec<_>>())
}

/// Costs of every series.
pub fn scaling(series: &[Series]) -> Canvas {
    draw(&series.iter().map(scaling_panel).collect::<Vec<_>>())
}

fn error_panel(s: &SceneResult) -> Panel {
    let mut panel = Panel {
        title: s.name.clone(),
        x: "CPU seconds",
        y: "relMSE".into(),
        ..Panel::default()
    };
    for (k, line) in s.lines.iter().enumerate() {
        let points: Vec<_> = line
            .runs
            .iter()
            .filter(|r| r.score.rel_mse > 0.0)
            .map(|r| [r.cost.render_cpu, r.score.rel_mse])
            .collect();
        let span = |f: fn(f64, f64) -> f64, start: f64| points.iter().map(|p| p[0]).fold(start, f);
        let (low, high) = (span(f64::min, f64::INFINITY), span(f64::max, 0.0));
        if let Some(a) = line.fit.and_then(|f| f.asymptote) {
            let ends = [low, high].map(|t| [t, 1.0 / (a * t)]);
            panel.dashed.push((k, ends));
        }
        panel.points.push((line.renderer.clone(), points));
    }
    panel
}

fn scaling_panel(s: &Series) -> Panel {
    let exponent = s
        .exponent
        .map_or(String::new(), |e| format!(" ~ x^{:.2}", e[0]));
    Panel {
        title: format!("{}{exponent}", s.name),
        x: s.x,
        y: s.y.replace('µ', "u"),
        points: vec![(String::new(), s.points.iter().map(|p| [p.x, p.y]).collect())],
        dashed: Vec::new(),
    }
}

fn draw(panels: &[Panel]) -> Canvas {
    let columns = panels.len().clamp(1, COLUMNS);
    let rows = panels.len().div_ceil(columns).max(1);
    let mut names: Vec<String> = Vec::new();
    for (name, _) in panels.iter().flat_map(|p| &p.points) {
        if !name.is_empty() && !names.contains(name) {
            names.push(name.clone());
        }
    }
    let legend = if names.is_empty() { 0.0 } else { 24.0 };
    let mut canvas = Canvas::new([
        (PANEL[0] * columns as f64) as usize,
        (PANEL[1] * rows as f64 + legend) as usize,
    ]);
    let color =
        |name: &str| COLORS[names.iter().position(|n| n == name).unwrap_or(0) % COLORS.len()];
    for (k, panel) in panels.iter().enumerate() {
        let at = [
            PANEL[0] * (k % columns) as f64,
            PANEL[1] * (k / columns) as f64,
        ];
        draw_panel(&mut canvas, panel, at, &color);
    }
    let mut x = 50.0;
    for name in &names {
        let y = PANEL[1] * rows as f64 + 10.0;
        canvas.dot([x, y], 3.5, color(name));
        canvas.text([x + 8.0, y], name, Anchor::Start, INK);
        x += 30.0 + 6.0 * name.len() as f64;
    }
    if !names.is_empty() {
        let y = PANEL[1] * rows as f64 + 10.0;
        canvas.dashed([x, y], [x + 30.0, y], 1.0, INK);
        canvas.text([x + 36.0, y], "by the stated variance", Anchor::Start, INK);
    }
    canvas
}

fn draw_panel(canvas: &mut Canvas, panel: &Panel, at: [f64; 2], color: &dyn Fn(&str) -> Color) {
    let (left, right) = (at[0] + 52.0, at[0] + PANEL[0] - 12.0);
    let (top, bottom) = (at[1] + 24.0, at[1] + PANEL[1] - 36.0);
    let all: Vec<[f64; 2]> = panel
        .points
        .iter()
        .flat_map(|(_, p)| p.iter().copied())
        .chain(panel.dashed.iter().flat_map(|(_, e)| *e))
        .filter(|p| p.iter().all(|v| *v > 0.0 && v.is_finite()))
        .collect();
    canvas.text([left, at[1] + 12.0], &panel.title, Anchor::Start, INK);
    if all.is_empty() {
        canvas.text([left, top + 40.0], "no data", Anchor::Start, INK);
        return;
    }
    let range = |k: usize| {
        let low = all.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
        let high = all.iter().map(|p| p[k]).fold(0.0, f64::max);
        let (low, high) = (low.log10() - 0.08, high.log10() + 0.08);
        // At least a decade, so that noise does not look like a trend.
        let middle = 0.5 * (low + high);
        (low.min(middle - 0.5), high.max(middle + 0.5))
    };
    let ((x0, x1), (y0, y1)) = (range(0), range(1));
    let place = |p: [f64; 2]| {
        [
            left + (p[0].log10() - x0) / (x1 - x0) * (right - left),
            bottom - (p[1].log10() - y0) / (y1 - y0) * (bottom - top),
        ]
    };
    for e in x0.ceil() as i32..=x1.floor() as i32 {
        let x = place([10f64.powi(e), 1.0])[0];
        canvas.line([x, top], [x, bottom], 1.0, FAINT);
        canvas.text([x, bottom + 9.0], &power(e), Anchor::Middle, INK);
    }
    for e in y0.ceil() as i32..=y1.floor() as i32 {
        let y = place([1.0, 10f64.powi(e)])[1];
        canvas.line([left, y], [right, y], 1.0, FAINT);
        canvas.text([left - 4.0, y], &power(e), Anchor::End, INK);
    }
    for (a, b) in [
        ([left, top], [left, bottom]),
        ([left, bottom], [right, bottom]),
    ] {
        canvas.line(a, b, 1.0, INK);
    }
    let middle = 0.5 * (left + right);
    canvas.text([middle, bottom + 24.0], panel.x, Anchor::Middle, INK);
    canvas.text([right, at[1] + 12.0], &panel.y, Anchor::End, INK);
    for (k, ends) in &panel.dashed {
        if ends.iter().flatten().all(|v| *v > 0.0 && v.is_finite()) {
            let name = &panel.points[*k].0;
            canvas.dashed(place(ends[0]), place(ends[1]), 1.0, color(name));
        }
    }
    for (name, points) in &panel.points {
        let mut sorted: Vec<[f64; 2]> = points
            .iter()
            .copied()
            .filter(|p| p.iter().all(|v| *v > 0.0 && v.is_finite()))
            .collect();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for pair in sorted.windows(2) {
            canvas.line(place(pair[0]), place(pair[1]), 1.2, color(name));
        }
        for p in sorted {
            canvas.dot(place(p), 3.0, color(name));
        }
    }
}

/// A power of ten that is short to read.
fn power(e: i32) -> String {
    match e {
        -2..=3 => format!("{}", 10f64.powi(e)),
        _ => format!("1e{e}"),
    }
}
