//! BSDF `mask`: another BSDF that is only partly there.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `bsdf` | plugin (bsdf) | | required | | what is there |
//! | `opacity` | float or texture | | 1 | [0, 1] | how much of it is there |
//! | `cutoff` | float | | | [0, 1] | if given: an opacity below it counts as 0, any other as 1 |
//!
//! A share `opacity` of the light meets the nested BSDF, the rest passes unchanged, as through holes too small to be seen. It is
//! UsdPreviewSurface's `opacity` (with `opacityThreshold` as `cutoff`) and glTF's alpha (BLEND, and MASK with `alphaCutoff`).
//! Holes belong in sheets: in the boundary of a refracting body they let light in that no light could get out by.
//! What passes is a delta lobe: a light is found behind it by walking on, not by connecting to it.
//!
//! ```json
//! "materials": { "gauze": { "plugin": "mask", "params": {
//!   "bsdf": { "plugin": "diffuse", "params": { "reflectance": 0.9 } }, "opacity": 0.4 } } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::operator::{Measure, lobes};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Error, Mode, NestedBsdf, NestedClosures, ParamDecl, Params, Plugin, Scatter,
    ScatterDraws, ScatterEval, ScatterSample, Spectrum, SurfacePoint, TexturedFloat, Vec3,
};

/// Words for the nested closure: what is left of a closure.
const WORDS: usize = 56;

/// The lobe of what passes; the nested BSDF's keep their numbers.
const PASSED: u32 = u32::MAX;

/// The plugin.
#[derive(Clone, Copy)]
pub struct Mask {
    bsdf: NestedBsdf,
    opacity: TexturedFloat,
    cutoff: Option<f32>,
}

/// The mask at a point.
#[derive(Clone, Copy)]
pub struct Masked {
    closure: NestedClosures<1, WORDS>,
    opacity: f32,
    /// The opacity is textured: the surface is a vertex also where it lets everything pass.
    varies: bool,
}

impl Plugin for Mask {
    const NAME: &'static str = "mask";
    const SUMMARY: &'static str = "Another BSDF with an opacity; the rest of the light passes.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::plugin("bsdf", "bsdf", "what is there")
            .required()
            .build(),
        Decl::float("opacity", "how much of it is there")
            .default("1")
            .at_least(0.0)
            .at_most(1.0)
            .texturable()
            .build(),
        Decl::float("cutoff", "an opacity below it counts as 0, any other as 1")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            bsdf: params
                .bsdf("bsdf")?
                .ok_or_else(|| Error::new("the parameter 'bsdf' has no value"))?,
            opacity: params.textured_float("opacity")?,
            cutoff: params.float("cutoff").ok().map(|c| c as f32),
        })
    }
}

impl Mask {
    /// An opacity after the cutoff.
    fn resolved(&self, opacity: f32) -> f32 {
        match self.cutoff {
            Some(cutoff) => f32::from(u8::from(opacity >= cutoff)),
            None => opacity,
        }
    }
}

impl Bsdf for Mask {
    type Closure = Masked;

    fn traits(&self) -> u32 {
        match self.opacity.constant() {
            Some(opacity) if self.resolved(opacity) == 0.0 => {
                bsdf_traits::NULL | bsdf_traits::UNIFORM
            }
            Some(_) => self.bsdf.traits(),
            None => self.bsdf.traits() & !bsdf_traits::UNIFORM,
        }
    }

    fn ior(&self) -> f32 {
        self.bsdf.ior()
    }

    fn closure(&self, at: &SurfacePoint) -> Masked {
        Masked {
            closure: NestedClosures::resolve([self.bsdf], at),
            opacity: self.resolved(self.opacity.at(at)),
            varies: !self.opacity.is_constant(),
        }
    }
}

impl Scatter for Masked {
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        if self.opacity == 0.0 {
            return ScatterEval::default();
        }
        let e = self.closure.eval(0, wo, wi, mode);
        ScatterEval {
            f: e.f * self.opacity,
            forward: e.forward * self.opacity,
            reverse: e.reverse * self.opacity,
        }
    }

    fn sample(&self, wo: Vec3, mut u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        if u.lobe >= self.opacity {
            let p = 1.0 - self.opacity;
            return Some(ScatterSample {
                weight: Spectrum::ONE,
                wi: (-wo).into(),
                eta: 1.0,
                forward: p,
                reverse: p,
                measure: Measure::Discrete as u32,
                lobe: PASSED,
            });
        }
        u.lobe = (u.lobe / self.opacity).min(1.0 - f32::EPSILON);
        // Value and density shrink alike: the weight stays.
        let mut s = self.closure.sample(0, wo, u, mode)?;
        s.forward *= self.opacity;
        s.reverse *= self.opacity;
        Some(s)
    }

    fn lobes(&self) -> u32 {
        if self.opacity == 0.0 {
            return if self.varies {
                lobes::DELTA
            } else {
                lobes::PASSES
            };
        }
        let inner = self.closure.lobes(0);
        if self.opacity == 1.0 || inner == lobes::PASSES {
            return inner;
        }
        inner | lobes::DELTA
    }

    fn eta(&self) -> f32 {
        self.closure.eta(0)
    }
}

resolvent_api::export_plugin!(bsdf, Mask);
