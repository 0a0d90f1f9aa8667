//! Checkpoints of `resolvent render`: what they are of, when they are read, where they are written.

use crate::args::{Aim, Render};
use crate::console;
use crate::failure::{Failure, Outcome, failed, input};
use resolvent_engine::Rendered;
use resolvent_engine::checkpoint::{Checkpoint, State, difference, fingerprint};
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
use resolvent_scene as describe;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Refuses what would overwrite a checkpoint, before any work is done.
pub fn check(aim: &Aim) -> Outcome<()> {
    let Some(file) = &aim.checkpoint else {
        return Ok(());
    };
    crate::output::check_writable(file)?;
    if file.exists() && !aim.resume {
        return Err(input(format!(
            "{}: is there already: --resume goes on from it; remove it to begin anew",
            file.display()
        )));
    }
    resolvent_image::remove_leftovers(file);
    Ok(())
}

/// The checkpoint file of a render.
pub struct Keeper {
    file: PathBuf,
    /// What is rendered, and with what.
    pub identity: Value,
    /// Anything else worth telling.
    pub about: Value,
}

impl Keeper {
    /// The one asked for, if any.
    pub fn new(
        a: &Render,
        scene: &describe::Scene,
        registry: &Registry,
        integrator: &ForeignIntegrator,
    ) -> Outcome<Option<Self>> {
        let Some(file) = &a.aim.checkpoint else {
            return Ok(None);
        };
        Ok(Some(Self {
            file: file.clone(),
            identity: identity(scene, registry)?,
            about: json!({
                "input": a.input,
                "source": scene.source.file,
                "scene": scene.to_text().map_err(input)?,
                "integrator": integrator.title(),
            }),
        }))
    }

    /// What to go on from, if there is anything.
    pub fn load(&self) -> Outcome<Option<State>> {
        if !self.file.exists() {
            return Ok(None);
        }
        let found = Checkpoint::read(&self.file).map_err(input)?;
        let name = self.file.display();
        if let Some(d) = difference(&found.identity, &self.identity) {
            return Err(input(format!(
                "{name}: is of another render: {} is {} there and {} here",
                d.place, d.first, d.second
            )));
        }
        let samples = found.state.film.coverage(0).to_string();
        console::info(format!("going on from {name} (samples {samples})"));
        Ok(Some(found.state))
    }

    /// Why nothing goes on from it, with what can be done instead.
    pub fn refused(&self, why: &resolvent_engine::Error) -> String {
        let name = self.file.display();
        format!("{name}: {why}; `resolvent merge {name} -o FILE` writes what is there")
    }

    /// Writes it while rendering goes on: if that fails, the next time may be better.
    pub fn save(&self, bytes: &[u8]) {
        if let Err(e) = write(&self.file, bytes) {
            console::warning(format!("no checkpoint was written: {}", e.message));
        }
    }

    /// Writes what was done in the end.
    pub fn finish(&self, rendered: &Rendered) -> Outcome<()> {
        write(&self.file, &rendered.to_bytes(&self.identity, &self.about))
    }
}

/// Writes a checkpoint: the old one stays until the new one is on the disk.
pub fn write(file: &Path, bytes: &[u8]) -> Result<(), Failure> {
    resolvent_image::write_atomically(file, |out| {
        use std::io::Write;
        out.write_all(bytes)
            .map_err(|source| resolvent_image::Error::Io {
                file: file.to_path_buf(),
                what: "cannot write: ",
                source,
            })
    })
    .map_err(failed)
}

/// What must be the same for all parts of a picture: the scene, the files it names, the plugins, this program, and what has sums of
/// its own. What only says how long to sample, or which layers to write of the same sums, may differ.
fn identity(scene: &describe::Scene, registry: &Registry) -> Outcome<Value> {
    let mut text: Value = serde_json::from_str(&scene.to_text().map_err(input)?).map_err(failed)?;
    let of = |value: &mut Value, section: &str, names: &[&str]| {
        if let Some(section) = value.get_mut(section).and_then(Value::as_object_mut) {
            names.iter().for_each(|n| drop(section.shift_remove(*n)));
        }
    };
    of(&mut text, "sampling", &["spp", "time", "error"]);
    of(&mut text, "film", &["aovs"]);
    // Files are known by what is in them, not by where they are.
    let mut files = Map::new();
    for path in crate::info::named_files(scene, registry) {
        let name = path.file_name().unwrap_or(path.as_os_str());
        let mut name = name.to_string_lossy().into_owned();
        while files.contains_key(&name) {
            name.push('\'');
        }
        let content = fingerprint(&path).map_err(input)?;
        rename(&mut text, &|t| scene.resolve(t) == path, &name);
        files.insert(name, content.into());
    }
    let mut plugins = Map::new();
    for p in registry.loaded() {
        let name = format!("{} {}", p.kind.name(), p.name());
        plugins.insert(name, p.decl.version.clone().into());
    }
    let is_orders = |a: &&describe::Aov| matches!(a, describe::Aov::Orders(_));
    let orders = scene.film.aovs.iter().find(is_orders);
    Ok(json!({
        "resolvent": env!("CARGO_PKG_VERSION"),
        "scene": text,
        "first-vertex layers (depth, albedo, normal)": crate::output::wants_features(scene),
        "layers by scattering order": orders.map(ToString::to_string),
        "files": files,
        "plugins": plugins,
    }))
}

/// Replaces texts that `is` says yes to.
fn rename(value: &mut Value, is: &dyn Fn(&str) -> bool, name: &str) {
    match value {
        Value::String(text) if is(text) => name.clone_into(text),
        Value::Array(all) => all.iter_mut().for_each(|v| rename(v, is, name)),
        Value::Object(all) => all.values_mut().for_each(|v| rename(v, is, name)),
        _ => {}
    }
}
