//! What plugins declare about their parameters, and the check of a plugin block against it.

use std::path::Path;

use indexmap::IndexMap;

use crate::error::{Place, Problem};
use crate::format::Range;
use crate::nearest::hint;
use crate::plugin::{Param, PluginBlock, Value};

/// What a plugin says about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct PluginDecl {
    /// Its name in scene files.
    pub name: String,
    /// `medium`, `phase`, `bsdf` or `integrator`.
    pub kind: String,
    /// Its version, for people.
    pub version: String,
    /// One sentence.
    pub summary: String,
    /// All parameters that it knows.
    pub params: Vec<ParamDecl>,
}

/// What a plugin says about one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ParamDecl {
    /// Its name in scene files.
    pub name: String,
    /// What values it takes.
    pub kind: ParamKind,
    /// It must be given. Of no meaning if there is a default.
    pub required: bool,
    /// Its value when left out. `None` for an optional parameter: the plugin sees that it is absent.
    pub default: Option<Value>,
    /// Smallest number, for every component.
    pub min: Option<f64>,
    /// Largest number, for every component.
    pub max: Option<f64>,
    /// The smallest number itself is excluded.
    pub min_excluded: bool,
    /// The largest number itself is excluded.
    pub max_excluded: bool,
    /// It may also be read from a texture, whose values are clamped to the range; for [`ParamKind::Float`] and
    /// [`ParamKind::Spectrum`].
    pub texturable: bool,
    /// Unit, such as `1/m`; may be empty.
    pub unit: String,
    /// One sentence.
    pub help: String,
}

impl ParamDecl {
    /// An optional parameter without default, range, unit and help.
    pub fn new(name: impl Into<String>, kind: ParamKind) -> ParamDecl {
        ParamDecl {
            name: name.into(),
            kind,
            required: false,
            default: None,
            min: None,
            max: None,
            min_excluded: false,
            max_excluded: false,
            texturable: false,
            unit: String::new(),
            help: String::new(),
        }
    }

    pub(crate) fn is_required(&self) -> bool {
        self.required && self.default.is_none()
    }

    pub(crate) fn range(&self) -> Range {
        Range {
            min: self.min.unwrap_or(f64::NEG_INFINITY),
            max: self.max.unwrap_or(f64::INFINITY),
            min_excluded: self.min_excluded,
            max_excluded: self.max_excluded,
        }
    }
}

/// What values a parameter takes.
#[derive(Debug, Clone, PartialEq)]
pub enum ParamKind {
    /// `true` or `false`.
    Bool,
    /// A whole number of at most 2⁵³ in magnitude.
    Int,
    /// A number.
    Float,
    /// A number, or three (RGB).
    Spectrum,
    /// Three numbers.
    Vec3,
    /// Text.
    Text,
    /// Path of a file, relative to the scene file.
    File,
    /// One of these texts.
    Choice(Vec<String>),
    /// A 4×4 matrix that can be inverted, or a list of operations.
    Transform,
    /// A nested plugin of this kind: a block, or only its name.
    Plugin(String),
    /// A list of numbers.
    Numbers,
}

/// Parameters that fit a declaration, in its order, with defaults filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// The plugin's name or path, as the block has it.
    pub plugin: String,
    /// The parameters. Optional ones without default are missing if they were not given. A nested plugin
    /// is always [`Value::Object`], also where only its name was given.
    pub params: IndexMap<String, Param>,
}

impl PluginDecl {
    /// Checks a block against this declaration; see [`check`].
    pub fn check(&self, block: &PluginBlock, file: &Path) -> Result<Checked, Vec<Problem>> {
        check(block, self, file)
    }
}

/// Checks a plugin block of the scene `file` against the plugin's declaration and fills in defaults.
///
/// Unknown, missing, mistyped and out-of-range parameters are problems with their places. Nested plugins
/// are not looked into: whoever loads them checks them against their own declarations.
pub fn check(block: &PluginBlock, decl: &PluginDecl, file: &Path) -> Result<Checked, Vec<Problem>> {
    let mut problems = Vec::new();
    let mut report =
        |place: &Place, what: String| problems.push(Problem::new(file, place.clone(), what));
    for (name, param) in &block.params {
        if !decl.params.iter().any(|d| d.name == *name) {
            let hint = hint(name, decl.params.iter().map(|d| d.name.as_str()));
            report(
                &param.place,
                format!(
                    "{} {} has no parameter {name:?}{hint}",
                    decl.kind, decl.name
                ),
            );
        }
    }
    let mut params = IndexMap::new();
    for d in &decl.params {
        match block.params.get(&d.name) {
            Some(param) => match normalize(&param.value, d, &param.place) {
                Ok(value) => {
                    params.insert(
                        d.name.clone(),
                        Param {
                            value,
                            place: param.place.clone(),
                        },
                    );
                }
                Err(expected) => {
                    let what = format!(
                        "{:?} of {} {}: expected {expected}, found {}",
                        d.name,
                        decl.kind,
                        decl.name,
                        param.value.found()
                    );
                    report(&param.place, what);
                }
            },
            None if d.is_required() => {
                let help = if d.help.is_empty() {
                    String::new()
                } else {
                    format!(": {}", d.help)
                };
                report(
                    &block.place,
                    format!(
                        "{} {} needs the parameter {:?}{help}",
                        decl.kind, decl.name, d.name
                    ),
                );
            }
            None => {
                if let Some(value) = &d.default {
                    params.insert(
                        d.name.clone(),
                        Param {
                            value: value.clone(),
                            place: block.place.clone(),
                        },
                    );
                }
            }
        }
    }
    if problems.is_empty() {
        Ok(Checked {
            plugin: block.plugin.clone(),
            params,
        })
    } else {
        Err(problems)
    }
}

/// The value in the form that [`Checked`] promises, or what was expected instead.
fn normalize(value: &Value, decl: &ParamDecl, place: &Place) -> Result<Value, String> {
    let range = decl.range();
    let unit = if decl.unit.is_empty() {
        String::new()
    } else {
        format!(" ({})", decl.unit)
    };
    let all = |numbers: Option<Vec<f64>>| {
        numbers.is_some_and(|n| n.iter().all(|x| x.is_finite() && range.contains(*x)))
    };
    let texture = if decl.texturable { " or a texture" } else { "" };
    if decl.texturable && value.as_texture().is_some() {
        return Ok(value.clone());
    }
    let expected = |ok: bool, what: String| if ok { Ok(value.clone()) } else { Err(what) };
    match &decl.kind {
        ParamKind::Bool => expected(value.as_bool().is_some(), "true or false".into()),
        ParamKind::Int => {
            let number = value.as_integer().and(value.as_number());
            expected(
                all(number.map(|x| vec![x])),
                format!("a whole number {range}{unit}"),
            )
        }
        ParamKind::Float => expected(
            all(value.as_number().map(|x| vec![x])),
            format!("a number {range}{unit}{texture}"),
        ),
        ParamKind::Spectrum => expected(
            all(value.as_spectrum().map(|v| v.to_vec())),
            format!("a number {range} or three of them (RGB){unit}{texture}"),
        ),
        ParamKind::Vec3 => expected(
            all(value.as_vec3().map(|v| v.to_vec())),
            format!("three numbers {range}{unit}"),
        ),
        ParamKind::Numbers => expected(
            all(value.as_numbers()),
            format!("a list of numbers {range}{unit}"),
        ),
        ParamKind::Text => expected(value.as_text().is_some(), "a text".into()),
        ParamKind::File => {
            let path = value
                .as_text()
                .is_some_and(|t| !t.is_empty() && !t.contains('\0'));
            expected(path, "the path of a file".into())
        }
        ParamKind::Choice(names) => match value.as_text() {
            Some(t) if names.iter().any(|n| n == t) => Ok(value.clone()),
            other => {
                let all = names
                    .iter()
                    .map(|n| format!("{n:?}"))
                    .collect::<Vec<_>>()
                    .join(", ");
                let near = other.and_then(|t| crate::nearest(t, names.iter().map(String::as_str)));
                Err(format!(
                    "one of {all}{}",
                    near.map_or(String::new(), |n| format!(" (did you mean {n:?}?)"))
                ))
            }
        },
        ParamKind::Transform => match value.as_transform() {
            Some(t) => match t.fault() {
                None => Ok(value.clone()),
                Some(fault) => Err(format!("a transform that can be inverted, not {fault}")),
            },
            None => Err("four rows of four numbers or a list of operations".into()),
        },
        ParamKind::Plugin(kind) => match value {
            Value::Object(_) => Ok(value.clone()),
            Value::Text(name) if !name.is_empty() => Ok(Value::Object(PluginBlock {
                place: place.clone(),
                ..PluginBlock::new(name.clone())
            })),
            _ => Err(format!(
                "a {kind} plugin: its name, or an object with \"plugin\" and \"params\""
            )),
        },
    }
}
