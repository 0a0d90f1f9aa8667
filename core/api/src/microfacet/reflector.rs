//! Reflection by rough facets that transmit nothing, scattered once and more often.

use super::energy::Width;
use super::ggx::{Ggx, reflect};
use crate::math::{Vec3, warp};
use crate::operator::{ScatterDraws, ScatterEval};
use crate::spectrum::Spectrum;
use core::f32::consts::FRAC_1_PI;

/// A rough reflector whose facets have any Fresnel reflectance F.
///
/// Single scattering is f = F D G₂/(4 z_o z_i). What meets further facets is returned by a second lobe,
/// f = F_ms (1 − E(ωo)) (1 − E(ωi))/(π (1 − E_avg)), with F_ms = F_avg² E_avg/(1 − F_avg (1 − E_avg))
/// (Kulla & Conty 2017): reciprocal, and without loss where F = 1. It reflects the same way on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Reflector {
    ggx: Ggx,
    width: Width,
    /// F_ms/(π (1 − E_avg)).
    multiple: Spectrum,
    /// How strong multiple scattering is against single scattering, for choosing between them.
    share: f32,
}

impl Reflector {
    /// From the widths, both above 0, and the facets' mean reflectance for diffuse light, 2 ∫ F(μ) μ dμ. `lanes` are in use.
    pub fn new(alpha: [f32; 2], f_average: Spectrum, lanes: u32) -> Self {
        Self::of_parts(alpha, [(Spectrum::ONE, f_average)], lanes)
    }

    /// The same where parts of the surface have facets of different kinds: the share of each, and its mean reflectance. F_ms is not
    /// linear in F, and light that met a facet of one kind meets more of that kind.
    pub fn of_parts<const N: usize>(
        alpha: [f32; 2],
        parts: [(Spectrum, Spectrum); N],
        lanes: u32,
    ) -> Self {
        let ggx = Ggx { alpha };
        let width = Width::of(&ggx);
        let (mut once, mut multiple) = (Spectrum::ZERO, Spectrum::ZERO);
        for (share, average) in parts {
            once += average * share;
            multiple += Self::multiple(&width, average) * share;
        }
        let lost = (1.0 - width.single_average()).max(1e-6);
        let f = once.mean(lanes).max(1e-6);
        Self {
            ggx,
            width,
            multiple: multiple * (FRAC_1_PI / lost),
            share: multiple.mean(lanes) / f,
        }
    }

    /// F_ms, the reflectance for what meets more than one facet.
    fn multiple(width: &Width, f_average: Spectrum) -> Spectrum {
        let e = width.single_average();
        f_average.map(|f| f * f * e / (1.0 - f * (1.0 - e)))
    }

    /// F_ms of facets of another mean reflectance.
    pub fn multiple_reflectance(&self, f_average: Spectrum) -> Spectrum {
        Self::multiple(&self.width, f_average)
    }

    /// The facets' widths as the tables of energy know them.
    pub fn width(&self) -> &Width {
        &self.width
    }

    /// Share of the light from `w` that is scattered more than once and then leaves: (1 − E(ω)) F_ms.
    pub fn returned(&self, w: Vec3) -> Spectrum {
        let lost = (1.0 - self.width.single_average()).max(1e-6);
        self.multiple * ((1.0 - self.width.single(w)) * lost * core::f32::consts::PI)
    }

    /// Probability of choosing multiple scattering where a share `e` of the light is scattered once.
    #[inline(always)]
    fn choice(&self, e: f32) -> f32 {
        let multiple = (1.0 - e) * self.share;
        multiple / (e + multiple)
    }

    /// Value and densities; nothing for directions on different sides.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, fresnel: impl Fn(f32) -> Spectrum) -> ScatterEval {
        if !(wo.z * wi.z > 0.0) {
            return ScatterEval::default();
        }
        let up = 1f32.copysign(wo.z);
        let Some(h) = (wo + wi).try_normalize() else {
            return ScatterEval::default();
        };
        let h = h * up;
        let cos = wo.dot(h).abs();
        let d = 0.25 * self.ggx.d(h);
        let (eo, ei) = (self.width.single(wo), self.width.single(wi));
        let (po, pi) = (self.choice(eo), self.choice(ei));
        ScatterEval {
            f: fresnel(cos) * (d * self.ggx.g2_over_cos(wo, wi))
                + self.multiple * ((1.0 - eo) * (1.0 - ei)),
            forward: (1.0 - po) * self.ggx.g1_over_cos(wo) * d + po * wi.z.abs() * FRAC_1_PI,
            reverse: (1.0 - pi) * self.ggx.g1_over_cos(wi) * d + pi * wo.z.abs() * FRAC_1_PI,
        }
    }

    /// A direction with the density that [`eval`](Self::eval) states; `None` where the facet sends the light into the surface.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: ScatterDraws) -> Option<Vec3> {
        if wo.z == 0.0 {
            return None;
        }
        let up = 1f32.copysign(wo.z);
        let above = Vec3::new(wo.x, wo.y, wo.z.abs());
        let wi = if u.lobe < self.choice(self.width.single(wo)) {
            warp::cosine_hemisphere(u.dir)
        } else {
            reflect(above, self.ggx.sample(above, u.dir))
        };
        (wi.z > 0.0).then_some(Vec3::new(wi.x, wi.y, wi.z * up))
    }
}
