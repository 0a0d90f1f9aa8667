//! What lies on a boundary and changes what it reflects: nothing, or a film.
//!
//! What scatters is generic over it, so that where there is nothing the code is the same as if there were no coatings.

use super::{Film, fresnel};
use crate::spectrum::{Lanes, Spectrum};

/// Lanes that a film colours: red, green and blue.
const COLOURS: u32 = 3;

/// A coating of the boundary between dielectrics that absorbs nothing.
pub trait Coating: Copy + Send + Sync + 'static {
    /// A reflectance.
    type Value: Lanes;
    /// There is none.
    const IS_BARE: bool;

    /// Reflectance for light at cosine `cos` ≥ 0, `eta` being the index on the far side over that on the near one, and the cosine of
    /// the refracted direction (0 if reflection is total). `inside` tells whether the light comes from the side that is not coated.
    fn reflects(&self, cos: f32, eta: f32, inside: bool) -> (Self::Value, f32);

    /// Transmittance from both cosines.
    fn passes(&self, cos: f32, cos_t: f32, eta: f32, inside: bool) -> Self::Value;

    /// The probability that goes with a share.
    fn mean(share: Self::Value) -> f32;

    /// A share over its probability.
    fn relative(share: Self::Value, p: f32) -> Spectrum;
}

/// No coating.
#[derive(Clone, Copy, Debug)]
pub struct Bare;

impl Coating for Bare {
    type Value = f32;
    const IS_BARE: bool = true;

    #[inline(always)]
    fn reflects(&self, cos: f32, eta: f32, _: bool) -> (f32, f32) {
        fresnel::dielectric(cos, eta)
    }

    #[inline(always)]
    fn passes(&self, cos: f32, cos_t: f32, eta: f32, _: bool) -> f32 {
        fresnel::transmittance(cos, cos_t, eta)
    }

    #[inline(always)]
    fn mean(share: f32) -> f32 {
        share
    }

    #[inline(always)]
    fn relative(_: f32, _: f32) -> Spectrum {
        Spectrum::ONE
    }
}

impl Coating for Film {
    type Value = Spectrum;
    const IS_BARE: bool = false;

    #[inline]
    fn reflects(&self, cos: f32, eta: f32, inside: bool) -> (Spectrum, f32) {
        let (bare, cos_t) = fresnel::dielectric(cos, eta);
        if cos_t == 0.0 {
            return (Spectrum::splat(bare), 0.0);
        }
        (self.either_way(cos, cos_t, eta, inside), cos_t)
    }

    #[inline]
    fn passes(&self, cos: f32, cos_t: f32, eta: f32, inside: bool) -> Spectrum {
        Spectrum::ONE - self.either_way(cos, cos_t, eta, inside)
    }

    #[inline(always)]
    fn mean(share: Spectrum) -> f32 {
        share.mean(COLOURS)
    }

    #[inline(always)]
    fn relative(share: Spectrum, p: f32) -> Spectrum {
        share / p.max(1e-12)
    }
}

impl Film {
    /// Reflectance where refraction leads from `cos` to `cos_t`. From within, what is not reflected totally meets the stack in the
    /// opposite order, which reflects as much (Born & Wolf, §1.6.3).
    #[inline(always)]
    fn either_way(&self, cos: f32, cos_t: f32, eta: f32, inside: bool) -> Spectrum {
        if inside {
            self.dielectric(cos_t, 1.0 / eta)
        } else {
            self.dielectric(cos, eta)
        }
    }
}
