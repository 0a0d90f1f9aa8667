//! JSON Schema (draft 2020-12) of the scene format and of the plugins that are there.

use serde_json::{Map, Value as Json, json};

use crate::declare::{ParamDecl, ParamKind, PluginDecl};
use crate::format::{COORDINATE, Kind, Object, POWER, Range, Rule, SCENE, SHARE};
use crate::write::value;

/// The schema of scene files. Blocks that name one of the plugins given are held to its declaration;
/// other plugins may have any parameters.
///
/// A schema cannot say everything: references to names, degenerate frames and singular matrices are found
/// by reading the scene only.
pub fn schema(decls: &[PluginDecl]) -> Json {
    let mut builder = Builder {
        decls,
        defs: Map::new(),
    };
    builder.defs.insert("transform".into(), transform());
    builder.defs.insert(
        "value".into(),
        json!({
            "description": "A parameter of a plugin that is not known here",
            "anyOf": [
                {"type": ["boolean", "number", "string"]},
                {"type": "array", "items": {"$ref": "#/$defs/value"}},
                {"$ref": "#/$defs/transform"},
                {"$ref": "#/$defs/plugin"},
                {"$ref": "#/$defs/texture"},
            ]
        }),
    );
    builder.defs.insert(
        "texture".into(),
        json!({
            "type": "object", "description": "A texture of the scene, by name",
            "required": ["texture"], "additionalProperties": false,
            "properties": {"texture": {"type": "string", "minLength": 1}},
        }),
    );
    // A block as the value of a parameter whose plugin kind is not known.
    builder.defs.insert(
        "plugin".into(),
        block(json!({"type": "object", "additionalProperties": {"$ref": "#/$defs/value"}})),
    );
    let mut root = json!({"$schema": "https://json-schema.org/draft/2020-12/schema"});
    merge(&mut root, builder.object(&SCENE, None));
    root["title"] = json!("Resolvent scene");
    for decl in decls {
        let params = builder.params_of(decl);
        builder
            .defs
            .insert(format!("params.{}.{}", decl.kind, decl.name), params);
    }
    root["$defs"] = Json::Object(builder.defs);
    root
}

struct Builder<'a> {
    decls: &'a [PluginDecl],
    defs: Map<String, Json>,
}

impl Builder<'_> {
    fn kind(&mut self, kind: &Kind) -> Json {
        match *kind {
            Kind::Bool => json!({"type": "boolean"}),
            Kind::Number(range) => number(range),
            Kind::Integer(min, max) => json!({"type": "integer", "minimum": min, "maximum": max}),
            Kind::Signed(min, max) => json!({"type": "integer", "minimum": min, "maximum": max}),
            Kind::Integers(count, min, max) => {
                json!({"type": "array", "minItems": count, "maxItems": count,
                       "items": {"type": "integer", "minimum": min, "maximum": max}})
            }
            Kind::Text => json!({"type": "string"}),
            Kind::Name => json!({"type": "string", "minLength": 1}),
            Kind::Layers(names, _) => {
                let orders = json!({"type": "string", "pattern": "^orders:[0-9]{1,2}$"});
                json!({"type": "array", "items": {"anyOf": [{"enum": names}, orders]}, "uniqueItems": true})
            }
            Kind::Choice(names) => json!({"enum": names}),
            Kind::Pair => numbers(2, COORDINATE),
            Kind::Factor => json!({"anyOf": [number(COORDINATE), numbers(3, COORDINATE)]}),
            Kind::Vec3 => numbers(3, COORDINATE),
            Kind::Vec3s => json!({"type": "array", "items": numbers(3, COORDINATE)}),
            Kind::Pairs => json!({"type": "array", "items": numbers(2, COORDINATE)}),
            Kind::Fours => json!({"type": "array", "items": numbers(4, COORDINATE)}),
            Kind::Colors => json!({
                "type": "array", "items": {"anyOf": [numbers(3, POWER), numbers(4, POWER)]},
            }),
            Kind::Triangles => {
                let triangle = self.kind(&Kind::Integers(3, 0, u64::from(u32::MAX)));
                json!({"type": "array", "items": triangle})
            }
            Kind::Share => json!({"anyOf": [number(SHARE), numbers(3, SHARE)]}),
            Kind::Spectrum => json!({"anyOf": [number(POWER), numbers(3, POWER)]}),
            Kind::Transform => json!({"$ref": "#/$defs/transform"}),
            Kind::Params(_) => {
                json!({"type": "object", "additionalProperties": {"$ref": "#/$defs/value"}})
            }
            Kind::Object(object) => self.object(object, None),
            Kind::Variants(variants) => {
                let names: Vec<_> = variants.iter().map(|v| v.name).collect();
                let cases: Vec<Json> = variants
                    .iter()
                    .map(|v| {
                        let is = json!({"properties": {"type": {"const": v.name}}, "required": ["type"]});
                        json!({"if": is, "then": self.object(v, Some(v.name))})
                    })
                    .collect();
                json!({"type": "object", "required": ["type"], "properties": {"type": {"enum": names}}, "allOf": cases})
            }
            Kind::List(item) => json!({"type": "array", "items": self.kind(item)}),
            Kind::Named(item) => {
                json!({"type": "object", "propertyNames": {"minLength": 1}, "additionalProperties": self.kind(item)})
            }
        }
    }

    /// The schema of an object; `tag` is the value of its key `type`.
    fn object(&mut self, object: &Object, tag: Option<&str>) -> Json {
        let mut properties = Map::new();
        let mut all: Vec<Json> = Vec::new();
        if let Some(tag) = tag {
            properties.insert("type".into(), json!({"const": tag}));
        }
        for field in object.fields {
            let mut property = self.kind(&field.kind);
            property["description"] = json!(field.help);
            if let Kind::Params(kind) = field.kind {
                all.extend(self.conditions(kind));
                if let Some(plugin) = properties.get_mut("plugin") {
                    plugin["examples"] = self.names(kind);
                }
            }
            properties.insert(field.name.into(), property);
        }
        let required: Vec<_> = object
            .fields
            .iter()
            .filter(|f| f.required)
            .map(|f| f.name)
            .collect();
        let mut out = json!({
            "type": "object", "description": object.help, "properties": properties,
            "required": required, "additionalProperties": false,
        });
        let each = |keys: &[&str]| -> Vec<Json> {
            keys.iter().map(|k| json!({"required": [k]})).collect()
        };
        for rule in object.rules {
            match rule {
                Rule::ExactlyOne(keys) => all.push(json!({"oneOf": each(keys)})),
                Rule::AtLeastOne(keys) => all.push(json!({"anyOf": each(keys)})),
                Rule::AtMostOne(keys) => {
                    for (i, a) in keys.iter().enumerate() {
                        all.extend(
                            keys[..i]
                                .iter()
                                .map(|b| json!({"not": {"required": [a, b]}})),
                        );
                    }
                }
                Rule::Needs(key, other) => all.push(json!({"dependentRequired": {*key: [other]}})),
            }
        }
        if !all.is_empty() {
            out["allOf"] = Json::Array(all);
        }
        out
    }

    fn names(&self, kind: &str) -> Json {
        self.decls
            .iter()
            .filter(|d| d.kind == kind)
            .map(|d| d.name.as_str())
            .collect()
    }

    /// For each plugin of a kind: a block that names it has its parameters.
    fn conditions(&self, kind: &str) -> Vec<Json> {
        let of_kind = self.decls.iter().filter(|d| d.kind == kind);
        of_kind
            .map(|d| {
                let is =
                    json!({"properties": {"plugin": {"const": d.name}}, "required": ["plugin"]});
                let params = format!("#/$defs/params.{}.{}", d.kind, d.name);
                let mut then = json!({"properties": {"params": {"$ref": params}}});
                if d.params.iter().any(ParamDecl::is_required) {
                    then["required"] = json!(["params"]);
                }
                json!({"if": is, "then": then})
            })
            .collect()
    }

    fn params_of(&self, decl: &PluginDecl) -> Json {
        let properties: Map<_, _> = decl
            .params
            .iter()
            .map(|p| (p.name.clone(), self.param(p)))
            .collect();
        let required: Vec<_> = decl
            .params
            .iter()
            .filter(|p| p.is_required())
            .map(|p| p.name.as_str())
            .collect();
        json!({
            "type": "object", "description": decl.summary, "properties": properties,
            "required": required, "additionalProperties": false,
        })
    }

    fn param(&self, p: &ParamDecl) -> Json {
        let range = p.range();
        let mut out = match &p.kind {
            ParamKind::Bool => json!({"type": "boolean"}),
            ParamKind::Int => {
                let mut out = number(range);
                out["type"] = json!("integer");
                out
            }
            ParamKind::Float => number(range),
            ParamKind::Spectrum => json!({"anyOf": [number(range), numbers(3, range)]}),
            ParamKind::Vec3 => numbers(3, range),
            ParamKind::Text => json!({"type": "string"}),
            ParamKind::File => json!({"type": "string", "minLength": 1}),
            ParamKind::Choice(names) => json!({"enum": names}),
            ParamKind::Transform => json!({"$ref": "#/$defs/transform"}),
            ParamKind::Plugin(kind) => {
                let mut nested = block(json!({"type": "object"}));
                nested["properties"]["plugin"]["examples"] = self.names(kind);
                nested["allOf"] = Json::Array(self.conditions(kind));
                json!({"anyOf": [{"type": "string", "minLength": 1}, nested]})
            }
            ParamKind::Numbers => json!({"type": "array", "items": number(range)}),
        };
        if p.texturable {
            out = json!({"anyOf": [out, {"$ref": "#/$defs/texture"}]});
        }
        let unit = if p.unit.is_empty() {
            String::new()
        } else {
            format!(" [{}]", p.unit)
        };
        out["description"] = json!(format!("{}{unit}", p.help));
        if let Some(default) = &p.default {
            out["default"] = value(default);
        }
        out
    }
}

fn block(params: Json) -> Json {
    json!({
        "type": "object", "required": ["plugin"], "additionalProperties": false,
        "properties": {"plugin": {"type": "string", "minLength": 1}, "params": params},
    })
}

fn number(range: Range) -> Json {
    let mut out = json!({"type": "number"});
    if range.min.is_finite() {
        out[if range.min_excluded {
            "exclusiveMinimum"
        } else {
            "minimum"
        }] = json!(range.min);
    }
    if range.max.is_finite() {
        out[if range.max_excluded {
            "exclusiveMaximum"
        } else {
            "maximum"
        }] = json!(range.max);
    }
    out
}

fn numbers(count: usize, range: Range) -> Json {
    json!({"type": "array", "minItems": count, "maxItems": count, "items": number(range)})
}

fn transform() -> Json {
    let matrix =
        json!({"type": "array", "minItems": 4, "maxItems": 4, "items": numbers(4, COORDINATE)});
    let single = |key: &str, schema: Json| json!({"type": "object", "required": [key], "properties": {key: schema}, "additionalProperties": false});
    let rotation = json!({
        "type": "object", "required": ["axis", "angle"], "additionalProperties": false,
        "properties": {"axis": numbers(3, COORDINATE), "angle": {"type": "number", "minimum": -1e6, "maximum": 1e6}},
    });
    let operation = json!({"anyOf": [
        single("translate", numbers(3, COORDINATE)),
        single("scale", json!({"anyOf": [number(COORDINATE), numbers(3, COORDINATE)]})),
        single("rotate_deg", rotation),
        single("matrix", json!({"$ref": "#/$defs/transform"})),
    ]});
    json!({
        "description": "Rows of a 4×4 matrix that acts on column vectors, or operations applied in order",
        "anyOf": [matrix, {"type": "array", "minItems": 1, "items": operation}],
    })
}

fn merge(into: &mut Json, from: Json) {
    if let (Json::Object(into), Json::Object(from)) = (into, from) {
        into.extend(from);
    }
}
