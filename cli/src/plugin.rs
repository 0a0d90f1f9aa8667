//! `resolvent plugin` and `resolvent schema`.

use crate::args::{Plugin as Args, PluginAction, Schema};
use crate::failure::{Code, Outcome, input};
use resolvent_engine::plugin::{Found, Plugin, Registry};
use resolvent_scene::{ParamDecl, ParamKind, PluginBlock, Value, nearest};
use serde_json::{Value as Json, json};
use std::path::Path;
use std::sync::Arc;

/// Runs `plugin`.
pub fn run(a: &Args) -> Outcome {
    match &a.action {
        PluginAction::List { json, plugins } => list(&plugins.registry()?, *json),
        PluginAction::Info {
            name,
            json,
            plugins,
        } => info(&plugins.registry()?, name, *json),
        PluginAction::New(a) => crate::template::run(a),
        PluginAction::Check(a) => crate::check::run(a),
    }
}

/// Runs `schema`.
pub fn schema(a: &Schema) -> Outcome {
    let registry = a.plugins.registry()?;
    let decls: Vec<_> = available(&registry)
        .into_iter()
        .filter_map(|(_, plugin)| Some(plugin.ok()?.decl.clone()))
        .collect();
    println!("{:#}", resolvent_scene::schema(&decls));
    Ok(Code::Done)
}

type Loaded = (Found, Result<Arc<Plugin>, String>);

/// All plugins in the search path, loaded; those that cannot be loaded are told of.
fn available(registry: &Registry) -> Vec<Loaded> {
    registry
        .found()
        .into_iter()
        .map(|found| {
            let plugin = registry.load(found.kind, &found.path);
            let plugin = plugin.map_err(|e| e.to_string());
            if let Err(why) = &plugin {
                crate::console::warning(why);
            }
            (found, plugin)
        })
        .collect()
}

/// Reads the headers alone: no function of a plugin is called.
fn list(registry: &Registry, json: bool) -> Outcome {
    let all = available(registry);
    if json {
        let plugins: Vec<Json> = all
            .iter()
            .map(|(f, plugin)| match plugin {
                Ok(p) => json!({
                    "kind": f.kind.name(), "name": f.name, "version": p.decl.version,
                    "summary": p.decl.summary, "path": p.path, "hides": f.hides,
                }),
                Err(why) => json!({
                    "kind": f.kind.name(), "name": f.name, "error": why, "path": f.path, "hides": f.hides,
                }),
            })
            .collect();
        println!(
            "{:#}",
            json!({"folders": registry.folders(), "plugins": plugins})
        );
        return Ok(Code::Done);
    }
    for (f, plugin) in &all {
        if let Ok(p) = plugin {
            println!(
                "{:<11} {:<17} {:<8} {}",
                f.kind.name(),
                f.name,
                p.decl.version,
                p.decl.summary
            );
        }
        for hidden in &f.hides {
            println!(
                "{:<38} not used: {}, behind {}",
                "",
                hidden.display(),
                f.path.display()
            );
        }
    }
    if all.is_empty() {
        let folders: Vec<_> = registry
            .folders()
            .iter()
            .map(|f| f.display().to_string())
            .collect();
        return Err(input(format!(
            "no plugins found in: {}",
            folders.join(", ")
        )));
    }
    Ok(Code::Done)
}

fn info(registry: &Registry, name: &str, json: bool) -> Outcome {
    let plugins = if PluginBlock::new(name).is_path() {
        vec![registry.open(Path::new(name)).map_err(input)?]
    } else {
        let known = registry.available();
        let paths: Vec<_> = known.iter().filter(|(_, n, _)| n == name).collect();
        if paths.is_empty() {
            let near = nearest(name, known.iter().map(|(_, n, _)| n.as_str()))
                .map_or_else(String::new, |n| format!("; did you mean '{n}'?"));
            let names: Vec<_> = known.iter().map(|(_, n, _)| n.as_str()).collect();
            return Err(input(format!(
                "there is no plugin '{name}'{near} Found: {}",
                names.join(", ")
            )));
        }
        paths
            .into_iter()
            .map(|(kind, _, path)| registry.load(*kind, path).map_err(input))
            .collect::<Outcome<Vec<_>>>()?
    };
    if json {
        let all: Vec<Json> = plugins.iter().map(|p| to_json(p)).collect();
        println!(
            "{:#}",
            if all.len() == 1 {
                all[0].clone()
            } else {
                json!(all)
            }
        );
    } else {
        plugins.iter().for_each(|p| print(p));
    }
    Ok(Code::Done)
}

fn to_json(p: &Plugin) -> Json {
    json!({
        "kind": p.kind.name(),
        "name": p.name(),
        "version": p.decl.version,
        "summary": p.decl.summary,
        "path": p.path,
        "parameters": p.decl.params.iter().map(|d| json!({
            "name": d.name,
            "type": kind_name(&d.kind),
            "choices": match &d.kind { ParamKind::Choice(c) => json!(c), _ => Json::Null },
            "required": d.required && d.default.is_none(),
            "default": d.default.as_ref().map(value),
            "min": d.min, "max": d.max,
            "min_excluded": d.min_excluded, "max_excluded": d.max_excluded,
            "texturable": d.texturable,
            "unit": d.unit,
            "help": d.help,
        })).collect::<Vec<_>>(),
    })
}

fn value(v: &Value) -> Json {
    match v {
        Value::Bool(b) => json!(b),
        Value::Number(x) => json!(x),
        Value::Text(t) => json!(t),
        Value::List(items) => items.iter().map(value).collect(),
        Value::Object(block) => {
            let params: serde_json::Map<_, _> = block
                .params
                .iter()
                .map(|(n, p)| (n.clone(), value(&p.value)))
                .collect();
            json!({"plugin": block.plugin, "params": params})
        }
        Value::Texture(name) => json!({"texture": name}),
    }
}

fn kind_name(kind: &ParamKind) -> String {
    match kind {
        ParamKind::Bool => "bool".into(),
        ParamKind::Int => "integer".into(),
        ParamKind::Float => "number".into(),
        ParamKind::Spectrum => "spectrum".into(),
        ParamKind::Vec3 => "vec3".into(),
        ParamKind::Text => "text".into(),
        ParamKind::File => "file".into(),
        ParamKind::Choice(_) => "choice".into(),
        ParamKind::Transform => "transform".into(),
        ParamKind::Plugin(kind) => format!("{kind} plugin"),
        ParamKind::Numbers => "numbers".into(),
    }
}

fn print(p: &Plugin) {
    println!("{} plugin {} {}", p.kind.name(), p.name(), p.decl.version);
    println!("{}", p.decl.summary);
    println!("{}", p.path.display());
    if p.decl.params.is_empty() {
        println!("no parameters");
    }
    for d in &p.decl.params {
        let mut facts = vec![match &d.kind {
            ParamKind::Choice(c) => c.join(" | "),
            other => kind_name(other),
        }];
        if d.texturable {
            facts.push("or a texture".into());
        }
        facts.extend(range(d));
        if !d.unit.is_empty() {
            facts.push(format!("unit {}", d.unit));
        }
        facts.push(match &d.default {
            Some(v) => format!("default {}", value(v)),
            None if d.required => "required".into(),
            None => "optional".into(),
        });
        println!("  {:<20} {} ({})", d.name, d.help, facts.join(", "));
    }
}

/// `0 ≤ x < 1`.
fn range(d: &ParamDecl) -> Option<String> {
    let sign = |excluded| if excluded { "<" } else { "<=" };
    match (d.min, d.max) {
        (None, None) => None,
        (Some(a), None) => Some(format!("{} {a}", if d.min_excluded { ">" } else { ">=" })),
        (None, Some(b)) => Some(format!("{} {b}", sign(d.max_excluded))),
        (Some(a), Some(b)) => Some(format!(
            "{a} {} x {} {b}",
            sign(d.min_excluded),
            sign(d.max_excluded)
        )),
    }
}
