//! Phase function `isotropic`: scatters equally into all directions, p = 1/(4π) sr⁻¹.
//!
//! It has no parameters.
//!
//! What the host uses for a medium that names no phase function. Right for strongly diffusing matter after many
//! collisions and for tests against the classical tables of radiative transfer, which are made for it.
//!
//! ```json
//! "phase": { "plugin": "isotropic" }
//! ```

use resolvent_api::math::warp;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Error, Mode, ParamDecl, Params, PhaseFunction, Plugin, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Spectrum, Vec3,
};

#[cfg(test)]
mod tests;

/// The plugin.
#[derive(Clone, Copy, Debug)]
pub struct Isotropic;

impl Plugin for Isotropic {
    const NAME: &'static str = "isotropic";
    const SUMMARY: &'static str = "Scatters equally into all directions.";
    const PARAMS: &'static [ParamDecl] = &[];

    fn create(_: &Params<'_>) -> Result<Self, Error> {
        Ok(Self)
    }
}

impl PhaseFunction for Isotropic {
    type Closure<'a> = Self;

    fn closure(&self, _: &MediumPoint) -> Self {
        Self
    }
}

impl Scatter for Isotropic {
    #[inline]
    fn eval(&self, _: Vec3, _: Vec3, _: Mode) -> ScatterEval {
        ScatterEval {
            f: Spectrum::splat(warp::SPHERE_PDF),
            forward: warp::SPHERE_PDF,
            reverse: warp::SPHERE_PDF,
        }
    }

    #[inline]
    fn sample(&self, _: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        Some(ScatterSample {
            weight: Spectrum::ONE,
            wi: warp::sphere(u.dir).into(),
            eta: 1.0,
            forward: warp::SPHERE_PDF,
            reverse: warp::SPHERE_PDF,
            measure: Measure::SolidAngle as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

resolvent_api::export_plugin!(phase, Isotropic);
