//! The layers at a point, and how they scatter together.

use crate::boundary::Boundary;
use crate::diffuse::Diffuse;
use crate::layers::{Layers, Passed, darkening};
use crate::skin::Skin;
use crate::{Parameters, sheen};
use core::f32::consts::{FRAC_1_PI, FRAC_1_SQRT_2};
use resolvent_api::math::warp;
use resolvent_api::microfacet::energy::Width;
use resolvent_api::microfacet::fresnel::{self, Tinted};
use resolvent_api::microfacet::{Film, Interface, Reflector, SMOOTH_BELOW, alpha};
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::{Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample, Spectrum, Vec3};

/// The lobes to choose from.
const FUZZ: usize = 0;
const COAT: usize = 1;
const BOUNDARY: usize = 2;
const DIFFUSE: usize = 3;
const BODY: usize = 4;
/// What the layers send back into the body.
const BACK: usize = 5;
const LOBES: usize = 6;

/// Index whose Fresnel curve leads from a reflectance that is given itself to that at grazing.
const CURVE_IOR: f32 = 1.5;

/// All layers, resolved; what lies on the base directly is `S`.
#[derive(Clone, Copy, Debug)]
pub struct Surface<S> {
    skin: S,
    boundary: Boundary,
    metal: Tinted,
    /// Share of the metal, times what the coat above darkens it by.
    metallic: Spectrum,
    /// Share of the diffuse base and its boundary: (1 − metallic)(1 − transmission).
    opaque: f32,
    /// Facets of the metal and of the boundary; `None`: smooth.
    rough: Option<Reflector>,
    /// Reflectance of the boundary for what meets several facets, F_ms.
    multiple: Spectrum,
    /// Base colour over π and over the mean of what reaches the base.
    diffuse: Spectrum,
    rough_diffuse: Diffuse,
    /// Mean of the base colour times its share, for choosing.
    diffuse_mean: f32,
    /// Share of the transparent body.
    transparent: f32,
    body: Interface,
    /// Factors of what the body reflects on its outside, and of what passes.
    body_tints: [Spectrum; 2],
    layers: Layers,
    lanes: u32,
}

/// What is known of one direction.
struct Passage {
    layers: Passed,
    /// Share that reaches the diffuse base, relative to what comes through fuzz and coat: 1 − E.
    base: Spectrum,
    /// Share of light from inside that the layers send back.
    back: f32,
    /// Probabilities of the lobes.
    choice: [f32; LOBES],
}

impl<S: Skin> Surface<S> {
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
        let darker = if p.clearcoat * p.clearcoat_darkening > 0.0 {
            let dark = darkening(p.base_color, (p.clearcoat_ior / outside).max(1.0));
            dark.map(|d| 1.0 + p.clearcoat * p.clearcoat_darkening * (d - 1.0))
        } else {
            Spectrum::ONE
        };
        let metal = Tinted::new(p.base_color, p.edge_color);
        let metallic = darker * p.metallic;
        let widths = alpha(p.roughness, p.anisotropy).map(narrowest);
        let is_rough = p.roughness >= SMOOTH_BELOW;
        let skin = S::new(p, outside, &metal);
        // Of a part that is not there a film need not be asked.
        let asked = |there: bool| there || S::IS_BARE;
        let metal_average = match asked(p.metallic > 0.0) {
            true => skin.metal_average(&metal),
            false => Spectrum::ZERO,
        };
        let boundary_average = match asked(opaque > 0.0) {
            true => skin.boundary_average(&boundary),
            false => Spectrum::ZERO,
        };
        let parts = [
            (metallic, metal_average),
            (Spectrum::splat(opaque), boundary_average),
        ];
        let tint = p.transmission_color.unwrap_or(p.base_color);
        let outer = p.specular_color.map(|c| c.min(1.0)) * p.specular;
        let body_widths = if is_rough { widths } else { [0.0; 2] };
        let body = Interface::new(body_widths, eta, p.thin);
        let body = if transparent > 0.0 {
            body.under(skin.coat())
        } else {
            body
        };
        let mut layers = Layers::new(p, outside, transparent == 0.0 || p.thin, lanes);
        let facets = is_rough.then_some(widths);
        layers.over(facets, (transparent > 0.0).then_some(&body));
        let mut out = Self {
            skin,
            boundary,
            metal,
            metallic,
            opaque,
            rough: is_rough.then(|| Reflector::of_parts(widths, parts, lanes)),
            multiple: Spectrum::ZERO,
            diffuse: Spectrum::ZERO,
            rough_diffuse: Diffuse::new(p.diffuse_roughness, p.base_color),
            diffuse_mean: p.base_color.mean(lanes) * opaque,
            transparent,
            body,
            body_tints: [outer, tint],
            layers,
            lanes,
        };
        if let Some(r) = &out.rough {
            out.multiple = r.multiple_reflectance(boundary_average);
        }
        if opaque > 0.0 && !p.base_color.is_zero() {
            let reaches = out.mean_to_base().map(|r| r.max(1e-4));
            let lanes = out.lanes;
            out.rough_diffuse = out.rough_diffuse.below(|mu| {
                let r = ((1.0 - mu * mu).max(0.0) * 0.5).sqrt();
                let [fuzz, coat] = out.layers.transmittances(mu);
                let share = out.boundary_share(Vec3::new(r, r, mu));
                (1.0 - share.mean(lanes)) * fuzz * coat
            });
            let seen = p.base_color * darker;
            out.diffuse = seen.zip(reaches, |c, r| c * opaque * FRAC_1_PI / r);
        }
        out
    }

    /// Mean for diffuse light of the share that reaches the base.
    fn mean_to_base(&self) -> Spectrum {
        let reaches = |e: Spectrum| e.map(|e| 1.0 - e);
        if self.layers.is_bare() {
            return match &self.rough {
                None => reaches(self.skin.boundary_average(&self.boundary)),
                Some(r) => {
                    let once = r.width().single_average();
                    let f = r.width().reflected_average(self.boundary.eta);
                    let share = self.boundary_albedo(once, f);
                    if S::IS_BARE {
                        return reaches(share);
                    }
                    let adds = Film::average(|mu| self.adds(r.width(), warp::around_z(mu, 0.125)));
                    reaches(share + adds)
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
            let [fuzz, coat] = self.layers.transmittances(z);
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
            None => self.skin.boundary(&self.boundary, w.z.abs()),
            Some(r) => {
                let width = r.width();
                let (once, f) = (width.single(w), width.reflected(w, self.boundary.eta));
                let share = self.boundary_albedo(once, f);
                if S::IS_BARE {
                    return share;
                }
                (share + self.adds(width, w)).map(|v| v.clamp(0.0, 1.0))
            }
        }
    }

    /// What the skin adds to the boundary's albedo for light from `w`.
    #[inline(always)]
    fn adds(&self, width: &Width, w: Vec3) -> Spectrum {
        self.skin.adds(&self.boundary, w.z, width.isotropic()) * width.single(w)
    }

    #[inline(always)]
    fn passage(&self, w: Vec3) -> Passage {
        let layers = self.layers.passed(w);
        let share = if self.opaque > 0.0 {
            self.boundary_share(w)
        } else {
            Spectrum::ZERO
        };
        let base = share.map(|e| 1.0 - e);
        let mean = |s: Spectrum| s.mean(self.lanes);
        let metal = if self.metallic.is_zero() {
            0.0
        } else {
            mean(self.metallic * self.skin.metal_roughly(&self.metal, w.z.abs()))
        };
        let (fuzz, above) = (layers.fuzz, layers.above);
        let mut choice = [0.0; LOBES];
        choice[FUZZ] =
            (1.0 - fuzz) * mean(self.layers.fuzz) / self.layers.fuzz.max_lane().max(1e-6);
        if layers.coat_way.z * w.z > 0.0 {
            choice[COAT] = fuzz - above;
        }
        choice[BOUNDARY] = above * (self.opaque * mean(share) + metal);
        choice[DIFFUSE] = above * self.diffuse_mean * mean(base);
        let mut back = 0.0;
        if self.transparent > 0.0 {
            if !self.layers.covers(w) && !self.body.is_smooth() {
                back = self.layers.sent_back(w, &self.body);
            }
            choice[BODY] = above * self.transparent * (1.0 - back);
            choice[BACK] = self.transparent * back;
        }
        let sum: f32 = choice.iter().sum();
        if sum > 0.0 {
            choice.iter_mut().for_each(|c| *c /= sum);
        }
        Passage {
            layers,
            base,
            back,
            choice,
        }
    }

    /// Reflectance of metal and boundary at a facet.
    #[inline(always)]
    fn reflectance(&self, cos: f32) -> Spectrum {
        let mut f = Spectrum::ZERO;
        if !self.metallic.is_zero() {
            f += self.skin.metal(&self.metal, cos) * self.metallic;
        }
        if self.opaque > 0.0 {
            f += self.skin.boundary(&self.boundary, cos) * self.opaque;
        }
        f
    }

    #[inline(always)]
    fn body_tint(&self, wo: Vec3, crosses: bool) -> Spectrum {
        match (crosses, self.layers.covers(wo)) {
            (true, _) => self.body_tints[1],
            (false, true) => self.body_tints[0],
            (false, false) => Spectrum::ONE,
        }
    }

    /// Value and densities, with what is known of both directions.
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3, po: &Passage, pi: &Passage, mode: Mode) -> ScatterEval {
        let mut out = ScatterEval::default();
        let mut add = |lobe: usize, factor: Spectrum, e: ScatterEval| {
            out.f += e.f * factor;
            out.forward += po.choice[lobe] * e.forward;
            out.reverse += pi.choice[lobe] * e.reverse;
        };
        let crosses = wo.z * wi.z < 0.0;
        let (lo, li) = (&po.layers, &pi.layers);
        let tint = lo.tint * li.tint;
        let reflects = tint * (lo.reflects * li.reflects);
        if self.transparent > 0.0 && !self.body.is_smooth() {
            // Where only one side is covered, what passes is dimmed once; on both, it is spread like what is reflected.
            let passes = if crosses && !self.layers.two_sided {
                tint * (lo.above * li.above)
            } else {
                reflects
            };
            let factor = self.body_tint(wo, crosses) * passes * self.transparent;
            add(BODY, factor, self.body.eval_under(self.skin.coat(), wo, wi));
        }
        if crosses || wo.z == 0.0 || wi.z == 0.0 {
            return out;
        }
        let (i, o) = (wi.z.abs() * FRAC_1_PI, wo.z.abs() * FRAC_1_PI);
        let layers = &self.layers;
        if po.back > 0.0 {
            let f = layers.back(po.back, pi.back);
            add(BACK, Spectrum::splat(self.transparent), same(f, i, o));
        }
        if layers.covers(wo) {
            if !layers.fuzz.is_zero() {
                let f = sheen::value(wo, wi, layers.fuzz_roughness);
                let uniform = 0.5 * FRAC_1_PI;
                add(FUZZ, layers.fuzz, same(f, uniform, uniform));
            }
            if layers.coat > 0.0
                && let Some(coat) = &layers.coat_rough
                && let Some(cosines) = self.coat_cosines(wo, wi, lo.coat_way, li.coat_way, mode)
            {
                let e = coat.eval(lo.coat_way, li.coat_way, |cos| {
                    Spectrum::splat(fresnel::dielectric(cos, layers.coat_eta).0)
                });
                let there = layers.coat * lo.fuzz.min(li.fuzz) * cosines;
                add(COAT, Spectrum::splat(there), e);
            }
        }
        if let Some(rough) = &self.rough
            && (self.opaque > 0.0 || !self.metallic.is_zero())
        {
            let e = rough.eval(wo, wi, |cos| self.reflectance(cos));
            add(BOUNDARY, reflects, e);
        }
        if !self.diffuse.is_zero() {
            let reaches = po.base * pi.base * tint * (lo.above * li.above);
            let f = self.diffuse * self.rough_diffuse.value(wo, wi);
            add(DIFFUSE, f * reaches, same(1.0, i, o));
        }
        out
    }

    /// What a coat with a normal n of its own carries over one that follows the base: |n·ωi|/|ωi.z|, or the same of ωo in
    /// importance mode. `None` where coat and base are not on the same side. `o` and `i` are the directions in the coat's frame.
    #[inline(always)]
    fn coat_cosines(&self, wo: Vec3, wi: Vec3, o: Vec3, i: Vec3, mode: Mode) -> Option<f32> {
        if !self.layers.coat_tilt.is_some() {
            return Some(1.0);
        }
        let (w, own) = match mode {
            Mode::Radiance => (wi, i),
            Mode::Importance => (wo, o),
        };
        // Along the surface the quotient grows without bound, the light it stands for not.
        (o.z * wo.z > 0.0 && i.z * wi.z > 0.0).then(|| own.z.abs() / w.z.abs().max(1e-6))
    }

    /// Reflection by a smooth coat.
    fn coat_mirror(&self, wo: Vec3, po: &Passage, mode: Mode) -> Option<ScatterSample> {
        let layers = &self.layers;
        let o = po.layers.coat_way;
        let f = fresnel::dielectric(o.z.abs(), layers.coat_eta).0;
        let weight = Spectrum::splat(layers.coat * po.layers.fuzz * f);
        let mut s = self.mirror(wo, weight, po, COAT);
        if layers.coat_tilt.is_some() {
            let i = Vec3::new(-o.x, -o.y, o.z);
            let wi = layers.coat_tilt.leave(i).normalize();
            if wi.z * wo.z <= 0.0 {
                return None;
            }
            let pi = self.passage(wi);
            // Fuzz dims the pair as it does that of a rough coat; the cosines' quotient is that of the delta's weight.
            let fuzz = po.layers.fuzz.min(pi.layers.fuzz) / po.layers.fuzz;
            s.weight *= fuzz * self.coat_cosines(wo, wi, o, i, mode)? * wi.z / i.z;
            s.wi = wi.into();
            s.reverse = pi.choice[COAT];
        }
        Some(s)
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

impl<S: Skin> Scatter for Surface<S> {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        self.evaluate(wo, wi, &self.passage(wo), &self.passage(wi), mode)
    }

    #[inline]
    fn sample(&self, wo: Vec3, mut u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
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
            COAT => match &self.layers.coat_rough {
                Some(coat) => {
                    let wi = coat.sample(po.layers.coat_way, u)?;
                    let wi = self.layers.coat_tilt.leave(wi);
                    if wi.z * wo.z <= 0.0 {
                        return None;
                    }
                    wi
                }
                None => return self.coat_mirror(wo, &po, mode),
            },
            BOUNDARY => match &self.rough {
                Some(rough) => rough.sample(wo, u)?,
                None => {
                    let tint = po.layers.tint * po.layers.tint;
                    let weight = self.reflectance(wo.z.abs()) * tint * po.layers.above;
                    return Some(self.mirror(wo, weight, &po, BOUNDARY));
                }
            },
            DIFFUSE | BACK => {
                let w = warp::cosine_hemisphere(u.dir);
                Vec3::new(w.x, w.y, w.z * up)
            }
            _ if self.body.is_smooth() => return self.through(wo, u, &po),
            _ => Vec3::from(self.body.sample_under(self.skin.coat(), wo, u)?.wi),
        };
        if wi.z == 0.0 {
            return None;
        }
        // A cosine that rounding carried beyond 1 has no sine.
        let wi = Vec3::new(wi.x, wi.y, wi.z.clamp(-1.0, 1.0));
        let e = self.evaluate(wo, wi, &po, &self.passage(wi), mode);
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
        set(
            !self.diffuse.is_zero() || !self.layers.fuzz.is_zero(),
            false,
        );
        set(self.layers.coat > 0.0, self.layers.coat_rough.is_none());
        set(
            self.opaque > 0.0 || !self.metallic.is_zero(),
            self.rough.is_none(),
        );
        set(self.transparent > 0.0, self.body.is_smooth());
        out
    }

    fn eta(&self) -> f32 {
        self.body.eta()
    }
}

impl<S: Skin> Surface<S> {
    /// A sample of the smooth body, as one of all lobes. From inside, the layers send back a part of what passes.
    fn through(&self, wo: Vec3, mut u: ScatterDraws, po: &Passage) -> Option<ScatterSample> {
        let out = self.layers.covers(wo) || self.layers.is_bare();
        let mut kept = 1.0;
        if !out {
            let last = 1.0 - f32::EPSILON;
            let u_last = ScatterDraws { lobe: last, ..u };
            let passes = self.body.sample_under(self.skin.coat(), wo, u_last)?;
            if Vec3::from(passes.wi).z > 0.0 {
                kept = self.passage(passes.wi.into()).layers.above;
                let through = passes.forward * kept;
                if u.lobe < 1.0 - through {
                    // The body's own reflection and what the layers send back, one as steep as the other.
                    let weight = (Spectrum::ONE - passes.weight * through) * self.transparent;
                    let mut s = self.mirror(wo, weight, po, BODY);
                    s.weight = s.weight / (1.0 - through);
                    s.forward *= 1.0 - through;
                    s.reverse = s.forward;
                    return Some(s);
                }
                u.lobe = last;
            }
        }
        let mut s = self.body.sample_under(self.skin.coat(), wo, u)?;
        let wi = Vec3::from(s.wi);
        let pi = self.passage(wi);
        let crosses = wi.z * wo.z < 0.0;
        let (lo, li) = (&po.layers, &pi.layers);
        let (there, back) = (po.choice[BODY], pi.choice[BODY]);
        let tint = self.body_tint(wo, crosses) * lo.tint * li.tint;
        // From outside the layers dim what comes; from inside the choice does.
        let dims = match (out, crosses && !self.layers.two_sided) {
            (true, true) => lo.above,
            (true, false) => lo.reflects * li.reflects,
            (false, _) => 1.0,
        };
        s.weight = s.weight * tint * (self.transparent * dims / there);
        if crosses && !self.layers.two_sided {
            s.forward *= kept;
            s.reverse *= lo.above;
        }
        s.forward *= there;
        s.reverse *= back;
        s.lobe = BODY as u32;
        (s.forward > 0.0).then_some(s)
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
