//! USD stages: converted by the Python package `resolvent_usd`, which stands on OpenUSD's own libraries.

mod cache;
mod python;

use python::Python;

use crate::args::{Convert, Export, Stage};
use crate::console;
use crate::failure::{Code, Outcome, failed, input};
use crate::roles::Roles;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// `resolvent convert`.
pub fn convert(a: &Convert) -> Outcome {
    apart(&a.stage, &a.output, &a.options.report)?;
    let python = Python::find()?;
    let mut command = command(&python, &a.stage, &a.output, &a.options);
    if let Some(frames) = &a.options.frames {
        command.arg(format!("--frames={frames}"));
    }
    report(&mut command, &a.options.report);
    finish(command, &python, &a.stage)
}

/// `resolvent export`.
pub fn export(a: &Export) -> Outcome {
    apart(&a.scene, &a.output, &a.report)?;
    let python = Python::find()?;
    let mut command = python.command();
    command.arg("-m").arg("resolvent_usd.export").arg(&a.scene);
    command.arg("-o").arg(&a.output);
    if a.strict {
        command.arg("--strict");
    }
    report(&mut command, &a.report);
    finish(command, &python, &a.scene)
}

/// Refuses to write over the input, or one file over the other.
fn apart(read: &Path, output: &Path, report: &Option<PathBuf>) -> Outcome<()> {
    let mut roles = Roles::default();
    roles.read("the input", read)?;
    roles.write("-o", output)?;
    report.iter().try_for_each(|r| roles.write("--report", r))
}

fn report(command: &mut Command, file: &Option<PathBuf>) {
    if let Some(file) = file {
        command.arg("--report").arg(file);
    }
}

/// Runs a conversion; what it says goes where we say things.
fn finish(mut command: Command, python: &Python, what: &Path) -> Outcome {
    let status = command.status().map_err(|e| python.broken(&e))?;
    match status.code() {
        Some(0) => Ok(Code::Done),
        Some(2) => Err(input(format!("{} is not converted", what.display()))),
        _ => Err(failed(format!(
            "the conversion of {} failed ({status})",
            what.display()
        ))),
    }
}

/// The scene file of a stage, converted now or found in the cache. What was lost is said in both cases.
pub fn scene(stage: &Path, options: &Stage) -> Outcome<PathBuf> {
    let python = Python::find()?;
    let arguments = arguments(options);
    let entry = cache::Entry::new(stage, &arguments, python.fingerprint())?;
    if let Some((scene, losses)) = entry.find() {
        hand_out(&scene.with_file_name(cache::REPORT), options)?;
        say(&losses);
        crate::watch::reads(entry.layers());
        return Ok(scene);
    }
    let folder = entry.begin()?;
    let mut command = command(&python, stage, &folder.join(cache::SCENE), options);
    command.arg("--layers").arg(folder.join(cache::LAYERS));
    report(&mut command, &Some(folder.join(cache::REPORT)));
    let out = command
        .stdout(Stdio::null())
        .output()
        .map_err(|e| python.broken(&e))?;
    let said = String::from_utf8_lossy(&out.stderr);
    hand_out(&folder.join(cache::REPORT), options)?;
    if !out.status.success() {
        crate::watch::reads(cache::layers(folder));
        entry.discard();
        // The converter's own words; its last line is the error.
        let (losses, error) = said.trim_end().rsplit_once('\n').unwrap_or(("", &said));
        say(losses);
        let message = error.trim().trim_start_matches("error: ").to_owned();
        return Err(match out.status.code() {
            Some(2) => input(message),
            _ => failed(format!(
                "the conversion of {} failed: {message}",
                stage.display()
            )),
        });
    }
    say(&said);
    let scene = entry.keep(&said)?;
    crate::watch::reads(entry.layers());
    Ok(scene)
}

/// Writes the report where it is asked for. A conversion that ended in an error has none.
fn hand_out(report: &Path, options: &Stage) -> Outcome<()> {
    match &options.report {
        Some(file) if report.exists() => std::fs::copy(report, file)
            .map(drop)
            .map_err(|e| failed(format!("{}: {e}", file.display()))),
        _ => Ok(()),
    }
}

/// What the converter said, each loss a warning: the picture is not quite what the stage means.
fn say(text: &str) {
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        console::warning(line);
    }
}

fn command(python: &Python, stage: &Path, output: &Path, options: &Stage) -> Command {
    let mut command = python.command();
    command.arg("-m").arg("resolvent_usd").arg(stage);
    command.arg("-o").arg(output).args(arguments(options));
    command
}

/// The options as the converter's command line has them.
fn arguments(o: &Stage) -> Vec<OsString> {
    let mut out: Vec<OsString> = Vec::new();
    let mut add = |flag: &str, value: &Option<String>| {
        if let Some(value) = value {
            out.push(format!("{flag}={value}").into());
        }
    };
    add("--frame", &o.frame.map(|f| f.to_string()));
    add("--purpose", &o.purpose);
    add("--camera", &o.stage_camera);
    add("--render-settings", &o.render_settings);
    add("--subdivision", &o.subdivision.map(|n| n.to_string()));
    out.extend(o.variant.iter().map(|v| format!("--variant={v}").into()));
    for (flag, given) in [("--strict", o.strict), ("--keep-going", o.keep_going)] {
        if given {
            out.push(flag.into());
        }
    }
    out
}
