//! Integrates the tables of `resolvent_api::microfacet::energy` and writes them to the file named by the argument:
//! `cargo run --release -p resolvent-api --example energy_tables -- core/api/src/microfacet/energy.bin`

use resolvent_api::math::warp::around_z;
use resolvent_api::microfacet::Ggx;
use resolvent_api::microfacet::energy::{
    ALPHA_NODES, ETA_NODES, MU_NODES, cosine_at, eta_at, integrate,
};
use std::io;

/// Fineness of the integration over visible normals.
const CELLS: u32 = 80;

fn main() -> io::Result<()> {
    let file = std::env::args().nth(1).ok_or(io::ErrorKind::InvalidInput)?;
    let mut out = Vec::new();
    write(&mut out, &sheet(f32::INFINITY).0);
    for k in 0..ETA_NODES {
        let eta = eta_at(k);
        for side in [eta, 1.0 / eta] {
            let (reflected, total) = sheet(side);
            write(&mut out, &reflected);
            write(&mut out, &total);
        }
    }
    std::fs::write(file, out)
}

/// Node `k` of `n` from 0 to 1.
fn root(k: usize, n: usize) -> f32 {
    k as f32 / (n - 1) as f32
}

/// Reflected and total shares at the nodes of √α and of the cosine.
fn sheet(eta: f32) -> (Vec<f64>, Vec<f64>) {
    let nodes = (0..ALPHA_NODES * MU_NODES).map(|i| {
        let alpha = root(i / MU_NODES, ALPHA_NODES).powi(2);
        let mu = cosine_at(root(i % MU_NODES, MU_NODES), eta);
        // Smooth facets and grazing light are limits: come close, but not to where nothing is defined.
        let ggx = Ggx {
            alpha: [alpha.max(1e-4); 2],
        };
        let (r, t) = integrate(ggx, around_z(mu.max(1e-5), 0.0), eta, CELLS);
        (r, r + t)
    });
    nodes.unzip()
}

fn write(out: &mut Vec<u8>, values: &[f64]) {
    for v in values {
        out.extend(((v * 65535.0).round() as u16).to_le_bytes());
    }
}
