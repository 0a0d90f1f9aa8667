//! BSDF `mix`: two others, mixed by weight.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `a` | plugin (bsdf) | | required | | the first |
//! | `b` | plugin (bsdf) | | required | | the second |
//! | `weight` | float or texture | | 0.5 | [0, 1] | share of the second |
//!
//! f = (1 − w) f_a + w f_b, with the densities mixed likewise. Mixtures may nest; the two closures are held inline as far as 432
//! bytes go, and one that is larger is resolved anew whenever it is evaluated. A body has one index of refraction, so two BSDFs
//! that refract must agree on it.
//!
//! ```json
//! "materials": { "worn": { "plugin": "mix", "params": {
//!   "a": { "plugin": "conductor", "params": { "metal": "Cu", "roughness": 0.2 } },
//!   "b": { "plugin": "diffuse", "params": { "reflectance": [0.2, 0.5, 0.4] } },
//!   "weight": 0.3 } } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::operator::{Measure, lobes};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Error, Mode, NestedBsdf, NestedClosures, ParamDecl, Params, Plugin, Scatter,
    ScatterDraws, ScatterEval, ScatterSample, SurfacePoint, TexturedFloat, Vec3,
};

/// Words for the nested closures: what is left of a closure.
const WORDS: usize = 54;

/// The plugin.
#[derive(Clone, Copy)]
pub struct Mix {
    bsdfs: [NestedBsdf; 2],
    weight: TexturedFloat,
    ior: f32,
}

/// The mixture at a point.
#[derive(Clone, Copy)]
pub struct Mixture {
    closures: NestedClosures<2, WORDS>,
    /// Share of the second.
    weight: f32,
    /// Probability of choosing the second.
    choice: f32,
}

impl Plugin for Mix {
    const NAME: &'static str = "mix";
    const SUMMARY: &'static str = "Two other BSDFs, mixed by weight.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::plugin("a", "bsdf", "the first").required().build(),
        Decl::plugin("b", "bsdf", "the second").required().build(),
        Decl::float("weight", "share of the second")
            .default("0.5")
            .at_least(0.0)
            .at_most(1.0)
            .texturable()
            .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let nested = |name: &str| {
            params
                .bsdf(name)?
                .ok_or_else(|| Error::new(format!("the parameter '{name}' has no value")))
        };
        let bsdfs = [nested("a")?, nested("b")?];
        let [a, b] = bsdfs.map(|n| n.ior());
        if a != 1.0 && b != 1.0 && a != b {
            return Err(Error::new(format!(
                "'a' and 'b' refract with the indices {a} and {b}, but a body has one"
            )));
        }
        Ok(Self {
            bsdfs,
            weight: params.textured_float("weight")?,
            ior: if a != 1.0 { a } else { b },
        })
    }
}

impl Bsdf for Mix {
    type Closure = Mixture;

    fn traits(&self) -> u32 {
        // Both pass light unchanged, or are the same everywhere: then so is the mixture.
        let uniform = if self.weight.is_constant() {
            bsdf_traits::UNIFORM
        } else {
            0
        };
        let [a, b] = [0, 1].map(|i| self.bsdfs[i].traits());
        let of_either = bsdf_traits::NON_RECIPROCAL | bsdf_traits::OWN_NORMALS;
        a & b & (bsdf_traits::NULL | uniform) | (a | b) & of_either
    }

    fn ior(&self) -> f32 {
        self.ior
    }

    fn closure(&self, at: &SurfacePoint) -> Mixture {
        let closures = NestedClosures::resolve(self.bsdfs, at);
        let weight = self.weight.at(at);
        // What scatters nothing is not worth choosing.
        let choice = match [0, 1].map(|i| closures.lobes(i) != 0) {
            [true, false] => 0.0,
            [false, true] => 1.0,
            _ => weight,
        };
        Mixture {
            closures,
            weight,
            choice,
        }
    }
}

impl Mixture {
    fn shares(&self) -> [f32; 2] {
        [1.0 - self.weight, self.weight]
    }

    fn choices(&self) -> [f32; 2] {
        [1.0 - self.choice, self.choice]
    }

    /// Value of closure `i`, for a caller that divides radiance by the square of `eta`: the core does so with one index for the
    /// whole mixture, but a part that passes light unbent must not be divided.
    fn eval_for(&self, i: usize, wo: Vec3, wi: Vec3, mode: Mode, eta: f32) -> ScatterEval {
        let mut e = self.closures.eval(i, wo, wi, mode);
        if wo.z * wi.z < 0.0 && mode == Mode::Radiance {
            let own = self.closures.eta(i);
            let ratio = eta / if wo.z > 0.0 { own } else { 1.0 / own };
            e.f *= ratio * ratio;
        }
        e
    }
}

impl Scatter for Mixture {
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        let eta = if wo.z > 0.0 {
            self.eta()
        } else {
            1.0 / self.eta()
        };
        let (share, choice) = (self.shares(), self.choices());
        let mut out = ScatterEval::default();
        for i in 0..2 {
            if share[i] == 0.0 {
                continue;
            }
            let e = self.eval_for(i, wo, wi, mode, eta);
            out.f += e.f * share[i];
            out.forward += e.forward * choice[i];
            out.reverse += e.reverse * choice[i];
        }
        out
    }

    fn sample(&self, wo: Vec3, mut u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        let (share, choice) = (self.shares(), self.choices());
        let i = usize::from(u.lobe >= choice[0]);
        // What is left of the number serves the closure.
        u.lobe = if i == 0 {
            u.lobe / choice[0]
        } else {
            (u.lobe - choice[0]) / choice[1]
        };
        u.lobe = u.lobe.min(1.0 - f32::EPSILON);
        let mut s = self.closures.sample(i, wo, u, mode)?;
        let (mut f, mut forward) = (s.weight * (share[i] * s.forward), choice[i] * s.forward);
        let mut reverse = choice[i] * s.reverse;
        let other = 1 - i;
        if s.measure != Measure::Discrete as u32 && share[other] > 0.0 {
            let wi = Vec3::from(s.wi);
            let e = self.eval_for(other, wo, wi, mode, s.eta);
            f += e.f * (share[other] * wi.z.abs());
            forward += choice[other] * e.forward;
            reverse += choice[other] * e.reverse;
        }
        s.weight = f * (1.0 / forward);
        (s.forward, s.reverse) = (forward, reverse);
        (forward > 0.0 && !s.weight.is_zero()).then_some(s)
    }

    fn lobes(&self) -> u32 {
        let mut out = 0;
        for (i, share) in self.shares().into_iter().enumerate() {
            if share > 0.0 {
                out |= self.closures.lobes(i);
            }
        }
        // Only a surface that passes everything is no vertex; as a part, passing is a delta lobe.
        if out & lobes::PASSES != 0 && out != lobes::PASSES {
            out = (out & !lobes::PASSES) | lobes::DELTA;
        }
        out
    }

    fn eta(&self) -> f32 {
        let a = self.closures.eta(0);
        if a != 1.0 { a } else { self.closures.eta(1) }
    }
}

resolvent_api::export_plugin!(bsdf, Mix);
