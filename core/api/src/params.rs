//! Parameters: declared in the plugin, checked by the host, read here.

use crate::abi::{
    BsdfTable, CreateArgs, HostTable, ParamDecl, ParamKind, ParamValue, PluginKind, Task, Text,
    param_flags,
};
use crate::math::{Affine, DVec3};
use crate::nested::NestedBsdf;
use crate::spectrum::Spectrum;
use core::ffi::c_void;

/// Why an instance could not be made, in one sentence; the host adds the plugin and the place in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Error(pub String);

impl Error {
    /// An error with this message.
    pub fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }
}

impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(&self.0)
    }
}

impl core::error::Error for Error {}

/// Builds declarations in constants: `Decl::float("g", "mean cosine").default("0").between(-1.0, 1.0).build()`.
#[derive(Clone, Copy)]
pub struct Decl(ParamDecl);

impl Decl {
    const fn new(name: &'static str, kind: ParamKind, help: &'static str) -> Self {
        Self(ParamDecl {
            name: Text::new(name),
            unit: Text::new(""),
            help: Text::new(help),
            default: Text::new(""),
            choices: Text::new(""),
            min: 0.0,
            max: 0.0,
            kind: kind as u32,
            flags: 0,
        })
    }

    /// `true` or `false`.
    pub const fn bool(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Bool, help)
    }
    /// A whole number.
    pub const fn int(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Int, help)
    }
    /// A number.
    pub const fn float(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Float, help)
    }
    /// One number or RGB.
    pub const fn spectrum(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Spectrum, help)
    }
    /// Three numbers.
    pub const fn vec3(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Vec3, help)
    }
    /// Any count of numbers.
    pub const fn numbers(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Numbers, help)
    }
    /// Text.
    pub const fn text(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::Text, help)
    }
    /// A path to a file.
    pub const fn file(name: &'static str, help: &'static str) -> Self {
        Self::new(name, ParamKind::File, help)
    }
    /// One of some words, given as `"a|b|c"`.
    pub const fn choice(name: &'static str, choices: &'static str, help: &'static str) -> Self {
        let mut d = Self::new(name, ParamKind::Choice, help);
        d.0.choices = Text::new(choices);
        d
    }
    /// A nested plugin of a kind ("phase", "bsdf").
    pub const fn plugin(name: &'static str, kind: &'static str, help: &'static str) -> Self {
        let mut d = Self::new(name, ParamKind::Plugin, help);
        d.0.choices = Text::new(kind);
        d
    }
    /// Must be given.
    pub const fn required(mut self) -> Self {
        self.0.flags |= param_flags::REQUIRED;
        self
    }
    /// Default, as JSON.
    pub const fn default(mut self, json: &'static str) -> Self {
        self.0.default = Text::new(json);
        self
    }
    /// Unit.
    pub const fn unit(mut self, unit: &'static str) -> Self {
        self.0.unit = Text::new(unit);
        self
    }
    /// ≥ `min`.
    pub const fn at_least(mut self, min: f64) -> Self {
        self.0.min = min;
        self.0.flags |= param_flags::MIN;
        self
    }
    /// ≤ `max`.
    pub const fn at_most(mut self, max: f64) -> Self {
        self.0.max = max;
        self.0.flags |= param_flags::MAX;
        self
    }
    /// > `min`.
    pub const fn above(mut self, min: f64) -> Self {
        self = self.at_least(min);
        self.0.flags |= param_flags::ABOVE_MIN;
        self
    }
    /// < `max`.
    pub const fn below(mut self, max: f64) -> Self {
        self = self.at_most(max);
        self.0.flags |= param_flags::BELOW_MAX;
        self
    }
    /// It may also be a texture, see [`crate::texture`]; for numbers and spectra of BSDFs. Use
    /// [`Params::textured_float`] or [`Params::textured_spectrum`].
    pub const fn texturable(mut self) -> Self {
        self.0.flags |= param_flags::TEXTURABLE;
        self
    }
    /// The declaration.
    pub const fn build(self) -> ParamDecl {
        self.0
    }
}

/// The parameters of an instance and the services it may use while it is made.
#[derive(Clone, Copy)]
pub struct Params<'a> {
    args: &'a CreateArgs,
}

impl<'a> Params<'a> {
    /// A view of what the host passed.
    ///
    /// # Safety
    /// `args` and everything it points to must be valid for `'a`, as the ABI promises for the duration of `create`.
    pub unsafe fn new(args: &'a CreateArgs) -> Self {
        Self { args }
    }

    pub(crate) fn host_table(&self) -> *const HostTable {
        self.args.host
    }

    pub(crate) fn find(&self, name: &str, kind: ParamKind) -> Option<&'a ParamValue> {
        if self.args.params.is_null() {
            return None;
        }
        // SAFETY: pointer and count come from the host under the contract of `new`.
        let all = unsafe {
            core::slice::from_raw_parts(self.args.params, self.args.param_count as usize)
        };
        // SAFETY: names are valid for the call.
        all.iter()
            .find(|p| p.kind == kind as u32 && unsafe { p.name.to_owned() } == name)
    }

    fn numbers_of(&self, name: &str, kind: ParamKind) -> Option<&'a [f64]> {
        let p = self.find(name, kind)?;
        if p.numbers.is_null() {
            return Some(&[]);
        }
        // SAFETY: pointer and count come from the host under the contract of `new`.
        Some(unsafe { core::slice::from_raw_parts(p.numbers, p.count as usize) })
    }

    fn one(&self, name: &str, kind: ParamKind) -> Result<f64, Error> {
        self.numbers_of(name, kind)
            .and_then(|n| n.first().copied())
            .ok_or_else(|| Error(format!("the parameter '{name}' has no value")))
    }

    /// A number.
    pub fn float(&self, name: &str) -> Result<f64, Error> {
        self.one(name, ParamKind::Float)
    }

    /// A whole number.
    pub fn int(&self, name: &str) -> Result<i64, Error> {
        Ok(self.one(name, ParamKind::Int)? as i64)
    }

    /// `true` or `false`.
    pub fn bool(&self, name: &str) -> Result<bool, Error> {
        Ok(self.one(name, ParamKind::Bool)? != 0.0)
    }

    /// A spectrum, if given.
    pub fn spectrum(&self, name: &str) -> Option<Spectrum> {
        match self.numbers_of(name, ParamKind::Spectrum)? {
            [r, g, b] => Some(Spectrum::rgb(*r as f32, *g as f32, *b as f32)),
            _ => None,
        }
    }

    /// A vector, if given.
    pub fn vec3(&self, name: &str) -> Option<DVec3> {
        match self.numbers_of(name, ParamKind::Vec3)? {
            [x, y, z] => Some(DVec3::new(*x, *y, *z)),
            _ => None,
        }
    }

    /// Numbers, if given.
    pub fn numbers(&self, name: &str) -> Option<&'a [f64]> {
        self.numbers_of(name, ParamKind::Numbers)
    }

    /// Text, the word of a choice, or a path, if given.
    pub fn text(&self, name: &str) -> Option<String> {
        [ParamKind::Text, ParamKind::Choice, ParamKind::File]
            .into_iter()
            .find_map(|k| self.find(name, k))
            // SAFETY: texts are valid for the call.
            .map(|p| unsafe { p.text.to_owned() })
    }

    /// A nested BSDF, if given.
    ///
    /// # Errors
    /// If the nested plugin is of another kind.
    pub fn bsdf(&self, name: &str) -> Result<Option<NestedBsdf>, Error> {
        let Some(p) = self.find(name, ParamKind::Plugin) else {
            return Ok(None);
        };
        // SAFETY: the host passes a header that it has checked, or null; headers and tables are statics of libraries that stay.
        let Some(header) = (unsafe { p.header.as_ref() }) else {
            return Ok(None);
        };
        if header.kind != PluginKind::Bsdf as u32 || p.instance.is_null() {
            return Err(Error(format!("the parameter '{name}' is no BSDF")));
        }
        // SAFETY: the kind says what the table is; the host keeps the instance alive as long as the one being made.
        Ok(Some(unsafe {
            NestedBsdf::new(&*header.table.cast::<BsdfTable>(), p.instance)
        }))
    }

    /// Object to world.
    pub fn to_world(&self) -> Affine {
        Affine::from_rows(self.args.to_world)
    }

    /// Lanes in use.
    pub fn lanes(&self) -> u32 {
        self.args.lanes
    }

    /// Minor version of the ABI that the host was built with: what came with later ones is not there.
    pub fn host_minor(&self) -> u32 {
        // SAFETY: the host's table is valid for the life of the process.
        unsafe { (*self.args.host).abi_minor }
    }

    /// The host's services.
    pub fn host(&self) -> Host {
        Host {
            table: self.args.host,
        }
    }
}

/// Services of the host.
#[derive(Clone, Copy)]
pub struct Host {
    table: *const HostTable,
}

// SAFETY: the table lives as long as the process and its functions may be called from any thread.
unsafe impl Send for Host {}
// SAFETY: as above.
unsafe impl Sync for Host {}

impl Host {
    /// # Safety
    /// `table` must be the host's table.
    pub(crate) unsafe fn new(table: *const HostTable) -> Self {
        Self { table }
    }

    /// Warns the user.
    pub fn warn(&self, message: &str) {
        // SAFETY: the host's table is valid for the life of the process.
        unsafe { ((*self.table).log)((*self.table).ctx, 0, Text::new(message)) }
    }

    /// Records why the call in progress fails.
    pub fn fail(&self, message: &str) {
        // SAFETY: as above.
        unsafe { ((*self.table).fail)((*self.table).ctx, Text::new(message)) }
    }

    /// Runs `task(i)` for all i below `count` on the host's threads. A plugin must not bring a thread pool of its own.
    ///
    /// # Panics
    /// If a task panics, after all of them have ended.
    pub fn parallel_for<F: Fn(usize) + Sync>(&self, count: usize, task: F) {
        struct Shared<F> {
            task: F,
            panic: std::sync::Mutex<Option<String>>,
        }
        impl<F> Shared<F> {
            fn lock(&self) -> std::sync::MutexGuard<'_, Option<String>> {
                self.panic.lock().unwrap_or_else(|e| e.into_inner())
            }
        }
        unsafe extern "C" fn run<F: Fn(usize) + Sync>(data: *const c_void, index: usize) {
            // SAFETY: `data` is the `Shared` below, alive until `parallel_for` returns.
            let shared = unsafe { &*data.cast::<Shared<F>>() };
            let call = std::panic::AssertUnwindSafe(|| (shared.task)(index));
            if let Err(payload) = std::panic::catch_unwind(call) {
                let text = crate::panics::panic_text(payload);
                shared.lock().get_or_insert(text);
            }
        }
        let shared = Shared {
            task,
            panic: None.into(),
        };
        // SAFETY: the host calls `run` only before it returns, and `Shared<F>` may be used from any thread (`F: Sync`).
        unsafe {
            let t = &*self.table;
            (t.parallel_for)(t.ctx, count, run::<F> as Task, (&raw const shared).cast());
        }
        if let Some(text) = shared.lock().take() {
            std::panic::resume_unwind(Box::new(crate::panics::TaskPanic(text)));
        }
    }
}
