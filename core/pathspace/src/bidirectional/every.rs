//! All strategies of a sample: every way to join two walks that were made.

use super::connect::Bidirectional;
use super::draws::{Draws, End};
use crate::sampler::Purpose;
use resolvent_api::integrator::Outcome;
use resolvent_api::rng::Stream;
use resolvent_api::{SceneView, Spectrum, VertexKind};

/// Which strategies are tried.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    /// Most vertices of a path.
    pub limit: usize,
    /// Mean number of vertices of the light's walk that each of the sensor's is joined to.
    pub connections: f32,
    /// Only with this many vertices from the light, and from the sensor.
    pub only: [Option<usize>; 2],
}

/// What one strategy found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Vertices from the light.
    pub s: usize,
    /// Vertices from the sensor.
    pub t: usize,
    /// Where on the film it falls, pixels, for t = 1; `None`: where the sensor's walk began.
    pub film: Option<[f32; 2]>,
    /// Weighted contribution.
    pub radiance: Spectrum,
    /// Probability with which the strategy was tried: what is missing of the contribution's mean.
    pub share: f32,
}

impl Found {
    /// How often the light was scattered.
    pub fn order(&self) -> usize {
        self.s + self.t - 2
    }
}

impl Pairs {
    fn wants(&self, s: usize, t: usize) -> bool {
        self.only[0].is_none_or(|o| o == s) && self.only[1].is_none_or(|o| o == t)
    }
}

impl Bidirectional {
    /// Tells `found` of what every strategy finds in the two walks. If that from the light is empty, scattering alone finds lights.
    /// Strategy (1, 1), light that connects to the lens without being scattered, is not tried: (0, 2) has it all.
    ///
    /// # Errors
    /// If a plugin breaks, or `found` stops.
    #[inline(always)]
    pub fn every<D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        draws: &mut D,
        pairs: &Pairs,
        connects: bool,
        mut found: impl FnMut(Found) -> Outcome<()>,
    ) -> Outcome<()> {
        let at = |s, t, radiance| Found {
            s,
            t,
            film: None,
            radiance,
            share: 1.0,
        };
        if pairs.wants(0, 2) {
            for (order, emitted) in self.sensor.emitted.iter().enumerate() {
                found(at(0, order + 2, *emitted))?;
            }
        }
        for t in 2..=self.sensor.len() {
            if pairs.wants(0, t) {
                let light = self.hit(scene, t)?;
                found(at(0, t, light))?;
            }
            if t < pairs.limit && connects && pairs.wants(1, t) {
                let light = self.next_event(scene, t, draws)?;
                found(at(1, t, light))?;
            }
        }
        for s in 2..=self.light.len() {
            if pairs.wants(s, 1)
                && let Some(splat) = self.project(scene, s, draws)?
            {
                found(Found {
                    film: Some(splat.film),
                    ..at(s, 1, splat.radiance)
                })?;
            }
        }
        self.join_all(scene, draws, pairs, found)
    }

    /// Joins every vertex of the sensor's walk to some of the light's. Long walks have too many pairs: each is kept with the
    /// same probability.
    #[inline(always)]
    fn join_all<D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        draws: &mut D,
        pairs: &Pairs,
        mut found: impl FnMut(Found) -> Outcome<()>,
    ) -> Outcome<()> {
        let inner = self.light.len().saturating_sub(1);
        if inner == 0 {
            return Ok(());
        }
        let share = (pairs.connections / inner as f32).min(1.0);
        let mut choice = Stream::new(draws.key(End::Light, 0, Purpose::Connection));
        for t in 2..=self.sensor.len() {
            if self.sensor.nodes()[t - 1].vertex.is(VertexKind::Emitter) {
                continue;
            }
            for s in 2..=self.light.len() {
                if s + t > pairs.limit || !pairs.wants(s, t) {
                    continue;
                }
                if share < 1.0 && choice.uniform() >= share {
                    continue;
                }
                found(Found {
                    s,
                    t,
                    film: None,
                    radiance: self.join(scene, s, t, draws)?,
                    share,
                })?;
            }
        }
        Ok(())
    }
}
