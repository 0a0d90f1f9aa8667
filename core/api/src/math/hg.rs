//! The Henyey-Greenstein lobe in `f32`, stable for every |g| < 1 and every angle: what phase functions are built from.
//!
//! The textbook forms lose all digits at three places: 1 + g² − 2 g cos θ near the peak, the 1/(2g) of the inverse CDF at
//! small g, and 1 − cos² θ at both poles. Here 1 − cos θ and 1 + cos θ are carried instead of cos θ, and the inverse CDF is
//! factored by hand so that only products of non-negative numbers remain.

use super::{Frame, Vec3, warp};
use crate::params::Error;
use core::f32::consts::FRAC_1_PI;

/// A lobe with mean cosine g.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    g: f32,
    /// 1 − g and 1 + g, subtracted in `f64`: at |g| = 1 − 10⁻⁷ the `f32` difference would be 20 % off.
    one_minus_g: f32,
    one_plus_g: f32,
    /// (1 − g²)/(4π).
    scale: f32,
}

/// A scattering angle θ.
#[derive(Clone, Copy, Debug)]
pub struct Angle {
    /// 1 − cos θ.
    pub one_minus_cos: f32,
    /// 1 + cos θ.
    pub one_plus_cos: f32,
}

impl Lobe {
    /// A lobe of mean cosine `g` in (−1, 1).
    ///
    /// # Errors
    /// If `g` is no number, or |g| is above 1 − 10⁻⁷.
    pub fn new(g: f64) -> Result<Self, Error> {
        // Below 10⁻⁷ the lobe is narrower than directions in `f32` can tell apart.
        if !(g.abs() <= 1.0 - 1e-7) {
            return Err(Error::new(format!(
                "the mean cosine g must lie in (-1, 1) and at least 1e-7 from its ends, not be {g}"
            )));
        }
        Ok(Self {
            g: g as f32,
            one_minus_g: (1.0 - g) as f32,
            one_plus_g: (1.0 + g) as f32,
            scale: ((1.0 - g) * (1.0 + g)) as f32 * (0.25 * FRAC_1_PI),
        })
    }

    /// Phase function value and density, sr⁻¹.
    ///
    /// 1 + g² − 2 g cos θ = (1 − g)² + 2 g (1 − cos θ) = (1 + g)² − 2 g (1 + cos θ): the form whose terms have one sign.
    #[inline(always)]
    pub fn density(&self, one_minus_cos: f32, one_plus_cos: f32) -> f32 {
        let h = if self.g >= 0.0 {
            self.one_minus_g * self.one_minus_g + 2.0 * self.g * one_minus_cos
        } else {
            self.one_plus_g * self.one_plus_g - 2.0 * self.g * one_plus_cos
        };
        self.scale / (h * h.sqrt())
    }

    /// The density for two directions that point away from the vertex.
    ///
    /// |wo + wi|² = 2 (1 − cos θ) and |wo − wi|² = 2 (1 + cos θ) for unit vectors: exact near the poles, where 1 ± wo·wi
    /// would have one digit left.
    #[inline(always)]
    pub fn density_between(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.density(
            0.5 * (wo + wi).length_squared(),
            0.5 * (wo - wi).length_squared(),
        )
    }

    /// The angle at which the distribution function of cos θ, counted from −1, reaches `u`.
    ///
    /// cos θ = (1 + g² − ((1 − g²)/D)²)/(2g) with D = 1 − g + 2 g u (Witt 1977, eq. 21) factors into
    /// 1 − cos θ = 2 (1 − g)² (1 − u)(1 + g u)/D² and 1 + cos θ = 2 (1 + g)² u (1 − g (1 − u))/D²: no difference is left
    /// but 1 − u, which is exact, and g = 0 needs no case of its own.
    #[inline(always)]
    pub fn sample(&self, u: f32) -> Angle {
        let v = 1.0 - u;
        let d = if self.g >= 0.0 {
            self.one_minus_g + 2.0 * self.g * u
        } else {
            self.one_plus_g - 2.0 * self.g * v
        };
        let (a, b) = (self.one_minus_g / d, self.one_plus_g / d);
        // 1 + g u = (1 + g) − g v and 1 − g v = (1 − g) + g u: again the form without a difference.
        let (p, q) = if self.g >= 0.0 {
            (1.0 + self.g * u, self.one_minus_g + self.g * u)
        } else {
            (self.one_plus_g - self.g * v, 1.0 - self.g * v)
        };
        Angle {
            one_minus_cos: (2.0 * a * a * v * p).min(2.0),
            one_plus_cos: (2.0 * b * b * u * q).min(2.0),
        }
    }
}

impl Angle {
    /// The direction at this angle from `frame.n` and the azimuth 2π·`u`.
    #[inline(always)]
    pub fn direction(&self, frame: Frame, u: f32) -> Vec3 {
        let sin = (self.one_minus_cos * self.one_plus_cos).sqrt();
        let cos = if self.one_minus_cos < 1.0 {
            1.0 - self.one_minus_cos
        } else {
            self.one_plus_cos - 1.0
        };
        let (s, c) = warp::sin_cos_turn(u);
        let w = frame.to_world(Vec3::new(sin * c, sin * s, cos));
        // One Newton step towards unit length: each event starts from the last one's direction, and over the 10⁵ events of
        // a thick medium the rounding of their lengths would add up.
        w * (1.5 - 0.5 * w.length_squared())
    }
}
