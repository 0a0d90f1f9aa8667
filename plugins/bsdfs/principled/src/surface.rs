//! The layers at a point, and how they scatter together.

use crate::{Parameters, sheen};
use core::f32::consts::{FRAC_1_PI, FRAC_1_SQRT_2};
use resolvent_api::math::warp;
use resolvent_api::microfacet::fresnel::{self, Tinted};
use resolvent_api::microfacet::{Interface, Reflector, SMOOTH_BELOW, alpha};
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::{Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample, Spectrum, Vec3};

/// The lobes to choose from.
const FUZZ: usize = 0;
const COAT: usize = 1;
const BOUNDARY: usize = 2;
const DIFFUSE: usize = 3;
const BODY: usize = 4;
const LOBES: usize = 5;

/// Index whose Fresnel curve leads from a reflectance that is given itself to that at grazing.
const CURVE_IOR: f32 = 1.5;

/// The dielectric's reflectance: Fresnel's curve for `eta`, from the colour `f0` at normal incidence to `f90` at grazing.
#[derive(Clone, Copy, Debug)]
struct Boundary {
    f0: Spectrum,
    f90: f32,
    /// At least 1: seen from the thinner side.
    eta: f32,
    /// Reflectance of `eta` at normal incidence.
    normal: f32,
}

impl Boundary {
    /// From 0 at normal incidence to 1 at grazing, given the reflectance of `eta`.
    #[inline(always)]
    fn curve(&self, f: f32) -> f32 {
        ((f - self.normal) / (1.0 - self.normal)).max(0.0)
    }

    #[inline(always)]
    fn mix(&self, curve: f32) -> Spectrum {
        self.f0.map(|f0| f0 + (self.f90 - f0) * curve)
    }

    #[inline(always)]
    fn at(&self, cos: f32) -> Spectrum {
        self.mix(self.curve(fresnel::dielectric(cos, self.eta).0))
    }

    fn average(&self) -> Spectrum {
        self.mix(self.curve(fresnel::dielectric_average(self.eta)))
    }
}

/// All layers, resolved.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    boundary: Boundary,
    metal: Tinted,
    metallic: f32,
    /// Share of the diffuse base and its boundary: (1 − metallic)(1 − transmission).
    opaque: f32,
    /// Facets of the metal and of the boundary; `None`: smooth.
    rough: Option<Reflector>,
    /// Reflectance of the boundary for what meets several facets, F_ms.
    multiple: Spectrum,
    /// Base colour over π and over the mean of what reaches the base.
    diffuse: Spectrum,
    /// Mean of the base colour times its share, for choosing.
    diffuse_mean: f32,
    /// Share of the transparent body.
    transparent: f32,
    body: Interface,
    /// Factors of what the body reflects on its outside, and of what passes.
    body_tints: [Spectrum; 2],
    /// Coat and fuzz are on both sides.
    two_sided: bool,
    coat: f32,
    coat_eta: f32,
    coat_rough: Option<Reflector>,
    fuzz: Spectrum,
    fuzz_roughness: f32,
    lanes: u32,
}

/// What the layers do to light from one direction.
struct Passage {
    /// Transmittance of the fuzz, and of fuzz and coat.
    fuzz: f32,
    above: f32,
    /// Share that reaches the diffuse base, relative to what comes through fuzz and coat: 1 − E.
    base: Spectrum,
    /// Probabilities of the lobes.
    choice: [f32; LOBES],
}

impl Surface {
    /// The layers that the parameters describe, in surroundings of index `outside`.
    pub fn new(p: &Parameters, outside: f32, lanes: u32) -> Self {
        let eta = p.ior / outside;
        let bent = eta.max(1.0 / eta);
        let eta_curve = if p.f0.is_some() { CURVE_IOR } else { bent };
        let normal = fresnel::normal_incidence(eta_curve);
        let boundary = Boundary {
            f0: match p.f0 {
                Some(f0) => f0 * p.specular,
                None => p.specular_color.map(|c| (c * normal).min(1.0)) * p.specular,
            },
            f90: p.specular,
            eta: eta_curve,
            normal,
        };
        let transparent = (1.0 - p.metallic) * p.transmission;
        let opaque = (1.0 - p.metallic) * (1.0 - p.transmission);
        let metal = Tinted::new(p.base_color, p.edge_color);
        let widths = alpha(p.roughness, p.anisotropy).map(narrowest);
        let rough = |average| Reflector::new(widths, average, lanes);
        let is_rough = p.roughness >= SMOOTH_BELOW;
        let average = metal.average() * p.metallic + boundary.average() * opaque;
        let tint = p.transmission_color.unwrap_or(p.base_color);
        let outer = p.specular_color.map(|c| c.min(1.0)) * p.specular;
        let coat_eta = p.clearcoat_ior / outside;
        let coat_eta = coat_eta.max(1.0 / coat_eta);
        let coat_average = Spectrum::splat(fresnel::dielectric_average(coat_eta));
        let coat_rough = (p.clearcoat > 0.0 && p.clearcoat_roughness >= SMOOTH_BELOW)
            .then(|| Reflector::new(alpha(p.clearcoat_roughness, 0.0), coat_average, lanes));
        let body_widths = if is_rough { widths } else { [0.0; 2] };
        let mut out = Self {
            boundary,
            metal,
            metallic: p.metallic,
            opaque,
            rough: is_rough.then(|| rough(average)),
            multiple: Spectrum::ZERO,
            diffuse: Spectrum::ZERO,
            diffuse_mean: p.base_color.mean(lanes) * opaque,
            transparent,
            body: Interface::new(body_widths, eta, p.thin),
            body_tints: [outer, tint],
            two_sided: transparent == 0.0 || p.thin,
            coat: p.clearcoat,
            coat_eta,
            coat_rough,
            fuzz: p.sheen_color * p.sheen,
            fuzz_roughness: p.sheen_roughness,
            lanes,
        };
        if let Some(r) = &out.rough {
            out.multiple = r.multiple_reflectance(boundary.average());
        }
        if opaque > 0.0 && !p.base_color.is_zero() {
            let reaches = out.mean_to_base().map(|r| r.max(1e-4));
            out.diffuse = p.base_color.zip(reaches, |c, r| c * opaque * FRAC_1_PI / r);
        }
        out
    }

    /// Mean for diffuse light of the share that reaches the base.
    fn mean_to_base(&self) -> Spectrum {
        let reaches = |e: Spectrum| e.map(|e| 1.0 - e);
        if self.coat == 0.0 && self.fuzz.is_zero() {
            // Of what is interpolated, exactly.
            return match &self.rough {
                None => reaches(self.boundary.average()),
                Some(r) => {
                    let once = r.width().single_average();
                    let f = r.width().reflected_average(self.boundary.eta);
                    reaches(self.boundary_albedo(once, f))
                }
            };
        }
        // By midpoints in μ², which is uniform for diffuse light.
        const N: u32 = 16;
        let mut sum = Spectrum::ZERO;
        for i in 0..N {
            let z = ((i as f32 + 0.5) / N as f32).sqrt();
            let r = (1.0 - z * z).sqrt();
            // Anisotropic facets are asked in a direction between their axes.
            let w = Vec3::new(r * FRAC_1_SQRT_2, r * FRAC_1_SQRT_2, z);
            let (fuzz, coat) = self.layers(w);
            sum += reaches(self.boundary_share(w)) * (fuzz * coat / N as f32);
        }
        sum
    }

    /// The boundary's albedo, if mirrors in its place reflect a share `once` in one scattering and dielectrics `f`.
    #[inline(always)]
    fn boundary_albedo(&self, once: f32, f: f32) -> Spectrum {
        let b = &self.boundary;
        let rising = ((f - b.normal * once) / (1.0 - b.normal)).clamp(0.0, once);
        let single = b.f0.map(|f0| f0 * (once - rising) + b.f90 * rising);
        single + self.multiple * (1.0 - once)
    }

    /// The boundary's albedo for light from `w`.
    #[inline(always)]
    fn boundary_share(&self, w: Vec3) -> Spectrum {
        match &self.rough {
            None => self.boundary.at(w.z.abs()),
            Some(r) => {
                let f = r.width().reflected(w.z.abs(), self.boundary.eta);
                self.boundary_albedo(r.width().single(w), f)
            }
        }
    }

    /// Transmittance of fuzz and coat for light from `w`.
    #[inline(always)]
    fn layers(&self, w: Vec3) -> (f32, f32) {
        if !self.two_sided && w.z < 0.0 {
            return (1.0, 1.0);
        }
        let fuzz = if self.fuzz.is_zero() {
            1.0
        } else {
            1.0 - self.fuzz.max_lane() * sheen::albedo(w.z, self.fuzz_roughness)
        };
        let coat = if self.coat == 0.0 {
            1.0
        } else {
            1.0 - self.coat * self.coat_share(w)
        };
        (fuzz, coat)
    }

    /// Albedo of a coat that is fully there.
    #[inline(always)]
    fn coat_share(&self, w: Vec3) -> f32 {
        match &self.coat_rough {
            None => fresnel::dielectric(w.z.abs(), self.coat_eta).0,
            Some(r) => r.width().reflected(w.z.abs(), self.coat_eta) + r.returned(w)[0],
        }
    }

    /// True if coat and fuzz are on the side of `w`.
    #[inline(always)]
    fn is_layered(&self, w: Vec3) -> bool {
        self.two_sided || w.z > 0.0
    }

    #[inline(always)]
    fn passage(&self, w: Vec3) -> Passage {
        let (fuzz, coat) = self.layers(w);
        let above = fuzz * coat;
        let share = if self.opaque > 0.0 {
            self.boundary_share(w)
        } else {
            Spectrum::ZERO
        };
        let base = share.map(|e| 1.0 - e);
        let mean = |s: Spectrum| s.mean(self.lanes);
        let metal = if self.metallic > 0.0 {
            self.metallic * mean(self.metal.at(w.z.abs()))
        } else {
            0.0
        };
        let mut choice = [0.0; LOBES];
        choice[FUZZ] = (1.0 - fuzz) * mean(self.fuzz) / self.fuzz.max_lane().max(1e-6);
        choice[COAT] = fuzz * (1.0 - coat);
        choice[BOUNDARY] = above * (self.opaque * mean(share) + metal);
        choice[DIFFUSE] = above * self.diffuse_mean * mean(base);
        choice[BODY] = above * self.transparent;
        let sum: f32 = choice.iter().sum();
        if sum > 0.0 {
            choice.iter_mut().for_each(|c| *c /= sum);
        }
        Passage {
            fuzz,
            above,
            base,
            choice,
        }
    }

    /// Reflectance of metal and boundary at a facet.
    #[inline(always)]
    fn reflectance(&self, cos: f32) -> Spectrum {
        let mut f = Spectrum::ZERO;
        if self.metallic > 0.0 {
            f += self.metal.at(cos) * self.metallic;
        }
        if self.opaque > 0.0 {
            f += self.boundary.at(cos) * self.opaque;
        }
        f
    }

    #[inline(always)]
    fn body_tint(&self, wo: Vec3, crosses: bool) -> Spectrum {
        match (crosses, wo.z > 0.0 || self.two_sided) {
            (true, _) => self.body_tints[1],
            (false, true) => self.body_tints[0],
            (false, false) => Spectrum::ONE,
        }
    }

    /// Value and densities, with what is known of both directions.
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3, po: &Passage, pi: &Passage) -> ScatterEval {
        let mut out = ScatterEval::default();
        let mut add = |lobe: usize, factor: Spectrum, e: ScatterEval| {
            out.f += e.f * factor;
            out.forward += po.choice[lobe] * e.forward;
            out.reverse += pi.choice[lobe] * e.reverse;
        };
        let crosses = wo.z * wi.z < 0.0;
        let below = po.above.min(pi.above);
        if self.transparent > 0.0 && !self.body.is_smooth() {
            let tint = self.body_tint(wo, crosses);
            add(
                BODY,
                tint * (self.transparent * below),
                self.body.eval(wo, wi),
            );
        }
        if crosses || wo.z == 0.0 || wi.z == 0.0 {
            return out;
        }
        if self.is_layered(wo) {
            if !self.fuzz.is_zero() {
                let f = sheen::value(wo, wi, self.fuzz_roughness);
                let uniform = 0.5 * FRAC_1_PI;
                add(FUZZ, self.fuzz, same(f, uniform, uniform));
            }
            if self.coat > 0.0
                && let Some(coat) = &self.coat_rough
            {
                let e = coat.eval(wo, wi, |cos| {
                    Spectrum::splat(fresnel::dielectric(cos, self.coat_eta).0)
                });
                add(COAT, Spectrum::splat(self.coat * po.fuzz.min(pi.fuzz)), e);
            }
        }
        if let Some(rough) = &self.rough
            && self.metallic + self.opaque > 0.0
        {
            let e = rough.eval(wo, wi, |cos| self.reflectance(cos));
            add(BOUNDARY, Spectrum::splat(below), e);
        }
        if !self.diffuse.is_zero() {
            let (i, o) = (wi.z.abs() * FRAC_1_PI, wo.z.abs() * FRAC_1_PI);
            let reaches = po.base * pi.base * (po.above * pi.above);
            add(DIFFUSE, self.diffuse * reaches, same(1.0, i, o));
        }
        out
    }

    /// Reflection in a single direction, of a weight besides the choice of the lobe.
    #[inline(always)]
    fn mirror(&self, wo: Vec3, weight: Spectrum, po: &Passage, lobe: usize) -> ScatterSample {
        let p = po.choice[lobe];
        ScatterSample {
            weight: weight * (1.0 / p),
            wi: [-wo.x, -wo.y, wo.z],
            eta: 1.0,
            // Both directions are equally steep, and facets don't tell one sense of an azimuth from the other.
            forward: p,
            reverse: p,
            measure: Measure::Discrete as u32,
            lobe: lobe as u32,
        }
    }
}

#[inline(always)]
fn same(f: f32, forward: f32, reverse: f32) -> ScatterEval {
    ScatterEval {
        f: Spectrum::splat(f),
        forward,
        reverse,
    }
}

#[inline(always)]
fn narrowest(a: f32) -> f32 {
    a.max(SMOOTH_BELOW * SMOOTH_BELOW)
}

impl Scatter for Surface {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        self.evaluate(wo, wi, &self.passage(wo), &self.passage(wi))
    }

    #[inline]
    fn sample(&self, wo: Vec3, mut u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        if wo.z == 0.0 {
            return None;
        }
        let po = self.passage(wo);
        let (lobe, rest) = choose(&po.choice, u.lobe)?;
        u.lobe = rest;
        let up = 1f32.copysign(wo.z);
        let wi = match lobe {
            FUZZ => {
                let w = warp::around_z(1.0 - u.dir[0], u.dir[1]);
                Vec3::new(w.x, w.y, w.z * up)
            }
            COAT => match &self.coat_rough {
                Some(coat) => coat.sample(wo, u)?,
                None => {
                    let f = fresnel::dielectric(wo.z.abs(), self.coat_eta).0;
                    let weight = Spectrum::splat(self.coat * po.fuzz * f);
                    return Some(self.mirror(wo, weight, &po, COAT));
                }
            },
            BOUNDARY => match &self.rough {
                Some(rough) => rough.sample(wo, u)?,
                None => {
                    let weight = self.reflectance(wo.z.abs()) * po.above;
                    return Some(self.mirror(wo, weight, &po, BOUNDARY));
                }
            },
            DIFFUSE => {
                let w = warp::cosine_hemisphere(u.dir);
                Vec3::new(w.x, w.y, w.z * up)
            }
            _ => {
                let s = self.body.sample(wo, u)?;
                if self.body.is_smooth() {
                    return self.through(wo, s, &po);
                }
                Vec3::from(s.wi)
            }
        };
        if wi.z == 0.0 {
            return None;
        }
        let e = self.evaluate(wo, wi, &po, &self.passage(wi));
        (e.forward > 0.0).then(|| ScatterSample {
            weight: e.f * (wi.z.abs() / e.forward),
            wi: wi.into(),
            eta: match (wo.z > 0.0, wi.z > 0.0) {
                (true, false) => self.body.eta(),
                (false, true) => 1.0 / self.body.eta(),
                _ => 1.0,
            },
            forward: e.forward,
            reverse: e.reverse,
            measure: Measure::SolidAngle as u32,
            lobe: lobe as u32,
        })
    }

    fn lobes(&self) -> u32 {
        let mut out = 0;
        let mut set = |present: bool, smooth: bool| {
            if present {
                out |= if smooth { lobes::DELTA } else { lobes::SMOOTH };
            }
        };
        set(!self.diffuse.is_zero() || !self.fuzz.is_zero(), false);
        set(self.coat > 0.0, self.coat_rough.is_none());
        set(self.metallic + self.opaque > 0.0, self.rough.is_none());
        set(self.transparent > 0.0, self.body.is_smooth());
        out
    }

    fn eta(&self) -> f32 {
        self.body.eta()
    }
}

impl Surface {
    /// A sample of the smooth body, as one of all lobes.
    fn through(&self, wo: Vec3, mut s: ScatterSample, po: &Passage) -> Option<ScatterSample> {
        let wi = Vec3::from(s.wi);
        let pi = self.passage(wi);
        let crosses = wi.z * wo.z < 0.0;
        let below = po.above.min(pi.above);
        let (there, back) = (po.choice[BODY], pi.choice[BODY]);
        let factor = self.transparent * below / there;
        s.weight = s.weight * self.body_tint(wo, crosses) * factor;
        s.forward *= there;
        s.reverse *= back;
        s.lobe = BODY as u32;
        Some(s)
    }
}

/// The lobe that a number in [0, 1) falls on, and where in it; `None` if nothing scatters.
#[inline(always)]
fn choose(choice: &[f32; LOBES], u: f32) -> Option<(usize, f32)> {
    let (mut below, mut last) = (0.0, None);
    for (i, &p) in choice.iter().enumerate() {
        if p <= 0.0 {
            continue;
        }
        let rest = (u - below) / p;
        last = Some(i);
        if rest < 1.0 {
            return Some((i, rest.max(0.0)));
        }
        below += p;
    }
    // The probabilities may add up to a little less than 1.
    last.map(|i| (i, 1.0 - f32::EPSILON))
}
