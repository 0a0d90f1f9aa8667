//! Phase function `mie-approx`: droplets of water, by their diameter.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `diameter` | float | µm | 10 | (0, 50] | diameter of the droplets: haze 0.1 to 1, fog 1 to 10, clouds 10 to 20, drizzle from 50 on |
//!
//! The blend p = (1 − w) p_HG(g) + w p_D(g_D, α) of a Henyey-Greenstein lobe, which takes the forward peak, and a lobe of Draine,
//! which takes the rest, fitted to Lorenz-Mie scattering (Jendersie & d'Eon 2023, "An Approximate Mie Scattering Function for
//! Fog and Cloud Rendering"). It has the peak and the backward rise of droplets and their mean cosine, not the rings of corona,
//! fog bow and glory: for these give the plugin `tabulated` a table of your own. Very small droplets scatter like `rayleigh`. The
//! fit has four ranges of diameter and small steps between them, at 0.1, 1.5 and 5 µm.
//!
//! A lobe is chosen by its weight; both are sampled by inverting their distribution function, and the density is that of the
//! blend, so a scattering event never changes the throughput. [`draine`] has the lobe, [`fit`] the numbers.
//!
//! ```json
//! "phase": { "plugin": "mie-approx", "params": { "diameter": 12 } }
//! ```

pub mod draine;
pub mod fit;

#[cfg(test)]
mod tests;

use draine::Draine;
use fit::Fit;
use resolvent_api::math::Frame;
use resolvent_api::math::hg::{Angle, Lobe};
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Decl, Error, Mode, ParamDecl, Params, PhaseFunction, Plugin, Scatter, ScatterDraws,
    ScatterEval, ScatterSample, Spectrum, Vec3,
};

/// The plugin, and its own closure: the function is the same everywhere.
#[derive(Clone, Copy, Debug)]
pub struct MieApprox {
    peak: Lobe,
    rest: Draine,
    /// Share of `rest`.
    weight: f32,
}

impl Plugin for MieApprox {
    const NAME: &'static str = "mie-approx";
    const SUMMARY: &'static str =
        "Droplets of water by their diameter: Jendersie and d'Eon's fit to Mie scattering.";
    const PARAMS: &'static [ParamDecl] = &[Decl::float(
        "diameter",
        "diameter of the droplets: fog 1 to 10, clouds 10 to 20",
    )
    .unit("µm")
    .default("10")
    .above(0.0)
    .at_most(fit::LARGEST)
    .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let fit = Fit::new(params.float("diameter")?);
        Ok(Self {
            peak: Lobe::new(fit.g_hg)?,
            rest: Draine::new(fit.g_d, fit.alpha)?,
            weight: fit.w_d as f32,
        })
    }
}

impl PhaseFunction for MieApprox {
    type Closure<'a> = Self;

    fn closure(&self, _: &MediumPoint) -> Self {
        *self
    }
}

impl MieApprox {
    #[inline(always)]
    fn density(&self, angle: Angle) -> f32 {
        let peak = self.peak.density(angle.one_minus_cos, angle.one_plus_cos);
        (1.0 - self.weight) * peak + self.weight * self.rest.density(angle)
    }
}

impl Scatter for MieApprox {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        // Exact near both poles, where 1 ± wo·wi would have lost its digits.
        let p = self.density(Angle {
            one_minus_cos: 0.5 * (wo + wi).length_squared(),
            one_plus_cos: 0.5 * (wo - wi).length_squared(),
        });
        ScatterEval {
            f: Spectrum::splat(p),
            forward: p,
            reverse: p,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let lobe = u32::from(u.lobe < self.weight);
        let angle = if lobe == 0 {
            self.peak.sample(u.dir[0])
        } else {
            self.rest.sample(u.dir[0])
        };
        let p = self.density(angle);
        Some(ScatterSample {
            weight: Spectrum::ONE,
            wi: angle.direction(Frame::around(-wo), u.dir[1]).into(),
            eta: 1.0,
            forward: p,
            reverse: p,
            measure: Measure::SolidAngle as u32,
            lobe,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

resolvent_api::export_plugin!(phase, MieApprox);
