//! The scene as an integrator sees it: the table of functions, counters, and the first error.

use super::{Scene, Until, media};
use crate::light::Reference;
use crate::plugin::{ForeignMedium, pending_failure};
use bytemuck::{Pod, Zeroable};
use resolvent_api::abi::{SceneTable, Status, Text, scene_traits};
use resolvent_api::math::Float3;
use resolvent_api::operator::FlightDraws;
use resolvent_api::vertex::{
    CameraRay, Edge, LightRay, LightSample, SensorSample, Vertex, WITH_MEDIA, vertex_flags,
};
use resolvent_api::{Spectrum, Vec3};
use std::cell::{Cell, RefCell};
use std::ffi::c_void;

/// What was done, counted per worker and summed at the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Counters {
    /// Rays traced against surfaces to find the nearest.
    pub rays: u64,
    /// Rays traced against surfaces to test visibility.
    pub shadow_rays: u64,
    /// Free flights asked of media.
    pub flights: u64,
    /// Transmittances asked of media.
    pub transmittances: u64,
    /// Approximate depths asked of media.
    pub depths: u64,
    /// Real collisions.
    pub collisions: u64,
    /// Null collisions.
    pub nulls: u64,
    /// Look-ups of a density.
    pub lookups: u64,
    /// Points where extinction exceeded its majorant.
    pub violations: u64,
}

impl Counters {
    /// All counts, in the order of the fields.
    pub(crate) fn to_array(self) -> [u64; 9] {
        bytemuck::cast(self)
    }

    /// The counts that [`Counters::to_array`] gave.
    pub(crate) fn from_array(all: &[u64]) -> Option<Self> {
        // Sums of what files say must not overflow.
        if all.iter().any(|n| *n > 1 << 60) {
            return None;
        }
        <[u64; 9]>::try_from(all).ok().map(bytemuck::cast)
    }

    /// Adds another's counts.
    pub fn add(&mut self, o: &Self) {
        let mut all = self.to_array();
        all.iter_mut().zip(o.to_array()).for_each(|(a, b)| *a += b);
        *self = bytemuck::cast(all);
    }
}

/// One worker's view of a scene; not shared between threads.
pub struct View<'s> {
    /// The scene.
    pub scene: &'s Scene,
    pub(crate) counters: Cell<Counters>,
    error: RefCell<Option<String>>,
    until: Until<'s>,
    /// Rays that integrators have asked for.
    calls: Cell<u32>,
    stopped: Cell<bool>,
}

impl<'s> View<'s> {
    /// A fresh view for work that may be stopped.
    pub fn new(scene: &'s Scene, until: Until<'s>) -> Self {
        Self {
            scene,
            counters: Cell::default(),
            error: RefCell::new(None),
            until,
            calls: Cell::new(0),
            stopped: Cell::new(false),
        }
    }

    /// True if an integrator has been told to end, since the work is to stop.
    pub fn is_stopped(&self) -> bool {
        self.stopped.get()
    }

    /// Counts a ray; an error if the work is to stop.
    #[inline(always)]
    pub(super) fn go_on(&self) -> Result<(), Status> {
        let calls = self.calls.get().wrapping_add(1);
        self.calls.set(calls);
        if self.until.is_due(calls) {
            self.stopped.set(true);
            return Err(Status::ERROR);
        }
        Ok(())
    }

    /// What was counted.
    pub fn counters(&self) -> Counters {
        self.counters.get()
    }

    /// The first error a plugin caused.
    pub fn take_error(&self) -> Option<String> {
        self.error.borrow_mut().take()
    }

    #[inline(always)]
    pub(super) fn count(&self, f: impl FnOnce(&mut Counters)) {
        let mut c = self.counters.get();
        f(&mut c);
        self.counters.set(c);
    }

    #[cold]
    pub(super) fn fail(&self, why: String) -> Status {
        self.error.borrow_mut().get_or_insert(why);
        Status::ERROR
    }

    #[cold]
    pub(super) fn medium_failed(&self, medium: &ForeignMedium, name: &str, why: &str) -> Status {
        self.fail(format!(
            "{} of the medium '{name}': {why}",
            medium.instance.plugin.title()
        ))
    }

    /// The table for an integrator. The facts about the scene choose the functions: what the scene does not have is not
    /// tested for along the path.
    pub fn table(&self) -> SceneTable {
        let has = |t| self.scene.traits & t != 0;
        let single = self.scene.media.len() == 1 && self.scene.media[0].free;
        let (emerge, propagate, connect) =
            match (has(scene_traits::SURFACES), has(scene_traits::MEDIA)) {
                _ if !WITH_MEDIA => functions::<true, { media::NONE }>(),
                (true, false) => functions::<true, { media::NONE }>(),
                (true, true) if self.scene.fades => functions::<true, { media::FADING }>(),
                (true, true) if single => functions::<true, { media::ONE }>(),
                (true, true) => functions::<true, { media::MANY }>(),
                (false, false) => functions::<false, { media::NONE }>(),
                (false, true) if self.scene.fades => functions::<false, { media::FADING }>(),
                (false, true) if single => functions::<false, { media::ONE }>(),
                (false, true) => functions::<false, { media::MANY }>(),
            };
        SceneTable {
            size: size_of::<SceneTable>() as u32,
            traits: self.scene.traits,
            lanes: self.scene.lanes,
            reserved: 0,
            sun: self.scene.lights.sun().into(),
            reserved_sun: 0,
            ctx: std::ptr::from_ref(self).cast(),
            camera_ray,
            emerge,
            propagate,
            sample_light,
            light_density,
            approximate,
            fault,
            connect,
            film_ray,
            sense,
            emit,
            emission_density,
            radiance,
        }
    }
}

type Emerge = unsafe extern "C" fn(
    *const c_void,
    *const CameraRay,
    *const FlightDraws,
    *mut Edge,
    *mut Vertex,
) -> Status;
type Propagate = unsafe extern "C" fn(
    *const c_void,
    *const Vertex,
    *const Float3,
    *const FlightDraws,
    *mut Edge,
    *mut Vertex,
) -> Status;
type Connect = unsafe extern "C" fn(
    *const c_void,
    *const Vertex,
    *const LightSample,
    *const FlightDraws,
    *mut Edge,
) -> Status;

fn functions<const SURFACES: bool, const MEDIA: u8>() -> (Emerge, Propagate, Connect) {
    (
        emerge::<SURFACES, MEDIA>,
        propagate::<SURFACES, MEDIA>,
        connect::<SURFACES, MEDIA>,
    )
}

/// # Safety
/// `ctx` is the `View` of a table that is still in use.
#[inline(always)]
unsafe fn view<'a>(ctx: *const c_void) -> &'a View<'a> {
    // SAFETY: by contract.
    unsafe { &*ctx.cast::<View<'a>>() }
}

unsafe extern "C" fn camera_ray(
    ctx: *const c_void,
    pixel: *const [u32; 2],
    film: *const [f32; 2],
    lens: *const [f32; 2],
    out: *mut CameraRay,
) -> Status {
    // SAFETY: integrators pass on the table's ctx and valid pointers; the same below.
    unsafe {
        let scene = view(ctx).scene;
        *out = scene.within(scene.camera.ray(*pixel, *film, *lens));
    }
    Status::OK
}

unsafe extern "C" fn emerge<const SURFACES: bool, const MEDIA: u8>(
    ctx: *const c_void,
    ray: *const CameraRay,
    u: *const FlightDraws,
    edge: *mut Edge,
    next: *mut Vertex,
) -> Status {
    // SAFETY: as above.
    let (v, ray, u, edge, next) = unsafe { (view(ctx), &*ray, &*u, &mut *edge, &mut *next) };
    v.travel::<SURFACES, MEDIA>(ray.o.into(), ray.d.into(), ray.inside, u, edge, next)
}

unsafe extern "C" fn propagate<const SURFACES: bool, const MEDIA: u8>(
    ctx: *const c_void,
    from: *const Vertex,
    wi: *const Float3,
    u: *const FlightDraws,
    edge: *mut Edge,
    next: *mut Vertex,
) -> Status {
    // SAFETY: as above.
    let (v, from, wi, u, edge, next) = unsafe {
        (
            view(ctx),
            &*from,
            Vec3::from(*wi),
            &*u,
            &mut *edge,
            &mut *next,
        )
    };
    let (o, inside) = v.scene.leave(from, wi);
    v.travel::<SURFACES, MEDIA>(o, wi, inside, u, edge, next)
}

unsafe extern "C" fn sample_light(
    ctx: *const c_void,
    reference: *const Vertex,
    choice: f32,
    point: *const [f32; 2],
    out: *mut LightSample,
) -> Status {
    // SAFETY: as above.
    let (v, reference, point) = unsafe { (view(ctx), &*reference, *point) };
    let at = Reference::of(reference);
    match v.scene.lights.sample(&at, choice, point) {
        Some(s) if s.density > 0.0 && !s.radiance.is_zero() => {
            // SAFETY: as above.
            unsafe { *out = s };
            Status::OK
        }
        _ => Status::NONE,
    }
}

unsafe extern "C" fn light_density(
    ctx: *const c_void,
    reference: *const Vertex,
    found: *const Vertex,
) -> f32 {
    // SAFETY: as above.
    let (v, reference, found) = unsafe { (view(ctx), &*reference, &*found) };
    let at = Reference::of(reference);
    let lights = &v.scene.lights;
    if found.flags & vertex_flags::DELTA != 0 {
        return lights.probability(&at, found.light);
    }
    if found.flags & vertex_flags::INFINITE != 0 {
        return lights.environment(at.in_medium, found.position()).1;
    }
    let ng = Vec3::from(found.ng);
    lights.density(&at, found.light, found.position(), ng)
}

unsafe extern "C" fn approximate(
    ctx: *const c_void,
    from: *const Vertex,
    to: *const LightSample,
    out: *mut Spectrum,
) -> Status {
    // SAFETY: as above.
    let (v, from, to) = unsafe { (view(ctx), &*from, &*to) };
    match v.approximate_depth(from, to) {
        Ok(depth) => {
            // SAFETY: as above.
            unsafe { *out = (depth * -1.0).exp() };
            Status::OK
        }
        Err(status) => status,
    }
}

unsafe extern "C" fn connect<const SURFACES: bool, const MEDIA: u8>(
    ctx: *const c_void,
    from: *const Vertex,
    to: *const LightSample,
    u: *const FlightDraws,
    edge: *mut Edge,
) -> Status {
    // SAFETY: as above.
    let (v, from, to, u, edge) = unsafe { (view(ctx), &*from, &*to, &*u, &mut *edge) };
    v.join::<SURFACES, MEDIA>(from, to, u, edge)
}

unsafe extern "C" fn film_ray(
    ctx: *const c_void,
    film: *const [f32; 2],
    lens: *const [f32; 2],
    out: *mut CameraRay,
) -> Status {
    // SAFETY: as above.
    unsafe {
        let scene = view(ctx).scene;
        *out = scene.within(scene.camera.film_ray(*film, *lens));
    }
    Status::OK
}

unsafe extern "C" fn sense(
    ctx: *const c_void,
    reference: *const Vertex,
    lens: *const [f32; 2],
    out: *mut SensorSample,
) -> Status {
    // SAFETY: as above.
    let (v, reference, lens) = unsafe { (view(ctx), &*reference, *lens) };
    match v.scene.camera.sense(reference, lens) {
        Some(s) => {
            // SAFETY: as above.
            unsafe { *out = s };
            Status::OK
        }
        None => Status::NONE,
    }
}

unsafe extern "C" fn emit(
    ctx: *const c_void,
    choice: f32,
    position: *const [f32; 2],
    direction: *const [f32; 2],
    out: *mut LightRay,
    vertex: *mut Vertex,
) -> Status {
    // SAFETY: as above.
    let (v, position, direction, vertex) =
        unsafe { (view(ctx), *position, *direction, &mut *vertex) };
    let scene = v.scene;
    match scene.lights.emit(choice, position, direction, vertex) {
        Some(mut ray) => {
            // Lights at infinity stand outside everything.
            if !vertex.is_infinite() {
                ray.inside = scene.light_start(vertex.light, ray.o.into());
                vertex.inside = ray.inside;
            }
            // SAFETY: as above.
            unsafe { *out = ray };
            Status::OK
        }
        None => Status::NONE,
    }
}

unsafe extern "C" fn emission_density(
    ctx: *const c_void,
    light: *const Vertex,
    to: *const Vertex,
    out: *mut [f32; 2],
) -> Status {
    // SAFETY: as above.
    unsafe { *out = view(ctx).scene.lights.emission_density(&*light, &*to) };
    Status::OK
}

unsafe extern "C" fn radiance(
    ctx: *const c_void,
    light: *const Vertex,
    to: *const Vertex,
    out: *mut Spectrum,
) -> Status {
    // SAFETY: as above.
    unsafe { *out = view(ctx).scene.lights.radiance(&*light, &*to) };
    Status::OK
}

unsafe extern "C" fn fault(ctx: *const c_void, vertex: *const Vertex, message: Text) -> Status {
    // SAFETY: as above.
    let (v, vertex, message) = unsafe { (view(ctx), &*vertex, message.to_owned()) };
    // What the plugin itself said, if it panicked.
    let why = pending_failure().map_or(message.clone(), |own| format!("{message}: {own}"));
    let at = v.scene.centre + Vec3::from(vertex.p).as_dvec3();
    v.fail(format!("{} {why}, at {at}", v.scene.scatterer(vertex)))
}
