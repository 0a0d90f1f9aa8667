//! Checks JSON against the tables of [`crate::format`] and reports everything that is wrong.

use std::path::Path;

use crate::error::{Place, Problem};
use crate::format::{COORDINATE, Kind, Object, POWER, Range, Rule, SHARE};
use crate::json::{Data, Document, Member, Node, quoted};
use crate::nearest::hint;
use crate::transform::{Transform, length};

/// More problems than this are not worth reading.
const MAX_PROBLEMS: usize = 50;

/// Collects problems of one document.
pub(crate) struct Checker<'d> {
    pub doc: &'d Document<'d>,
    file: &'d Path,
    problems: Vec<Problem>,
}

impl<'d> Checker<'d> {
    pub fn new(doc: &'d Document<'d>, file: &'d Path) -> Checker<'d> {
        Checker {
            doc,
            file,
            problems: Vec::new(),
        }
    }

    /// The problems found so far.
    pub fn finish(self) -> Result<(), Vec<Problem>> {
        if self.problems.is_empty() {
            Ok(())
        } else {
            Err(self.problems)
        }
    }

    /// True if further problems are dropped, and need not be worded.
    pub fn is_full(&self) -> bool {
        self.problems.len() >= MAX_PROBLEMS
    }

    pub fn report(&mut self, node: &Node, what: impl Into<String>) {
        if !self.is_full() {
            self.report_at(self.doc.place(node), what);
        }
    }

    pub fn report_at(&mut self, place: Place, what: impl Into<String>) {
        if !self.is_full() {
            self.problems.push(Problem::new(self.file, place, what));
        }
    }

    fn mismatch(&mut self, node: &Node, expected: &str) {
        self.report(node, format!("expected {expected}, found {}", node.found()));
    }

    /// Checks one value.
    pub fn check(&mut self, node: &Node, kind: &Kind) {
        match *kind {
            Kind::Bool => {
                if !matches!(node.data, Data::Bool(_)) {
                    self.mismatch(node, "true or false");
                }
            }
            Kind::Number(range) => self.number(node, range),
            Kind::Integer(min, max) => self.integer(node, min.into(), max.into()),
            Kind::Signed(min, max) => self.integer(node, min.into(), max.into()),
            Kind::Integers(count, min, max) => {
                if let Some(items) = self.list(
                    node,
                    &format!("a list of {count} whole numbers"),
                    Some(count),
                ) {
                    items
                        .iter()
                        .for_each(|item| self.integer(item, min.into(), max.into()));
                }
            }
            Kind::Text => {
                if !matches!(node.data, Data::Text(_)) {
                    self.mismatch(node, "a text");
                }
            }
            Kind::Name => match &node.data {
                Data::Text(t) if !t.is_empty() && !t.contains('\0') => {}
                _ => self.mismatch(node, "a text that is not empty"),
            },
            Kind::Layers(names, most) => self.layers(node, names, most),
            Kind::Choice(names) => self.choice(node, names),
            Kind::Pair => self.numbers(node, 2, "a list of two numbers", COORDINATE),
            Kind::Factor => match node.data {
                Data::Number(_) => self.number(node, COORDINATE),
                _ => self.numbers(node, 3, "a number or a list of three (RGB)", COORDINATE),
            },
            Kind::Vec3 => self.numbers(node, 3, "a list of three numbers", COORDINATE),
            Kind::Vec3s => self.tuples(node, 3, "a list of three numbers"),
            Kind::Pairs => self.tuples(node, 2, "a list of two numbers"),
            Kind::Fours => self.tuples(node, 4, "a list of four numbers"),
            Kind::Colors => {
                let items = self.list(node, "a list of colours", None);
                for item in items.unwrap_or_default() {
                    let rgba = matches!(&item.data, Data::List(n) if n.len() == 4);
                    let what = "a list of three numbers (RGB) or four (RGBA)";
                    self.numbers(item, if rgba { 4 } else { 3 }, what, POWER);
                }
            }
            Kind::Triangles => {
                for item in self
                    .list(node, "a list of triangles", None)
                    .unwrap_or_default()
                {
                    self.check(item, &Kind::Integers(3, 0, u64::from(u32::MAX)));
                }
            }
            Kind::Spectrum => match node.data {
                Data::Number(_) => self.number(node, POWER),
                _ => self.numbers(node, 3, "a number or a list of three (RGB)", POWER),
            },
            Kind::Share => match node.data {
                Data::Number(_) => self.number(node, SHARE),
                _ => self.numbers(node, 3, "a number or a list of three (RGB)", SHARE),
            },
            Kind::Transform => {
                if let Err((at, what)) = transform(node) {
                    self.report(at, what);
                }
            }
            Kind::Params(_) => {
                for member in self.members(node).unwrap_or_default() {
                    self.param(&member.value);
                }
            }
            Kind::Object(object) => self.object(node, object, false),
            Kind::Variants(variants) => self.variants(node, variants),
            Kind::List(item_kind) => {
                for item in self.list(node, "a list", None).unwrap_or_default() {
                    self.check(item, item_kind);
                }
            }
            Kind::Named(item_kind) => {
                for member in self.members(node).unwrap_or_default() {
                    if member.key.is_empty() {
                        self.report_at(self.doc.place_of_key(member), "a name must not be empty");
                    }
                    self.check(&member.value, item_kind);
                }
            }
        }
    }

    fn members<'n>(&mut self, node: &'n Node) -> Option<&'n [Member]> {
        match &node.data {
            Data::Object(members) => Some(members),
            _ => {
                self.mismatch(node, "an object");
                None
            }
        }
    }

    fn list<'n>(
        &mut self,
        node: &'n Node,
        expected: &str,
        count: Option<usize>,
    ) -> Option<&'n [Node]> {
        match &node.data {
            Data::List(items) if count.is_none_or(|n| n == items.len()) => Some(items),
            _ => {
                self.mismatch(node, expected);
                None
            }
        }
    }

    fn number(&mut self, node: &Node, range: Range) {
        match node.data {
            Data::Number(x) if range.contains(x) => {}
            _ => self.mismatch(node, &format!("a number {range}")),
        }
    }

    fn integer(&mut self, node: &Node, min: i128, max: i128) {
        match self.doc.integer(node) {
            Some(i) if i >= min && i <= max => {}
            _ => self.mismatch(node, &format!("a whole number in [{min}, {max}]")),
        }
    }

    fn numbers(&mut self, node: &Node, count: usize, expected: &str, range: Range) {
        if let Some(items) = self.list(node, expected, Some(count)) {
            items.iter().for_each(|item| self.number(item, range));
        }
    }

    fn tuples(&mut self, node: &Node, count: usize, expected: &str) {
        for item in self
            .list(node, "a list of lists of numbers", None)
            .unwrap_or_default()
        {
            self.numbers(item, count, expected, COORDINATE);
        }
    }

    fn choice(&mut self, node: &Node, names: &'static [&'static str]) {
        match &node.data {
            Data::Text(t) if names.contains(&&**t) => {}
            Data::Text(t) => {
                self.report(
                    node,
                    format!(
                        "unknown name {}{}",
                        quoted(t),
                        hint(t, names.iter().copied())
                    ),
                );
            }
            _ => self.mismatch(node, &format!("one of {}", names.join(", "))),
        }
    }

    /// A list of layers: names, and `orders:N` once.
    fn layers(&mut self, node: &Node, names: &'static [&'static str], most: u32) {
        let items = self.list(node, "a list of names", None).unwrap_or_default();
        let orders = |n: &Node| matches!(&n.data, Data::Text(t) if t.starts_with("orders"));
        for (i, item) in items.iter().enumerate() {
            match &item.data {
                Data::Text(t) if orders(item) => {
                    if crate::Aov::parse(t).is_none() {
                        let what = format!(
                            "{} is no layer; orders are asked for as \"orders:N\", N from 0 to {most}",
                            quoted(t)
                        );
                        self.report(item, what);
                    }
                }
                _ => self.choice(item, names),
            }
            // One more than there are names: longer lists repeat one of these.
            let mut before = items[..i.min(names.len() + 1)].iter();
            if before.any(|other| same_text(other, item) || (orders(other) && orders(item))) {
                self.report(item, format!("{} is named twice", item.found()));
            }
        }
    }

    fn object(&mut self, node: &Node, object: &Object, variant: bool) {
        let Some(members) = self.members(node) else {
            return;
        };
        for member in members {
            match object.fields.iter().find(|f| f.name == &*member.key) {
                Some(field) => self.check(&member.value, &field.kind),
                None if self.is_full() || (variant && &*member.key == "type") => {}
                None => {
                    let names = object.fields.iter().map(|f| f.name);
                    let what = format!(
                        "{} has no key {}{}",
                        object.name,
                        quoted(&member.key),
                        hint(&member.key, names)
                    );
                    self.report_at(self.doc.place_of_key(member), what);
                }
            }
        }
        for field in object
            .fields
            .iter()
            .filter(|f| f.required && node.get(f.name).is_none())
        {
            self.missing(node, object, field.name);
        }
        for rule in object.rules {
            self.rule(node, object, rule);
        }
    }

    fn missing(&mut self, node: &Node, object: &Object, key: &str) {
        let help = object
            .fields
            .iter()
            .find(|f| f.name == key)
            .map_or("", |f| f.help);
        self.report(
            node,
            format!("{} needs the key \"{key}\": {help}", object.name),
        );
    }

    fn rule(&mut self, node: &Node, object: &Object, rule: &Rule) {
        let given = |keys: &'static [&'static str]| -> Vec<&'static str> {
            keys.iter()
                .copied()
                .filter(|k| node.get(k).is_some())
                .collect()
        };
        let name = object.name;
        match *rule {
            Rule::ExactlyOne(keys) | Rule::AtMostOne(keys) if given(keys).len() > 1 => {
                let both = given(keys).join("\" and \"");
                self.report(
                    node,
                    format!("{name} has the keys \"{both}\", of which only one may be given"),
                );
            }
            Rule::ExactlyOne(keys) | Rule::AtLeastOne(keys) if given(keys).is_empty() => {
                self.report(
                    node,
                    format!("{name} needs one of the keys \"{}\"", keys.join("\", \"")),
                );
            }
            Rule::Needs(key, other) if node.get(key).is_some() && node.get(other).is_none() => {
                self.report(
                    node,
                    format!("{name} has the key \"{key}\" and so needs \"{other}\""),
                );
            }
            _ => {}
        }
    }

    fn variants(&mut self, node: &Node, variants: &[&'static Object]) {
        if self.members(node).is_none() {
            return;
        }
        let names = variants.iter().map(|v| v.name);
        match node.get("type") {
            None => {
                let known: Vec<_> = names.collect();
                self.report(
                    node,
                    format!("this object needs the key \"type\": {}", known.join(", ")),
                );
            }
            Some(tag) => match &tag.data {
                Data::Text(t) => match variants.iter().find(|v| v.name == &**t) {
                    Some(object) => self.object(node, object, true),
                    None => {
                        self.report(tag, format!("unknown type {}{}", quoted(t), hint(t, names)))
                    }
                },
                _ => {
                    let known: Vec<_> = names.collect();
                    self.mismatch(tag, &format!("one of {}", known.join(", ")));
                }
            },
        }
    }

    /// A parameter's value: what kind it must be, only the plugin knows.
    fn param(&mut self, node: &Node) {
        match &node.data {
            Data::Null => self.mismatch(node, "a value (leave the key out for the default)"),
            Data::List(items) if is_operations(items) => self.check(node, &Kind::Transform),
            Data::List(items) => items.iter().for_each(|item| self.param(item)),
            Data::Object(members) if node.get("texture").is_some() => {
                for member in members {
                    if &*member.key == "texture" {
                        self.check(&member.value, &Kind::Name);
                        continue;
                    }
                    let what = format!("a texture's use has no key {}", quoted(&member.key));
                    self.report_at(self.doc.place_of_key(member), what);
                }
            }
            Data::Object(members) => {
                for member in members
                    .iter()
                    .filter(|m| !matches!(&*m.key, "plugin" | "params"))
                {
                    let what = format!(
                        "a nested plugin has no key {}{}",
                        quoted(&member.key),
                        hint(&member.key, ["plugin", "params"])
                    );
                    self.report_at(self.doc.place_of_key(member), what);
                }
                match node.get("plugin") {
                    Some(plugin) => self.check(plugin, &Kind::Name),
                    None => self.report(node, "a nested plugin needs the key \"plugin\": its name (and a texture's use the key \"texture\")"),
                }
                if let Some(params) = node.get("params") {
                    self.check(params, &Kind::Params(""));
                }
            }
            _ => {}
        }
    }
}

fn same_text(a: &Node, b: &Node) -> bool {
    matches!((&a.data, &b.data), (Data::Text(a), Data::Text(b)) if a == b)
}

/// The keys of a transform's operations.
pub(crate) const OPERATIONS: [&str; 4] = ["translate", "rotate_deg", "scale", "matrix"];

/// True for a list that can only be meant as a transform's operations.
pub(crate) fn is_operations(items: &[Node]) -> bool {
    let operation = |n: &Node| matches!(&n.data, Data::Object(m) if m.len() == 1 && OPERATIONS.contains(&&*m[0].key));
    !items.is_empty() && items.iter().all(operation)
}

type Faulty<'n, T> = Result<T, (&'n Node, String)>;

fn floats<const N: usize>(node: &Node) -> Faulty<'_, [f64; N]> {
    let fault = || {
        (
            node,
            format!(
                "expected a list of {N} numbers {COORDINATE}, found {}",
                node.found()
            ),
        )
    };
    let Data::List(items) = &node.data else {
        return Err(fault());
    };
    let mut out = [0.0; N];
    if items.len() != N {
        return Err(fault());
    }
    for (x, item) in out.iter_mut().zip(items) {
        match item.data {
            Data::Number(value) if COORDINATE.contains(value) => *x = value,
            _ => {
                return Err((
                    item,
                    format!("expected a number {COORDINATE}, found {}", item.found()),
                ));
            }
        }
    }
    Ok(out)
}

/// Reads a transform: four rows of four numbers, or a list of operations that are applied in order.
pub(crate) fn transform(node: &Node) -> Faulty<'_, Transform> {
    let expected = || {
        let what = "expected four rows of four numbers or a list of operations (translate, rotate_deg, scale, matrix)";
        (node, format!("{what}, found {}", node.found()))
    };
    let Data::List(items) = &node.data else {
        return Err(expected());
    };
    let result = match items.first().map(|n| &n.data) {
        Some(Data::Object(_)) => {
            let mut all = Transform::IDENTITY;
            for item in items {
                all = all.then(&operation(item)?);
            }
            all
        }
        Some(Data::List(_)) if items.len() == 4 => {
            let mut rows = [[0.0; 4]; 4];
            for (row, item) in rows.iter_mut().zip(items) {
                *row = floats(item)?;
            }
            Transform(rows)
        }
        _ => return Err(expected()),
    };
    match result.fault() {
        Some(fault) => Err((
            node,
            format!("expected a transform that can be inverted, found {fault}"),
        )),
        None => Ok(result),
    }
}

fn operation(node: &Node) -> Faulty<'_, Transform> {
    let member = match &node.data {
        Data::Object(members) if members.len() == 1 => &members[0],
        _ => {
            let what =
                "expected an object with one key out of translate, rotate_deg, scale, matrix";
            return Err((node, format!("{what}, found {}", node.found())));
        }
    };
    let value = &member.value;
    match &*member.key {
        "translate" => Ok(Transform::translate(floats(value)?)),
        "scale" => match value.data {
            Data::Number(s) if COORDINATE.contains(s) => Ok(Transform::scale([s; 3])),
            _ => Ok(Transform::scale(floats(value)?)),
        },
        "matrix" => transform(value),
        "rotate_deg" => {
            let keys = matches!(&value.data, Data::Object(members) if members.len() == 2);
            let (Some(axis), Some(angle), true) = (value.get("axis"), value.get("angle"), keys)
            else {
                return Err((
                    value,
                    format!(
                        "expected {{\"axis\": [x, y, z], \"angle\": degrees}}, found {}",
                        value.found()
                    ),
                ));
            };
            let direction = floats(axis)?;
            if length(direction) == 0.0 {
                return Err((
                    axis,
                    "expected an axis that is not zero, found [0, 0, 0]".into(),
                ));
            }
            match angle.data {
                Data::Number(a) if a.abs() <= 1e6 => Ok(Transform::rotate_deg(direction, a)),
                _ => Err((
                    angle,
                    format!(
                        "expected an angle in degrees in [-1e6, 1e6], found {}",
                        angle.found()
                    ),
                )),
            }
        }
        key => Err((
            node,
            format!("unknown operation {}{}", quoted(key), hint(key, OPERATIONS)),
        )),
    }
}
