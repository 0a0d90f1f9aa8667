//! Instances behind the shapes of the ordinary traits, with every answer checked.

use super::host::{pending_failure, take_failure};
use super::instance::Instance;
use crate::error::{Error, Result};
use resolvent_api::abi::*;
use resolvent_api::medium::{MediumInfo, medium_traits};
use resolvent_api::operator::{Coefficients, Flight, FlightDraws, Segment};
use resolvent_api::phase::MediumPoint;
use resolvent_api::surface::{SurfacePoint, bsdf_traits};
use resolvent_api::{Closure, Event, PluginKind, Scatter, Spectrum, Vec3};
use std::ffi::c_void;
use std::sync::Arc;

/// A call to a plugin failed: what it said, to be completed with who said it.
pub struct Failure(pub String);

/// The outcome of a call to a plugin.
pub type Call<T> = std::result::Result<T, Failure>;

#[cold]
fn failure(status: Status) -> Failure {
    let why = take_failure();
    Failure(match status {
        Status::PANIC | Status::ERROR => why,
        other => format!("returned the unknown status {}", other.0),
    })
}

#[inline(always)]
fn check(status: Status) -> Call<()> {
    if status == Status::OK {
        Ok(())
    } else {
        Err(failure(status))
    }
}

fn expect(instance: &Instance, kind: PluginKind) -> Result<()> {
    if instance.plugin.kind == kind {
        return Ok(());
    }
    Err(Error::Plugin(format!(
        "{} is no {}",
        instance.plugin.title(),
        kind.name()
    )))
}

/// A medium.
pub struct ForeignMedium {
    /// The instance.
    pub instance: Arc<Instance>,
    /// What it said about itself.
    pub info: MediumInfo,
    /// Its phase functions; isotropic scattering if it has none.
    pub phases: Vec<ForeignPhase>,
    /// Index of the last phase function a flight may name.
    last_phase: u32,
    table: &'static MediumTable,
    pointer: *const c_void,
}

// SAFETY: the pointer is the instance's, which may be used from any thread.
unsafe impl Send for ForeignMedium {}
// SAFETY: as above.
unsafe impl Sync for ForeignMedium {}

impl ForeignMedium {
    /// Wraps an instance of a medium plugin.
    ///
    /// # Errors
    /// If it is no medium, or what it says about itself is impossible.
    pub fn new(instance: Instance) -> Result<Self> {
        expect(&instance, PluginKind::Medium)?;
        // SAFETY: the kind was checked.
        let table = unsafe { instance.table::<MediumTable>() };
        let pointer = instance.pointer.cast_const();
        let mut info = MediumInfo::default();
        // SAFETY: a live instance of this table's plugin.
        check(unsafe { (table.info)(pointer, &mut info) }).map_err(|f| instance.error(&f.0))?;
        let sound = info.sigma_max.is_finite()
            && info.sigma_max.0.iter().all(|s| *s >= 0.0)
            && info
                .bounds
                .min
                .iter()
                .chain(&info.bounds.max)
                .all(|v| !v.is_nan());
        if !sound {
            return Err(instance.error(&format!(
                "claims impossible bounds or extinction: {:?}, largest extinction {:?}",
                info.bounds, info.sigma_max.0
            )));
        }
        if info.bounds.is_empty() {
            info.traits |= medium_traits::EMPTY;
        }
        let phases = instance
            .nested
            .iter()
            .filter(|(_, n)| n.plugin.kind == PluginKind::Phase)
            .map(|(_, n)| ForeignPhase::new(n.clone()))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            instance: Arc::new(instance),
            info,
            last_phase: phases.len().saturating_sub(1) as u32,
            phases,
            table,
            pointer,
        })
    }

    /// See [`resolvent_api::Medium::sample`].
    #[inline(always)]
    pub fn sample(&self, s: &Segment, u: &FlightDraws) -> Call<Flight> {
        self.fly(self.table.sample, s, u)
    }

    /// See [`resolvent_api::Medium::transmit`].
    #[inline(always)]
    pub fn transmit(&self, s: &Segment, u: &FlightDraws) -> Call<Flight> {
        self.fly(self.table.transmit, s, u)
    }

    #[inline(always)]
    fn fly(
        &self,
        f: unsafe extern "C" fn(
            *const c_void,
            *const Segment,
            *const FlightDraws,
            *mut Flight,
        ) -> Status,
        s: &Segment,
        u: &FlightDraws,
    ) -> Call<Flight> {
        let mut out = std::mem::MaybeUninit::<Flight>::uninit();
        // SAFETY: a live instance of this table's plugin.
        let status = unsafe { f(self.pointer, s, u, out.as_mut_ptr()) };
        check(status).map_err(|f| on(s, f))?;
        // SAFETY: a call that returns OK has written its result; every bit pattern of a `Flight` is valid.
        let flight = unsafe { out.assume_init() };
        // One sum finds a NaN in any of them.
        let sum = flight.value + flight.track + flight.emitted + flight.sigma_t + flight.sigma_s;
        let good = sum.is_finite()
            && flight.t >= s.t0
            && flight.t <= s.t1
            && !flight.ratio.0.iter().any(|r| r.is_nan())
            && flight.event <= Event::Collided as u32
            && flight.phase <= self.last_phase;
        if good {
            Ok(flight)
        } else {
            Err(bad_flight(s, &flight))
        }
    }

    /// See [`resolvent_api::Medium::depth`].
    #[inline(always)]
    pub fn depth(&self, s: &Segment) -> Call<Spectrum> {
        let mut out = Spectrum::ZERO;
        // SAFETY: a live instance of this table's plugin.
        check(unsafe { (self.table.depth)(self.pointer, s, &mut out) })?;
        if out.0.iter().any(|v| v.is_nan()) {
            return Err(Failure(format!("depth of {s:?} is NaN")));
        }
        Ok(out)
    }

    /// See [`resolvent_api::Medium::coefficients`].
    pub fn coefficients(&self, p: Vec3) -> Call<Coefficients> {
        let mut out = Coefficients::default();
        // SAFETY: a live instance of this table's plugin.
        check(unsafe { (self.table.coefficients)(self.pointer, &p.to_array(), &mut out) })?;
        Ok(out)
    }
}

/// What was asked when it failed.
#[cold]
fn on(s: &Segment, f: Failure) -> Failure {
    Failure(format!("{}, on {s:?}", f.0))
}

#[cold]
fn bad_flight(s: &Segment, f: &Flight) -> Failure {
    Failure(format!(
        "gave an impossible flight (not finite, beyond its segment, or of an unknown event or phase function): {f:?} on {s:?}"
    ))
}

/// A phase function.
pub struct ForeignPhase {
    instance: Arc<Instance>,
    table: &'static PhaseTable,
}

impl ForeignPhase {
    /// Wraps an instance of a phase function plugin.
    ///
    /// # Errors
    /// If it is none.
    pub fn new(instance: Arc<Instance>) -> Result<Self> {
        expect(&instance, PluginKind::Phase)?;
        // SAFETY: the kind was checked.
        let table = unsafe { instance.table::<PhaseTable>() };
        Ok(Self { instance, table })
    }

    /// Writes the closure at a point into `out`.
    #[inline(always)]
    pub fn closure(&self, at: &MediumPoint, out: &mut Closure) -> Call<()> {
        // SAFETY: a live instance of this table's plugin.
        check(unsafe { (self.table.closure)(self.instance.pointer, at, out) })
    }

    /// As errors name it.
    pub fn title(&self) -> String {
        self.instance.plugin.title()
    }
}

/// A BSDF.
pub struct ForeignBsdf {
    instance: Arc<Instance>,
    table: &'static BsdfTable,
    traits: u32,
    ior: f32,
}

impl ForeignBsdf {
    /// Wraps an instance of a BSDF plugin.
    ///
    /// # Errors
    /// If it is none.
    pub fn new(instance: Arc<Instance>) -> Result<Self> {
        expect(&instance, PluginKind::Bsdf)?;
        // SAFETY: the kind was checked.
        let table = unsafe { instance.table::<BsdfTable>() };
        // SAFETY: a live instance of this table's plugin.
        let traits = unsafe { (table.traits)(instance.pointer) };
        let ior = match table.ior {
            // SAFETY: as above.
            Some(ior) => unsafe { ior(instance.pointer) },
            None => 1.0,
        };
        if let Some(why) = pending_failure() {
            return Err(instance.error(&why));
        }
        if !(ior > 0.0 && ior.is_finite()) {
            return Err(instance.error(&format!("claims the impossible index of refraction {ior}")));
        }
        Ok(Self {
            instance,
            table,
            traits,
            ior,
        })
    }

    /// Index of refraction inside, see [`resolvent_api::Bsdf::ior`].
    pub fn ior(&self) -> f32 {
        self.ior
    }

    /// True if it bends light that comes from twice as dense a medium: also a boundary whose inside is vacuum does.
    pub fn refracts(&self) -> bool {
        if self.ior != 1.0 {
            return true;
        }
        let mut closure = Closure::EMPTY;
        let at = SurfacePoint {
            outside_ior: 2.0,
            ..SurfacePoint::default()
        };
        // One that fails here fails at its vertices, where it can say so.
        self.closure(&at, &mut closure).is_ok() && closure.eta() != 1.0
    }

    /// True if light passes unchanged.
    pub fn is_null(&self) -> bool {
        self.traits & bsdf_traits::NULL != 0
    }

    /// True if lobes have normals of their own, for which it asks for [`SurfacePoint::tangent`].
    #[inline(always)]
    pub fn has_own_normals(&self) -> bool {
        self.traits & bsdf_traits::OWN_NORMALS != 0
    }

    /// Writes the closure at a point into `out`.
    #[inline(always)]
    pub fn closure(&self, at: &SurfacePoint, out: &mut Closure) -> Call<()> {
        // SAFETY: a live instance of this table's plugin.
        check(unsafe { (self.table.closure)(self.instance.pointer, at, out) })
    }

    /// As errors name it.
    pub fn title(&self) -> String {
        self.instance.plugin.title()
    }
}

/// An integrator.
pub struct ForeignIntegrator {
    instance: Instance,
    table: &'static IntegratorTable,
}

impl ForeignIntegrator {
    /// Wraps an instance of an integrator plugin.
    ///
    /// # Errors
    /// If it is none.
    pub fn new(instance: Instance) -> Result<Self> {
        expect(&instance, PluginKind::Integrator)?;
        // SAFETY: the kind was checked.
        let table = unsafe { instance.table::<IntegratorTable>() };
        Ok(Self { instance, table })
    }

    /// Renders a piece of work.
    pub fn render(&self, scene: &SceneTable, tile: &Tile, out: &OutputTable) -> Call<()> {
        // SAFETY: a live instance of this table's plugin; the tables live for the call.
        check(unsafe { (self.table.render)(self.instance.pointer, scene, tile, out) })?;
        // A closure may panic where it has no status to say so: that must not pass unseen.
        pending_failure().map_or(Ok(()), |why| Err(Failure(why)))
    }

    /// As errors name it.
    pub fn title(&self) -> String {
        self.instance.plugin.title()
    }
}
