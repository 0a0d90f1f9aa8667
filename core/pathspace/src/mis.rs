//! Multiple importance sampling over techniques and lanes.
//!
//! A path carries, lane by lane, its contribution f and its density p, where lane λ of p is the density with which the path
//! would have come about had λ been the hero. The balance heuristic over lanes and techniques divides f by the sum of all
//! densities (Veach 1997, eq. 9.15; over null-collision paths Miller et al. 2019, eq. 15):
//!
//!   ⟨I⟩ = f_λ / mean over λ' of Σ_techniques p_λ'

use resolvent_api::vertex::Edge;
use resolvent_api::{Flight, Spectrum};

/// Contribution and density of a path so far, lane by lane, sharing one arbitrary scale.
#[derive(Clone, Copy, Debug)]
pub struct Throughput {
    /// Contribution f.
    pub f: Spectrum,
    /// Density p; all ones in grey scenes.
    pub p: Spectrum,
}

impl Throughput {
    /// A path that has not begun.
    pub const ONE: Self = Self {
        f: Spectrum::ONE,
        p: Spectrum::ONE,
    };

    /// f over the mean density: the weight of what the path finds, by free flight alone.
    #[inline(always)]
    pub fn weight<const CHROMATIC: bool>(&self, lanes: u32) -> Spectrum {
        if CHROMATIC {
            self.f / self.p.mean(lanes)
        } else {
            self.f
        }
    }

    /// Follows an edge found by free flight to a vertex that is no collision.
    #[inline(always)]
    pub fn travel<const CHROMATIC: bool>(&mut self, edge: &Edge) {
        if CHROMATIC {
            self.f *= edge.value;
            self.p *= edge.track;
        }
        // In a grey scene value equals track in all lanes: the quotient is 1.
    }

    /// Collides in a medium, at extinction and scattering coefficients `sigma_t` and `sigma_s`.
    #[inline(always)]
    pub fn collide<const CHROMATIC: bool>(
        &mut self,
        sigma_t: Spectrum,
        sigma_s: Spectrum,
        lanes: u32,
    ) {
        if CHROMATIC {
            self.f *= sigma_s;
            self.p *= sigma_t;
            self.normalise(lanes);
        } else {
            // Divided, not multiplied by the inverse: at albedo 1 the quotient is exactly 1, however often it is taken.
            self.f *= sigma_s / sigma_t[0];
        }
    }

    /// Brings the mean density back to 1, so that long paths neither overflow nor vanish.
    #[inline(always)]
    fn normalise(&mut self, lanes: u32) {
        let mean = self.p.mean(lanes);
        if mean > 0.0 {
            let scale = 1.0 / mean;
            self.f *= scale;
            self.p *= scale;
        }
    }

    /// Weight of light found at the end of `edge` by scattering with density 1 (already divided out of f), where
    /// connecting would have found it with `other` times that density: f·value / mean(p·(track + other·ratio)).
    #[inline(always)]
    pub fn found<const CHROMATIC: bool>(&self, edge: &Edge, other: f32, lanes: u32) -> Spectrum {
        if CHROMATIC {
            let density = self.p * (edge.track + edge.ratio * other);
            self.f * edge.value / density.mean(lanes)
        } else {
            if other == 0.0 {
                return self.f;
            }
            // value = track; a huge ratio (a path connection would find far more often) gives weight 0, not NaN.
            let (value, ratio) = (edge.value[0], edge.ratio[0]);
            self.f * (value / (value + other * ratio))
        }
    }

    /// Weight of light found by connecting with density `density`, where scattering would have found it with
    /// density `other`: f·value / mean(p·(density·ratio + other·track)).
    #[inline(always)]
    pub fn connected<const CHROMATIC: bool>(
        &self,
        edge: &Edge,
        density: f32,
        other: f32,
        lanes: u32,
    ) -> Spectrum {
        if CHROMATIC {
            let total = self.p * (edge.ratio * density + edge.track * other);
            let mean = total.mean(lanes);
            if mean > 0.0 {
                self.f * edge.value / mean
            } else {
                Spectrum::ZERO
            }
        } else {
            let total = edge.ratio[0] * density + edge.track[0] * other;
            if total > 0.0 {
                self.f * (edge.value[0] / total)
            } else {
                Spectrum::ZERO
            }
        }
    }
}

/// An edge that nothing hinders.
pub fn clear(length: f32) -> Edge {
    let f = Flight::vacuum(length);
    Edge {
        value: f.value,
        track: f.track,
        ratio: f.ratio,
        emitted: f.emitted,
        length,
        media: 0,
    }
}
