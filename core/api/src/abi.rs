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

mod params;
mod scattering;
mod scene;

pub use params::{CreateArgs, HostTable, ParamDecl, ParamKind, ParamValue, Task, param_flags};
pub use scattering::{BsdfTable, Create, Destroy, MediumTable, PhaseTable, ScatterTable};
pub use scene::{IntegratorTable, OutputTable, PixelSample, SceneTable, Tile, scene_traits};

use core::ffi::c_void;

/// First bytes of every plugin header.
pub const MAGIC: [u8; 8] = *b"RESOLVNT";
/// Versions must agree exactly.
pub const ABI_MAJOR: u32 = 1;
/// The host accepts plugins of any minor version; it reads only what a table's size says is there.
pub const ABI_MINOR: u32 = 4;
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
