//! BSDF `null`: a surface that isn't there.
//!
//! It has no parameters.
//!
//! Light passes unchanged. Put it on the closed mesh around a medium whose boundary doesn't refract: the mesh then only
//! says where the medium is. Transport goes through such a surface without making a vertex, so next-event estimation reaches
//! lights behind it.
//!
//! ```json
//! "materials": { "boundary": { "plugin": "null" } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::operator::{Measure, lobes};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Error, Mode, ParamDecl, Params, Plugin, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Spectrum, SurfacePoint, Vec3,
};

/// The plugin, and its own closure.
#[derive(Clone, Copy, Debug)]
pub struct Null;

impl Plugin for Null {
    const NAME: &'static str = "null";
    const SUMMARY: &'static str =
        "Passes all light unchanged: the boundary of a medium, nothing more.";
    const PARAMS: &'static [ParamDecl] = &[];

    fn create(_: &Params<'_>) -> Result<Self, Error> {
        Ok(Self)
    }
}

impl Bsdf for Null {
    type Closure = Self;

    fn traits(&self) -> u32 {
        bsdf_traits::NULL | bsdf_traits::UNIFORM
    }

    fn closure(&self, _: &SurfacePoint) -> Self {
        Self
    }
}

impl Scatter for Null {
    /// A delta lobe contributes nothing to any given pair of directions.
    #[inline]
    fn eval(&self, _: Vec3, _: Vec3, _: Mode) -> ScatterEval {
        ScatterEval::default()
    }

    #[inline]
    fn sample(&self, wo: Vec3, _: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        Some(ScatterSample {
            weight: Spectrum::ONE,
            wi: (-wo).into(),
            eta: 1.0,
            forward: 1.0,
            reverse: 1.0,
            measure: Measure::Discrete as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::PASSES
    }
}

resolvent_api::export_plugin!(bsdf, Null);
