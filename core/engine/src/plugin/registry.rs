//! Finding plugins by kind and name along a search path; a plugin is loaded when it is named, and not before.

use super::instance::{Instance, nested_blocks};
use super::load::Plugin;
use crate::error::{Error, Result};
use crate::texture::{Binding, Textures};
use resolvent_api::abi::PluginHeader;
use resolvent_api::{Affine, PluginKind};
use resolvent_scene::{Checked, PluginBlock, Problem, Scene, nearest};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Environment variable with further folders.
pub const PATH_VARIABLE: &str = "RESOLVENT_PLUGIN_PATH";

/// The search path and the plugins loaded so far.
pub struct Registry {
    folders: Vec<PathBuf>,
    /// Plugins that are part of the program.
    linked: Vec<Arc<Plugin>>,
    loaded: Mutex<BTreeMap<PathBuf, Arc<Plugin>>>,
    copies: bool,
}

/// A library in the search path whose name is that of a plugin.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Kind, by the file's name.
    pub kind: PluginKind,
    /// Name, by the file's name.
    pub name: String,
    /// The library.
    pub path: PathBuf,
    /// Libraries of the same kind and name later in the search path: they are never used.
    pub hides: Vec<PathBuf>,
}

impl Registry {
    /// Searches `first`, then the folders of `RESOLVENT_PLUGIN_PATH`, then beside the executable (and in `plugins` and
    /// `../lib/resolvent` from there).
    pub fn new(first: &[PathBuf]) -> Self {
        let mut folders = first.to_vec();
        if let Some(path) = std::env::var_os(PATH_VARIABLE) {
            folders.extend(std::env::split_paths(&path).filter(|p| !p.as_os_str().is_empty()));
        }
        if let Some(beside) = std::env::current_exe()
            .ok()
            .as_deref()
            .and_then(Path::parent)
        {
            folders.push(beside.to_path_buf());
            folders.push(beside.join("plugins"));
            folders.push(beside.join("../lib/resolvent"));
            // Test executables stand one folder below the libraries they are built with.
            if beside.ends_with("deps") || beside.ends_with("examples") {
                folders.extend(beside.parent().map(Path::to_path_buf));
            }
        }
        Self {
            folders,
            linked: Vec::new(),
            loaded: Mutex::default(),
            copies: false,
        }
    }

    /// Loads libraries from copies, so that their files may be overwritten while they are in use.
    pub fn copying(self) -> Self {
        Self {
            copies: true,
            ..self
        }
    }

    /// Adds a plugin that is linked into the program, by the header that its library would export (with the feature `linked` of
    /// `resolvent-api`, so that there can be several): it comes before all in the search path.
    ///
    /// # Errors
    /// As for one that is loaded.
    pub fn link(&mut self, header: &'static PluginHeader) -> Result<()> {
        self.linked.push(Arc::new(Plugin::linked(header)?));
        Ok(())
    }

    /// The search path.
    pub fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// The file name of a plugin's library: `libresolvent_medium_vdb.so` for the medium `vdb`.
    pub fn file_name(kind: PluginKind, name: &str) -> String {
        use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
        format!(
            "{DLL_PREFIX}resolvent_{}_{}{DLL_SUFFIX}",
            kind.name(),
            name.replace('-', "_")
        )
    }

    /// Where the libraries of the plugins of a name would be, of any kind, whether there is one or not.
    pub fn places(&self, name: &str) -> impl Iterator<Item = PathBuf> {
        let files = PluginKind::ALL.map(|kind| Self::file_name(kind, name));
        let folders = self.folders.iter();
        folders.flat_map(move |folder| files.clone().map(|file| folder.join(file)))
    }

    /// Every library in the search path whose name is that of a plugin, the first of each name only, without loading any.
    pub fn available(&self) -> Vec<(PluginKind, String, PathBuf)> {
        let found = self.found().into_iter();
        found.map(|f| (f.kind, f.name, f.path)).collect()
    }

    /// The same, with the libraries that are hidden by those: of the same kind and name, but later in the search path.
    pub fn found(&self) -> Vec<Found> {
        let mut out: Vec<Found> = Vec::new();
        for folder in &self.folders {
            let Ok(entries) = std::fs::read_dir(folder) else {
                continue;
            };
            let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).collect();
            paths.sort();
            for path in paths {
                let Some((kind, name)) = Self::parse(&path) else {
                    continue;
                };
                match out.iter_mut().find(|f| f.kind == kind && f.name == name) {
                    // A folder may be named twice.
                    Some(first) if same(&first.path, &path) => {}
                    Some(first) => first.hides.push(path),
                    None => out.push(Found {
                        kind,
                        name,
                        path,
                        hides: vec![],
                    }),
                }
            }
        }
        out.sort_by(|a, b| (a.kind, &a.name).cmp(&(b.kind, &b.name)));
        out
    }

    fn parse(path: &Path) -> Option<(PluginKind, String)> {
        use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
        let file = path.file_name()?.to_str()?;
        let stem = file.strip_prefix(DLL_PREFIX)?.strip_suffix(DLL_SUFFIX)?;
        let rest = stem.strip_prefix("resolvent_")?;
        PluginKind::ALL.into_iter().find_map(|kind| {
            let name = rest.strip_prefix(kind.name())?.strip_prefix('_')?;
            Some((kind, name.replace('_', "-")))
        })
    }

    /// The plugin `name` of a kind, loaded if it was not yet.
    ///
    /// # Errors
    /// If it is not found (with what is, and the nearest name) or cannot be loaded.
    pub fn find(&self, kind: PluginKind, name: &str) -> Result<Arc<Plugin>> {
        let mut linked = self.linked.iter();
        if let Some(plugin) = linked.find(|p| p.kind == kind && p.name() == name) {
            return Ok(plugin.clone());
        }
        let file = Self::file_name(kind, name);
        for folder in &self.folders {
            let path = folder.join(&file);
            if path.is_file() {
                let plugin = self.load(kind, &path)?;
                if plugin.name() != name {
                    return Err(Error::Plugin(format!(
                        "{}: calls itself '{}', not '{name}' as its file name says",
                        path.display(),
                        plugin.name()
                    )));
                }
                return Ok(plugin);
            }
        }
        let known: Vec<String> = self
            .available()
            .into_iter()
            .filter(|(k, ..)| *k == kind)
            .map(|(_, n, _)| n)
            .collect();
        let near = nearest(name, known.iter().map(String::as_str))
            .map_or_else(String::new, |n| format!("; did you mean '{n}'?"));
        let known = if known.is_empty() {
            "none".into()
        } else {
            known.join(", ")
        };
        let folders: Vec<_> = self
            .folders
            .iter()
            .map(|f| f.display().to_string())
            .collect();
        Err(Error::Plugin(format!(
            "there is no {} plugin '{name}'{near} Found: {known}. Searched for {file} in: {}",
            kind.name(),
            folders.join(", ")
        )))
    }

    /// The plugin in the library at `path`, loaded if it was not yet; it must be of the given kind.
    ///
    /// # Errors
    /// If it cannot be loaded or is of another kind.
    pub fn load(&self, kind: PluginKind, path: &Path) -> Result<Arc<Plugin>> {
        let plugin = self.open(path)?;
        if plugin.kind != kind {
            return Err(Error::Plugin(format!(
                "{}: is a plugin of the kind {} where one of the kind {} is needed",
                path.display(),
                plugin.kind.name(),
                kind.name()
            )));
        }
        Ok(plugin)
    }

    /// The plugin in the library at `path`, of any kind, loaded if it was not yet.
    ///
    /// # Errors
    /// If it cannot be loaded.
    pub fn open(&self, path: &Path) -> Result<Arc<Plugin>> {
        // The system looks for a name without a folder everywhere but here.
        let here = Path::new(".").join(path);
        let bare = path.parent() == Some(Path::new(""));
        let path = if bare { &here } else { path };
        let key = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let mut loaded = self.loaded.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(plugin) = loaded.get(&key) {
            return Ok(plugin.clone());
        }
        let plugin = if self.copies {
            Plugin::open_copy(path)?
        } else {
            Plugin::open(path)?
        };
        let plugin = Arc::new(plugin);
        loaded.insert(key, plugin.clone());
        Ok(plugin)
    }

    /// The plugins loaded so far.
    pub fn loaded(&self) -> Vec<Arc<Plugin>> {
        self.loaded
            .lock()
            .unwrap_or_else(|e| e.into_inner())
            .values()
            .cloned()
            .collect()
    }

    /// Makes the instance a block of the scene describes, nested plugins first.
    ///
    /// # Errors
    /// Whatever is wrong with the block, with its place in the scene.
    pub fn instantiate(
        &self,
        kind: PluginKind,
        block: &PluginBlock,
        scene: &Scene,
        to_world: &Affine,
        lanes: u32,
    ) -> Result<Instance> {
        self.instantiate_textured(kind, block, scene, to_world, lanes, &Textures::new())
    }

    /// The same for plugins whose parameters may be textured, with the textures of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with the block or the images it needs, with its place in the scene.
    pub fn instantiate_textured(
        &self,
        kind: PluginKind,
        block: &PluginBlock,
        scene: &Scene,
        to_world: &Affine,
        lanes: u32,
        textures: &Textures,
    ) -> Result<Instance> {
        let file = scene.source.file.as_path();
        let placed = |e: Error| match e {
            Error::Plugin(why) => Error::from(Problem::new(file, block.place.clone(), why)),
            other => other,
        };
        let plugin = if block.is_path() {
            self.load(kind, &scene.resolve(&block.plugin))
        } else {
            self.find(kind, &block.plugin)
        }
        .map_err(placed)?;
        let checked = plugin.decl.check(block, file).map_err(Error::Scene)?;
        let mut nested = Vec::new();
        for (name, kind, inner) in nested_blocks(&plugin, &checked) {
            let kind = PluginKind::ALL
                .into_iter()
                .find(|k| k.name() == kind)
                .ok_or_else(|| {
                    Error::Plugin(format!(
                        "{}: '{name}' asks for the unknown kind '{kind}'",
                        plugin.title()
                    ))
                })?;
            let instance =
                self.instantiate_textured(kind, inner, scene, to_world, lanes, textures)?;
            nested.push((name, Arc::new(instance)));
        }
        let resolve = |p: &str| scene.resolve(p);
        let bound = bindings(&plugin, &checked, scene, textures)?;
        Instance::create(
            plugin,
            &checked,
            nested,
            bound,
            to_world,
            lanes,
            &resolve,
            (file, &block.place),
        )
    }
}

/// True if both lead to the same file.
fn same(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// The textures among checked parameters, each with its parameter's range.
fn bindings(
    plugin: &Plugin,
    checked: &Checked,
    scene: &Scene,
    textures: &Textures,
) -> Result<Vec<(String, Box<Binding>)>> {
    let mut out = Vec::new();
    for decl in &plugin.decl.params {
        let Some(name) = checked
            .params
            .get(&decl.name)
            .and_then(|p| p.value.as_texture())
        else {
            continue;
        };
        let mut min = decl.min.map_or(f32::MIN, |v| v as f32);
        let mut max = decl.max.map_or(f32::MAX, |v| v as f32);
        // An excluded end is out of range itself.
        if decl.min_excluded {
            min = min.next_up();
        }
        if decl.max_excluded {
            max = max.next_down();
        }
        let texture = textures.get(name, scene)?;
        out.push((decl.name.clone(), Box::new(Binding::new(texture, min, max))));
    }
    Ok(out)
}
