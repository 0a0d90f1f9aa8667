//! How the samples of a pixel are divided into nets.
//!
//! Every net is scrambled on its own, so that nets are independent of each other, and errors can be estimated from their spread without
//! assuming anything. Larger nets converge faster, more nets make a better estimate of the error: size and number both grow with the
//! square root of the number of samples. Sample `i` from 4ᵏ up to 4ᵏ⁺¹ is in a net of 2ᵏ⁺² (at least [`SMALLEST`]): 4 nets are
//! the first 64 samples, 10 the first 256, 22 the first 1024.
//!
//! The price against one net for all samples is what large nets are better than small ones. Where they are no better (in
//! media, mostly) there is none.

use crate::sobol::POINTS;
use core::ops::Range;

/// Samples of the smallest net.
pub const SMALLEST: u32 = 16;

/// Size of the net that holds `sample`.
#[inline(always)]
fn size(sample: u32) -> u32 {
    let k = (sample | SMALLEST).ilog2() / 2;
    (4 << k).min(POINTS)
}

/// The samples of the net that holds `sample`. Its first sample is the net's name.
#[inline(always)]
pub fn around(sample: u32) -> Range<u32> {
    // Levels begin at multiples of the size of their nets, which is a power of two.
    let size = size(sample);
    let begin = sample & !(size - 1);
    begin..begin.saturating_add(size)
}

/// How many nets there are before the one that holds `sample`.
pub fn number(sample: u32) -> u32 {
    let (mut level, mut count) = (0, 0);
    let own = size(sample);
    loop {
        let size = size(level);
        if size == own {
            return count + (sample - level) / size;
        }
        let next = end_of_level(level);
        count += (next - level) / size;
        level = next;
    }
}

/// The samples of net `number`, counted from 0.
pub fn nth(number: u32) -> Range<u32> {
    let (mut level, mut left) = (0u32, number);
    loop {
        let size = size(level);
        let next = end_of_level(level);
        let count = (next - level) / size;
        if left < count || size == POINTS {
            let begin = left.saturating_mul(size).saturating_add(level);
            return begin..begin.saturating_add(size);
        }
        left -= count;
        level = next;
    }
}

/// The first sample after `level`, the first of a size of nets, whose net is larger.
fn end_of_level(level: u32) -> u32 {
    if size(level) == POINTS {
        u32::MAX
    } else {
        (4 * level).max(4 * SMALLEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nets follow each other without gap, are counted, and their sizes are powers of two that never fall.
    #[test]
    fn nets_tile_the_samples() {
        let (mut begin, mut number_of, mut last) = (0, 0, 0);
        while begin < 1 << 23 {
            let net = nth(number_of);
            assert_eq!(net.start, begin);
            for i in [net.start, net.start + net.len() as u32 / 3, net.end - 1] {
                assert_eq!((around(i), number(i)), (net.clone(), number_of));
            }
            let size = net.len() as u32;
            assert!(size.is_power_of_two() && size >= last && begin % size == 0);
            (begin, number_of, last) = (net.end, number_of + 1, size);
        }
        assert_eq!(last, POINTS);
        let count = |n: u32| number(n - 1) + 1;
        assert_eq!([64, 256, 1024].map(count), [4, 10, 22]);
    }
}
