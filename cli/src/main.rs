//! The `resolvent` command: renders scenes and volumes, and says what is in files and plugins.
//!
//! Results go to standard output, everything else to standard error. Exit codes: 0 done, 1 something failed, 2 wrong
//! usage, input or plugin, 3 interrupted with the finished part saved.

mod args;
#[cfg(feature = "bench")]
mod bench;
mod check;
mod checkpoint;
mod compare;
mod console;
mod failure;
mod frames;
mod guess;
mod info;
mod input;
mod interrupt;
mod merge;
mod output;
mod overrides;
mod plugin;
mod progress;
mod render;
mod roles;
mod sequence;
mod stats;
mod system;
mod template;
mod usd;
mod values;
mod volume;
mod watch;

use clap::Parser;
use failure::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        let text = panic.to_string().replace('\n', " ");
        // `println!` knows no other way to tell that it cannot print. A reader that has had enough (`resolvent info … | head`) is
        // no error.
        match text.split_once("failed printing to stdout: ") {
            Some((_, why)) if why.contains("Broken pipe") => {}
            Some((_, why)) => {
                console::line(&format!("error: cannot write to standard output: {why}"))
            }
            None => console::line(&format!(
                "error: internal error, a bug in resolvent: {text}"
            )),
        }
    }));
    let args = args::Args::parse();
    let outcome = std::panic::catch_unwind(|| match args.command {
        args::Command::Render(a) => render::run(&a),
        args::Command::Convert(a) => usd::convert(&a),
        args::Command::Export(a) => usd::export(&a),
        args::Command::Info(a) => info::run(&a),
        args::Command::Compare(a) => compare::run(&a),
        args::Command::Merge(a) => merge::run(&a),
        #[cfg(feature = "bench")]
        args::Command::Bench(a) => bench::run(&a),
        args::Command::Plugin(a) => plugin::run(&a),
        args::Command::Schema(a) => plugin::schema(&a),
    });
    match outcome {
        Ok(Ok(code)) => code.into(),
        Ok(Err(Failure { code, message })) => {
            console::line(&format!("error: {message}"));
            code.into()
        }
        Err(_) => failure::Code::Failed.into(),
    }
}
