//! The scene as plain data: what the engine builds from.
//!
//! Lengths are in scene units, directions need not be normalised, radiometric values are linear RGB
//! in SI units (`[f64; 3]`). A single number in a file stands for three equal ones.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use indexmap::IndexMap;

use crate::plugin::PluginBlock;
use crate::texture::{NormalMap, Texture};
use crate::transform::Transform;

/// Three numbers: a point, a direction or an RGB spectrum.
pub type Vec3 = [f64; 3];

/// A whole scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The file it was read from; empty for a description built in memory. Equal in comparisons to
    /// any other, as [`crate::Place`] is.
    pub source: Source,
    /// Physical meaning of the lengths.
    pub units: Units,
    /// The camera.
    pub camera: Camera,
    /// Resolution and what is recorded.
    pub film: Film,
    /// How long to sample.
    pub sampling: Sampling,
    /// The integrator plugin.
    pub integrator: PluginBlock,
    /// All lights, except emitting shapes and media.
    pub lights: Vec<Light>,
    /// Images that parameters of materials are read from, by name. One that nothing uses is not read.
    pub textures: IndexMap<String, Texture>,
    /// Materials by name.
    pub materials: IndexMap<String, Material>,
    /// Media by name. A medium that no shape names as its interior stands free.
    pub media: IndexMap<String, Medium>,
    /// All surfaces that stand in the world once.
    pub shapes: Vec<Shape>,
    /// Groups of surfaces in a space of their own, by name: they appear in the world by [`Scene::instances`] alone.
    pub prototypes: IndexMap<String, Vec<Shape>>,
    /// Copies of prototypes.
    pub instances: Vec<Instance>,
}

/// The scene file: errors name it, and relative paths start from its folder.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// The path as it was given.
    pub file: PathBuf,
}

impl PartialEq for Source {
    fn eq(&self, _: &Source) -> bool {
        true
    }
}

impl Scene {
    /// The folder that relative paths start from: the scene file's, or the current one if the scene
    /// comes from no file (the empty path).
    pub fn base(&self) -> &Path {
        self.source.file.parent().unwrap_or(Path::new(""))
    }

    /// The path of a file that the scene names.
    pub fn resolve(&self, path: impl AsRef<Path>) -> PathBuf {
        self.base().join(path)
    }

    /// The shapes of the world, then those of the prototypes.
    pub fn all_shapes(&self) -> impl Iterator<Item = &Shape> {
        self.shapes.iter().chain(self.prototypes.values().flatten())
    }

    /// The media that fill space by their own bounds: those which are no shape's interior.
    pub fn free_standing(&self) -> impl Iterator<Item = (&str, &Medium)> {
        let interiors: HashSet<&str> = self
            .all_shapes()
            .filter_map(|s| s.interior.as_deref())
            .collect();
        self.media
            .iter()
            .map(|(name, medium)| (name.as_str(), medium))
            .filter(move |(name, _)| !interiors.contains(name))
    }
}

/// Physical meaning of the scene's lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Metres per scene unit, > 0.
    pub meters_per_unit: f64,
}

impl Default for Units {
    fn default() -> Units {
        Units {
            meters_per_unit: 1.0,
        }
    }
}

/// A camera; with a lens radius it is a thin lens.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Where it stands and looks.
    pub pose: Pose,
    /// What it sees from there.
    pub projection: Projection,
    /// Radius of the lens in scene units, ≥ 0; 0 is a pinhole. Of no effect for parallel rays.
    pub lens_radius: f64,
    /// Distance along the viewing axis to the plane in focus, > 0. Of no effect for a pinhole.
    pub focus_distance: f64,
    /// How far the picture's middle lies off the viewing axis, to the right and up, in widths and heights of the picture.
    pub shift: [f64; 2],
    /// Stops: the picture is multiplied by 2^exposure.
    pub exposure: f64,
}

/// How a camera maps the world to its picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// All rays pass through the lens.
    Perspective {
        /// Full horizontal field of view in degrees, in (0, 180), without the shift.
        fov_x_deg: f64,
    },
    /// All rays are parallel, and start on the plane through the camera's origin.
    Orthographic {
        /// Width of the picture in scene units, > 0.
        width: f64,
    },
}

/// Position and orientation of a camera.
#[derive(Debug, Clone, PartialEq)]
pub enum Pose {
    /// From a point towards another.
    LookAt {
        /// The centre of the lens.
        origin: Vec3,
        /// A point in the middle of the picture, unequal to `origin`.
        target: Vec3,
        /// A direction that is up in the picture, not parallel to the viewing axis.
        up: Vec3,
    },
    /// Camera to world. The camera looks along −z, y is up, x is right.
    Transform(Transform),
}

impl Camera {
    /// The camera-to-world transform: the camera looks along −z, y is up, x is right.
    pub fn to_world(&self) -> Transform {
        match &self.pose {
            Pose::Transform(t) => *t,
            Pose::LookAt { origin, target, up } => Transform::look_at(*origin, *target, *up),
        }
    }
}

/// Resolution and what is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Width and height in pixels, each at least 1.
    pub resolution: [u32; 2],
    /// Width of a pixel over its height, > 0.
    pub pixel_aspect: f64,
    /// The window that is rendered, `[x0, y0, x1, y1]` in pixels; x1 and y1 are outside of it.
    pub crop: Option<[u32; 4]>,
    /// Reconstruction filter.
    pub filter: Filter,
    /// Further layers to record.
    pub aovs: Vec<Aov>,
}

impl Default for Film {
    fn default() -> Film {
        Film {
            resolution: [1280, 720],
            pixel_aspect: 1.0,
            crop: None,
            filter: Filter::default(),
            aovs: Vec::new(),
        }
    }
}

impl Film {
    /// The window that is rendered: the crop, or everything.
    pub fn window(&self) -> [u32; 4] {
        self.crop
            .unwrap_or([0, 0, self.resolution[0], self.resolution[1]])
    }

    /// How many layers of light by scattering order there are: one for each order up to that of [`Aov::Orders`], and one for the
    /// rest; 0 if none are asked for.
    pub fn order_layers(&self) -> usize {
        let orders = self.aovs.iter().find_map(|a| match a {
            Aov::Orders(n) => Some(*n as usize),
            _ => None,
        });
        orders.map_or(0, |n| n + 2)
    }
}

/// Reconstruction filter. Radii are half widths in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// Constant within the radius. Radius 0.5 averages over each pixel.
    Box {
        /// Half width in pixels, > 0.
        radius: f64,
    },
    /// Falls linearly to 0 at the radius.
    Tent {
        /// Half width in pixels, > 0.
        radius: f64,
    },
    /// exp(−x²/(2σ²)) − exp(−r²/(2σ²)).
    Gaussian {
        /// Half width r in pixels, > 0.
        radius: f64,
        /// Standard deviation σ in pixels, > 0.
        sigma: f64,
    },
}

impl Default for Filter {
    fn default() -> Filter {
        Filter::Box { radius: 0.5 }
    }
}

/// A layer that is recorded beside the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Aov {
    /// Distance from the camera to the first collision or surface, along the ray.
    Depth,
    /// Albedo there.
    Albedo,
    /// Normal there.
    Normal,
    /// Variance of the pixel's mean.
    Variance,
    /// Half the width of the pixel's 95 % interval.
    Error95,
    /// Samples taken.
    Samples,
    /// Light by scattering order, as layers `order0` … `orderN` and `order_rest`, which sum to the picture: the N + 1 first terms
    /// of Σ (GK)^k G Le, and all others. Written `orders:N`.
    Orders(u32),
}

impl Aov {
    /// All that a name is enough for.
    pub const NAMED: [Aov; 6] = [
        Aov::Depth,
        Aov::Albedo,
        Aov::Normal,
        Aov::Variance,
        Aov::Error95,
        Aov::Samples,
    ];

    /// Highest order that can have a layer of its own.
    pub const MOST_ORDERS: u32 = 99;

    /// Reads what stands in scene files and on the command line: a name, or `orders:N`.
    pub fn parse(text: &str) -> Option<Aov> {
        if let Some(order) = text.strip_prefix("orders:") {
            let plain = !order.is_empty() && order.bytes().all(|b| b.is_ascii_digit());
            let n = order.parse().ok().filter(|_| plain)?;
            return (n <= Aov::MOST_ORDERS).then_some(Aov::Orders(n));
        }
        Aov::NAMED.into_iter().find(|a| a.name() == text)
    }

    /// The name in scene files, and of the layer in images; without the number of orders.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Depth => "depth",
            Aov::Albedo => "albedo",
            Aov::Normal => "normal",
            Aov::Variance => "variance",
            Aov::Error95 => "error_95",
            Aov::Samples => "samples",
            Aov::Orders(_) => "orders",
        }
    }
}

impl std::fmt::Display for Aov {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Aov::Orders(n) => write!(f, "orders:{n}"),
            _ => f.write_str(self.name()),
        }
    }
}

/// How long to sample, and with which random numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// When to stop.
    pub budget: Budget,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Sampling {
    fn default() -> Sampling {
        Sampling {
            budget: Budget::Spp(64),
            seed: 0,
        }
    }
}

/// When a rendering is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// After so many samples per pixel, ≥ 1.
    Spp(u64),
    /// After so many seconds, > 0.
    Time(f64),
    /// When the estimated relative error of every tile of the picture is at most this, > 0.
    Error(f64),
}

/// A light that is no emitting shape.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Light from everywhere, at an infinite distance.
    Environment(Environment),
    /// Light from one direction.
    Distant {
        /// Towards the light.
        to_light: Vec3,
        /// Irradiance on a plane that faces the light, W·m⁻², ≥ 0, whatever the angle.
        irradiance: Vec3,
        /// Full angle of the disc that the light seems to be, degrees, in [0, 180]; 0 is parallel light.
        angle_deg: f64,
    },
    /// Light from a point.
    Point {
        /// Where it is.
        position: Vec3,
        /// Radiant intensity, W·sr⁻¹, ≥ 0.
        intensity: Vec3,
    },
    /// Light from a point into a cone. The intensity falls from that within the inner cone to 0 at the outer one as the smoothstep
    /// s²(3 − 2s) of s = (cos θ − cos θ_outer)/(cos θ_inner − cos θ_outer).
    Spot {
        /// Where it is.
        position: Vec3,
        /// The axis along which it shines; need not be of length 1.
        direction: Vec3,
        /// Radiant intensity within the inner cone, W·sr⁻¹, ≥ 0.
        intensity: Vec3,
        /// Full angle of the outer cone, degrees, in (0, 360].
        angle_deg: f64,
        /// Full angle of the inner cone, degrees, from 0 to `angle_deg`.
        inner_angle_deg: f64,
    },
    /// A clear sky with its sun (Preetham, Shirley & Smits 1999), +y up. Radiances are linear sRGB in W·sr⁻¹·m⁻² weighted by the
    /// eye's sensitivity: times 683 lm/W they are luminances.
    SunSky {
        /// Towards the sun in the sky's own space, y ≥ 0; need not be of length 1.
        to_sun: Vec3,
        /// Haze, from 2 (clear) to 10.
        turbidity: f64,
        /// Albedo of the plane below the horizon, 0 to 1.
        ground_albedo: Vec3,
        /// Factor on everything, ≥ 0.
        scale: Vec3,
        /// There is a sun's disc; the ground shows its light in any case.
        sun: bool,
        /// Full angle of the disc, degrees, in [0, 180]; the irradiance does not depend on it, 0 is parallel light.
        sun_angle_deg: f64,
        /// The sky's space to world, a rotation.
        rotation: Transform,
    },
    /// A parallelogram that emits from the side where edge_u × edge_v points.
    Rectangle {
        /// One corner.
        corner: Vec3,
        /// From the corner to a neighbouring one.
        edge_u: Vec3,
        /// From the corner to the other neighbouring one.
        edge_v: Vec3,
        /// Emitted radiance, W·sr⁻¹·m⁻², ≥ 0.
        radiance: Vec3,
        /// Emits from both sides.
        two_sided: bool,
    },
}

/// Light from everywhere.
#[derive(Debug, Clone, PartialEq)]
pub enum Environment {
    /// The same radiance from all directions.
    Constant {
        /// W·sr⁻¹·m⁻², ≥ 0.
        radiance: Vec3,
    },
    /// An image of all directions: +y is up, its centre is +z.
    Image {
        /// The image, as the scene names it; see [`Scene::resolve`].
        file: String,
        /// How it shows the directions.
        mapping: Mapping,
        /// Factor on its pixels, ≥ 0.
        scale: Vec3,
        /// Image to world, a rotation or a reflection.
        rotation: Transform,
    },
}

/// How an image shows all directions. (u, v) goes from the upper left corner to the lower right one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mapping {
    /// Latitude and longitude, OpenEXR's convention: ω stands at u = ½ − atan2(ω_x, ω_z)/2π, v = acos(ω_y)/π.
    #[default]
    LatLong,
    /// A mirroring ball seen from afar, from +z: at its point with normal n it shows the direction 2 n_z n − z. The ball fills
    /// the image.
    MirroredBall,
    /// A disk with +z in its centre, the angle from it proportional to the radius, +x right and +y up.
    Angular,
    /// A cube folded out to three columns and four rows, seen from inside: +y; then +x, +z, −x; then −y; then −z upside down.
    VerticalCross,
}

/// What surfaces are made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// The BSDF plugin with its parameters.
    pub block: PluginBlock,
    /// Turns the shading frame before the BSDF sees it.
    pub normal_map: Option<NormalMap>,
}

impl From<PluginBlock> for Material {
    fn from(block: PluginBlock) -> Material {
        Material {
            block,
            normal_map: None,
        }
    }
}

/// A medium: its plugin and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// The plugin with its parameters.
    pub block: PluginBlock,
    /// The medium's space to world.
    pub transform: Transform,
}

/// A surface. At least one of `material`, `emission` and `interior` is given. Without a material, light
/// passes straight through if there is an interior, and is absorbed otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Where it is.
    pub geometry: Geometry,
    /// Name in [`Scene::materials`].
    pub material: Option<String>,
    /// Radiance emitted from the outer side, W·sr⁻¹·m⁻², ≥ 0.
    pub emission: Option<Vec3>,
    /// Name in [`Scene::textures`] of what the emission is multiplied with over the surface; for rectangles and meshes.
    pub emission_texture: Option<String>,
    /// Emits from both sides; of no meaning without emission.
    pub two_sided: bool,
    /// Directions that the emission favours; of no meaning without emission.
    pub shaping: Option<Shaping>,
    /// Name in [`Scene::media`] of what fills it; for closed shapes only.
    pub interior: Option<String>,
    /// Where closed shapes overlap that refract or have an interior, those of the highest priority fill the overlap, and the
    /// surfaces of the others are not there (Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced Images"). Media
    /// of equal priority superpose.
    pub priority: i32,
}

/// A factor on emission by the angle θ from an axis: 0 beyond a cone's half angle θ_c, and within it
/// [1 − smoothstep(θ; (1 − softness) θ_c, θ_c)] · [tint + (1 − tint) |cos θ|^focus], as UsdLux's `ShapingAPI` has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaping {
    /// The axis, in world, or in a prototype's space; need not be of length 1, but not zero.
    pub axis: Vec3,
    /// Full angle 2 θ_c of the cone, degrees, in (0, 360]; 360 is no cone.
    pub angle_deg: f64,
    /// Share of θ_c over which the emission falls to 0, in [0, 1].
    pub softness: f64,
    /// Power of the cosine, ≥ 0.
    pub focus: f64,
    /// Factor where that power is 0, ≥ 0.
    pub focus_tint: Vec3,
}

/// A copy of a prototype, or many.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// Name in [`Scene::prototypes`].
    pub prototype: String,
    /// The prototype's space to world; it may stretch, shear and mirror.
    pub transform: Transform,
    /// A table of transforms, as the scene names it: there is a copy for each of them, placed by it and then by `transform`. See
    /// [`crate::table`].
    pub transforms: Option<String>,
    /// Name in [`Scene::materials`] of what replaces the material of every shape of the prototype.
    pub material: Option<String>,
}

/// Where a surface is. The outer side is the one the normal points to.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A sphere, outside out.
    Sphere {
        /// Its centre.
        center: Vec3,
        /// Its radius, > 0.
        radius: f64,
    },
    /// A parallelogram with normal edge_u × edge_v.
    Rectangle {
        /// One corner.
        corner: Vec3,
        /// From the corner to a neighbouring one.
        edge_u: Vec3,
        /// From the corner to the other neighbouring one.
        edge_v: Vec3,
    },
    /// A flat disk.
    Disk {
        /// Its centre.
        center: Vec3,
        /// Its normal; need not be of length 1, but not zero.
        normal: Vec3,
        /// Its radius, > 0.
        radius: f64,
    },
    /// The lateral surface of a cylinder, without caps; its outer side faces away from the axis.
    Cylinder {
        /// Middle of one end.
        base: Vec3,
        /// From there to the middle of the other end; not zero.
        axis: Vec3,
        /// Its radius, > 0.
        radius: f64,
    },
    /// Triangles in the scene file, counter-clockwise seen from outside.
    Mesh(Mesh),
    /// The meshes of a glTF 2.0 model with their own materials, emission and interiors; a material or interior of the shape
    /// replaces those of the model. The model's cameras and punctual lights are left out.
    Gltf {
        /// The file, as the scene names it; see [`Scene::resolve`].
        file: String,
        /// The model's space to world.
        transform: Transform,
    },
    /// Triangles in a PLY file, counter-clockwise seen from outside.
    Ply {
        /// The file, as the scene names it; see [`Scene::resolve`].
        file: String,
        /// The file's space to world.
        transform: Transform,
    },
}

/// Triangles in the scene file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per triangle.
    pub indices: Vec<[u32; 3]>,
    /// One shading normal per corner, or empty.
    pub normals: Vec<Vec3>,
    /// One texture coordinate per corner, or empty.
    pub uvs: Vec<[f64; 2]>,
    /// One linear colour and opacity per corner, or empty: what textures with [`Texture::vertex_color`] are multiplied with.
    pub colors: Vec<[f64; 4]>,
    /// One tangent per corner, or empty: the direction of growing u for normal maps and anisotropy, and with a negative fourth
    /// number growing v on the other side of it than usual. Without any they are taken from the texture coordinates.
    pub tangents: Vec<[f64; 4]>,
    /// The mesh's space to world.
    pub transform: Transform,
}
