//! What anisotropy changes in the energy of one scattering between dielectric facets: the difference of the share that is
//! reflected or transmitted to that of isotropic facets of the same mean square slope.
//!
//! Differences are smoother than shares, so a coarser grid does. It was integrated by `examples/energy_tables.rs`, as the
//! tables of [`super::energy`].

use super::energy::{ETA_END, TURN_NODES, hats, node};
use std::sync::OnceLock;

/// Nodes in √μ from 0 to 1.
pub const MU_NODES: usize = 14;
/// Nodes in √α from 0 to 1.
pub const ALPHA_NODES: usize = 10;
/// Nodes in √(|η − 1|/(η + 1)) from 0 to √[`ETA_END`].
pub const ETA_NODES: usize = 8;
/// Nodes in the ratio of widths, from 0 in steps of 1/`RATIO_NODES`; at 1 there is no difference.
pub const RATIO_NODES: usize = 4;

/// Values for all μ and α.
const SHEET: usize = MU_NODES * ALPHA_NODES;
/// Unit of a stored value.
const UNIT: f32 = 1.0 / 32767.0;
/// Sheets as little-endian signed 16-bit numbers: by side (from the thinner, from the denser), η, ratio and azimuth.
static TABLE: &[u8; 2 * SHEET * SHEETS] = include_bytes!("grain.bin");
const SHEETS: usize = 2 * ETA_NODES * RATIO_NODES * TURN_NODES;

/// A value between the sheets around `eta` and `ratio`, of those for azimuth node `turn`.
#[inline(always)]
fn between(eta: f32, ratio: f32, turn: usize, value: impl Fn(usize) -> f32) -> f32 {
    let side = usize::from(eta < 1.0);
    let x = (eta - 1.0).abs() / (eta + 1.0) / ETA_END;
    let (e, fe) = node(x.sqrt(), ETA_NODES);
    let (r, fr) = node(ratio, RATIO_NODES + 1);
    let at = |e: usize, r: usize| {
        if r == RATIO_NODES {
            0.0
        } else {
            value(((side * ETA_NODES + e) * RATIO_NODES + r) * TURN_NODES + turn)
        }
    };
    let at_eta = |e: usize| at(e, r) * (1.0 - fr) + at(e, r + 1) * fr;
    at_eta(e) * (1.0 - fe) + at_eta(e + 1) * fe
}

#[inline(always)]
fn stored(sheet: usize, a: usize, m: usize) -> f32 {
    let i = 2 * (sheet * SHEET + a * MU_NODES + m);
    f32::from(i16::from_le_bytes([TABLE[i], TABLE[i + 1]])) * UNIT
}

/// The difference for light at cosine `mu`, at `turn` (0 along the wider axis, 1 across it).
pub fn difference(mu: f32, turn: f32, alpha: f32, ratio: f32, eta: f32) -> f32 {
    let (m, fm) = node(mu.sqrt(), MU_NODES);
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    let sheet = |s: usize| {
        let row = |a: usize| stored(s, a, m) * (1.0 - fm) + stored(s, a, m + 1) * fm;
        row(a) * (1.0 - fa) + row(a + 1) * fa
    };
    let (p, fp) = node(turn, TURN_NODES);
    between(eta, ratio, p, sheet) * (1.0 - fp) + between(eta, ratio, p + 1, sheet) * fp
}

/// The mean of [`difference`] for diffuse light, of what is interpolated.
pub fn difference_average(alpha: f32, ratio: f32, eta: f32) -> f32 {
    static ROWS: OnceLock<Vec<f32>> = OnceLock::new();
    let rows = ROWS.get_or_init(|| {
        let hats = hats::<MU_NODES>();
        (0..SHEETS * ALPHA_NODES)
            .map(|i| {
                let at = |m| stored(i / ALPHA_NODES, i % ALPHA_NODES, m);
                (0..MU_NODES).map(|m| at(m) * hats[m]).sum()
            })
            .collect()
    });
    let (a, fa) = node(alpha.sqrt(), ALPHA_NODES);
    let sheet = |s: usize| {
        let row = |a: usize| rows[s * ALPHA_NODES + a];
        row(a) * (1.0 - fa) + row(a + 1) * fa
    };
    let sum: f32 = (0..TURN_NODES)
        .map(|p| {
            let end = p == 0 || p + 1 == TURN_NODES;
            between(eta, ratio, p, sheet) * if end { 0.5 } else { 1.0 }
        })
        .sum();
    sum / (TURN_NODES - 1) as f32
}
