//! Meshes: triangles, strips and fans with their normals and texture coordinates.

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use resolvent_scene::{Geometry, Mesh, Shape};

use crate::accessor::Accessors;
use crate::error::Fallible;
use crate::material::{Converted, Materials};

/// Triangles that a model may have for each of its bytes, and without any: primitives can share their data, and a small file
/// must not become a huge scene.
const PER_BYTE: usize = 16;
const FREE: usize = 1 << 16;

/// Makes shapes of primitives.
pub(crate) struct Meshes<'c> {
    root: &'c json::Root,
    accessors: Accessors<'c>,
    /// Triangles that may still be made.
    budget: usize,
}

impl<'c> Meshes<'c> {
    /// `bytes` is the size of the model with its buffers.
    pub fn new(root: &'c json::Root, accessors: Accessors<'c>, bytes: usize) -> Meshes<'c> {
        Meshes {
            root,
            accessors,
            budget: bytes.saturating_mul(PER_BYTE).saturating_add(FREE),
        }
    }

    /// The shapes of a mesh, in its own space.
    pub fn shapes(&mut self, mesh: usize, materials: &mut Materials) -> Fallible<Vec<Shape>> {
        let root = self.root;
        let found = root.meshes.get(mesh);
        let found = found.ok_or_else(|| format!("meshes[{mesh}] does not exist"))?;
        let mut out = Vec::new();
        for (i, p) in found.primitives.iter().enumerate() {
            let at = format!("meshes[{mesh}].primitives[{i}]");
            let shape = self.primitive(p, &at, materials);
            out.extend(shape.map_err(|what| format!("{at}: {what}"))?);
        }
        Ok(out)
    }

    fn primitive(
        &mut self,
        p: &Primitive,
        at: &str,
        materials: &mut Materials,
    ) -> Fallible<Option<Shape>> {
        let attribute = |s: Semantic| p.attributes.get(&Checked::Valid(s)).copied();
        let mode = match &p.mode {
            Checked::Valid(mode) => *mode,
            Checked::Invalid => return Err("has an unknown mode".into()),
        };
        if !matches!(
            mode,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            materials.warn(at, &format!("{mode:?} are no surface and are left out"));
            return Ok(None);
        }
        let positions = attribute(Semantic::Positions).ok_or("has no positions")?;
        if p.targets.as_ref().is_some_and(|t| !t.is_empty()) {
            let mesh = at.split('.').next().unwrap_or(at);
            let what = format!("morph targets of {mesh}");
            materials.warn(&what, "the mesh is shown in its base shape");
        }
        let colors = attribute(Semantic::Colors(0));
        let material = materials.get(p.material.map(|m| m.value()), colors.is_some())?;
        let positions = self.accessors.vectors::<3>(positions)?;
        let order = match p.indices {
            Some(indices) => self.accessors.indices(indices)?,
            None => {
                let count = u32::try_from(positions.len()).map_err(|_| "has too many vertices")?;
                (0..count).collect()
            }
        };
        let triangles = triangles(mode, &order);
        if let Some(i) = triangles
            .iter()
            .flatten()
            .find(|i| **i as usize >= positions.len())
        {
            return Err(format!("names vertex {i} of {}", positions.len()));
        }
        self.budget = self
            .budget
            .checked_sub(triangles.len())
            .ok_or("with it the model has more triangles than a file of its size can describe")?;
        let vectors = |accessor: Option<Index<json::Accessor>>| match accessor {
            Some(a) => self.accessors.vectors::<3>(a),
            None => Ok(Vec::new()),
        };
        let normals = vectors(attribute(Semantic::Normals))?;
        let uvs = match attribute(Semantic::TexCoords(material.uv_set)) {
            Some(a) => self.accessors.vectors::<2>(a)?,
            None => Vec::new(),
        };
        let colors = match colors {
            Some(a) => self.accessors.colors(a)?,
            None => Vec::new(),
        };
        // Without normals the ones of the file's tangents are not known.
        let tangents = match attribute(Semantic::Tangents) {
            Some(a) if material.has_normal_map && !normals.is_empty() => {
                self.accessors.vectors::<4>(a)?
            }
            _ => Vec::new(),
        };
        for (name, count) in [
            ("normals", normals.len()),
            ("texture coordinates", uvs.len()),
            ("colours", colors.len()),
            ("tangents", tangents.len()),
        ] {
            if count != 0 && count != positions.len() {
                return Err(format!(
                    "has {count} {name} for {} vertices",
                    positions.len()
                ));
            }
        }
        if triangles.is_empty() {
            return Ok(None);
        }
        Ok(Some(shape(
            compact(
                Mesh {
                    positions,
                    normals,
                    uvs,
                    colors,
                    tangents,
                    ..Mesh::default()
                },
                triangles,
            ),
            &material,
        )))
    }
}

fn shape(mesh: Mesh, material: &Converted) -> Shape {
    Shape {
        geometry: Geometry::Mesh(mesh),
        material: Some(material.material.clone()),
        emission: material.emission,
        emission_texture: material.emission_texture.clone(),
        two_sided: material.two_sided && material.emission.is_some(),
        shaping: None,
        interior: material.interior.clone(),
        priority: 0,
    }
}

/// Corners of triangles (glTF 2.0, §3.7.2.1); incomplete ones at the end are left out.
fn triangles(mode: Mode, order: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => order
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                // Every second triangle runs the other way.
                let odd = i % 2;
                [w[0], w[1 + odd], w[2 - odd]]
            })
            .collect(),
        Mode::TriangleFan => match order.split_first() {
            Some((first, rest)) => rest.windows(2).map(|w| [w[0], w[1], *first]).collect(),
            None => Vec::new(),
        },
        _ => order.as_chunks::<3>().0.to_vec(),
    }
}

/// The mesh with the vertices that its triangles use, in the order of their use: primitives often share one large set. v is turned
/// upwards.
fn compact(all: Mesh, triangles: Vec<[u32; 3]>) -> Mesh {
    const NONE: u32 = u32::MAX;
    let mut new = vec![NONE; all.positions.len()];
    let mut mesh = Mesh::default();
    mesh.indices = triangles
        .iter()
        .map(|t| {
            t.map(|i| {
                let i = i as usize;
                if new[i] == NONE {
                    new[i] = mesh.positions.len() as u32;
                    mesh.positions.push(all.positions[i]);
                    mesh.normals.extend(all.normals.get(i));
                    mesh.uvs.extend(all.uvs.get(i).map(|[u, v]| [*u, 1.0 - v]));
                    mesh.colors.extend(all.colors.get(i));
                    mesh.tangents.extend(all.tangents.get(i));
                }
                new[i]
            })
        })
        .collect();
    mesh
}
