//! Subpaths as data: the vertices of a walk from the sensor or from a light, with the densities at which either end finds them.

use super::depth;
use super::draws::{Draws, End};
use crate::measure::conversion;
use crate::mis::{self, MediaDensities, Throughput};
use crate::sampler::Purpose;
use crate::{roulette, scatter};
use resolvent_api::integrator::Outcome;
use resolvent_api::operator::{Mode, ScatterSample};
use resolvent_api::vertex::{CameraRay, Edge, vertex_flags};
use resolvent_api::{SceneView, Spectrum, Transport, Vec3, Vertex, VertexKind};

/// Vertices of the longest walk that is kept. What goes on longer, in media that hardly absorb, would fill any memory.
const MOST_VERTICES: usize = 1 << 17;

/// A vertex of a subpath.
#[derive(Clone, Copy)]
pub struct Node {
    /// The vertex; its `wo` points to the one before.
    pub vertex: Vertex,
    /// The edge from the vertex before.
    pub edge: Edge,
    /// Contribution over density, up to and including the collision here, before scattering.
    pub beta: Throughput,
    /// Density, per area or volume, at which the vertex before found this one.
    pub forward: f64,
    /// Density, per area or volume, at which the vertex after would find this one; known once that has scattered.
    pub reverse: f64,
    /// What roulette multiplied `beta` by.
    pub survival: f64,
    /// What scattering here multiplied `beta` by: f̄·D over its density.
    pub turn: Spectrum,
    /// ratio/track of the edge from the vertex before, as weights have it.
    pub rho: Spectrum,
    /// Lane densities of the walk until here through approximate depths, relative to their mean; all ones if weights do without.
    pub smooth: Spectrum,
    /// The walk was turned by a delta lobe here: nothing can be connected to.
    pub delta: bool,
}

impl Node {
    fn new() -> Self {
        Self {
            vertex: Vertex::empty(),
            edge: Edge::default(),
            beta: Throughput::ONE,
            forward: 0.0,
            reverse: 0.0,
            survival: 1.0,
            turn: Spectrum::ONE,
            rho: Spectrum::ONE,
            smooth: Spectrum::ONE,
            delta: false,
        }
    }
}

/// A walk; its storage is kept between paths.
pub struct Subpath {
    nodes: Vec<Node>,
    len: usize,
    media: MediaDensities,
    /// Density per steradian of the first direction (walks from the sensor: the importance).
    pub start: f64,
    /// Radiance that media emit along each edge walked (walks from the sensor): one more than vertices to arrive at if the
    /// light was lost. That of edge k was scattered k times.
    pub emitted: Vec<Spectrum>,
    /// Density of the start when it is chosen as seen from the vertex after it (walks from a light), once it was asked for.
    chosen: Option<f64>,
}

impl Subpath {
    /// A walk not begun, for weights of this kind.
    pub fn new(media: MediaDensities) -> Self {
        Self {
            nodes: Vec::new(),
            len: 0,
            media,
            start: 0.0,
            emitted: Vec::new(),
            chosen: None,
        }
    }

    /// The vertices.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes[..self.len]
    }

    /// The vertex after the start, if one was met, and the edge towards it.
    pub fn first(&self) -> (Option<&Vertex>, Edge) {
        let met = (self.len > 1).then(|| &self.nodes[1].vertex);
        (met, self.nodes.get(1).map_or(mis::clear(0.0), |n| n.edge))
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if the walk did not begin.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forgets the walk.
    pub fn clear(&mut self) {
        self.len = 0;
        self.emitted.clear();
        self.chosen = None;
    }

    /// Density per area, or probability, of the start of a walk from a light when it is chosen as seen from the vertex after it:
    /// of strategy 1. The same for all connections of the walk.
    pub(super) fn chosen(&mut self, scene: &SceneView<'_>) -> f64 {
        let (x, y) = (&self.nodes[0].vertex, &self.nodes[1].vertex);
        *self.chosen.get_or_insert_with(|| {
            f64::from(scene.light_density(y, x)) * conversion(y, x, -towards(x, y))
        })
    }

    fn push(&mut self) -> usize {
        if self.len == self.nodes.len() {
            self.nodes.push(Node::new());
        }
        self.len += 1;
        self.len - 1
    }

    /// Walks from the sensor along `ray` until `limit` vertices, the sensor among them.
    pub fn from_sensor<const CHROMATIC: bool, D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        ray: &CameraRay,
        draws: &mut D,
        limit: usize,
    ) -> Outcome<()> {
        self.clear();
        let first = self.push();
        let node = &mut self.nodes[first];
        node.vertex = sensor_vertex(ray.o, -Vec3::from(ray.d), ray.flags);
        node.beta = Throughput::ONE;
        node.beta.f *= ray.weight;
        // The place on the lens is chosen alike by all techniques: its density cancels.
        node.forward = 1.0;
        node.reverse = 1.0;
        node.delta = false;
        self.walk::<CHROMATIC, D>(scene, End::Sensor, ray, ray.density, draws, limit)
    }

    /// Walks from a light until `limit` vertices, the one on the light among them.
    pub fn from_light<const CHROMATIC: bool, D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        draws: &mut D,
        limit: usize,
    ) -> Outcome<()> {
        self.clear();
        let first = self.push();
        let [a, b, choice, _] = draws.four(End::Light, 0, Purpose::Emission);
        let [c, d, ..] = draws.four(End::Light, 0, Purpose::Ray);
        let node = &mut self.nodes[first];
        let Some(start) = scene.emit(choice, [a, b], [c, d], &mut node.vertex)? else {
            self.len = 0;
            return Ok(());
        };
        node.beta = Throughput::ONE;
        node.beta.f *= start.weight;
        node.forward = f64::from(start.position);
        node.reverse = 0.0;
        node.delta = false;
        let ray = CameraRay {
            o: start.o,
            d: start.d,
            weight: 1.0,
            inside: start.inside,
            ..CameraRay::default()
        };
        self.walk::<CHROMATIC, D>(scene, End::Light, &ray, start.direction, draws, limit)
    }

    fn walk<const CHROMATIC: bool, D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        end: End,
        ray: &CameraRay,
        density: f32,
        draws: &mut D,
        limit: usize,
    ) -> Outcome<()> {
        let lanes = scene.lanes();
        let mode = match end {
            End::Sensor => Mode::Radiance,
            End::Light => Mode::Importance,
        };
        // Weights count relative to the start: what a light gives is neither small nor large.
        let scale = self.nodes[0].beta.f.max_lane();
        if !(scale > 0.0) {
            return Ok(());
        }
        let mut beta = self.nodes[0].beta;
        self.start = f64::from(density);
        let mut density = f64::from(density);
        let mut survival = 1.0;
        let mut direction = Vec3::from(ray.d);
        for bounce in 0u32.. {
            if self.len >= limit {
                break;
            }
            if self.len == MOST_VERTICES {
                let last = &self.nodes[self.len - 1].vertex;
                let most = MOST_VERTICES - 1;
                let why = format!(
                    "a walk has scattered {most} times, and no longer one is kept whole: set `max_depth`, or use the integrator pt"
                );
                return Err(scene.fault(last, &why));
            }
            let at = self.push();
            let (before, rest) = self.nodes.split_at_mut(at);
            let (from, node) = (&mut before[at - 1], &mut rest[0]);
            let flight = draws.flight(end, bounce, beta.p);
            let alive = if bounce == 0 {
                scene.emerge(ray, &flight, &mut node.edge, &mut node.vertex)?
            } else {
                let (edge, next) = (&mut node.edge, &mut node.vertex);
                scene.propagate(&from.vertex, direction, &flight, edge, next)?
            };
            if end == End::Sensor {
                self.emitted.push(beta.f * node.edge.emitted);
            }
            let arrived = alive && (end == End::Sensor || !node.vertex.is(VertexKind::Emitter));
            if !arrived {
                self.len -= 1;
                break;
            }
            beta.travel::<CHROMATIC>(&node.edge);
            node.rho = match self.media {
                MediaDensities::Exact => mis::rho(&node.edge),
                MediaDensities::Depth => {
                    let t = match end {
                        End::Sensor => depth::smooth(scene, &from.vertex, &node.vertex)?,
                        End::Light => depth::smooth(scene, &node.vertex, &from.vertex)?,
                    };
                    if CHROMATIC {
                        let lit = from.smooth * t;
                        let p = if node.vertex.is(VertexKind::Medium) {
                            lit * node.vertex.sigma_t
                        } else {
                            lit
                        };
                        node.smooth = p * (1.0 / p.mean(lanes).max(f32::MIN_POSITIVE));
                    }
                    t.map(|t| 1.0 / t)
                }
            };
            node.forward = density * conversion(&from.vertex, &node.vertex, direction);
            node.delta = false;
            node.reverse = 0.0;
            if node.vertex.is(VertexKind::Medium) {
                let v = &node.vertex;
                beta.collide::<CHROMATIC>(v.sigma_t, v.sigma_s, lanes);
            }
            node.beta = beta;
            node.survival = survival;
            if node.vertex.is(VertexKind::Emitter) || beta.f.is_zero() || self.len >= limit {
                break;
            }
            let (u, chance) = draws.scatter(end, bounce);
            let Some(s) = scatter::sample(scene, &node.vertex, u, mode)? else {
                break;
            };
            let wi = Vec3::from(s.wi);
            let (forward, reverse) = turn(&node.vertex, &s);
            node.delta = scatter::is_delta(&s);
            from.reverse =
                reverse * conversion(&node.vertex, &from.vertex, Vec3::from(node.vertex.wo));
            node.turn = s.weight;
            beta.f *= s.weight;
            let q = roulette::survival(beta.weight::<CHROMATIC>(lanes).max_lane() / scale);
            if q < 1.0 {
                if chance >= q {
                    break;
                }
                beta.f *= 1.0 / q;
                survival /= f64::from(q);
            }
            density = forward;
            direction = wi;
        }
        Ok(())
    }
}

/// Densities per steradian of a turn along the walk and against it.
///
/// A delta lobe is a distribution in projected solid angle with the refracted side's compressed by η²: relative to the
/// common measure of both directions its probabilities stand over |cos θ| and, against the walk, over η² as well
/// (Veach 1997, §10.3.5). So the weights are exact on specular chains, too.
fn turn(v: &Vertex, s: &ScatterSample) -> (f64, f64) {
    let (forward, reverse) = (f64::from(s.forward), f64::from(s.reverse));
    if !scatter::is_delta(s) {
        return (forward, reverse);
    }
    let n = Vec3::from(v.frame.n);
    let cosine = |w: [f32; 3]| f64::from(n.dot(Vec3::from(w)).abs()).max(1e-12);
    let eta = f64::from(s.eta);
    (forward / cosine(s.wi), reverse / (cosine(v.wo) * eta * eta))
}

/// The vertex on the sensor at `p`, which lies in direction `to` of what it sees; `flags` are the camera's. Parallel rays come from
/// infinity, as far as densities are concerned.
pub(super) fn sensor_vertex(p: [f32; 3], to: Vec3, flags: u32) -> Vertex {
    let parallel = flags & vertex_flags::PARALLEL != 0;
    Vertex {
        kind: VertexKind::Sensor as u32,
        flags: if parallel { vertex_flags::INFINITE } else { 0 },
        p: if parallel { to.into() } else { p },
        ..Vertex::empty()
    }
}

/// Unit direction from one vertex to the next; towards a vertex at infinity, or away from it.
pub(super) fn towards(from: &Vertex, to: &Vertex) -> Vec3 {
    if from.is_infinite() {
        -from.position()
    } else if to.is_infinite() {
        to.position()
    } else {
        (to.position() - from.position()).normalize_or_zero()
    }
}
