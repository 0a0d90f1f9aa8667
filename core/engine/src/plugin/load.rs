//! Opening one shared library: the header is checked before anything else of it is used.

use super::{copy, declare};
use crate::error::{Error, Result};
use resolvent_api::abi::{ABI_MAJOR, MAGIC, PluginHeader, PluginKind, SYMBOL};
use resolvent_scene::PluginDecl;
use std::path::{Path, PathBuf};

/// A loaded plugin. Its library stays mapped until the process ends.
pub struct Plugin {
    /// Where it was found.
    pub path: PathBuf,
    /// What it makes.
    pub kind: PluginKind,
    /// What it declares.
    pub decl: PluginDecl,
    pub(super) header: &'static PluginHeader,
}

/// Size of the header's leading integers, which every ABI version shares.
const LEAD: usize = 24;

impl Plugin {
    /// Loads the library at `path`.
    ///
    /// # Errors
    /// If it is no library, no plugin, or one of another ABI version; the message says which side to update.
    pub fn open(path: &Path) -> Result<Self> {
        Self::map(path, |load| Ok(load(path)))
    }

    /// The same from a copy, so that the file may be overwritten while the plugin is in use.
    ///
    /// # Errors
    /// As [`Plugin::open`].
    pub fn open_copy(path: &Path) -> Result<Self> {
        Self::map(path, |load| copy::with(path, load))
    }

    /// Loads the library from the file that `with` calls its argument with.
    fn map(
        path: &Path,
        with: impl FnOnce(fn(&Path) -> Mapped) -> std::io::Result<Mapped>,
    ) -> Result<Self> {
        let fail = |why: String| Error::Plugin(format!("{}: {why}", path.display()));
        match std::fs::metadata(path) {
            Err(e) => return Err(fail(format!("cannot be opened ({e})"))),
            Ok(m) if !m.is_file() => return Err(fail("is no file".into())),
            Ok(_) => {}
        }
        #[cfg(target_os = "linux")]
        super::image::check(path).map_err(|why| {
            fail(format!(
                "is no shared library that can be loaded here: {why}"
            ))
        })?;
        let library = with(load)
            .map_err(|e| fail(format!("cannot be copied ({e})")))?
            .map_err(|why| {
                fail(format!(
                    "is no shared library that can be loaded here ({why})"
                ))
            })?;
        // SAFETY: the symbol is only used as an address here; what it points to is checked field by field.
        let symbol = unsafe { library.get::<*const u8>(SYMBOL.as_bytes()) }.map_err(|_| {
            fail(format!(
                "exports no symbol `{SYMBOL}`: it is no Resolvent plugin"
            ))
        })?;
        // SAFETY: for a static, the symbol's address is that of the value.
        let address = unsafe { symbol.try_as_raw_ptr() }.unwrap_or(std::ptr::null_mut());
        // Never unloaded: instances, closures and thread-locals of the library may outlive any scope here.
        std::mem::forget(library);
        Self::from_header(address.cast(), path)
    }

    /// A plugin that is linked into the program.
    ///
    /// # Errors
    /// As [`Plugin::open`].
    pub(super) fn linked(header: &'static PluginHeader) -> Result<Self> {
        Self::from_header(header, Path::new("(part of the program)"))
    }

    fn from_header(header: *const PluginHeader, path: &Path) -> Result<Self> {
        let fail = |why: String| Error::Plugin(format!("{}: {why}", path.display()));
        if header.is_null() || !(header as usize).is_multiple_of(align_of::<PluginHeader>()) {
            return Err(fail(format!("its symbol `{SYMBOL}` is no plugin header")));
        }
        const { assert!(std::mem::offset_of!(PluginHeader, name) == LEAD) };
        // SAFETY: the leading integers have this place and meaning in every ABI version; a symbol of this name that
        // points to less than 24 readable bytes is no plugin anyone could have meant.
        let (magic, major, minor, size, kind) = unsafe {
            (
                (*header).magic,
                (*header).abi_major,
                (*header).abi_minor,
                (*header).size,
                (*header).kind,
            )
        };
        if magic != MAGIC {
            return Err(fail(format!("its symbol `{SYMBOL}` is no plugin header")));
        }
        if major != ABI_MAJOR {
            let update = if major > ABI_MAJOR {
                "update resolvent, or use an older build of the plugin"
            } else {
                "the plugin must be rebuilt against a newer resolvent-api"
            };
            return Err(fail(format!(
                "was built for plugin ABI {major}.{minor}, this resolvent has ABI {ABI_MAJOR}: {update}"
            )));
        }
        if (size as usize) < size_of::<PluginHeader>() {
            return Err(fail(format!(
                "its header has {size} bytes instead of {}: it was built against a damaged or altered resolvent-api",
                size_of::<PluginHeader>()
            )));
        }
        let Some(kind) = PluginKind::from_u32(kind) else {
            return Err(fail(format!(
                "is of an unknown kind ({kind}): update resolvent"
            )));
        };
        // SAFETY: magic, version and size say that a complete header of this version is there, in a library that stays.
        let header: &'static PluginHeader = unsafe { &*header };
        if header.table.is_null() || !header.table.cast::<usize>().is_aligned() {
            return Err(fail("has no function table".into()));
        }
        let needed = match kind {
            PluginKind::Medium => size_of::<resolvent_api::abi::MediumTable>(),
            PluginKind::Phase => size_of::<resolvent_api::abi::PhaseTable>(),
            PluginKind::Bsdf => size_of::<resolvent_api::abi::BsdfTable>(),
            PluginKind::Integrator => size_of::<resolvent_api::abi::IntegratorTable>(),
        };
        // SAFETY: every table begins with its size.
        let table_size = unsafe { *header.table.cast::<u32>() } as usize;
        if table_size < needed {
            return Err(fail(format!(
                "its function table has {table_size} bytes instead of {needed}"
            )));
        }
        let decl = declare::declaration(header, kind).map_err(fail)?;
        Ok(Self {
            path: path.to_path_buf(),
            kind,
            decl,
            header,
        })
    }

    /// Name, as in scenes.
    pub fn name(&self) -> &str {
        &self.decl.name
    }

    /// As errors name it: `medium plugin 'vdb' (/path/to/library.so)`.
    pub fn title(&self) -> String {
        format!(
            "{} plugin '{}' ({})",
            self.kind.name(),
            self.decl.name,
            self.path.display()
        )
    }
}

/// A library, or why it is none.
type Mapped = std::result::Result<libloading::Library, String>;

fn load(file: &Path) -> Mapped {
    // SAFETY: loading a library runs its initialisers; a plugin is code that the user chose to run.
    unsafe { libloading::Library::new(file) }.map_err(|e| reason(&e, file))
}

/// The system's reason without the path, which the message already has. Other files in it stay: a library that this one needs
/// may be what is missing.
fn reason(e: &libloading::Error, path: &Path) -> String {
    use std::error::Error as _;
    let text = e
        .source()
        .map_or_else(|| e.to_string(), ToString::to_string);
    let own = format!("{}: ", path.display());
    text.strip_prefix(&own).unwrap_or(&text).to_owned()
}
