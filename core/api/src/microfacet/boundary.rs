//! The boundary of a dielectric as a closure: what the BSDFs `dielectric` and `rough-dielectric` have in common.

use super::Interface;
use crate::abi::ParamDecl;
use crate::math::Vec3;
use crate::operator::{Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample, lobes};
use crate::params::{Decl, Params};
use crate::spectrum::Spectrum;

/// Parameter `ior`.
pub const IOR: ParamDecl = Decl::float("ior", "index of refraction inside")
    .default("1.5")
    .at_least(0.2)
    .at_most(5.0)
    .build();
/// Parameter `thin`.
pub const THIN: ParamDecl = Decl::bool("thin", "a thin sheet, through which light passes unbent")
    .default("false")
    .build();
/// Parameter `reflection_tint`.
pub const REFLECTION_TINT: ParamDecl = tint("reflection_tint", "factor of what is reflected");
/// Parameter `transmission_tint`.
pub const TRANSMISSION_TINT: ParamDecl = tint("transmission_tint", "factor of what passes");

const fn tint(name: &'static str, help: &'static str) -> ParamDecl {
    Decl::spectrum(name, help)
        .default("1")
        .at_least(0.0)
        .at_most(1.0)
        .build()
}

/// An [`Interface`] with factors of what it reflects and of what it transmits.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    /// The interface.
    pub interface: Interface,
    /// Factors of what is reflected and transmitted.
    pub tints: [Spectrum; 2],
}

impl Boundary {
    /// The factors among a plugin's parameters.
    pub fn tints(params: &Params<'_>) -> [Spectrum; 2] {
        ["reflection_tint", "transmission_tint"]
            .map(|name| params.spectrum(name).unwrap_or(Spectrum::ONE))
    }
}

impl Scatter for Boundary {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let mut e = self.interface.eval(wo, wi);
        e.f *= self.tints[usize::from(wo.z * wi.z < 0.0)];
        e
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let mut s = self.interface.sample(wo, u)?;
        s.weight *= self.tints[s.lobe as usize];
        (!s.weight.is_zero()).then_some(s)
    }

    fn lobes(&self) -> u32 {
        if self.interface.is_smooth() {
            lobes::DELTA
        } else {
            lobes::SMOOTH
        }
    }

    fn eta(&self) -> f32 {
        self.interface.eta()
    }
}
