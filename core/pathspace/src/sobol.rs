//! Four-dimensional Owen-scrambled Sobol' points (Owen 1995; hashing after Burley 2020, "Practical Hash-based Owen
//! Scrambling").
//!
//! A net has up to [`POINTS`] points; their order is shuffled by a nested uniform scramble of the index from its highest bit down, so
//! that any aligned power of two of them is a net as well. (From the lowest bit up the lowest bits would hardly
//! be shuffled at all, and with them the highest bits of nets of different keys would be tied together: that was measured to
//! double the error.)

use resolvent_api::rng::mix;

/// Most points of a net.
pub const POINTS: u32 = 1 << LOG_NET;
const LOG_NET: u32 = 12;

/// Direction numbers of the first four Sobol' dimensions for indices below [`POINTS`].
/// Primitive polynomials and initial numbers: Joe & Kuo 2008 (new-joe-kuo-6.21201), dimensions 1-4.
const DIRECTIONS: [[u32; LOG_NET as usize]; 4] = directions();

/// Bits of an index that one look-up takes.
const DIGIT: u32 = 6;

/// What each digit of an index, the low and the high one, contributes to the four coordinates, which have their bits reversed
/// (scrambling wants them so).
static DIGITS: [[[u32; 4]; 1 << DIGIT]; 2] = digits();

const fn digits() -> [[[u32; 4]; 1 << DIGIT]; 2] {
    let mut out = [[[0; 4]; 1 << DIGIT]; 2];
    let mut digit = 0;
    while digit < 2 {
        let mut value = 0;
        while value < 1 << DIGIT {
            let mut dim = 0;
            while dim < 4 {
                let mut bit = 0;
                while bit < DIGIT as usize {
                    if value >> bit & 1 == 1 {
                        let direction = DIRECTIONS[dim][digit * DIGIT as usize + bit];
                        out[digit][value][dim] ^= direction.reverse_bits();
                    }
                    bit += 1;
                }
                dim += 1;
            }
            value += 1;
        }
        digit += 1;
    }
    out
}

const fn directions() -> [[u32; LOG_NET as usize]; 4] {
    // (degree, coefficients, initial odd numbers)
    let table: [(usize, u32, [u32; 3]); 3] =
        [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];
    let mut out = [[0u32; LOG_NET as usize]; 4];
    let mut i = 0;
    while i < LOG_NET as usize {
        out[0][i] = 1 << (31 - i);
        i += 1;
    }
    let mut dim = 1;
    while dim < 4 {
        let (degree, coefficients, initial) = table[dim - 1];
        let mut k = 0;
        while k < LOG_NET as usize {
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

/// Owen scrambling by a hash (Laine & Karras 2011, constants of Vegdahl 2021) of bits in reverse order: each depends on those
/// below. The result is in order.
#[inline(always)]
fn owen(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// The coordinates of point `index` of the net `key`, not yet scrambled.
#[inline(always)]
fn plain(index: u32, key: u64) -> [u32; 4] {
    let reversed = index.reverse_bits() >> (32 - LOG_NET);
    let i = owen(reversed, key as u32) >> (32 - LOG_NET);
    let low = DIGITS[0][(i & ((1 << DIGIT) - 1)) as usize];
    let high = DIGITS[1][(i >> DIGIT) as usize];
    [0, 1, 2, 3].map(|dim| low[dim] ^ high[dim])
}

/// Point `index` (below [`POINTS`]) of the net `key`.
#[inline(always)]
pub fn point(index: u32, key: u64) -> [u32; 4] {
    let x = plain(index, key);
    // Seeds of their own for all dimensions: shared bits would tie decisions that must be independent.
    let (s, t) = (mix(key), mix(key ^ SECOND));
    [
        owen(x[0], s as u32),
        owen(x[1], (s >> 32) as u32),
        owen(x[2], t as u32),
        owen(x[3], (t >> 32) as u32),
    ]
}

/// The first two coordinates of [`point`], or the last two.
#[inline(always)]
pub fn half(index: u32, key: u64, last: bool) -> [u32; 2] {
    let x = plain(index, key);
    let s = mix(if last { key ^ SECOND } else { key });
    let dim = if last { 2 } else { 0 };
    [owen(x[dim], s as u32), owen(x[dim + 1], (s >> 32) as u32)]
}

const SECOND: u64 = 0x5851_f42d_4c95_7f2d;

#[cfg(test)]
mod tests {
    use super::*;

    /// One point in each elementary interval of the first two dimensions, for every aligned batch, for larger aligned parts and
    /// for the whole net.
    #[test]
    fn aligned_parts_are_nets() {
        for key in 0..50u64 {
            let key = resolvent_api::rng::mix(key);
            for log in [4, 6, 9, LOG_NET] {
                let n = 1u32 << log;
                for begin in [0, n, POINTS / 2, POINTS - n] {
                    for a in 0..=log {
                        let b = log - a;
                        let mut seen = vec![0; n as usize];
                        for i in begin..begin + n {
                            let p = point(i % POINTS, key);
                            let x = p[0].checked_shr(32 - a).unwrap_or(0);
                            let y = p[1].checked_shr(32 - b).unwrap_or(0);
                            seen[((x << b) | y) as usize] += 1;
                        }
                        assert_eq!(
                            seen,
                            vec![1; n as usize],
                            "key {key}, {n} from {begin}, intervals 2^-{a} x 2^-{b}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn halves_are_those_of_the_point() {
        for index in [0, 1, 77, POINTS - 1] {
            for key in [3, u64::MAX / 7] {
                let [a, b, c, d] = point(index, key);
                assert_eq!(half(index, key, false), [a, b]);
                assert_eq!(half(index, key, true), [c, d]);
            }
        }
    }

    /// Nets of different keys are unrelated: what one puts into the halves of an axis, the other spreads over both. Over keys, the
    /// number of the first 16 points that lie in the lower half in both has the mean and variance of a random pairing.
    #[test]
    fn nets_are_paired_at_random() {
        let n = 40_000u64;
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..n {
            let keys = [mix(2 * k), mix(2 * k + 1)];
            let both = (0..16)
                .filter(|&i| keys.iter().all(|&key| point(i, key)[0] >> 31 == 0))
                .count() as f64;
            sum += both;
            squares += both * both;
        }
        let mean = sum / n as f64;
        let variance = squares / n as f64 - mean * mean;
        // Hypergeometric: 8 of 16 drawn, 8 of 16 good: mean 4, variance 16/15. Shuffling by a nested scramble keeps it within a few
        // per cent; order tied from the lowest bit up has variance 16.
        assert!((mean - 4.0).abs() < 0.05, "{mean}");
        assert!((0.5..2.2).contains(&variance), "{variance}");
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
