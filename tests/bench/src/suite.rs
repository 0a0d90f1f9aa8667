//! The benchmark scenes.

use crate::error::{Error, Result};
use crate::generate;
use crate::score::Picture;
use std::path::{Path, PathBuf};

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mode {
    /// Three scenes for a moment: does everything work?
    Smoke,
    /// All but the two heaviest scenes at half the resolution, in less than five minutes on two cores.
    Quick,
    /// Everything at full resolution.
    Full,
}

impl Mode {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Smoke => "smoke",
            Mode::Quick => "quick",
            Mode::Full => "full",
        }
    }
}

/// Where a scene comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// `scenes/bench/NAME.json`.
    File,
    /// A volume of 50 million voxels.
    Big,
    /// A thousand overlapping media.
    Puffs,
    /// A thousand point lights.
    Lights,
    /// The scene whose converged picture this has, by `pt` with shared paths.
    Reuse,
}

/// What the converged picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Converged {
    /// `tests/bench/references/NAME.exr`.
    Stored,
    /// That of another case, of which this is another rendering.
    Of(&'static str),
    /// The same in every pixel.
    Constant(f64),
}

/// A benchmark scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// What it is for, in one sentence.
    pub purpose: &'static str,
    /// Where it comes from.
    pub source: Source,
    /// Its converged picture.
    pub converged: Converged,
    /// The smallest mode that runs it.
    pub mode: Mode,
}

impl Case {
    /// The case that has the same converged picture.
    fn picture(&self) -> &'static str {
        match self.converged {
            Converged::Of(name) => name,
            _ => self.name,
        }
    }
}

const fn case(name: &'static str, mode: Mode, purpose: &'static str) -> Case {
    Case {
        name,
        purpose,
        source: Source::File,
        converged: Converged::Stored,
        mode,
    }
}

const fn reuse(name: &'static str, of: &'static str, purpose: &'static str) -> Case {
    Case {
        source: Source::Reuse,
        converged: Converged::Of(of),
        ..case(name, Mode::Quick, purpose)
    }
}

/// All scenes.
pub const CASES: &[Case] = &[
    case(
        "cloud_sun",
        Mode::Quick,
        "The main case: a cloud of optical thickness 60, peaked forward scattering, a sun without size and a dim sky.",
    ),
    case(
        "grazing",
        Mode::Quick,
        "The same cloud with the sun at the horizon beside it, so that light comes through thin rims and long chords.",
    ),
    case(
        "smoke_area",
        Mode::Quick,
        "Real smoke of optical thickness 6 over a floor under a small area light.",
    ),
    case(
        "chromatic",
        Mode::Smoke,
        "Extinction 1 : 3 : 9 over red, green and blue, where one channel's choices must not ruin the others.",
    ),
    Case {
        converged: Converged::Constant(1.0),
        ..case(
            "cloud_env",
            Mode::Quick,
            "A white cloud in a white sky, where every pixel is exactly 1 and any loss of energy shows.",
        )
    },
    case(
        "absorb_env",
        Mode::Quick,
        "Smoke that only absorbs: the exact picture is a quadrature, and shows misplaced voxels.",
    ),
    case(
        "fire",
        Mode::Quick,
        "Light from emission alone: a hot, absorbing plume that glows as a black body, in the dark.",
    ),
    case(
        "mist",
        Mode::Quick,
        "Thin mist in which a spot light through slats makes shafts of light: few collisions, hard shadows.",
    ),
    case(
        "milk",
        Mode::Quick,
        "A glass of milk: dense, nearly white scattering behind two refracting boundaries that next-event estimation cannot pass.",
    ),
    case(
        "box_fog",
        Mode::Quick,
        "Thin fog in a box with an area light: surfaces and a medium share the light.",
    ),
    reuse(
        "fog_reuse",
        "box_fog",
        "The same by `pt` with `reuse` 4: blocks of pixels share what their paths find.",
    ),
    case(
        "surface_only",
        Mode::Smoke,
        "The same box without any medium: what surfaces alone cost.",
    ),
    reuse(
        "surface_reuse",
        "surface_only",
        "The same by `pt` with `reuse` 4: blocks of pixels share what their paths find.",
    ),
    Case {
        source: Source::Lights,
        ..case(
            "many_lights",
            Mode::Smoke,
            "A thousand point lights over a floor, of which each place needs a few.",
        )
    },
    Case {
        source: Source::Puffs,
        ..case(
            "puffs",
            Mode::Full,
            "A thousand media that overlap, of which each ray meets dozens.",
        )
    },
    Case {
        source: Source::Big,
        ..case(
            "big",
            Mode::Full,
            "A volume of 50 million voxels: loading, memory, and look-ups that miss the caches.",
        )
    },
];

/// Width and height of scenes made at run time.
const MADE: [u32; 2] = [160, 120];
/// Voxels of the big one.
const BIG: f64 = 50e6;

/// Where the scenes and references are.
#[derive(Clone, Debug)]
pub struct Suite {
    /// The repository.
    pub root: PathBuf,
}

impl Suite {
    /// Looks in a folder, or else in and above the current folder and the program's.
    pub fn find(given: Option<&Path>) -> Result<Self> {
        let has = |p: &Path| p.join("scenes/bench/cloud_sun.json").is_file();
        if let Some(root) = given {
            return if has(root) {
                Ok(Self { root: root.into() })
            } else {
                Err(Error::invalid(format!(
                    "--root {}: has no scenes/bench/cloud_sun.json; give Resolvent's source folder",
                    root.display()
                )))
            };
        }
        let starts = [std::env::current_dir().ok(), std::env::current_exe().ok()];
        starts
            .iter()
            .flatten()
            .flat_map(|p| p.ancestors())
            .find(|p| has(p))
            .map(|root| Self { root: root.into() })
            .ok_or_else(|| {
                Error::invalid(
                    "the benchmark scenes are in Resolvent's source folder: run this there, or name it with --root",
                )
            })
    }

    /// The cases of a mode, or those named.
    pub fn cases(&self, mode: Mode, named: &[String]) -> Result<Vec<&'static Case>> {
        if named.is_empty() {
            return Ok(CASES.iter().filter(|c| c.mode <= mode).collect());
        }
        named
            .iter()
            .map(|n| {
                CASES.iter().find(|c| c.name == n).ok_or_else(|| {
                    let known: Vec<_> = CASES.iter().map(|c| c.name).collect();
                    Error::invalid(format!(
                        "--scene {n}: there is no such scene; there are {}",
                        known.join(", ")
                    ))
                })
            })
            .collect()
    }

    /// The scene's file; scenes that are made are written into `work`.
    pub fn scene(&self, case: &Case, work: &Path) -> Result<PathBuf> {
        let path = work.join(format!("{}.json", case.name));
        let scene = match case.source {
            Source::File => {
                return Ok(self
                    .root
                    .join("scenes/bench")
                    .join(format!("{}.json", case.name)));
            }
            Source::Big => generate::ball(BIG, 20.0, MADE, &work.join("big.vdb"))?,
            Source::Puffs => generate::puffs(1000, 0.18, [96, 72]),
            Source::Lights => generate::lights(1000, MADE),
            Source::Reuse => {
                let plain = self.root.join("scenes/bench");
                let plain = plain.join(format!("{}.json", case.picture()));
                let mut scene = generate::read(&plain)?;
                scene["integrator"]["params"]["reuse"] = 4.into();
                scene
            }
        };
        generate::write(&scene, &path)?;
        Ok(path)
    }

    /// Where the converged picture is stored.
    pub fn reference_path(&self, case: &Case) -> PathBuf {
        self.root
            .join("tests/bench/references")
            .join(format!("{}.exr", case.picture()))
    }

    /// The converged picture at a scene's resolution divided by `coarser`.
    pub fn reference(&self, case: &Case, size: [usize; 2], coarser: usize) -> Result<Picture> {
        let full = match case.converged {
            Converged::Constant(v) => Picture {
                size,
                color: vec![[v; 3]; size[0] * size[1]],
                variance: None,
            },
            Converged::Stored | Converged::Of(_) => Picture::read(&self.reference_path(case))?,
        };
        if full.size != size {
            return Err(Error::invalid(format!(
                "{}: {} x {} pixels for a scene of {} x {}",
                self.reference_path(case).display(),
                full.size[0],
                full.size[1],
                size[0],
                size[1]
            )));
        }
        Ok(if coarser > 1 {
            full.coarser(coarser)
        } else {
            full
        })
    }
}

/// Width and height that a scene asks for.
pub fn resolution(scene: &Path) -> Result<[usize; 2]> {
    let value = generate::read(scene)?;
    let side = |k: usize| value["film"]["resolution"][k].as_u64().map(|v| v as usize);
    match (side(0), side(1)) {
        (Some(w), Some(h)) => Ok([w, h]),
        _ => Err(Error::invalid(format!(
            "{}: no film resolution",
            scene.display()
        ))),
    }
}
