//! The energy of one scattering between anisotropic GGX facets: what [`super::energy`] is for isotropic ones.
//!
//! Two more numbers count here, the ratio of the widths and the azimuth, which would make a large table of values that
//! hardly any scene needs. So a sheet (all directions for one width, one ratio and one index) is integrated when it is first
//! asked for, in a few milliseconds, and kept as long as the program runs; between sheets and in them values are interpolated
//! linearly.

use super::energy::{ETA_END, cosine_at, integrate, node, place};
use super::ggx::Ggx;
use crate::math::Vec3;
use crate::math::warp::around_z;
use core::f32::consts::TAU;
use std::sync::OnceLock;

/// Nodes in the [`place`] of μ from 0 to 1.
const MU_NODES: usize = 30;
/// Nodes in the width that faces the light, from that across the grain to that along it.
const TURN_NODES: usize = 16;
/// Nodes in √α from 0 to 1.
const ALPHA_NODES: usize = 24;
/// Nodes in √ratio from 0 to 1.
const RATIO_NODES: usize = 16;
/// Nodes in √(|η − 1|/(η + 1)) from 0 to √[`ETA_END`].
const ETA_NODES: usize = 26;
/// Fineness of the integration over visible normals.
const CELLS: u32 = 20;
/// Least width: where facets are narrower along one axis, nothing changes any more.
const NARROWEST: f32 = 1e-3;

/// Widths along two axes.
#[derive(Clone, Copy, Debug)]
pub struct Grain {
    /// Width of isotropic facets of the same mean square slope.
    pub(super) alpha: f32,
    /// Narrower width over the wider.
    ratio: f32,
    /// True if the wider axis is y.
    turned: bool,
}

/// Shares reflected, and reflected or transmitted.
type Shares = [f32; 2];

/// All directions for one pair of widths and one index.
struct Sheet {
    shares: [[Shares; MU_NODES]; TURN_NODES],
    average: Shares,
}

/// Sheets by width and ratio.
type Sheets = [[OnceLock<Box<Sheet>>; RATIO_NODES]; ALPHA_NODES];

const fn no_sheets() -> Sheets {
    [const { [const { OnceLock::new() }; RATIO_NODES] }; ALPHA_NODES]
}

static MIRRORS: Sheets = no_sheets();
/// By side, from the optically thinner one and from the denser, and by index.
static DIELECTRICS: [[Sheets; ETA_NODES]; 2] = [const { [const { no_sheets() }; ETA_NODES] }; 2];

/// Where a direction lies in every sheet: nodes and the ways to the next.
#[derive(Clone, Copy)]
struct Place {
    turn: (usize, f32),
    mu: (usize, f32),
}

impl Grain {
    /// From the widths along x and y.
    pub fn new(x: f32, y: f32) -> Self {
        Self {
            alpha: (0.5 * (x * x + y * y)).sqrt(),
            ratio: x.min(y) / x.max(y),
            turned: y > x,
        }
    }

    /// The share that mirrors reflect of light from `w`.
    #[inline]
    pub(super) fn mirrors(&self, w: Vec3) -> f32 {
        let place = self.place(w, 1.0);
        self.between(&MIRRORS, f32::INFINITY, |s| s.at(place)[0])
    }

    /// [`mirrors`](Self::mirrors) for diffuse light, as the other averages.
    pub(super) fn mirrors_average(&self) -> f32 {
        self.between(&MIRRORS, f32::INFINITY, |s| s.average[0])
    }

    /// The share that dielectrics reflect.
    #[inline]
    pub(super) fn reflected(&self, w: Vec3, eta: f32) -> f32 {
        let place = self.place(w, eta);
        self.over_eta(eta, |s| s.at(place)[0])
    }

    pub(super) fn reflected_average(&self, eta: f32) -> f32 {
        self.over_eta(eta, |s| s.average[0])
    }

    /// The share that dielectrics reflect or transmit.
    #[inline]
    pub(super) fn total(&self, w: Vec3, eta: f32) -> f32 {
        let place = self.place(w, eta);
        self.over_eta(eta, |s| s.at(place)[1])
    }

    pub(super) fn total_average(&self, eta: f32) -> f32 {
        self.over_eta(eta, |s| s.average[1])
    }

    /// The azimuth counts by the width that faces the light, √(α_x² cos² φ + α_y² sin² φ): masking depends on nothing else.
    #[inline(always)]
    fn place(&self, w: Vec3, eta: f32) -> Place {
        let (x2, y2) = if self.turned {
            (w.y * w.y, w.x * w.x)
        } else {
            (w.x * w.x, w.y * w.y)
        };
        let facing = if x2 + y2 > 0.0 {
            ((x2 + self.ratio * self.ratio * y2) / (x2 + y2)).sqrt()
        } else {
            1.0
        };
        let turn = (facing - self.ratio) / (1.0 - self.ratio).max(1e-6);
        Place {
            turn: node(turn, TURN_NODES),
            mu: node(place(w.z, eta), MU_NODES),
        }
    }

    /// Interpolates between the sheets around the widths.
    #[inline(always)]
    fn between(&self, sheets: &'static Sheets, eta: f32, value: impl Fn(&Sheet) -> f32) -> f32 {
        let (a, fa) = node(self.alpha.sqrt(), ALPHA_NODES);
        let (r, fr) = node(self.ratio.sqrt(), RATIO_NODES);
        let at = |a: usize, r: usize| {
            value(sheets[a][r].get_or_init(|| Box::new(Sheet::integrate(a, r, eta))))
        };
        let row = |a: usize| at(a, r) * (1.0 - fr) + at(a, r + 1) * fr;
        row(a) * (1.0 - fa) + row(a + 1) * fa
    }

    /// Interpolates between the sheets around `eta`.
    #[inline(always)]
    fn over_eta(&self, eta: f32, value: impl Fn(&Sheet) -> f32) -> f32 {
        let x = (eta - 1.0).abs() / (eta + 1.0) / ETA_END;
        let (e, fe) = node(x.sqrt(), ETA_NODES);
        let at = |e: usize| {
            let x = ETA_END * (e as f32 / (ETA_NODES - 1) as f32).powi(2);
            let there = (1.0 + x) / (1.0 - x);
            let (side, there) = if eta < 1.0 {
                (1, 1.0 / there)
            } else {
                (0, there)
            };
            self.between(&DIELECTRICS[side][e], there, &value)
        };
        at(e) * (1.0 - fe) + at(e + 1) * fe
    }
}

impl Sheet {
    fn integrate(a: usize, r: usize, eta: f32) -> Self {
        let square = |k: usize, n: usize| (k as f32 / (n - 1) as f32).powi(2);
        let (alpha, ratio) = (square(a, ALPHA_NODES), square(r, RATIO_NODES));
        // The widths of this ratio and mean square; smooth facets and grazing light are limits.
        let x = (alpha * (2.0 / (1.0 + ratio * ratio)).sqrt()).max(1e-4);
        let ggx = Ggx {
            alpha: [x, (x * ratio).max(NARROWEST.min(x))],
        };
        let grain = Grain {
            alpha,
            ratio,
            turned: false,
        };
        let mut shares = [[[0.0; 2]; MU_NODES]; TURN_NODES];
        for (p, row) in shares.iter_mut().enumerate() {
            let facing = ratio + (1.0 - ratio) * p as f32 / (TURN_NODES - 1) as f32;
            let cos2 = (facing * facing - ratio * ratio) / (1.0 - ratio * ratio).max(1e-6);
            let turn = cos2.clamp(0.0, 1.0).sqrt().acos() / TAU;
            for (m, out) in row.iter_mut().enumerate() {
                let place = m as f32 / (MU_NODES - 1) as f32;
                let wo = around_z(cosine_at(place, eta).max(1e-5), turn);
                let (reflected, transmitted) = integrate(ggx, wo, eta, CELLS);
                *out = [reflected as f32, (reflected + transmitted) as f32];
            }
        }
        let mut out = Self {
            shares,
            average: [0.0; 2],
        };
        out.average = out.mean(&grain, eta);
        out
    }

    /// ∫ E cos θ dω/π by midpoints in μ² and the azimuth.
    fn mean(&self, grain: &Grain, eta: f32) -> Shares {
        const N: u32 = 64;
        let at = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        let mut sum = [0f64; 2];
        for i in 0..N {
            for k in 0..N / 2 {
                let w = around_z(at(i, N).sqrt(), 0.25 * at(k, N / 2));
                let shares = self.at(grain.place(w, eta));
                (0..2).for_each(|j| sum[j] += f64::from(shares[j]));
            }
        }
        sum.map(|s| (s / f64::from(N * N / 2)) as f32)
    }

    #[inline(always)]
    fn at(&self, place: Place) -> Shares {
        let ((p, fp), (m, fm)) = (place.turn, place.mu);
        let mix = |a: Shares, b: Shares, f: f32| [0, 1].map(|i| a[i] * (1.0 - f) + b[i] * f);
        let row = |p: usize| mix(self.shares[p][m], self.shares[p][m + 1], fm);
        mix(row(p), row(p + 1), fp)
    }
}
