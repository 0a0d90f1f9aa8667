//! What a plugin declares about its parameters.

use super::subject::Subject;
use resolvent_conformance::{Suite, property};
use resolvent_scene::{ParamDecl, ParamKind, PluginBlock, Value};
use std::path::Path;

/// Names, ranges, defaults and help fit each other; what is not declared is refused.
pub fn check(suite: &mut Suite, subject: &Subject) {
    suite.about(property::PARAMETERS);
    let decl = &subject.plugin.decl;
    suite.claim(!decl.summary.is_empty(), || "it has no summary".into());
    suite.claim(!decl.version.is_empty(), || "it has no version".into());
    for (i, d) in decl.params.iter().enumerate() {
        let name = &d.name;
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        suite.claim(!name.is_empty() && name.chars().all(plain), || {
            format!("{name:?} is no name for a parameter: letters, digits and '_'")
        });
        suite.claim(decl.params[..i].iter().all(|o| o.name != *name), || {
            format!("'{name}' is declared twice")
        });
        suite.claim(!d.help.is_empty(), || format!("'{name}' has no help"));
        range(suite, d);
        choices(suite, d);
        if let Some(default) = &d.default {
            suite.claim(!d.required, || {
                format!("'{name}' is required, and has a default that can never be used")
            });
            let block = only(d, default.clone());
            let verdict = only_decl(subject, d).check(&block, Path::new("default"));
            suite.claim(verdict.is_ok(), || {
                let why = verdict
                    .err()
                    .and_then(|p| p.first().map(ToString::to_string));
                format!(
                    "the default of '{name}' does not fit its own declaration: {}",
                    why.unwrap_or_default()
                )
            });
        }
        for outside in outside(d) {
            let block = only(d, Value::Number(outside));
            let verdict = only_decl(subject, d).check(&block, Path::new("range"));
            suite.claim(verdict.is_err(), || {
                format!("'{name}' = {outside} is out of its range and passes")
            });
        }
    }
    let mut unknown = subject.base.clone();
    unknown.insert("there_is_no_such_parameter".into(), 1.into());
    suite.claim(subject.make(&unknown).is_err(), || {
        "an unknown parameter passes".into()
    });
}

fn range(suite: &mut Suite, d: &ParamDecl) {
    let name = &d.name;
    let (min, max) = (
        d.min.unwrap_or(f64::NEG_INFINITY),
        d.max.unwrap_or(f64::INFINITY),
    );
    let some = if d.min_excluded || d.max_excluded {
        min < max
    } else {
        min <= max
    };
    suite.claim(some, || {
        format!("the range of '{name}', {min} to {max}, holds nothing")
    });
    let numeric = matches!(
        d.kind,
        ParamKind::Int
            | ParamKind::Float
            | ParamKind::Spectrum
            | ParamKind::Vec3
            | ParamKind::Numbers
    );
    suite.claim(numeric || (d.min.is_none() && d.max.is_none()), || {
        format!("'{name}' has a range and is no number")
    });
}

fn choices(suite: &mut Suite, d: &ParamDecl) {
    let name = &d.name;
    match &d.kind {
        ParamKind::Choice(words) => {
            suite.claim(words.iter().all(|w| !w.trim().is_empty()), || {
                format!("'{name}' is a choice of {words:?}")
            });
        }
        ParamKind::Plugin(kind) => {
            let known = resolvent_api::PluginKind::ALL
                .iter()
                .any(|k| k.name() == kind);
            suite.claim(known, || {
                format!("'{name}' is a plugin of the unknown kind {kind:?}")
            });
        }
        _ => {}
    }
}

/// Numbers outside of a range of single numbers.
fn outside(d: &ParamDecl) -> Vec<f64> {
    if !matches!(
        d.kind,
        ParamKind::Float | ParamKind::Spectrum | ParamKind::Int
    ) {
        return vec![];
    }
    let mut out = Vec::new();
    out.extend(d.min.map(|a| a - 1.0));
    out.extend(d.max.map(|b| b + 1.0));
    out.extend(d.min.filter(|_| d.min_excluded));
    out.extend(d.max.filter(|_| d.max_excluded));
    out
}

fn only(d: &ParamDecl, value: Value) -> PluginBlock {
    PluginBlock::new("checked").with(d.name.clone(), value)
}

/// A plugin that declares this parameter and no other.
fn only_decl(subject: &Subject, d: &ParamDecl) -> resolvent_scene::PluginDecl {
    resolvent_scene::PluginDecl {
        params: vec![d.clone()],
        ..subject.plugin.decl.clone()
    }
}
