//! Prototypes and their instances: from the description to geometry, and what stands behind the shapes of each copy.

use super::Surface;
use super::shapes::{Wide, affine};
use crate::error::{Error, Result};
use crate::geometry::{Accel, Cylinder, Disk, Geometry, Instance, Quad, Shape, Sphere};
use glam::DVec3;
use resolvent_api::{Affine, Vec3};
use resolvent_scene as describe;
use resolvent_scene::table;
use std::collections::HashMap;

/// What stands behind the shapes of instances. Copies that differ in nothing but their place share it.
#[derive(Default)]
pub struct Copies {
    /// Where each instance's surfaces begin.
    first: Vec<u32>,
    surfaces: Vec<Surface>,
}

impl Copies {
    /// The surface of a shape of an instance.
    pub fn surface(&self, instance: u32, shape: u32) -> &Surface {
        &self.surfaces[(self.first[instance as usize] + shape) as usize]
    }

    /// All of them.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    pub(super) fn surfaces_mut(&mut self) -> &mut [Surface] {
        &mut self.surfaces
    }

    /// Adds an instance whose surfaces are those of an earlier one.
    fn share(&mut self, first: u32) {
        self.first.push(first);
    }

    fn add(&mut self, surfaces: Vec<Surface>) -> u32 {
        let first = self.surfaces.len() as u32;
        self.surfaces.extend(surfaces);
        self.first.push(first);
        first
    }
}

/// A prototype that some instance uses, in its own space, and still in double precision.
pub(super) struct Group<'s> {
    name: &'s str,
    described: &'s [describe::Shape],
    shapes: Vec<Wide>,
    /// Corners of a box around it.
    bounds: (DVec3, DVec3),
    emits: bool,
}

/// The prototypes and instances of a scene.
pub(super) struct Groups<'s> {
    groups: Vec<Group<'s>>,
    /// With the index of their group and their transform to the world.
    instances: Vec<(usize, &'s describe::Instance, Affine)>,
}

impl<'s> Groups<'s> {
    /// Reads the prototypes that are used, and no others.
    pub fn read(scene: &'s describe::Scene) -> Result<Self> {
        let mut groups: Vec<Group> = Vec::new();
        let mut index: HashMap<&str, usize> = HashMap::new();
        let mut instances = Vec::with_capacity(scene.instances.len());
        for (number, instance) in scene.instances.iter().enumerate() {
            let name = instance.prototype.as_str();
            let group = match index.get(name) {
                Some(i) => *i,
                None => {
                    groups.push(Group::read(scene, name)?);
                    index.insert(name, groups.len() - 1);
                    groups.len() - 1
                }
            };
            let to_world = affine(&instance.transform);
            let Some(file) = &instance.transforms else {
                instances.push((group, instance, to_world));
                continue;
            };
            let table = table::read(&scene.resolve(file))
                .map_err(|e| Error::Input(format!("$.instances[{number}].transforms: {e}")))?;
            instances.reserve(table.len());
            instances.extend(
                table
                    .iter()
                    .map(|t| (group, instance, to_world.after(&affine(t)))),
            );
        }
        Ok(Self { groups, instances })
    }

    /// Boxes around the instances in the world.
    pub fn boxes(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.instances.iter().map(|(group, _, t)| {
            let (lo, hi) = self.groups[*group].bounds;
            let middle = t.point(0.5 * (lo + hi));
            let half = 0.5 * (hi - lo);
            let reach = t.columns[0].abs() * half.x
                + t.columns[1].abs() * half.y
                + t.columns[2].abs() * half.z;
            (middle - reach, middle + reach)
        })
    }

    /// What the hierarchy is built of, relative to the scene's centre. Prototypes are moved to the origin of their space, so that their
    /// coordinates keep their digits.
    pub fn geometry(&self, centre: DVec3) -> Result<(Vec<Geometry>, Vec<Instance>)> {
        let mut geometries = Vec::with_capacity(self.groups.len());
        for group in &self.groups {
            let shapes = group
                .shapes
                .iter()
                .map(|w| w.clone().narrow(group.middle()))
                .collect();
            let geometry = Geometry { shapes };
            geometry
                .check()
                .map_err(|e| Error::Input(format!("the prototype '{}': {e}", group.name)))?;
            geometries.push(geometry);
        }
        let to_local = Affine::from_translation(-centre);
        let instances = self
            .instances
            .iter()
            .map(|(group, _, t)| {
                let middle = Affine::from_translation(self.groups[*group].middle());
                Instance {
                    prototype: *group as u32,
                    to_world: to_local.after(t).after(&middle),
                }
            })
            .collect();
        Ok((geometries, instances))
    }

    /// The prototypes by name, with their shapes as they are and as they are intersected.
    pub fn bodies(&self) -> impl Iterator<Item = (&str, &'s [describe::Shape], Vec<Shape>)> {
        self.groups.iter().map(|group| {
            let shapes = group.shapes.iter();
            let shapes = shapes.map(|w| w.clone().narrow(group.middle())).collect();
            (group.name, group.described, shapes)
        })
    }

    /// The surfaces of all instances: `surface` makes the one of a shape, given the material of the instance, and `light` turns an
    /// emitting one into a light.
    pub fn surfaces(
        &self,
        accel: &Accel,
        placed: &[Instance],
        mut surface: impl FnMut(&'s describe::Shape, Option<&'s str>) -> Result<Surface>,
        mut light: impl FnMut(&'s describe::Shape, &Shape, u32, Vec3, &Affine) -> Result<u32>,
    ) -> Result<Copies> {
        let mut copies = Copies::default();
        let mut known: HashMap<(usize, Option<&str>), u32> = HashMap::new();
        for (number, (index, instance, _)) in self.instances.iter().enumerate() {
            let group = &self.groups[*index];
            let material = instance.material.as_deref();
            if let Some(first) = known.get(&(*index, material)) {
                copies.share(*first);
                continue;
            }
            let mut surfaces = group
                .described
                .iter()
                .map(|s| surface(s, material))
                .collect::<Result<Vec<_>>>()?;
            if !group.emits {
                known.insert((*index, material), copies.add(surfaces));
                continue;
            }
            // Every copy is a light of its own.
            let to_world = rounded(&placed[number].to_world);
            let shapes = group.shapes.iter().zip(group.described);
            for ((k, (shape, described)), surface) in shapes.enumerate().zip(&mut surfaces) {
                if !emits(described) {
                    continue;
                }
                let own = shape.clone().narrow(group.middle());
                let Some(shape) = transformed(&own, &to_world) else {
                    return Err(Error::Input(format!(
                        "instance {number}, of the prototype '{}', stretches an emitting shape that is round: only meshes and rectangles can emit where a transform stretches",
                        group.name
                    )));
                };
                let reach = 0.5 * (group.bounds.1 - group.bounds.0);
                let size = to_world.columns[0].abs() * reach.x
                    + to_world.columns[1].abs() * reach.y
                    + to_world.columns[2].abs() * reach.z;
                let at = accel.first_shape(number as u32) + k as u32;
                surface.light = Some(light(described, &shape, at, size.as_vec3(), &to_world)?);
                surface.null = false;
            }
            copies.add(surfaces);
        }
        Ok(copies)
    }
}

impl<'s> Group<'s> {
    fn read(scene: &'s describe::Scene, name: &'s str) -> Result<Self> {
        let described = scene
            .prototypes
            .get(name)
            .ok_or_else(|| Error::Input(format!("there is no prototype '{name}' in the scene")))?;
        let shapes = described
            .iter()
            .map(|s| Wide::read(scene, &s.geometry))
            .collect::<Result<Vec<_>>>()?;
        let bounds = shapes
            .iter()
            .filter_map(Wide::bounds)
            .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
            .unwrap_or_default();
        Ok(Self {
            name,
            described,
            shapes,
            bounds,
            emits: described.iter().any(emits),
        })
    }

    fn middle(&self) -> DVec3 {
        let middle = 0.5 * (self.bounds.0 + self.bounds.1);
        if middle.is_finite() {
            middle
        } else {
            DVec3::ZERO
        }
    }
}

/// True if a shape is a light.
pub(super) fn emits(shape: &describe::Shape) -> bool {
    shape.emission.is_some_and(|e| e.iter().any(|v| *v > 0.0))
}

/// The transform as the geometry keeps it.
fn rounded(t: &Affine) -> Affine {
    Affine {
        columns: t.columns.map(|c| c.as_vec3().as_dvec3()),
        translation: t.translation.as_vec3().as_dvec3(),
    }
}

/// The factor of a transform that stretches all directions by the same; `None` for others.
fn similarity(t: &Affine) -> Option<f64> {
    let [a, b, c] = t.columns;
    let scale = a.length();
    let same = |v: DVec3| (v.length() - scale).abs() < 1e-6 * scale;
    let square = |v: DVec3, w: DVec3| v.dot(w).abs() < 1e-6 * scale * scale;
    (same(b) && same(c) && square(a, b) && square(b, c) && square(c, a)).then_some(scale)
}

/// A shape moved by a transform, its outer side still outside. `None` for a round shape that would not stay what it is.
fn transformed(shape: &Shape, t: &Affine) -> Option<Shape> {
    let mirrors = t.determinant() < 0.0;
    let point = |p: Vec3| t.point(p.as_dvec3()).as_vec3();
    let vector = |v: Vec3| t.vector(v.as_dvec3()).as_vec3();
    Some(match shape {
        Shape::Mesh(m) => {
            let mut m = m.clone();
            m.positions.iter_mut().for_each(|p| *p = point(*p));
            if mirrors {
                m.indices.iter_mut().for_each(|i| i.swap(1, 2));
            }
            Shape::Mesh(m)
        }
        Shape::Quad(q) => {
            let (mut edge_u, mut edge_v) = (vector(q.edge_u), vector(q.edge_v));
            if mirrors {
                std::mem::swap(&mut edge_u, &mut edge_v);
            }
            Shape::Quad(Quad {
                corner: point(q.corner),
                edge_u,
                edge_v,
            })
        }
        Shape::Sphere(s) => Shape::Sphere(Sphere {
            center: point(s.center),
            radius: s.radius * similarity(t)? as f32,
        }),
        Shape::Disk(d) => {
            let scale = similarity(t)?;
            Shape::Disk(Disk {
                center: point(d.center),
                normal: (t.vector(d.normal.as_dvec3()) / scale)
                    .normalize()
                    .as_vec3(),
                radius: d.radius * scale as f32,
            })
        }
        Shape::Cylinder(c) => Shape::Cylinder(Cylinder {
            base: point(c.base),
            axis: vector(c.axis),
            radius: c.radius * similarity(t)? as f32,
        }),
    })
}
