//! Phase function `@NAME@`: scattering that grows linearly with the cosine of the angle.
//!
//! | name | type | default | range | meaning |
//! |---|---|---|---|---|
//! | `a` | float | 0.5 | [-1, 1] | slope; positive scatters forward, the mean cosine is `a`/3 |
//!
//! p(cos θ) = (1 + a cos θ)/4π.
//!
//! ```json
//! "phase": { "plugin": "@NAME@", "params": { "a": 1 } }
//! ```
//!
//! # How it works, and what to change
//!
//! [`PhaseFunction::closure`] resolves everything local at a point; the closure is what gets evaluated and sampled, often. Both
//! directions point away from the vertex, so the cosine of the scattering angle is −wo·wi. A value integrates to 1 over the sphere, a
//! sample's `forward` is the density of `wi`, and its weight is value over density.

#[cfg(test)]
mod tests;

use core::f32::consts::{PI, TAU};
use resolvent_api::math::Frame;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Decl, Error, Mode, ParamDecl, Params, PhaseFunction, Plugin, Scatter, ScatterDraws,
    ScatterEval, ScatterSample, Spectrum, Vec3,
};

/// The phase function, the same at every point, and so its own closure.
#[derive(Clone, Copy)]
pub struct Linear {
    a: f32,
}

impl Linear {
    fn value(&self, cosine: f32) -> f32 {
        ((1.0 + self.a * cosine) / (4.0 * PI)).max(0.0)
    }
}

impl Plugin for Linear {
    const NAME: &'static str = "@NAME@";
    const SUMMARY: &'static str = "Scattering that grows linearly with the cosine of the angle.";
    const PARAMS: &'static [ParamDecl] = &[Decl::float("a", "slope; positive scatters forward")
        .default("0.5")
        .at_least(-1.0)
        .at_most(1.0)
        .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            a: params.float("a")? as f32,
        })
    }
}

impl PhaseFunction for Linear {
    type Closure<'a> = Self;

    fn closure(&self, _: &MediumPoint) -> Self {
        *self
    }
}

impl Scatter for Linear {
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let p = self.value(-wo.dot(wi));
        ScatterEval {
            f: Spectrum::splat(p),
            forward: p,
            reverse: p,
        }
    }

    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        // The distribution of the cosine is a quadratic; this form of its root needs no case for a = 0.
        let root = ((1.0 - self.a).powi(2) + 4.0 * self.a * u.dir[0]).max(0.0).sqrt();
        let cosine = ((4.0 * u.dir[0] - 2.0 + self.a) / (1.0 + root)).clamp(-1.0, 1.0);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin_turn, cos_turn) = (TAU * u.dir[1]).sin_cos();
        let local = Vec3::new(sine * cos_turn, sine * sin_turn, cosine);
        // The densities are those of the direction as it is returned.
        let wi = Frame::around(-wo).to_world(local).normalize();
        let p = self.value(-wo.dot(wi));
        (p > 0.0).then_some(ScatterSample {
            weight: Spectrum::ONE,
            wi: wi.into(),
            eta: 1.0,
            forward: p,
            reverse: p,
            measure: Measure::SolidAngle as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

resolvent_api::export_plugin!(phase, Linear);
