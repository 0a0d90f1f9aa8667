//! Meshes: triangles, strips and fans with their normals and texture coordinates.

use gltf::json;
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use resolvent_scene::{Geometry, Mesh, Shape};

use crate::accessor::{Accessor, Accessors, allowance};
use crate::error::Fallible;
use crate::material::{Converted, Materials};

/// Makes shapes of primitives.
pub(crate) struct Meshes<'c> {
    root: &'c json::Root,
    accessors: Accessors<'c>,
    /// Triangles that may still be made.
    budget: usize,
    numbers: Numbers,
}

/// The vertices of one primitive among those that it may share with others.
#[derive(Default)]
struct Numbers {
    /// By the vertex in the accessor its number in the mesh, [`Numbers::NONE`] for all that are not taken. It serves all
    /// primitives: each takes time for its own vertices, however many the accessor has.
    new: Vec<u32>,
    /// The vertices taken, in the order of their numbers.
    taken: Vec<u32>,
}

impl Numbers {
    const NONE: u32 = u32::MAX;

    /// Numbers the vertices of triangles in the order of their use, out of `count`; the triangles with these numbers.
    fn take(&mut self, triangles: Vec<[u32; 3]>, count: usize) -> Vec<[u32; 3]> {
        for old in self.taken.drain(..) {
            self.new[old as usize] = Self::NONE;
        }
        if self.new.len() < count {
            self.new.resize(count, Self::NONE);
        }
        let mut number = |old: u32| {
            let new = &mut self.new[old as usize];
            if *new == Self::NONE {
                *new = self.taken.len() as u32;
                self.taken.push(old);
            }
            *new
        };
        triangles.into_iter().map(|t| t.map(&mut number)).collect()
    }

    /// What an accessor has for the vertices taken.
    fn of<'c, T>(
        &self,
        accessor: Option<&Accessor<'c>>,
        get: impl Fn(&Accessor<'c>, usize) -> Fallible<T>,
    ) -> Fallible<Vec<T>> {
        let Some(accessor) = accessor else {
            return Ok(Vec::new());
        };
        let mut out = Vec::with_capacity(self.taken.len());
        for old in &self.taken {
            out.push(get(accessor, *old as usize)?);
        }
        Ok(out)
    }
}

impl<'c> Meshes<'c> {
    /// `bytes` is the size of the model with its buffers.
    pub fn new(root: &'c json::Root, accessors: Accessors<'c>, bytes: usize) -> Meshes<'c> {
        Meshes {
            root,
            accessors,
            budget: allowance(bytes),
            numbers: Numbers::default(),
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
        let positions = self.accessors.get(positions, &[Type::Vec3])?;
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
        let mut beside = |name: &str, semantic: Semantic, kinds: &[Type]| {
            let Some(accessor) = attribute(semantic) else {
                return Ok(None);
            };
            let found = self.accessors.get(accessor, kinds)?;
            if found.len() != 0 && found.len() != positions.len() {
                return Err(format!(
                    "has {} {name} for {} vertices",
                    found.len(),
                    positions.len()
                ));
            }
            Ok(Some(found).filter(|f| f.len() != 0))
        };
        let normals = beside("normals", Semantic::Normals, &[Type::Vec3])?;
        let uvs = Semantic::TexCoords(material.uv_set);
        let uvs = beside("texture coordinates", uvs, &[Type::Vec2])?;
        let colors = beside("colours", Semantic::Colors(0), &[Type::Vec3, Type::Vec4])?;
        // Without normals the ones of the file's tangents are not known.
        let tangents = if material.has_normal_map && normals.is_some() {
            beside("tangents", Semantic::Tangents, &[Type::Vec4])?
        } else {
            None
        };
        if triangles.is_empty() {
            return Ok(None);
        }
        let numbers = &mut self.numbers;
        let indices = numbers.take(triangles, positions.len());
        let mesh = Mesh {
            positions: numbers.of(Some(&positions), |a, i| a.vector(i))?,
            normals: numbers.of(normals.as_ref(), |a, i| a.vector(i))?,
            // v is turned upwards.
            uvs: numbers.of(uvs.as_ref(), |a, i| a.vector(i).map(|[u, v]| [u, 1.0 - v]))?,
            colors: numbers.of(colors.as_ref(), Accessor::color)?,
            tangents: numbers.of(tangents.as_ref(), |a, i| a.vector(i))?,
            indices,
            ..Mesh::default()
        };
        Ok(Some(shape(mesh, &material)))
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
