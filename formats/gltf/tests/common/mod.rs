//! Models made in memory.
#![allow(dead_code)]

use resolvent_gltf::{Error, Model};
use resolvent_scene::{Geometry, Mesh, Shape};
use serde_json::{Value, json};

/// The smallest PNG there is to make by hand: one white pixel, grey, 8 bits.
pub const PIXEL: &[u8] = &[
    0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, b'I', b'H', b'D', b'R', 0, 0, 0,
    1, 0, 0, 0, 1, 8, 0, 0, 0, 0, 0x3a, 0x7e, 0x9b, 0x55, 0, 0, 0, 10, b'I', b'D', b'A', b'T',
    0x78, 0x9c, 0x63, 0xf8, 0x0f, 0, 1, 1, 1, 0, 0x1b, 0xb6, 0xee, 0x56, 0, 0, 0, 0, b'I', b'E',
    b'N', b'D', 0xae, 0x42, 0x60, 0x82,
];

/// A model under construction: JSON and one buffer.
pub struct Builder {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Builder {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]
        });
        Self {
            json,
            bin: Vec::new(),
        }
    }

    /// Adds an element to a list of the model; its index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json.get(list).is_none() {
            self.json[list] = json!([]);
        }
        let all = self.json[list].as_array_mut().unwrap();
        all.push(value);
        all.len() - 1
    }

    /// Adds bytes; their buffer view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend(bytes);
        self.push(
            "bufferViews",
            json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}),
        )
    }

    /// Adds vectors of `n` numbers; their accessor.
    pub fn floats(&mut self, numbers: &[f32], n: usize) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][n - 1];
        let (mut min, mut max) = (vec![f32::MAX; n], vec![f32::MIN; n]);
        for v in numbers.chunks(n) {
            for a in 0..n {
                min[a] = min[a].min(v[a]);
                max[a] = max[a].max(v[a]);
            }
        }
        self.push(
            "accessors",
            json!({
                "bufferView": view, "componentType": 5126, "count": numbers.len() / n, "type": kind,
                "min": min, "max": max
            }),
        )
    }

    /// Adds indices of 16 bits; their accessor.
    pub fn indices(&mut self, all: &[u16]) -> usize {
        let bytes: Vec<u8> = all.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5123, "count": all.len(), "type": "SCALAR"}),
        )
    }

    /// Adds a unit square in the plane z = 0, its texture upright, with a material; its mesh.
    pub fn square(&mut self, material: Option<usize>) -> usize {
        let positions = self.floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.], 3);
        let uvs = self.floats(&[0., 1., 1., 1., 1., 0., 0., 0.], 2);
        let indices = self.indices(&[0, 1, 2, 0, 2, 3]);
        let mut p = json!({
            "attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices
        });
        if let Some(m) = material {
            p["material"] = json!(m);
        }
        self.push("meshes", json!({"name": "square", "primitives": [p]}))
    }

    /// Adds a box from −1 to 1 with outward normals; its mesh.
    pub fn cube(&mut self) -> usize {
        let (mut p, mut n, mut i) = (vec![], vec![], vec![]);
        for axis in 0..3 {
            for sign in [-1.0f32, 1.0] {
                let first = (p.len() / 3) as u16;
                for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    let mut v = [0.0f32; 3];
                    v[axis] = sign;
                    v[(axis + 1) % 3] = a * sign;
                    v[(axis + 2) % 3] = b;
                    p.extend(v);
                    let mut normal = [0.0f32; 3];
                    normal[axis] = sign;
                    n.extend(normal);
                }
                i.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
            }
        }
        let (p, n, i) = (self.floats(&p, 3), self.floats(&n, 3), self.indices(&i));
        self.push(
            "meshes",
            json!({"name": "box", "primitives": [{"attributes": {"POSITION": p, "NORMAL": n}, "indices": i}]}),
        )
    }

    /// The binary form.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = json!(self.bin.len());
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((28 + text.len() as u32 + bin.len() as u32).to_le_bytes());
        out.extend((text.len() as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(text);
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    }

    #[track_caller]
    pub fn read(&self) -> Model {
        Model::parse(&self.glb(), "folder/model.glb").unwrap_or_else(|e| panic!("{e}"))
    }

    #[track_caller]
    pub fn error(&self) -> String {
        parse_error(&self.glb())
    }
}

#[track_caller]
pub fn parse_error(bytes: &[u8]) -> String {
    let error: Error = Model::parse(bytes, "folder/model.glb").expect_err("a damaged model");
    let text = error.to_string();
    assert!(text.starts_with("folder/model.glb: "), "{text}");
    text
}

pub fn mesh(shape: &Shape) -> &Mesh {
    match &shape.geometry {
        Geometry::Mesh(m) => m,
        other => panic!("{other:?}"),
    }
}

/// A model with nearly everything: what mutants are made of.
pub fn everything() -> Builder {
    let mut b = Builder::new();
    let view = b.view(PIXEL);
    let image = b.push(
        "images",
        json!({"bufferView": view, "mimeType": "image/png"}),
    );
    let sampler = b.push(
        "samplers",
        json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}),
    );
    let texture = b.push("textures", json!({"source": image, "sampler": sampler}));
    let info = json!({"index": texture});
    let material = b.push(
        "materials",
        json!({
            "name": "all", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 1, 0.75], "baseColorTexture": info,
                "metallicFactor": 0.5, "roughnessFactor": 0.25, "metallicRoughnessTexture": info
            },
            "normalTexture": {"index": texture, "scale": 0.5}, "occlusionTexture": info,
            "emissiveFactor": [1, 0.5, 0], "emissiveTexture": info,
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 8},
                "KHR_materials_ior": {"ior": 1.25},
                "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture": info},
                "KHR_materials_volume": {
                    "thicknessFactor": 2, "attenuationColor": [1, 0.5, 0.25], "attenuationDistance": 4
                },
                "KHR_materials_clearcoat": {
                    "clearcoatFactor": 0.75, "clearcoatTexture": info, "clearcoatRoughnessFactor": 0.5
                },
                "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0, 1], "sheenRoughnessFactor": 0.25},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 2, 0.5]}
            }
        }),
    );
    let square = b.square(Some(material));
    let cube = b.cube();
    b.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 1.5}}));
    b.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 10, "color": [1, 0.5, 0.25]},
        {"type": "directional", "intensity": 3},
        {"type": "spot", "intensity": 5, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}
    ]}});
    b.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_clearcoat"]);
    b.push(
        "nodes",
        json!({"children": [1, 2, 3, 4, 5], "translation": [1, 2, 3]}),
    );
    b.push(
        "nodes",
        json!({"mesh": square, "rotation": [0, 0.6, 0, 0.8], "scale": [2, 2, 2]}),
    );
    b.push(
        "nodes",
        json!({"mesh": cube, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]}),
    );
    b.push("nodes", json!({"mesh": cube, "camera": 0}));
    b.push(
        "nodes",
        json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}),
    );
    b.push(
        "nodes",
        json!({"extensions": {"KHR_lights_punctual": {"light": 1}}, "children": [6]}),
    );
    b.push(
        "nodes",
        json!({"extensions": {"KHR_lights_punctual": {"light": 2}}}),
    );
    b
}
