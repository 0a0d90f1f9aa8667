//! Multiple importance sampling over techniques and lanes.
//!
//! A path carries, lane by lane, its contribution f and its density p, where lane λ of p is the density with which the path
//! would have come about had λ been the hero. The balance heuristic over lanes and techniques divides f by the sum of all
//! densities (Veach 1997, eq. 9.15; over null-collision paths Miller et al. 2019, eq. 15):
//!
//!   ⟨I⟩ = f_λ / mean over λ' of Σ_techniques p_λ'

use resolvent_api::vertex::{Edge, WITH_MEDIA};
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
        if !WITH_MEDIA {
            return self.f * (1.0 / (1.0 + other));
        }
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
        if !WITH_MEDIA {
            return self.f * (1.0 / (density + other));
        }
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

/// How the densities of all strategies make a weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heuristic {
    /// q_s / Σ q (Veach 1997, eq. 9.8).
    Balance,
    /// q_s² / Σ q² (Veach 1997, eq. 9.13 with β = 2).
    Power,
    /// 1: the strategy is the only one used.
    Alone,
}

/// What weights take for the densities of the media between two vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MediaDensities {
    /// Those of the null collisions that came about (Miller et al. 2019): exact over all strategies and lanes, and as random as
    /// they are.
    Exact,
    /// Those of flights and connections through a deterministic, approximate optical depth: smooth. Each strategy then is divided by
    /// its own exact density, and weighed by these.
    Depth,
}

/// The densities of a whole path x_0 … x_n, x_0 on a light and x_n on the sensor, under all strategies: strategy s takes
/// x_0 … x_{s−1} from a walk that starts at a light, the others from one that starts at the sensor, and connects the two.
///
/// With L_i the density of x_i found from x_{i−1} and S_i found from x_{i+1}, and with lane densities `track` and `ratio` on
/// every edge, strategy s has the density, lane by lane,
///
///   q_s(λ) = n_s Π_{i<s} L_i Π_{i≥s} S_i · Π_{e≠s−1} track_e(λ) · ratio_{s−1}(λ) · Π_media σ_t(λ)
///
/// because a flight produces null collisions with density `track`, a connection with `ratio`, and every collision vertex is
/// found by a flight from one side or the other (Miller et al. 2019, §5; flat arrays as in Veach 1997, §10.2.1).
#[derive(Clone, Debug, Default)]
pub struct Strategies {
    /// L_i, per area or volume.
    pub from_light: Vec<f64>,
    /// S_i, per area or volume.
    pub from_sensor: Vec<f64>,
    /// Vertices of delta events, which cannot be connected to.
    pub delta: Vec<bool>,
    /// ratio/track of the edge from x_i to x_{i+1}.
    pub rho: Vec<Spectrum>,
    /// Density of x_0 when it is chosen as seen from x_1: strategy 1.
    pub chosen: f64,
    /// Walks from lights for each walk from a pixel: n_s of strategy n, which finds all pixels alike.
    pub light_walks: f64,
}

/// Smallest density a division is done with; below it, a strategy does not exist.
const TINY: f64 = 1e-200;

impl Strategies {
    /// Makes room for a path of `n` edges.
    pub fn resize(&mut self, n: usize) {
        self.from_light.clear();
        self.from_light.resize(n + 1, 0.0);
        self.from_sensor.clear();
        self.from_sensor.resize(n + 1, 0.0);
        self.delta.clear();
        self.delta.resize(n + 1, false);
        self.rho.clear();
        self.rho.resize(n, Spectrum::ONE);
    }

    /// Number of edges.
    fn edges(&self) -> usize {
        self.rho.len()
    }

    /// True if strategy `k` may give the path light: nothing is connected to what was turned by a delta lobe, and its walks find
    /// every vertex.
    pub fn can(&self, k: usize) -> bool {
        let walked = self.from_light.iter().take(if k > 1 { k } else { 0 });
        let seen = self.from_sensor[..self.edges()].iter().skip(k);
        self.extra(k) > 0.0 && walked.chain(seen).all(|p| *p > 0.0)
    }

    /// What strategy `k` has beside the products of L and S: 0 if it cannot be.
    fn extra(&self, k: usize) -> f64 {
        let n = self.edges();
        if k == 0 {
            return 1.0;
        }
        // A light seen directly is left to the walk from the sensor.
        if n == 1 || self.delta[k - 1] || self.delta[k] {
            return 0.0;
        }
        let chosen = if k == 1 {
            self.chosen / self.from_light[0].max(TINY)
        } else {
            1.0
        };
        let walks = if k == n { self.light_walks } else { 1.0 };
        chosen * walks
    }

    /// Calls `visit(k, q_k/q_s)` for all strategies, lanes left out.
    pub fn relative(&self, s: usize, mut visit: impl FnMut(usize, f64)) {
        let quotient = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
        let own = self.extra(s).max(TINY);
        visit(s, 1.0);
        let mut g = 1.0 / own;
        for k in (0..s).rev() {
            let light = if k == 0 {
                self.from_light[0].max(TINY)
            } else {
                self.from_light[k]
            };
            g *= quotient(self.from_sensor[k], light);
            visit(k, g * self.extra(k));
        }
        g = 1.0 / own;
        for k in s..self.edges() {
            let light = if k == 0 {
                self.from_light[0].max(TINY)
            } else {
                self.from_light[k]
            };
            g *= quotient(light, self.from_sensor[k]);
            visit(k + 1, g * self.extra(k + 1));
        }
    }

    /// The weight of strategy `s`, for lane densities as in [`Strategies::divisor`].
    pub fn weight(&self, s: usize, track: Spectrum, lanes: u32, heuristic: Heuristic) -> f64 {
        self.divisor(s, track, lanes, Heuristic::Alone) / self.divisor(s, track, lanes, heuristic)
    }

    /// What strategy `s` divides contribution over its own grey density by, for a path whose walks and connection have the
    /// lane densities `track` (all edges' track and all collisions' σ_t).
    pub fn divisor(&self, s: usize, track: Spectrum, lanes: u32, heuristic: Heuristic) -> f64 {
        let lane_mean = |rho: Spectrum| {
            let mut sum = 0.0;
            for lane in 0..lanes as usize {
                sum += f64::from(track[lane]) * f64::from(rho[lane]);
            }
            sum / f64::from(lanes)
        };
        let q = |k: usize, d: f64| {
            let rho = if k == 0 {
                Spectrum::ONE
            } else {
                self.rho[k - 1]
            };
            if d > 0.0 { d * lane_mean(rho) } else { 0.0 }
        };
        match heuristic {
            Heuristic::Balance => {
                let mut sum = 0.0;
                self.relative(s, |k, d| sum += q(k, d));
                sum
            }
            Heuristic::Power => {
                let (mut sum, own) = (0.0, q(s, 1.0));
                self.relative(s, |k, d| sum += q(k, d).powi(2));
                if own > 0.0 { sum / own } else { f64::INFINITY }
            }
            Heuristic::Alone => q(s, 1.0),
        }
    }
}

/// Smallest lane density of an edge that is told from 0.
const LEAST_TRACK: f32 = 1e-30;

/// The lane densities of an edge under flights, kept from 0 so that they can be divided by.
#[inline(always)]
pub fn track(edge: &Edge) -> Spectrum {
    edge.track.map(|t| t.max(LEAST_TRACK))
}

/// ratio/track of an edge.
#[inline(always)]
pub fn rho(edge: &Edge) -> Spectrum {
    edge.ratio.zip(track(edge), |r, t| r / t)
}

/// An edge that nothing hinders.
#[inline(always)]
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
