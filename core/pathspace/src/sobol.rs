//! Four-dimensional Owen-scrambled Sobol' points in batches (Owen 1995; hashing after Burley 2020, "Practical Hash-based
//! Owen Scrambling", with the tree of a batch's index kept explicit because it has few levels).

use resolvent_api::rng::mix;

/// Points a batch holds.
pub const BATCH: u32 = 1 << LOG_BATCH;
const LOG_BATCH: u32 = 4;

/// Direction numbers of the first four Sobol' dimensions for indices below [`BATCH`].
/// Primitive polynomials and initial numbers: Joe & Kuo 2008 (new-joe-kuo-6.21201), dimensions 1-4.
const DIRECTIONS: [[u32; LOG_BATCH as usize]; 4] = directions();

const fn directions() -> [[u32; LOG_BATCH as usize]; 4] {
    // (degree, coefficients, initial odd numbers)
    let table: [(usize, u32, [u32; 3]); 3] =
        [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];
    let mut out = [[0u32; LOG_BATCH as usize]; 4];
    let mut i = 0;
    while i < LOG_BATCH as usize {
        out[0][i] = 1 << (31 - i);
        i += 1;
    }
    let mut dim = 1;
    while dim < 4 {
        let (degree, coefficients, initial) = table[dim - 1];
        let mut k = 0;
        while k < LOG_BATCH as usize {
            if k < degree {
                out[dim][k] = initial[k] << (31 - k);
            } else {
                let mut v = out[dim][k - degree] ^ (out[dim][k - degree] >> degree);
                let mut j = 1;
                while j < degree {
                    if coefficients >> (degree - 1 - j) & 1 == 1 {
                        v ^= out[dim][k - j];
                    }
                    j += 1;
                }
                out[dim][k] = v;
            }
            k += 1;
        }
        dim += 1;
    }
    out
}

/// Owen scrambling of the bits of `x` by a hash (Laine & Karras 2011, constants of Vegdahl 2021).
#[inline(always)]
fn owen(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// Point `index` (below [`BATCH`]) of the batch `key`: four numbers whose batch is a scrambled net.
#[inline(always)]
pub fn point(index: u32, key: u64) -> [u32; 4] {
    // Shuffle the order by nested uniform scrambling of the index, so that batches of different keys are unrelated
    // while the first 2, 4, 8 points of each stay well spread.
    let flips = key as u32;
    let mut i = index;
    let mut k = 0;
    while k < LOG_BATCH {
        let node = (1 << k) - 1 + (index & ((1 << k) - 1));
        i ^= (flips >> node & 1) << k;
        k += 1;
    }
    // Seeds of their own for all dimensions: shared bits would tie decisions that must be independent.
    let (s, t) = (mix(key), mix(key ^ 0x5851_f42d_4c95_7f2d));
    let seeds = [s as u32, (s >> 32) as u32, t as u32, (t >> 32) as u32];
    let mut out = [0u32; 4];
    for (dim, v) in out.iter_mut().enumerate() {
        let mut x = 0;
        for (bit, direction) in DIRECTIONS[dim].iter().enumerate() {
            x ^= direction & 0u32.wrapping_sub(i >> bit & 1);
        }
        *v = owen(x, seeds[dim]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every batch is a (0, 4, 2)-net in its first two dimensions: one point in each elementary interval.
    #[test]
    fn batches_are_nets() {
        for key in 0..200u64 {
            let key = resolvent_api::rng::mix(key);
            for (a, b) in [(0, 4), (1, 3), (2, 2), (3, 1), (4, 0)] {
                let mut seen = [0; 16];
                for i in 0..BATCH {
                    let p = point(i, key);
                    let x = if a == 0 { 0 } else { p[0] >> (32 - a) };
                    let y = if b == 0 { 0 } else { p[1] >> (32 - b) };
                    seen[((x << b) | y) as usize] += 1;
                }
                assert_eq!(seen, [1; 16], "key {key}, intervals 2^-{a} x 2^-{b}");
            }
        }
    }

    /// Over keys, any two dimensions of a point are jointly uniform: χ² of an 8 × 8 table for every pair and two indices.
    #[test]
    fn dimensions_are_independent() {
        let n = 200_000;
        for index in [0, 5] {
            for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let mut table = [0u32; 64];
                for key in 0..n {
                    let p = point(index, resolvent_api::rng::mix(key));
                    table[(p[a] >> 29 << 3 | p[b] >> 29) as usize] += 1;
                }
                let expected = n as f64 / 64.0;
                let chi2: f64 = table
                    .iter()
                    .map(|c| (f64::from(*c) - expected).powi(2) / expected)
                    .sum();
                // 63 degrees of freedom: mean 63, standard deviation 11.2.
                assert!(
                    chi2 < 63.0 + 5.0 * 11.2,
                    "index {index}, dimensions {a}, {b}: {chi2}"
                );
            }
        }
    }
}
