//! Sets of parameters to check a plugin with.

use super::subject::{Params, Subject};
use resolvent_scene::{ParamDecl, ParamKind};
use serde_json::{Value, json};

/// A set of parameters.
pub struct Variant {
    /// What differs from the defaults, for reports.
    pub name: String,
    /// The parameters.
    pub params: Params,
}

/// The defaults, and all numbers low and high within their ranges at once.
pub fn thorough(subject: &Subject) -> Vec<Variant> {
    let mut out = vec![Variant {
        name: if subject.fixed.is_empty() {
            "defaults".into()
        } else {
            Value::Object(subject.base.clone()).to_string()
        },
        params: subject.base.clone(),
    }];
    for (i, share) in [0.25, 0.75].into_iter().enumerate() {
        let mut v = Variant {
            name: String::new(),
            params: subject.base.clone(),
        };
        for d in varied(subject) {
            let value = match &d.kind {
                ParamKind::Bool => Some(json!(i == 1)),
                ParamKind::Choice(words) => {
                    words.get((i + 1) % words.len().max(1)).map(|w| json!(w))
                }
                ParamKind::Float | ParamKind::Spectrum => inside(d, share).map(|x| json!(x)),
                _ => None,
            };
            let Some(value) = value else { continue };
            if !v.name.is_empty() {
                v.name.push_str(", ");
            }
            v.name.push_str(&format!("{} = {value}", d.name));
            v.params.insert(d.name.clone(), value);
        }
        if !v.name.is_empty() && subject.make(&v.params).is_ok() {
            out.push(v);
        }
    }
    out
}

/// A number well inside of a parameter's range; for ranges without an end, a multiple of the default.
fn inside(d: &ParamDecl, share: f64) -> Option<f64> {
    let default = d
        .default
        .as_ref()
        .and_then(resolvent_scene::Value::as_spectrum);
    match (d.min, d.max, default) {
        (Some(a), Some(b), _) => Some(a + share * (b - a)),
        (Some(a), None, Some([x, ..])) => Some(a + 2.0 * share * (x - a)),
        (None, Some(b), Some([x, ..])) => Some(b - 2.0 * share * (b - x)),
        (None, None, Some([x, ..])) => Some(2.0 * share * x),
        // Without a default its absence means something.
        (_, _, None) => None,
    }
}

/// Every parameter alone, at the ends of its range, with each of its words, and far out where it declares no end.
pub fn each_alone(subject: &Subject) -> Vec<Variant> {
    let mut out = Vec::new();
    for d in varied(subject) {
        for value in values(d) {
            let mut params = subject.base.clone();
            params.insert(d.name.clone(), value.clone());
            out.push(Variant {
                name: format!("{} = {value}", d.name),
                params,
            });
        }
    }
    out
}

fn values(d: &ParamDecl) -> Vec<Value> {
    match &d.kind {
        ParamKind::Bool => vec![json!(false), json!(true)],
        ParamKind::Choice(words) => words.iter().map(|w| json!(w)).collect(),
        ParamKind::Int => ends(d, 1.0, 4.0)
            .into_iter()
            .map(|x| json!(x as i64))
            .collect(),
        ParamKind::Float => ends(d, 1e-6, 100.0).into_iter().map(|x| json!(x)).collect(),
        ParamKind::Spectrum => ends(d, 1e-6, 100.0)
            .into_iter()
            .flat_map(|x| {
                [
                    json!(x),
                    json!([x, 0.5 * (x + near_default(d)), near_default(d)]),
                ]
            })
            .collect(),
        _ => vec![],
    }
}

fn near_default(d: &ParamDecl) -> f64 {
    inside(d, 0.5).or(d.min).or(d.max).unwrap_or_default()
}

/// Both ends of a range, `step` inside if they are excluded; `far` beyond zero where it has none.
fn ends(d: &ParamDecl, step: f64, far: f64) -> [f64; 2] {
    let low = match d.min {
        Some(a) if d.min_excluded => a + step,
        Some(a) => a,
        None => d.max.map_or(-1.0, |b| b - far),
    };
    let high = match d.max {
        Some(b) if d.max_excluded => b - step,
        Some(b) => b,
        None => d.min.map_or(far, |a| a + far),
    };
    [low, high]
}

/// Parameters that were not given.
fn varied(subject: &Subject) -> impl Iterator<Item = &ParamDecl> {
    let decls = subject.plugin.decl.params.iter();
    decls.filter(|d| !subject.fixed.contains(&d.name))
}
