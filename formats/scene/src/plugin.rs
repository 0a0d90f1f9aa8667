//! Plugin blocks: which plugin, and its parameters as they were written.

use indexmap::IndexMap;

use crate::describe::Vec3;
use crate::error::Place;
use crate::transform::Transform;

/// A use of a plugin: `{"plugin": "hg", "params": {"g": 0.85}}`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PluginBlock {
    /// The plugin's name, or the path of its library.
    pub plugin: String,
    /// Its parameters in the order of the file.
    pub params: IndexMap<String, Param>,
    /// Where the block stands.
    pub place: Place,
}

/// One parameter of a plugin block.
#[derive(Debug, Clone, PartialEq)]
pub struct Param {
    /// What was given.
    pub value: Value,
    /// Where it stands.
    pub place: Place,
}

/// The value of a parameter. JSON knows one kind of number; whether it must be whole is for the
/// plugin's declaration to say.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A finite number.
    Number(f64),
    /// Text, names and files.
    Text(String),
    /// Vectors, spectra, matrices (rows), tables.
    List(Vec<Value>),
    /// A nested plugin.
    Object(PluginBlock),
    /// The texture of this name, see [`crate::Scene::textures`].
    Texture(String),
}

impl PluginBlock {
    /// A block without parameters that comes from no file.
    pub fn new(plugin: impl Into<String>) -> PluginBlock {
        PluginBlock {
            plugin: plugin.into(),
            ..PluginBlock::default()
        }
    }

    /// The same block with one parameter more.
    pub fn with(mut self, name: impl Into<String>, value: impl Into<Value>) -> PluginBlock {
        self.params.insert(
            name.into(),
            Param {
                value: value.into(),
                place: Place::default(),
            },
        );
        self
    }

    /// True if the plugin is named by the path of its library: it contains a slash or ends in `.so`,
    /// `.dylib` or `.dll`. Relative ones are relative to the scene file.
    pub fn is_path(&self) -> bool {
        let name = &self.plugin;
        name.contains(['/', '\\'])
            || [".so", ".dylib", ".dll"]
                .iter()
                .any(|end| name.ends_with(end))
    }
}

impl PluginBlock {
    /// The textures that this block and the plugins nested in it name, with the places of the parameters.
    pub fn textures(&self) -> Vec<(&str, &Place)> {
        let mut out = Vec::new();
        // Blocks nest as deep as the file does, which the JSON reader bounds.
        for param in self.params.values() {
            match &param.value {
                Value::Texture(name) => out.push((name.as_str(), &param.place)),
                Value::Object(block) => out.extend(block.textures()),
                _ => {}
            }
        }
        out
    }
}

impl Value {
    /// The value, if it is `true` or `false`.
    pub fn as_bool(&self) -> Option<bool> {
        match self {
            Value::Bool(b) => Some(*b),
            _ => None,
        }
    }

    /// The number, if it is one.
    pub fn as_number(&self) -> Option<f64> {
        match self {
            Value::Number(x) => Some(*x),
            _ => None,
        }
    }

    /// The number, if it is whole and exact (at most 2⁵³ in magnitude).
    pub fn as_integer(&self) -> Option<i64> {
        let x = self.as_number()?;
        (x.fract() == 0.0 && x.abs() <= 9_007_199_254_740_992.0).then_some(x as i64)
    }

    /// The text, if it is one.
    pub fn as_text(&self) -> Option<&str> {
        match self {
            Value::Text(t) => Some(t),
            _ => None,
        }
    }

    /// The numbers, if it is a list of numbers only.
    pub fn as_numbers(&self) -> Option<Vec<f64>> {
        match self {
            Value::List(items) => items.iter().map(Value::as_number).collect(),
            _ => None,
        }
    }

    /// Three numbers.
    pub fn as_vec3(&self) -> Option<Vec3> {
        self.as_numbers()?.try_into().ok()
    }

    /// Three numbers, or one that stands for three equal ones.
    pub fn as_spectrum(&self) -> Option<Vec3> {
        self.as_number().map(|x| [x; 3]).or_else(|| self.as_vec3())
    }

    /// Four rows of four numbers. (A list of operations has become its matrix when the file was read.)
    pub fn as_transform(&self) -> Option<Transform> {
        let Value::List(rows) = self else { return None };
        let rows: Option<Vec<[f64; 4]>> = rows
            .iter()
            .map(|r| r.as_numbers()?.try_into().ok())
            .collect();
        Some(Transform(rows?.try_into().ok()?))
    }

    /// The nested plugin.
    pub fn as_plugin(&self) -> Option<&PluginBlock> {
        match self {
            Value::Object(block) => Some(block),
            _ => None,
        }
    }

    /// The name of the texture that the value is read from.
    pub fn as_texture(&self) -> Option<&str> {
        match self {
            Value::Texture(name) => Some(name),
            _ => None,
        }
    }

    /// What an error message says was found.
    pub(crate) fn found(&self) -> String {
        match self {
            Value::Bool(b) => format!("{b}"),
            Value::Number(x) => format!("{x:?}"),
            Value::Text(t) => crate::json::quoted(t),
            Value::List(items) if items.is_empty() => "an empty list".into(),
            Value::List(items) => format!("a list of {}", items.len()),
            Value::Object(block) => {
                format!("the plugin block {}", crate::json::quoted(&block.plugin))
            }
            Value::Texture(name) => format!("the texture {}", crate::json::quoted(name)),
        }
    }
}

impl From<bool> for Value {
    fn from(b: bool) -> Value {
        Value::Bool(b)
    }
}

impl From<f64> for Value {
    fn from(x: f64) -> Value {
        Value::Number(x)
    }
}

impl From<&str> for Value {
    fn from(t: &str) -> Value {
        Value::Text(t.into())
    }
}

impl From<String> for Value {
    fn from(t: String) -> Value {
        Value::Text(t)
    }
}

impl From<Vec3> for Value {
    fn from(v: Vec3) -> Value {
        Value::List(v.into_iter().map(Value::Number).collect())
    }
}

impl From<Vec<f64>> for Value {
    fn from(v: Vec<f64>) -> Value {
        Value::List(v.into_iter().map(Value::Number).collect())
    }
}

impl From<Transform> for Value {
    fn from(t: Transform) -> Value {
        Value::List(
            t.0.into_iter()
                .map(|row| Value::from(row.to_vec()))
                .collect(),
        )
    }
}

impl From<PluginBlock> for Value {
    fn from(block: PluginBlock) -> Value {
        Value::Object(block)
    }
}
