//! A check in a process of its own, so that a plugin that crashes or hangs ends nothing but that.
//!
//! The child says on its standard output, line by line, what it is about to do, and at the end what it found. If it ends before that,
//! the last thing it was about to do is what the plugin did not survive.

use super::report::Report;
use super::{LEVEL, examine};
use crate::args::Check;
use crate::failure::{Code, Outcome, failed, input};
use resolvent_conformance::{Failure, Suite, Verdict, property};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// First member of the lines that are ours: a plugin may print, too.
const MARK: &str = "resolvent_check";

/// The child's side.
pub fn child(a: &Check) -> Outcome {
    let say = |v: Value| {
        let mut out = std::io::stdout().lock();
        // The parent may be gone: then nobody is left to hear it.
        drop(writeln!(out, "{v}").and_then(|()| out.flush()));
    };
    let outcome = examine(a, &|property, at| {
        say(json!({MARK: "stage", "property": property, "at": at}));
    });
    match outcome {
        Ok(report) => say(json!({MARK: "report", "report": report.to_json()})),
        Err(f) => say(json!({MARK: "refused", "message": f.message, "code": f.code as u8})),
    }
    Ok(Code::Done)
}

/// The parent's side.
pub fn parent(a: &Check) -> Outcome<Report> {
    let program = std::env::current_exe().map_err(failed)?;
    let mut command = Command::new(program);
    command.args(["plugin", "check", &a.plugin, "--stages"]);
    if let Some(params) = &a.params {
        command.args(["--params", params]);
    }
    if a.brief {
        command.arg("--brief");
    }
    for folder in &a.plugins.plugin_path {
        command.arg("--plugin-path").arg(folder);
    }
    // Freed memory is filled, so that what uses it after its end shows.
    command.env("MALLOC_PERTURB_", "165");
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    let mut child = command.spawn().map_err(failed)?;
    let heard = listen(&mut child);
    let mut last = ("loading".to_owned(), a.plugin.clone());
    loop {
        match heard.recv_timeout(Duration::from_secs(a.patience)) {
            Ok(line) => match line[MARK].as_str() {
                Some("stage") => {
                    let text = |key: &str| line[key].as_str().unwrap_or_default().to_owned();
                    last = (text("property"), text("at"));
                }
                Some("report") => {
                    drop(child.wait());
                    return read(&line["report"]).ok_or_else(|| failed("the report is damaged"));
                }
                _ => {
                    drop(child.wait());
                    let message = line["message"].as_str().unwrap_or_default();
                    return Err(if line["code"] == Code::Input as u8 {
                        input(message)
                    } else {
                        failed(message)
                    });
                }
            },
            Err(RecvTimeoutError::Timeout) => {
                drop(child.kill());
                drop(child.wait());
                let how = format!("it hangs: no answer for {} s", a.patience);
                return Ok(fatal(a, &last, &how));
            }
            Err(RecvTimeoutError::Disconnected) => {
                let status = child.wait().map_err(failed)?;
                return Ok(fatal(a, &last, &crate::system::ending(status)));
            }
        }
    }
}

/// The child's lines that are ours, as they come.
fn listen(child: &mut Child) -> Receiver<Value> {
    let (send, receive) = channel();
    if let Some(out) = child.stdout.take() {
        std::thread::spawn(move || {
            for line in BufReader::new(out).split(b'\n').map_while(Result::ok) {
                let ours = serde_json::from_slice::<Value>(&line).ok();
                if let Some(v) = ours.filter(|v| v[MARK].is_string())
                    && send.send(v).is_err()
                {
                    return;
                }
            }
        });
    }
    receive
}

/// The report on a plugin that a check did not survive.
fn fatal(a: &Check, (property, at): &(String, String), how: &str) -> Report {
    let mut suite = Suite::new();
    suite.about(property::SURVIVAL);
    suite.claim(false, || format!("{how} (while checking {property}: {at})"));
    Report {
        title: format!("plugin {}", a.plugin),
        version: String::new(),
        variants: vec![],
        refused: vec![],
        verdicts: suite.verdicts(LEVEL),
    }
}

/// A report as the child wrote it.
fn read(v: &Value) -> Option<Report> {
    let text = |v: &Value| v.as_str().map(str::to_owned);
    let texts = |v: &Value| v.as_array()?.iter().map(text).collect::<Option<Vec<_>>>();
    let number = |v: &Value| match v.as_str() {
        Some(s) => s.parse().ok(),
        None => v.as_f64(),
    };
    let failure = |v: &Value| {
        Some(Failure {
            what: text(&v["what"])?,
            figure: number(&v["figure"])?,
            threshold: number(&v["threshold"])?,
        })
    };
    let verdict = |v: &Value| {
        Some(Verdict {
            property: property::known(v["property"].as_str()?)?,
            findings: v["findings"].as_u64()? as usize,
            failed: v["failed"].as_u64()? as usize,
            failures: v["failures"]
                .as_array()?
                .iter()
                .map(failure)
                .collect::<Option<_>>()?,
        })
    };
    Some(Report {
        title: text(&v["plugin"])?,
        version: text(&v["version"])?,
        variants: texts(&v["checked"])?,
        refused: v["refused"]
            .as_array()?
            .iter()
            .map(|pair| Some((text(&pair[0])?, text(&pair[1])?)))
            .collect::<Option<_>>()?,
        verdicts: v["properties"]
            .as_array()?
            .iter()
            .map(verdict)
            .collect::<Option<_>>()?,
    })
}
