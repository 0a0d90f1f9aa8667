//! Phase function `rayleigh`: particles much smaller than the wavelength, such as the molecules of air.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `depolarization` | float | | 0 | [0, 6/7] | depolarisation factor ρ of the particles for natural light; dry air has 0.028, spheres 0 |
//!
//! p(cos θ) = 3/(16π (1 + 2γ)) · ((1 + 3γ) + (1 − γ) cos² θ) with γ = ρ/(2 − ρ) (Chandrasekhar 1960, *Radiative Transfer*, chapter I;
//! Bucholtz 1995, "Rayleigh-scattering calculations for the terrestrial atmosphere"). As much goes forward as backward,
//! so the mean cosine is 0. ρ = 6/7 is the largest that any particle can have. How scattering depends on the wavelength (λ⁻⁴) is
//! not part of the phase function: it belongs into the medium's coefficients.
//!
//! ```json
//! "phase": { "plugin": "rayleigh", "params": { "depolarization": 0.028 } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::math::Frame;
use resolvent_api::math::hg::Angle;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Decl, Error, Mode, ParamDecl, Params, PhaseFunction, Plugin, Scatter, ScatterDraws,
    ScatterEval, ScatterSample, Spectrum, Vec3,
};

/// The plugin, and its own closure: the function is the same everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Rayleigh {
    /// p = `level` + `bow` · cos² θ, sr⁻¹.
    level: f32,
    bow: f32,
    /// `level`/`bow`, between 1 (ρ = 0) and 13 (ρ = 6/7).
    ratio: f64,
}

impl Rayleigh {
    /// With the depolarisation factor ρ.
    fn new(depolarization: f64) -> Self {
        let gamma = depolarization / (2.0 - depolarization);
        let scale = 3.0 / (16.0 * core::f64::consts::PI * (1.0 + 2.0 * gamma));
        Self {
            level: (scale * (1.0 + 3.0 * gamma)) as f32,
            bow: (scale * (1.0 - gamma)) as f32,
            ratio: (1.0 + 3.0 * gamma) / (1.0 - gamma),
        }
    }

    #[inline(always)]
    fn density(&self, cos: f32) -> f32 {
        self.level + self.bow * cos * cos
    }

    /// cos θ at which the distribution function, counted from −1, reaches `u`.
    ///
    /// It solves the cubic c³ + 3 r c = q with r = `ratio`, q = (2u − 1)(1 + 3 r), by Cardano's formula: its other two roots are
    /// complex. The cube root is taken on the side where its terms add, and in `f64`, where what c = h − r/h cancels around
    /// c = 0 is far below the precision of `f32`.
    #[inline]
    fn cosine(&self, u: f32) -> f64 {
        let r = self.ratio;
        let q = (2.0 * f64::from(u) - 1.0) * (1.0 + 3.0 * r);
        let half = 0.5 * q.abs();
        let h = (half + (half * half + r * r * r).sqrt()).cbrt();
        (h - r / h).min(1.0).copysign(q)
    }
}

impl Plugin for Rayleigh {
    const NAME: &'static str = "rayleigh";
    const SUMMARY: &'static str = "Rayleigh scattering of molecules and other particles much smaller than the wavelength, with depolarisation.";
    const PARAMS: &'static [ParamDecl] = &[Decl::float(
        "depolarization",
        "depolarisation factor of the particles for natural light; dry air has 0.028",
    )
    .default("0")
    .at_least(0.0)
    .at_most(6.0 / 7.0)
    .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self::new(params.float("depolarization")?))
    }
}

impl PhaseFunction for Rayleigh {
    type Closure<'a> = Self;

    fn closure(&self, _: &MediumPoint) -> Self {
        *self
    }
}

impl Scatter for Rayleigh {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let p = self.density(wo.dot(wi));
        ScatterEval {
            f: Spectrum::splat(p),
            forward: p,
            reverse: p,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let cos = self.cosine(u.dir[0]);
        let p = self.density(cos as f32);
        let angle = Angle {
            one_minus_cos: (1.0 - cos) as f32,
            one_plus_cos: (1.0 + cos) as f32,
        };
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

resolvent_api::export_plugin!(phase, Rayleigh);
