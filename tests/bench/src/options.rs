//! The command line of `resolvent bench`.

use crate::suite::Mode;
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  resolvent bench                                       every scene but the two heaviest, under five minutes on two cores
  resolvent bench --full --scaling -o docs/benchmarks   everything, with the growth of costs
  resolvent bench --scene cloud_sun --against mitsuba   beside a peer, in turn
  resolvent bench --compare old.json                    what changed since, and is it more than chance?
  resolvent bench --scene mist --build ../old/resolvent two builds in turn, the most exact comparison of all

Writes NAME.json, NAME.md, NAME.svg and NAME.png. Run it in Resolvent's source folder, where scenes and references are.";

/// Options of `bench`.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub struct Options {
    /// Three scenes for a moment, to see that everything works
    #[arg(long, group = "mode")]
    pub smoke: bool,
    /// All but the two heaviest scenes, at half the resolution (the default)
    #[arg(long, group = "mode")]
    pub quick: bool,
    /// Everything at full resolution: about an hour on two cores
    #[arg(long, group = "mode")]
    pub full: bool,
    /// Only these scenes
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub scene: Vec<String>,
    /// List the scenes and their purposes
    #[arg(long)]
    pub list: bool,
    /// CPU seconds of the longest run of each scene [default: 7, with --full 40]
    #[arg(long, value_name = "S", value_parser = positive)]
    pub budget: Option<f64>,
    /// Seed of all runs
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Threads; 0 is one per processor
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Integrator plugin instead of the scenes' own
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Where results go; extensions are added
    #[arg(short, long, value_name = "NAME", default_value = "bench")]
    pub output: PathBuf,
    /// Print only results
    #[arg(short, long)]
    pub quiet: bool,

    /// Run a peer in the same session: mitsuba, mitsuba-scalar, cycles
    #[arg(
        long,
        value_name = "PEER",
        value_delimiter = ',',
        help_heading = "Comparisons"
    )]
    pub against: Vec<String>,
    /// Python that has the peer installed
    #[arg(
        long,
        value_name = "PATH",
        default_value = "python3",
        help_heading = "Comparisons"
    )]
    pub python: String,
    /// Run another build of this program in the same session
    #[arg(long, value_name = "EXE", help_heading = "Comparisons")]
    pub build: Vec<PathBuf>,
    /// Compare with earlier results
    #[arg(long, value_name = "FILE.json", help_heading = "Comparisons")]
    pub compare: Option<PathBuf>,
    /// End with exit code 1 if the same error certainly costs more than then
    #[arg(long, requires = "compare", help_heading = "Comparisons")]
    pub fail: bool,

    /// Measure the growth of costs as well
    #[arg(long, help_heading = "Scaling")]
    pub scaling: bool,
    /// Measure nothing else
    #[arg(long, help_heading = "Scaling")]
    pub only_scaling: bool,
    /// Only these series: optical_thickness, voxels, depth, media, lights, pixels, threads
    #[arg(
        long,
        value_name = "NAME",
        value_delimiter = ',',
        help_heading = "Scaling"
    )]
    pub series: Vec<String>,

    /// Make the scenes' references instead
    #[arg(long, help_heading = "References")]
    pub make_references: bool,
    /// Integrator that makes them
    #[arg(
        long,
        value_name = "NAME",
        default_value = "bdpt",
        help_heading = "References"
    )]
    pub reference_integrator: String,
    /// CPU seconds for each
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = positive, help_heading = "References")]
    pub reference_seconds: f64,
    /// Make the reference of one scene of these pictures, which differ by their seeds
    #[arg(long, value_name = "FILE.exr", num_args = 1.., requires_all = ["make_references", "by"], help_heading = "References")]
    pub from: Vec<PathBuf>,
    /// What made them
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true,
        help_heading = "References"
    )]
    pub by: String,
    /// Write the scenes that are made at run time into a folder
    #[arg(long, value_name = "DIR", help_heading = "References")]
    pub write_scenes: Option<PathBuf>,
    /// Resolvent's source folder [default: the first that holds this folder or this program]
    #[arg(long, value_name = "DIR")]
    pub root: Option<PathBuf>,
}

impl Options {
    /// How much is run.
    pub fn mode(&self) -> Mode {
        match (self.smoke, self.full) {
            (true, _) => Mode::Smoke,
            (_, true) => Mode::Full,
            _ => Mode::Quick,
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err("a positive number is needed".into()),
    }
}
