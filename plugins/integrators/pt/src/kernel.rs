//! One path, and the branches that look for the sun.
//!
//! With a peaked phase function and a sun, light that arrives after a scattering into the sun's direction is rare and strong: the
//! value of the last phase function has the relative second moment (1+g²)/(1−g²)², 22 at g = 0.85. The remedy is in the spirit of
//! VROOM (Buras & Mayer 2011): at a vertex of the walk a branch leaves with probability c in a direction sampled *around the
//! sun* with density q_L; it goes on like the walk, but never branches itself. A given path can come about by the walk alone, or by
//! a branch at any of its vertices; the balance heuristic over all of these gives every path, whichever way it came about, the weight
//!
//!   1 / (1 + S),   S = Σ over vertices k of c q_L(ω_k) / q(ω_k)
//!
//! where q is the walk's own density. So S is carried along, and nothing else changes: walk and branches have one kernel.

use resolvent_api::abi::{PixelSample, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::operator::{Mode, Scatter, lobes};
use resolvent_api::vertex::{Edge, vertex_flags};
use resolvent_api::{SceneView, Spectrum, Transport, Vec3, Vertex, VertexKind};
use resolvent_pathspace::mis::Throughput;
use resolvent_pathspace::orders::Tally;
use resolvent_pathspace::sampler::{Bounce, Sampler};
use resolvent_pathspace::{features, roulette, scatter};

/// What paths are made with.
pub struct Kernel<'a> {
    /// The scene.
    pub scene: &'a SceneView<'a>,
    /// Scattering events after which a path ends.
    pub max_depth: u32,
    /// Vertices are connected to lights.
    pub connects: bool,
    /// Direction towards the sun, if walks branch.
    pub sun: Option<Vec3>,
    /// Probability c of a branch.
    pub branching: f32,
}

/// How the direction to the next vertex was found, for the weight of light met there.
#[derive(Clone, Copy)]
pub enum Found {
    /// By the camera or a delta lobe: no connection could have found it.
    Alone,
    /// By scattering with this density per steradian.
    With(f32),
    /// Whichever way: its light is counted already.
    Counted,
}

/// The state of a walk between two vertices.
#[derive(Clone, Copy)]
pub struct Walk {
    /// Contribution and density.
    pub beta: Throughput,
    /// S: density of the ways through branches, relative to the walk's.
    pub others: f32,
    /// How the current direction was found.
    pub found: Found,
    /// Scattering events so far.
    pub depth: u32,
    /// What the numbers of the next vertex share with those before.
    pub shared: [f32; 2],
    /// Density of the current direction around the sun relative to isotropic, at least 1: what the light still to come
    /// is expected to be worth.
    pub promise: f32,
}

impl Walk {
    /// A walk that leaves the camera with this weight.
    pub fn new(weight: f32, sampler: &Sampler) -> Self {
        let mut beta = Throughput::ONE;
        beta.f *= weight;
        Self {
            beta,
            others: 0.0,
            found: Found::Alone,
            depth: 0,
            shared: sampler.first_point(),
            promise: 1.0,
        }
    }
}

impl Kernel<'_> {
    /// Traces the path of one sample of a pixel.
    pub fn path<const CHROMATIC: bool, T: Tally>(
        &self,
        sampler: &Sampler,
        pixel: [u32; 2],
        wants_features: bool,
        tally: &mut T,
    ) -> Outcome<PixelSample> {
        let mut out = PixelSample::default();
        let lanes = self.scene.lanes();
        let (film, lens) = sampler.camera();
        let Some(ray) = self.scene.camera_ray(pixel, film, lens)? else {
            return Ok(out);
        };
        let walk = Walk::new(ray.weight, sampler);
        let (mut first, mut second) = (Vertex::empty(), Vertex::empty());
        // Vertices are large: they change roles, not places.
        let (here, next) = (&mut first, &mut second);
        let mut edge = Edge::default();
        let flight = sampler.flight(0, walk.beta.p);
        let alive = self.scene.emerge(&ray, &flight, &mut edge, next)?;
        let met = alive.then_some(&*next);
        features::fill(&mut out, met, &edge, lanes, wants_features);
        out.radiance = if self.sun.is_some() {
            self.follow::<CHROMATIC, true, T>(walk, sampler, alive, &mut edge, here, next, tally)?
        } else {
            self.follow::<CHROMATIC, false, T>(walk, sampler, alive, &mut edge, here, next, tally)?
        };
        Ok(out)
    }

    /// Follows a walk from the edge it is on to its end; the light it finds.
    #[allow(clippy::too_many_arguments)]
    pub fn follow<'v, const CHROMATIC: bool, const BRANCHES: bool, T: Tally>(
        &self,
        mut walk: Walk,
        sampler: &Sampler,
        mut alive: bool,
        edge: &mut Edge,
        mut here: &'v mut Vertex,
        mut next: &'v mut Vertex,
        tally: &mut T,
    ) -> Outcome<Spectrum> {
        let scene = self.scene;
        let lanes = scene.lanes();
        let emissive = scene.has(scene_traits::EMISSIVE_MEDIA);
        let mut light = Spectrum::ZERO;
        loop {
            let share = 1.0 / (1.0 + walk.others);
            let order = walk.depth as usize;
            if emissive {
                let emitted = walk.beta.f * edge.emitted * share;
                light += emitted;
                tally.add(order, emitted);
            }
            if !alive {
                break;
            }
            let medium = next.is(VertexKind::Medium);
            if !medium
                && next.flags & vertex_flags::EMITS != 0
                && !matches!(walk.found, Found::Counted)
            {
                let other = match walk.found {
                    Found::With(density) if self.connects => {
                        scene.light_density(here, next) / density
                    }
                    _ => 0.0,
                };
                let found = walk.beta.found::<CHROMATIC>(edge, other, lanes);
                let found = found * next.emitted * share;
                light += found;
                tally.add(order, found);
            }
            if next.is(VertexKind::Emitter) {
                break;
            }
            walk.beta.travel::<CHROMATIC>(edge);
            if walk.depth >= self.max_depth {
                break;
            }
            std::mem::swap(&mut here, &mut next);
            if medium {
                walk.beta
                    .collide::<CHROMATIC>(here.sigma_t, here.sigma_s, lanes);
                if walk.beta.f.is_zero() {
                    break;
                }
            }
            let bounce = sampler.bounce(walk.depth, walk.shared);
            walk.shared = bounce.next;
            if self.connects {
                let connected = self.connect::<CHROMATIC>(here, &walk, sampler, &bounce)? * share;
                light += connected;
                tally.add(order + 1, connected);
            }
            if BRANCHES && medium {
                light += self.branch::<CHROMATIC, T>(here, &walk, sampler, tally)?;
            }
            let Some(s) = scatter::sample(scene, here, bounce.scatter, Mode::Radiance)? else {
                break;
            };
            walk.beta.f *= s.weight;
            let wi = Vec3::from(s.wi);
            walk.found = if scatter::is_delta(&s) {
                Found::Alone
            } else {
                Found::With(s.forward)
            };
            if let Some(sun) = self.sun {
                self.turn(&mut walk, here, wi, sun, s.forward, medium)?;
            }
            if !survives::<CHROMATIC>(&mut walk, bounce.roulette, lanes) {
                break;
            }
            walk.depth += 1;
            let flight = sampler.flight(walk.depth, walk.beta.p);
            alive = scene.propagate(here, wi, &flight, edge, next)?;
        }
        Ok(light)
    }

    /// Accounts for a new direction `wi`, chosen with density `q` at `here`: its share of the ways through branches, and
    /// what it promises.
    #[inline(always)]
    pub fn turn(
        &self,
        walk: &mut Walk,
        here: &Vertex,
        wi: Vec3,
        sun: Vec3,
        q: f32,
        medium: bool,
    ) -> Outcome<()> {
        if !medium {
            walk.promise = 1.0;
            return Ok(());
        }
        let around = around_sun(self.scene, here, sun, wi)?;
        walk.others += self.branching * around / q;
        walk.promise = (around * 4.0 * core::f32::consts::PI).max(1.0);
        Ok(())
    }

    /// Perhaps sends a branch from `here` towards the sun; the light it finds.
    #[inline(always)]
    fn branch<const CHROMATIC: bool, T: Tally>(
        &self,
        here: &Vertex,
        walk: &Walk,
        sampler: &Sampler,
        tally: &mut T,
    ) -> Outcome<Spectrum> {
        let Some(sun) = self.sun else {
            return Ok(Spectrum::ZERO);
        };
        let (chance, draws) = sampler.branching(walk.depth);
        if chance >= self.branching {
            return Ok(Spectrum::ZERO);
        }
        let scene = self.scene;
        let Some(s) = here.scatter.sample(-sun, draws, Mode::Radiance) else {
            return Ok(Spectrum::ZERO);
        };
        let wi = Vec3::from(s.wi);
        let e = scatter::eval(scene, here, wi, Mode::Radiance)?;
        // Where the walk's own density is below all normal numbers, one over it is infinite; such a branch weighs nothing (S > 10³⁰).
        if !(e.forward >= f32::MIN_POSITIVE) {
            return Ok(Spectrum::ZERO);
        }
        let mut walk = *walk;
        walk.beta.f *= e.f * (1.0 / e.forward);
        walk.found = Found::With(e.forward);
        self.turn(&mut walk, here, wi, sun, e.forward, true)?;
        let sampler = sampler.branch(walk.depth);
        let numbers = sampler.bounce(walk.depth, walk.shared);
        walk.shared = numbers.next;
        if !survives::<CHROMATIC>(&mut walk, numbers.roulette, scene.lanes()) {
            return Ok(Spectrum::ZERO);
        }
        walk.depth += 1;
        let (mut first, mut second) = (*here, Vertex::empty());
        let mut edge = Edge::default();
        let flight = sampler.flight(walk.depth, walk.beta.p);
        let alive = scene.propagate(here, wi, &flight, &mut edge, &mut second)?;
        let (here, next) = (&mut first, &mut second);
        self.follow::<CHROMATIC, false, T>(walk, &sampler, alive, &mut edge, here, next, tally)
    }

    /// Light that reaches `here` straight from a light chosen at random.
    #[inline(always)]
    pub fn connect<const CHROMATIC: bool>(
        &self,
        here: &Vertex,
        walk: &Walk,
        sampler: &Sampler,
        bounce: &Bounce,
    ) -> Outcome<Spectrum> {
        let scene = self.scene;
        if here.is(VertexKind::Surface) && here.scatter.lobes() & lobes::SMOOTH == 0 {
            return Ok(Spectrum::ZERO);
        }
        let Some(light) = scene.sample_light(here, bounce.choice, bounce.point)? else {
            return Ok(Spectrum::ZERO);
        };
        let e = scatter::eval(scene, here, Vec3::from(light.wi), Mode::Radiance)?;
        if e.f.is_zero() {
            return Ok(Spectrum::ZERO);
        }
        let mut weight = e.f;
        if here.is(VertexKind::Medium) {
            // A peaked phase function rarely faces the light: most connections carry next to nothing. Roulette on the value
            // relative to isotropic scattering saves their transmittance.
            let q = roulette::connection(e.f.max_lane());
            if q < 1.0 {
                if bounce.chance >= q {
                    return Ok(Spectrum::ZERO);
                }
                weight *= 1.0 / q;
            }
        }
        let Some(edge) =
            scene.connect(here, &light, &sampler.connection(walk.depth, walk.beta.p))?
        else {
            return Ok(Spectrum::ZERO);
        };
        let delta = light.flags & vertex_flags::DELTA != 0;
        let other = if delta { 0.0 } else { e.forward };
        let found = walk
            .beta
            .connected::<CHROMATIC>(&edge, light.density, other, scene.lanes());
        Ok(found * weight * light.radiance)
    }
}

/// Density of a direction under the phase function of `here` turned towards the sun.
#[inline(always)]
fn around_sun(scene: &SceneView<'_>, here: &Vertex, sun: Vec3, wi: Vec3) -> Outcome<f32> {
    match here.scatter.try_eval(-sun, wi, Mode::Radiance) {
        Ok(e) => Ok(e.forward),
        Err(_) => Err(scene.fault(here, "panicked in eval")),
    }
}

/// Plays roulette with what the walk is worth: its weight times what its direction promises.
#[inline(always)]
fn survives<const CHROMATIC: bool>(walk: &mut Walk, chance: f32, lanes: u32) -> bool {
    let weight = walk.beta.weight::<CHROMATIC>(lanes).max_lane() / (1.0 + walk.others);
    let q = roulette::survival(weight * walk.promise);
    if q < 1.0 {
        if chance >= q {
            return false;
        }
        walk.beta.f *= 1.0 / q;
    }
    true
}
