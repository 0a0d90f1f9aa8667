//! Parameters as they cross the boundary, and the host's services.

use super::{PluginHeader, Text};
use crate::surface::SurfacePoint;
use core::ffi::c_void;

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
