//! Tracking: free flight and transmittance over a [`crate::Field`], compiled once per field inside its plugin.
//!
//! Null points on a ray form a Poisson process of the rate of the majorant. [`delta`] samples the next collision,
//! [`ratio`] estimates a transmittance. Both use a minorant where the field knows one: a collision below the minorant is
//! accepted without a look-up, and a transmittance keeps the minorant's part in closed form (the residual and decomposition
//! tracking of Novák et al. 2014 and Kutz et al. 2017). Where minorant and majorant meet, both become exact regular
//! tracking of constant cells, without any look-up.

pub mod delta;
pub mod ratio;
mod tracked;

pub use tracked::{Tracked, Transmittance};

/// Random numbers of one flight: the primary ones first, then the tail of the key.
pub(crate) struct Draws {
    stream: crate::rng::Stream,
    event: Option<f32>,
}

impl Draws {
    pub(crate) fn new(u: &crate::FlightDraws) -> Self {
        Self {
            stream: crate::rng::Stream::new(u.key),
            event: Some(u.event),
        }
    }

    /// Uniforms for a decision and for the next distance, and bits for a stochastic look-up.
    #[inline(always)]
    pub(crate) fn next(&mut self) -> ([f32; 2], u64) {
        let [event, tau] = self.stream.uniform2();
        (
            [self.event.take().unwrap_or(event), tau],
            self.stream.bits() >> 1,
        )
    }
}

/// Exponential steps of a point process along a ray whose rate changes from cell to cell.
///
/// What is left of the distance (in units of optical depth) at the end of a cell is carried into the next one.
pub(crate) struct Steps {
    tau: f32,
    stalls: u32,
}

/// Steps below the resolution of `t` that may follow each other before `t` is moved on by one ulp. A majorant so large
/// that `t + Δt = t` would otherwise never leave the spot.
const STALLS: u32 = 64;

impl Steps {
    /// The first step is decided by the uniform `u`.
    #[inline(always)]
    pub(crate) fn new(u: f32) -> Self {
        Self {
            tau: crate::rng::exponential(u),
            stalls: 0,
        }
    }

    /// Where the step from `t` ends in a cell of the given rate up to `t1`, and whether that is the cell's end.
    #[inline(always)]
    pub(crate) fn reach(&self, t: f32, rate: f32, t1: f32) -> (f32, bool) {
        let end = t + self.tau / rate;
        // A rate of 0 gives ∞ or NaN (0/0): either leaves the cell.
        if end < t1 { (end, false) } else { (t1, true) }
    }

    /// Leaves a cell after `dt` at `rate`.
    #[inline(always)]
    pub(crate) fn leave(&mut self, dt: f32, rate: f32) {
        if rate > 0.0 {
            self.tau = (self.tau - dt * rate).max(0.0);
        }
    }

    /// Arrives at `end` from `t`: the new `t`, or `None` if it had to be moved on past the cell's end `t1`.
    #[inline(always)]
    pub(crate) fn arrive(&mut self, t: f32, end: f32, t1: f32) -> Option<f32> {
        if end != t {
            return Some(end);
        }
        self.stalls += 1;
        if self.stalls <= STALLS {
            return Some(t);
        }
        self.stalls = 0;
        let next = t.next_up();
        (next < t1).then_some(next)
    }

    /// The next step is decided by the uniform `u`.
    #[inline(always)]
    pub(crate) fn again(&mut self, u: f32) {
        self.tau = crate::rng::exponential(u);
    }
}

/// Keeps products of many factors inside the range of `f32`; their common scale means nothing.
#[inline(always)]
pub(crate) fn rescale<L: crate::Lanes>(a: &mut L, b: &mut L) {
    let top = a.max_lane().max(b.max_lane());
    if !(1e-15..=1e15).contains(&top) && top > 0.0 {
        let scale = if top > 1.0 { 1e-15 } else { 1e15 };
        *a = *a * scale;
        *b = *b * scale;
    }
}

/// Multiplies an exponential into its product once it has grown: a lane's product over null collisions and its
/// exponential run away in opposite directions, and only together they stay within range.
#[inline(always)]
pub(crate) fn fold<L: crate::Lanes>(product: &mut L, log: &mut L) {
    let zero = L::splat(0.0);
    if log.max_lane().max((zero - *log).max_lane()) > 8.0 {
        *product = *product * log.exp();
        *log = zero;
    }
}

/// `a·exp(log_a)` and `b·exp(log_b)` up to a common factor that keeps the larger exponent at zero.
#[inline(always)]
pub(crate) fn finish<L: crate::Lanes>(
    a: L,
    log_a: L,
    b: L,
    log_b: L,
) -> (crate::Spectrum, crate::Spectrum) {
    let top = log_a.max_lane().max(log_b.max_lane());
    let shift = L::splat(top);
    (
        (a * (log_a - shift).exp()).spectrum(),
        (b * (log_b - shift).exp()).spectrum(),
    )
}
