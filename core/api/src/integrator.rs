//! Integrators: the trait of their plugins and the scene as they see it.

use crate::abi::{OutputTable, PixelSample, SceneTable, Status, Text, Tile, scene_traits};
use crate::math::Vec3;
use crate::operator::FlightDraws;
use crate::spectrum::Spectrum;
use crate::vertex::{CameraRay, Edge, LightRay, LightSample, SensorSample, Vertex, WITH_MEDIA};

/// A host call failed (a plugin broke, or the render was stopped); return it at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

/// What a host call came to.
pub type Outcome<T> = Result<T, Stopped>;

/// An integrator plugin.
pub trait Integrator: Send + Sync + 'static {
    /// Renders a piece of work into `out`. What it adds must depend on the tile and the scene alone.
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()>;
}

/// G for a whole scene: how vertices are linked.
pub trait Transport {
    /// The next vertex from `from` in direction `wi`. `false`: the light is lost (the edge's emission counts even then).
    fn propagate(
        &self,
        from: &Vertex,
        wi: Vec3,
        u: &FlightDraws,
        edge: &mut Edge,
        next: &mut Vertex,
    ) -> Outcome<bool>;
    /// Connects `from` to a point on a light; `None` if occluded.
    fn connect(&self, from: &Vertex, to: &LightSample, u: &FlightDraws) -> Outcome<Option<Edge>>;
}

/// The scene.
#[derive(Clone, Copy)]
pub struct SceneView<'a> {
    table: &'a SceneTable,
}

#[inline(always)]
fn found(status: Status) -> Outcome<bool> {
    match status {
        Status::OK => Ok(true),
        Status::NONE => Ok(false),
        _ => Err(Stopped),
    }
}

impl<'a> SceneView<'a> {
    /// A view of the host's table.
    ///
    /// # Safety
    /// The table must be a complete one of this ABI version, valid for `'a`.
    pub unsafe fn new(table: &'a SceneTable) -> Self {
        Self { table }
    }

    /// True if the scene has all of these [`scene_traits`].
    #[inline(always)]
    pub fn has(&self, traits: u32) -> bool {
        let media = scene_traits::MEDIA
            | scene_traits::EMISSIVE_MEDIA
            | scene_traits::CHROMATIC_MEDIA
            | scene_traits::TRACKED_MEDIA;
        self.table.traits & traits == traits && (WITH_MEDIA || traits & media == 0)
    }

    /// True if a grey kernel is enough: no medium tells lanes apart.
    pub fn is_grey(&self) -> bool {
        !self.has(scene_traits::CHROMATIC_MEDIA)
    }

    /// Lanes in use.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        self.table.lanes
    }

    /// Unit direction towards the strongest distant light, if there is one.
    pub fn sun(&self) -> Option<Vec3> {
        let sun = Vec3::from(self.table.sun);
        (sun != Vec3::ZERO).then_some(sun)
    }

    /// The camera's ray for a sample of `pixel` (column, row), by two random numbers for the film and two for the lens.
    #[inline(always)]
    pub fn camera_ray(
        &self,
        pixel: [u32; 2],
        film: [f32; 2],
        lens: [f32; 2],
    ) -> Outcome<Option<CameraRay>> {
        let mut ray = CameraRay::default();
        // SAFETY: the table is valid (contract of `new`), pointers live for the call.
        let status =
            unsafe { (self.table.camera_ray)(self.table.ctx, &pixel, &film, &lens, &mut ray) };
        Ok(found(status)?.then_some(ray))
    }

    /// G from the sensor.
    #[inline(always)]
    pub fn emerge(
        &self,
        ray: &CameraRay,
        u: &FlightDraws,
        edge: &mut Edge,
        next: &mut Vertex,
    ) -> Outcome<bool> {
        // SAFETY: as above.
        found(unsafe { (self.table.emerge)(self.table.ctx, ray, u, edge, next) })
    }

    /// Chooses a point on a light for `reference`; `None` if nothing can be connected.
    ///
    /// Lights that scattering finds as well from there are left to it (a constant environment, from inside a medium): then
    /// [`SceneView::light_density`] is 0, and only an integrator that also follows scattered directions has all light.
    #[inline(always)]
    pub fn sample_light(
        &self,
        reference: &Vertex,
        choice: f32,
        point: [f32; 2],
    ) -> Outcome<Option<LightSample>> {
        let mut out = core::mem::MaybeUninit::<LightSample>::uninit();
        // SAFETY: as above; the host fills `out` completely when it returns OK.
        unsafe {
            let status = (self.table.sample_light)(
                self.table.ctx,
                reference,
                choice,
                &point,
                out.as_mut_ptr(),
            );
            Ok(found(status)?.then(|| out.assume_init()))
        }
    }

    /// Density (sr⁻¹) with which [`SceneView::sample_light`] at `reference` finds `emitter`.
    #[inline(always)]
    pub fn light_density(&self, reference: &Vertex, emitter: &Vertex) -> f32 {
        // SAFETY: as above.
        unsafe { (self.table.light_density)(self.table.ctx, reference, emitter) }
    }

    /// Reports a broken closure of `vertex`; the render ends with an error that names its plugin.
    #[cold]
    pub fn fault(&self, vertex: &Vertex, message: &str) -> Stopped {
        // SAFETY: as above.
        unsafe { (self.table.fault)(self.table.ctx, vertex, Text::new(message)) };
        Stopped
    }

    /// The camera's ray through the position `film` (pixels), without the reconstruction filter.
    #[inline(always)]
    pub fn film_ray(&self, film: [f32; 2], lens: [f32; 2]) -> Outcome<Option<CameraRay>> {
        let mut ray = CameraRay::default();
        // SAFETY: as above.
        let status = unsafe { (self.table.film_ray)(self.table.ctx, &film, &lens, &mut ray) };
        Ok(found(status)?.then_some(ray))
    }

    /// A point on the lens for `reference`; `None` if it does not see the film.
    #[inline(always)]
    pub fn sense(&self, reference: &Vertex, lens: [f32; 2]) -> Outcome<Option<SensorSample>> {
        let mut out = core::mem::MaybeUninit::<SensorSample>::uninit();
        // SAFETY: as above; the host fills `out` completely when it returns OK.
        unsafe {
            let status = (self.table.sense)(self.table.ctx, reference, &lens, out.as_mut_ptr());
            Ok(found(status)?.then(|| out.assume_init()))
        }
    }

    /// Chooses a light, a vertex on it and a ray that leaves it; `None` if there is none.
    #[inline(always)]
    pub fn emit(
        &self,
        choice: f32,
        position: [f32; 2],
        direction: [f32; 2],
        vertex: &mut Vertex,
    ) -> Outcome<Option<LightRay>> {
        let mut ray = LightRay::default();
        // SAFETY: as above.
        let status = unsafe {
            (self.table.emit)(
                self.table.ctx,
                choice,
                &position,
                &direction,
                &mut ray,
                vertex,
            )
        };
        Ok(found(status)?.then_some(ray))
    }

    /// The densities (position, direction; see [`LightRay`]) with which [`SceneView::emit`] gives `light` and a ray to `to`.
    #[inline(always)]
    pub fn emission_density(&self, light: &Vertex, to: &Vertex) -> Outcome<[f32; 2]> {
        let mut out = [0.0; 2];
        // SAFETY: as above.
        found(unsafe { (self.table.emission_density)(self.table.ctx, light, to, &mut out) })?;
        Ok(out)
    }

    /// Radiance that `light`, a vertex on an emitting surface, sends towards `to`.
    #[inline(always)]
    pub fn radiance(&self, light: &Vertex, to: &Vertex) -> Outcome<Spectrum> {
        let mut out = Spectrum::ZERO;
        // SAFETY: as above.
        found(unsafe { (self.table.radiance)(self.table.ctx, light, to, &mut out) })?;
        Ok(out)
    }

    /// Approximate transmittance towards a light, visibility not tested.
    #[inline(always)]
    pub fn approximate(&self, from: &Vertex, to: &LightSample) -> Outcome<Spectrum> {
        let mut out = Spectrum::ZERO;
        // SAFETY: as above.
        found(unsafe { (self.table.approximate)(self.table.ctx, from, to, &mut out) })?;
        Ok(out)
    }
}

impl Transport for SceneView<'_> {
    #[inline(always)]
    fn propagate(
        &self,
        from: &Vertex,
        wi: Vec3,
        u: &FlightDraws,
        edge: &mut Edge,
        next: &mut Vertex,
    ) -> Outcome<bool> {
        // SAFETY: as above.
        found(unsafe {
            (self.table.propagate)(self.table.ctx, from, &wi.to_array(), u, edge, next)
        })
    }

    #[inline(always)]
    fn connect(&self, from: &Vertex, to: &LightSample, u: &FlightDraws) -> Outcome<Option<Edge>> {
        let mut edge = Edge::default();
        // SAFETY: as above.
        let status = unsafe { (self.table.connect)(self.table.ctx, from, to, u, &mut edge) };
        Ok(found(status)?.then_some(edge))
    }
}

/// Where samples go.
pub struct Output<'a> {
    table: &'a OutputTable,
}

impl<'a> Output<'a> {
    /// # Safety
    /// The table must be a complete one of this ABI version, valid for `'a`.
    pub unsafe fn new(table: &'a OutputTable) -> Self {
        Self { table }
    }

    /// Adds one sample of pixel (x, y); the samples of a pixel come in order.
    #[inline(always)]
    pub fn add(&mut self, x: u32, y: u32, sample: &PixelSample) -> Outcome<()> {
        // SAFETY: the table is valid (contract of `new`), pointers live for the call.
        found(unsafe { (self.table.add)(self.table.ctx, x, y, sample) }).map(|_| ())
    }

    /// Adds light to the film at a position in pixels: every pixel receives it times the value of its reconstruction filter
    /// there, divided by the number of samples of all pixels of the window together.
    #[inline(always)]
    pub fn splat(&mut self, film: [f32; 2], radiance: Spectrum) -> Outcome<()> {
        // SAFETY: as above.
        found(unsafe { (self.table.splat)(self.table.ctx, &film, &radiance) }).map(|_| ())
    }

    /// How many layers of light by scattering order are wanted: layer k has the light scattered k times, the last one all that
    /// was scattered more often; 0: none.
    pub fn orders(&self) -> usize {
        let complete = self.table.size as usize >= size_of::<OutputTable>();
        if complete {
            self.table.orders as usize
        } else {
            0
        }
    }

    /// As [`Output::add`], with the radiance by scattering order. Takes its place if [`Output::orders`] is not 0.
    ///
    /// # Panics
    /// If there are not as many layers as are wanted.
    pub fn add_orders(
        &mut self,
        x: u32,
        y: u32,
        sample: &PixelSample,
        layers: &[Spectrum],
    ) -> Outcome<()> {
        assert_eq!(layers.len(), self.orders(), "layers of scattering orders");
        let ctx = self.table.ctx;
        // SAFETY: as above; the table reaches this function, since it wants layers, of which there are enough.
        found(unsafe { (self.table.add_orders)(ctx, x, y, sample, layers.as_ptr()) }).map(|_| ())
    }

    /// As [`Output::splat`], for light that was scattered `order` times. Takes its place if [`Output::orders`] is not 0.
    ///
    /// # Panics
    /// If no layers are wanted.
    pub fn splat_order(&mut self, film: [f32; 2], radiance: Spectrum, order: u32) -> Outcome<()> {
        assert_ne!(self.orders(), 0, "layers of scattering orders");
        let ctx = self.table.ctx;
        // SAFETY: as above; the table reaches this function, since it wants layers.
        found(unsafe { (self.table.splat_order)(ctx, &film, &radiance, order) }).map(|_| ())
    }
}
