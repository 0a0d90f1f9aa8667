//! Phase function `hg`: Henyey & Greenstein's (1941) one-parameter lobe.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `g` | float | | 0 | (−1, 1) | mean cosine of the scattering angle; positive scatters forward, 0 is isotropic |
//!
//! p(cos θ) = (1 − g²) / (4π (1 + g² − 2 g cos θ)^{3/2}), with cos θ = −wo·wi because both directions point away from the
//! vertex. Clouds are near 0.85, thin haze near 0.6, skin and milk between 0.7 and 0.95. Sampling is exact, so a
//! scattering event never changes the throughput.
//!
//! ```json
//! "phase": { "plugin": "hg", "params": { "g": 0.85 } }
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
pub struct HenyeyGreenstein {
    lobe: Lobe,
}

impl Plugin for HenyeyGreenstein {
    const NAME: &'static str = "hg";
    const SUMMARY: &'static str =
        "Henyey-Greenstein: one lobe, forward or backward, given by its mean cosine.";
    const PARAMS: &'static [ParamDecl] = &[Decl::float(
        "g",
        "mean cosine of the scattering angle; positive scatters forward",
    )
    .default("0")
    .above(-1.0)
    .below(1.0)
    .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            lobe: Lobe::new(params.float("g")?)?,
        })
    }
}

impl PhaseFunction for HenyeyGreenstein {
    type Closure<'a> = Self;

    fn closure(&self, _: &MediumPoint) -> Self {
        *self
    }
}

impl Scatter for HenyeyGreenstein {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let p = self.lobe.density_between(wo, wi);
        ScatterEval {
            f: Spectrum::splat(p),
            forward: p,
            reverse: p,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let angle = self.lobe.sample(u.dir[0]);
        let p = self.lobe.density(angle.one_minus_cos, angle.one_plus_cos);
        Some(ScatterSample {
            weight: Spectrum::ONE,
            wi: angle.direction(Frame::around(-wo), u.dir[1]).into(),
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

resolvent_api::export_plugin!(phase, HenyeyGreenstein);
