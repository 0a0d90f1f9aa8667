//! The energy of one scattering between GGX facets: how much of the light that arrives from one direction leaves again without
//! meeting a second facet. The rest is what a lobe for multiple scattering has to return (Kulla & Conty 2017, "Revisiting
//! Physically Based Shading at Imageworks").
//!
//! The values depend on the direction's cosine μ, the widths α and the relative index η only; they were integrated once by
//! `examples/energy_tables.rs`, whose output this file includes, and are interpolated linearly in √μ, √α and
//! √(|η − 1|/(η + 1)). Averages for diffuse light are those of the interpolated values, so that a compensated lobe is normalised
//! exactly.

use super::fresnel;
use super::ggx::{Ggx, reflect};
use super::grain;
use crate::math::Vec3;
use std::sync::OnceLock;

/// Nodes in √μ from 0 to 1.
pub const MU_NODES: usize = 24;
/// Nodes in √α from 0 to 1.
pub const ALPHA_NODES: usize = 16;
/// Nodes in √(|η − 1|/(η + 1)) from 0 to √[`ETA_END`].
pub const ETA_NODES: usize = 16;
/// Largest |η − 1|/(η + 1): η = 3 or 1/3. Beyond it the values there are used.
pub const ETA_END: f32 = 0.5;
/// Nodes in α_y/α_x from 0 to 1, and in the azimuth from 0 (along the wider x) to π/2.
pub const TURN_NODES: usize = 5;

/// Values of one kind for all μ and α.
const SHEET: usize = MU_NODES * ALPHA_NODES;
/// Sheets for mirrors: one for each ratio of widths and each azimuth.
const MIRRORS: usize = TURN_NODES * TURN_NODES;
/// Unit of a stored value.
const UNIT: f32 = 1.0 / 65535.0;
/// All sheets as little-endian 16-bit numbers: those for mirrors, then for each η reflected and total from the optically
/// thinner side, and from the denser side.
static TABLE: &[u8; 2 * SHEET * (MIRRORS + 4 * ETA_NODES)] = include_bytes!("energy.bin");

/// Widths of a surface as the tables know them: the isotropic width of the same mean square slope, and the ratio.
#[derive(Clone, Copy, Debug)]
pub struct Width {
    alpha: f32,
    ratio: f32,
    /// True if the wider axis is y.
    turned: bool,
}

impl Width {
    /// Of a distribution of facets.
    pub fn of(ggx: &Ggx) -> Self {
        let [x, y] = ggx.alpha;
        Self {
            alpha: (0.5 * (x * x + y * y)).sqrt(),
            ratio: x.min(y) / x.max(y),
            turned: y > x,
        }
    }

    /// Share of the light from `w` that facets of reflectance 1 reflect in one scattering.
    pub fn single(&self, w: Vec3) -> f32 {
        if self.ratio >= 1.0 {
            return sheet(MIRRORS - 1, w.z, self.alpha);
        }
        let (p, fp) = node(self.turn(w), TURN_NODES);
        let at_ratio = |r: usize| {
            let of = |p: usize| sheet(r * TURN_NODES + p, w.z, self.alpha);
            of(p) * (1.0 - fp) + of(p + 1) * fp
        };
        let (r, fr) = node(self.ratio, TURN_NODES);
        at_ratio(r) * (1.0 - fr) + at_ratio(r + 1) * fr
    }

    /// Azimuth from 0, along the wider axis, to 1 across it.
    fn turn(&self, w: Vec3) -> f32 {
        let (x, y) = if self.turned { (w.y, w.x) } else { (w.x, w.y) };
        y.abs().atan2(x.abs()) * core::f32::consts::FRAC_2_PI
    }

    /// [`single`](Self::single) for diffuse light, ∫ E(ω) cos θ dω/π.
    pub fn single_average(&self) -> f32 {
        if self.ratio >= 1.0 {
            return sheet_average(MIRRORS - 1, self.alpha);
        }
        // Mean over the azimuth of what is interpolated: half a weight for the first node and the last.
        let at_ratio = |r: usize| {
            let sum: f32 = (0..TURN_NODES)
                .map(|p| {
                    let weight = if p == 0 || p + 1 == TURN_NODES {
                        0.5
                    } else {
                        1.0
                    };
                    weight * sheet_average(r * TURN_NODES + p, self.alpha)
                })
                .sum();
            sum / (TURN_NODES - 1) as f32
        };
        let (r, fr) = node(self.ratio, TURN_NODES);
        at_ratio(r) * (1.0 - fr) + at_ratio(r + 1) * fr
    }

    /// Share of the light at cosine `mu` that dielectric facets reflect in one scattering; `eta` is the index of refraction
    /// beyond the surface over that on the side of the light. Anisotropic facets are taken for isotropic ones of the same
    /// mean square slope: the share is small where it matters.
    pub fn reflected(&self, mu: f32, eta: f32) -> f32 {
        over_eta(eta, 0, |s| sheet(s, mu, self.alpha))
    }

    /// [`reflected`](Self::reflected) for diffuse light.
    pub fn reflected_average(&self, eta: f32) -> f32 {
        over_eta(eta, 0, |s| sheet_average(s, self.alpha))
    }

    /// Share of the light from `w` that dielectric facets reflect or transmit in one scattering.
    pub fn total(&self, w: Vec3, eta: f32) -> f32 {
        let mu = w.z.abs();
        let total = over_eta(eta, 1, |s| sheet(s, mu, self.alpha));
        if self.ratio >= 1.0 {
            return total;
        }
        let more = grain::difference(mu, self.turn(w), self.alpha, self.ratio, eta);
        (total + more).clamp(0.0, 1.0)
    }

    /// [`total`](Self::total) for diffuse light.
    pub fn total_average(&self, eta: f32) -> f32 {
        let total = over_eta(eta, 1, |s| sheet_average(s, self.alpha));
        if self.ratio >= 1.0 {
            return total;
        }
        total + grain::difference_average(self.alpha, self.ratio, eta)
    }
}

/// Interpolates between the sheets of one kind (0 reflected, 1 total) around `eta`.
#[inline(always)]
fn over_eta(eta: f32, kind: usize, value: impl Fn(usize) -> f32) -> f32 {
    let side = if eta >= 1.0 { 0 } else { 2 };
    let x = (eta - 1.0).abs() / (eta + 1.0) / ETA_END;
    let (k, f) = node(x.sqrt(), ETA_NODES);
    let of = |k: usize| value(MIRRORS + 4 * k + side + kind);
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

#[inline(always)]
fn sheet(s: usize, mu: f32, alpha: f32) -> f32 {
    let (m, fm) = node(mu.abs().sqrt(), MU_NODES);
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    let row = |a: usize| at(s, a, m) * (1.0 - fm) + at(s, a, m + 1) * fm;
    row(a) * (1.0 - fa) + row(a + 1) * fa
}

/// 2 ∫ E μ dμ = 4 ∫ E t³ dt over t = √μ of what [`sheet`] interpolates: the nodes with the integrals of their hat functions.
fn sheet_average(s: usize, alpha: f32) -> f32 {
    static ROWS: OnceLock<Vec<f32>> = OnceLock::new();
    let rows = ROWS.get_or_init(|| {
        let row = |i: usize| {
            (0..MU_NODES).map(move |m| at(i / ALPHA_NODES, i % ALPHA_NODES, m) * HATS[m])
        };
        (0..TABLE.len() / (2 * MU_NODES))
            .map(|i| row(i).sum())
            .collect()
    });
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    let row = |a: usize| rows[s * ALPHA_NODES + a];
    row(a) * (1.0 - fa) + row(a + 1) * fa
}

const HATS: [f32; MU_NODES] = hats();

/// 4 ∫ t³ hat(t) dt for the hat function of each node, with t = (m ± s)/n: ∫₀¹ (m ± s)³ (1 − s) ds times 4/n⁴.
pub(super) const fn hats<const N: usize>() -> [f32; N] {
    let mut out = [0.0; N];
    let n = (N - 1) as f64;
    let mut m = 0;
    while m < N {
        let k = m as f64;
        // The integral is k³/2 ± k²/2 + k/4 ± 1/20.
        let odd = k * k * k / 2.0 + k / 4.0;
        let even = k * k / 2.0 + 1.0 / 20.0;
        let up = if m + 1 < N { odd + even } else { 0.0 };
        let down = if m > 0 { odd - even } else { 0.0 };
        out[m] = (4.0 * (up + down) / (n * n * n * n)) as f32;
        m += 1;
    }
    out
}

/// What one scattering does with light from `wo` (above): shares reflected and transmitted by dielectric facets of relative index
/// `eta`, or reflected by perfect mirrors if `eta` is infinite. By midpoints of `n`² cells of the visible normals; what the
/// tables are made of.
pub fn integrate(ggx: Ggx, wo: Vec3, eta: f32, n: u32) -> (f64, f64) {
    let (mut reflected, mut transmitted) = (0.0, 0.0);
    let from = ggx.g1_over_cos(wo);
    for i in 0..n * n {
        let u = [i % n, i / n].map(|k| (k as f32 + 0.5) / n as f32);
        let h = ggx.sample(wo, u);
        let cos = wo.dot(h);
        let (f, t) = if eta.is_finite() {
            fresnel::dielectric(cos, eta)
        } else {
            (1.0, 0.0)
        };
        let weight = |wi: Vec3| f64::from(wi.z.abs() * ggx.g2_over_cos(wo, wi) / from);
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
    let cells = f64::from(n * n);
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

    /// Between the nodes, the tables against the integrals they come from; at grazing angles they are coarser.
    #[test]
    fn tables_interpolate_the_integrals() {
        for alpha in [0.003, 0.05, 0.22, 0.6, 0.95] {
            let ggx = round(alpha);
            let width = Width::of(&ggx);
            for (mu, bound) in [(0.93, 0.004), (0.55, 0.005), (0.21, 0.007), (0.043, 0.02)] {
                let wo = around_z(mu, 0.1);
                let (e, _) = integrate(ggx, wo, f32::INFINITY, 64);
                let d = f64::from(width.single(wo)) - e;
                assert!(d.abs() < bound, "mirrors, {alpha} {mu}: off by {d}");
                for eta in [1.02, 1.15, 1.5, 2.3] {
                    let (r, t) = integrate(ggx, wo, eta, 64);
                    let d = f64::from(width.reflected(mu, eta)) - r;
                    assert!(d.abs() < bound, "reflected, {alpha} {mu} {eta}: off by {d}");
                    let d = f64::from(width.total(wo, eta)) - (r + t);
                    assert!(d.abs() < bound, "total, {alpha} {mu} {eta}: off by {d}");
                    let (r, t) = integrate(ggx, wo, 1.0 / eta, 64);
                    let d = f64::from(width.total(wo, 1.0 / eta)) - (r + t);
                    assert!(d.abs() < bound, "inside, {alpha} {mu} {eta}: off by {d}");
                }
            }
        }
    }

    #[test]
    fn anisotropic_facets() {
        for alpha in [[1.0, 0.4], [0.2, 0.6], [0.5, 0.15]] {
            let ggx = Ggx { alpha };
            let width = Width::of(&ggx);
            for turn in [0.03, 0.11, 0.2, 0.45] {
                for mu in [0.9, 0.5, 0.3] {
                    let wo = around_z(mu, turn);
                    let (e, _) = integrate(ggx, wo, f32::INFINITY, 64);
                    let d = f64::from(width.single(wo)) - e;
                    assert!(d.abs() < 0.015, "{alpha:?} {mu} {turn}: off by {d}");
                    for eta in [1.2, 1.5, 1.0 / 1.2, 1.0 / 1.5] {
                        let (r, t) = integrate(ggx, wo, eta, 64);
                        let d = f64::from(width.total(wo, eta)) - (r + t);
                        assert!(d.abs() < 0.03, "{alpha:?} {mu} {turn} {eta}: off by {d}");
                    }
                }
            }
        }
    }

    /// Averages are those of the interpolated values, to rounding.
    #[test]
    fn averages_are_exact() {
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
                assert!(d.abs() < 2e-4, "{d}");
                let r = width.reflected_average(eta);
                let d = mean(&|mu| width.reflected(mu, eta)) - f64::from(r);
                assert!(d.abs() < 2e-5, "{d}");
            }
            let d =
                mean(&|mu| around(mu, &|w| width.single(w))) - f64::from(width.single_average());
            assert!(d.abs() < 1e-4, "{d}");
        }
    }
}
