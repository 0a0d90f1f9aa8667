//! `resolvent plugin check`: drives a plugin through the checks of the conformance kit.
//!
//! Instances are made as a scene makes them, from the declared parameters and what `--params` fixes ([`subject`]). What needs
//! statistics is done for a few sets of parameters, what needs a few thousand calls for every parameter at the ends of its range
//! ([`variants`]). The functions are called through the C tables, with results poisoned beforehand, so that nothing a plugin
//! forgets to write passes for an answer ([`raw`]).

mod declared;
mod integrators;
mod isolate;
mod life;
mod media;
mod raw;
mod report;
mod scatterers;
mod subject;
mod variants;

use crate::args::Check;
use crate::failure::{Code, Outcome, failed};
use report::Report;
use resolvent_api::PluginKind;
use resolvent_conformance::{Suite, property};
use subject::Subject;
use variants::Variant;

/// Samples taken, as a share of what the plugins of this repository are tested with.
const EFFORT: f64 = 0.2;
/// Chance that a correct plugin fails.
const LEVEL: f64 = 1e-3;

/// Runs `plugin check`.
pub fn run(a: &Check) -> Outcome {
    if a.stages {
        return isolate::child(a);
    }
    let report = if a.isolate {
        isolate::parent(a)?
    } else {
        examine(a, &|_, _| {})?
    };
    if a.json {
        println!("{:#}", report.to_json());
    } else {
        report.print();
    }
    let broken: Vec<_> = report.broken().collect();
    if broken.is_empty() {
        return Ok(Code::Done);
    }
    Err(failed(format!(
        "{} does not conform: {}",
        report.title,
        broken.join(", ")
    )))
}

/// Hears of each stage before it begins: the property and the parameters it is about.
type Stages<'a> = &'a dyn Fn(&'static str, &str);

/// All checks of a plugin.
fn examine(a: &Check, stages: Stages) -> Outcome<Report> {
    stages("loading", &a.plugin);
    let subject = Subject::new(a)?;
    let mut suite = Suite::with_effort(EFFORT);
    stages(property::PARAMETERS, "declarations");
    declared::check(&mut suite, &subject);
    let variants = if a.brief {
        Vec::new()
    } else {
        variants::thorough(&subject)
    };
    for v in &variants {
        thorough(&mut suite, &subject, v, stages)?;
    }
    life::check(&mut suite, &subject, stages)?;
    let mut refused = Vec::new();
    let each_alone = if a.brief {
        Vec::new()
    } else {
        variants::each_alone(&subject)
    };
    for v in each_alone {
        stages(property::PARAMETERS, &v.name);
        match subject.make(&v.params) {
            Ok(instance) => {
                let mut brief = Suite::with_effort(EFFORT * 0.1);
                match subject.plugin.kind {
                    PluginKind::Medium => media::brief(&mut brief, &v.name, &instance),
                    PluginKind::Phase | PluginKind::Bsdf => {
                        scatterers::brief(&mut brief, &v.name, &instance);
                    }
                    PluginKind::Integrator => {}
                }
                suite.about(property::PARAMETERS);
                let verdicts = brief.verdicts(LEVEL);
                let failure = verdicts.iter().find_map(|v| v.failures.first().cloned());
                suite.report(failure);
            }
            // Parameters may exclude each other in ways that declarations can't say.
            Err(why) => refused.push((v.name, words(&why))),
        }
    }
    Ok(Report {
        title: subject.plugin.title(),
        version: subject.plugin.decl.version.clone(),
        variants: variants.into_iter().map(|v| v.name).collect(),
        refused,
        verdicts: suite.verdicts(LEVEL),
    })
}

/// The reason alone: place and plugin are known.
fn words(why: &str) -> String {
    why.rsplit_once("): ")
        .map_or(why, |(_, reason)| reason)
        .into()
}

/// The checks that need statistics, with one set of parameters.
fn thorough(suite: &mut Suite, subject: &Subject, v: &Variant, stages: Stages) -> Outcome<()> {
    match subject.plugin.kind {
        PluginKind::Medium => media::thorough(suite, subject, v, stages),
        PluginKind::Phase | PluginKind::Bsdf => scatterers::thorough(suite, subject, v, stages),
        PluginKind::Integrator => integrators::thorough(suite, subject, v, stages),
    }
}
