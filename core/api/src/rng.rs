//! Keyed random streams: plain data, no state outside the value itself.
//!
//! A stream is made from a key and yields a sequence that depends on that key alone, so a segment can be replayed
//! and an image does not depend on threads. Keys come from (seed, pixel, sample, bounce, purpose) by [`mix`].

/// A bijective 64-bit mixer (the finaliser of SplitMix64; Steele et al. 2014).
#[inline(always)]
pub const fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Derives a key for `purpose` from `key`; different purposes give independent streams.
#[inline(always)]
pub const fn derive(key: u64, purpose: u64) -> u64 {
    mix(key ^ purpose.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Uniform in [0, 1) from the upper 24 bits: every value is exact in `f32` and 1 is never reached.
#[inline(always)]
pub fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A random stream (SplitMix64 sequence from a key).
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    state: u64,
}

impl Stream {
    /// The stream of `key`.
    #[inline(always)]
    pub const fn new(key: u64) -> Self {
        Self { state: key }
    }

    /// Next 64 bits.
    #[inline(always)]
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.state)
    }

    /// Uniform in [0, 1).
    #[inline(always)]
    pub fn uniform(&mut self) -> f32 {
        unit((self.bits() >> 32) as u32)
    }

    /// Two independent uniforms from one draw of 64 bits.
    #[inline(always)]
    pub fn uniform2(&mut self) -> [f32; 2] {
        let b = self.bits();
        [unit((b >> 32) as u32), unit(b as u32)]
    }
}

/// Exponential variate of unit rate like [`exponential`], with the 24 bits of `u` continued to 53 by `key`.
///
/// Media that step a whole segment at once need the fine bits: at an optical depth of 10⁻⁶ the multiples of 2⁻²⁴ are 6 % apart,
/// and no distance beyond 16.6 could be drawn.
#[inline(always)]
pub fn exponential_fine(u: f32, key: u64) -> f64 {
    let tail = (mix(key) >> 35) as f64 * (1.0 / 536_870_912.0);
    // The difference is exact, so the logarithm has all its digits, and costs a third of `ln_1p`.
    -(1.0 - (f64::from(u) + tail * (1.0 / 16_777_216.0))).ln()
}

/// Exponential variate of unit rate from a uniform in [0, 1): −ln(1−u), finite since u < 1.
///
/// Below u = 2⁻²⁴ the result is exactly 0 (u = 0); the largest result is 24 ln 2 = 16.6.
#[inline(always)]
pub fn exponential(u: f32) -> f32 {
    -(1.0 - u).ln()
}
