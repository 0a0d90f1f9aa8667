//! The command line.

use crate::failure::{Outcome, input};
use crate::frames::Frames;
use crate::values::{
    Color, MaybeColor, MaybeDirection, Samples, Size, View, Window, cosine, finite, layer,
    positive, share,
};
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use resolvent_engine::plugin::Registry;
use resolvent_scene::Aov;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  resolvent render cloud.vdb -o cloud.png          a VDB file, with camera and light chosen for it
  resolvent render model.glb -o model.png          a glTF model, with its own camera and lights if it has some
  resolvent render scene.json -o out.exr -o out.png --spp 256
  resolvent render shot.usd -o shot.exr --frame 12 a USD stage; `convert` writes its scene
  resolvent info cloud.vdb                         its grids, bounds and optical thickness
  resolvent compare out.exr reference.exr          is the difference more than noise?
  resolvent plugin list                            media, phase functions, materials, integrators

Exit codes: 0 done, 1 something failed, 2 wrong usage, input or plugin, 3 interrupted with the finished part saved.";

/// Physically based rendering of volumes
#[derive(Debug, Parser)]
#[command(name = "resolvent", version, after_help = EXAMPLES)]
pub struct Args {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene, or a VDB file, glTF model or USD stage as it is
    Render(Box<Render>),
    /// Convert a USD stage to a scene
    Convert(Convert),
    /// Write a scene as a USD stage
    Export(Export),
    /// Say what is in a VDB file, a glTF model, a scene or an EXR image
    Info(Info),
    /// Compare an image with a reference
    Compare(Compare),
    /// Merge checkpoints of disjoint sample ranges into one picture
    Merge(Merge),
    /// Measure time against error on the benchmark scenes
    #[cfg(feature = "bench")]
    Bench(Box<resolvent_bench::Options>),
    /// List plugins, or describe one
    Plugin(Plugin),
    /// Print the JSON Schema of scene files, with the parameters of all plugins found
    Schema(Schema),
}

const RENDER_EXAMPLES: &str = "\
Examples:
  resolvent render cloud.vdb -o cloud.png
  resolvent render cloud.vdb --optical-thickness 20 --sun 1,0.3,0.5 --save-scene cloud.json
  resolvent render scene.json -o out.exr --time 60 --aov depth,variance
  resolvent render scene.json -o tile.exr --crop 0,0,320,180
  resolvent render scene.json -o out.exr --spp 4096 --checkpoint out.ckpt --resume    (again after a crash)
  resolvent render scene.json --sample-range 64..128 --checkpoint b.ckpt    (resolvent merge a.ckpt b.ckpt -o out.exr)
  resolvent render scene.json -o out.png --spp 16 --watch    (again after every change, until Ctrl-C)
  resolvent render shot.usd --frames 1-100:2 -o shot.####.exr

Ctrl-C ends the rendering and saves what is finished (exit code 3); a second Ctrl-C aborts at once. Of a sequence it says which frames are left; frames that are there already are rendered again, unless --checkpoint shot.####.ckpt --resume has their sums.";

/// Options of `render`.
#[derive(Clone, Debug, ClapArgs)]
#[command(after_help = RENDER_EXAMPLES, allow_negative_numbers = true)]
pub struct Render {
    /// A scene (.json), an OpenVDB file (.vdb), a glTF model (.gltf, .glb) or a USD stage (.usd, .usda, .usdc, .usdz)
    pub input: PathBuf,
    /// Picture to write, .exr or .png; may be given several times [default: the input's name with .exr, in the current
    /// folder]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Samples per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), group = "budget", help_heading = "Sampling")]
    pub spp: Option<u64>,
    /// Sample for so many seconds
    #[arg(long, value_name = "S", value_parser = positive, group = "budget", help_heading = "Sampling")]
    pub time: Option<f64>,
    /// Sample every tile until its estimated relative error (root mean square) is at most this, such as 0.02
    #[arg(long, value_name = "E", value_parser = positive, group = "budget", help_heading = "Sampling")]
    pub error: Option<f64>,
    /// Take samples A up to, not including, B of every pixel's sequence; parts merge to one run
    #[arg(long, value_name = "A..B", group = "budget", help_heading = "Sampling")]
    pub sample_range: Option<Samples>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", help_heading = "Sampling")]
    pub seed: Option<u64>,
    /// Threads; 0 is one per processor. The picture does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Sampling")]
    pub threads: u16,
    /// Integrator plugin, by name or path
    #[arg(long, value_name = "NAME", help_heading = "Sampling")]
    pub integrator: Option<String>,
    /// Let blocks of N x N pixels share their paths (integrator pt): less noise in dense clouds at large sizes and in rooms, but
    /// noise that neighbours have in common
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8), help_heading = "Sampling")]
    pub reuse: Option<u8>,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", help_heading = "Picture")]
    pub resolution: Option<Size>,
    /// Render only this window; X1 and Y1 are outside of it
    #[arg(long, value_name = "X0,Y0,X1,Y1", help_heading = "Picture")]
    pub crop: Option<Window>,
    /// Further layers of EXR files: depth, albedo, normal (of the first collision or surface), variance (of each pixel's mean),
    /// error_95 (half the width of each pixel's 95 % interval), samples, or orders:N (light scattered 0, 1, ... N times, and the
    /// rest: layers that sum to the picture)
    #[arg(
        long,
        value_name = "LAYER",
        value_parser = layer,
        value_delimiter = ',',
        help_heading = "Picture"
    )]
    pub aov: Vec<Aov>,
    /// How PNG files are made
    #[command(flatten)]
    pub tone: Tone,

    /// What is kept of the work
    #[command(flatten)]
    pub aim: Aim,

    /// What to choose instead of guessing, for VDB files and models
    #[command(flatten)]
    pub guesses: Guesses,

    /// How to convert, for USD stages
    #[command(flatten)]
    pub stage: Stage,

    /// Where to look for plugins first
    #[command(flatten)]
    pub plugins: PluginPath,
    /// Write figures about the run: plugins, files, memory, counts, times
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Write the scene as it is rendered, options and guesses included
    #[arg(long, value_name = "FILE.json")]
    pub save_scene: Option<PathBuf>,
    /// Render again whenever the input, a file that it names or a plugin in use changes; a change ends the render in progress. Errors are
    /// shown, and leave the last picture as it is. Ctrl-C ends it
    #[arg(long, conflicts_with_all = ["checkpoint", "save_scene", "frames"])]
    pub watch: bool,
    /// One render of --watch: for the process that it starts
    #[arg(long, hide = true)]
    pub watched: bool,
    /// Print only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Options of USD stages.
#[derive(Clone, Debug, Default, ClapArgs)]
#[command(next_help_heading = "USD stages")]
pub struct Stage {
    /// Time code [default: the stage's start]
    #[arg(long, value_name = "T", value_parser = finite, allow_hyphen_values = true)]
    pub frame: Option<f64>,
    /// A sequence, one file after the other: #### in its name is the frame's number, else .0001 goes before the suffix
    #[arg(
        long,
        value_name = "A-B[:STEP]",
        conflicts_with = "frame",
        allow_hyphen_values = true
    )]
    pub frames: Option<Frames>,
    /// Select a variant; may be given several times
    #[arg(long, value_name = "/PRIM{SET=SELECTION}")]
    pub variant: Vec<String>,
    /// Purposes that are drawn [default: those of the render settings, else default,render]
    #[arg(long, value_name = "LIST")]
    pub purpose: Option<String>,
    /// The camera [default: that of the render settings, else the first]
    #[arg(long, value_name = "/PRIM")]
    pub stage_camera: Option<String>,
    /// The RenderSettings prim [default: the stage's own]
    #[arg(long, value_name = "/PRIM")]
    pub render_settings: Option<String>,
    /// Level of subdivision surfaces [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=6))]
    pub subdivision: Option<u8>,
    /// Write everything that was lost
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Any loss is an error
    #[arg(long)]
    pub strict: bool,
    /// Leave out prims with errors and convert the rest
    #[arg(long)]
    pub keep_going: bool,
}

impl Stage {
    /// The first option given, for inputs that take none.
    pub fn given(&self) -> Option<&'static str> {
        first(&[
            ("--frame", self.frame.is_some()),
            ("--frames", self.frames.is_some()),
            ("--variant", !self.variant.is_empty()),
            ("--purpose", self.purpose.is_some()),
            ("--stage-camera", self.stage_camera.is_some()),
            ("--render-settings", self.render_settings.is_some()),
            ("--subdivision", self.subdivision.is_some()),
            ("--report", self.report.is_some()),
            ("--strict", self.strict),
            ("--keep-going", self.keep_going),
        ])
    }
}

/// Options of `export`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "Example:\n  resolvent export scene.json -o scene.usda")]
pub struct Export {
    /// The scene (.json)
    pub scene: PathBuf,
    /// The stage to write (.usda, .usdc, .usd)
    #[arg(short, long, value_name = "STAGE.usda")]
    pub output: PathBuf,
    /// Write everything that was lost
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Any loss is an error
    #[arg(long)]
    pub strict: bool,
}

/// Options of `convert`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Examples:\n  resolvent convert shot.usd -o shot.json --frame 12\n  resolvent convert shot.usd -o shot.####.json --frames 1-100:2 --report losses.json\n\nMeshes and tables of instances go into a folder beside the scene. What is not converted in full is said, and listed by --report."
)]
pub struct Convert {
    /// The stage (.usd, .usda, .usdc, .usdz)
    pub stage: PathBuf,
    /// The scene to write
    #[arg(short, long, value_name = "SCENE.json")]
    pub output: PathBuf,
    /// How to convert
    #[command(flatten)]
    pub options: Stage,
}

/// How PNG files are made.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Picture")]
pub struct Tone {
    /// Exposure of PNG files, in stops
    #[arg(long, value_name = "STOPS", value_parser = finite, default_value_t = 0.0, allow_negative_numbers = true)]
    pub exposure: f64,
    /// How PNG files bring large values into the display's range
    #[arg(long, value_name = "CURVE", value_enum, default_value_t = ToneCurve::Filmic)]
    pub tone_map: ToneCurve,
}

/// What is kept of the work.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Checkpoints")]
pub struct Aim {
    /// Keep the exact sums in this file: now and then while rendering, and at the end
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Seconds between checkpoints: so much work may be lost by a crash
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 60.0, requires = "checkpoint")]
    pub every: f64,
    /// Go on from the checkpoint if there is one: the picture has the same bits as that of a render that was not interrupted
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,
}

/// Options that replace guesses about a VDB file or a model.
#[derive(Clone, Debug, Default, ClapArgs)]
#[command(next_help_heading = "VDB files and models (each replaces a guess)")]
pub struct Guesses {
    /// Grid of densities
    #[arg(long, value_name = "NAME")]
    pub grid: Option<String>,
    /// Extinction per world unit where the grid is 1
    #[arg(long, value_name = "X", value_parser = positive)]
    pub density_scale: Option<f64>,
    /// Choose the density scale so that the volume has this optical thickness
    #[arg(long, value_name = "T", value_parser = positive, conflicts_with = "density_scale")]
    pub optical_thickness: Option<f64>,
    /// Share of the extinction that is scattering: one number or R,G,B
    #[arg(long, value_name = "A", value_parser = share)]
    pub albedo: Option<Color>,
    /// Mean cosine of the phase function (Henyey-Greenstein)
    #[arg(long, value_name = "G", value_parser = cosine, allow_hyphen_values = true)]
    pub g: Option<f64>,
    /// Direction towards the sun, or none
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub sun: Option<MaybeDirection>,
    /// The sun's irradiance on a plane facing it: one number or R,G,B
    #[arg(long, value_name = "E")]
    pub sun_irradiance: Option<Color>,
    /// Radiance of the sky: one number or R,G,B, or none
    #[arg(long, value_name = "L")]
    pub sky: Option<MaybeColor>,
    /// Where the camera stands and the point it looks at
    #[arg(long, value_name = "X,Y,Z,TX,TY,TZ", allow_hyphen_values = true)]
    pub camera: Option<View>,
    /// Full horizontal field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = positive)]
    pub fov: Option<f64>,
    /// The axis that is up
    #[arg(long, value_name = "AXIS", value_enum)]
    pub up: Option<Up>,
    /// Grid of temperatures that glows as a black body, or none
    #[arg(long, value_name = "NAME")]
    pub temperature_grid: Option<String>,
    /// Grid of emission, or none
    #[arg(long, value_name = "NAME")]
    pub flame_grid: Option<String>,
    /// Factor on what these two emit
    #[arg(long, value_name = "X", value_parser = positive)]
    pub emission_scale: Option<f64>,
}

impl Guesses {
    /// The first option given, for inputs that take none.
    pub fn given(&self) -> Option<&'static str> {
        self.of_volumes().or_else(|| self.of_all())
    }

    /// The first option given that only volumes take.
    pub fn of_volumes(&self) -> Option<&'static str> {
        first(&[
            ("--grid", self.grid.is_some()),
            ("--density-scale", self.density_scale.is_some()),
            ("--optical-thickness", self.optical_thickness.is_some()),
            ("--albedo", self.albedo.is_some()),
            ("--g", self.g.is_some()),
            ("--temperature-grid", self.temperature_grid.is_some()),
            ("--flame-grid", self.flame_grid.is_some()),
            ("--emission-scale", self.emission_scale.is_some()),
        ])
    }

    fn of_all(&self) -> Option<&'static str> {
        first(&[
            ("--sun", self.sun.is_some()),
            ("--sun-irradiance", self.sun_irradiance.is_some()),
            ("--sky", self.sky.is_some()),
            ("--camera", self.camera.is_some()),
            ("--fov", self.fov.is_some()),
            ("--up", self.up.is_some()),
        ])
    }
}

/// The name of the first that is given.
fn first(all: &[(&'static str, bool)]) -> Option<&'static str> {
    all.iter().find(|(_, given)| *given).map(|(name, _)| *name)
}

/// The axis that is up.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Up {
    /// As Houdini has it
    Y,
    /// As Blender has it
    Z,
}

/// Where to look for plugins.
#[derive(Clone, Debug, ClapArgs)]
pub struct PluginPath {
    /// Look for plugins here first, then in RESOLVENT_PLUGIN_PATH and beside the program; may be given several times
    #[arg(long, value_name = "DIR")]
    pub plugin_path: Vec<PathBuf>,
}

impl PluginPath {
    /// The plugins in these folders and in those that are always searched.
    pub fn registry(&self) -> Outcome<Registry> {
        match self.plugin_path.iter().find(|p| !p.is_dir()) {
            Some(none) => Err(input(format!(
                "--plugin-path {}: there is no such folder",
                none.display()
            ))),
            None => Ok(Registry::new(&self.plugin_path)),
        }
    }
}

/// Curves of PNG files.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum ToneCurve {
    /// Values above 1 are white
    Srgb,
    /// Large values fade into white (Narkowicz's fit of the ACES curve)
    Filmic,
}

/// Options of `info`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Examples:\n  resolvent info cloud.vdb\n  resolvent info scene.json\n  resolvent info out.exr --json"
)]
pub struct Info {
    /// A VDB file, a glTF model, a scene or an EXR image
    pub file: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Options of `compare`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Examples:\n  resolvent compare out.exr reference.exr\n  resolvent compare out.exr reference.exr --fail && echo same picture\n\nThe z-test needs a layer `variance` in at least one of the images (render with --aov variance). With a layer `error_95`, the share of values is told that differ by no more than the intervals allow: 95 % if only noise differs."
)]
pub struct Compare {
    /// The image
    pub image: PathBuf,
    /// The reference
    pub reference: PathBuf,
    /// Regions of the z-test, across and down
    #[arg(long, value_name = "WxH", default_value = "8x8")]
    pub regions: Size,
    /// End with exit code 1 if noise does not explain the difference
    #[arg(long)]
    pub fail: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Options of `merge`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Examples:\n  resolvent render scene.json --sample-range 0..64 --checkpoint a.ckpt\n  resolvent render scene.json --sample-range 64..128 --checkpoint b.ckpt\n  resolvent merge a.ckpt b.ckpt -o out.exr\n\nThe picture has the same bits as that of one render of all samples. Ranges that meet at multiples of 64 (of 128 from sample 1024 on, of 256 from 4096 on ...) divide no net: then this holds for the variance of bdpt and light as well, and for the chains of mlt, of which every part of a net has its own."
)]
pub struct Merge {
    /// Checkpoints of the same scene, seed, integrator and layers
    #[arg(required = true, value_name = "CHECKPOINT")]
    pub checkpoints: Vec<PathBuf>,
    /// Picture to write, .exr or .png; may be given several times
    #[arg(
        short,
        long,
        value_name = "FILE",
        required_unless_present = "checkpoint"
    )]
    pub output: Vec<PathBuf>,
    /// Write the sums as a checkpoint
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// How PNG files are made
    #[command(flatten)]
    pub tone: Tone,
    /// Print only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Options of `plugin`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Examples:\n  resolvent plugin list\n  resolvent plugin info hg\n  resolvent plugin info target/release/libmine.so\n  resolvent plugin new soft-ball --kind medium --lang rust\n  resolvent plugin check target/release/libmine.so --isolate"
)]
pub struct Plugin {
    /// What to do
    #[command(subcommand)]
    pub action: PluginAction,
}

/// What to do with plugins.
#[derive(Debug, Subcommand)]
pub enum PluginAction {
    /// List the plugins found
    List {
        /// Print JSON
        #[arg(long)]
        json: bool,
        /// Where to look first
        #[command(flatten)]
        plugins: PluginPath,
    },
    /// Describe a plugin and its parameters
    Info {
        /// A plugin's name, or the path of its library
        name: String,
        /// Print JSON
        #[arg(long)]
        json: bool,
        /// Where to look first
        #[command(flatten)]
        plugins: PluginPath,
    },
    /// Write a complete plugin to start from: source, build file, test, scene
    New(New),
    /// Check that a plugin keeps the promises of its kind: statistics, edge cases, threads, memory
    Check(Check),
}

/// Options of `plugin new`.
#[derive(Debug, ClapArgs)]
pub struct New {
    /// The plugin's name, as in scenes
    pub name: String,
    /// What it is
    #[arg(long, value_enum)]
    pub kind: NewKind,
    /// What it is written in
    #[arg(long, value_enum, default_value_t = Language::Rust)]
    pub lang: Language,
    /// The folder to make [default: the name]
    #[arg(long, value_name = "DIR")]
    pub to: Option<PathBuf>,
    /// Folder of resolvent-api, for Rust [default: that of the sources beside the program, or the published one]
    #[arg(long, value_name = "DIR")]
    pub api: Option<PathBuf>,
}

/// Kinds of plugins.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum NewKind {
    /// What fills space
    Medium,
    /// How a surface scatters
    Bsdf,
    /// How a medium scatters
    Phase,
    /// How pictures are computed
    Integrator,
}

/// Languages that there are templates in.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Language {
    /// Against the crate resolvent-api
    Rust,
    /// Against resolvent.h
    C,
}

const CHECK_HELP: &str = "\
Example:
  resolvent plugin check target/release/libmine.so --isolate

Data races of a plugin in C or C++, found although the answers are right:
  cc -g -O1 -fsanitize=thread -shared -fPIC mine.c -o mine.so -lm
  LD_PRELOAD=libtsan.so.2 resolvent plugin check ./mine.so --brief";

/// Options of `plugin check`.
#[derive(Debug, ClapArgs)]
#[command(after_help = CHECK_HELP)]
pub struct Check {
    /// A plugin's name, or the path of its library
    pub plugin: String,
    /// Parameters to check it with, as JSON; those that are not given are varied over their ranges
    #[arg(long, value_name = "JSON")]
    pub params: Option<String>,
    /// Only what needs no statistics: declarations, determinism, threads, memory
    #[arg(long)]
    pub brief: bool,
    /// Check in a process of its own, so that a crash or a hang is reported like any other fault
    #[arg(long)]
    pub isolate: bool,
    /// Seconds without progress that count as a hang, with --isolate
    #[arg(long, value_name = "S", default_value_t = 120)]
    pub patience: u64,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Say every stage: for the process that --isolate starts
    #[arg(long, hide = true)]
    pub stages: bool,
    /// Where to look first
    #[command(flatten)]
    pub plugins: PluginPath,
}

/// Options of `schema`.
#[derive(Debug, ClapArgs)]
pub struct Schema {
    /// Where to look for plugins first
    #[command(flatten)]
    pub plugins: PluginPath,
}
