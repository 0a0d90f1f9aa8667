//! Gradient and cellular noise on the integer lattice, from a hash of the cell.

use resolvent_api::math::DVec3;
use resolvent_api::rng::{mix, unit};

fn hash(cell: [i64; 3], seed: u64) -> u64 {
    cell.iter().fold(seed, |h, &c| mix(h ^ c as u64))
}

/// Perlin's gradient noise (Perlin 2002), scaled into [−1, 1]: the gradients' lengths bound it by √3/2 · √(3/2) before.
fn perlin(p: DVec3, seed: u64) -> f64 {
    let base = p.floor();
    let f = p - base;
    let fade = f * f * f * (f * (f * 6.0 - DVec3::splat(15.0)) + DVec3::splat(10.0));
    let mut sum = 0.0;
    for corner in 0..8i64 {
        let at = [corner & 1, corner >> 1 & 1, corner >> 2];
        let cell = [base.x as i64 + at[0], base.y as i64 + at[1], base.z as i64 + at[2]];
        let at = DVec3::new(at[0] as f64, at[1] as f64, at[2] as f64);
        let h = hash(cell, seed);
        // One of the twelve edges of a cube: two components ±1, one 0.
        let sign = |bit: u64| if h & bit == 0 { 1.0 } else { -1.0 };
        let d = f - at;
        let [u, v] = match h >> 8 & 0xffff {
            e if e % 3 == 0 => [d.x, d.y],
            e if e % 3 == 1 => [d.y, d.z],
            _ => [d.z, d.x],
        };
        let w = (DVec3::ONE - at) + (at * 2.0 - DVec3::ONE) * fade;
        sum += w.x * w.y * w.z * (sign(1) * u + sign(2) * v);
    }
    sum.clamp(-1.0, 1.0)
}

/// 1 at the points of a jittered lattice and 0 where the nearest is a cell's edge away (Worley 1996, inverted).
fn worley(p: DVec3, seed: u64) -> f64 {
    let base = p.floor();
    let mut nearest = 1.0f64;
    for i in 0..27i64 {
        let at = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
        let cell = [base.x as i64 + at[0], base.y as i64 + at[1], base.z as i64 + at[2]];
        let h = hash(cell, seed);
        let jitter = DVec3::new(
            unit(h as u32).into(),
            unit((h >> 32) as u32).into(),
            unit(mix(h) as u32).into(),
        );
        let point = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64) + jitter;
        nearest = nearest.min((p - point).length_squared());
    }
    1.0 - nearest.sqrt()
}

/// Perlin-Worley noise in [0, 1]: fractal gradient noise, lifted where fractal cellular noise is high, so that it billows (Schneider
/// 2015, "The real-time volumetric cloudscapes of Horizon: Zero Dawn").
pub fn perlin_worley(p: DVec3, octaves: u32, seed: u64) -> f64 {
    let (mut wisps, mut billows, mut weight, mut total) = (0.0, 0.0, 0.5, 0.0);
    let mut q = p;
    for octave in 0..octaves {
        let seed = mix(seed ^ u64::from(octave));
        wisps += weight * (0.5 + 0.5 * perlin(q, seed));
        billows += weight * worley(q, seed ^ 1);
        total += weight;
        weight *= 0.5;
        // Shifted, so that the lattices don't coincide at the origin.
        q = q * 2.0 + DVec3::splat(0.37);
    }
    let (wisps, billows) = (wisps / total, billows / total);
    (billows + wisps * (1.0 - billows)).clamp(0.0, 1.0)
}
