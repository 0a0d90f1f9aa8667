//! Shapes and their copies.

use super::Reader;
use super::values::{flag, floats, list, number, spectrum, text, to_world, vec3};
use crate::describe::{Geometry, Instance, Mesh, Shape};
use crate::json::{Data, Node};
use crate::plugin::PluginBlock;
use indexmap::IndexMap;

impl Reader<'_> {
    pub(super) fn shapes(&mut self, nodes: &[Node]) -> Option<Vec<Shape>> {
        nodes.iter().map(|n| self.shape(n)).collect()
    }

    pub(super) fn shape(&mut self, node: &Node) -> Option<Shape> {
        let geometry = match text(node, "type")? {
            "sphere" => Geometry::Sphere {
                center: vec3(node, "center")?,
                radius: number(node, "radius")?,
            },
            "rectangle" => {
                let [corner, edge_u, edge_v] = self.rectangle(node)?;
                Geometry::Rectangle {
                    corner,
                    edge_u,
                    edge_v,
                }
            }
            "disk" => Geometry::Disk {
                center: vec3(node, "center")?,
                normal: self.direction(node, "normal")?,
                radius: number(node, "radius")?,
            },
            "cylinder" => Geometry::Cylinder {
                base: vec3(node, "base")?,
                axis: self.direction(node, "axis")?,
                radius: number(node, "radius")?,
            },
            "mesh" => Geometry::Mesh(self.mesh(node)?),
            "gltf" => Geometry::Gltf {
                file: text(node, "file")?.into(),
                transform: to_world(node)?,
            },
            "ply" => Geometry::Ply {
                file: text(node, "file")?.into(),
                transform: to_world(node)?,
            },
            _ => return None,
        };
        Some(Shape {
            geometry,
            material: text(node, "material").map(String::from),
            emission: spectrum(node, "emission"),
            emission_texture: text(node, "emission_texture").map(String::from),
            two_sided: flag(node, "two_sided").unwrap_or(false),
            shaping: match node.get("shaping") {
                Some(n) => Some(self.shaping(n)?),
                None => None,
            },
            interior: text(node, "interior").map(String::from),
            priority: match node.get("priority") {
                Some(n) => self.checker.doc.integer(n)?.try_into().ok()?,
                None => 0,
            },
        })
    }

    pub(super) fn mesh(&mut self, node: &Node) -> Option<Mesh> {
        let mesh = Mesh {
            positions: list(node, "positions")
                .iter()
                .map(floats)
                .collect::<Option<_>>()?,
            indices: list(node, "indices")
                .iter()
                .map(|n| self.integers(n))
                .collect::<Option<_>>()?,
            normals: list(node, "normals")
                .iter()
                .map(floats)
                .collect::<Option<_>>()?,
            uvs: list(node, "uvs")
                .iter()
                .map(floats)
                .collect::<Option<_>>()?,
            colors: list(node, "colors")
                .iter()
                .map(|n| floats(n).or_else(|| floats(n).map(|[r, g, b]| [r, g, b, 1.0])))
                .collect::<Option<_>>()?,
            tangents: list(node, "tangents")
                .iter()
                .map(floats)
                .collect::<Option<_>>()?,
            transform: to_world(node)?,
        };
        let corners = mesh.positions.len();
        if mesh.indices.is_empty() {
            self.checker
                .report(node.get("indices")?, "expected at least one triangle");
        }
        for (triangle, at) in mesh.indices.iter().zip(list(node, "indices")) {
            if let Some(i) = triangle.iter().find(|i| **i as usize >= corners) {
                self.checker.report(
                    at,
                    format!(
                        "expected indices below {corners} (the number of positions), found {i}"
                    ),
                );
            }
        }
        for (key, count) in [
            ("normals", mesh.normals.len()),
            ("uvs", mesh.uvs.len()),
            ("colors", mesh.colors.len()),
            ("tangents", mesh.tangents.len()),
        ] {
            if let Some(at) = node.get(key)
                && count != corners
            {
                self.checker.report(
                    at,
                    format!("expected one per position ({corners}), found {count}"),
                );
            }
        }
        Some(mesh)
    }

    pub(crate) fn block(&mut self, node: &Node) -> Option<PluginBlock> {
        let params = match node.get("params").map(|n| &n.data) {
            Some(Data::Object(members)) => members
                .iter()
                .map(|m| self.param(m))
                .collect::<Option<_>>()?,
            _ => IndexMap::new(),
        };
        Some(PluginBlock {
            plugin: text(node, "plugin")?.into(),
            params,
            place: self.checker.doc.place(node),
        })
    }
}

pub(super) fn instance(node: &Node) -> Option<Instance> {
    Some(Instance {
        prototype: text(node, "prototype")?.into(),
        transform: to_world(node)?,
        transforms: text(node, "transforms").map(String::from),
        material: text(node, "material").map(String::from),
    })
}
