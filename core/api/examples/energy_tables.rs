//! Integrates the tables of `resolvent_api::microfacet::{energy, grain}` and writes `energy.bin` and `grain.bin` into the folder
//! named by the argument: `cargo run --release -p resolvent-api --example energy_tables -- core/api/src/microfacet`

use resolvent_api::math::warp::around_z;
use resolvent_api::microfacet::Ggx;
use resolvent_api::microfacet::energy::{
    ALPHA_NODES, ETA_END, ETA_NODES, MU_NODES, TURN_NODES, integrate,
};
use resolvent_api::microfacet::grain;
use std::io;

/// Cells along each side of the square of random numbers.
const CELLS: u32 = 160;
/// In place of a ratio of widths of 0.
const NARROWEST: f32 = 1e-3;

fn main() -> io::Result<()> {
    let folder = std::env::args().nth(1).ok_or(io::ErrorKind::InvalidInput)?;
    let folder = std::path::PathBuf::from(folder);
    let mut out = Vec::new();

    for r in 0..TURN_NODES {
        for p in 0..TURN_NODES {
            let ratio = root(r, TURN_NODES).max(NARROWEST);
            let turn = 0.25 * root(p, TURN_NODES);
            write(&mut out, &sheet(f32::INFINITY, ratio, turn).0);
        }
    }
    for k in 0..ETA_NODES {
        let x = ETA_END * root(k, ETA_NODES).powi(2);
        let eta = (1.0 + x) / (1.0 - x);
        for side in [eta, 1.0 / eta] {
            let (reflected, total) = sheet(side, 1.0, 0.0);
            write(&mut out, &reflected);
            write(&mut out, &total);
        }
    }
    std::fs::write(folder.join("energy.bin"), out)?;
    std::fs::write(folder.join("grain.bin"), differences())
}

/// Node `k` of `n` from 0 to 1.
fn root(k: usize, n: usize) -> f32 {
    k as f32 / (n - 1) as f32
}

/// What anisotropy adds to the total share, in the order of [`grain`].
fn differences() -> Vec<u8> {
    let mut out = Vec::new();
    for denser in [false, true] {
        for k in 0..grain::ETA_NODES {
            let x = ETA_END * root(k, grain::ETA_NODES).powi(2);
            let eta = (1.0 + x) / (1.0 - x);
            let eta = if denser { 1.0 / eta } else { eta };
            let round = grain_sheet(eta, 1.0, 0.0);
            for r in 0..grain::RATIO_NODES {
                let ratio = (r as f32 / grain::RATIO_NODES as f32).max(NARROWEST);
                for p in 0..TURN_NODES {
                    let sheet = grain_sheet(eta, ratio, 0.25 * root(p, TURN_NODES));
                    for (a, b) in sheet.iter().zip(&round) {
                        out.extend((((a - b) * 32767.0).round() as i16).to_le_bytes());
                    }
                }
            }
        }
    }
    out
}

/// Total shares at the nodes of [`grain`].
fn grain_sheet(eta: f32, ratio: f32, turn: f32) -> Vec<f64> {
    (0..grain::ALPHA_NODES * grain::MU_NODES)
        .map(|i| {
            let alpha = root(i / grain::MU_NODES, grain::ALPHA_NODES);
            let mu = root(i % grain::MU_NODES, grain::MU_NODES);
            let (r, t) = shares(alpha, mu, eta, ratio, turn, 96);
            r + t
        })
        .collect()
}

/// Reflected and total shares at the nodes of √α and √μ, for light from the azimuth 2π·`turn`.
fn sheet(eta: f32, ratio: f32, turn: f32) -> (Vec<f64>, Vec<f64>) {
    let nodes = (0..ALPHA_NODES * MU_NODES).map(|i| {
        let (alpha, mu) = (
            root(i / MU_NODES, ALPHA_NODES),
            root(i % MU_NODES, MU_NODES),
        );
        let (r, t) = shares(alpha, mu, eta, ratio, turn, CELLS);
        (r, r + t)
    });
    nodes.unzip()
}

/// Shares reflected and transmitted at the given roots of width and cosine.
fn shares(alpha: f32, mu: f32, eta: f32, ratio: f32, turn: f32, cells: u32) -> (f64, f64) {
    // Smooth facets and grazing light are limits: come close, but not to where nothing is defined.
    let (alpha, mu) = (alpha.powi(2).max(1e-4), mu.powi(2).max(1e-5));
    // The widths of this ratio and mean square.
    let x = alpha * (2.0 / (1.0 + ratio * ratio)).sqrt();
    let ggx = Ggx {
        alpha: [x, x * ratio],
    };
    integrate(ggx, around_z(mu, turn), eta, cells)
}

fn write(out: &mut Vec<u8>, values: &[f64]) {
    for v in values {
        out.extend(((v * 65535.0).round() as u16).to_le_bytes());
    }
}
