//! Making and ending plugin instances.

use super::host::{HOST, pending_failure, take_failure, warn};
use super::load::Plugin;
use crate::error::{Error, Result};
use crate::texture::Binding;
use resolvent_api::Affine;
use resolvent_api::abi::{self, CreateArgs, ParamValue, PluginKind, Text};
use resolvent_scene::{Checked, ParamKind, Place, PluginBlock, Problem, Value};
use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A plugin's instance and the nested ones it refers to, which outlive it.
pub struct Instance {
    /// The plugin.
    pub plugin: Arc<Plugin>,
    /// Nested instances by parameter name, in order of declaration.
    pub nested: Vec<(String, Arc<Instance>)>,
    /// The textures that the plugin holds handles to.
    _textures: Vec<(String, Box<Binding>)>,
    pub(super) pointer: *mut c_void,
    /// Scene file and place of the block that it was made from.
    pub(super) at: (PathBuf, Place),
}

// SAFETY: the ABI asks that instances may be used from any thread, several at once.
unsafe impl Send for Instance {}
// SAFETY: as above.
unsafe impl Sync for Instance {}

/// Parameters in the form that crosses the boundary; owns what the values point to.
#[derive(Default)]
struct Marshalled {
    numbers: Vec<Vec<f64>>,
    texts: Vec<String>,
}

impl Instance {
    /// Makes an instance from parameters checked against the plugin's declaration. `nested` are the instances of its
    /// `Plugin` parameters, `textures` those of the parameters that are read from one.
    ///
    /// # Errors
    /// What the plugin says, with the place of its block in the scene.
    #[allow(clippy::too_many_arguments)]
    pub fn create(
        plugin: Arc<Plugin>,
        checked: &Checked,
        nested: Vec<(String, Arc<Instance>)>,
        textures: Vec<(String, Box<Binding>)>,
        to_world: &Affine,
        lanes: u32,
        scene: &dyn Fn(&str) -> std::path::PathBuf,
        at: (&Path, &Place),
    ) -> Result<Self> {
        let mut store = Marshalled::default();
        for decl in &plugin.decl.params {
            let value = checked.params.get(&decl.name).map(|p| &p.value);
            store
                .numbers
                .push(value.map_or_else(Vec::new, |v| numbers(&decl.kind, v)));
            let text = match (&decl.kind, value.and_then(Value::as_text)) {
                (ParamKind::File, Some(path)) => scene(path).to_string_lossy().into_owned(),
                (_, text) => text.unwrap_or_default().to_owned(),
            };
            store.texts.push(text);
        }
        let mut values = Vec::new();
        for (i, decl) in plugin.decl.params.iter().enumerate() {
            if !checked.params.contains_key(&decl.name) {
                continue;
            }
            let inner = nested
                .iter()
                .find(|(name, _)| *name == decl.name)
                .map(|(_, n)| n);
            let texture = textures
                .iter()
                .find(|(name, _)| *name == decl.name)
                .map(|(_, t)| t.handle());
            let kind = match texture {
                Some(_) => abi::ParamKind::Texture,
                None => kind(&decl.kind),
            };
            values.push(ParamValue {
                name: Text::new(&decl.name),
                kind: kind as u32,
                count: store.numbers[i].len() as u32,
                numbers: store.numbers[i].as_ptr(),
                text: Text::new(&store.texts[i]),
                header: inner.map_or(std::ptr::null(), |n| n.plugin.header),
                instance: inner
                    .map(|n| n.pointer.cast_const())
                    .or(texture)
                    .unwrap_or(std::ptr::null()),
            });
        }
        let args = CreateArgs {
            size: size_of::<CreateArgs>() as u32,
            param_count: values.len() as u32,
            params: values.as_ptr(),
            host: &raw const HOST,
            to_world: to_world.to_rows(),
            lanes,
            reserved: 0,
        };
        let create = functions(&plugin).0;
        // What an earlier call left behind is not why this one fails.
        pending_failure();
        // SAFETY: the table was checked when the plugin was loaded; `args` and all it points to live for the call.
        let pointer = unsafe { create(&args) };
        if pointer.is_null() {
            let why = format!("{}: {}", plugin.title(), take_failure());
            return Err(Problem::new(at.0, at.1.clone(), why).into());
        }
        Ok(Self {
            plugin,
            nested,
            _textures: textures,
            pointer,
            at: (at.0.to_path_buf(), at.1.clone()),
        })
    }

    /// The plugin's header and this instance, for callers that drive it by its C tables themselves.
    pub fn raw(&self) -> (&'static abi::PluginHeader, *const c_void) {
        (self.plugin.header, self.pointer)
    }

    /// An error of the plugin, with the place of its block in the scene.
    pub(super) fn error(&self, why: &str) -> Error {
        let (file, place) = &self.at;
        Problem::new(
            file,
            place.clone(),
            format!("{}: {why}", self.plugin.title()),
        )
        .into()
    }

    /// The table of the plugin's kind.
    ///
    /// # Safety
    /// `T` must be the table type of the plugin's kind.
    pub(super) unsafe fn table<T>(&self) -> &'static T {
        // SAFETY: kind and size were checked when the plugin was loaded; tables are statics of a library that stays.
        unsafe { &*self.plugin.header.table.cast::<T>() }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        let destroy = functions(&self.plugin).1;
        // SAFETY: `pointer` came from this plugin's `create` and is ended once.
        unsafe { destroy(self.pointer) }
        // The picture is not touched by what goes wrong at the end, so it stays a warning.
        if let Some(why) = pending_failure() {
            warn(format!("{}: {why}", self.plugin.title()));
        }
    }
}

fn functions(plugin: &Plugin) -> (abi::Create, abi::Destroy) {
    let table = plugin.header.table;
    // SAFETY: kind and size of the table were checked when the plugin was loaded.
    unsafe {
        match plugin.kind {
            PluginKind::Medium => {
                let t = &*table.cast::<abi::MediumTable>();
                (t.create, t.destroy)
            }
            PluginKind::Phase => {
                let t = &*table.cast::<abi::PhaseTable>();
                (t.create, t.destroy)
            }
            PluginKind::Bsdf => {
                let t = &*table.cast::<abi::BsdfTable>();
                (t.create, t.destroy)
            }
            PluginKind::Integrator => {
                let t = &*table.cast::<abi::IntegratorTable>();
                (t.create, t.destroy)
            }
        }
    }
}

fn numbers(kind: &ParamKind, value: &Value) -> Vec<f64> {
    match kind {
        ParamKind::Bool => vec![f64::from(u8::from(value.as_bool().unwrap_or_default()))],
        ParamKind::Int | ParamKind::Float => value.as_number().into_iter().collect(),
        ParamKind::Spectrum => value.as_spectrum().map_or_else(Vec::new, |v| v.to_vec()),
        _ => value.as_numbers().unwrap_or_default(),
    }
}

fn kind(kind: &ParamKind) -> abi::ParamKind {
    match kind {
        ParamKind::Bool => abi::ParamKind::Bool,
        ParamKind::Int => abi::ParamKind::Int,
        ParamKind::Float => abi::ParamKind::Float,
        ParamKind::Spectrum => abi::ParamKind::Spectrum,
        ParamKind::Vec3 => abi::ParamKind::Vec3,
        ParamKind::Text => abi::ParamKind::Text,
        ParamKind::File => abi::ParamKind::File,
        ParamKind::Choice(_) => abi::ParamKind::Choice,
        ParamKind::Numbers | ParamKind::Transform => abi::ParamKind::Numbers,
        ParamKind::Plugin(_) => abi::ParamKind::Plugin,
    }
}

/// The nested plugin blocks among checked parameters, with the kind each must be of.
pub(crate) fn nested_blocks<'c>(
    plugin: &Plugin,
    checked: &'c Checked,
) -> Vec<(String, String, &'c PluginBlock)> {
    let mut out = Vec::new();
    for decl in &plugin.decl.params {
        if let ParamKind::Plugin(kind) = &decl.kind
            && let Some(block) = checked
                .params
                .get(&decl.name)
                .and_then(|p| p.value.as_plugin())
        {
            out.push((decl.name.clone(), kind.clone(), block));
        }
    }
    out
}

impl From<Error> for String {
    fn from(e: Error) -> Self {
        e.to_string()
    }
}
