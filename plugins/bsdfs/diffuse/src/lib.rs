//! BSDF `diffuse`: Lambert's law, reflecting on both sides.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `reflectance` | spectrum or texture | | 0.5 | [0, 1] | share of the incident power that is reflected |
//!
//! f = ρ/π where `wo` and `wi` lie on the same side of the surface, 0 elsewhere; nothing is transmitted. Directions are sampled
//! with the density |cos θ|/π, so the weight of a sample is ρ.
//!
//! ```json
//! "materials": { "clay": { "plugin": "diffuse", "params": { "reflectance": [0.8, 0.6, 0.4] } } }
//! ```

#[cfg(test)]
mod tests;

use core::f32::consts::FRAC_1_PI;
use resolvent_api::math::warp;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Error, Mode, ParamDecl, Params, Plugin, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Spectrum, SurfacePoint, TexturedSpectrum, Vec3,
};

/// The plugin.
#[derive(Debug)]
pub struct Diffuse {
    reflectance: TexturedSpectrum,
}

/// The BSDF at one point.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    reflectance: Spectrum,
}

impl Plugin for Diffuse {
    const NAME: &'static str = "diffuse";
    const SUMMARY: &'static str = "Lambertian reflection on both sides.";
    const PARAMS: &'static [ParamDecl] = &[Decl::spectrum(
        "reflectance",
        "share of the incident power that is reflected",
    )
    .default("0.5")
    .at_least(0.0)
    .at_most(1.0)
    .texturable()
    .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let reflectance = params
            .textured_spectrum("reflectance")?
            .ok_or_else(|| Error::new("the parameter 'reflectance' has no value"))?;
        Ok(Self { reflectance })
    }
}

impl Bsdf for Diffuse {
    type Closure = Lambert;

    fn traits(&self) -> u32 {
        if self.reflectance.is_constant() {
            bsdf_traits::UNIFORM
        } else {
            0
        }
    }

    #[inline]
    fn closure(&self, at: &SurfacePoint) -> Lambert {
        Lambert {
            reflectance: self.reflectance.at(at),
        }
    }
}

impl Lambert {
    /// A black surface samples nothing, and its densities say so: a walk ends there without a wasted ray.
    #[inline(always)]
    fn is_black(&self) -> bool {
        self.reflectance.is_zero()
    }
}

impl Scatter for Lambert {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        if !(wo.z * wi.z > 0.0) || self.is_black() {
            return ScatterEval::default();
        }
        ScatterEval {
            f: self.reflectance * FRAC_1_PI,
            forward: wi.z.abs() * FRAC_1_PI,
            reverse: wo.z.abs() * FRAC_1_PI,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let wi = warp::cosine_hemisphere(u.dir);
        // A direction within the surface has density 0 and carries nothing.
        if wo.z == 0.0 || wi.z == 0.0 || self.is_black() {
            return None;
        }
        Some(ScatterSample {
            weight: self.reflectance,
            wi: [wi.x, wi.y, wi.z.copysign(wo.z)],
            eta: 1.0,
            forward: wi.z * FRAC_1_PI,
            reverse: wo.z.abs() * FRAC_1_PI,
            measure: Measure::SolidAngle as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        if self.is_black() { 0 } else { lobes::SMOOTH }
    }
}

resolvent_api::export_plugin!(bsdf, Diffuse);
