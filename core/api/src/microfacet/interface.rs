//! The boundary of a dielectric: reflection and transmission, smooth or rough, refracting or thin-walled.

use super::SMOOTH_BELOW;
use super::coating::{Bare, Coating};
use super::energy::Width;
use super::exits::{self, Exits};
use super::ggx::{Ggx, reflect};
use super::{facets, fresnel};
use crate::math::{Vec3, warp};
use crate::operator::{Measure, ScatterDraws, ScatterEval, ScatterSample};
use crate::spectrum::{Lanes, Spectrum};
use core::f32::consts::FRAC_1_PI;

/// Deviation of refracted rays below which a rough boundary counts as smooth: half vectors of directions in single precision
/// say nothing about it.
const UNBENT: f32 = 2e-5;
/// Cosine below which a direction lies in the surface: two of them would leave the range of `f32` in f's denominator.
const GRAZING: f32 = 1e-30;

/// A boundary that absorbs nothing.
///
/// Rough facets scatter once as in Walter et al. 2007 (eq. 20 and 21, per power: see [`crate::Mode`]), with height-correlated
/// masking. What meets more facets is returned in two lobes, reflected and transmitted, that keep the whole reciprocal and
/// without loss: with the lost shares l(ω) = 1 − E(ω) on each side and their means A,
///
///   f_r = x_s l_s(ωo) l_s(ωi)/(π A_s),   f_t = y_s l_s(ωo) l_s'(ωi)/(π A_s'),   x_s + y_s = 1,
///
/// and y_s A_s n_s² the same from both sides: y_s = (1 − F_avg) min(1, A_s'/A_s) (after Kulla & Conty 2017).
///
/// A thin wall is two parallel boundaries with nothing to see between them: with all internal reflections it reflects
/// 2F/(1 + F) and passes the rest unbent, scattered as widely as what it reflects.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    ggx: Ggx,
    width: Width,
    /// Index of refraction below over that above.
    eta: f32,
    thin: bool,
    smooth: bool,
    /// x_s from above and from below.
    reflects: [f32; 2],
    /// 1/(π A) above and below.
    norm: [f32; 2],
}

/// What is known from the two directions and the side of `wo`, turned so that `wo` is above.
struct Turned {
    wo: Vec3,
    wi: Vec3,
    /// Index on the other side over that on the side of `wo`.
    eta: f32,
    /// Side of `wo`: 0 above, 1 below.
    side: usize,
}

impl Interface {
    /// A boundary with an index of refraction `eta` below over that above, and widths `alpha`.
    pub fn new(alpha: [f32; 2], eta: f32, thin: bool) -> Self {
        let eta = if eta.is_finite() && eta > 0.0 {
            eta
        } else {
            1.0
        };
        let widest = alpha[0].max(alpha[1]);
        let unbent = !thin && widest * (eta - 1.0).abs() < UNBENT;
        let smooth = widest < SMOOTH_BELOW * SMOOTH_BELOW || unbent;
        let narrowest = SMOOTH_BELOW * SMOOTH_BELOW;
        let ggx = Ggx {
            alpha: alpha.map(|a| a.max(narrowest)),
        };
        let mut out = Self {
            ggx,
            width: Width::of(&ggx),
            eta,
            thin,
            smooth,
            reflects: [0.0; 2],
            norm: [0.0; 2],
        };
        if !smooth {
            out.share();
        }
        out
    }

    /// The boundary as it is under a coating, by which less or more light meets several facets, in the mean of all colours.
    pub fn under<C: Coating>(mut self, coating: &C) -> Self {
        if C::IS_BARE || self.smooth || self.thin {
            return self;
        }
        let adds = average(|mu| added(coating, mu, self.eta, false));
        let f = fresnel::dielectric_average(self.eta) + adds;
        // 1 − F(1/η) = (1 − F(η))/η².
        let back = 1.0 - (1.0 - f) / (self.eta * self.eta);
        let lost = [(self.eta, false), (1.0 / self.eta, true)].map(|(eta, inside)| {
            let more = |mu| {
                let w = warp::around_z(mu, 0.125);
                self.lost_under(coating, w, eta, inside) - self.lost(w, eta)
            };
            (1.0 - self.width.total_average(eta) + average(more)).max(1e-6)
        });
        self.share_out(f, back, lost);
        self
    }

    /// Shares of what meets more than one facet.
    fn share(&mut self) {
        let f = fresnel::dielectric_average(self.eta);
        if self.thin {
            let lost = (1.0 - self.width.single_average()).max(1e-6);
            self.norm = [FRAC_1_PI / lost; 2];
            self.reflects = [2.0 * f / (1.0 + f); 2];
            return;
        }
        let back = fresnel::dielectric_average(1.0 / self.eta);
        let lost =
            [self.eta, 1.0 / self.eta].map(|eta| (1.0 - self.width.total_average(eta)).max(1e-6));
        self.share_out(f, back, lost);
    }

    /// The same from the mean reflectances and the lost shares for diffuse light, from above and from below.
    fn share_out(&mut self, f: f32, back: f32, lost: [f32; 2]) {
        let least = lost[0].min(lost[1]);
        self.norm = lost.map(|l| FRAC_1_PI / l);
        self.reflects = [
            1.0 - (1.0 - f) * least / lost[0],
            1.0 - (1.0 - back) * least / lost[1],
        ];
    }

    /// True if it reflects and refracts in single directions.
    pub fn is_smooth(&self) -> bool {
        self.smooth
    }

    /// Index of refraction below over that above as light meets it: 1 for thin walls.
    pub fn eta(&self) -> f32 {
        if self.thin { 1.0 } else { self.eta }
    }

    /// How what passes from below is spread over the cosines above, see [`exits::passing`]; `None` if nothing is bent that way.
    pub fn passing(&self) -> Option<Exits> {
        let bends = !self.thin && !self.smooth && self.eta >= 1.0;
        bends.then(|| exits::passing(self.width.isotropic(), 1.0 / self.eta))
    }

    /// Share of the light from `w`, below a rough boundary, that passes.
    pub fn passes(&self, w: Vec3) -> f32 {
        let back = 1.0 / self.eta;
        let total = self.width.total(w, back);
        total - self.width.reflected(w, back) + (1.0 - self.reflects[1]) * (1.0 - total)
    }

    /// Share of the light from `w` that is reflected, about: for choosing between this and other lobes.
    pub fn reflected(&self, w: Vec3) -> f32 {
        let eta = if w.z < 0.0 && !self.thin {
            1.0 / self.eta
        } else {
            self.eta
        };
        let f = if self.smooth {
            fresnel::dielectric(w.z.abs(), eta).0
        } else {
            let side = usize::from(w.z < 0.0);
            let once = self.width.reflected(w, eta);
            once + self.reflects[side] * self.lost(w, eta)
        };
        self.wall(f.min(1.0))
    }

    /// Reflectance of the wall or the boundary itself.
    #[inline(always)]
    fn wall<V: Lanes>(&self, f: V) -> V {
        if self.thin {
            V::splat(2.0) * f / (V::splat(1.0) + f)
        } else {
            f
        }
    }

    /// Share of the light from `w` that meets more than one facet; `eta` as seen from its side.
    #[inline(always)]
    fn lost(&self, w: Vec3, eta: f32) -> f32 {
        if self.thin {
            1.0 - self.width.single(w)
        } else {
            1.0 - self.width.total(w, eta)
        }
    }

    /// [`lost`](Self::lost) under a coating: what it lets reflect in place of passing is masked otherwise.
    #[inline(always)]
    fn lost_under<C: Coating>(&self, coating: &C, w: Vec3, eta: f32, inside: bool) -> f32 {
        let lost = self.lost(w, eta);
        if C::IS_BARE || self.thin {
            return lost;
        }
        let (mirrors, reflects) = (self.width.single(w), self.width.reflected(w, eta));
        // What facets that reflect nothing would let pass, about.
        let passes = (1.0 - lost - reflects) * mirrors / (mirrors - reflects).max(1e-3);
        let mut adds = 0.0;
        for (cos, weight) in facets::cosines(w.z, self.width.isotropic()) {
            adds += weight * added(coating, cos, eta, inside);
        }
        (lost - adds * (mirrors - passes)).clamp(0.0, 0.99)
    }

    #[inline(always)]
    fn turn(&self, wo: Vec3, wi: Vec3) -> Turned {
        if wo.z >= 0.0 {
            return Turned {
                wo,
                wi,
                eta: self.eta,
                side: 0,
            };
        }
        Turned {
            wo: flip(wo),
            wi: flip(wi),
            eta: if self.thin { self.eta } else { 1.0 / self.eta },
            side: 1,
        }
    }

    /// Value (per power, sr⁻¹) and densities; all zero if smooth.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> ScatterEval {
        self.eval_under(&Bare, wo, wi)
    }

    /// [`eval`](Self::eval) under a coating, which [`under`](Self::under) was told of. Light that meets several facets is not coloured by it.
    #[inline]
    pub fn eval_under<C: Coating>(&self, coating: &C, wo: Vec3, wi: Vec3) -> ScatterEval {
        if self.smooth || wo.z.abs() < GRAZING || wi.z.abs() < GRAZING {
            return ScatterEval::default();
        }
        let t = self.turn(wo, wi);
        let crosses = t.wi.z < 0.0;
        let (there, back) = (t.side, if crosses { 1 - t.side } else { t.side });
        let eta_i = match crosses && !self.thin {
            true => 1.0 / t.eta,
            false => t.eta,
        };
        let inside = self.inside(&t);
        let lo = self.lost_under(coating, t.wo, t.eta, inside);
        let li = self.lost_under(coating, t.wi, eta_i, inside != (crosses && !self.thin));
        let once = if crosses && !self.thin {
            self.refract_once(coating, &t)
        } else {
            self.reflect_once(coating, &t, crosses)
        };
        let (xo, xi) = (self.reflects[there], self.reflects[back]);
        let (xo, xi) = if crosses {
            (1.0 - xo, 1.0 - xi)
        } else {
            (xo, xi)
        };
        ScatterEval {
            f: once.f + Spectrum::splat(xo * lo * li * self.norm[back]),
            forward: (1.0 - lo) * once.forward + lo * xo * t.wi.z.abs() * FRAC_1_PI,
            reverse: (1.0 - li) * once.reverse + li * xi * t.wo.z * FRAC_1_PI,
        }
    }

    /// Reflection at one facet; with `passes`, the thin wall's transmission, which is the same mirrored.
    #[inline(always)]
    fn reflect_once<C: Coating>(&self, coating: &C, t: &Turned, passes: bool) -> ScatterEval {
        let wi = if passes { flip(t.wi) } else { t.wi };
        let Some(h) = (t.wo + wi).try_normalize() else {
            return ScatterEval::default();
        };
        let f = self.wall(coating.reflects(t.wo.dot(h), t.eta, self.inside(t)).0);
        let share = if passes { C::Value::splat(1.0) - f } else { f };
        let normals = self.ggx.d(h);
        let d = 0.25 * C::mean(share) * normals;
        ScatterEval {
            f: (share * 0.25 * normals * self.ggx.g2_over_cos(t.wo, wi)).spectrum(),
            forward: d * self.ggx.g1_over_cos(t.wo),
            reverse: d * self.ggx.g1_over_cos(wi),
        }
    }

    /// Refraction by one facet (Walter et al. 2007, eq. 16, 17 and 21).
    #[inline(always)]
    fn refract_once<C: Coating>(&self, coating: &C, t: &Turned) -> ScatterEval {
        let Some(h) = (t.wo + t.eta * t.wi).try_normalize() else {
            return ScatterEval::default();
        };
        let h = h * 1f32.copysign(h.z);
        let (co, ci) = (t.wo.dot(h), t.wi.dot(h));
        // Facets seen from behind scatter nothing.
        if !(co > 0.0 && ci < 0.0) {
            return ScatterEval::default();
        }
        let normals = self.ggx.d(h);
        let passes = coating.passes(co, -ci, t.eta, self.inside(t));
        let share = C::mean(passes) * normals;
        // dh/dωi with lengths in units of the index on the side of wi, and dh/dωo likewise.
        let (bent_i, bent_o) = (ci + co / t.eta, co + ci * t.eta);
        let forward = share * co * -ci / (bent_i * bent_i);
        let reverse = share * co * -ci / (bent_o * bent_o);
        let value = passes * normals * co * -ci / C::Value::splat(bent_i * bent_i);
        ScatterEval {
            f: (value * self.ggx.g2_over_cos(t.wo, t.wi)).spectrum(),
            forward: forward * self.ggx.g1_over_cos(t.wo),
            reverse: reverse * self.ggx.g1_over_cos(t.wi),
        }
    }

    /// Chooses a direction. The weight is 1 for a smooth boundary, and f·|cos θ_i|/density otherwise; `lobe` is 0 for reflection
    /// and 1 for transmission.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: ScatterDraws) -> Option<ScatterSample> {
        self.sample_under(&Bare, wo, u)
    }

    /// [`sample`](Self::sample) under a coating; the weight of a smooth boundary is then that of the colours among each other.
    #[inline]
    pub fn sample_under<C: Coating>(
        &self,
        coating: &C,
        wo: Vec3,
        u: ScatterDraws,
    ) -> Option<ScatterSample> {
        if wo.z == 0.0 {
            return None;
        }
        let t = self.turn(wo, wo);
        let (wi, crosses) = if self.smooth {
            let (f, cos) = coating.reflects(t.wo.z, t.eta, self.inside(&t));
            let shares = self.wall(f);
            let f = C::mean(shares);
            let crosses = u.lobe >= f;
            let wi = match (crosses, self.thin) {
                (false, _) => Vec3::new(-t.wo.x, -t.wo.y, t.wo.z),
                (true, true) => -t.wo,
                (true, false) => Vec3::new(-t.wo.x / t.eta, -t.wo.y / t.eta, -cos).normalize(),
            };
            let (p, share) = if crosses {
                (1.0 - f, C::Value::splat(1.0) - shares)
            } else {
                (f, shares)
            };
            let wi = if t.side == 1 { flip(wi) } else { wi };
            return Some(ScatterSample {
                weight: C::relative(share, p),
                wi: wi.into(),
                eta: self.bend(crosses, t.eta),
                forward: p,
                reverse: p,
                measure: Measure::Discrete as u32,
                lobe: u32::from(crosses),
            });
        } else {
            self.direction(coating, &t, u)?
        };
        if wi.z == 0.0 || (wi.z < 0.0) != crosses {
            return None;
        }
        let wi = if t.side == 1 { flip(wi) } else { wi };
        let e = self.eval_under(coating, wo, wi);
        (e.forward > 0.0).then(|| ScatterSample {
            weight: e.f * (wi.z.abs() / e.forward),
            wi: wi.into(),
            eta: self.bend(crosses, t.eta),
            forward: e.forward,
            reverse: e.reverse,
            measure: Measure::SolidAngle as u32,
            lobe: u32::from(crosses),
        })
    }

    /// True if light comes from within the body, where a coating lies behind its boundary.
    #[inline(always)]
    fn inside(&self, t: &Turned) -> bool {
        t.side == 1 && !self.thin
    }

    #[inline(always)]
    fn bend(&self, crosses: bool, eta: f32) -> f32 {
        if crosses && !self.thin { eta } else { 1.0 }
    }

    /// A direction from rough facets, with `wo` above, and whether it was meant to cross.
    #[inline(always)]
    fn direction<C: Coating>(
        &self,
        coating: &C,
        t: &Turned,
        u: ScatterDraws,
    ) -> Option<(Vec3, bool)> {
        let lost = self.lost_under(coating, t.wo, t.eta, self.inside(t));
        if u.lobe < lost {
            let wi = warp::cosine_hemisphere(u.dir);
            let crosses = u.lobe >= lost * self.reflects[t.side];
            return Some((if crosses { flip(wi) } else { wi }, crosses));
        }
        let u_side = (u.lobe - lost) / (1.0 - lost);
        let h = self.ggx.sample(t.wo, u.dir);
        let co = t.wo.dot(h);
        let (f, cos) = coating.reflects(co, t.eta, self.inside(t));
        if u_side < C::mean(self.wall(f)) {
            return Some((reflect(t.wo, h), false));
        }
        if self.thin {
            return Some((flip(reflect(t.wo, h)), true));
        }
        let wi = h * (co / t.eta - cos) - t.wo / t.eta;
        Some((wi.try_normalize()?, true))
    }
}

/// What a coating adds to the reflectance of a facet, in the mean of all colours.
#[inline(always)]
fn added<C: Coating>(coating: &C, cos: f32, eta: f32, inside: bool) -> f32 {
    C::mean(coating.reflects(cos, eta, inside).0) - fresnel::dielectric(cos, eta).0
}

/// Mean for diffuse light, 2 ∫ f(μ) μ dμ, of what is smooth.
fn average(f: impl Fn(f32) -> f32) -> f32 {
    const N: u32 = 12;
    let at = |i: u32| ((i as f32 + 0.5) / N as f32).sqrt();
    (0..N).map(|i| f(at(i)) / N as f32).sum()
}

/// Mirrored at the surface.
#[inline(always)]
fn flip(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}
