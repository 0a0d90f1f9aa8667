//! A normalised table: evaluation and exact sampling.

use crate::parse::Row;
use core::f64::consts::PI;
use resolvent_api::math::hg::Angle;
use resolvent_api::{Error, Spectrum};

/// One angle of the table.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Phase function per lane, sr⁻¹; the fourth is the mean of the others.
    value: Spectrum,
    /// Probability of smaller scattering angles under the mean of the lanes.
    below: f64,
}

/// A function that is linear in cos θ between nodes, and integrates to 1 over the sphere in every lane.
#[derive(Clone, Debug)]
pub struct Table {
    /// 1 − cos θ of the nodes, from 0 to 2: from straight on, where peaks are and where this keeps the digits of small angles.
    at: Vec<f64>,
    nodes: Vec<Node>,
}

impl Table {
    /// Normalises rows that [`crate::parse`] has checked.
    ///
    /// # Errors
    /// If a channel is zero everywhere, or cannot be represented when normalised.
    pub fn new(rows: &[Row]) -> Result<Self, Error> {
        let at: Vec<f64> = rows.iter().map(|r| r.one_minus_cos).collect();
        let scale = [0, 1, 2].map(|lane| {
            // Relative to the largest value, so that no sum overflows or vanishes.
            let largest = rows.iter().map(|r| r.value[lane]).fold(0.0, f64::max);
            let mass: f64 = rows
                .windows(2)
                .map(|w| {
                    let mean = 0.5 * (w[0].value[lane] / largest + w[1].value[lane] / largest);
                    2.0 * PI * (w[1].one_minus_cos - w[0].one_minus_cos) * mean
                })
                .sum();
            (largest, 1.0 / mass)
        });
        if let Some(lane) = scale.iter().position(|s| s.0 == 0.0) {
            let name = ["first", "second", "third"][lane];
            return Err(Error::new(format!(
                "the table's {name} channel is zero everywhere"
            )));
        }
        let mut nodes: Vec<Node> = rows
            .iter()
            .map(|r| {
                let p = [0, 1, 2].map(|i| (r.value[i] / scale[i].0 * scale[i].1) as f32);
                // In `f64`: the mean of three equal values is that value.
                let mean = p.map(f64::from).iter().sum::<f64>() / 3.0;
                Node {
                    value: Spectrum([p[0], p[1], p[2], mean as f32]),
                    below: 0.0,
                }
            })
            .collect();
        if nodes
            .iter()
            .any(|n| !n.value.0.iter().all(|v| v.is_finite()))
        {
            return Err(Error::new(
                "the table has a peak too narrow to be represented",
            ));
        }
        // From the rounded values, so that the distribution function belongs to the density that is returned.
        let mut below = 0.0;
        for i in 1..nodes.len() {
            let mean = 0.5 * (mean_of(&nodes[i - 1]) + mean_of(&nodes[i]));
            below += 2.0 * PI * (at[i] - at[i - 1]) * mean;
            nodes[i].below = below;
        }
        nodes.iter_mut().for_each(|n| n.below /= below);
        Ok(Self { at, nodes })
    }

    /// Phase function per lane and the density of sampling, sr⁻¹.
    #[inline]
    pub fn value(&self, angle: Angle) -> (Spectrum, f32) {
        // Measured from the pole that is nearer.
        let x = if angle.one_minus_cos < 1.0 {
            f64::from(angle.one_minus_cos)
        } else {
            2.0 - f64::from(angle.one_plus_cos)
        };
        let i = self.piece(|k| self.at[k] <= x);
        let t = (x - self.at[i]) / (self.at[i + 1] - self.at[i]);
        self.between(i, t.clamp(0.0, 1.0) as f32)
    }

    /// The angle at which the distribution function, counted from straight on, reaches `u`; the values there. `None` where the
    /// density is zero, which has no probability but for rounding.
    ///
    /// In a piece with densities a and b at its ends and a share r of its width times density still to go, a t + (b − a) t²/2 = r
    /// has the root t = 2 r/(a + √(a² + 2 (b − a) r)): the form that stays exact as b → a.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(Angle, Spectrum, f32)> {
        let u = f64::from(u);
        let i = self.piece(|k| self.nodes[k].below <= u);
        let (near, far) = (&self.nodes[i], &self.nodes[i + 1]);
        let (a, b) = (mean_of(near), mean_of(far));
        let share = (u - near.below) / (far.below - near.below);
        let r = 0.5 * (a + b) * share;
        let root = (a * a + 2.0 * (b - a) * r).max(0.0).sqrt();
        // 0/0 where the density is zero at the near end, and there t = 1 leads to p of the far end.
        let t = (2.0 * r / (a + root)).min(1.0);
        let x = self.at[i] + t * (self.at[i + 1] - self.at[i]);
        let (value, p) = self.between(i, t as f32);
        let angle = Angle {
            one_minus_cos: x as f32,
            one_plus_cos: (2.0 - x) as f32,
        };
        (p > 0.0).then_some((angle, value, p))
    }

    /// The last piece whose first node satisfies `reached`, which holds for nodes up to some point.
    #[inline(always)]
    fn piece(&self, reached: impl Fn(usize) -> bool) -> usize {
        let (mut low, mut high) = (0, self.at.len() - 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if reached(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    #[inline(always)]
    fn between(&self, i: usize, t: f32) -> (Spectrum, f32) {
        let (a, b) = (self.nodes[i].value, self.nodes[i + 1].value);
        let v = a.zip(b, |a, b| a + t * (b - a));
        (v, v.0[3])
    }
}

/// The density of sampling at a node.
#[inline(always)]
fn mean_of(node: &Node) -> f64 {
    f64::from(node.value.0[3])
}
