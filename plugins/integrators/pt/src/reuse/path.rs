//! The path of one pixel up to what it shares.

use super::{Arrival, Member};
use crate::kernel::{Found, Kernel, Walk};
use resolvent_api::abi::{PixelSample, Tile, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::operator::{FlightDraws, Mode, Scatter, lobes};
use resolvent_api::vertex::{Edge, vertex_flags};
use resolvent_api::{Spectrum, Transport, Vec3, Vertex, VertexKind};
use resolvent_pathspace::orders::Together;
use resolvent_pathspace::sampler::Sampler;
use resolvent_pathspace::{features, roulette, scatter};

/// Least weight that roulette takes the direction at a second vertex for: what the own first vertex makes little of may be worth
/// more to others.
const LEAST_WORTH: f32 = 0.1;

impl Kernel<'_> {
    /// The path of one sample, as far as it goes alone, and what it has to share.
    pub(super) fn set_out(
        &self,
        tile: &Tile,
        pixel: [u32; 2],
        sample: u32,
        flight: &FlightDraws,
        m: &mut Member,
        scratch: &mut [Vertex; 2],
    ) -> Outcome<()> {
        let (scene, lanes) = (self.scene, self.scene.lanes());
        let index = u64::from(pixel[1]) * u64::from(tile.resolution[0]) + u64::from(pixel[0]);
        let vacuum = !scene.has(scene_traits::MEDIA);
        let sampler = Sampler::new(tile.seed, index, sample, lanes).without_flights(vacuum);
        (m.pixel, m.sampler, m.sample) = (pixel, sampler, PixelSample::default());
        (m.connects, m.shares, m.light, m.arrival) = (false, false, None, None);
        let (film, lens) = sampler.camera();
        let Some(ray) = scene.camera_ray(pixel, film, lens)? else {
            return Ok(());
        };
        let mut edge = Edge::default();
        let alive = scene.emerge(&ray, flight, &mut edge, &mut m.first)?;
        let y = &m.first;
        features::fill(
            &mut m.sample,
            alive.then_some(y),
            &edge,
            lanes,
            tile.features != 0,
        );
        let mut walk = Walk::new(ray.weight, &sampler);
        m.sample.radiance += walk.beta.f * edge.emitted;
        if !alive {
            return Ok(());
        }
        if y.flags & vertex_flags::EMITS != 0 && !y.is(VertexKind::Medium) {
            m.sample.radiance += walk.beta.f * y.emitted;
        }
        if y.is(VertexKind::Emitter) || self.max_depth == 0 {
            return Ok(());
        }
        walk.beta.f *= albedo(y);
        m.weight = walk.beta.f;
        if m.weight.is_zero() {
            return Ok(());
        }
        m.connects = y.scatter.lobes() & lobes::SMOOTH != 0;
        let bounce = sampler.bounce(0, walk.shared);
        walk.shared = bounce.next;
        if self.connects {
            m.sample.radiance += self.connect::<false>(y, &walk, &sampler, &bounce)?;
        }
        let Some(s) = scatter::sample(scene, y, bounce.scatter, Mode::Radiance)? else {
            return Ok(());
        };
        walk.beta.f *= s.weight;
        walk.depth = 1;
        let flight = sampler.flight(1, Spectrum::ONE);
        let alive = scene.propagate(y, s.wi.into(), &flight, &mut edge, &mut m.second)?;
        let x = &m.second;
        m.shares = alive
            && !scatter::is_delta(&s)
            && !x.is(VertexKind::Emitter)
            && x.scatter.lobes() & lobes::SMOOTH != 0
            && self.max_depth > 1;
        if !m.shares {
            walk.found = if scatter::is_delta(&s) {
                Found::Alone
            } else {
                Found::With(s.forward)
            };
            let [here, next] = scratch;
            if alive {
                (*here, *next) = (*y, *x);
            }
            m.sample.radiance += self.go_on(walk, &sampler, alive, &mut edge, here, next)?;
            return Ok(());
        }
        m.clear = clear(&edge);
        m.sample.radiance += walk.beta.f * edge.emitted;
        if x.flags & vertex_flags::EMITS != 0 && !x.is(VertexKind::Medium) {
            let other = match self.connects {
                true => scene.light_density(y, x) / s.forward,
                false => 0.0,
            };
            m.sample.radiance += walk.beta.found::<false>(&edge, other, lanes) * x.emitted;
        }
        self.gather(walk, m, scratch)
    }

    /// What reaches the second vertex of a path; `walk` has come there.
    fn gather(&self, mut walk: Walk, m: &mut Member, scratch: &mut [Vertex; 2]) -> Outcome<()> {
        let (scene, sampler, x) = (self.scene, m.sampler, &m.second);
        m.albedo = albedo(x);
        if m.albedo.is_zero() {
            return Ok(());
        }
        walk.beta.f *= m.albedo;
        let bounce = sampler.bounce(1, walk.shared);
        walk.shared = bounce.next;
        m.chance = bounce.chance;
        if self.connects {
            m.light = scene.sample_light(x, bounce.choice, bounce.point)?;
        }
        let Some(s) = scatter::sample(scene, x, bounce.scatter, Mode::Radiance)? else {
            return Ok(());
        };
        walk.beta.f *= s.weight;
        let wi = Vec3::from(s.wi);
        if let Some(sun) = self.sun {
            // Branches leave from later vertices only.
            self.turn(&mut walk, x, wi, sun, s.forward, x.is(VertexKind::Medium))?;
            walk.others = 0.0;
        }
        let worth = walk.beta.f.max_lane().max(LEAST_WORTH);
        let q = roulette::survival(worth * walk.promise);
        if q < 1.0 && bounce.roulette >= q {
            return Ok(());
        }
        walk.depth = 2;
        let ([here, next], mut edge) = (scratch, Edge::default());
        let flight = sampler.flight(2, Spectrum::ONE);
        let alive = scene.propagate(x, wi, &flight, &mut edge, next)?;
        if scatter::is_delta(&s) {
            walk.beta.f *= 1.0 / q;
            walk.found = Found::Alone;
            m.sample.radiance += self.go_on(walk, &sampler, alive, &mut edge, here, next)?;
            return Ok(());
        }
        let (mut emitted, mut connecting) = (Spectrum::ZERO, 0.0);
        if alive && next.flags & vertex_flags::EMITS != 0 && !next.is(VertexKind::Medium) {
            emitted = next.emitted * (1.0 / q);
            if self.connects {
                connecting = scene.light_density(x, next) / clear(&edge);
            }
        }
        // What lies beyond has the colour of no first vertex; the weight is for later roulette.
        walk.beta.f = Spectrum::splat(worth / q);
        walk.found = Found::Counted;
        let scattered = self.go_on(walk, &sampler, alive, &mut edge, here, next)? * (1.0 / worth);
        m.arrival = Some(Arrival {
            wi,
            emitted,
            connecting,
            scattered,
        });
        Ok(())
    }

    /// The light that a walk finds from `next` on, which it has reached from `here`.
    fn go_on(
        &self,
        walk: Walk,
        sampler: &Sampler,
        alive: bool,
        edge: &mut Edge,
        here: &mut Vertex,
        next: &mut Vertex,
    ) -> Outcome<Spectrum> {
        let t = &mut Together;
        if self.sun.is_some() {
            self.follow::<false, true, _>(walk, sampler, alive, edge, here, next, t)
        } else {
            self.follow::<false, false, _>(walk, sampler, alive, edge, here, next, t)
        }
    }
}

/// Share of the extinction at a vertex that scatters; surfaces have theirs in K.
fn albedo(v: &Vertex) -> Spectrum {
    if v.is(VertexKind::Medium) {
        v.sigma_s / v.sigma_t[0]
    } else {
        Spectrum::ONE
    }
}

/// Density of an edge by flight over that by connection, in a grey scene.
pub(super) fn clear(edge: &Edge) -> f32 {
    edge.track[0] / edge.ratio[0]
}
