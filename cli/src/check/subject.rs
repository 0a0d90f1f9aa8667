//! The plugin that is checked, and how instances of it are made.

use crate::args::Check;
use crate::failure::{Outcome, input};
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::plugin::{Instance, Plugin, Registry};
use resolvent_scene::{ParamDecl, ParamKind, PluginBlock, Scene};
use serde_json::{Map, Value, json};
use std::path::Path;
use std::sync::Arc;

/// Parameters as JSON.
pub type Params = Map<String, Value>;

/// The plugin.
pub struct Subject {
    /// What finds the plugins that are nested in it.
    pub registry: Registry,
    /// The plugin.
    pub plugin: Arc<Plugin>,
    /// Parameters that every instance is made with: those given, and values for those that must be.
    pub base: Params,
    /// Parameters that were given, and so are not varied.
    pub fixed: Vec<String>,
}

impl Subject {
    /// Loads the plugin and makes sure that an instance of it can be made.
    pub fn new(a: &Check) -> Outcome<Self> {
        let registry = a.plugins.registry()?;
        let plugin = find(&registry, &a.plugin)?;
        let given: Value = match &a.params {
            Some(text) => serde_json::from_str(text)
                .map_err(|e| input(format!("--params {text}: is no JSON: {e}")))?,
            None => json!({}),
        };
        let Value::Object(given) = given else {
            return Err(input(format!(
                "--params {given}: expected an object, such as {{\"g\": 0.5}}"
            )));
        };
        let fixed = given.keys().cloned().collect();
        let mut base = given;
        for d in &plugin.decl.params {
            if d.required && d.default.is_none() && !base.contains_key(&d.name) {
                base.insert(d.name.clone(), some_value(d)?);
            }
        }
        let subject = Self {
            registry,
            plugin,
            base,
            fixed,
        };
        subject.make(&subject.base).map_err(|why| {
            input(format!(
                "{why}; give the parameters that it needs: --params '{{\"name\": value}}'"
            ))
        })?;
        Ok(subject)
    }

    /// An instance.
    ///
    /// # Errors
    /// What the plugin says, or its declaration.
    pub fn make(&self, params: &Params) -> Result<Instance, String> {
        let scene = describe(&self.plugin.path, params)?;
        let (_, medium) = scene.media.first().ok_or("the scene lost its plugin")?;
        self.instantiate(&medium.block, &scene)
    }

    fn instantiate(&self, block: &PluginBlock, scene: &Scene) -> Result<Instance, String> {
        self.registry
            .instantiate(self.plugin.kind, block, scene, &Affine::IDENTITY, 3)
            .map_err(|e| e.to_string())
    }
}

/// A scene that holds nothing but the plugin, in a place where a block of any kind may stand. Files are relative to the current
/// folder.
fn describe(plugin: &Path, params: &Params) -> Result<Scene, String> {
    let plugin = plugin.canonicalize().map_err(|e| e.to_string())?;
    let text = json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": [0, 0, 5], "target": [0, 0, 0], "fov_x_deg": 40},
        "media": {"checked": {"plugin": plugin, "params": params}},
    });
    Scene::parse(text.to_string().as_bytes(), "parameters").map_err(|e| e.to_string())
}

fn find(registry: &Registry, name: &str) -> Outcome<Arc<Plugin>> {
    if PluginBlock::new(name).is_path() {
        return registry.open(Path::new(name)).map_err(input);
    }
    let known = registry.available();
    let mut kinds = known.iter().filter(|(_, n, _)| n == name);
    match (kinds.next(), kinds.next()) {
        (Some((kind, _, path)), None) => registry.load(*kind, path).map_err(input),
        (Some((.., a)), Some((.., b))) => Err(input(format!(
            "there are several plugins '{name}': give the library, {} or {}",
            a.display(),
            b.display()
        ))),
        (None, _) => {
            let names = known.iter().map(|(_, n, _)| n.as_str());
            let near = resolvent_scene::nearest(name, names)
                .map_or_else(String::new, |n| format!("; did you mean '{n}'?"));
            Err(input(format!("there is no plugin '{name}'{near}")))
        }
    }
}

/// A value for a parameter that must be given.
fn some_value(d: &ParamDecl) -> Outcome<Value> {
    let number = match (d.min, d.max) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (Some(a), None) => a + 1.0,
        (None, Some(b)) => b - 1.0,
        (None, None) => 1.0,
    };
    Ok(match &d.kind {
        ParamKind::Bool => json!(false),
        ParamKind::Int => json!(number.round()),
        ParamKind::Float | ParamKind::Spectrum => json!(number),
        ParamKind::Vec3 => json!([number, number, number]),
        ParamKind::Choice(words) => json!(words.first()),
        ParamKind::Plugin(kind) if kind == PluginKind::Bsdf.name() => json!("diffuse"),
        ParamKind::Plugin(kind) if kind == PluginKind::Phase.name() => json!("isotropic"),
        _ => {
            return Err(input(format!(
                "the parameter '{}' must be given: --params '{{\"{}\": …}}'",
                d.name, d.name
            )));
        }
    })
}
