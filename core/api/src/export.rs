//! From the safe traits to the C tables: trampolines, panic containment and the one export macro.
//!
//! A plugin crate (crate-type `cdylib`) writes `export_plugin!(medium, MyMedium);` and implements [`Plugin`] and the trait of
//! its kind. Everything unsafe happens here.

mod instance;
mod shims;

pub use shims::{BsdfShim, IntegratorShim, MediumShim, PhaseShim, ScatterShim};

use crate::abi::{ABI_MAJOR, ABI_MINOR, MAGIC, ParamDecl, PluginHeader, PluginKind, Text};
use crate::params::{Error, Params};
use core::ffi::c_void;

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
