//! Phase function `two-lobe-hg`: a mixture of two Henyey-Greenstein lobes.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `g1` | float | | 0.85 | (−1, 1) | mean cosine of the first lobe |
//! | `g2` | float | | −0.3 | (−1, 1) | mean cosine of the second lobe |
//! | `weight` | float | | 0.9 | [0, 1] | share of the first lobe; the second has the rest |
//!
//! p = w p₁ + (1 − w) p₂, each a lobe as in the plugin `hg`; the mean cosine is w g₁ + (1 − w) g₂. A forward and a
//! weaker backward lobe come close to the scattering of cloud droplets, whose glory and fog bow one lobe can't show.
//! The lobe is chosen by its weight and the density is that of the mixture, so the throughput stays unchanged.
//!
//! ```json
//! "phase": { "plugin": "two-lobe-hg", "params": { "g1": 0.9, "g2": -0.4, "weight": 0.85 } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::math::Frame;
use resolvent_api::math::hg::Lobe;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Decl, Error, Mode, ParamDecl, Params, PhaseFunction, Plugin, Scatter, ScatterDraws,
    ScatterEval, ScatterSample, Spectrum, Vec3,
};

/// The plugin, and its own closure: the function is the same everywhere.
#[derive(Clone, Copy, Debug)]
pub struct TwoLobes {
    lobes: [Lobe; 2],
    weight: f32,
}

impl Plugin for TwoLobes {
    const NAME: &'static str = "two-lobe-hg";
    const SUMMARY: &'static str =
        "A mixture of two Henyey-Greenstein lobes, such as a forward and a backward one.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::float("g1", "mean cosine of the first lobe")
            .default("0.85")
            .above(-1.0)
            .below(1.0)
            .build(),
        Decl::float("g2", "mean cosine of the second lobe")
            .default("-0.3")
            .above(-1.0)
            .below(1.0)
            .build(),
        Decl::float("weight", "share of the first lobe")
            .default("0.9")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            lobes: [
                Lobe::new(params.float("g1")?)?,
                Lobe::new(params.float("g2")?)?,
            ],
            weight: params.float("weight")? as f32,
        })
    }
}

impl PhaseFunction for TwoLobes {
    type Closure<'a> = Self;

    fn closure(&self, _: &MediumPoint) -> Self {
        *self
    }
}

impl TwoLobes {
    #[inline(always)]
    fn mix(&self, p: impl Fn(&Lobe) -> f32) -> f32 {
        self.weight * p(&self.lobes[0]) + (1.0 - self.weight) * p(&self.lobes[1])
    }
}

impl Scatter for TwoLobes {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let p = self.mix(|lobe| lobe.density_between(wo, wi));
        ScatterEval {
            f: Spectrum::splat(p),
            forward: p,
            reverse: p,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let choice = usize::from(u.lobe >= self.weight);
        let angle = self.lobes[choice].sample(u.dir[0]);
        let p = self.mix(|lobe| lobe.density(angle.one_minus_cos, angle.one_plus_cos));
        Some(ScatterSample {
            weight: Spectrum::ONE,
            wi: angle.direction(Frame::around(-wo), u.dir[1]).into(),
            eta: 1.0,
            forward: p,
            reverse: p,
            measure: Measure::SolidAngle as u32,
            lobe: choice as u32,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

resolvent_api::export_plugin!(phase, TwoLobes);
