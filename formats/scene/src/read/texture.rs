//! Reading textures and materials, after [`crate::check`].

use indexmap::IndexMap;

use super::Reader;
use super::values::{flag, floats, number, spectrum, text};
use crate::base64;
use crate::describe::Material;
use crate::json::{Node, quoted};
use crate::nearest::hint;
use crate::texture::*;

impl Reader<'_> {
    pub(crate) fn texture(&mut self, node: &Node) -> Option<Texture> {
        let image = match (text(node, "file"), node.get("data")) {
            (Some(file), _) => ImageSource::File(file.into()),
            (None, Some(data)) => {
                let place = self.checker.doc.place(node);
                let Some(bytes) = base64::decode(text(node, "data")?) else {
                    self.checker.report(data, "expected bytes in base64");
                    return None;
                };
                ImageSource::Memory(MemoryImage {
                    name: place.path,
                    bytes: bytes.into(),
                })
            }
            // The check asks for one of the three.
            (None, None) => ImageSource::White,
        };
        let wrap = |key: &str| {
            let word = text(node, key).or_else(|| text(node, "wrap"));
            word.and_then(|w| named(&WRAPS, w)).unwrap_or_default()
        };
        let uv = node
            .get("uv_transform")
            .map_or_else(UvTransform::default, |t| {
                let pair = |key: &str| t.get(key).and_then(floats);
                UvTransform {
                    scale: pair("scale").unwrap_or([1.0; 2]),
                    rotation_deg: number(t, "rotation_deg").unwrap_or(0.0),
                    offset: pair("offset").unwrap_or([0.0; 2]),
                }
            });
        Some(Texture {
            image,
            vertex_color: flag(node, "vertex_color").unwrap_or(false),
            color_space: text(node, "color_space")
                .and_then(|w| named(&COLOR_SPACES, w))
                .unwrap_or_default(),
            wrap: [wrap("wrap_u"), wrap("wrap_v")],
            filter: text(node, "filter")
                .and_then(|w| named(&FILTERS, w))
                .unwrap_or_default(),
            channel: text(node, "channel").and_then(|w| named(&CHANNELS, w)),
            scale: spectrum(node, "scale").unwrap_or([1.0; 3]),
            bias: spectrum(node, "bias").unwrap_or([0.0; 3]),
            uv,
            place: self.checker.doc.place(node),
        })
    }

    pub(crate) fn material(&mut self, node: &Node) -> Option<Material> {
        Some(Material {
            block: self.block(node)?,
            normal_map: node.get("normal_map").and_then(|n| {
                Some(NormalMap {
                    texture: text(n, "texture")?.into(),
                    scale: number(n, "scale").unwrap_or(1.0),
                })
            }),
        })
    }

    /// Reports the textures of a material that do not exist.
    pub(crate) fn known_textures(
        &mut self,
        node: &Node,
        material: &Material,
        all: &IndexMap<String, Texture>,
    ) {
        let map = material.normal_map.as_ref();
        let place = map.map(|_| {
            self.checker
                .doc
                .place(node.get("normal_map").unwrap_or(node))
        });
        let map = map.map(|m| m.texture.as_str()).zip(place.as_ref());
        for (name, place) in material.block.textures().into_iter().chain(map) {
            if !all.contains_key(name) && !self.checker.is_full() {
                let hint = hint(name, all.keys().map(String::as_str));
                let what = format!("no texture is named {}{hint}", quoted(name));
                self.checker.report_at(place.clone(), what);
            }
        }
    }
}
