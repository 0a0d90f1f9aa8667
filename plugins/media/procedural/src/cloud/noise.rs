//! Fractal value noise whose range over any box is known exactly, layer by layer.
//!
//! A layer puts a random number on every lattice point and interpolates with weights s(x) = 6x⁵ − 15x⁴ + 10x³ (Perlin 2002), which
//! rise monotonously from 0 to 1. Within one lattice cell the layer is trilinear in (s(x), s(y), s(z)), so over any box inside
//! that cell it takes its extremes at the box's corners; over a box across cells, at the corners of the pieces. No
//! Lipschitz constant, no safety factor.

use resolvent_api::Vec3;
use resolvent_api::rng::derive;

/// Lattice cells a box may span along an axis before its range is taken to be all of [0, 1].
const SPAN: i32 = 3;

/// One layer.
#[derive(Clone, Copy, Debug)]
struct Layer {
    /// Lattice cells per unit of the caller's coordinates.
    scale: Vec3,
    /// Where the lattice begins, so that layers don't share their points.
    shift: Vec3,
    seed: u32,
    /// Share in the sum.
    weight: f32,
}

/// A sum of layers with values in [0, 1].
#[derive(Clone, Debug)]
pub struct Noise {
    layers: Vec<Layer>,
}

/// Bits that depend on all bits of a lattice point.
#[inline(always)]
fn hash(x: i32, y: i32, z: i32, seed: u32) -> u32 {
    let mut h = seed
        ^ (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77).rotate_left(11)
        ^ (z as u32).wrapping_mul(0xc2b2_ae3d).rotate_left(22);
    // The finaliser of MurmurHash3.
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

#[inline(always)]
fn smooth(x: f32) -> f32 {
    x * x * x * (x * (x * 6.0 - 15.0) + 10.0)
}

#[inline(always)]
fn mix(a: f32, b: f32, s: f32) -> f32 {
    a + (b - a) * s
}

/// Trilinear in the weights `s`.
#[inline(always)]
fn interpolate(c: &[f32; 8], s: Vec3) -> f32 {
    let near = mix(mix(c[0], c[1], s.x), mix(c[2], c[3], s.x), s.y);
    let far = mix(mix(c[4], c[5], s.x), mix(c[6], c[7], s.x), s.y);
    mix(near, far, s.z)
}

impl Layer {
    /// The numbers at the corners of a lattice cell, x fastest.
    #[inline(always)]
    fn corners(&self, x: i32, y: i32, z: i32) -> [f32; 8] {
        core::array::from_fn(|i| {
            let i = i as i32;
            let bits = hash(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2), self.seed);
            (bits >> 8) as f32 * (1.0 / 16_777_215.0)
        })
    }

    /// The layer at a point of its lattice.
    #[inline(always)]
    fn at(&self, q: Vec3) -> f32 {
        let low = q.floor();
        let f = q - low;
        let s = Vec3::new(smooth(f.x), smooth(f.y), smooth(f.z));
        interpolate(&self.corners(low.x as i32, low.y as i32, low.z as i32), s)
    }

    /// Least and largest value over a box.
    fn range(&self, low: Vec3, high: Vec3) -> (f32, f32) {
        let (a, b) = (
            low * self.scale + self.shift,
            high * self.scale + self.shift,
        );
        let (first, last) = (a.floor().as_ivec3(), b.floor().as_ivec3());
        if (last - first).max_element() > SPAN {
            return (0.0, 1.0);
        }
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let corners = self.corners(x, y, z);
                    let corner = Vec3::new(x as f32, y as f32, z as f32);
                    let weights = |q: Vec3| {
                        let f = (q - corner).clamp(Vec3::ZERO, Vec3::ONE);
                        Vec3::new(smooth(f.x), smooth(f.y), smooth(f.z))
                    };
                    let (s, t) = (weights(a), weights(b));
                    for i in 0..8 {
                        let pick = |k: usize| if i >> k & 1 == 0 { s[k] } else { t[k] };
                        let at = Vec3::new(pick(0), pick(1), pick(2));
                        let v = interpolate(&corners, at);
                        least = least.min(v);
                        most = most.max(v);
                    }
                }
            }
        }
        (least, most)
    }
}

impl Noise {
    /// Layers `i` of weight gainⁱ and `scale` · lacunarityⁱ lattice cells per unit.
    pub fn new(octaves: u32, scale: Vec3, lacunarity: f32, gain: f32, seed: u64) -> Self {
        let total: f32 = (0..octaves).map(|i| gain.powi(i as i32)).sum();
        let layers = (0..octaves)
            .map(|i| {
                let bits = derive(derive(0x6e_6f69_7365, seed), i.into());
                let fraction = |k: u32| ((bits >> (21 * k)) & 0xfff) as f32 / 4096.0;
                Layer {
                    scale: scale * lacunarity.powi(i as i32),
                    shift: Vec3::new(fraction(0), fraction(1), fraction(2)),
                    seed: (bits >> 32) as u32 ^ bits as u32,
                    weight: gain.powi(i as i32) / total,
                }
            })
            .collect();
        Self { layers }
    }

    /// The noise at a point, in [0, 1].
    #[inline(always)]
    pub fn at(&self, p: Vec3) -> f32 {
        self.layers
            .iter()
            .map(|l| l.weight * l.at(p * l.scale + l.shift))
            .sum()
    }

    /// Bounds over a box: the sum of the layers' ranges, widened by what rounding may do to a sum.
    pub fn range(&self, low: Vec3, high: Vec3) -> (f32, f32) {
        let (mut least, mut most) = (0.0, 0.0);
        for layer in &self.layers {
            let (a, b) = layer.range(low, high);
            least += layer.weight * a;
            most += layer.weight * b;
        }
        (least - 1e-5, most + 1e-5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    #[test]
    fn ranges_hold_and_are_tight() {
        let mut stream = Stream::new(3);
        let mut v = move || Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let noise = Noise::new(4, Vec3::new(0.3, 0.4, 0.1), 2.1, 0.6, 9);
        let single = Noise::new(1, Vec3::splat(0.7), 2.0, 0.5, 1);
        let mut slack = 0.0f32;
        for _ in 0..300 {
            let low = v() * 30.0;
            let high = low + v() * 2.0;
            for n in [&noise, &single] {
                let (a, b) = n.range(low, high);
                let (mut least, mut most) = (1.0f32, 0.0f32);
                for _ in 0..300 {
                    let x = n.at(low + (high - low) * v());
                    assert!(a <= x && x <= b, "{x} outside {a}..{b}");
                    (least, most) = (least.min(x), most.max(x));
                }
                if n.layers.len() == 1 {
                    slack += (least - a) + (b - most);
                }
            }
        }
        // Over 300 boxes samples come within 0.02 of the bounds on average, so the bounds are not just wide.
        assert!(slack / 300.0 < 0.04, "{slack}");
    }

    #[test]
    fn seeds_and_layers_differ() {
        let a = Noise::new(3, Vec3::ONE, 2.0, 0.5, 1);
        let b = Noise::new(3, Vec3::ONE, 2.0, 0.5, 2);
        let p = Vec3::new(1.3, 7.7, 4.1);
        assert!(a.at(p) != b.at(p));
        let [x, y, ..] = &a.layers[..] else {
            panic!("three layers")
        };
        assert!(x.seed != y.seed && x.shift != y.shift);
    }
}
