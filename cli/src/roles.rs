//! What the files of a command are for: none that is written is another one of them.

use crate::args::Render;
use crate::failure::{Outcome, input};
use crate::output::Target;
use resolvent_engine::plugin::Registry;
use resolvent_scene::Scene;
use std::path::{Path, PathBuf};

struct File {
    /// Where links lead to.
    path: PathBuf,
    /// What it is for, as messages say it.
    role: &'static str,
    written: bool,
}

/// The files that a command reads and writes.
#[derive(Default)]
pub struct Roles(Vec<File>);

impl Roles {
    /// The files that the command line of a render names.
    pub fn of_render(a: &Render, targets: &[Target]) -> Outcome<Self> {
        let mut roles = Self::default();
        roles.read("the input", &a.input)?;
        for t in targets {
            roles.write("-o", t.path())?;
        }
        for (option, file) in [
            ("--checkpoint", &a.aim.checkpoint),
            ("--stats", &a.stats),
            ("--save-scene", &a.save_scene),
            ("--report", &a.stage.report),
        ] {
            if let Some(file) = file {
                roles.write(option, file)?;
            }
        }
        Ok(roles)
    }

    /// Another file that is read.
    pub fn read(&mut self, role: &'static str, path: &Path) -> Outcome<()> {
        // What is not there, nobody can lose.
        match path.canonicalize() {
            Ok(file) => self.add(path, file, role, false),
            Err(_) => Ok(()),
        }
    }

    /// Another file that is written.
    pub fn write(&mut self, option: &'static str, path: &Path) -> Outcome<()> {
        let file = resolvent_image::destination(path).map_err(input)?;
        self.add(path, file, option, true)
    }

    /// The files that a scene names are read, whatever a text in it may name: no plugin is loaded to tell.
    pub fn read_scene(&mut self, scene: &Scene, registry: &Registry) -> Outcome<()> {
        // What is not there yet cannot be a file that is read.
        if !self.0.iter().any(|f| f.written && f.path.exists()) {
            return Ok(());
        }
        let files = crate::watch::of_scene(scene, registry);
        let mut files = files.iter();
        files.try_for_each(|file| self.read("a file of the scene", file))
    }

    fn add(
        &mut self,
        name: &Path,
        path: PathBuf,
        role: &'static str,
        written: bool,
    ) -> Outcome<()> {
        let mut others = self.0.iter();
        if let Some(other) = others.find(|o| (o.written || written) && o.path == path) {
            let name = name.display();
            return Err(input(if other.role == role {
                format!("{role} {name} is given twice")
            } else {
                let other = other.role;
                format!("{name}: is {other} and {role}: one would replace the other")
            }));
        }
        self.0.push(File {
            path,
            role,
            written,
        });
        Ok(())
    }
}
