//! The energy of one scattering between GGX facets: how much of the light that arrives from one direction leaves again without
//! meeting a second facet. The rest is what a lobe for multiple scattering has to return (Kulla & Conty 2017, "Revisiting
//! Physically Based Shading at Imageworks").
//!
//! The values depend on the direction's cosine μ, the width α and the relative index η only; they were integrated once by
//! `examples/energy_tables.rs`, whose output this file includes, and are interpolated linearly in [`place`] of μ, √α and
//! √(|η − 1|/(η + 1)). Anisotropic facets have tables of their own, see [`Grain`].

use super::fresnel;
use super::ggx::{Ggx, reflect};
use super::grain::Grain;
use crate::math::Vec3;
use std::sync::OnceLock;

/// Nodes in the [`place`] of μ from 0 to 1.
pub const MU_NODES: usize = 36;
/// Nodes in √α from 0 to 1.
pub const ALPHA_NODES: usize = 22;
/// Nodes in √(|η − 1|/(η + 1)) from 0 to √[`ETA_END`].
pub const ETA_NODES: usize = 18;
/// Largest |η − 1|/(η + 1): η = 3 or 1/3. Beyond it the values there are used.
pub const ETA_END: f32 = 0.5;

/// Values of one kind for all μ and α.
const SHEET: usize = MU_NODES * ALPHA_NODES;
/// Unit of a stored value.
const UNIT: f32 = 1.0 / 65535.0;
/// All sheets as little-endian 16-bit numbers: that for mirrors, then for each η reflected and total from the optically
/// thinner side, and from the denser side.
static TABLE: &[u8; 2 * SHEET * (1 + 4 * ETA_NODES)] = include_bytes!("energy.bin");

/// Widths of a surface as the tables know them.
#[derive(Clone, Copy, Debug)]
pub enum Width {
    /// The same in all directions.
    Round(f32),
    /// Wider along one axis.
    Grain(Grain),
}

impl Width {
    /// Of a distribution of facets.
    pub fn of(ggx: &Ggx) -> Self {
        let [x, y] = ggx.alpha;
        if x == y {
            Self::Round(x)
        } else {
            Self::Grain(Grain::new(x, y))
        }
    }

    /// The width of isotropic facets of the same mean square slope.
    pub fn isotropic(&self) -> f32 {
        match self {
            Self::Round(alpha) => *alpha,
            Self::Grain(grain) => grain.alpha,
        }
    }

    /// Share of the light from `w` that facets of reflectance 1 reflect in one scattering.
    #[inline(always)]
    pub fn single(&self, w: Vec3) -> f32 {
        match self {
            Self::Round(alpha) => sheet(w.z.abs().sqrt(), *alpha)(0),
            Self::Grain(grain) => grain.mirrors(w),
        }
    }

    /// [`single`](Self::single) for diffuse light, ∫ E(ω) cos θ dω/π.
    pub fn single_average(&self) -> f32 {
        match self {
            Self::Round(alpha) => sheet_average(*alpha)(0),
            Self::Grain(grain) => grain.mirrors_average(),
        }
    }

    /// Share of the light from `w` that dielectric facets reflect in one scattering; `eta` is the index of refraction
    /// beyond the surface over that on the side of the light.
    #[inline(always)]
    pub fn reflected(&self, w: Vec3, eta: f32) -> f32 {
        match self {
            Self::Round(alpha) => over_eta(eta, 0, sheet(place(w.z, eta), *alpha)),
            Self::Grain(grain) => grain.reflected(w, eta),
        }
    }

    /// [`reflected`](Self::reflected) for diffuse light.
    pub fn reflected_average(&self, eta: f32) -> f32 {
        match self {
            Self::Round(alpha) => over_eta(eta, 0, sheet_average(*alpha)),
            Self::Grain(grain) => grain.reflected_average(eta),
        }
    }

    /// Share of the light from `w` that dielectric facets reflect or transmit in one scattering.
    #[inline(always)]
    pub fn total(&self, w: Vec3, eta: f32) -> f32 {
        match self {
            Self::Round(alpha) => over_eta(eta, 1, sheet(place(w.z, eta), *alpha)),
            Self::Grain(grain) => grain.total(w, eta),
        }
    }

    /// [`total`](Self::total) for diffuse light.
    pub fn total_average(&self, eta: f32) -> f32 {
        match self {
            Self::Round(alpha) => over_eta(eta, 1, sheet_average(*alpha)),
            Self::Grain(grain) => grain.total_average(eta),
        }
    }
}

/// Interpolates between the sheets of one kind (0 reflected, 1 total) around `eta`.
#[inline(always)]
fn over_eta(eta: f32, kind: usize, value: impl Fn(usize) -> f32) -> f32 {
    let side = if eta >= 1.0 { 0 } else { 2 };
    let x = (eta - 1.0).abs() / (eta + 1.0) / ETA_END;
    let (k, f) = node(x.sqrt(), ETA_NODES);
    let of = |k: usize| value(1 + 4 * k + side + kind);
    of(k) * (1.0 - f) + of(k + 1) * f
}

/// The node below `x` in [0, 1], never the last, and the way to the next.
#[inline(always)]
pub(super) fn node(x: f32, nodes: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let k = (x as usize).min(nodes - 2);
    (k, x - k as f32)
}

#[inline(always)]
fn at(sheet: usize, a: usize, m: usize) -> f32 {
    let i = 2 * (sheet * SHEET + a * MU_NODES + m);
    f32::from(u16::from_le_bytes([TABLE[i], TABLE[i + 1]])) * UNIT
}

/// The value at a [`place`] and a width, in a sheet.
#[inline(always)]
fn sheet(place: f32, alpha: f32) -> impl Fn(usize) -> f32 {
    let (m, fm) = node(place, MU_NODES);
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    move |s| {
        let row = |a: usize| at(s, a, m) * (1.0 - fm) + at(s, a, m + 1) * fm;
        row(a) * (1.0 - fa) + row(a + 1) * fa
    }
}

/// The mean of a sheet's values for diffuse light, 2 ∫ E μ dμ, at a width.
fn sheet_average(alpha: f32) -> impl Fn(usize) -> f32 {
    static ROWS: OnceLock<Vec<f32>> = OnceLock::new();
    let rows = ROWS.get_or_init(averages);
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    move |s| {
        let row = |a: usize| rows[s * ALPHA_NODES + a];
        row(a) * (1.0 - fa) + row(a + 1) * fa
    }
}

/// Means of all rows, of what is interpolated in them.
fn averages() -> Vec<f32> {
    (0..1 + 4 * ETA_NODES)
        .flat_map(|s| {
            let eta = if s == 0 { 1.0 } else { eta_at((s - 1) / 4) };
            let eta = if s > 0 && (s - 1) % 4 >= 2 {
                1.0 / eta
            } else {
                eta
            };
            let weights = average_weights::<MU_NODES>(eta);
            (0..ALPHA_NODES).map(move |a| (0..MU_NODES).map(|m| at(s, a, m) * weights[m]).sum())
        })
        .collect()
}

/// The index at a node, at least 1.
pub fn eta_at(k: usize) -> f32 {
    let x = ETA_END * (k as f32 / (ETA_NODES - 1) as f32).powi(2);
    (1.0 + x) / (1.0 - x)
}

/// Part of the nodes for directions beyond the critical angle.
const BEYOND: f32 = 0.45;

/// Where a cosine lies between the tables' nodes, from 0 to 1: √μ; seen from the denser side the nodes keep their places
/// relative to the critical angle, where values change abruptly.
#[inline(always)]
pub fn place(mu: f32, eta: f32) -> f32 {
    let mu = mu.abs();
    if eta >= 1.0 {
        return mu.sqrt();
    }
    let critical = ((1.0 - eta) * (1.0 + eta)).sqrt();
    if mu < critical {
        BEYOND * (mu / critical).sqrt()
    } else {
        BEYOND + (1.0 - BEYOND) * ((mu - critical) / (1.0 - critical)).sqrt()
    }
}

/// The cosine at a [`place`].
pub fn cosine_at(place: f32, eta: f32) -> f32 {
    if eta >= 1.0 {
        return place * place;
    }
    let critical = ((1.0 - eta) * (1.0 + eta)).sqrt();
    if place < BEYOND {
        critical * (place / BEYOND).powi(2)
    } else {
        critical + (1.0 - critical) * ((place - BEYOND) / (1.0 - BEYOND)).powi(2)
    }
}

/// Weights of nodes in 2 ∫ f μ dμ for what is interpolated linearly in the [`place`] of μ, by midpoints.
fn average_weights<const N: usize>(eta: f32) -> [f32; N] {
    const STEPS: usize = 4096;
    let mut out = [0f64; N];
    for i in 0..STEPS {
        // Uniform in μ².
        let mu = ((i as f32 + 0.5) / STEPS as f32).sqrt();
        let (m, f) = node(place(mu, eta), N);
        out[m] += f64::from(1.0 - f);
        out[m + 1] += f64::from(f);
    }
    out.map(|w| (w / STEPS as f64) as f32)
}

/// What one scattering does with light from `wo` (above): shares reflected and transmitted by dielectric facets of relative index
/// `eta`, or reflected by perfect mirrors if `eta` is infinite. By midpoints of 2`n`² cells of the visible normals, finer
/// towards the steepest ones, which lose the most; what the tables are made of.
pub fn integrate(ggx: Ggx, wo: Vec3, eta: f32, n: u32) -> (f64, f64) {
    let (mut reflected, mut transmitted) = (0.0, 0.0);
    let from = ggx.g1_over_cos(wo);
    for i in 0..2 * n * n {
        let steep = 1.0 - ((i / n) as f32 + 0.5) / (2 * n) as f32;
        let u = [((i % n) as f32 + 0.5) / n as f32, 1.0 - steep * steep];
        let cell = 2.0 * steep;
        let h = ggx.sample(wo, u);
        let cos = wo.dot(h);
        let (f, t) = if eta.is_finite() {
            fresnel::dielectric(cos, eta)
        } else {
            (1.0, 0.0)
        };
        let weight = |wi: Vec3| f64::from(cell * wi.z.abs() * ggx.g2_over_cos(wo, wi) / from);
        let wi = reflect(wo, h);
        if wi.z > 0.0 {
            reflected += f64::from(f) * weight(wi);
        }
        if f < 1.0 {
            let wi = h * (cos / eta - t) - wo / eta;
            if wi.z < 0.0 {
                transmitted += f64::from(1.0 - f) * weight(wi);
            }
        }
    }
    let cells = f64::from(2 * n * n);
    (reflected / cells, transmitted / cells)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::warp::around_z;

    fn round(alpha: f32) -> Ggx {
        Ggx {
            alpha: [alpha, alpha],
        }
    }

    /// Between the nodes, the tables against the integrals they come from.
    #[test]
    fn tables_interpolate_the_integrals() {
        const BOUND: f64 = 0.01;
        for alpha in [0.003, 0.05, 0.22, 0.6, 0.95] {
            let ggx = round(alpha);
            let width = Width::of(&ggx);
            for mu in [0.93, 0.55, 0.21, 0.043] {
                let wo = around_z(mu, 0.1);
                let (e, _) = integrate(ggx, wo, f32::INFINITY, 48);
                let d = f64::from(width.single(wo)) - e;
                assert!(d.abs() < BOUND, "mirrors, {alpha} {mu}: off by {d}");
                for eta in [1.02, 1.15, 1.5, 2.3] {
                    let (r, t) = integrate(ggx, wo, eta, 48);
                    let d = f64::from(width.reflected(wo, eta)) - r;
                    assert!(d.abs() < 0.012, "reflected, {alpha} {mu} {eta}: off by {d}");
                    let d = f64::from(width.total(wo, eta)) - (r + t);
                    assert!(d.abs() < BOUND, "total, {alpha} {mu} {eta}: off by {d}");
                    let (r, t) = integrate(ggx, wo, 1.0 / eta, 48);
                    let d = f64::from(width.total(wo, 1.0 / eta)) - (r + t);
                    assert!(d.abs() < BOUND, "inside, {alpha} {mu} {eta}: off by {d}");
                }
            }
        }
    }

    #[test]
    fn anisotropic_facets() {
        for alpha in [[1.0, 0.4], [0.2, 0.6], [1.2, 0.15]] {
            let ggx = Ggx { alpha };
            let width = Width::of(&ggx);
            for turn in [0.03, 0.11, 0.2, 0.45] {
                for mu in [0.9, 0.5, 0.3, 0.06] {
                    let wo = around_z(mu, turn);
                    let (e, _) = integrate(ggx, wo, f32::INFINITY, 48);
                    let d = f64::from(width.single(wo)) - e;
                    assert!(d.abs() < 0.01, "{alpha:?} {mu} {turn}: off by {d}");
                    for eta in [1.2, 1.5, 1.0 / 1.2, 1.0 / 1.5] {
                        let (r, t) = integrate(ggx, wo, eta, 48);
                        let d = f64::from(width.total(wo, eta)) - (r + t);
                        assert!(d.abs() < 0.012, "{alpha:?} {mu} {turn} {eta}: off by {d}");
                    }
                    let (r, _) = integrate(ggx, wo, 1.5, 48);
                    let d = f64::from(width.reflected(wo, 1.5)) - r;
                    assert!(d.abs() < 0.01, "{alpha:?} {mu} {turn}: off by {d}");
                }
            }
        }
    }

    /// Averages are those of the interpolated values; between nodes, where the [`place`] of a cosine moves, nearly.
    #[test]
    fn averages_are_those_of_the_values() {
        for alpha in [[0.3, 0.3], [0.8, 0.8], [0.9, 0.35]] {
            let width = Width::of(&Ggx { alpha });
            let n = 2000;
            let at = |i: u32| (i as f32 + 0.5) / n as f32;
            let mean = |f: &dyn Fn(f32) -> f32| {
                let sum: f64 = (0..n).map(|i| f64::from(f(at(i).sqrt()))).sum();
                sum / f64::from(n)
            };
            let around = |mu: f32, f: &dyn Fn(Vec3) -> f32| -> f32 {
                (0..64)
                    .map(|k| f(around_z(mu, (k as f32 + 0.5) / 64.0)) / 64.0)
                    .sum()
            };
            for eta in [1.3, 1.0 / 1.3] {
                let d = mean(&|mu| around(mu, &|w| width.total(w, eta)))
                    - f64::from(width.total_average(eta));
                assert!(d.abs() < 1e-3, "{d}");
                let r = width.reflected_average(eta);
                let d = mean(&|mu| around(mu, &|w| width.reflected(w, eta))) - f64::from(r);
                assert!(d.abs() < 1e-3, "{d}");
            }
            let d =
                mean(&|mu| around(mu, &|w| width.single(w))) - f64::from(width.single_average());
            assert!(d.abs() < 1e-3, "{d}");
        }
    }
}
