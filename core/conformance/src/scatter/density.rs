//! The density of a closure integrated over a grid on the sphere.

use super::{Measured, wide};
use crate::quadrature::gauss;
use core::f64::consts::{FRAC_PI_2, PI};
use resolvent_api::math::DVec3;
use resolvent_api::{Mode, Scatter, ScatterEval, Vec3};

/// Rings of constant polar angle between a pole and the equator, spaced logarithmically so that a peak of any width at the
/// pole is resolved (|g| = 0.9999 has one of 10⁻⁴).
const RINGS: usize = 140;
/// Innermost ring, radians.
const INNERMOST: f64 = 1e-6;
/// Sectors of azimuth.
pub const SECTORS: usize = 12;
/// Panels of quadrature in each sector.
const PANELS: usize = 3;
/// How often a panel may be quartered.
const DEPTH: u32 = 5;
/// Deviation between two rules at which a panel is quartered.
const FINE: f64 = 2e-5;
/// Weights of the rule of degree 3 that uses the outer nodes and the middle one of the 5-point rule on [−1, 1]:
/// 1/(3 x²) for the outer, 2 − 2/(3 x²) for the middle, x = 0.90618.
const COARSE: [f64; 5] = [0.405_928_877_1, 0.0, 1.188_142_245_8, 0.0, 0.405_928_877_1];
/// Bands of polar angle in the histogram, of about equal probability.
pub const BANDS: usize = 24;

/// The density over the sphere for one `wo`.
pub struct Density {
    /// The known direction.
    pub wo: Vec3,
    /// How values weigh directions.
    pub measured: Measured,
    /// What is carried.
    pub mode: Mode,
    /// ∫ forward dω: 1, or less where sampling may fail.
    pub total: f64,
    /// ∫ f |cos| dω per lane: the albedo.
    pub albedo: [f64; 4],
    /// ∫ f |cos| (axis·wi) dω of lane 0, over the albedo: the mean cosine.
    pub mean_cosine: f64,
    /// Probability of each band and sector, band by band.
    pub bins: Vec<f64>,
    frame: [DVec3; 3],
    /// Upper polar angle of each band.
    edges: Vec<f64>,
}

/// Polar angles that separate the rings, from pole to pole.
fn rings() -> Vec<f64> {
    let half = (0..=RINGS)
        .map(|i| INNERMOST * (FRAC_PI_2 / INNERMOST).powf(i as f64 / RINGS as f64))
        .collect::<Vec<_>>();
    let mut out = vec![0.0];
    out.extend(&half);
    out.extend(half.iter().rev().skip(1).map(|t| PI - t));
    out.push(PI);
    out
}

/// What is integrated at once: the density, f |cos| of all lanes, and that of lane 0 times the cosine to the axis.
#[derive(Clone, Copy)]
struct Masses([f64; 6]);

impl Masses {
    fn add(&mut self, o: Self, weight: f64) {
        self.0
            .iter_mut()
            .zip(o.0)
            .for_each(|(a, b)| *a += weight * b);
    }
}

/// Integral over a rectangle of polar angle and azimuth by 5 × 5 points. Where a rule with the 3 × 3 of them that reach the rim
/// says something else, as where a peak or an edge lies inside, it is quartered, at most `depth` times.
fn patch(at: &impl Fn(f64, f64) -> Masses, polar: [f64; 2], turn: [f64; 2], depth: u32) -> Masses {
    let (mut fine, mut coarse) = (Masses([0.0; 6]), Masses([0.0; 6]));
    let half = 0.25 * (polar[1] - polar[0]) * (turn[1] - turn[0]);
    for (i, (theta, u)) in gauss(polar[0], polar[1]).enumerate() {
        for (j, (phi, v)) in gauss(turn[0], turn[1]).enumerate() {
            let m = at(theta, phi);
            fine.add(m, u * v);
            coarse.add(m, half * COARSE[i] * COARSE[j]);
        }
    }
    let off = fine.0[..4].iter().zip(coarse.0).map(|(a, b)| (a - b).abs());
    if depth == 0 || off.fold(0.0, f64::max) < FINE {
        return fine;
    }
    let mut sum = Masses([0.0; 6]);
    let middle = [0.5 * (polar[0] + polar[1]), 0.5 * (turn[0] + turn[1])];
    for polar in [[polar[0], middle[0]], [middle[0], polar[1]]] {
        for turn in [[turn[0], middle[1]], [middle[1], turn[1]]] {
            sum.add(patch(at, polar, turn, depth - 1), 1.0);
        }
    }
    sum
}

impl Density {
    /// Integrates `k` for `wo`; the grid's poles are ±`axis`.
    pub fn new(k: &impl Scatter, measured: Measured, wo: Vec3, axis: Vec3, mode: Mode) -> Self {
        Self::of(measured, wo, axis, mode, |wi| k.eval(wo, wi, mode))
    }

    /// The same of the density that `k` states for the swapped pair, against the walk.
    pub fn adjoint(k: &impl Scatter, measured: Measured, wo: Vec3, axis: Vec3, mode: Mode) -> Self {
        Self::of(measured, wo, axis, mode, |wi| {
            let e = k.eval(wi, wo, mode);
            ScatterEval {
                forward: e.reverse,
                ..e
            }
        })
    }

    fn of(
        measured: Measured,
        wo: Vec3,
        axis: Vec3,
        mode: Mode,
        eval: impl Fn(Vec3) -> ScatterEval,
    ) -> Self {
        let n = wide(axis).normalize();
        let s = n.any_orthonormal_vector();
        let frame = [s, n.cross(s), n];
        let rings = rings();
        let (mut albedo, mut cosine) = ([0.0; 4], 0.0);
        let mut mass = vec![[0.0; SECTORS]; rings.len() - 1];
        let at = |theta: f64, phi: f64| {
            let (sin, cos) = theta.sin_cos();
            let w = frame[0] * (sin * phi.cos()) + frame[1] * (sin * phi.sin()) + frame[2] * cos;
            let wi = w.as_vec3();
            let e = eval(wi);
            let reflected = measured.cosine(wi) * sin;
            let f = e.f.0.map(|f| f64::from(f) * reflected);
            Masses([
                f64::from(e.forward) * sin,
                f[0],
                f[1],
                f[2],
                f[3],
                f[0] * cos,
            ])
        };
        let step = 2.0 * PI / (SECTORS * PANELS) as f64;
        for (ring, mass) in rings.windows(2).zip(&mut mass) {
            for (j, mass) in mass.iter_mut().enumerate() {
                for panel in j * PANELS..(j + 1) * PANELS {
                    let turn = [panel as f64 * step, (panel + 1) as f64 * step];
                    let Masses(m) = patch(&at, [ring[0], ring[1]], turn, DEPTH);
                    *mass += m[0];
                    albedo.iter_mut().zip(&m[1..]).for_each(|(a, m)| *a += m);
                    cosine += m[5];
                }
            }
        }
        let ring_mass: Vec<f64> = mass.iter().map(|m| m.iter().sum()).collect();
        let total: f64 = ring_mass.iter().sum();
        // Bands end at the ring where their share of the probability is reached.
        let (mut edges, mut bins) = (Vec::new(), Vec::new());
        let (mut below, mut band) = (0.0, [0.0; SECTORS]);
        for (i, m) in mass.iter().enumerate() {
            below += ring_mass[i];
            band.iter_mut().zip(m).for_each(|(b, m)| *b += m);
            // The last band takes all that is left: a sliver at the far pole would expect next to nothing, yet hold the one
            // number in 2²⁴ that maps to the pole itself.
            let full =
                edges.len() + 1 < BANDS && below >= total * (edges.len() + 1) as f64 / BANDS as f64;
            if full || i + 1 == mass.len() {
                edges.push(rings[i + 1]);
                bins.extend(band);
                band = [0.0; SECTORS];
            }
        }
        Self {
            wo,
            measured,
            mode,
            total,
            albedo,
            mean_cosine: if albedo[0] > 0.0 {
                cosine / albedo[0]
            } else {
                0.0
            },
            bins,
            frame,
            edges,
        }
    }

    /// The bin of a direction.
    pub fn bin(&self, wi: Vec3) -> usize {
        let w = wide(wi);
        let local = self.frame.map(|axis| axis.dot(w));
        let theta = local[0].hypot(local[1]).atan2(local[2]);
        let band = self.edges.partition_point(|&e| e < theta);
        let turn = local[1].atan2(local[0]) / (2.0 * PI);
        let sector = ((turn - turn.floor()) * SECTORS as f64) as usize;
        band.min(self.edges.len() - 1) * SECTORS + sector.min(SECTORS - 1)
    }

    /// Cosine between a direction and the grid's axis.
    pub fn cosine(&self, wi: Vec3) -> f64 {
        self.frame[2].dot(wide(wi))
    }
}
