//! Integrates the tables of `resolvent_api::microfacet::energy` and writes them to the file named by the argument:
//! `cargo run --release -p resolvent-api --example energy_tables -- core/api/src/microfacet/energy.bin`

use resolvent_api::math::warp::around_z;
use resolvent_api::microfacet::Ggx;
use resolvent_api::microfacet::energy::{
    ALPHA_NODES, ETA_END, ETA_NODES, MU_NODES, TURN_NODES, integrate,
};
use std::io;

/// Cells along each side of the square of random numbers.
const CELLS: u32 = 160;

fn main() -> io::Result<()> {
    let path = std::env::args().nth(1).ok_or(io::ErrorKind::InvalidInput)?;
    let mut out = Vec::new();
    let root = |k: usize, n: usize| k as f32 / (n - 1) as f32;
    for r in 0..TURN_NODES {
        for p in 0..TURN_NODES {
            let ratio = root(r, TURN_NODES).max(1e-3);
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
    std::fs::write(path, out)
}

/// Reflected and total shares at the nodes of √α and √μ, for light from the azimuth 2π·`turn`.
fn sheet(eta: f32, ratio: f32, turn: f32) -> (Vec<f64>, Vec<f64>) {
    let nodes = (0..ALPHA_NODES * MU_NODES).map(|i| {
        let root = |k: usize, n: usize| k as f32 / (n - 1) as f32;
        // Smooth facets and grazing light are limits: come close, but not to where nothing is defined.
        let alpha = root(i / MU_NODES, ALPHA_NODES).powi(2).max(1e-4);
        let mu = root(i % MU_NODES, MU_NODES).powi(2).max(1e-5);
        // The widths of this ratio and mean square.
        let x = alpha * (2.0 / (1.0 + ratio * ratio)).sqrt();
        let ggx = Ggx {
            alpha: [x, x * ratio],
        };
        let (r, t) = integrate(ggx, around_z(mu, turn), eta, CELLS);
        (r, r + t)
    });
    nodes.unzip()
}

fn write(out: &mut Vec<u8>, values: &[f64]) {
    for v in values {
        out.extend(((v * 65535.0).round() as u16).to_le_bytes());
    }
}
