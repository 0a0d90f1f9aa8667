//! One render of `--watch` in a process of its own: both sides.
//!
//! The process says line by line on its standard output what files it is about to read. It ends when its standard input does:
//! then whoever started it is gone.

use super::files::{Stamp, stamp};
use crate::args::Render;
use crate::failure::{Code, Outcome, failed};
use crate::output::Target;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// First member of the lines that are ours: a plugin may print, too.
const MARK: &str = "resolvent_reads";
/// How long a process that is asked to end may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// True in the process of a render.
static WATCHED: AtomicBool = AtomicBool::new(false);

/// The process of a render begins.
pub fn begin() {
    WATCHED.store(true, Ordering::Relaxed);
    std::thread::spawn(|| {
        let end = std::io::stdin().read_to_end(&mut Vec::new());
        drop(end);
        std::process::exit(Code::Interrupted as i32);
    });
}

/// Says that files are about to be read. Nothing happens where nobody watches.
pub fn reads<P: AsRef<Path>>(files: impl IntoIterator<Item = P>) {
    if !WATCHED.load(Ordering::Relaxed) {
        return;
    }
    let mut out = std::io::stdout().lock();
    for file in files {
        let path = std::path::absolute(&file).unwrap_or_else(|_| file.as_ref().to_path_buf());
        let line = json!({MARK: path.as_os_str().as_bytes(), "stamp": stamp(&path)});
        // If nobody is left to hear it, standard input ends, too.
        drop(writeln!(out, "{line}"));
    }
    drop(out.flush());
}

/// The watching side of a render.
pub struct Attempt {
    child: Child,
    heard: Receiver<(PathBuf, Option<Stamp>)>,
}

impl Attempt {
    /// Starts a render with the options of this process.
    pub fn start(a: &Render, targets: &[Target]) -> Outcome<Self> {
        // The program itself may be replaced by another in the meantime, which would not know these plugins.
        let own = Path::new("/proc/self/exe");
        let program = match own.exists() {
            true => own.to_path_buf(),
            false => std::env::current_exe().map_err(failed)?,
        };
        let mut args = std::env::args_os();
        let mut command = Command::new(program);
        command.arg0(args.next().unwrap_or_else(|| "resolvent".into()));
        command.args(args.next()).arg("--watched");
        if a.output.is_empty() {
            // The name that was chosen for want of one.
            for t in targets {
                command.arg("-o").arg(t.path());
            }
        }
        command
            .args(args)
            // What it starts (Python, for USD stages) ends with it.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        let mut child = command.spawn().map_err(failed)?;
        let heard = listen(&mut child);
        Ok(Self { child, heard })
    }

    /// The files that it has named by now, after waiting for a while or until it names one.
    pub fn heard(&self, wait: Duration) -> Vec<(PathBuf, Option<Stamp>)> {
        let start = Instant::now();
        match self.heard.recv_timeout(wait) {
            Ok(first) => std::iter::once(first)
                .chain(self.heard.try_iter())
                .collect(),
            Err(_) => {
                // Where nothing more can come there is no waiting.
                std::thread::sleep(wait.saturating_sub(start.elapsed()).min(wait / 5));
                Vec::new()
            }
        }
    }

    /// How it has ended, once it has.
    pub fn ended(&mut self) -> Outcome<Option<ExitStatus>> {
        self.child.try_wait().map_err(failed)
    }

    /// The last files that it named before its end.
    pub fn rest(self) -> impl Iterator<Item = (PathBuf, Option<Stamp>)> {
        // What it has started itself may keep the pipe open.
        std::iter::from_fn(move || self.heard.recv_timeout(Duration::from_millis(200)).ok())
    }

    /// What the names of its copies of libraries begin with.
    pub fn mark(&self) -> String {
        format!(".{}-", self.child.id())
    }

    /// Ends it: before it writes its picture, or after that. Returns its mark.
    pub fn end(mut self) -> String {
        let group = Pid::from_raw(self.child.id() as i32);
        let _ = killpg(group, Signal::SIGTERM);
        let start = Instant::now();
        while matches!(self.child.try_wait(), Ok(None)) {
            if start.elapsed() > PATIENCE {
                let _ = killpg(group, Signal::SIGKILL);
                drop(self.child.wait());
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        self.mark()
    }
}

/// The lines that are ours, as they come.
fn listen(child: &mut Child) -> Receiver<(PathBuf, Option<Stamp>)> {
    let (send, receive) = channel();
    if let Some(out) = child.stdout.take() {
        std::thread::spawn(move || {
            for line in BufReader::new(out).split(b'\n').map_while(Result::ok) {
                if let Some(noted) = read(&line)
                    && send.send(noted).is_err()
                {
                    return;
                }
            }
        });
    }
    receive
}

fn read(line: &[u8]) -> Option<(PathBuf, Option<Stamp>)> {
    let line: Value = serde_json::from_slice(line).ok()?;
    let path: Vec<u8> = serde_json::from_value(line[MARK].clone()).ok()?;
    let stamp = serde_json::from_value(line["stamp"].clone()).ok()?;
    Some((OsString::from_vec(path).into(), stamp))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsStr;

    #[test]
    fn lines_of_others_are_left_out() {
        assert!(read(b"loaded!").is_none());
        assert!(read(b"{\"resolvent_reads\": 3}").is_none());
        let path = OsStr::from_bytes(b"/a\xff b");
        let line = json!({MARK: path.as_bytes(), "stamp": [1, 2, 3, 4, 5]}).to_string();
        assert_eq!(
            read(line.as_bytes()),
            Some((path.into(), Some([1, 2, 3, 4, 5])))
        );
    }
}
