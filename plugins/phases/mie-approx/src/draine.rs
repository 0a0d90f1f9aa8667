//! Draine's (2003) lobe: Henyey & Greenstein's times (1 + α cos² θ)/(1 + α (1 + 2 g²)/3).
//!
//! Sampling inverts the distribution function. In closed form that is the root of a quartic, which loses its digits at small
//! g. Instead it is written over v, the Henyey-Greenstein distribution function of the same g, in which the lobe's density is
//! bounded by 1 and 1 + α; with w = 2v − 1 and D = 1 + g w,
//!
//! cos θ = (w (1 + g²) (1 + g w/2) + g (3 − g²)/2) / D²  and  G(w) = ∫₀ʷ cos² θ dw = w P(w)/(3 D³),
//! P(w) = ¾ g² a² + ¾ g a b w + ¼ b² w² + ¾ g (1 + g²)² w³,  a = 3 − g², b = 2 + 5 g² − g⁴,
//!
//! so that the distribution function is ((w + 1)/2 + (α/2)(G(w) − G(−1)))/(1 + α (1 + 2 g²)/3). No term of it divides by g.
//! Its slope is least where cos θ = 0 and grows to both sides: it is concave before, convex after, and Newton's method from there
//! converges without a safeguard, in 3 to 12 steps to all digits of `f64`.

use resolvent_api::Error;
use resolvent_api::math::hg::{Angle, Lobe};

/// A lobe.
#[derive(Clone, Copy, Debug)]
pub struct Draine {
    hg: Lobe,
    /// α, and 1/(1 + α (1 + 2 g²)/3).
    alpha: f32,
    scale: f32,
    g: f64,
}

impl Draine {
    /// With g in (−1, 1) and finite α ≥ 0; α = 0 is Henyey & Greenstein's lobe, g = 0 with α = 1 Rayleigh's.
    ///
    /// # Errors
    /// If g or α are out of range.
    pub fn new(g: f64, alpha: f64) -> Result<Self, Error> {
        if !(0.0..f64::INFINITY).contains(&alpha) {
            return Err(Error::new(format!(
                "Draine's alpha must be finite and at least 0, not {alpha}"
            )));
        }
        Ok(Self {
            hg: Lobe::new(g)?,
            alpha: alpha as f32,
            scale: (1.0 / norm(g, alpha)) as f32,
            g,
        })
    }

    /// Phase function value and density, sr⁻¹.
    #[inline(always)]
    pub fn density(&self, angle: Angle) -> f32 {
        let cos = 0.5 * (angle.one_plus_cos - angle.one_minus_cos);
        self.hg.density(angle.one_minus_cos, angle.one_plus_cos)
            * self.scale
            * (1.0 + self.alpha * cos * cos)
    }

    /// The angle at which the distribution function of cos θ, counted from −1, reaches `u`.
    #[inline]
    pub fn sample(&self, u: f32) -> Angle {
        let (g, alpha) = (self.g, f64::from(self.alpha));
        let start = g_of(g, -1.0);
        // The distribution function times its norm, less what it should be: increasing in w.
        let target = f64::from(u) * norm(g, alpha);
        let excess = |w: f64| 0.5 * (w + 1.0 + alpha * (g_of(g, w) - start)) - target;
        let mut w = least_slope(g);
        for _ in 0..MOST_STEPS {
            let cos = cosine(g, w);
            let next = w - excess(w) / (0.5 * (1.0 + alpha * cos * cos));
            // The first step may leave the interval: its end is still on the convex side.
            let next = next.clamp(-1.0, 1.0);
            let done = (next - w).abs() <= 1e-14;
            w = next;
            if done {
                break;
            }
        }
        // As in `Lobe::sample`, but from w: products of numbers that are not negative, where 1 − cos θ would cancel.
        let (d, v) = (1.0 + g * w, 0.5 * (w + 1.0));
        let (a, b) = ((1.0 - g) / d, (1.0 + g) / d);
        let (below, above) = (1.0 - v, v);
        Angle {
            one_minus_cos: ((2.0 * a * a * below * (1.0 + g * above)) as f32).min(2.0),
            one_plus_cos: ((2.0 * b * b * above * (1.0 - g * below)) as f32).min(2.0),
        }
    }
}

/// Newton's method ends long before: see the head of the file.
const MOST_STEPS: usize = 64;

/// 1 + α ⟨cos² θ⟩.
fn norm(g: f64, alpha: f64) -> f64 {
    1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0
}

/// cos θ at w = 2v − 1.
#[inline(always)]
pub(crate) fn cosine(g: f64, w: f64) -> f64 {
    let (g2, d) = (g * g, 1.0 + g * w);
    (w * (1.0 + g2) * (1.0 + 0.5 * g * w) + 0.5 * g * (3.0 - g2)) / (d * d)
}

/// G(w) = ∫₀ʷ cos² θ dw.
#[inline(always)]
pub(crate) fn g_of(g: f64, w: f64) -> f64 {
    let (g2, d) = (g * g, 1.0 + g * w);
    let (a, b, c) = (3.0 - g2, 2.0 + g2 * (5.0 - g2), 1.0 + g2);
    let p = 0.75 * g2 * a * a + w * (0.75 * g * a * b + w * (0.25 * b * b + w * 0.75 * g * c * c));
    w * p / (3.0 * d * d * d)
}

/// The w at which cos θ = 0: (s − 1)/g with s = (1 − g²)/√(1 + g²), free of the division by g.
#[inline(always)]
fn least_slope(g: f64) -> f64 {
    let g2 = g * g;
    let s = (1.0 - g2) / (1.0 + g2).sqrt();
    -g * (3.0 - g2) / ((1.0 + g2) * (1.0 + s))
}
