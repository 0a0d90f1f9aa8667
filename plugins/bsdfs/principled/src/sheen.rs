//! Fuzz: the microfacet sheen of Estevez & Kulla 2017, "Production Friendly Microfacet Sheen BRDF", as KHR_materials_sheen
//! has it. Neither its fitted shadowing nor the usual visibility term of Ashikhmin & Premože 2007 keeps the albedo below 1
//! at grazing angles (narrow distributions reach 1.6 and 2.7 at a cosine of 0.02), so the value is divided by the larger albedo of
//! its two directions where that exceeds 1: reciprocal, and never more than what arrives.

use core::f32::consts::PI;
use resolvent_api::Vec3;
use std::sync::OnceLock;

/// Nodes of the table of albedos in the root of the cosine and in the roughness, both from 0 to 1.
const NODES: usize = 28;
/// Least width of the distribution of fibres: below it single precision has no power left to raise a sine to.
const NARROWEST: f32 = 0.005;

/// f for white fibres, per steradian; `wo` and `wi` on one side.
#[inline(always)]
pub fn value(wo: Vec3, wi: Vec3, roughness: f32) -> f32 {
    let most = look_up(wo.z, roughness).max(look_up(wi.z, roughness));
    microfacets(wo, wi, roughness) / most.max(1.0)
}

/// The value of the model itself.
#[inline(always)]
fn microfacets(wo: Vec3, wi: Vec3, roughness: f32) -> f32 {
    let up = 1f32.copysign(wo.z);
    let Some(h) = (wo + wi).try_normalize() else {
        return 0.0;
    };
    let z = h.z * up;
    let sin2 = ((1.0 - z) * (1.0 + z)).max(0.0);
    let alpha = (roughness * roughness).max(NARROWEST);
    let power = 1.0 / alpha;
    // D = (2 + 1/α) sin^(1/α) θ/(2π), eq. 2.
    let d = (2.0 + power) * sin2.powf(0.5 * power) / (2.0 * PI);
    let (o, i) = (wo.z.abs().max(1e-6), wi.z.abs().max(1e-6));
    d / (4.0 * o * i * (1.0 + shadowing(o, alpha) + shadowing(i, alpha)))
}

/// Λ(θ), eq. 3 and table 1: a curve fitted to the distribution's shadowing up to 60° and mirrored beyond.
#[inline(always)]
fn shadowing(cos: f32, alpha: f32) -> f32 {
    let sharp = (1.0 - alpha) * (1.0 - alpha);
    let mix = |at0: f32, at1: f32| at1 + sharp * (at0 - at1);
    let (a, b, c) = (
        mix(25.3245, 21.5473),
        mix(3.32435, 3.82987),
        mix(0.16801, 0.19823),
    );
    let (d, e) = (mix(-1.27393, -1.97760), mix(-4.85967, -4.32054));
    let curve = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cos < 0.5 {
        curve(cos).exp()
    } else {
        (2.0 * curve(0.5) - curve(1.0 - cos)).exp()
    }
}

/// Share of the light at cosine `mu` that white fibres reflect: of [`value`] itself.
pub fn albedo(mu: f32, roughness: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| tabulate(value));
    interpolate(table, mu, roughness).min(1.0)
}

/// Albedo of the model itself.
#[inline(always)]
fn look_up(mu: f32, roughness: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    interpolate(TABLE.get_or_init(|| tabulate(microfacets)), mu, roughness)
}

#[inline(always)]
fn interpolate(table: &[f32], mu: f32, roughness: f32) -> f32 {
    let node = |x: f32| {
        let x = x.clamp(0.0, 1.0) * (NODES - 1) as f32;
        let k = (x as usize).min(NODES - 2);
        (k, x - k as f32)
    };
    let ((m, fm), (r, fr)) = (node(mu.abs().sqrt()), node(roughness));
    let row = |r: usize| table[r * NODES + m] * (1.0 - fm) + table[r * NODES + m + 1] * fm;
    row(r) * (1.0 - fr) + row(r + 1) * fr
}

/// Albedos at all nodes, when fuzz is first asked for.
fn tabulate(f: impl Fn(Vec3, Vec3, f32) -> f32) -> Vec<f32> {
    let at = |k: usize| k as f32 / (NODES - 1) as f32;
    (0..NODES * NODES)
        .map(|i| integrate(at(i % NODES).powi(2).max(1e-4), at(i / NODES), &f) as f32)
        .collect()
}

/// ∫ f cos θ_i dω_i by midpoints, finer towards grazing directions where fibres are bright.
pub(crate) fn integrate(mu: f32, roughness: f32, f: impl Fn(Vec3, Vec3, f32) -> f32) -> f64 {
    const N: usize = 40;
    let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let mut sum = 0.0;
    for i in 0..N {
        let t = (i as f32 + 0.5) / N as f32;
        let (z, dz) = (t * t, 2.0 * t / N as f32);
        let r = (1.0 - z * z).sqrt();
        for j in 0..N {
            // Half of the azimuth: f is symmetric.
            let phi = PI * (j as f32 + 0.5) / N as f32;
            let wi = Vec3::new(r * phi.cos(), r * phi.sin(), z);
            let omega = dz * 2.0 * PI / N as f32;
            sum += f64::from(f(wo, wi, roughness) * z * omega);
        }
    }
    sum
}
