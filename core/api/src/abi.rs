//! The C ABI of plugins: one exported symbol, plain-data tables, `extern "C"` functions.
//!
//! Rust authors never meet this file: they implement the safe traits and write one `export_plugin!` line. C authors
//! need only what is here.
//!
//! # Versions
//!
//! The ABI has a version of its own, apart from the crate's: [`ABI_MAJOR`] and [`ABI_MINOR`], written into every plugin's header.
//!
//! - A **minor** version appends: functions at the end of a table, bits of flags, numbers of kinds, meaning for what was reserved and
//!   zero. A plugin of an older minor version works as before; one of a newer works in an older host as long as it looks at a
//!   table's `size` before it uses what was appended. What came with which minor version says so ("Since minor version 1").
//! - A **major** version changes anything else. Host and plugin must have the same; otherwise the plugin is refused with a sentence
//!   that names both versions and the side to update.
//!
//! A plugin that was built once, by whatever compiler, goes on working with every later host of its major version. The
//! crate's version follows Cargo's rules for Rust authors: a crate that breaks their sources may keep the ABI, and then their old
//! libraries keep working. `CHANGELOG.md` lists both. C authors find the same in `include/resolvent.h`.
//!
//! # Rules
//!
//! Every table starts with its `size`, so later minor versions can append and the other side knows what is there.
//! The side that allocates frees. Only plain data crosses, by pointer. Every function may be called from any thread at any time after
//! `create` returned and before `destroy`. Libraries are never unloaded.

use crate::closure::Closure;
use crate::math::Float3;
use crate::medium::MediumInfo;
use crate::operator::{
    Coefficients, Flight, FlightDraws, ScatterDraws, ScatterEval, ScatterSample, Segment,
};
use crate::phase::MediumPoint;
use crate::spectrum::Spectrum;
use crate::surface::SurfacePoint;
use crate::vertex::{CameraRay, Edge, LightRay, LightSample, SensorSample, Vertex};
use core::ffi::c_void;

/// First bytes of every plugin header.
pub const MAGIC: [u8; 8] = *b"RESOLVNT";
/// Versions must agree exactly.
pub const ABI_MAJOR: u32 = 1;
/// The host accepts plugins of any minor version; it reads only what a table's size says is there.
pub const ABI_MINOR: u32 = 3;
/// Name of the exported `static` [`PluginHeader`].
pub const SYMBOL: &str = "resolvent_plugin";

/// What a call came to.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status(pub i32);

impl Status {
    /// Done.
    pub const OK: Self = Self(0);
    /// Nothing to report: no sample, no hit, absorbed.
    pub const NONE: Self = Self(1);
    /// Failed; the message went to [`HostTable::fail`].
    pub const ERROR: Self = Self(-1);
    /// The plugin panicked; the message went to [`HostTable::fail`].
    pub const PANIC: Self = Self(-2);
}

/// UTF-8 text, not terminated. The pointer may be null if the length is 0.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Text {
    /// First byte.
    pub data: *const u8,
    /// Bytes.
    pub len: usize,
}

// SAFETY: a `Text` is a view; those in statics point to static text, the others live for one call.
unsafe impl Sync for Text {}
// SAFETY: as above.
unsafe impl Send for Text {}

impl Text {
    /// A view of `s`.
    pub const fn new(s: &str) -> Self {
        Self {
            data: s.as_ptr(),
            len: s.len(),
        }
    }

    /// Copies the text, replacing what is not UTF-8.
    ///
    /// # Safety
    /// The view must be valid.
    pub unsafe fn to_owned(self) -> String {
        if self.data.is_null() || self.len == 0 {
            return String::new();
        }
        // SAFETY: valid by contract.
        let bytes = unsafe { core::slice::from_raw_parts(self.data, self.len) };
        String::from_utf8_lossy(bytes).into_owned()
    }
}

/// The kind of a plugin.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PluginKind {
    /// Table is a [`MediumTable`].
    Medium = 1,
    /// Table is a [`PhaseTable`].
    Phase = 2,
    /// Table is a [`BsdfTable`].
    Bsdf = 3,
    /// Table is an [`IntegratorTable`].
    Integrator = 4,
}

impl PluginKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Medium, Self::Phase, Self::Bsdf, Self::Integrator];

    /// From its number.
    pub fn from_u32(v: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|k| *k as u32 == v)
    }

    /// As written in scenes, file names and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Medium => "medium",
            Self::Phase => "phase",
            Self::Bsdf => "bsdf",
            Self::Integrator => "integrator",
        }
    }
}

/// The exported symbol: plain integers first, so that a foreign or older library can be told from one of ours.
#[repr(C)]
pub struct PluginHeader {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// [`ABI_MAJOR`] of the side that built it.
    pub abi_major: u32,
    /// [`ABI_MINOR`] of the side that built it.
    pub abi_minor: u32,
    /// `size_of::<PluginHeader>()`.
    pub size: u32,
    /// A [`PluginKind`] as its number.
    pub kind: u32,
    /// Name, as in scenes.
    pub name: Text,
    /// Version of the plugin.
    pub version: Text,
    /// One sentence.
    pub summary: Text,
    /// Declarations of the parameters.
    pub params: *const ParamDecl,
    /// How many.
    pub param_count: u32,
    /// `size_of::<ParamDecl>()`.
    pub param_size: u32,
    /// The table of the kind.
    pub table: *const c_void,
}

// SAFETY: headers are immutable statics.
unsafe impl Sync for PluginHeader {}

/// Type of a parameter.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParamKind {
    /// `true`/`false`; one number, 0 or 1.
    Bool = 1,
    /// A whole number.
    Int = 2,
    /// A number.
    Float = 3,
    /// One number for all lanes, or three (RGB); always arrives as three.
    Spectrum = 4,
    /// Three numbers.
    Vec3 = 5,
    /// Text.
    Text = 6,
    /// A path; arrives absolute, resolved against the scene file.
    File = 7,
    /// One of the words in `choices`.
    Choice = 8,
    /// Any count of numbers.
    Numbers = 9,
    /// Another plugin, of the kind named in `choices`.
    Plugin = 10,
    /// Kind of a value, not of a declaration: a texture where [`param_flags::TEXTURABLE`] allows one, to be read with
    /// [`HostTable::texture`]. Since minor version 1.
    Texture = 11,
}

/// Bits of [`ParamDecl::flags`].
pub mod param_flags {
    /// Must be given.
    pub const REQUIRED: u32 = 1;
    /// `min` applies.
    pub const MIN: u32 = 2;
    /// `max` applies.
    pub const MAX: u32 = 4;
    /// The value must exceed `min`.
    pub const ABOVE_MIN: u32 = 8;
    /// The value must stay below `max`.
    pub const BELOW_MAX: u32 = 16;
    /// It may also be a texture, whose values the host clamps to the range; for `Float` and `Spectrum` of BSDFs. Since minor
    /// version 1.
    pub const TEXTURABLE: u32 = 32;
}

/// Declaration of a parameter.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct ParamDecl {
    /// Name, as in scenes.
    pub name: Text,
    /// Unit, for people ("1/length"); empty if it has none.
    pub unit: Text,
    /// One sentence.
    pub help: Text,
    /// Default as JSON; empty: none, and the parameter is absent unless given.
    pub default: Text,
    /// Words of a `Choice`, separated by `|`; the kind of a `Plugin`.
    pub choices: Text,
    /// Lower bound of every number.
    pub min: f64,
    /// Upper bound of every number.
    pub max: f64,
    /// A [`ParamKind`] as its number.
    pub kind: u32,
    /// Bits of [`param_flags`].
    pub flags: u32,
}

/// The value of a parameter, checked by the host against its declaration, defaults filled in.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct ParamValue {
    /// Name.
    pub name: Text,
    /// A [`ParamKind`] as its number: as declared, or [`ParamKind::Texture`].
    pub kind: u32,
    /// How many numbers.
    pub count: u32,
    /// The numbers (`Bool`, `Int`, `Float`, `Spectrum`, `Vec3`, `Numbers`).
    pub numbers: *const f64,
    /// The text (`Text`, `File`, `Choice`).
    pub text: Text,
    /// The nested plugin's header, or null.
    pub header: *const PluginHeader,
    /// The nested plugin's instance, or the texture; owned by the host and alive as long as this one.
    pub instance: *const c_void,
}

/// What `create` is given.
#[repr(C)]
pub struct CreateArgs {
    /// `size_of::<CreateArgs>()`.
    pub size: u32,
    /// How many parameters.
    pub param_count: u32,
    /// The parameters that have a value.
    pub params: *const ParamValue,
    /// Services; valid for the life of the process.
    pub host: *const HostTable,
    /// Object to world: three rows of four, column vectors.
    pub to_world: [[f64; 4]; 3],
    /// Lanes in use.
    pub lanes: u32,
    /// Zero.
    pub reserved: u32,
}

/// A task of [`HostTable::parallel_for`].
pub type Task = unsafe extern "C" fn(data: *const c_void, index: usize);

/// Services of the host.
#[repr(C)]
pub struct HostTable {
    /// `size_of::<HostTable>()`.
    pub size: u32,
    /// Minor version of the host.
    pub abi_minor: u32,
    /// Passed back to the functions.
    pub ctx: *mut c_void,
    /// Says something: level 0 warning, 1 information.
    pub log: unsafe extern "C" fn(ctx: *mut c_void, level: u32, message: Text),
    /// Records why the call in progress on this thread is about to return an error.
    pub fail: unsafe extern "C" fn(ctx: *mut c_void, message: Text),
    /// Runs `task(data, i)` for all i below `count` on the host's threads and returns when all are done.
    pub parallel_for:
        unsafe extern "C" fn(ctx: *mut c_void, count: usize, task: Task, data: *const c_void),
    /// Writes red, green, blue and alpha of `texture` (the `instance` of a [`ParamValue`] of the kind [`ParamKind::Texture`]) at
    /// the texture coordinates `uv` to `out`: linear, clamped to the parameter's range, always finite. It takes no lock and
    /// allocates nothing. Since minor version 1: there if `size` reaches it.
    pub texture: unsafe extern "C" fn(
        ctx: *mut c_void,
        texture: *const c_void,
        uv: *const [f32; 2],
        out: *mut [f32; 4],
    ),
    /// The same at a point of a surface: textures may depend on more of it than its texture coordinates (the colours of its mesh),
    /// which [`HostTable::texture`] takes for white. Since minor version 2: there if `size` reaches it.
    pub texture_at: unsafe extern "C" fn(
        ctx: *mut c_void,
        texture: *const c_void,
        at: *const SurfacePoint,
        out: *mut [f32; 4],
    ),
}

// SAFETY: the host's functions may be called from any thread.
unsafe impl Sync for HostTable {}
// SAFETY: as above.
unsafe impl Send for HostTable {}

/// `create`: null on failure.
pub type Create = unsafe extern "C" fn(args: *const CreateArgs) -> *mut c_void;
/// `destroy`.
pub type Destroy = unsafe extern "C" fn(instance: *mut c_void);

/// Functions of a closure, see [`crate::Scatter`]; `data` are the closure's bytes.
#[repr(C)]
pub struct ScatterTable {
    /// `size_of::<ScatterTable>()`.
    pub size: u32,
    /// Bytes of the closure that are in use.
    pub data_size: u32,
    /// Value and densities between two unit directions that point away from the vertex, see [`crate::Scatter::eval`]. `mode` is a
    /// [`Mode`](crate::Mode) as its number.
    pub eval: unsafe extern "C" fn(
        data: *const c_void,
        wo: *const Float3,
        wi: *const Float3,
        mode: u32,
        out: *mut ScatterEval,
    ) -> Status,
    /// Chooses `wi` for `wo`, see [`crate::Scatter::sample`]; [`Status::NONE`] if the light is absorbed.
    pub sample: unsafe extern "C" fn(
        data: *const c_void,
        wo: *const Float3,
        u: *const ScatterDraws,
        mode: u32,
        out: *mut ScatterSample,
    ) -> Status,
    /// Bits of [`lobes`](crate::operator::lobes), see [`crate::Scatter::lobes`].
    pub lobes: unsafe extern "C" fn(data: *const c_void) -> u32,
    /// Index of refraction below the surface over that above, see [`crate::Scatter::eta`]; null: 1.
    pub eta: Option<unsafe extern "C" fn(data: *const c_void) -> f32>,
}

/// Functions of a medium, see [`crate::Medium`].
#[repr(C)]
pub struct MediumTable {
    /// `size_of::<MediumTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Bounds and facts, see [`crate::Medium::info`].
    pub info: unsafe extern "C" fn(instance: *const c_void, out: *mut MediumInfo) -> Status,
    /// Free flight: a collision or survival, with densities; see [`crate::Medium::sample`].
    pub sample: unsafe extern "C" fn(
        instance: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status,
    /// Unbiased transmittance `value/ratio` of a connection; see [`crate::Medium::transmit`].
    pub transmit: unsafe extern "C" fn(
        instance: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status,
    /// Approximate optical depth, deterministic and cheap; see [`crate::Medium::depth`].
    pub depth: unsafe extern "C" fn(
        instance: *const c_void,
        s: *const Segment,
        out: *mut Spectrum,
    ) -> Status,
    /// Exact coefficients at a point in the world, see [`crate::Medium::coefficients`].
    pub coefficients: unsafe extern "C" fn(
        instance: *const c_void,
        p: *const Float3,
        out: *mut Coefficients,
    ) -> Status,
}

/// Functions of a phase function, see [`crate::PhaseFunction`].
#[repr(C)]
pub struct PhaseTable {
    /// `size_of::<PhaseTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Resolves the phase function at a point, see [`crate::PhaseFunction::closure`]. The closure may point into the instance: no function of it is called after `destroy`.
    pub closure: unsafe extern "C" fn(
        instance: *const c_void,
        at: *const MediumPoint,
        out: *mut Closure,
    ) -> Status,
}

/// Functions of a BSDF, see [`crate::Bsdf`].
#[repr(C)]
pub struct BsdfTable {
    /// `size_of::<BsdfTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Bits of [`bsdf_traits`](crate::surface::bsdf_traits), see [`crate::Bsdf::traits`].
    pub traits: unsafe extern "C" fn(instance: *const c_void) -> u32,
    /// Resolves the BSDF at a point, see [`crate::Bsdf::closure`].
    pub closure: unsafe extern "C" fn(
        instance: *const c_void,
        at: *const SurfacePoint,
        out: *mut Closure,
    ) -> Status,
    /// Index of refraction inside, see [`crate::Bsdf::ior`]; null: 1.
    pub ior: Option<unsafe extern "C" fn(instance: *const c_void) -> f32>,
}

/// Facts about the scene that an integrator may choose its kernel by; bits of [`SceneTable::traits`].
pub mod scene_traits {
    /// Has surfaces.
    pub const SURFACES: u32 = 1;
    /// Has media.
    pub const MEDIA: u32 = 2;
    /// The value of a flight can differ from its density: some medium's extinction differs between lanes, or all media only
    /// absorb and light fades along the way.
    pub const CHROMATIC_MEDIA: u32 = 4;
    /// Some medium emits.
    pub const EMISSIVE_MEDIA: u32 = 8;
    /// Has lights that next-event estimation should sample.
    pub const LIGHTS: u32 = 16;
    /// Has lights that a scattered ray can hit (area lights, environment, suns with an angle).
    pub const HITTABLE_LIGHTS: u32 = 32;
    /// Has an environment.
    pub const ENVIRONMENT: u32 = 64;
}

/// The scene as an integrator sees it. Functions return [`Status::OK`], [`Status::NONE`] where stated, or an error, on
/// which the integrator returns at once.
#[repr(C)]
pub struct SceneTable {
    /// `size_of::<SceneTable>()`.
    pub size: u32,
    /// Bits of [`scene_traits`].
    pub traits: u32,
    /// Lanes in use.
    pub lanes: u32,
    /// Zero.
    pub reserved: u32,
    /// Unit direction towards the strongest distant light, or zero if there is none: what walks in media may be guided by.
    pub sun: Float3,
    /// Zero.
    pub reserved_sun: u32,
    /// Passed back to the functions.
    pub ctx: *const c_void,
    /// Ray of a sample of `pixel` (column, row). `film` are two random numbers that the reconstruction filter turns into a
    /// position around the pixel's centre, `lens` two for the position on the lens.
    pub camera_ray: unsafe extern "C" fn(
        ctx: *const c_void,
        pixel: *const [u32; 2],
        film: *const [f32; 2],
        lens: *const [f32; 2],
        out: *mut CameraRay,
    ) -> Status,
    /// G from the sensor: as `propagate`, for a camera ray.
    pub emerge: unsafe extern "C" fn(
        ctx: *const c_void,
        ray: *const CameraRay,
        u: *const FlightDraws,
        edge: *mut Edge,
        next: *mut Vertex,
    ) -> Status,
    /// G from a vertex in direction `wi`: the next vertex (surface, medium or emitter) and the edge to it.
    /// [`Status::NONE`] if the light is lost; the edge's `emitted` counts even then.
    pub propagate: unsafe extern "C" fn(
        ctx: *const c_void,
        from: *const Vertex,
        wi: *const Float3,
        u: *const FlightDraws,
        edge: *mut Edge,
        next: *mut Vertex,
    ) -> Status,
    /// Chooses a point on a light for `reference`. [`Status::NONE`] if there is nothing to connect to.
    pub sample_light: unsafe extern "C" fn(
        ctx: *const c_void,
        reference: *const Vertex,
        choice: f32,
        point: *const [f32; 2],
        out: *mut LightSample,
    ) -> Status,
    /// Density (sr⁻¹) with which `sample_light` at `reference` gives the direction to the emitting vertex `found`.
    pub light_density: unsafe extern "C" fn(
        ctx: *const c_void,
        reference: *const Vertex,
        found: *const Vertex,
    ) -> f32,
    /// Approximate transmittance of a connection, without the test of visibility: deterministic, cheap.
    pub approximate: unsafe extern "C" fn(
        ctx: *const c_void,
        from: *const Vertex,
        to: *const LightSample,
        out: *mut Spectrum,
    ) -> Status,
    /// Reports that the scattering closure of a vertex panicked or gave a value that is not finite: the host names its plugin
    /// and ends the render.
    pub fault:
        unsafe extern "C" fn(ctx: *const c_void, vertex: *const Vertex, message: Text) -> Status,
    /// Connects a vertex to a point on a light. [`Status::NONE`] if it is occluded.
    pub connect: unsafe extern "C" fn(
        ctx: *const c_void,
        from: *const Vertex,
        to: *const LightSample,
        u: *const FlightDraws,
        edge: *mut Edge,
    ) -> Status,
    /// Ray through the position `film` (pixels), without the reconstruction filter.
    pub film_ray: unsafe extern "C" fn(
        ctx: *const c_void,
        film: *const [f32; 2],
        lens: *const [f32; 2],
        out: *mut CameraRay,
    ) -> Status,
    /// Chooses a point on the lens for `reference`, where it can connect to. [`Status::NONE`] if it is not on the film.
    pub sense: unsafe extern "C" fn(
        ctx: *const c_void,
        reference: *const Vertex,
        lens: *const [f32; 2],
        out: *mut SensorSample,
    ) -> Status,
    /// Chooses a light, a vertex on it and a ray that leaves it. [`Status::NONE`] if there is none.
    pub emit: unsafe extern "C" fn(
        ctx: *const c_void,
        choice: f32,
        position: *const [f32; 2],
        direction: *const [f32; 2],
        out: *mut LightRay,
        vertex: *mut Vertex,
    ) -> Status,
    /// The two densities with which `emit` gives the vertex `light` and a ray towards `to`, as in [`LightRay`]:
    /// `position`, `direction`.
    pub emission_density: unsafe extern "C" fn(
        ctx: *const c_void,
        light: *const Vertex,
        to: *const Vertex,
        out: *mut [f32; 2],
    ) -> Status,
    /// Radiance that the vertex `light`, on an emitting surface, sends towards `to`: 0 from a side that does not emit, and from
    /// lights that no ray can meet. Since minor version 2: there if `size` reaches it.
    pub radiance: unsafe extern "C" fn(
        ctx: *const c_void,
        light: *const Vertex,
        to: *const Vertex,
        out: *mut Spectrum,
    ) -> Status,
}

/// Features of a pixel sample beyond its radiance; filled if [`Tile::features`] asks for them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelSample {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
    /// Coverage: 0 where the camera sees the environment unhindered, 1 elsewhere.
    pub alpha: f32,
    /// Distance to the first vertex; 0 if there is none.
    pub depth: f32,
    /// Albedo there.
    pub albedo: Float3,
    /// Shading normal there (0 in media).
    pub normal: Float3,
}

/// A piece of work: a rectangle of pixels and a range of samples.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// First column and row.
    pub min: [u32; 2],
    /// One past the last column and row.
    pub max: [u32; 2],
    /// First sample.
    pub sample_begin: u32,
    /// One past the last sample.
    pub sample_end: u32,
    /// Seed of the image.
    pub seed: u64,
    /// Width and height of the full image, pixels.
    pub resolution: [u32; 2],
    /// The window that is rendered: first column and row, one past the last column and row.
    pub window: [u32; 4],
    /// 1 if features are wanted.
    pub features: u32,
    /// How far beyond the window's border light still counts for its pixels: the reach of the reconstruction filter past
    /// half a pixel.
    pub margin: f32,
}

/// Where an integrator puts its samples.
#[repr(C)]
pub struct OutputTable {
    /// `size_of::<OutputTable>()`.
    pub size: u32,
    /// How many layers of light by scattering order are wanted: layer k has the light scattered k times, the last one all that was
    /// scattered more often; 0: none. Since minor version 2, before which it was zero.
    pub orders: u32,
    /// Passed back to the functions.
    pub ctx: *mut c_void,
    /// Adds one sample of pixel (x, y). Samples of a pixel must come in order.
    pub add: unsafe extern "C" fn(
        ctx: *mut c_void,
        x: u32,
        y: u32,
        sample: *const PixelSample,
    ) -> Status,
    /// Adds light to the film at position `film` (pixels), for walks that start at lights: every pixel receives it times the
    /// value of its reconstruction filter there, divided by the number of samples of all pixels of the window together.
    pub splat: unsafe extern "C" fn(
        ctx: *mut c_void,
        film: *const [f32; 2],
        radiance: *const Spectrum,
    ) -> Status,
    /// As `add`, with `layers`: the sample's radiance by scattering order, `orders` spectra that sum to it. Takes the place of `add`
    /// if `orders` is not 0. Since minor version 2: there if `size` reaches it.
    pub add_orders: unsafe extern "C" fn(
        ctx: *mut c_void,
        x: u32,
        y: u32,
        sample: *const PixelSample,
        layers: *const Spectrum,
    ) -> Status,
    /// As `splat`, for light that was scattered `order` times. Takes the place of `splat` if `orders` is not 0. Since minor
    /// version 2: there if `size` reaches it.
    pub splat_order: unsafe extern "C" fn(
        ctx: *mut c_void,
        film: *const [f32; 2],
        radiance: *const Spectrum,
        order: u32,
    ) -> Status,
}

/// Functions of an integrator, see [`crate::Integrator`].
#[repr(C)]
pub struct IntegratorTable {
    /// `size_of::<IntegratorTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Renders a piece of work: every sample of every pixel of the tile, see [`crate::Integrator::render`].
    pub render: unsafe extern "C" fn(
        instance: *const c_void,
        scene: *const SceneTable,
        tile: *const Tile,
        out: *const OutputTable,
    ) -> Status,
}
