//! A model: its nodes walked, its meshes placed, its cameras and lights found.

use gltf::json;
use gltf::json::validation::Checked;
use resolvent_scene::{
    Camera, Geometry, IndexMap, Light, Material, Medium, Pose, Projection, Shape, Texture,
    Transform,
};
use serde_json::Value;
use std::path::Path;

use crate::accessor::{Accessors, allowance};
use crate::buffers::Buffers;
use crate::container;
use crate::error::{Error, Fallible};
use crate::material::Materials;
use crate::mesh::Meshes;
use crate::spot::spot;
use crate::values::{element, extension, number, numbers, short};

/// Vertices of meshes at several places that are looked at one by one.
const MOST_POINTS: usize = 1 << 24;
/// The largest model file that is read, bytes.
pub(crate) const MAX_FILE: u64 = 4 << 30;

/// A glTF model as parts of a scene. Lengths are metres, y is up.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Images of materials, by name; their files are named from the model's folder.
    pub textures: IndexMap<String, Texture>,
    /// Materials, by name.
    pub materials: IndexMap<String, Material>,
    /// Media inside of transmitting materials, by name.
    pub media: IndexMap<String, Medium>,
    /// The meshes that nodes show, each in its own space.
    pub meshes: Vec<ModelMesh>,
    /// Cameras, in the order of nodes.
    pub cameras: Vec<ModelCamera>,
    /// Punctual lights, in the order of nodes.
    pub lights: Vec<Light>,
    /// What is in the model and is not shown as it is meant, each with its reason.
    pub warnings: Vec<String>,
    /// Most triangles that copies of its meshes may have in a scene.
    pub(crate) allowance: usize,
}

/// A mesh and its places.
#[derive(Debug, Clone)]
pub struct ModelMesh {
    /// Its name, or its number.
    pub name: String,
    /// One shape for each of its primitives, in the mesh's space.
    pub shapes: Vec<Shape>,
    /// Where nodes put it: mesh to model.
    pub places: Vec<Transform>,
}

impl ModelMesh {
    /// Triangles at one place.
    pub(crate) fn triangles(&self) -> usize {
        let of = |s: &Shape| match &s.geometry {
            Geometry::Mesh(m) => m.indices.len(),
            _ => 0,
        };
        self.shapes.iter().map(of).sum()
    }
}

/// A camera of the model.
#[derive(Debug, Clone)]
pub struct ModelCamera {
    /// Its name, or its number.
    pub name: String,
    /// The camera. Its horizontal field of view is for `aspect`, or for a square picture if there is none.
    pub camera: Camera,
    /// Width over height.
    pub aspect: Option<f64>,
}

impl Model {
    /// Reads a `.gltf` or `.glb` file and the buffers it names. Images are named, and read by whoever needs them.
    ///
    /// # Errors
    /// If it is damaged, or requires extensions that are not known.
    pub fn read(path: impl AsRef<Path>) -> Result<Model, Error> {
        let path = path.as_ref();
        let io = |source| Error::Io {
            file: path.to_path_buf(),
            source,
        };
        let file = std::fs::File::open(path).map_err(io)?;
        if !file.metadata().map_err(io)?.is_file() {
            return Err(Error::invalid(path, "is not a file"));
        }
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut std::io::Read::take(file, MAX_FILE), &mut bytes)
            .map_err(io)?;
        Model::parse(&bytes, path)
    }

    /// Reads a model from memory; `path` names it in errors, and its folder is where relative URIs start.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn parse(bytes: &[u8], path: impl AsRef<Path>) -> Result<Model, Error> {
        let path = path.as_ref();
        parse(bytes, path).map_err(|what| {
            if what.starts_with("requires the extension") {
                Error::Unsupported {
                    file: path.to_path_buf(),
                    what,
                }
            } else {
                Error::invalid(path, what)
            }
        })
    }

    /// Corners of the box around all shapes; `None` if there are none.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let mut out = None;
        self.for_each_point(|p| include(&mut out, p));
        out
    }

    /// Calls `f` with every vertex where it is in the model, once for each place of its mesh. Where that would be very many,
    /// with the corners of the box around the mesh instead: what comes has all vertices in its convex hull.
    pub fn for_each_point(&self, mut f: impl FnMut([f64; 3])) {
        let mut left = MOST_POINTS;
        for mesh in &self.meshes {
            let points = || {
                let meshes = mesh.shapes.iter().filter_map(|s| match &s.geometry {
                    Geometry::Mesh(m) => Some(m),
                    _ => None,
                });
                meshes.flat_map(|m| &m.positions)
            };
            let all = points().count().saturating_mul(mesh.places.len());
            let enough = mesh.places.len() == 1 || {
                let rest = left.checked_sub(all);
                left = rest.unwrap_or(left);
                rest.is_some()
            };
            let corners = if enough { None } else { around(points()) };
            for place in &mesh.places {
                match &corners {
                    Some(corners) => corners.iter().for_each(|p| f(place.point(*p))),
                    None => points().for_each(|p| f(place.point(*p))),
                }
            }
        }
    }

    /// Triangles, those of every place counted.
    pub fn triangles(&self) -> usize {
        let each = |m: &ModelMesh| m.places.len() * m.triangles();
        self.meshes.iter().map(each).sum()
    }

    /// True if some shape emits.
    pub fn glows(&self) -> bool {
        let mut shapes = self.meshes.iter().flat_map(|m| &m.shapes);
        shapes.any(|s| s.emission.is_some())
    }
}

fn include(out: &mut Option<[[f64; 3]; 2]>, p: [f64; 3]) {
    let b = out.get_or_insert([p, p]);
    for a in 0..3 {
        b[0][a] = b[0][a].min(p[a]);
        b[1][a] = b[1][a].max(p[a]);
    }
}

/// Corners of the box around points.
fn around<'p>(points: impl Iterator<Item = &'p [f64; 3]>) -> Option<[[f64; 3]; 8]> {
    let mut all = None;
    points.for_each(|p| include(&mut all, *p));
    let b = all?;
    Some(std::array::from_fn(|i| {
        [b[i & 1][0], b[i >> 1 & 1][1], b[i >> 2][2]]
    }))
}

fn parse(bytes: &[u8], path: &Path) -> Fallible<Model> {
    let container = container::parse(bytes)?;
    let root = &container.root;
    let folder = path.parent().unwrap_or(Path::new(""));
    let buffers = Buffers::read(&container, folder)?;
    let images = buffers.images();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut materials = Materials::new(&container.raw, format!("{name}: "), images);
    for extension in &container.unknown {
        materials.warn(extension, "the extension is not known and has no effect");
    }
    if !root.animations.is_empty() {
        materials.warn("animations", "the model is shown at rest");
    }
    let size = bytes.len().saturating_add(buffers.bytes);
    let accessors = Accessors::new(root, &buffers, size);
    let mut meshes = Meshes::new(root, accessors, size);
    let mut model = Model {
        allowance: allowance(size),
        ..Model::default()
    };
    let mut slots: Vec<Option<usize>> = vec![None; root.meshes.len()];
    for (index, to_world) in nodes(root)? {
        let node = &root.nodes[index];
        let raw = element(&container.raw, "nodes", index).unwrap_or(&Value::Null);
        if let Some(camera) = node.camera.and_then(|c| root.cameras.get(c.value())) {
            model
                .cameras
                .extend(view(camera, &to_world, &mut materials));
        }
        if let Some(light) = extension(raw, "KHR_lights_punctual") {
            let at = |what: String| format!("nodes[{index}]: {what}");
            let light = punctual(&container.raw, light, &to_world, &mut materials);
            model.lights.extend(light.map_err(at)?);
        }
        if let Some(skin) = node.skin.map(|s| s.value()) {
            let named = root.skins.get(skin).and_then(|s| s.name.as_deref());
            let what = match named {
                Some(name) => format!("skin '{}'", short(name)),
                None => format!("skins[{skin}]"),
            };
            materials.warn(&what, "the mesh is shown in its bind pose");
        }
        let Some(mesh) = node.mesh.map(|m| m.value()) else {
            continue;
        };
        if to_world.determinant() == 0.0 || to_world.0.iter().flatten().any(|x| !x.is_finite()) {
            materials.warn(
                &format!("nodes[{index}]"),
                "its transform makes the mesh flat; it is left out",
            );
            continue;
        }
        let slot = *slots.get(mesh).ok_or("a node's mesh does not exist")?;
        let slot = match slot {
            Some(slot) => slot,
            None => {
                let named = root.meshes[mesh].name.as_deref().map(short);
                model.meshes.push(ModelMesh {
                    name: named.unwrap_or_else(|| format!("mesh {mesh}")),
                    shapes: meshes.shapes(mesh, &mut materials)?,
                    places: Vec::new(),
                });
                slots[mesh] = Some(model.meshes.len() - 1);
                model.meshes.len() - 1
            }
        };
        model.meshes[slot].places.push(to_world);
    }
    model.meshes.retain(|m| !m.shapes.is_empty());
    model.textures = materials.textures;
    model.materials = materials.materials;
    model.media = materials.media;
    model.warnings = materials.warnings;
    Ok(model)
}

/// The nodes of the scene to show with their transforms to the world, parents first.
fn nodes(root: &json::Root) -> Fallible<Vec<(usize, Transform)>> {
    let scene = root.scene.map_or(0, |s| s.value());
    let mut stack: Vec<(usize, Transform)> = match root.scenes.get(scene) {
        Some(scene) => {
            let roots = scene.nodes.iter().rev();
            roots.map(|n| (n.value(), Transform::IDENTITY)).collect()
        }
        // Without scenes, the nodes that are nobody's children.
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            let children = root.nodes.iter().flat_map(|n| n.children.iter().flatten());
            for child in children {
                if let Some(slot) = is_child.get_mut(child.value()) {
                    *slot = true;
                }
            }
            let roots = (0..root.nodes.len()).rev().filter(|i| !is_child[*i]);
            roots.map(|i| (i, Transform::IDENTITY)).collect()
        }
    };
    let mut seen = vec![false; root.nodes.len()];
    let mut out = Vec::new();
    while let Some((index, parent)) = stack.pop() {
        let (Some(node), Some(seen)) = (root.nodes.get(index), seen.get_mut(index)) else {
            return Err(format!("nodes[{index}] does not exist"));
        };
        // Also what keeps a cycle from being walked forever.
        if std::mem::replace(seen, true) {
            return Err(format!(
                "nodes[{index}] has two parents or is its own ancestor"
            ));
        }
        let to_world = local(node).then(&parent);
        out.push((index, to_world));
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|c| (c.value(), to_world)));
    }
    Ok(out)
}

/// Node to parent: a matrix, or scale, rotation and translation in this order.
fn local(node: &json::Node) -> Transform {
    if let Some(m) = node.matrix {
        // Columns one after another.
        return Transform([0, 1, 2, 3].map(|r| [0, 1, 2, 3].map(|c| f64::from(m[4 * c + r]))));
    }
    let [x, y, z, w] = node
        .rotation
        .as_ref()
        .map_or([0.0, 0.0, 0.0, 1.0], |r| r.0.map(f64::from));
    let n = x * x + y * y + z * z + w * w;
    // A quaternion rounded to f32 is made a rotation again; one that is none at all turns nothing.
    let k = if n > 0.0 { 2.0 / n } else { 0.0 };
    let s = node.scale.map_or([1.0; 3], |s| s.map(f64::from));
    let t = node.translation.map_or([0.0; 3], |t| t.map(f64::from));
    let r = [
        [
            1.0 - k * (y * y + z * z),
            k * (x * y - z * w),
            k * (x * z + y * w),
        ],
        [
            k * (x * y + z * w),
            1.0 - k * (x * x + z * z),
            k * (y * z - x * w),
        ],
        [
            k * (x * z - y * w),
            k * (y * z + x * w),
            1.0 - k * (x * x + y * y),
        ],
    ];
    let row = |i: usize| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]];
    Transform([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}

/// The position and the axes of a node, without its scale.
fn pose(t: &Transform) -> Option<Transform> {
    let unit = |v: [f64; 3]| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        (length > 0.0 && length.is_finite()).then(|| v.map(|x| x / length))
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let z = unit(t.vector([0.0, 0.0, 1.0]))?;
    let x = unit(cross(t.vector([0.0, 1.0, 0.0]), z))?;
    let y = cross(z, x);
    let p = t.point([0.0; 3]);
    Some(Transform([
        [x[0], y[0], z[0], p[0]],
        [x[1], y[1], z[1], p[1]],
        [x[2], y[2], z[2], p[2]],
        [0.0, 0.0, 0.0, 1.0],
    ]))
}

fn view(
    camera: &json::Camera,
    to_world: &Transform,
    materials: &mut Materials,
) -> Option<ModelCamera> {
    let name = camera.name.as_deref().map_or("camera".into(), short);
    let (Checked::Valid(json::camera::Type::Perspective), Some(p)) =
        (&camera.type_, &camera.perspective)
    else {
        materials.warn(
            &format!("camera '{name}'"),
            "only perspective cameras are there; it is left out",
        );
        return None;
    };
    let aspect = p
        .aspect_ratio
        .map(f64::from)
        .filter(|a| *a > 0.0 && a.is_finite());
    let half = (0.5 * f64::from(p.yfov)).tan() * aspect.unwrap_or(1.0);
    let fov_x_deg = 2.0 * half.atan().to_degrees();
    let pose = pose(to_world).filter(|_| fov_x_deg > 0.0 && fov_x_deg < 180.0);
    let Some(pose) = pose else {
        materials.warn(
            &format!("camera '{name}'"),
            "has no direction or no field of view",
        );
        return None;
    };
    Some(ModelCamera {
        name,
        camera: Camera {
            pose: Pose::Transform(pose),
            projection: Projection::Perspective { fov_x_deg },
            lens_radius: 0.0,
            focus_distance: 1.0,
            shift: [0.0; 2],
            exposure: 0.0,
        },
        aspect,
    })
}

/// A punctual light. Photometric numbers are taken as radiometric ones: 1 cd as 1 W/sr, 1 lx as 1 W/m², for every channel. One
/// common factor on all light, emission included, is a matter of exposure.
fn punctual(
    raw: &Value,
    reference: &Value,
    to_world: &Transform,
    materials: &mut Materials,
) -> Fallible<Option<Light>> {
    let index = reference.get("light").and_then(Value::as_u64);
    let lights = extension(raw, "KHR_lights_punctual");
    let light = index
        .and_then(|i| usize::try_from(i).ok())
        .and_then(|i| element(lights?, "lights", i))
        .ok_or("its light does not exist")?;
    let intensity = number(light, "intensity", 1.0, [0.0, 1e30])?;
    let color = numbers(light, "color", [1.0; 3], [0.0, 1.0])?.map(|c| c * intensity);
    if light.get("range").is_some() {
        materials.warn(
            "range of lights",
            "light falls off with the square of the distance alone",
        );
    }
    let kind = light
        .get("type")
        .and_then(Value::as_str)
        .unwrap_or_default();
    let Some(pose) = pose(to_world) else {
        materials.warn("lights", "one whose node has no direction is left out");
        return Ok(None);
    };
    Ok(Some(match kind {
        "directional" => Light::Distant {
            // It shines along −z.
            to_light: pose.vector([0.0, 0.0, 1.0]),
            irradiance: color,
            angle_deg: 0.0,
        },
        "point" => Light::Point {
            position: pose.point([0.0; 3]),
            intensity: color,
        },
        "spot" => spot(light, &pose, color)?,
        other => return Err(format!("a light is of the unknown type {other:?}")),
    }))
}
