//! Reference pages in Markdown: the scene format, from the tables that the checker and the JSON Schema are driven by, and
//! plugins, from what they declare.

use crate::declare::{ParamDecl, ParamKind, PluginDecl};
use crate::format::{COORDINATE, FAR, Field, Kind, Object, POWER, Range, Rule, SCENE, SHARE};
use crate::write::value;

/// Every object of the scene format with its keys: type, default, range, meaning.
pub fn scene_reference() -> String {
    let mut page = Page::default();
    page.reach("scene".into(), &SCENE);
    let mut next = 0;
    while let Some((title, object)) = page.objects.get(next).cloned() {
        page.object(&title, object);
        next += 1;
    }
    page.text
}

/// A page in the making.
#[derive(Default)]
struct Page {
    text: String,
    /// The objects that were referred to so far, and their headings.
    objects: Vec<(String, &'static Object)>,
}

impl Page {
    /// A link to an object, which gets its section if it has none yet.
    fn reach(&mut self, title: String, object: &'static Object) -> String {
        let known = self.objects.iter().find(|(_, o)| std::ptr::eq(*o, object));
        let title = match known {
            Some((title, _)) => title.clone(),
            None => {
                self.objects.push((title.clone(), object));
                title
            }
        };
        let anchor = title.replace(": ", "-");
        format!("[{}](#{anchor})", object.name)
    }

    fn object(&mut self, title: &str, object: &'static Object) {
        self.text += &format!("\n## {title}\n\n{}.\n\n", object.help);
        self.text += "| key | type | default | range | meaning |\n|---|---|---|---|---|\n";
        if title.contains(": ") {
            self.text += &format!("| `type` | `\"{}\"` | needed | | |\n", object.name);
        }
        for field in object.fields {
            let (meaning, default) = meaning(field);
            let kind = self.kind(field.name, &field.kind);
            let range = range(&field.kind);
            let name = field.name;
            self.text += &row(&[&format!("`{name}`"), &kind, default, &range, meaning]);
        }
        let rules: Vec<String> = object.rules.iter().map(rule).collect();
        if !rules.is_empty() {
            self.text += &format!("\n{}\n", rules.join(" "));
        }
    }

    /// What stands under a key.
    fn kind(&mut self, key: &str, kind: &Kind) -> String {
        match *kind {
            Kind::Bool => "true or false".into(),
            Kind::Number(_) => "number".into(),
            Kind::Integer(..) | Kind::Signed(..) => "whole number".into(),
            Kind::Integers(count, ..) => format!("{count} whole numbers"),
            Kind::Text | Kind::Name => "text".into(),
            Kind::Layers(names, most) => {
                format!("list of {}, \"orders:0\" … \"orders:{most}\"", words(names))
            }
            Kind::Choice(names) => words(names),
            Kind::Vec3 => "3 numbers".into(),
            Kind::Pair => "2 numbers".into(),
            Kind::Factor | Kind::Spectrum | Kind::Share => "number or RGB".into(),
            Kind::Vec3s => "list of 3 numbers each".into(),
            Kind::Pairs => "list of 2 numbers each".into(),
            Kind::Fours => "list of 4 numbers each".into(),
            Kind::Colors => "list of 3 or 4 numbers each".into(),
            Kind::Triangles => "list of 3 indices each".into(),
            Kind::Transform => "[transform](#transforms)".into(),
            Kind::Params(kind) => {
                format!("parameters of [{kind} plugins](plugins.md#{kind}-plugins)")
            }
            Kind::Object(object) => self.reach(object.name.into(), object),
            Kind::Variants(variants) => {
                let links = variants
                    .iter()
                    .map(|o| self.reach(format!("{key}: {}", o.name), o));
                let links: Vec<String> = links.collect();
                links.join(", ")
            }
            Kind::List(item) => format!("list of {}", self.kind(key, item)),
            Kind::Named(item) => format!("by name: {}", self.kind(key, item)),
        }
    }
}

/// A row of a table.
fn row(cells: &[&str]) -> String {
    let plain = |c: &&str| c.replace('|', "\\|").replace('<', "&lt;");
    let cells: Vec<String> = cells.iter().map(plain).collect();
    format!("| {} |\n", cells.join(" | "))
}

/// A field's help, and the default at its end.
fn meaning(field: &Field) -> (&'static str, &'static str) {
    if field.required {
        return (field.help, "needed");
    }
    let at_end = field.help.strip_suffix(')');
    at_end
        .and_then(|help| help.rsplit_once(" ("))
        .unwrap_or((field.help, ""))
}

fn words(names: &[&str]) -> String {
    let names: Vec<String> = names.iter().map(|n| format!("\"{n}\"")).collect();
    names.join(", ")
}

/// The range of the numbers under a key, if it is anything to speak of.
fn range(kind: &Kind) -> String {
    let whole = |min: f64, max: f64| Range {
        min,
        max,
        min_excluded: false,
        max_excluded: false,
    };
    match *kind {
        Kind::Number(range) => limits(range),
        Kind::Integer(min, max) | Kind::Integers(_, min, max) => {
            limits(whole(min as f64, max as f64))
        }
        Kind::Signed(min, max) => limits(whole(min as f64, max as f64)),
        Kind::Spectrum | Kind::Colors => limits(POWER),
        Kind::Share => limits(SHARE),
        Kind::Vec3 | Kind::Vec3s | Kind::Pair | Kind::Pairs | Kind::Factor => limits(COORDINATE),
        _ => String::new(),
    }
}

/// Words for a range; bounds that only keep numbers finite are none.
fn limits(range: Range) -> String {
    let far = |x: f64| {
        if x.abs() >= FAR {
            x.signum() * f64::INFINITY
        } else {
            x
        }
    };
    let range = Range {
        min: far(range.min),
        max: far(range.max),
        ..range
    };
    if range.min.is_infinite() && range.max.is_infinite() {
        return String::new();
    }
    range.to_string().trim_start_matches("in ").to_owned()
}

fn rule(rule: &Rule) -> String {
    let list = |keys: &[&str]| {
        let keys: Vec<String> = keys.iter().map(|k| format!("`{k}`")).collect();
        keys.join(", ")
    };
    match rule {
        Rule::ExactlyOne(keys) => format!("Exactly one of {}.", list(keys)),
        Rule::AtMostOne(keys) => format!("At most one of {}.", list(keys)),
        Rule::AtLeastOne(keys) => format!("At least one of {}.", list(keys)),
        Rule::Needs(key, other) => format!("`{key}` needs `{other}`."),
    }
}

/// Every parameter of the plugins, by kind: type, unit, default, range, meaning.
pub fn plugin_reference(decls: &[PluginDecl]) -> String {
    let mut text = String::new();
    let mut kind = "";
    for decl in decls {
        if decl.kind != kind {
            kind = &decl.kind;
            text += &format!("\n## {kind} plugins\n");
        }
        text += &format!("\n### {}\n\n{}\n", decl.name, decl.summary);
        if decl.params.is_empty() {
            text += "\nIt has no parameters.\n";
            continue;
        }
        text += "\n| parameter | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
        for p in &decl.params {
            text += &row(&[
                &format!("`{}`", p.name),
                &param_kind(p),
                &p.unit,
                &param_default(p),
                &limits(p.range()),
                &p.help,
            ]);
        }
    }
    text
}

fn param_kind(p: &ParamDecl) -> String {
    let mut text = match &p.kind {
        ParamKind::Bool => "true or false".into(),
        ParamKind::Int => "whole number".into(),
        ParamKind::Float => "number".into(),
        ParamKind::Spectrum => "number or RGB".into(),
        ParamKind::Vec3 => "3 numbers".into(),
        ParamKind::Text => "text".into(),
        ParamKind::File => "file".into(),
        ParamKind::Choice(names) => {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            words(&names)
        }
        ParamKind::Transform => "[transform](scene.md#transforms)".into(),
        ParamKind::Plugin(kind) => format!("[{kind} plugin](#{kind}-plugins)"),
        ParamKind::Numbers => "numbers".into(),
    };
    if p.texturable {
        text += " or [texture](scene.md#texture)";
    }
    text
}

fn param_default(p: &ParamDecl) -> String {
    match &p.default {
        Some(default) => {
            let text = value(default).to_string();
            let text = text.replace(".0,", ",").replace(".0]", "]");
            format!("`{}`", text.strip_suffix(".0").unwrap_or(&text))
        }
        None if p.required => "needed".into(),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stands in parentheses at the end of a help is a default: a value, or words for one.
    #[test]
    fn defaults_are_told_from_help() {
        let page = scene_reference();
        for expected in [
            "| `seed` | whole number | 0 | ≥ 0 | Seed of all random numbers |",
            "| `up` | 3 numbers | [0, 1, 0] |  | A direction that is up in the picture |",
            "| `turbidity` | number | 3 | [2, 10] | Haze, from 2 (clear) to 10 |",
            "| `fov_x_deg` | number | needed | (0, 180) | Full horizontal field of view in degrees |",
        ] {
            assert!(page.contains(expected), "{expected}\n{page}");
        }
    }

    /// Every object that can be reached has one section, which what refers to it links to.
    #[test]
    fn every_object_has_its_section() {
        let page = scene_reference();
        for link in page
            .split("](#")
            .skip(1)
            .filter_map(|l| l.split(')').next())
        {
            let heading = |line: &str| {
                line.strip_prefix("## ")
                    .is_some_and(|h| h.replace(": ", "-") == link)
            };
            let sections = page.lines().filter(|l| heading(l)).count();
            assert!(
                sections == 1 || link == "transforms",
                "{sections} of {link}"
            );
        }
    }
}
