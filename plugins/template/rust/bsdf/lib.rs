//! BSDF `@NAME@`: a surface that reflects evenly into all directions (Lambert).
//!
//! | name | type | default | range | meaning |
//! |---|---|---|---|---|
//! | `albedo` | spectrum or texture | 0.8 | [0, 1] | share that is reflected |
//!
//! ```json
//! "materials": { "wall": { "plugin": "@NAME@", "params": { "albedo": [0.8, 0.4, 0.2] } } }
//! ```
//!
//! # How it works, and what to change
//!
//! [`Bsdf::closure`] looks textures up, once per vertex; the closure is what gets evaluated and sampled, often. Directions point away
//! from the surface, in the shading frame: z is the normal, and both sides have the same material here. A value carries no
//! cosine, a sample's `forward` is the density of `wi` per steradian, and its weight is value · |cos| / density.

#[cfg(test)]
mod tests;

use core::f32::consts::{FRAC_1_PI, TAU};
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Error, Mode, ParamDecl, Params, Plugin, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Spectrum, SurfacePoint, TexturedSpectrum, Vec3,
};

/// The plugin.
pub struct Even {
    albedo: TexturedSpectrum,
}

impl Plugin for Even {
    const NAME: &'static str = "@NAME@";
    const SUMMARY: &'static str = "A surface that reflects evenly into all directions.";
    const PARAMS: &'static [ParamDecl] = &[Decl::spectrum("albedo", "share that is reflected")
        .default("0.8")
        .at_least(0.0)
        .at_most(1.0)
        .texturable()
        .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let albedo = params.textured_spectrum("albedo")?;
        Ok(Self {
            albedo: albedo.ok_or_else(|| Error::new("'albedo' has no value"))?,
        })
    }
}

impl Bsdf for Even {
    type Closure = Reflector;

    fn traits(&self) -> u32 {
        if self.albedo.is_constant() {
            bsdf_traits::UNIFORM
        } else {
            0
        }
    }

    fn closure(&self, at: &SurfacePoint) -> Reflector {
        Reflector {
            albedo: self.albedo.at(at),
        }
    }
}

/// The surface at one point.
#[derive(Clone, Copy)]
pub struct Reflector {
    albedo: Spectrum,
}

impl Scatter for Reflector {
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        // On different sides: nothing passes.
        if wo.z * wi.z <= 0.0 {
            return ScatterEval::default();
        }
        ScatterEval {
            f: self.albedo * FRAC_1_PI,
            forward: wi.z.abs() * FRAC_1_PI,
            reverse: wo.z.abs() * FRAC_1_PI,
        }
    }

    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        // Uniform on the disk below the hemisphere: the density is cos/π, and the weight the albedo.
        let (sin, cos) = (TAU * u.dir[1]).sin_cos();
        let (r, z) = (u.dir[0].sqrt(), (1.0 - u.dir[0]).sqrt());
        if wo.z == 0.0 {
            return None;
        }
        Some(ScatterSample {
            weight: self.albedo,
            wi: [r * cos, r * sin, z.copysign(wo.z)],
            eta: 1.0,
            forward: z * FRAC_1_PI,
            reverse: wo.z.abs() * FRAC_1_PI,
            measure: Measure::SolidAngle as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

resolvent_api::export_plugin!(bsdf, Even);
