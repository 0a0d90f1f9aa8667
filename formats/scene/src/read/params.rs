//! Parameters of plugins.

use super::values::text;
use super::{MAX_PARAMS, Reader};
use crate::check::{is_operations, transform};
use crate::json::{Data, Member, Node};
use crate::plugin::{Param, Value};

impl Reader<'_> {
    pub(super) fn param(&mut self, member: &Member) -> Option<(String, Param)> {
        self.count(&member.value)?;
        let place = self.checker.doc.place(&member.value);
        Some((
            member.key.to_string(),
            Param {
                value: self.value(&member.value)?,
                place,
            },
        ))
    }

    /// Counts what keeps a place; nothing once there are too many.
    pub(super) fn count(&mut self, node: &Node) -> Option<()> {
        self.params += 1;
        if self.params == MAX_PARAMS {
            let what = format!("more than {MAX_PARAMS} plugin parameters in one scene");
            self.checker.report(node, what);
        }
        (self.params < MAX_PARAMS).then_some(())
    }

    pub(super) fn value(&mut self, node: &Node) -> Option<Value> {
        Some(match &node.data {
            Data::Null => return None,
            Data::Bool(b) => Value::Bool(*b),
            Data::Number(x) => Value::Number(*x),
            Data::Text(t) => Value::Text(t.to_string()),
            Data::List(items) if is_operations(items) => Value::from(transform(node).ok()?),
            Data::List(items) => {
                Value::List(items.iter().map(|n| self.value(n)).collect::<Option<_>>()?)
            }
            Data::Object(_) => {
                self.count(node)?;
                match text(node, "texture") {
                    Some(name) => Value::Texture(name.into()),
                    None => Value::Object(self.block(node)?),
                }
            }
        })
    }

    pub(super) fn unsigned(&self, node: &Node) -> Option<u64> {
        self.checker.doc.integer(node)?.try_into().ok()
    }

    pub(super) fn integers<const N: usize>(&self, node: &Node) -> Option<[u32; N]> {
        let Data::List(items) = &node.data else {
            return None;
        };
        let all: Option<Vec<u32>> = items
            .iter()
            .map(|n| self.unsigned(n)?.try_into().ok())
            .collect();
        all?.try_into().ok()
    }
}
