//! What can be traced, and the checks it passes before the builder sees it.

use glam::{Vec2, Vec3};

use super::bvh8::MAX_ITEMS;
use super::ray::MAX_COORDINATE;

/// A triangle mesh with shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions, scene units.
    pub positions: Vec<Vec3>,
    /// Shading normals, one a vertex, of any length; empty if the mesh has none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex; empty if the mesh has none.
    pub uvs: Vec<Vec2>,
    /// Linear colours and opacities, one a vertex; empty if the mesh has none.
    pub colors: Vec<[f32; 4]>,
    /// Directions of growing u, one a vertex, of any length, whose fourth number is negative where v grows on the other side than
    /// usual; empty if they are to be taken from the texture coordinates.
    pub tangents: Vec<[f32; 4]>,
    /// Triangles. The front (towards which the geometric normal points) is where their vertices run counter-clockwise.
    pub indices: Vec<[u32; 3]>,
}

/// A sphere; its geometric normal points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, scene units.
    pub center: Vec3,
    /// Radius, scene units, greater than 0.
    pub radius: f32,
}

/// A flat disk; its geometric normal is `normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// Centre, scene units.
    pub center: Vec3,
    /// Normal, of length 1 within rounding.
    pub normal: Vec3,
    /// Radius, scene units, greater than 0.
    pub radius: f32,
}

/// The lateral surface of a cylinder, without caps; its geometric normal points away from the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Middle of one end, scene units.
    pub base: Vec3,
    /// From there to the middle of the other end, not zero.
    pub axis: Vec3,
    /// Radius, scene units, greater than 0.
    pub radius: f32,
}

/// A parallelogram corner + s·edge_u + t·edge_v with s, t in \[0, 1\]; its geometric normal is along edge_u × edge_v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// The corner at s = t = 0, scene units.
    pub corner: Vec3,
    /// Edge along which s grows.
    pub edge_u: Vec3,
    /// Edge along which t grows.
    pub edge_v: Vec3,
}

impl Quad {
    /// The two triangles that are traced: they share the diagonal from (0, 0) to (1, 1).
    pub(super) fn triangle(&self, half: u32) -> [Vec3; 3] {
        let opposite = self.corner + self.edge_u + self.edge_v;
        if half == 0 {
            [self.corner, self.corner + self.edge_u, opposite]
        } else {
            [self.corner, opposite, self.corner + self.edge_v]
        }
    }
}

/// Something rays can hit.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Indexed triangles.
    Mesh(TriangleMesh),
    /// An analytic sphere.
    Sphere(Sphere),
    /// A parallelogram.
    Quad(Quad),
    /// A flat disk.
    Disk(Disk),
    /// A cylinder without caps.
    Cylinder(Cylinder),
}

impl Shape {
    /// Number of primitives: triangles of a mesh, two halves of a quad, one of other shapes.
    pub fn primitives(&self) -> usize {
        match self {
            Self::Mesh(m) => m.indices.len(),
            Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_) => 1,
            Self::Quad(_) => 2,
        }
    }

    /// Vertices of primitive `prim`; `None` for shapes without triangles.
    pub(super) fn triangle(&self, prim: u32) -> Option<[Vec3; 3]> {
        match self {
            Self::Mesh(m) => Some(m.indices[prim as usize].map(|i| m.positions[i as usize])),
            Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_) => None,
            Self::Quad(q) => Some(q.triangle(prim)),
        }
    }
}

/// All shapes of a scene. A shape's index here is what hits and errors name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// The shapes.
    pub shapes: Vec<Shape>,
}

/// Why shapes cannot be traced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// A mesh vertex is NaN, infinite or beyond [`MAX_COORDINATE`].
    #[error(
        "shape {shape}: vertex {vertex} is {value}; coordinates must be finite and within ±1e18"
    )]
    Vertex {
        /// Index of the shape.
        shape: usize,
        /// Index of the vertex.
        vertex: usize,
        /// The position found.
        value: Vec3,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "shape {shape}: triangle {triangle} refers to vertex {index}, but there are {vertices} vertices"
    )]
    Index {
        /// Index of the shape.
        shape: usize,
        /// Index of the triangle.
        triangle: usize,
        /// The index found.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A per-vertex attribute has another length than the positions.
    #[error("shape {shape}: {found} {attribute} for {vertices} vertices")]
    AttributeCount {
        /// Index of the shape.
        shape: usize,
        /// "normals" or "uvs".
        attribute: &'static str,
        /// Number found.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A per-vertex attribute is NaN or infinite.
    #[error("shape {shape}: the {attribute} of vertex {vertex} are not finite")]
    Attribute {
        /// Index of the shape.
        shape: usize,
        /// "normals" or "uvs".
        attribute: &'static str,
        /// Index of the vertex.
        vertex: usize,
    },
    /// A sphere has a bad centre, or a radius that is not positive and finite, or both together exceed the coordinate range.
    #[error(
        "shape {shape}: sphere with centre {center} and radius {radius}; both must be finite and within ±1e18, the radius positive"
    )]
    Sphere {
        /// Index of the shape.
        shape: usize,
        /// Centre found.
        center: Vec3,
        /// Radius found.
        radius: f32,
    },
    /// A disk has a bad centre, a radius that is not positive and finite, both together exceed the coordinate range, or its
    /// normal is not of length 1.
    #[error(
        "shape {shape}: disk with centre {center}, normal {normal} and radius {radius}; all must be finite and within ±1e18, the radius positive, the normal of length 1"
    )]
    Disk {
        /// Index of the shape.
        shape: usize,
        /// Centre found.
        center: Vec3,
        /// Normal found.
        normal: Vec3,
        /// Radius found.
        radius: f32,
    },
    /// A cylinder has a bad end, an axis without length, a radius that is not positive and finite, or all together exceed the
    /// coordinate range.
    #[error(
        "shape {shape}: cylinder from {base} along {axis} with radius {radius}; all must be finite and within ±1e18, radius and length positive"
    )]
    Cylinder {
        /// Index of the shape.
        shape: usize,
        /// End found.
        base: Vec3,
        /// Axis found.
        axis: Vec3,
        /// Radius found.
        radius: f32,
    },
    /// A quad has a corner that is not finite or beyond [`MAX_COORDINATE`].
    #[error(
        "shape {shape}: corner {corner} of the quad is {value}; coordinates must be finite and within ±1e18"
    )]
    Quad {
        /// Index of the shape.
        shape: usize,
        /// Corner 0 to 3, counter-clockwise.
        corner: usize,
        /// The position found.
        value: Vec3,
    },
    /// An instance's transform cannot be inverted in single precision, scales beyond 1e18 or below 1e-18, or moves its prototype out
    /// of the coordinate range.
    #[error(
        "instance {instance}: its transform cannot be inverted in single precision, or moves it out of the range ±1e18"
    )]
    Instance {
        /// Index of the instance.
        instance: usize,
    },
    /// An instance of a prototype that does not exist.
    #[error("instance {instance}: there is no prototype {prototype}")]
    NoPrototype {
        /// Index of the instance.
        instance: usize,
        /// The prototype named.
        prototype: u32,
    },
    /// More instances than shapes can be numbered in.
    #[error("{0} instances of so many shapes; shapes of instances are numbered in 32 bits")]
    TooManyInstances(usize),
    /// More primitives than the hierarchy can address.
    #[error("{0} primitives; at most {MAX_ITEMS} can be traced")]
    TooMany(usize),
}

fn in_range(p: Vec3) -> bool {
    // False for NaN.
    p.abs().max_element() <= MAX_COORDINATE && p.is_finite()
}

/// True if everything within `radius` of `p` is in range.
fn ball_in_range(p: Vec3, radius: f32) -> bool {
    let reach = Vec3::splat(radius);
    in_range(p) && in_range(p - reach) && in_range(p + reach)
}

impl Geometry {
    /// Number of primitives of all shapes.
    pub fn primitives(&self) -> usize {
        self.shapes.iter().map(Shape::primitives).sum()
    }

    /// Number of the first primitive of each shape, and the total.
    pub(super) fn first_primitives(&self) -> Vec<u32> {
        let mut first = vec![0];
        let mut total = 0;
        for shape in &self.shapes {
            total += shape.primitives() as u32;
            first.push(total);
        }
        first
    }

    /// Checks everything a traversal or an interaction relies on. Degenerate triangles are not errors.
    pub fn check(&self) -> Result<(), GeometryError> {
        for (i, shape) in self.shapes.iter().enumerate() {
            match shape {
                Shape::Mesh(m) => check_mesh(i, m)?,
                Shape::Sphere(s) => {
                    if !(ball_in_range(s.center, s.radius) && s.radius > 0.0) {
                        return Err(GeometryError::Sphere {
                            shape: i,
                            center: s.center,
                            radius: s.radius,
                        });
                    }
                }
                Shape::Disk(d) => {
                    let unit = (d.normal.length_squared() - 1.0).abs() < 1e-4;
                    if !(ball_in_range(d.center, d.radius) && d.radius > 0.0 && unit) {
                        return Err(GeometryError::Disk {
                            shape: i,
                            center: d.center,
                            normal: d.normal,
                            radius: d.radius,
                        });
                    }
                }
                Shape::Cylinder(c) => {
                    let fits =
                        ball_in_range(c.base, c.radius) && ball_in_range(c.base + c.axis, c.radius);
                    if !(fits && c.radius > 0.0 && c.axis != Vec3::ZERO) {
                        return Err(GeometryError::Cylinder {
                            shape: i,
                            base: c.base,
                            axis: c.axis,
                            radius: c.radius,
                        });
                    }
                }
                Shape::Quad(q) => {
                    let ([a, b, c], [_, _, d]) = (q.triangle(0), q.triangle(1));
                    for (corner, value) in [a, b, c, d].into_iter().enumerate() {
                        if !in_range(value) {
                            return Err(GeometryError::Quad {
                                shape: i,
                                corner,
                                value,
                            });
                        }
                    }
                }
            }
        }
        let count = self.primitives();
        if count > MAX_ITEMS {
            Err(GeometryError::TooMany(count))
        } else {
            Ok(())
        }
    }
}

fn check_mesh(shape: usize, m: &TriangleMesh) -> Result<(), GeometryError> {
    let vertices = m.positions.len();
    if let Some(vertex) = m.positions.iter().position(|&p| !in_range(p)) {
        return Err(GeometryError::Vertex {
            shape,
            vertex,
            value: m.positions[vertex],
        });
    }
    for (attribute, found) in [
        ("normals", m.normals.len()),
        ("uvs", m.uvs.len()),
        ("colors", m.colors.len()),
        ("tangents", m.tangents.len()),
    ] {
        if found != 0 && found != vertices {
            return Err(GeometryError::AttributeCount {
                shape,
                attribute,
                found,
                vertices,
            });
        }
    }
    if let Some(vertex) = m.normals.iter().position(|n| !n.is_finite()) {
        return Err(GeometryError::Attribute {
            shape,
            attribute: "normals",
            vertex,
        });
    }
    for (attribute, values) in [("colors", &m.colors), ("tangents", &m.tangents)] {
        let finite = |v: &[f32; 4]| v.iter().all(|x| x.is_finite());
        if let Some(vertex) = values.iter().position(|v| !finite(v)) {
            return Err(GeometryError::Attribute {
                shape,
                attribute,
                vertex,
            });
        }
    }
    if let Some(vertex) = m.uvs.iter().position(|n| !n.is_finite()) {
        return Err(GeometryError::Attribute {
            shape,
            attribute: "uvs",
            vertex,
        });
    }
    for (triangle, t) in m.indices.iter().enumerate() {
        if let Some(&index) = t.iter().find(|&&i| i as usize >= vertices) {
            return Err(GeometryError::Index {
                shape,
                triangle,
                index,
                vertices,
            });
        }
    }
    Ok(())
}
