//! From the safe traits to the C tables: trampolines, panic containment and the one export macro.
//!
//! A plugin crate (crate-type `cdylib`) writes `export_plugin!(medium, MyMedium);` and implements [`Plugin`] and the trait of
//! its kind. Everything unsafe happens here.

use crate::abi::*;
use crate::closure::Closure;
use crate::integrator::{Integrator, Output, SceneView};
use crate::math::{Float3, Vec3};
use crate::medium::{Medium, MediumInfo};
use crate::operator::*;
use crate::params::{Error, Host, Params};
use crate::phase::{MediumPoint, PhaseFunction};
use crate::spectrum::Spectrum;
use crate::surface::{Bsdf, SurfacePoint};
use core::ffi::c_void;
use core::marker::PhantomData;
use core::sync::atomic::{AtomicPtr, Ordering};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What every plugin declares.
pub trait Plugin: Sized + Send + Sync + 'static {
    /// Name, as in scenes.
    const NAME: &'static str;
    /// One sentence.
    const SUMMARY: &'static str;
    /// Parameters.
    const PARAMS: &'static [ParamDecl];
    /// Makes an instance. The values were checked against the declarations, defaults are filled in.
    ///
    /// # Errors
    /// Whatever the declarations can't express (a missing grid, parameters that exclude each other).
    fn create(params: &Params<'_>) -> Result<Self, Error>;
}

/// An instance with the way to its host.
struct Instance<T> {
    value: T,
    host: Host,
}

std::thread_local! {
    static PANIC_PLACE: core::cell::RefCell<String> = const { core::cell::RefCell::new(String::new()) };
}

/// Keeps the place of a panic for the message instead of printing it: the host says it once, with the plugin's name.
/// A shared library has its own copy of the standard library, so this hook is the plugin's alone.
fn install_hook() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        std::panic::set_hook(Box::new(|info| {
            let place = info
                .location()
                .map(|l| format!(" at {l}"))
                .unwrap_or_default();
            PANIC_PLACE.with(|p| *p.borrow_mut() = place);
        }));
    });
}

/// A panic in a task of [`Host::parallel_for`], passed on with the words of [`panic_text`].
pub(crate) struct TaskPanic(pub String);

/// The words for a caught panic. The payload is leaked: a destructor of it could panic again, outside of any guard.
pub(crate) fn panic_text(payload: Box<dyn std::any::Any + Send>) -> String {
    let payload = Box::leak(payload);
    if let Some(task) = payload.downcast_ref::<TaskPanic>() {
        return format!("{} (in a parallel task)", task.0);
    }
    let text = payload
        .downcast_ref::<&str>()
        .map(|s| s.to_string())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "(no message)".into());
    let place = PANIC_PLACE.with(|p| core::mem::take(&mut *p.borrow_mut()));
    format!("panicked{place}: {text}")
}

/// Runs `f`, turning a panic into [`Status::PANIC`] with a message to the host.
#[inline(always)]
fn guarded(host: Host, f: impl FnOnce() -> Status) -> Status {
    match catch_unwind(AssertUnwindSafe(f)) {
        Ok(status) => status,
        Err(payload) => {
            host.fail(&panic_text(payload));
            Status::PANIC
        }
    }
}

unsafe extern "C" fn create<T: Plugin>(args: *const CreateArgs) -> *mut c_void {
    install_hook();
    // SAFETY: the host passes valid arguments for the duration of the call.
    let args = unsafe { &*args };
    HOST.store(args.host.cast_mut(), Ordering::Relaxed);
    NAME.get_or_init(|| T::NAME);
    // SAFETY: as above; the host's table outlives the instance.
    let (params, host) = unsafe { (Params::new(args), Host::new(args.host)) };
    match catch_unwind(AssertUnwindSafe(|| T::create(&params))) {
        Ok(Ok(value)) => Box::into_raw(Box::new(Instance { value, host })).cast(),
        Ok(Err(e)) => {
            host.fail(&e.0);
            core::ptr::null_mut()
        }
        Err(payload) => {
            host.fail(&panic_text(payload));
            core::ptr::null_mut()
        }
    }
}

unsafe extern "C" fn destroy<T: Plugin>(instance: *mut c_void) {
    // SAFETY: `instance` came from `create::<T>` and is passed here once.
    let instance = unsafe { Box::from_raw(instance.cast::<Instance<T>>()) };
    let host = instance.host;
    guarded(host, || {
        drop(instance);
        Status::OK
    });
}

/// # Safety
/// `p` came from `create::<T>` and was not destroyed.
#[inline(always)]
unsafe fn instance<'a, T>(p: *const c_void) -> &'a Instance<T> {
    // SAFETY: by contract.
    unsafe { &*p.cast::<Instance<T>>() }
}

/// The host's table, for closures: they are plain data and carry no way to the host. A library holds one plugin and is loaded
/// by one program, so one place is enough.
static HOST: AtomicPtr<HostTable> = AtomicPtr::new(core::ptr::null_mut());

/// The plugin's name, for the same.
static NAME: std::sync::OnceLock<&'static str> = std::sync::OnceLock::new();

/// Reports a panic in a closure.
#[cold]
fn closure_panicked(payload: Box<dyn std::any::Any + Send>) -> Status {
    let name = NAME.get().copied().unwrap_or_default();
    let text = format!("a closure of '{name}' {}", panic_text(payload));
    let table = HOST.load(Ordering::Relaxed);
    if !table.is_null() {
        // SAFETY: the table came with `create` and lives as long as the process.
        unsafe { Host::new(table) }.fail(&text);
    }
    Status::PANIC
}

/// The table of a closure type.
pub struct ScatterShim<C>(PhantomData<C>);

impl<C: Scatter + Copy + Send + Sync + 'static> ScatterShim<C> {
    /// The table.
    pub const TABLE: ScatterTable = ScatterTable {
        size: size_of::<ScatterTable>() as u32,
        data_size: size_of::<C>() as u32,
        eval: Self::eval,
        sample: Self::sample,
        lobes: Self::lobes,
        eta: Some(Self::eta),
    };

    unsafe extern "C" fn eval(
        data: *const c_void,
        wo: *const Float3,
        wi: *const Float3,
        mode: u32,
        out: *mut ScatterEval,
    ) -> Status {
        // SAFETY: the host passes the closure's data and valid pointers.
        let (closure, wo, wi) = unsafe { (&*data.cast::<C>(), Vec3::from(*wo), Vec3::from(*wi)) };
        match catch_unwind(AssertUnwindSafe(|| {
            closure.eval(wo, wi, Mode::from_u32(mode))
        })) {
            Ok(e) => {
                // SAFETY: `out` is valid for writing.
                unsafe { *out = e };
                Status::OK
            }
            Err(payload) => closure_panicked(payload),
        }
    }

    unsafe extern "C" fn sample(
        data: *const c_void,
        wo: *const Float3,
        u: *const ScatterDraws,
        mode: u32,
        out: *mut ScatterSample,
    ) -> Status {
        // SAFETY: as above.
        let (closure, wo, u) = unsafe { (&*data.cast::<C>(), Vec3::from(*wo), *u) };
        match catch_unwind(AssertUnwindSafe(|| {
            closure.sample(wo, u, Mode::from_u32(mode))
        })) {
            Ok(Some(s)) => {
                // SAFETY: `out` is valid for writing.
                unsafe { *out = s };
                Status::OK
            }
            Ok(None) => Status::NONE,
            Err(payload) => closure_panicked(payload),
        }
    }

    unsafe extern "C" fn lobes(data: *const c_void) -> u32 {
        // SAFETY: as above.
        let closure = unsafe { &*data.cast::<C>() };
        catch_unwind(AssertUnwindSafe(|| closure.lobes())).unwrap_or_else(|payload| {
            closure_panicked(payload);
            0
        })
    }

    unsafe extern "C" fn eta(data: *const c_void) -> f32 {
        // SAFETY: as above.
        let closure = unsafe { &*data.cast::<C>() };
        catch_unwind(AssertUnwindSafe(|| closure.eta())).unwrap_or_else(|payload| {
            closure_panicked(payload);
            1.0
        })
    }
}

/// The table of a medium.
pub struct MediumShim<T>(PhantomData<T>);

impl<T: Plugin + Medium> MediumShim<T> {
    /// The table.
    pub const TABLE: MediumTable = MediumTable {
        size: size_of::<MediumTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        info: Self::info,
        sample: Self::sample,
        transmit: Self::transmit,
        depth: Self::depth,
        coefficients: Self::coefficients,
    };

    unsafe extern "C" fn info(p: *const c_void, out: *mut MediumInfo) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI; the same below.
        let i = unsafe { instance::<T>(p) };
        guarded(i.host, || {
            // SAFETY: `out` is valid for writing.
            unsafe { *out = i.value.info() };
            Status::OK
        })
    }

    unsafe extern "C" fn sample(
        p: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status {
        // SAFETY: as above.
        let (i, s, u) = unsafe { (instance::<T>(p), &*s, &*u) };
        guarded(i.host, || {
            // SAFETY: `out` is valid for writing.
            unsafe { *out = i.value.sample(s, u) };
            Status::OK
        })
    }

    unsafe extern "C" fn transmit(
        p: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status {
        // SAFETY: as above.
        let (i, s, u) = unsafe { (instance::<T>(p), &*s, &*u) };
        guarded(i.host, || {
            // SAFETY: `out` is valid for writing.
            unsafe { *out = i.value.transmit(s, u) };
            Status::OK
        })
    }

    unsafe extern "C" fn depth(p: *const c_void, s: *const Segment, out: *mut Spectrum) -> Status {
        // SAFETY: as above.
        let (i, s) = unsafe { (instance::<T>(p), &*s) };
        guarded(i.host, || {
            // SAFETY: `out` is valid for writing.
            unsafe { *out = i.value.depth(s) };
            Status::OK
        })
    }

    unsafe extern "C" fn coefficients(
        p: *const c_void,
        at: *const Float3,
        out: *mut Coefficients,
    ) -> Status {
        // SAFETY: as above.
        let (i, at) = unsafe { (instance::<T>(p), Vec3::from(*at)) };
        guarded(i.host, || {
            // SAFETY: `out` is valid for writing.
            unsafe { *out = i.value.coefficients(at) };
            Status::OK
        })
    }
}

/// The table of a phase function.
pub struct PhaseShim<T>(PhantomData<T>);

impl<T: Plugin + PhaseFunction> PhaseShim<T> {
    /// Functions are the same for every lifetime of the closure, so those of the longest stand for all. The borrow is kept by
    /// the ABI instead: see [`PhaseTable::closure`].
    const SCATTER: &'static ScatterTable = &ScatterShim::<T::Closure<'static>>::TABLE;

    /// The table.
    pub const TABLE: PhaseTable = PhaseTable {
        size: size_of::<PhaseTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        closure: Self::closure,
    };

    unsafe extern "C" fn closure(
        p: *const c_void,
        at: *const MediumPoint,
        out: *mut Closure,
    ) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI.
        let (i, at) = unsafe { (instance::<T>(p), &*at) };
        guarded(i.host, || {
            // SAFETY: the table is the one made for this closure type; `out` is valid for writing.
            unsafe { Closure::store(out, Self::SCATTER, i.value.closure(at)) };
            Status::OK
        })
    }
}

/// The table of a BSDF.
pub struct BsdfShim<T>(PhantomData<T>);

impl<T: Plugin + Bsdf> BsdfShim<T> {
    const SCATTER: &'static ScatterTable = &ScatterShim::<T::Closure>::TABLE;

    /// The table.
    pub const TABLE: BsdfTable = BsdfTable {
        size: size_of::<BsdfTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        traits: Self::traits,
        closure: Self::closure,
        ior: Some(Self::ior),
    };

    unsafe extern "C" fn traits(p: *const c_void) -> u32 {
        // SAFETY: a live instance, by the ABI.
        let i = unsafe { instance::<T>(p) };
        catch_unwind(AssertUnwindSafe(|| i.value.traits())).unwrap_or_else(|payload| {
            // There is no status here: the host looks for a report after the call.
            i.host.fail(&panic_text(payload));
            0
        })
    }

    unsafe extern "C" fn ior(p: *const c_void) -> f32 {
        // SAFETY: a live instance, by the ABI.
        let i = unsafe { instance::<T>(p) };
        catch_unwind(AssertUnwindSafe(|| i.value.ior())).unwrap_or_else(|payload| {
            i.host.fail(&panic_text(payload));
            1.0
        })
    }

    unsafe extern "C" fn closure(
        p: *const c_void,
        at: *const SurfacePoint,
        out: *mut Closure,
    ) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI.
        let (i, at) = unsafe { (instance::<T>(p), &*at) };
        guarded(i.host, || {
            // SAFETY: the table is the one made for this closure type; `out` is valid for writing.
            unsafe { Closure::store(out, Self::SCATTER, i.value.closure(at)) };
            Status::OK
        })
    }
}

/// The table of an integrator.
pub struct IntegratorShim<T>(PhantomData<T>);

impl<T: Plugin + Integrator> IntegratorShim<T> {
    /// The table.
    pub const TABLE: IntegratorTable = IntegratorTable {
        size: size_of::<IntegratorTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        render: Self::render,
    };

    unsafe extern "C" fn render(
        p: *const c_void,
        scene: *const SceneTable,
        tile: *const Tile,
        out: *const OutputTable,
    ) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI.
        let (i, tile) = unsafe { (instance::<T>(p), &*tile) };
        // SAFETY: as above; the host checked that the versions agree, so the tables are complete.
        let (scene, mut out) = unsafe { (SceneView::new(&*scene), Output::new(&*out)) };
        guarded(i.host, || match i.value.render(&scene, tile, &mut out) {
            Ok(()) => Status::OK,
            Err(_) => Status::ERROR,
        })
    }
}

/// The header of plugin `T`; used by [`export_plugin!`](crate::export_plugin).
pub const fn header<T: Plugin>(
    kind: PluginKind,
    version: &'static str,
    table: *const c_void,
) -> PluginHeader {
    PluginHeader {
        magic: MAGIC,
        abi_major: ABI_MAJOR,
        abi_minor: ABI_MINOR,
        size: size_of::<PluginHeader>() as u32,
        kind: kind as u32,
        name: Text::new(T::NAME),
        version: Text::new(version),
        summary: Text::new(T::SUMMARY),
        params: T::PARAMS.as_ptr(),
        param_count: T::PARAMS.len() as u32,
        param_size: size_of::<ParamDecl>() as u32,
        table,
    }
}

/// Exports a type as this library's plugin: `export_plugin!(medium, Fog);` with `medium`, `phase`, `bsdf` or `integrator`.
///
/// The type implements [`Plugin`] and the trait of its kind:
///
/// ```
/// use resolvent_api::phase::MediumPoint;
/// use resolvent_api::*;
///
/// /// Scatters evenly into all directions.
/// #[derive(Clone, Copy)]
/// struct Even;
///
/// impl Plugin for Even {
///     const NAME: &'static str = "even";
///     const SUMMARY: &'static str = "Scatters evenly.";
///     const PARAMS: &'static [ParamDecl] = &[];
///     fn create(_: &Params<'_>) -> Result<Self, Error> {
///         Ok(Self)
///     }
/// }
///
/// impl PhaseFunction for Even {
///     type Closure<'a> = Self;
///     fn closure(&self, _: &MediumPoint) -> Self {
///         *self
///     }
/// }
///
/// impl Scatter for Even {
///     fn eval(&self, _: Vec3, _: Vec3, _: Mode) -> ScatterEval {
///         let p = 1.0 / (4.0 * std::f32::consts::PI);
///         ScatterEval { f: Spectrum::splat(p), forward: p, reverse: p }
///     }
///     fn sample(&self, _: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
///         let p = 1.0 / (4.0 * std::f32::consts::PI);
///         Some(ScatterSample {
///             weight: Spectrum::ONE,
///             wi: math::warp::sphere(u.dir).into(),
///             eta: 1.0,
///             forward: p,
///             reverse: p,
///             ..ScatterSample::default()
///         })
///     }
///     fn lobes(&self) -> u32 {
///         operator::lobes::SMOOTH
///     }
/// }
///
/// export_plugin!(phase, Even);
/// ```
///
/// # What does not compile
///
/// A type that says nothing about itself:
///
/// ```compile_fail,E0277
/// struct Silent;
/// resolvent_api::export_plugin!(phase, Silent);
/// ```
///
/// A plugin exported as another kind than it is:
///
/// ```compile_fail,E0277
/// # use resolvent_api::*;
/// struct Fog;
/// impl Plugin for Fog {
///     const NAME: &'static str = "fog";
///     const SUMMARY: &'static str = "A fog.";
///     const PARAMS: &'static [ParamDecl] = &[];
///     fn create(_: &Params<'_>) -> Result<Self, Error> {
///         Ok(Self)
///     }
/// }
/// // It implements no `Medium`.
/// export_plugin!(medium, Fog);
/// ```
///
/// A kind that there is not:
///
/// ```compile_fail
/// struct Lamp;
/// resolvent_api::export_plugin!(light, Lamp);
/// ```
///
/// State that threads cannot share, which the host's would:
///
/// ```compile_fail,E0277
/// # use resolvent_api::*;
/// struct Counting(std::cell::Cell<u32>);
/// impl Plugin for Counting {
///     const NAME: &'static str = "counting";
///     const SUMMARY: &'static str = "Counts.";
///     const PARAMS: &'static [ParamDecl] = &[];
///     fn create(_: &Params<'_>) -> Result<Self, Error> {
///         Ok(Self(Default::default()))
///     }
/// }
/// ```
///
/// A closure that holds what must be dropped: the host copies closures byte by byte.
///
/// ```compile_fail,E0277
/// # use resolvent_api::*;
/// struct Heavy(Vec<f32>);
/// impl Scatter for Heavy {
///     fn eval(&self, _: Vec3, _: Vec3, _: Mode) -> ScatterEval {
///         ScatterEval::default()
///     }
///     fn sample(&self, _: Vec3, _: ScatterDraws, _: Mode) -> Option<ScatterSample> {
///         None
///     }
///     fn lobes(&self) -> u32 {
///         0
///     }
/// }
/// struct Paint;
/// impl Bsdf for Paint {
///     type Closure = Heavy;
///     fn traits(&self) -> u32 {
///         0
///     }
///     fn closure(&self, _: &SurfacePoint) -> Heavy {
///         Heavy(vec![])
///     }
/// }
/// ```
///
/// A closure that is larger than what a vertex has room for:
///
/// ```compile_fail,E0080
/// # use resolvent_api::*;
/// unsafe {
///     let mut room = Closure::EMPTY;
///     Closure::store(&mut room, std::ptr::null(), [0u64; closure::CLOSURE_BYTES / 8 + 1]);
/// }
/// ```
///
/// A default that is no text of JSON:
///
/// ```compile_fail,E0308
/// # use resolvent_api::*;
/// const G: ParamDecl = Decl::float("g", "mean cosine").default(0.5).build();
/// ```
#[macro_export]
macro_rules! export_plugin {
    (medium, $t:ty) => {
        $crate::export_plugin!(@ $t, Medium, MediumTable, MediumShim);
    };
    (phase, $t:ty) => {
        $crate::export_plugin!(@ $t, Phase, PhaseTable, PhaseShim);
    };
    (bsdf, $t:ty) => {
        $crate::export_plugin!(@ $t, Bsdf, BsdfTable, BsdfShim);
    };
    (integrator, $t:ty) => {
        $crate::export_plugin!(@ $t, Integrator, IntegratorTable, IntegratorShim);
    };
    (@ $t:ty, $kind:ident, $table:ident, $shim:ident) => {
        #[cfg(panic = "abort")]
        compile_error!(
            "a plugin must be built with panic = \"unwind\": a panic would end the whole program instead of the render"
        );
        $crate::__symbol! {
            /// The exported header.
            #[allow(non_upper_case_globals)]
            pub static resolvent_plugin: $crate::abi::PluginHeader = {
                static TABLE: $crate::abi::$table = $crate::export::$shim::<$t>::TABLE;
                $crate::export::header::<$t>(
                    $crate::abi::PluginKind::$kind,
                    env!("CARGO_PKG_VERSION"),
                    (&raw const TABLE).cast(),
                )
            };
        }
    };
}

/// Makes a header the symbol of its library, which only one in a program can be.
#[cfg(not(feature = "linked"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __symbol {
    ($header:item) => {
        #[unsafe(no_mangle)]
        $header
    };
}

/// The header as any other static.
#[cfg(feature = "linked")]
#[doc(hidden)]
#[macro_export]
macro_rules! __symbol {
    ($header:item) => {
        $header
    };
}
