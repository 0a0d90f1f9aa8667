//! Ctrl-C (and the signals that ask a program to end): the first ends the rendering in order, the second the program.

use crate::console;
use crate::failure::Code;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// Asks the renderer to stop.
pub static STOP: AtomicBool = AtomicBool::new(false);

static PHASE: AtomicU8 = AtomicU8::new(Phase::Preparing as u8);

/// What the program is doing, which decides what an interruption means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// There is nothing to save yet.
    Preparing = 0,
    /// What is finished can be saved.
    Rendering = 1,
    /// It is being saved.
    Writing = 2,
    /// Frames are saved, and the next one is being prepared.
    Between = 3,
}

/// Tells what the program is doing now.
pub fn enter(phase: Phase) {
    PHASE.store(phase as u8, Ordering::SeqCst);
}

/// What an interruption is to lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// What is finished is saved.
    Save,
    /// The process ends; what is half done is forgotten, what is being written is written.
    Discard,
    /// [`STOP`] is set, and the program sees to it.
    Tell,
}

/// Handles interruptions from now on.
pub fn install(on: On) {
    let outcome = ctrlc::set_handler(match on {
        On::Save => save,
        On::Discard => discard,
        On::Tell => tell,
    });
    if let Err(e) = outcome {
        console::warning(format!("Ctrl-C will not save what is finished: {e}"));
    }
}

fn discard() {
    if PHASE.load(Ordering::SeqCst) != Phase::Writing as u8 {
        console::set_bar(None);
        std::process::exit(Code::Interrupted as i32);
    }
}

fn tell() {
    if STOP.swap(true, Ordering::SeqCst) {
        std::process::exit(Code::Failed as i32);
    }
}

fn save() {
    let phase = PHASE.load(Ordering::SeqCst);
    if phase == Phase::Preparing as u8 {
        console::line("error: interrupted before anything was rendered");
        std::process::exit(Code::Failed as i32);
    }
    if STOP.swap(true, Ordering::SeqCst) {
        console::line("error: aborted");
        std::process::exit(Code::Failed as i32);
    }
    console::line(if phase == Phase::Writing as u8 {
        "the picture is being written; Ctrl-C again aborts"
    } else if phase == Phase::Between as u8 {
        "stopping before the next frame; Ctrl-C again aborts"
    } else {
        "stopping and saving what is finished; Ctrl-C again aborts"
    });
}
