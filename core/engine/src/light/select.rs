//! All lights of a scene and the choice among them.

use super::{BoundingSphere, Distribution, Light};
use resolvent_api::Spectrum;
use resolvent_api::math::Vec3;
use resolvent_api::vertex::{LightSample, vertex_flags};

/// Share of the choices made by power; the rest is uniform, so that a weak light that is the only one to reach a
/// point is never starved.
const BY_POWER: f64 = 0.8;

/// Probabilities of choosing each light. A scene with one light chooses without drawing.
pub struct Chooser {
    lights: Vec<u32>,
    table: Distribution,
    probability: Vec<f32>,
}

impl Chooser {
    fn new(all: &[Light], radius: f32, lanes: u32, wanted: impl Fn(&Light) -> bool) -> Self {
        let power: Vec<f64> = all
            .iter()
            .map(|l| {
                if wanted(l) {
                    f64::from(l.power(radius, lanes)).max(0.0)
                } else {
                    0.0
                }
            })
            .collect();
        let lights: Vec<u32> = (0..all.len() as u32)
            .filter(|i| power[*i as usize] > 0.0)
            .collect();
        let total: f64 = power.iter().sum();
        let weights: Vec<f64> = lights
            .iter()
            .map(|i| BY_POWER * power[*i as usize] / total + (1.0 - BY_POWER) / lights.len() as f64)
            .collect();
        let table = Distribution::new(&weights);
        let mut probability = vec![0.0; all.len()];
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

    /// Probability of choosing light `i`.
    pub(crate) fn probability(&self, i: u32) -> f32 {
        self.probability.get(i as usize).copied().unwrap_or(0.0)
    }

    /// True if there is nothing to choose.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }
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
    /// Around what they shine on.
    pub(super) bounds: BoundingSphere,
}

impl Lights {
    /// The lights of a scene within `bounds`.
    pub fn new(all: Vec<Light>, bounds: BoundingSphere, lanes: u32) -> Self {
        let radius = bounds.radius;
        let infinite = (0..all.len() as u32)
            .filter(|i| all[*i as usize].is_environment())
            .collect();
        let surface = Chooser::new(&all, radius, lanes, |_| true);
        let medium = Chooser::new(&all, radius, lanes, |l| {
            !matches!(l, Light::Constant { .. })
        });
        Self {
            all,
            infinite,
            surface,
            medium,
            bounds,
        }
    }

    /// The choice for a vertex in a medium or on a surface.
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

    /// Chooses a light and a point on it.
    #[inline]
    pub fn sample(
        &self,
        in_medium: bool,
        from: Vec3,
        choice: f32,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let (i, probability, _) = self.chooser(in_medium).choose(choice)?;
        let light = &self.all[i as usize];
        let mut s = light.sample(from, u)?;
        s.light = i;
        if light.is_environment() {
            // One technique for all infinite lights together.
            (s.radiance, s.density) = self.environment(in_medium, s.wi.into());
        } else if s.flags & vertex_flags::DELTA != 0 {
            s.density = probability;
        } else {
            s.density *= probability;
        }
        Some(s)
    }

    /// Radiance of all infinite lights from direction `w`, and the density of choosing it.
    #[inline]
    pub fn environment(&self, in_medium: bool, w: Vec3) -> (Spectrum, f32) {
        let chooser = self.chooser(in_medium);
        let (mut radiance, mut density) = (Spectrum::ZERO, 0.0);
        for i in &self.infinite {
            let (l, p) = self.all[*i as usize].towards(w);
            radiance += l;
            density += p * chooser.probability[*i as usize];
        }
        (radiance, density)
    }

    /// Density (sr⁻¹) of choosing the point `at` (normal `ng`) on the area light `light` from `from`.
    #[inline]
    pub fn density(&self, in_medium: bool, light: u32, from: Vec3, at: Vec3, ng: Vec3) -> f32 {
        match &self.all[light as usize] {
            Light::Area(a) => {
                a.density(from, at, ng) * self.chooser(in_medium).probability[light as usize]
            }
            _ => 0.0,
        }
    }
}
