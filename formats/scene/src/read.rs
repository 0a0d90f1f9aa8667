//! From checked JSON to the description, and the checks that see more than one value.
//!
//! Runs after [`crate::check`]: whatever the tables can say has been checked, so a `None` here means only
//! that a key was left out.

use std::path::Path;

use indexmap::IndexMap;

use crate::check::{Checker, is_operations, transform};
use crate::describe::*;
use crate::error::{Error, Problem};
use crate::format::{Kind, SCENE, VERSION};
use crate::json::{Data, Document, Member, Node, quoted};
use crate::nearest::hint;
use crate::plugin::{Param, PluginBlock, Value};
use crate::texture::{self, MAPPINGS};
use crate::transform::{Transform, cross, length, parallel, sub};

impl Scene {
    /// Reads a scene file.
    pub fn read(file: impl AsRef<Path>) -> Result<Scene, Error> {
        let file = file.as_ref();
        let io = |source| Error::Io {
            file: file.to_path_buf(),
            source,
        };
        let mut bytes = Vec::new();
        // One byte more than is accepted, so that an endless file (a pipe, /dev/zero) ends, too.
        let open = std::fs::File::open(file).map_err(io)?;
        std::io::Read::read_to_end(
            &mut std::io::Read::take(open, crate::json::MAX_BYTES + 1),
            &mut bytes,
        )
        .map_err(io)?;
        Scene::parse(&bytes, file)
    }

    /// Reads a scene from memory. `file` names it in errors, and its folder is where relative paths start.
    pub fn parse(bytes: &[u8], file: impl AsRef<Path>) -> Result<Scene, Error> {
        let file = file.as_ref();
        let doc = Document::parse(bytes)
            .map_err(|e| Error::Syntax(Problem::new(file, e.place, e.what)))?;
        check_version(&doc, file)?;
        let mut checker = Checker::new(&doc, file);
        checker.check(&doc.root, &Kind::Object(&SCENE));
        checker.finish().map_err(Error::Invalid)?;

        let mut reader = Reader {
            checker: Checker::new(&doc, file),
            params: 0,
        };
        let scene = reader.scene(&doc.root, file);
        reader.checker.finish().map_err(Error::Invalid)?;
        scene.ok_or_else(|| {
            let place = doc.place(&doc.root);
            Error::Invalid(vec![Problem::new(file, place, "the scene is incomplete")])
        })
    }
}

/// A newer format may differ in anything, so its version is looked at before all else.
fn check_version(doc: &Document<'_>, file: &Path) -> Result<(), Error> {
    let Some(node) = doc.root.get("resolvent") else {
        return Ok(());
    };
    match doc.integer(node) {
        Some(found) if found > i128::from(VERSION) => Err(Error::Unsupported(Problem::new(
            file,
            doc.place(node),
            format!(
                "the scene has format version {found}, this program reads up to {VERSION}; update the program"
            ),
        ))),
        _ => Ok(()),
    }
}

/// Most parameters and nested plugins of one scene: each keeps its place, so they cost much more memory
/// than text.
const MAX_PARAMS: usize = 200_000;

pub(crate) struct Reader<'d> {
    pub(crate) checker: Checker<'d>,
    params: usize,
}

impl Reader<'_> {
    fn scene(&mut self, root: &Node, file: &Path) -> Option<Scene> {
        let scene = Scene {
            source: Source {
                file: file.to_path_buf(),
            },
            units: root
                .get("units")
                .and_then(|n| number(n, "meters_per_unit"))
                .map_or_else(Units::default, |m| Units { meters_per_unit: m }),
            camera: self.camera(root.get("camera")?)?,
            film: root
                .get("film")
                .map_or_else(|| Some(Film::default()), |n| self.film(n))?,
            sampling: root
                .get("sampling")
                .map_or_else(|| Some(Sampling::default()), |n| self.sampling(n))?,
            integrator: match root.get("integrator") {
                Some(n) => self.block(n)?,
                None => PluginBlock::new("pt"),
            },
            lights: list(root, "lights")
                .iter()
                .map(|n| self.light(n))
                .collect::<Option<_>>()?,
            textures: named(root, "textures", |n| self.texture(n))?,
            materials: named(root, "materials", |n| self.material(n))?,
            media: named(root, "media", |n| self.medium(n))?,
            shapes: self.shapes(list(root, "shapes"))?,
            prototypes: named(root, "prototypes", |n| {
                if items(n).is_empty() {
                    self.checker.report(n, "expected at least one shape");
                }
                self.shapes(items(n))
            })?,
            instances: list(root, "instances")
                .iter()
                .map(instance)
                .collect::<Option<_>>()?,
        };
        self.references(root, &scene);
        Some(scene)
    }

    /// Reports names of textures, materials, media and prototypes that nothing has.
    fn references(&mut self, root: &Node, scene: &Scene) {
        for (node, material) in members(root, "materials").zip(scene.materials.values()) {
            self.known_textures(node, material, &scene.textures);
        }
        let prototypes = match root.get("prototypes").map(|n| &n.data) {
            Some(Data::Object(members)) => members.as_slice(),
            _ => &[],
        };
        let nodes = prototypes.iter().flat_map(|m| items(&m.value));
        for (node, shape) in list(root, "shapes")
            .iter()
            .chain(nodes)
            .zip(scene.all_shapes())
        {
            let (material, interior) = (shape.material.as_deref(), shape.interior.as_deref());
            self.known(node.get("material"), material, "material", &scene.materials);
            self.known(node.get("interior"), interior, "medium", &scene.media);
            let texture = shape.emission_texture.as_deref();
            self.known(
                node.get("emission_texture"),
                texture,
                "texture",
                &scene.textures,
            );
        }
        for (node, instance) in list(root, "instances").iter().zip(&scene.instances) {
            let (prototype, material) = (&instance.prototype, instance.material.as_deref());
            self.known(
                node.get("prototype"),
                Some(prototype),
                "prototype",
                &scene.prototypes,
            );
            self.known(node.get("material"), material, "material", &scene.materials);
        }
    }

    /// Reports a name that nothing has.
    fn known<T>(
        &mut self,
        node: Option<&Node>,
        name: Option<&str>,
        what: &str,
        all: &IndexMap<String, T>,
    ) {
        if let (Some(node), Some(name)) = (node, name)
            && !all.contains_key(name)
            && !self.checker.is_full()
        {
            let hint = hint(name, all.keys().map(String::as_str));
            self.checker
                .report(node, format!("no {what} is named {}{hint}", quoted(name)));
        }
    }

    fn camera(&mut self, node: &Node) -> Option<Camera> {
        let lens_radius = number(node, "lens_radius").unwrap_or(0.0);
        let mut focus_distance = number(node, "focus_distance");
        let pose = match node.get("transform") {
            Some(t) => Pose::Transform(transform(t).ok()?),
            None => {
                let (origin, target) = (vec3(node, "origin")?, vec3(node, "target")?);
                let up = vec3(node, "up").unwrap_or([0.0, 1.0, 0.0]);
                let axis = sub(target, origin);
                if length(axis) == 0.0 {
                    self.checker.report(
                        node.get("target")?,
                        "expected a target unequal to the origin",
                    );
                } else if parallel(axis, up) {
                    let at = node.get("up").unwrap_or(node);
                    self.checker.report(
                        at,
                        format!(
                            "expected \"up\" not to be parallel to the viewing axis, found {up:?}"
                        ),
                    );
                }
                focus_distance = focus_distance.or(Some(length(axis)));
                Pose::LookAt { origin, target, up }
            }
        };
        if lens_radius > 0.0 && focus_distance.is_none() {
            self.checker.report(
                node,
                "perspective with a lens_radius and a transform needs the key \"focus_distance\"",
            );
        }
        let focus_distance = focus_distance.unwrap_or(1.0);
        Some(Camera {
            pose,
            projection: match text(node, "type")? {
                "orthographic" => Projection::Orthographic {
                    width: number(node, "width")?,
                },
                _ => Projection::Perspective {
                    fov_x_deg: number(node, "fov_x_deg")?,
                },
            },
            lens_radius,
            focus_distance,
            shift: node.get("shift").and_then(floats).unwrap_or_default(),
            exposure: number(node, "exposure").unwrap_or(0.0),
        })
    }

    fn film(&mut self, node: &Node) -> Option<Film> {
        let resolution: [u32; 2] = match node.get("resolution") {
            Some(n) => self.integers(n)?,
            None => Film::default().resolution,
        };
        let crop: Option<[u32; 4]> = node.get("crop").and_then(|n| self.integers(n));
        if let Some([x0, y0, x1, y1]) = crop
            && (x0 >= x1 || y0 >= y1 || x1 > resolution[0] || y1 > resolution[1])
        {
            let what = format!(
                "expected x0 < x1 ≤ {} and y0 < y1 ≤ {}, found [{x0}, {y0}, {x1}, {y1}]",
                resolution[0], resolution[1]
            );
            self.checker.report(node.get("crop")?, what);
        }
        let filter = node.get("filter").map_or_else(
            || Some(Filter::default()),
            |n| {
                let radius = number(n, "radius");
                match text(n, "type")? {
                    "box" => Some(Filter::Box {
                        radius: radius.unwrap_or(0.5),
                    }),
                    "tent" => Some(Filter::Tent {
                        radius: radius.unwrap_or(1.0),
                    }),
                    "gaussian" => Some(Filter::Gaussian {
                        radius: radius.unwrap_or(1.5),
                        sigma: number(n, "sigma").unwrap_or(0.5),
                    }),
                    _ => None,
                }
            },
        )?;
        let aovs = list(node, "aovs")
            .iter()
            .filter_map(|n| match &n.data {
                Data::Text(t) => Aov::parse(t),
                _ => None,
            })
            .collect();
        Some(Film {
            resolution,
            pixel_aspect: number(node, "pixel_aspect").unwrap_or(1.0),
            crop,
            filter,
            aovs,
        })
    }

    fn sampling(&mut self, node: &Node) -> Option<Sampling> {
        let mut sampling = Sampling::default();
        if let Some(spp) = node.get("spp") {
            sampling.budget = Budget::Spp(self.unsigned(spp)?);
        } else if let Some(seconds) = number(node, "time") {
            sampling.budget = Budget::Time(seconds);
        } else if let Some(error) = number(node, "error") {
            sampling.budget = Budget::Error(error);
        }
        if let Some(seed) = node.get("seed") {
            sampling.seed = self.unsigned(seed)?;
        }
        Some(sampling)
    }

    fn light(&mut self, node: &Node) -> Option<Light> {
        Some(match text(node, "type")? {
            "environment" => Light::Environment(match text(node, "image") {
                None => Environment::Constant {
                    radiance: spectrum(node, "radiance")?,
                },
                Some(image) => {
                    let rotation = self.rotation(node, true)?;
                    let scale = spectrum(node, "scale").unwrap_or([1.0; 3]);
                    Environment::Image {
                        file: image.into(),
                        mapping: text(node, "mapping")
                            .and_then(|w| texture::named(&MAPPINGS, w))
                            .unwrap_or_default(),
                        scale,
                        rotation,
                    }
                }
            }),
            "distant" => {
                let to_light = self.direction(node, "to_light")?;
                let angle_deg = number(node, "angle_deg").unwrap_or(0.0);
                Light::Distant {
                    to_light,
                    irradiance: spectrum(node, "irradiance")?,
                    angle_deg,
                }
            }
            "point" => Light::Point {
                position: vec3(node, "position")?,
                intensity: spectrum(node, "intensity")?,
            },
            "sun_sky" => Light::SunSky {
                to_sun: self.sun_direction(node)?,
                turbidity: number(node, "turbidity").unwrap_or(3.0),
                ground_albedo: spectrum(node, "ground_albedo").unwrap_or([0.2; 3]),
                scale: spectrum(node, "scale").unwrap_or([1.0; 3]),
                sun: flag(node, "sun").unwrap_or(true),
                sun_angle_deg: number(node, "sun_angle_deg").unwrap_or(0.533),
                rotation: self.rotation(node, false)?,
            },
            "spot" => {
                let angle_deg = number(node, "angle_deg")?;
                let inner_angle_deg = number(node, "inner_angle_deg").unwrap_or(angle_deg);
                if inner_angle_deg > angle_deg {
                    self.checker.report(
                        node.get("inner_angle_deg")?,
                        format!(
                            "expected at most angle_deg ({angle_deg}), found {inner_angle_deg}"
                        ),
                    );
                }
                Light::Spot {
                    position: vec3(node, "position")?,
                    direction: self.direction(node, "direction")?,
                    intensity: spectrum(node, "intensity")?,
                    angle_deg,
                    inner_angle_deg,
                }
            }
            "rectangle" => {
                let [corner, edge_u, edge_v] = self.rectangle(node)?;
                Light::Rectangle {
                    corner,
                    edge_u,
                    edge_v,
                    radiance: spectrum(node, "radiance")?,
                    two_sided: flag(node, "two_sided").unwrap_or(false),
                }
            }
            _ => return None,
        })
    }

    fn rectangle(&mut self, node: &Node) -> Option<[Vec3; 3]> {
        let (edge_u, edge_v) = (vec3(node, "edge_u")?, vec3(node, "edge_v")?);
        if length(cross(edge_u, edge_v)) == 0.0 || parallel(edge_u, edge_v) {
            let what =
                format!("expected two edges that span an area, found {edge_u:?} and {edge_v:?}");
            self.checker.report(node, what);
        }
        Some([vec3(node, "corner")?, edge_u, edge_v])
    }

    /// A direction towards the sun, from either way to give it.
    fn sun_direction(&mut self, node: &Node) -> Option<Vec3> {
        if let Some(elevation) = number(node, "elevation_deg") {
            let azimuth = number(node, "azimuth_deg").unwrap_or(0.0).to_radians();
            let (sin, cos) = elevation.to_radians().sin_cos();
            return Some([cos * azimuth.sin(), sin, cos * azimuth.cos()]);
        }
        let to_sun = self.direction(node, "to_sun")?;
        if to_sun[1] < 0.0 {
            let what = format!("expected a sun above the horizon (y ≥ 0), found {to_sun:?}");
            self.checker.report(node.get("to_sun")?, what);
        }
        Some(to_sun)
    }

    /// A transform that must be a rotation, or may mirror besides.
    fn rotation(&mut self, node: &Node, mirrors: bool) -> Option<Transform> {
        let rotation = to_world(node)?;
        let fault = rotation.rotation_fault(mirrors);
        if let (Some(at), Some(fault)) = (node.get("transform"), fault) {
            self.checker
                .report(at, format!("expected a rotation, found {fault}"));
        }
        Some(rotation)
    }

    /// A vector that must not be zero.
    fn direction(&mut self, node: &Node, key: &str) -> Option<Vec3> {
        let v = vec3(node, key)?;
        if length(v) == 0.0 {
            self.checker.report(
                node.get(key)?,
                "expected a direction that is not zero, found [0, 0, 0]",
            );
        }
        Some(v)
    }

    fn medium(&mut self, node: &Node) -> Option<Medium> {
        Some(Medium {
            block: self.block(node)?,
            transform: to_world(node)?,
        })
    }

    fn shapes(&mut self, nodes: &[Node]) -> Option<Vec<Shape>> {
        nodes.iter().map(|n| self.shape(n)).collect()
    }

    fn shape(&mut self, node: &Node) -> Option<Shape> {
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

    fn shaping(&mut self, node: &Node) -> Option<Shaping> {
        Some(Shaping {
            axis: self.direction(node, "axis")?,
            angle_deg: number(node, "angle_deg").unwrap_or(360.0),
            softness: number(node, "softness").unwrap_or(0.0),
            focus: number(node, "focus").unwrap_or(0.0),
            focus_tint: spectrum(node, "focus_tint").unwrap_or_default(),
        })
    }

    fn mesh(&mut self, node: &Node) -> Option<Mesh> {
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

    fn param(&mut self, member: &Member) -> Option<(String, Param)> {
        self.count(&member.value)?;
        let place = self.checker.doc.place(&member.value);
        Some((
            member.key.to_string(),
            Param {
                value: self.value(&member.value)?,
                place,
            },
        ))
    }

    /// Counts what keeps a place; nothing once there are too many.
    fn count(&mut self, node: &Node) -> Option<()> {
        self.params += 1;
        if self.params == MAX_PARAMS {
            let what = format!("more than {MAX_PARAMS} plugin parameters in one scene");
            self.checker.report(node, what);
        }
        (self.params < MAX_PARAMS).then_some(())
    }

    fn value(&mut self, node: &Node) -> Option<Value> {
        Some(match &node.data {
            Data::Null => return None,
            Data::Bool(b) => Value::Bool(*b),
            Data::Number(x) => Value::Number(*x),
            Data::Text(t) => Value::Text(t.to_string()),
            Data::List(items) if is_operations(items) => Value::from(transform(node).ok()?),
            Data::List(items) => {
                Value::List(items.iter().map(|n| self.value(n)).collect::<Option<_>>()?)
            }
            Data::Object(_) => {
                self.count(node)?;
                match text(node, "texture") {
                    Some(name) => Value::Texture(name.into()),
                    None => Value::Object(self.block(node)?),
                }
            }
        })
    }

    fn unsigned(&self, node: &Node) -> Option<u64> {
        self.checker.doc.integer(node)?.try_into().ok()
    }

    fn integers<const N: usize>(&self, node: &Node) -> Option<[u32; N]> {
        let Data::List(items) = &node.data else {
            return None;
        };
        let all: Option<Vec<u32>> = items
            .iter()
            .map(|n| self.unsigned(n)?.try_into().ok())
            .collect();
        all?.try_into().ok()
    }
}

fn named<T>(
    node: &Node,
    key: &str,
    mut read: impl FnMut(&Node) -> Option<T>,
) -> Option<IndexMap<String, T>> {
    match node.get(key).map(|n| &n.data) {
        Some(Data::Object(members)) => members
            .iter()
            .map(|m| Some((m.key.to_string(), read(&m.value)?)))
            .collect(),
        _ => Some(IndexMap::new()),
    }
}

fn instance(node: &Node) -> Option<Instance> {
    Some(Instance {
        prototype: text(node, "prototype")?.into(),
        transform: to_world(node)?,
        transforms: text(node, "transforms").map(String::from),
        material: text(node, "material").map(String::from),
    })
}

/// The values of an object with names as keys.
fn members<'n>(node: &'n Node, key: &str) -> impl Iterator<Item = &'n Node> {
    let members = match node.get(key).map(|n| &n.data) {
        Some(Data::Object(members)) => &members[..],
        _ => &[],
    };
    members.iter().map(|m| &m.value)
}

fn list<'n>(node: &'n Node, key: &str) -> &'n [Node] {
    node.get(key).map_or(&[], items)
}

fn items(node: &Node) -> &[Node] {
    match &node.data {
        Data::List(items) => items,
        _ => &[],
    }
}

pub(crate) fn number(node: &Node, key: &str) -> Option<f64> {
    match node.get(key)?.data {
        Data::Number(x) => Some(x),
        _ => None,
    }
}

pub(crate) fn flag(node: &Node, key: &str) -> Option<bool> {
    match node.get(key)?.data {
        Data::Bool(b) => Some(b),
        _ => None,
    }
}

pub(crate) fn text<'n>(node: &'n Node, key: &str) -> Option<&'n str> {
    match &node.get(key)?.data {
        Data::Text(t) => Some(t),
        _ => None,
    }
}

pub(crate) fn floats<const N: usize>(node: &Node) -> Option<[f64; N]> {
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

fn vec3(node: &Node, key: &str) -> Option<Vec3> {
    floats(node.get(key)?)
}

pub(crate) fn spectrum(node: &Node, key: &str) -> Option<Vec3> {
    number(node, key)
        .map(|x| [x; 3])
        .or_else(|| vec3(node, key))
}

/// The transform of a shape, medium or environment; the identity if there is none.
fn to_world(node: &Node) -> Option<Transform> {
    node.get("transform")
        .map_or(Some(Transform::IDENTITY), |n| transform(n).ok())
}
