//! Where facets send light: the cosines under which it leaves, for each cosine under which it came.
//!
//! A layer above rough facets (varnish, fuzz) transmits by the direction, and what comes back to the facets from below it meets them
//! again. How much that is depends on how light is spread over cosines, which these tables say: integrated when they are first
//! asked for, in some ten milliseconds, and interpolated linearly.

use super::energy::{ETA_END, Width, cosine_at, node, place};
use super::fresnel;
use super::ggx::{Ggx, reflect};
use crate::math::Vec3;
use crate::math::warp::around_z;
use std::sync::OnceLock;

/// Nodes in the root of the cosine, from 0 to 1.
pub const NODES: usize = 10;
/// Nodes in √α from 0 to 1.
const ALPHA_NODES: usize = 12;
/// Nodes in √((1 − η)/(1 + η)) from 0 to √[`ETA_END`].
const ETA_NODES: usize = 10;
/// Fineness of the integration over visible normals.
const CELLS: u32 = 20;

/// Values at the nodes.
pub type Curve = [f32; NODES];
/// For each node of the cosine of arrival the shares that leave around each node.
pub type Exits = [Curve; NODES];

/// The cosine of a node.
pub fn mu_at(k: usize) -> f32 {
    (k as f32 / (NODES - 1) as f32).powi(2)
}

/// A curve with values from 0 to 2 in the few bytes that a closure has left.
#[derive(Clone, Copy, Debug)]
pub struct Packed([u16; NODES]);

/// Unit of a packed value.
const UNIT: f32 = 1.0 / 32767.0;

impl Packed {
    /// Rounded; values beyond the range are clamped to it.
    pub fn new(curve: &Curve) -> Self {
        Self(curve.map(|v| (v / UNIT + 0.5) as u16))
    }

    /// The value at a cosine.
    #[inline(always)]
    pub fn at(&self, mu: f32) -> f32 {
        self.between(mu.abs().sqrt())
    }

    /// The value of a curve over the [`place`] of a cosine seen from the denser side, `eta` < 1.
    #[inline(always)]
    pub fn at_place(&self, mu: f32, eta: f32) -> f32 {
        self.between(place(mu, eta))
    }

    #[inline(always)]
    fn between(&self, place: f32) -> f32 {
        let (k, f) = node(place, NODES);
        let at = |k: usize| f32::from(self.0[k]) * UNIT;
        at(k) * (1.0 - f) + at(k + 1) * f
    }
}

/// Exits of light from facets of width `alpha` that lose nothing, by one scattering or more: each row adds up to 1.
pub fn mirrors(alpha: f32) -> Exits {
    static TABLE: OnceLock<Vec<Exits>> = OnceLock::new();
    let table = TABLE.get_or_init(|| (0..ALPHA_NODES).map(mirrors_of).collect());
    let (a, f) = node(alpha.sqrt(), ALPHA_NODES);
    mixed(&table[a], &table[a + 1], f)
}

/// Exits of light through dielectric facets towards the thinner side, `eta` < 1 being its index over that of the side where the
/// light comes from; rows are at the places of cosines, and add up to 1.
pub fn passing(alpha: f32, eta: f32) -> Exits {
    static TABLE: OnceLock<Vec<Exits>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        (0..ETA_NODES * ALPHA_NODES)
            .map(|i| passing_of(i / ALPHA_NODES, i % ALPHA_NODES))
            .collect()
    });
    let x = (1.0 - eta) / (1.0 + eta) / ETA_END;
    let (e, fe) = node(x.max(0.0).sqrt(), ETA_NODES);
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    let row = |e: usize| {
        mixed(
            &table[e * ALPHA_NODES + a],
            &table[e * ALPHA_NODES + a + 1],
            fa,
        )
    };
    mixed(&row(e), &row(e + 1), fe)
}

fn mixed(a: &Exits, b: &Exits, f: f32) -> Exits {
    core::array::from_fn(|o| core::array::from_fn(|k| a[o][k] * (1.0 - f) + b[o][k] * f))
}

fn width(a: usize) -> f32 {
    (a as f32 / (ALPHA_NODES - 1) as f32).powi(2).max(1e-4)
}

fn mirrors_of(a: usize) -> Exits {
    let alpha = width(a);
    let ggx = Ggx { alpha: [alpha; 2] };
    // What meets several facets leaves by (1 − E) μ.
    let of = Width::of(&ggx);
    let again = spread(|mu| 1.0 - of.single(around_z(mu, 0.0)));
    core::array::from_fn(|o| {
        let wo = around_z(mu_at(o).max(1e-3), 0.0);
        let mut row = once(ggx, wo, |h| Some(reflect(wo, h)).filter(|w| w.z > 0.0));
        let lost = 1.0 - row.iter().sum::<f32>();
        row.iter_mut()
            .zip(again)
            .for_each(|(r, again)| *r += lost * again);
        row
    })
}

fn passing_of(e: usize, a: usize) -> Exits {
    let alpha = width(a);
    let ggx = Ggx { alpha: [alpha; 2] };
    let x = ETA_END * (e as f32 / (ETA_NODES - 1) as f32).powi(2);
    let eta = (1.0 - x) / (1.0 + x);
    let of = Width::of(&ggx);
    let again = spread(|mu| 1.0 - of.total(around_z(mu, 0.0), 1.0 / eta));
    // Of what meets several facets this part passes, see [`super::Interface`].
    let lost = [eta, 1.0 / eta].map(|eta| (1.0 - of.total_average(eta)).max(1e-6));
    let passes = (1.0 - fresnel::dielectric_average(eta)) * (lost[1] / lost[0]).min(1.0);
    core::array::from_fn(|o| {
        let mu = cosine_at(o as f32 / (NODES - 1) as f32, eta);
        let wo = around_z(mu.max(1e-3), 0.0);
        let mut row = weighted(ggx, wo, |h| {
            let cos = wo.dot(h);
            let (f, t) = fresnel::dielectric(cos, eta);
            let wi = h * (cos / eta - t) - wo / eta;
            (f < 1.0 && wi.z < 0.0).then_some((wi, 1.0 - f))
        });
        let lost = passes * (1.0 - of.total(wo, eta)).max(1e-5);
        row.iter_mut()
            .zip(again)
            .for_each(|(r, again)| *r += lost * again);
        let sum: f32 = row.iter().sum();
        row.map(|v| v / sum)
    })
}

fn once(ggx: Ggx, wo: Vec3, to: impl Fn(Vec3) -> Option<Vec3>) -> Curve {
    weighted(ggx, wo, |h| to(h).map(|w| (w, 1.0)))
}

/// Shares of light from `wo` around each node, by the direction and the share that each facet gives; cells as in
/// [`super::energy::integrate`].
fn weighted(ggx: Ggx, wo: Vec3, to: impl Fn(Vec3) -> Option<(Vec3, f32)>) -> Curve {
    let mut out = [0.0; NODES];
    let from = ggx.g1_over_cos(wo);
    for i in 0..2 * CELLS * CELLS {
        let steep = 1.0 - ((i / CELLS) as f32 + 0.5) / (2 * CELLS) as f32;
        let u = [
            ((i % CELLS) as f32 + 0.5) / CELLS as f32,
            1.0 - steep * steep,
        ];
        let Some((wi, share)) = to(ggx.sample(wo, u)) else {
            continue;
        };
        let weight = 2.0 * steep * share * wi.z.abs() * ggx.g2_over_cos(wo, wi) / from;
        let (k, f) = node(wi.z.abs().sqrt(), NODES);
        let part = weight / (2 * CELLS * CELLS) as f32;
        out[k] += part * (1.0 - f);
        out[k + 1] += part * f;
    }
    out
}

/// Shares around each node of light that leaves by the cosine alone.
pub fn diffuse() -> &'static Curve {
    static CURVE: OnceLock<Curve> = OnceLock::new();
    CURVE.get_or_init(|| spread(|_| 1.0))
}

/// Shares around each node of light that leaves by `f` times the cosine, adding up to 1.
fn spread(f: impl Fn(f32) -> f32) -> Curve {
    const STEPS: u32 = 256;
    let mut out = [0.0; NODES];
    for i in 0..STEPS {
        let mu = ((i as f32 + 0.5) / STEPS as f32).sqrt();
        let (k, t) = node(mu.sqrt(), NODES);
        out[k] += f(mu) * (1.0 - t);
        out[k + 1] += f(mu) * t;
    }
    let sum: f32 = out.iter().sum::<f32>().max(1e-9);
    out.map(|v| v / sum)
}

/// What reflection below a layer of transmittance `t` is to be weighted by, h(μo) h(μi), so that nothing is lost there: the curve h
/// with h(μo) ∫ M(μo, μi) h(μi) = t(μo), where M are the exits of what lies below. What is returned is the integral, t/h, which is
/// smoother and nowhere 0. Light that the layer sends back down
/// is in it. For smooth mirrors that is √t, for diffuse surfaces t over the root of its mean; the iteration is that of Sinkhorn & Knopp
/// (1967) for symmetric scalings.
pub fn passage(t: &Curve, below: &Exits) -> Curve {
    let mut h = t.map(|t| t.max(0.0).sqrt());
    let met = |h: &Curve| -> Curve {
        core::array::from_fn(|o| below[o].iter().zip(h).map(|(m, h)| m * h).sum())
    };
    for _ in 0..6 {
        let met = met(&h);
        h = core::array::from_fn(|o| (h[o] * t[o] / met[o].max(1e-6)).max(0.0).sqrt());
    }
    met(&h)
}
