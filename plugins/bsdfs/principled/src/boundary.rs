//! The boundary of the opaque dielectric.

use resolvent_api::Spectrum;
use resolvent_api::microfacet::fresnel;

/// The dielectric's reflectance: Fresnel's curve for `eta`, from the colour `f0` at normal incidence to `f90` at grazing.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    pub f0: Spectrum,
    pub f90: f32,
    /// At least 1: seen from the thinner side.
    pub eta: f32,
    /// Reflectance of `eta` at normal incidence.
    pub normal: f32,
}

impl Boundary {
    /// From 0 at normal incidence to 1 at grazing, given the reflectance of `eta`.
    #[inline(always)]
    pub fn curve(&self, f: f32) -> f32 {
        ((f - self.normal) / (1.0 - self.normal)).max(0.0)
    }

    #[inline(always)]
    pub fn mix(&self, curve: f32) -> Spectrum {
        self.f0.map(|f0| f0 + (self.f90 - f0) * curve)
    }

    #[inline(always)]
    pub fn at(&self, cos: f32) -> Spectrum {
        self.mix(self.curve(fresnel::dielectric(cos, self.eta).0))
    }

    pub fn average(&self) -> Spectrum {
        self.mix(self.curve(fresnel::dielectric_average(self.eta)))
    }
}
