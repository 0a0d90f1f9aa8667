//! Parameters that vary over a surface: a constant, or a texture of the host.
//!
//! A BSDF declares a parameter with [`crate::Decl::texturable`], keeps it as [`Textured`], and asks for its value once
//! per vertex, in [`crate::Bsdf::closure`]. Everything else about textures (files, colour spaces, wrapping,
//! interpolation) is the host's affair. Values arrive linear and clamped to the parameter's declared range.

use crate::abi::{HostTable, ParamKind, ParamValue};
use crate::params::{Error, Params};
use crate::spectrum::Spectrum;
use crate::surface::SurfacePoint;
use core::ffi::c_void;
use core::mem::offset_of;

/// What a texture's four numbers (red, green, blue, alpha) become.
pub trait FromTexel: Copy {
    /// The value of a texel.
    fn from_texel(texel: [f32; 4]) -> Self;
}

impl FromTexel for f32 {
    /// Red.
    #[inline(always)]
    fn from_texel(texel: [f32; 4]) -> Self {
        texel[0]
    }
}

impl FromTexel for Spectrum {
    /// Red, green and blue.
    #[inline(always)]
    fn from_texel([r, g, b, _]: [f32; 4]) -> Self {
        Self::rgb(r, g, b)
    }
}

/// A texture of the host, as one parameter sees it.
#[derive(Clone, Copy, Debug)]
pub struct TextureRef {
    handle: *const c_void,
    host: *const HostTable,
}

// SAFETY: the host keeps the texture as long as the instance it was given to, its table as long as the process, and its
// function may be called from any thread.
unsafe impl Send for TextureRef {}
// SAFETY: as above.
unsafe impl Sync for TextureRef {}

impl TextureRef {
    /// `host` is the host's table, and `value` one of its values of the kind [`ParamKind::Texture`].
    fn new(value: &ParamValue, host: *const HostTable) -> Result<Self, Error> {
        if value.instance.is_null() {
            return Err(Error::new("the host gives a texture that it cannot read"));
        }
        Ok(Self {
            handle: value.instance,
            host,
        })
    }

    /// Red, green, blue and alpha at a point.
    #[inline]
    pub fn texel(&self, at: &SurfacePoint) -> [f32; 4] {
        let mut out = [0.0; 4];
        // SAFETY: handle and table come from the host under the contract of `Params::new`; what a host of an older minor version
        // lacks is not touched.
        unsafe {
            let ctx = (*self.host).ctx;
            if (*self.host).size as usize > offset_of!(HostTable, texture_at) {
                ((*self.host).texture_at)(ctx, self.handle, at, &mut out);
            } else {
                ((*self.host).texture)(ctx, self.handle, &at.uv, &mut out);
            }
        }
        out
    }
}

/// A number or a spectrum that may vary over the surface. Constants cost a branch.
#[derive(Clone, Copy, Debug)]
pub enum Textured<T> {
    /// The same everywhere.
    Constant(T),
    /// Read from a texture.
    Image(TextureRef),
}

/// A number that may vary over the surface.
pub type TexturedFloat = Textured<f32>;
/// A spectrum that may vary over the surface.
pub type TexturedSpectrum = Textured<Spectrum>;

impl<T: FromTexel> Textured<T> {
    /// The value at a point.
    #[inline(always)]
    pub fn at(&self, at: &SurfacePoint) -> T {
        match self {
            Self::Constant(value) => *value,
            Self::Image(texture) => T::from_texel(texture.texel(at)),
        }
    }

    /// The value, if it is the same everywhere.
    pub fn constant(&self) -> Option<T> {
        match self {
            Self::Constant(value) => Some(*value),
            Self::Image(_) => None,
        }
    }

    /// True if it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

impl Params<'_> {
    fn texture(&self, name: &str) -> Result<Option<TextureRef>, Error> {
        let Some(value) = self.find(name, ParamKind::Texture) else {
            return Ok(None);
        };
        TextureRef::new(value, self.host_table()).map(Some)
    }

    /// A number that may be textured.
    ///
    /// # Errors
    /// If it has no value.
    pub fn textured_float(&self, name: &str) -> Result<TexturedFloat, Error> {
        Ok(match self.texture(name)? {
            Some(texture) => Textured::Image(texture),
            None => Textured::Constant(self.float(name)? as f32),
        })
    }

    /// A spectrum that may be textured, if given.
    ///
    /// # Errors
    /// If the host gives a texture that it cannot read.
    pub fn textured_spectrum(&self, name: &str) -> Result<Option<TexturedSpectrum>, Error> {
        Ok(match self.texture(name)? {
            Some(texture) => Some(Textured::Image(texture)),
            None => self.spectrum(name).map(Textured::Constant),
        })
    }
}
