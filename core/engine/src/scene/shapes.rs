//! From described shapes to geometry, relative to the scene's centre.

use crate::error::{Error, Result};
use crate::geometry::{Cylinder, Disk, Quad, Shape, Sphere, TriangleMesh};
use glam::{DVec3, Vec2, Vec3};
use resolvent_api::Affine;
use resolvent_scene::{Geometry, Scene, Transform};

/// A scene transform as an affine one.
pub(super) fn affine(t: &Transform) -> Affine {
    let m = t.0;
    Affine::from_rows([m[0], m[1], m[2]])
}

/// A shape in world coordinates, or in those of its prototype, still in double precision.
#[derive(Clone)]
pub(super) enum Wide {
    Sphere(DVec3, f64),
    Quad([DVec3; 3]),
    /// Centre, unit normal, radius.
    Disk(DVec3, DVec3, f64),
    /// One end, axis, radius.
    Cylinder(DVec3, DVec3, f64),
    Mesh {
        positions: Vec<DVec3>,
        attributes: Attributes,
        indices: Vec<[u32; 3]>,
    },
}

/// What vertices of a mesh have besides their positions, each one a vertex or empty.
#[derive(Clone, Default)]
pub(super) struct Attributes {
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<[f32; 4]>,
    tangents: Vec<[f32; 4]>,
}

impl Wide {
    pub fn read(scene: &Scene, geometry: &Geometry) -> Result<Self> {
        Ok(match geometry {
            Geometry::Sphere { center, radius } => Self::Sphere(DVec3::from(*center), *radius),
            Geometry::Rectangle {
                corner,
                edge_u,
                edge_v,
            } => Self::Quad([*corner, *edge_u, *edge_v].map(DVec3::from)),
            Geometry::Disk {
                center,
                normal,
                radius,
            } => Self::Disk(
                DVec3::from(*center),
                // Scaled first: the squares of large components would be infinite.
                (DVec3::from(*normal) / DVec3::from(*normal).abs().max_element()).normalize(),
                *radius,
            ),
            Geometry::Cylinder { base, axis, radius } => {
                Self::Cylinder(DVec3::from(*base), DVec3::from(*axis), *radius)
            }
            Geometry::Mesh(m) => Self::mesh(
                &affine(&m.transform),
                m.positions.iter().map(|p| DVec3::from(*p)),
                m.normals.iter().map(|n| DVec3::from(*n)),
                Attributes {
                    uvs: m
                        .uvs
                        .iter()
                        .map(|uv| Vec2::new(uv[0] as f32, uv[1] as f32))
                        .collect(),
                    colors: m.colors.iter().map(|c| c.map(|v| v as f32)).collect(),
                    tangents: m.tangents.iter().map(|t| t.map(|v| v as f32)).collect(),
                    ..Attributes::default()
                },
                m.indices.clone(),
            ),
            // Building replaces models by their meshes before it comes to shapes.
            Geometry::Gltf { file, .. } => {
                return Err(Error::Input(format!("{file}: the model was not read")));
            }
            Geometry::Ply { file, transform } => {
                let m = resolvent_ply::read(scene.resolve(file))
                    .map_err(|e| Error::Input(e.to_string()))?;
                let wide = |v: &[f32; 3]| Vec3::from(*v).as_dvec3();
                Self::mesh(
                    &affine(transform),
                    m.positions.iter().map(wide),
                    m.normals.as_deref().unwrap_or_default().iter().map(wide),
                    Attributes {
                        uvs: m
                            .uvs
                            .as_deref()
                            .unwrap_or_default()
                            .iter()
                            .map(|uv| Vec2::from(*uv))
                            .collect(),
                        colors: m.colors.unwrap_or_default(),
                        ..Attributes::default()
                    },
                    m.indices,
                )
            }
        })
    }

    fn mesh(
        to_world: &Affine,
        positions: impl Iterator<Item = DVec3>,
        normals: impl Iterator<Item = DVec3>,
        attributes: Attributes,
        mut indices: Vec<[u32; 3]>,
    ) -> Self {
        // Normals go with the cofactor matrix; a mirroring transform flips the winding, so that the outside stays outside.
        let [a, b, c] = to_world.columns;
        let flip = if to_world.determinant() < 0.0 {
            -1.0
        } else {
            1.0
        };
        let cofactor = [b.cross(c), c.cross(a), a.cross(b)];
        let normals = normals
            .map(|n| flip * (cofactor[0] * n.x + cofactor[1] * n.y + cofactor[2] * n.z))
            .map(|n| n.normalize_or_zero().as_vec3())
            .collect();
        // Tangents go with the surface, and a mirror changes the side of growing v.
        let tangents = attributes.tangents.iter().map(|[x, y, z, w]| {
            let along = a * f64::from(*x) + b * f64::from(*y) + c * f64::from(*z);
            let [x, y, z] = along.normalize_or_zero().as_vec3().to_array();
            [x, y, z, flip as f32 * w]
        });
        if flip < 0.0 {
            for t in &mut indices {
                t.swap(1, 2);
            }
        }
        Self::Mesh {
            positions: positions.map(|p| to_world.point(p)).collect(),
            attributes: Attributes {
                normals,
                tangents: tangents.collect(),
                ..attributes
            },
            indices,
        }
    }

    /// Corners of a box around it.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let around = |points: &mut dyn Iterator<Item = DVec3>| {
            points
                .filter(|p| p.is_finite())
                .fold(None, |b: Option<(DVec3, DVec3)>, p| {
                    Some(b.map_or((p, p), |(lo, hi)| (lo.min(p), hi.max(p))))
                })
        };
        match self {
            Self::Sphere(c, r) => around(&mut [*c - *r, *c + *r].into_iter()),
            Self::Quad([o, u, v]) => around(&mut [*o, *o + *u, *o + *v, *o + *u + *v].into_iter()),
            // Boxes around the circles' spheres: for the scene's centre they need not be tight.
            Self::Disk(c, _, r) => around(&mut [*c - *r, *c + *r].into_iter()),
            Self::Cylinder(b, a, r) => {
                around(&mut [*b - *r, *b + *r, *b + *a - *r, *b + *a + *r].into_iter())
            }
            Self::Mesh { positions, .. } => around(&mut positions.iter().copied()),
        }
    }

    /// Rounded to `f32` relative to `centre`.
    pub fn narrow(self, centre: DVec3) -> Shape {
        match self {
            Self::Sphere(c, r) => Shape::Sphere(Sphere {
                center: (c - centre).as_vec3(),
                radius: r as f32,
            }),
            Self::Quad([o, u, v]) => Shape::Quad(Quad {
                corner: (o - centre).as_vec3(),
                edge_u: u.as_vec3(),
                edge_v: v.as_vec3(),
            }),
            Self::Disk(c, n, r) => Shape::Disk(Disk {
                center: (c - centre).as_vec3(),
                normal: n.as_vec3(),
                radius: r as f32,
            }),
            Self::Cylinder(b, a, r) => Shape::Cylinder(Cylinder {
                base: (b - centre).as_vec3(),
                axis: a.as_vec3(),
                radius: r as f32,
            }),
            Self::Mesh {
                positions,
                attributes,
                indices,
            } => Shape::Mesh(TriangleMesh {
                positions: positions
                    .into_iter()
                    .map(|p| (p - centre).as_vec3())
                    .collect(),
                normals: attributes.normals,
                uvs: attributes.uvs,
                colors: attributes.colors,
                tangents: attributes.tangents,
                indices,
            }),
        }
    }
}
