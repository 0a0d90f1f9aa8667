//! Paths of neighbouring pixels that share what they find (Bekaert, Sbert & Halton 2002, "Accelerating Path Tracing by Re-Using
//! Paths").
//!
//! A block of pixels takes one sample of each at a time. Every path has a first vertex y_k, seen from the camera, and a second, x_k,
//! chosen at y_k with density p_k. The light that reaches x_i is what any y_k would find there, if nothing is in between: so all y_k
//! are connected to all x_i. A path (y_k, x_i, …) may thus have come about by scattering at any first vertex that sees x_i; the
//! balance heuristic over all of these, and at x_i over scattering and connecting as ever, divides its contribution by
//!
//!   Σ over k of V(y_k, x_i) p_k(x_i) q(x_i; wo_k, wi)
//!
//! with q the density of the direction `wi` at x_i, seen from y_k. Given the first vertices, each x_i is an independent sample: no
//! pixel is biased. But the errors of a block's pixels are alike, which those of other pixels are not.
//!
//! Only what a smooth density chose can be shared. A path that a delta lobe turns at y or at x goes on alone.

use crate::kernel::{Found, Kernel, Walk};
use resolvent_api::abi::{PixelSample, Tile};
use resolvent_api::integrator::Outcome;
use resolvent_api::operator::{Mode, Scatter, lobes};
use resolvent_api::rng::derive;
use resolvent_api::vertex::{Edge, LightSample, vertex_flags};
use resolvent_api::{Output, Spectrum, Transport, Vec3, Vertex, VertexKind};
use resolvent_pathspace::bidirectional::target;
use resolvent_pathspace::orders::Together;
use resolvent_pathspace::sampler::Sampler;
use resolvent_pathspace::{features, roulette, scatter};

/// Least weight that roulette takes the direction at a second vertex for: what the own first vertex makes little of may be worth
/// more to others.
const LEAST_WORTH: f32 = 0.1;

/// What reaches a second vertex from the direction that scattering chose.
#[derive(Clone, Copy)]
struct Arrival {
    wi: Vec3,
    /// Radiance of a light, and the density of `wi` by connecting to it.
    emitted: Spectrum,
    connecting: f32,
    /// Radiance of what is no light itself.
    scattered: Spectrum,
}

/// The path of one pixel.
struct Member {
    pixel: [u32; 2],
    sample: PixelSample,
    sampler: Sampler,
    /// Weight of the camera's ray.
    weight: f32,
    first: Vertex,
    second: Vertex,
    /// The first vertex can be connected to second ones.
    connects: bool,
    /// The second can be connected to first ones.
    shares: bool,
    /// A point on a light chosen for the second vertex; whether anything is in between is not known yet.
    light: Option<LightSample>,
    arrival: Option<Arrival>,
}

impl Member {
    fn new() -> Self {
        Self {
            pixel: [0; 2],
            sample: PixelSample::default(),
            sampler: Sampler::new(0, 0, 0, 1),
            weight: 0.0,
            first: Vertex::empty(),
            second: Vertex::empty(),
            connects: false,
            shares: false,
            light: None,
            arrival: None,
        }
    }
}

/// How first vertex `member` sees a second vertex: K at both and the geometry term between them, for the light chosen there and
/// for the direction chosen there.
struct Way {
    member: usize,
    to_light: Spectrum,
    onward: Spectrum,
}

/// A block of pixels and what it needs; kept for the next one.
struct Block {
    members: Vec<Member>,
    ways: Vec<Way>,
    /// The next vertices of a walk.
    scratch: [Vertex; 2],
}

/// Renders a tile in blocks of up to `edge` × `edge` pixels.
pub fn render(kernel: &Kernel<'_>, edge: u32, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
    let mut block = Block {
        members: Vec::with_capacity((edge * edge) as usize),
        ways: Vec::with_capacity((edge * edge) as usize),
        scratch: [Vertex::empty(); 2],
    };
    let size = [0, 1].map(|k| tile.max[k] - tile.min[k]);
    let across = size.map(|n| n.div_ceil(edge));
    for sample in tile.sample_begin..tile.sample_end {
        // Blocks lie elsewhere for every sample, and go round at the tile's edges: none of their own shows.
        let place = derive(tile.seed ^ 0x626c_6f63_6b73, u64::from(sample));
        let shift = [place as u32, (place >> 32) as u32];
        for b in 0..across[0] * across[1] {
            let at = [b % across[0], b / across[0]];
            let span = |k: usize| {
                let cut = |i: u32| i * size[k] / across[k];
                let shifted = move |i| tile.min[k] + (i + shift[k] % size[k]) % size[k];
                (cut(at[k])..cut(at[k] + 1)).map(shifted)
            };
            let mut count = 0;
            for y in span(1) {
                for x in span(0) {
                    if count == block.members.len() {
                        block.members.push(Member::new());
                    }
                    kernel.set_out(tile, [x, y], sample, &mut block, count)?;
                    count += 1;
                }
            }
            kernel.share(&mut block, count)?;
            for m in &block.members[..count] {
                out.add(m.pixel[0], m.pixel[1], &m.sample)?;
            }
        }
    }
    Ok(())
}

impl Kernel<'_> {
    /// The path of one sample, as far as it goes alone, and what it has to share.
    fn set_out(
        &self,
        tile: &Tile,
        pixel: [u32; 2],
        sample: u32,
        block: &mut Block,
        member: usize,
    ) -> Outcome<()> {
        let (scene, lanes) = (self.scene, self.scene.lanes());
        let m = &mut block.members[member];
        let index = u64::from(pixel[1]) * u64::from(tile.resolution[0]) + u64::from(pixel[0]);
        let sampler = Sampler::new(tile.seed, index, sample, lanes).without_flights(true);
        (m.pixel, m.sampler, m.sample) = (pixel, sampler, PixelSample::default());
        (m.connects, m.shares, m.light, m.arrival) = (false, false, None, None);
        let (film, lens) = sampler.camera();
        let Some(ray) = scene.camera_ray(pixel, film, lens)? else {
            return Ok(());
        };
        m.weight = ray.weight;
        let mut edge = Edge::default();
        let flight = sampler.flight(0, Spectrum::ONE);
        let alive = scene.emerge(&ray, &flight, &mut edge, &mut m.first)?;
        let y = &m.first;
        features::fill(
            &mut m.sample,
            alive.then_some(y),
            &edge,
            lanes,
            tile.features != 0,
        );
        if !alive {
            return Ok(());
        }
        let mut walk = Walk::new(ray.weight, &sampler);
        if y.flags & vertex_flags::EMITS != 0 {
            m.sample.radiance += walk.beta.f * y.emitted;
        }
        if y.is(VertexKind::Emitter) || self.max_depth == 0 || ray.weight == 0.0 {
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
        if !scene.propagate(y, s.wi.into(), &flight, &mut edge, &mut m.second)? {
            return Ok(());
        }
        let x = &m.second;
        m.shares = !scatter::is_delta(&s)
            && x.is(VertexKind::Surface)
            && x.scatter.lobes() & lobes::SMOOTH != 0
            && self.max_depth > 1;
        if !m.shares {
            walk.found = if scatter::is_delta(&s) {
                Found::Alone
            } else {
                Found::With(s.forward)
            };
            let [here, next] = &mut block.scratch;
            (*here, *next) = (*y, *x);
            m.sample.radiance += self.go_on(walk, &sampler, &mut edge, here, next)?;
            return Ok(());
        }
        if x.flags & vertex_flags::EMITS != 0 {
            let other = match self.connects {
                true => scene.light_density(y, x) / s.forward,
                false => 0.0,
            };
            m.sample.radiance += walk.beta.found::<false>(&edge, other, lanes) * x.emitted;
        }
        self.gather(walk, m, &mut block.scratch)
    }

    /// What reaches the second vertex of a path; `walk` has come there.
    fn gather(&self, mut walk: Walk, m: &mut Member, scratch: &mut [Vertex; 2]) -> Outcome<()> {
        let (scene, sampler, x) = (self.scene, m.sampler, &m.second);
        let bounce = sampler.bounce(1, walk.shared);
        walk.shared = bounce.next;
        if self.connects {
            m.light = scene.sample_light(x, bounce.choice, bounce.point)?;
        }
        let Some(s) = scatter::sample(scene, x, bounce.scatter, Mode::Radiance)? else {
            return Ok(());
        };
        walk.beta.f *= s.weight;
        let worth = walk.beta.f.max_lane().max(LEAST_WORTH);
        let q = roulette::survival(worth);
        if q < 1.0 && bounce.roulette >= q {
            return Ok(());
        }
        walk.depth = 2;
        let (wi, [here, next], mut edge) = (Vec3::from(s.wi), scratch, Edge::default());
        let flight = sampler.flight(2, Spectrum::ONE);
        if !scene.propagate(x, wi, &flight, &mut edge, next)? {
            return Ok(());
        }
        if scatter::is_delta(&s) {
            walk.beta.f *= 1.0 / q;
            walk.found = Found::Alone;
            m.sample.radiance += self.go_on(walk, &sampler, &mut edge, here, next)?;
            return Ok(());
        }
        let (mut emitted, mut connecting) = (Spectrum::ZERO, 0.0);
        if next.flags & vertex_flags::EMITS != 0 {
            emitted = next.emitted * (1.0 / q);
            if self.connects {
                connecting = scene.light_density(x, next);
            }
        }
        // What lies beyond has the colour of no first vertex; the weight is for later roulette.
        walk.beta.f = Spectrum::splat(worth / q);
        walk.found = Found::Counted;
        let scattered = self.go_on(walk, &sampler, &mut edge, here, next)? * (1.0 / worth);
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
        edge: &mut Edge,
        here: &mut Vertex,
        next: &mut Vertex,
    ) -> Outcome<Spectrum> {
        self.follow::<false, false, _>(walk, sampler, true, edge, here, next, &mut Together)
    }

    /// Connects the first vertices of the block's first `count` paths to all their second ones.
    fn share(&self, block: &mut Block, count: usize) -> Outcome<()> {
        let scene = self.scene;
        let (members, ways) = (&mut block.members[..count], &mut block.ways);
        for i in 0..count {
            let m = &members[i];
            let (light, arrival) = (m.light, m.arrival);
            if !m.shares || (light.is_none() && arrival.is_none()) {
                continue;
            }
            let mut x = m.second;
            let unhindered = m.sampler.connection(0, Spectrum::ONE);
            // Densities of: the light chosen; a light in the direction chosen; what else is there.
            let (mut of_light, mut of_emitted, mut of_scattered) = (0.0, 0.0, 0.0);
            ways.clear();
            for (k, other) in members.iter().enumerate() {
                let y = &other.first;
                let to = (x.position() - y.position()).as_dvec3();
                let d2 = to.length_squared();
                if !other.connects || !(d2 > 0.0) {
                    continue;
                }
                let w = (to / d2.sqrt()).as_vec3();
                // Scattering tells the two sides of a surface apart.
                let (ng, wo) = (Vec3::from(x.ng), Vec3::from(m.second.wo));
                if !(ng.dot(wo) * ng.dot(w) < 0.0) {
                    continue;
                }
                let ey = scatter::eval(scene, y, w, Mode::Radiance)?;
                let geometry = (f64::from(x.cosine(w)) / d2) as f32;
                let p = ey.forward * geometry;
                if !(p > 0.0 && p.is_finite()) {
                    continue;
                }
                if k != i
                    && scene
                        .connect(y, &target(&x, w, d2.sqrt() as f32), &unhindered)?
                        .is_none()
                {
                    continue;
                }
                x.wo = (-w).into();
                let mut way = Way {
                    member: k,
                    to_light: Spectrum::ZERO,
                    onward: Spectrum::ZERO,
                };
                let f = ey.f * geometry;
                if let Some(l) = &light {
                    let e = scatter::eval(scene, &x, l.wi.into(), Mode::Radiance)?;
                    let delta = l.flags & vertex_flags::DELTA != 0;
                    of_light += p * (l.density + if delta { 0.0 } else { e.forward });
                    way.to_light = f * e.f;
                }
                if let Some(a) = &arrival {
                    let e = scatter::eval(scene, &x, a.wi, Mode::Radiance)?;
                    of_emitted += p * (a.connecting + e.forward);
                    of_scattered += p * e.forward;
                    way.onward = f * e.f;
                }
                ways.push(way);
            }
            let over = |density: f32| if density > 0.0 { 1.0 / density } else { 0.0 };
            let mut lit = Spectrum::ZERO;
            if let Some(l) = &light
                && ways.iter().any(|way| !way.to_light.is_zero())
                && scene.connect(&members[i].second, l, &unhindered)?.is_some()
            {
                lit = l.radiance * over(of_light);
            }
            let arrived = arrival.map_or(Spectrum::ZERO, |a| {
                a.emitted * over(of_emitted) + a.scattered * over(of_scattered)
            });
            for way in ways.iter() {
                let m = &mut members[way.member];
                m.sample.radiance += (way.to_light * lit + way.onward * arrived) * m.weight;
            }
        }
        Ok(())
    }
}
