//! Single values out of checked JSON.

use crate::check::transform;
use crate::describe::Vec3;
use crate::json::{Data, Node};
use crate::transform::Transform;

/// The values of an object with names as keys.
pub(super) fn members<'n>(node: &'n Node, key: &str) -> impl Iterator<Item = &'n Node> {
    let members = match node.get(key).map(|n| &n.data) {
        Some(Data::Object(members)) => &members[..],
        _ => &[],
    };
    members.iter().map(|m| &m.value)
}

pub(super) fn list<'n>(node: &'n Node, key: &str) -> &'n [Node] {
    node.get(key).map_or(&[], items)
}

pub(super) fn items(node: &Node) -> &[Node] {
    match &node.data {
        Data::List(items) => items,
        _ => &[],
    }
}

pub(super) fn number(node: &Node, key: &str) -> Option<f64> {
    match node.get(key)?.data {
        Data::Number(x) => Some(x),
        _ => None,
    }
}

pub(super) fn flag(node: &Node, key: &str) -> Option<bool> {
    match node.get(key)?.data {
        Data::Bool(b) => Some(b),
        _ => None,
    }
}

pub(super) fn text<'n>(node: &'n Node, key: &str) -> Option<&'n str> {
    match &node.get(key)?.data {
        Data::Text(t) => Some(t),
        _ => None,
    }
}

pub(super) fn floats<const N: usize>(node: &Node) -> Option<[f64; N]> {
    let Data::List(items) = &node.data else {
        return None;
    };
    let all: Option<Vec<f64>> = items
        .iter()
        .map(|n| match n.data {
            Data::Number(x) => Some(x),
            _ => None,
        })
        .collect();
    all?.try_into().ok()
}

pub(super) fn vec3(node: &Node, key: &str) -> Option<Vec3> {
    floats(node.get(key)?)
}

pub(super) fn spectrum(node: &Node, key: &str) -> Option<Vec3> {
    number(node, key)
        .map(|x| [x; 3])
        .or_else(|| vec3(node, key))
}

/// The transform of a shape, medium or environment; the identity if there is none.
pub(super) fn to_world(node: &Node) -> Option<Transform> {
    node.get("transform")
        .map_or(Some(Transform::IDENTITY), |n| transform(n).ok())
}
