//! `resolvent render --frames`: one picture after the other.

use crate::args::Render;
use crate::console;
use crate::failure::{Code, Failure, Outcome};
use crate::frames::{self, Frames};
use crate::interrupt::{self, Phase};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Renders all frames. Each is complete on disk before the next one begins; the first that fails or is interrupted ends the
/// sequence, and what is left of it is said.
pub fn run(a: &Render, frames: &Frames, render: impl Fn(&Render) -> Outcome) -> Outcome {
    for (done, frame) in frames.times().enumerate() {
        if done > 0 {
            interrupt::enter(Phase::Between);
        }
        let name = frames::plain(frame);
        console::info(format!("frame {name}"));
        let outcome = render(&shot(a, frame));
        let stopped = interrupt::STOP.load(Ordering::SeqCst);
        let (written, next) = match outcome {
            Ok(Code::Done) => (done + 1, frames.times().nth(done + 1)),
            _ => (done, Some(frame)),
        };
        let Some(next) = next else { break };
        let left = format!(
            "{written} frames are written; for the rest: --frames {}",
            frames.from(next)
        );
        match outcome {
            Ok(Code::Done) if !stopped => {}
            Err(Failure { code, message }) if !stopped => {
                let message = format!("frame {name}: {message}; {left}");
                return Err(Failure { code, message });
            }
            // What is saved of a frame that was begun, it has said itself.
            _ => {
                console::line(&format!("interrupted; {left}"));
                return Ok(Code::Interrupted);
            }
        }
    }
    Ok(Code::Done)
}

/// The render of one frame: its time, and its own files.
fn shot(a: &Render, frame: f64) -> Render {
    let mut a = a.clone();
    a.stage.frames = None;
    a.stage.frame = Some(frame);
    if a.output.is_empty() && a.aim.checkpoint.is_none() {
        let stem = a.input.file_stem().unwrap_or(a.input.as_os_str());
        a.output.push(PathBuf::from(stem).with_extension("exr"));
    }
    let files = a
        .output
        .iter_mut()
        .chain(&mut a.aim.checkpoint)
        .chain(&mut a.stats)
        .chain(&mut a.save_scene)
        .chain(&mut a.stage.report);
    for file in files {
        *file = frames::file(file, frame);
    }
    a
}
