//! All lights of a scene and the choice among them.

use super::tree::Tree;
use super::{BoundingSphere, Distribution, Light};
use resolvent_api::Spectrum;
use resolvent_api::math::Vec3;
use resolvent_api::rng::derive;
use resolvent_api::vertex::{LightSample, Vertex, VertexKind, vertex_flags};

/// Share of the choices made by power; the rest is uniform, so that a weak light that is the only one to reach a
/// point is never starved.
const BY_POWER: f64 = 0.8;

/// From so many lights at finite places on, a tree chooses among them. It pays from the second on: at two lights it costs some
/// 20 ns more than choice by power, a few per cent of a connection, and near lights are told from far ones (`where_a_tree_pays`
/// among the tests measures it).
pub const TREE_FROM: usize = 2;

/// What a light is chosen for.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// Position.
    pub p: Vec3,
    /// Unit shading normal on surfaces; elsewhere light from all directions counts alike.
    pub normal: Option<Vec3>,
    /// In a medium.
    pub in_medium: bool,
}

impl Reference {
    /// A vertex of a path.
    #[inline(always)]
    pub fn of(v: &Vertex) -> Self {
        Self {
            p: v.position(),
            normal: v.is(VertexKind::Surface).then(|| v.frame.n.into()),
            in_medium: v.is(VertexKind::Medium),
        }
    }
}

/// Probabilities of choosing each light. A scene with one light chooses without drawing.
pub struct Chooser {
    lights: Vec<u32>,
    table: Distribution,
    probability: Vec<f32>,
}

impl Chooser {
    /// For lights of these powers; those without any are never chosen.
    fn new(power: &[f64]) -> Self {
        let lights: Vec<u32> = (0..power.len() as u32)
            .filter(|i| power[*i as usize] > 0.0)
            .collect();
        let total: f64 = power.iter().sum();
        let weights: Vec<f64> = lights
            .iter()
            .map(|i| BY_POWER * power[*i as usize] / total + (1.0 - BY_POWER) / lights.len() as f64)
            .collect();
        let table = Distribution::new(&weights);
        let mut probability = vec![0.0; power.len()];
        for (k, i) in lights.iter().enumerate() {
            probability[*i as usize] = table.probability(k);
        }
        Self {
            lights,
            table,
            probability,
        }
    }

    pub(super) fn choose(&self, u: f32) -> Option<(u32, f32, f32)> {
        match self.lights.as_slice() {
            [] => None,
            [only] => Some((*only, 1.0, u)),
            many => {
                let (k, rest) = self.table.sample(u)?;
                Some((many[k], self.probability[many[k] as usize], rest))
            }
        }
    }

    /// [`Chooser::choose`] in double precision.
    fn choose_wide(&self, u: f64) -> Option<(u32, f32, f64)> {
        match self.lights.as_slice() {
            [] => None,
            [only] => Some((*only, 1.0, u)),
            many => {
                let (k, rest) = self.table.sample_wide(u)?;
                Some((many[k], self.probability[many[k] as usize], rest))
            }
        }
    }

    /// Probability of choosing light `i`.
    pub(crate) fn probability(&self, i: u32) -> f32 {
        self.probability.get(i as usize).copied().unwrap_or(0.0)
    }

    /// True if there is nothing to choose.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }
}

/// A tree over the lights at finite places, and the choice between it and each of the others by power.
struct Grove {
    tree: Tree,
    /// Stands for the tree among the choosers' lights.
    index: u32,
    surface: Chooser,
    medium: Chooser,
}

/// The lights of a scene.
pub struct Lights {
    /// All of them; indices are stable.
    pub all: Vec<Light>,
    infinite: Vec<u32>,
    /// For vertices on surfaces.
    surface: Chooser,
    /// For vertices in media: a constant environment is left out, since scattering finds it with nearly the density one
    /// could wish for.
    medium: Chooser,
    /// Many lights are chosen by where they are.
    grove: Option<Grove>,
    /// Around what they shine on.
    pub(super) bounds: BoundingSphere,
}

impl Lights {
    /// The lights of a scene within `bounds`.
    pub fn new(all: Vec<Light>, bounds: BoundingSphere, lanes: u32) -> Self {
        Self::with_tree_from(all, bounds, lanes, TREE_FROM)
    }

    /// [`Lights::new`] with a tree from `least` lights at finite places on.
    pub fn with_tree_from(
        all: Vec<Light>,
        bounds: BoundingSphere,
        lanes: u32,
        least: usize,
    ) -> Self {
        let infinite = (0..all.len() as u32)
            .filter(|i| all[*i as usize].is_environment())
            .collect();
        let power: Vec<f64> = all
            .iter()
            .map(|l| f64::from(l.power(bounds.radius, lanes)).max(0.0))
            .collect();
        let scattered: Vec<f64> = all
            .iter()
            .zip(&power)
            .map(|(l, p)| {
                if matches!(l, Light::Constant { .. }) {
                    0.0
                } else {
                    *p
                }
            })
            .collect();
        let surface = Chooser::new(&power);
        let medium = Chooser::new(&scattered);
        let grove = Tree::new(&all, lanes)
            .filter(|t| t.count() >= least.max(2))
            .map(|tree| {
                let index = all.len() as u32;
                let aside = |power: &[f64]| {
                    let (mut aside, mut within) = (power.to_vec(), 0.0);
                    for (i, p) in aside.iter_mut().enumerate() {
                        if tree.holds(i as u32) {
                            within += std::mem::take(p);
                        }
                    }
                    aside.push(within);
                    Chooser::new(&aside)
                };
                Grove {
                    surface: aside(&power),
                    medium: aside(&scattered),
                    tree,
                    index,
                }
            });
        Self {
            all,
            infinite,
            surface,
            medium,
            grove,
            bounds,
        }
    }

    /// The choice by power for a vertex in a medium or on a surface, wherever it is.
    #[inline(always)]
    pub fn chooser(&self, in_medium: bool) -> &Chooser {
        if in_medium {
            &self.medium
        } else {
            &self.surface
        }
    }

    /// Unit direction towards the strongest distant light, or zero.
    pub fn sun(&self) -> Vec3 {
        let strongest = self.all.iter().filter_map(|l| match l {
            Light::Distant {
                to_light,
                irradiance,
            } => Some((*to_light, irradiance.max_lane())),
            Light::Disc {
                frame,
                radiance,
                one_minus_cos,
            } => Some((frame.n.into(), radiance.max_lane() * one_minus_cos)),
            _ => None,
        });
        strongest
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(Vec3::ZERO, |(d, _)| d)
    }

    /// True if some light is met by rays that leave the scene.
    pub fn has_environment(&self) -> bool {
        !self.infinite.is_empty()
    }

    /// Probability of choosing `light` for `at`.
    #[inline]
    pub fn probability(&self, at: &Reference, light: u32) -> f32 {
        match &self.grove {
            None => self.chooser(at.in_medium).probability(light),
            Some(g) if g.tree.holds(light) => {
                g.chooser(at.in_medium).probability(g.index) * g.tree.probability(at, light)
            }
            Some(g) => g.chooser(at.in_medium).probability(light),
        }
    }

    /// Chooses a light for `at`, with its probability. `u` are the numbers that choose the point on it; they only add digits.
    #[inline]
    pub fn choose(&self, at: &Reference, choice: f32, u: [f32; 2]) -> Option<(u32, f32)> {
        let Some(g) = &self.grove else {
            let (light, probability, _) = self.chooser(at.in_medium).choose(choice)?;
            return Some((light, probability));
        };
        let (light, probability, rest) = g.chooser(at.in_medium).choose_wide(refined(choice, u))?;
        if light != g.index {
            return Some((light, probability));
        }
        let (light, among) = g.tree.choose(at, rest)?;
        Some((light, probability * among))
    }

    /// Chooses a light for `at` and a point on it.
    #[inline]
    pub fn sample(&self, at: &Reference, choice: f32, u: [f32; 2]) -> Option<LightSample> {
        let (i, probability) = self.choose(at, choice, u)?;
        let light = &self.all[i as usize];
        let mut s = light.sample(at.p, u)?;
        s.light = i;
        if light.is_environment() {
            // One technique for all infinite lights together.
            (s.radiance, s.density) = self.environment(at.in_medium, s.wi.into());
        } else if s.flags & vertex_flags::DELTA != 0 {
            s.density = probability;
        } else {
            s.density *= probability;
        }
        Some(s)
    }

    /// Radiance of all infinite lights from direction `w`, and the density of choosing it for a connection.
    #[inline]
    pub fn environment(&self, in_medium: bool, w: Vec3) -> (Spectrum, f32) {
        let chooser = match &self.grove {
            Some(g) => g.chooser(in_medium),
            None => self.chooser(in_medium),
        };
        self.mixture(chooser, w)
    }

    /// Radiance of all infinite lights from direction `w`, and its density if `chooser` chooses them.
    #[inline]
    pub(super) fn mixture(&self, chooser: &Chooser, w: Vec3) -> (Spectrum, f32) {
        let (mut radiance, mut density) = (Spectrum::ZERO, 0.0);
        for i in &self.infinite {
            let (l, p) = self.all[*i as usize].towards(w);
            radiance += l;
            density += p * chooser.probability[*i as usize];
        }
        (radiance, density)
    }

    /// Density (sr⁻¹) of choosing the point `found` (normal `ng`) on the area light `light` for `at`.
    #[inline]
    pub fn density(&self, at: &Reference, light: u32, found: Vec3, ng: Vec3) -> f32 {
        match &self.all[light as usize] {
            Light::Area(a) => a.density(at.p, found, ng) * self.probability(at, light),
            _ => 0.0,
        }
    }
}

impl Grove {
    #[inline(always)]
    fn chooser(&self, in_medium: bool) -> &Chooser {
        if in_medium {
            &self.medium
        } else {
            &self.surface
        }
    }
}

/// `choice` with further digits: its 24 bits would be used up after as many levels of a tree. They come from the other
/// numbers of the connection, hashed, and move it by less than its own last digit.
#[inline(always)]
fn refined(choice: f32, u: [f32; 2]) -> f64 {
    let key = u64::from(u[0].to_bits()) << 32 | u64::from(u[1].to_bits());
    let more = (derive(key, u64::from(choice.to_bits())) >> 40) as f64;
    (f64::from(choice) + more * 2f64.powi(-48)).min(1.0f64.next_down())
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    /// The further digits fill what lies between a number and the next, evenly.
    #[test]
    fn refined_numbers() {
        let mut s = Stream::new(6);
        let mut tenths = [0u32; 10];
        for choice in [0.0, 0.25, 1.0f32.next_down()] {
            for _ in 0..10_000 {
                let more = (refined(choice, s.uniform2()) - f64::from(choice)) * 2f64.powi(24);
                assert!((0.0..1.0).contains(&more), "{choice} {more}");
                tenths[(more * 10.0) as usize] += 1;
            }
        }
        assert!(
            tenths.iter().all(|n| (2700..3300).contains(n)),
            "{tenths:?}"
        );
    }
}
