//! Quadrature of a medium's coefficients along a segment.

use crate::quadrature::gauss;
use resolvent_api::{Coefficients, Medium, Segment, Vec3};

/// Panels of 5 nodes; a multiple of [`BINS`], so that no panel straddles two bins.
const PANELS: usize = 2560;
/// Bins of the histogram of collisions.
pub const BINS: usize = 32;

/// A quadrature node.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Where, in the segment's `t`.
    pub t: f64,
    /// World length it stands for.
    pub length: f64,
    /// Optical depth from the segment's start.
    pub depth: [f64; 4],
    /// Coefficients there.
    pub at: Coefficients,
}

/// A segment with the coefficients met along it.
#[derive(Clone, Debug)]
pub struct March {
    /// The segment.
    pub segment: Segment,
    /// Nodes in order of `t`.
    pub nodes: Vec<Node>,
    /// Optical depth of the whole segment.
    pub depth: [f64; 4],
    /// The range of `t` in which there may be something.
    pub range: (f64, f64),
}

impl March {
    /// Integrates along a segment, which must be finite where it is inside the medium's bounds.
    ///
    /// Jumps between nothing and something, as at the medium's boundary, are located by bisection, so that they cost no
    /// accuracy. Other jumps cost what a panel's width costs.
    pub fn new(medium: &impl Medium, s: &Segment) -> Self {
        Self::with(medium, s, PANELS)
    }

    /// Relative accuracy of the integrals: a few times what half as many panels change of the depth, or what ∫ σ_t T dt is off
    /// from 1 − T where a free path is shorter than a panel; and at least what `f32` coefficients allow.
    pub fn accuracy(&self, medium: &impl Medium) -> f64 {
        let rough = Self::with(medium, &self.segment, PANELS / 2);
        let off = |lane: usize| {
            let collided = self.integrate(lane, |n| n.at.sigma_t[lane].into());
            let missed = (collided + self.transmittance(lane) - 1.0).abs();
            (self.depth[lane] - rough.depth[lane]).abs().max(missed)
        };
        (0..4).map(off).fold(1e-5, |most, d| most.max(4.0 * d))
    }

    fn with(medium: &impl Medium, s: &Segment, panels: usize) -> Self {
        let (o, d) = (wide(s.o), wide(s.d));
        let unit = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        let at = |t: f64| {
            let p = [0, 1, 2].map(|i| (o[i] + t * d[i]) as f32);
            medium.coefficients(Vec3::from(p))
        };
        let there = |t: f64| {
            let c = at(t);
            !(c.sigma_t.is_zero() && c.emission.is_zero())
        };
        let clipped = medium
            .info()
            .bounds
            .clip(s.o.into(), s.d.into(), s.t0, s.t1);
        let (a, b) = clipped.map_or((s.t0, s.t0), |c| c);
        // Outward a little: the clip is in f32, and outside there is nothing anyway.
        let slack = 1e-5 * f64::from(b - a);
        let range = (
            (f64::from(a) - slack).max(s.t0.into()),
            (f64::from(b) + slack).min(s.t1.into()),
        );
        assert!(range.1.is_finite(), "a march needs an end: {s:?}");
        let mut out = Self {
            segment: *s,
            nodes: Vec::new(),
            depth: [0.0; 4],
            range,
        };
        if clipped.is_none() {
            return out;
        }
        let h = (range.1 - range.0) / panels as f64;
        for i in 0..panels {
            let (a, b) = (range.0 + i as f64 * h, range.0 + (i + 1) as f64 * h);
            let (mut lo, mut hi) = (a, b);
            if there(a) == there(b) {
                out.panel(a, b, unit, &at);
                continue;
            }
            let start = there(a);
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if there(middle) == start {
                    lo = middle;
                } else {
                    hi = middle;
                }
            }
            out.panel(a, lo, unit, &at);
            out.panel(hi, b, unit, &at);
        }
        out
    }

    fn panel(&mut self, a: f64, b: f64, unit: f64, at: &impl Fn(f64) -> Coefficients) {
        let start = self.nodes.len();
        let mut total = [0.0; 4];
        for (t, w) in gauss(a, b) {
            let at = at(t);
            for (sum, sigma) in total.iter_mut().zip(at.sigma_t.0) {
                *sum += f64::from(sigma) * w * unit;
            }
            self.nodes.push(Node {
                t,
                length: w * unit,
                depth: self.depth,
                at,
            });
        }
        // Within the panel the depth grows as if the extinction were constant: second order in the panel's width.
        for node in &mut self.nodes[start..] {
            let share = (node.t - a) / (b - a);
            for (d, t) in node.depth.iter_mut().zip(total) {
                *d += share * t;
            }
        }
        for (d, t) in self.depth.iter_mut().zip(total) {
            *d += t;
        }
    }

    /// exp(−depth) of the whole segment.
    pub fn transmittance(&self, lane: usize) -> f64 {
        (-self.depth[lane]).exp()
    }

    /// ∫ T(t) f(node) dt.
    pub fn integrate(&self, lane: usize, f: impl Fn(&Node) -> f64) -> f64 {
        self.nodes
            .iter()
            .map(|n| (-n.depth[lane]).exp() * f(n) * n.length)
            .sum()
    }

    /// The bin of `t`, of 32 over the range.
    pub fn bin(&self, t: f64) -> usize {
        let (a, b) = self.range;
        (((t - a) / (b - a) * BINS as f64) as usize).min(BINS - 1)
    }
}

fn wide(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}
