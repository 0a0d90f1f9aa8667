//! `resolvent render --watch`: a render after every change.
//!
//! Each render is a process of its own: it can be ended at any moment, a plugin that crashes takes nothing else along, and the libraries
//! it has loaded (from copies, see [`resolvent_engine::plugin::Registry::copying`]) go with it. It says what files it is about to read,
//! and in which state it found them; this process looks at these files now and then, and compares.
//!
//! Looking (size, time of change, place on the disk) instead of being told by the system: that sees files which are replaced by renaming,
//! which appear later, and which are on another machine, and costs about a microsecond a file.

mod attempt;
mod files;

pub use attempt::{begin, reads};
pub use files::of_scene;

use crate::args::Render;
use crate::console;
use crate::failure::{Code, Outcome};
use crate::interrupt::{self, On};
use crate::output::{self, Target};
use crate::roles::Roles;
use crate::system;
use attempt::Attempt;
use files::Files;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Time between looks at the files.
const TICK: Duration = Duration::from_millis(100);
/// Files are read once nothing has changed for this long: until then they may be written half.
const QUIET: Duration = Duration::from_millis(250);

/// Runs `render` again and again.
pub fn run(a: &Render) -> Outcome {
    console::set_quiet(a.quiet);
    interrupt::install(On::Tell);
    // What no change of a file can mend ends it at once.
    crate::input::of(a)?;
    let targets = output::targets(&a.output, Some(&a.input))?;
    Roles::of_render(a, &targets)?;
    if let Some(file) = &a.stats {
        output::check_writable(file)?;
    }
    a.plugins.registry()?;
    let written = targets.iter().map(Target::path).chain(a.stats.as_deref());
    let mut files = Files::sparing(written);
    loop {
        let changed = match once(a, &targets, &mut files)? {
            Some(file) => Some(file),
            None => wait(&mut files),
        };
        let Some(file) = changed else {
            return Ok(Code::Done);
        };
        console::info(format!("{} has changed", file.display()));
        settle(&mut files);
    }
}

/// One render, to its end or until a file changes, which is returned.
fn once(a: &Render, targets: &[Target], files: &mut Files) -> Outcome<Option<PathBuf>> {
    files.next_round();
    let mut attempt = Attempt::start(a, targets)?;
    let status = loop {
        for (path, stamp) in attempt.heard(TICK) {
            files.note(path, stamp);
        }
        if let Some(status) = attempt.ended()? {
            break status;
        }
        let changed = files.changed();
        if changed.is_some() || interrupted() {
            files.sweep(&attempt.end());
            return Ok(changed);
        }
    };
    let mark = attempt.mark();
    for (path, stamp) in attempt.rest() {
        files.note(path, stamp);
    }
    tell(status, files);
    if !status.success() {
        files.sweep(&mark);
    }
    Ok(None)
}

/// What came of a render, and what is next.
fn tell(status: ExitStatus, files: &mut Files) {
    if status.success() {
        files.forget_earlier_rounds();
        console::info(format!("watching {} files; Ctrl-C ends", files.len()));
        return;
    }
    // An error was told by whoever met it.
    if status.code().is_none() {
        let how = system::ending(status);
        console::line(&format!(
            "error: the render was broken off, most likely by a plugin: {how}"
        ));
    }
    if !interrupted() {
        console::info("no picture was written; the next change is waited for");
    }
}

/// Waits until a file changes, which is returned, or until Ctrl-C.
fn wait(files: &mut Files) -> Option<PathBuf> {
    loop {
        if interrupted() {
            return None;
        }
        let start = Instant::now();
        if let Some(file) = files.changed() {
            return Some(file);
        }
        // Where there are so many files that looking takes long, it is done less often.
        std::thread::sleep(TICK.max(20 * start.elapsed()));
    }
}

/// Waits until files no longer change.
fn settle(files: &mut Files) {
    let mut last = Instant::now();
    while last.elapsed() < QUIET && !interrupted() {
        std::thread::sleep(TICK / 2);
        if files.changed().is_some() {
            last = Instant::now();
        }
    }
}

fn interrupted() -> bool {
    interrupt::STOP.load(Ordering::SeqCst)
}
