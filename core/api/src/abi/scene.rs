//! The scene and the film as integrators see them, and the table of integrators.

use super::{Create, Destroy, Status, Text};
use crate::math::Float3;
use crate::operator::FlightDraws;
use crate::spectrum::Spectrum;
use crate::vertex::{CameraRay, Edge, LightRay, LightSample, SensorSample, Vertex};
use core::ffi::c_void;

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
    /// Some medium's transmittances are random estimates, not in closed form. Since minor version 4.
    pub const TRACKED_MEDIA: u32 = 128;
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
