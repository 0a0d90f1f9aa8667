//! Connections: the strategies of a path, their contribution and their weight.

use super::depth;
use super::draws::{Draws, End};
use super::path::Joint;
use super::subpath::{Subpath, sensor_vertex, towards};
use super::verify::Verified;
use crate::mis::{self, Heuristic, MediaDensities, Strategies};
use crate::sampler::Purpose;
use crate::{features, measure, roulette, scatter};
use measure::conversion;
use resolvent_api::abi::PixelSample;
use resolvent_api::integrator::Outcome;
use resolvent_api::operator::{Mode, ScatterEval};
use resolvent_api::vertex::{Edge, LightSample, NONE, vertex_flags};
use resolvent_api::{SceneView, Spectrum, Transport, Vec3, Vertex, VertexKind};

/// Light that falls on the film from a walk that started at a light.
#[derive(Clone, Copy, Debug)]
pub struct Splat {
    /// Where, pixels.
    pub film: [f32; 2],
    /// Weighted contribution per walk.
    pub radiance: Spectrum,
}

/// Two walks and what connects them; storage is kept between paths.
pub struct Bidirectional {
    /// From the sensor.
    pub sensor: Subpath,
    /// From a light.
    pub light: Subpath,
    /// The densities of the last connection's path.
    pub strategies: Strategies,
    /// How weights are made.
    pub heuristic: Heuristic,
    /// What they take for media.
    pub media: MediaDensities,
    /// What was recomputed, if that is wanted.
    pub verified: Option<Verified>,
}

/// What connects two walks.
#[derive(Clone, Copy)]
struct Link {
    edge: Edge,
    /// ratio/track, as weights have it.
    rho: Spectrum,
    /// Transmittance of the approximate depth; all ones if weights do without.
    smooth: Spectrum,
}

/// The densities that a connection changes: of the two vertices it joins and of their neighbours, seen across it.
#[derive(Clone, Copy, Default)]
struct Across {
    /// L of the vertex on the sensor's side, and of the one beyond.
    light: [f64; 2],
    /// S of the vertex on the light's side, and of the one beyond.
    sensor: [f64; 2],
}

impl Bidirectional {
    /// Two walks not begun; `light_walks` walks from lights go with each from a pixel.
    pub fn new(light_walks: f64, heuristic: Heuristic, media: MediaDensities) -> Self {
        Self {
            sensor: Subpath::new(media),
            light: Subpath::new(media),
            strategies: Strategies {
                light_walks,
                ..Strategies::default()
            },
            heuristic,
            media,
            verified: None,
        }
    }

    /// Walks from the sensor through a sample of `pixel` until `limit` vertices; the sample has what the camera's ray tells
    /// beside light (`wanted`: with features).
    pub fn look<const CHROMATIC: bool, D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        pixel: [u32; 2],
        draws: &mut D,
        limit: usize,
        wanted: bool,
    ) -> Outcome<PixelSample> {
        let mut sample = PixelSample::default();
        self.sensor.clear();
        let [a, b, c, d] = draws.four(End::Sensor, 0, Purpose::Camera);
        if let Some(ray) = scene.camera_ray(pixel, [a, b], [c, d])? {
            self.sensor
                .from_sensor::<CHROMATIC, _>(scene, &ray, draws, limit)?;
            let (met, edge) = self.sensor.first();
            features::fill(&mut sample, met, &edge, scene.lanes(), wanted);
        }
        Ok(sample)
    }

    /// Strategy s = 0: the walk from the sensor met a light at its vertex `t − 1`.
    pub fn hit(&mut self, scene: &SceneView<'_>, t: usize) -> Outcome<Spectrum> {
        let nodes = self.sensor.nodes();
        let node = &nodes[t - 1];
        let v = &node.vertex;
        if v.flags & vertex_flags::EMITS == 0 || v.is(VertexKind::Medium) {
            return Ok(Spectrum::ZERO);
        }
        let f = node.beta.f * v.emitted;
        if t == 2 || self.heuristic == Heuristic::Alone {
            return Ok(f / node.beta.p.mean(scene.lanes()));
        }
        let before = &nodes[t - 2].vertex;
        let [position, direction] = scene.emission_density(v, before)?;
        let w = towards(v, before);
        let chosen = f64::from(scene.light_density(before, v)) * conversion(before, v, -w);
        let across = Across {
            light: [
                f64::from(position),
                f64::from(direction) * conversion(v, before, w),
            ],
            sensor: [0.0; 2],
        };
        let p = node.beta.p;
        self.assemble(0, t, &across, chosen, None);
        let value = self.weigh([0, t], f, p, None, scene.lanes());
        if self.verified.is_some() && !value.is_zero() {
            let joint = Joint {
                vertex: None,
                importance: 0.0,
                edge: None,
            };
            self.check(scene, [0, t], joint, value, 1.0)?;
        }
        Ok(value)
    }

    /// Strategy s = 1: vertex `t − 1` of the walk from the sensor connects to a light chosen as seen from there.
    pub fn next_event<D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        t: usize,
        draws: &mut D,
    ) -> Outcome<Spectrum> {
        let nodes = self.sensor.nodes();
        let node = &nodes[t - 1];
        let z = &node.vertex;
        if z.is(VertexKind::Emitter) || !measure::is_connectible(z) {
            return Ok(Spectrum::ZERO);
        }
        let [a, b, choice, chance] = draws.four(End::Sensor, t as u32 - 2, Purpose::Light);
        let Some(light) = scene.sample_light(z, choice, [a, b])? else {
            return Ok(Spectrum::ZERO);
        };
        let wi = Vec3::from(light.wi);
        let e = scatter::eval(scene, z, wi, Mode::Radiance)?;
        if e.f.is_zero() {
            return Ok(Spectrum::ZERO);
        }
        let mut f = node.beta.f * e.f * light.radiance * (1.0 / light.density);
        let mut survival = 1.0;
        if z.is(VertexKind::Medium) {
            // As in path tracing: a peaked phase function rarely faces the light.
            let q = roulette::connection(e.f.max_lane());
            if q < 1.0 {
                if chance >= q {
                    return Ok(Spectrum::ZERO);
                }
                f *= 1.0 / q;
                survival /= f64::from(q);
            }
        }
        let Some(edge) = scene.connect(z, &light, &draws.connection(1, t as u32))? else {
            return Ok(Spectrum::ZERO);
        };
        let link = self.link(scene, z, &light, edge)?;
        let x = emitter(&light);
        let [position, direction] = scene.emission_density(&x, z)?;
        let to_light = conversion(z, &x, wi);
        // Scattering never finds a light without extent.
        let delta = light.flags & vertex_flags::DELTA != 0;
        let scattered = if delta { 0.0 } else { e.forward };
        let across = Across {
            light: [
                f64::from(direction) * conversion(&x, z, -wi),
                reverse_at(&e, z, &nodes[t - 2].vertex),
            ],
            sensor: [f64::from(scattered) * to_light, 0.0],
        };
        let chosen = f64::from(light.density) * to_light;
        let p = node.beta.p * mis::track(&edge);
        self.assemble(1, t, &across, chosen, Some(&link));
        self.strategies.from_light[0] = f64::from(position);
        let value = self.weigh([1, t], f * edge.value, p, Some(&link), scene.lanes());
        if self.verified.is_some() && !value.is_zero() {
            let mut x = x;
            if delta && !x.is_infinite() {
                // A point's radiance stands for its intensity as seen from here.
                x.emitted *= light.distance * light.distance;
            }
            let joint = Joint {
                vertex: Some(x),
                importance: 0.0,
                edge: Some(edge),
            };
            self.check(scene, [1, t], joint, value, survival)?;
        }
        Ok(value)
    }

    /// A strategy s ≥ 2, t ≥ 2: vertex `s − 1` of the walk from the light connects to vertex `t − 1` of the other.
    pub fn join<D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        s: usize,
        t: usize,
        draws: &mut D,
    ) -> Outcome<Spectrum> {
        let (ys, zs) = (self.light.nodes(), self.sensor.nodes());
        let (ny, nz) = (&ys[s - 1], &zs[t - 1]);
        let (y, z) = (&ny.vertex, &nz.vertex);
        if z.is(VertexKind::Emitter) || !measure::is_connectible(z) || !measure::is_connectible(y) {
            return Ok(Spectrum::ZERO);
        }
        let to = (y.position() - z.position()).as_dvec3();
        let d2 = to.length_squared();
        if !(d2 > 0.0) {
            return Ok(Spectrum::ZERO);
        }
        let w = (to / d2.sqrt()).as_vec3();
        let ez = scatter::eval(scene, z, w, Mode::Radiance)?;
        if ez.f.is_zero() {
            return Ok(Spectrum::ZERO);
        }
        let ey = scatter::eval(scene, y, -w, Mode::Importance)?;
        if ey.f.is_zero() {
            return Ok(Spectrum::ZERO);
        }
        let target = target(y, w, d2.sqrt() as f32);
        let u = draws.connection(s as u32, t as u32);
        let Some(edge) = scene.connect(z, &target, &u)? else {
            return Ok(Spectrum::ZERO);
        };
        let across = Across {
            light: [
                f64::from(ey.forward) * conversion(y, z, w),
                reverse_at(&ez, z, &zs[t - 2].vertex),
            ],
            sensor: [
                f64::from(ez.forward) * conversion(z, y, w),
                reverse_at(&ey, y, &ys[s - 2].vertex),
            ],
        };
        let f = ny.beta.f * nz.beta.f * ey.f * ez.f * edge.value * (1.0 / d2) as f32;
        let p = ny.beta.p * nz.beta.p * mis::track(&edge);
        let link = self.link(scene, z, &target, edge)?;
        self.assemble(s, t, &across, 0.0, Some(&link));
        self.start_from_light(scene);
        let value = self.weigh([s, t], f, p, Some(&link), scene.lanes());
        if self.verified.is_some() && !value.is_zero() {
            let joint = Joint {
                vertex: None,
                importance: 0.0,
                edge: Some(edge),
            };
            self.check(scene, [s, t], joint, value, 1.0)?;
        }
        Ok(value)
    }

    /// Strategy t = 1: vertex `s − 1` of the walk from the light connects to the lens. For s = 1 the light itself is seen.
    pub fn project<D: Draws>(
        &mut self,
        scene: &SceneView<'_>,
        s: usize,
        draws: &mut D,
    ) -> Outcome<Option<Splat>> {
        let ys = self.light.nodes();
        let ny = &ys[s - 1];
        let y = &ny.vertex;
        if s > 1 && !measure::is_connectible(y) {
            return Ok(None);
        }
        let lens = draws.four(End::Light, s as u32 - 1, Purpose::Ray);
        let Some(sensor) = scene.sense(y, [lens[2], lens[3]])? else {
            return Ok(None);
        };
        let wi = Vec3::from(sensor.target.wi);
        let z = sensor_vertex(sensor.target.p, wi, sensor.target.flags);
        let (start, e) = if s == 1 {
            (
                Spectrum::splat((1.0 / ny.forward) as f32),
                shown(scene, y, &sensor_vertex(sensor.target.p, wi, 0))?,
            )
        } else {
            (ny.beta.f, scatter::eval(scene, y, wi, Mode::Importance)?)
        };
        if e.f.is_zero() {
            return Ok(None);
        }
        let u = draws.connection(s as u32, 1);
        let Some(edge) = scene.connect(y, &sensor.target, &u)? else {
            return Ok(None);
        };
        let d2 = if z.is_infinite() {
            1.0
        } else {
            f64::from(sensor.target.distance).powi(2)
        };
        let importance = f64::from(sensor.target.density);
        let f = start * e.f * edge.value * (importance / d2) as f32;
        let p = ny.beta.p * mis::track(&edge);
        let radiance = if self.heuristic == Heuristic::Alone {
            f / (p * mis::rho(&edge)).mean(scene.lanes())
        } else {
            let across = Across {
                light: [0.0; 2],
                sensor: [
                    importance * conversion(&z, y, wi),
                    if s > 1 {
                        reverse_at(&e, y, &ys[s - 2].vertex)
                    } else {
                        0.0
                    },
                ],
            };
            let link = self.link(scene, y, &sensor.target, edge)?;
            self.assemble(s, 1, &across, 0.0, Some(&link));
            self.start_from_light(scene);
            let value = self.weigh([s, 1], f, p, Some(&link), scene.lanes());
            if self.verified.is_some() && !value.is_zero() {
                let joint = Joint {
                    vertex: Some(z),
                    importance,
                    edge: Some(edge),
                };
                self.check(scene, [s, 1], joint, value, 1.0)?;
            }
            value
        };
        Ok(Some(Splat {
            film: sensor.film,
            radiance,
        }))
    }

    /// What weights need of the connection `edge` from `from` to `to`.
    fn link(
        &self,
        scene: &SceneView<'_>,
        from: &Vertex,
        to: &LightSample,
        edge: Edge,
    ) -> Outcome<Link> {
        let (rho, smooth) = match self.media {
            MediaDensities::Exact => (mis::rho(&edge), Spectrum::ONE),
            MediaDensities::Depth => {
                let t = depth::kept(scene.approximate(from, to)?);
                (t.map(|t| 1.0 / t), t)
            }
        };
        Ok(Link { edge, rho, smooth })
    }

    /// What strategies s ≥ 2 know of the light's vertex beyond the walk.
    fn start_from_light(&mut self, scene: &SceneView<'_>) {
        self.strategies.chosen = self.light.chosen(scene);
        if self.light.nodes()[0].vertex.flags & vertex_flags::DELTA != 0 {
            self.strategies.from_sensor[0] = 0.0;
        }
    }

    /// Fills the densities of the path of strategy (s, t).
    fn assemble(
        &mut self,
        s: usize,
        t: usize,
        across: &Across,
        chosen: f64,
        connection: Option<&Link>,
    ) {
        let (ys, zs) = (self.light.nodes(), self.sensor.nodes());
        let n = s + t - 1;
        let out = &mut self.strategies;
        out.resize(n);
        out.chosen = chosen;
        // Strategy 1 has no walk from a light: its vertex there is new.
        let walked = if s > 1 { s } else { 0 };
        for (i, y) in ys.iter().enumerate().take(walked) {
            out.from_light[i] = y.forward;
            out.from_sensor[i] = y.reverse;
            out.delta[i] = y.delta && i + 1 < s;
            if i > 0 {
                out.rho[i - 1] = y.rho;
            }
        }
        let seen = if t > 1 { t } else { 0 };
        for (j, z) in zs.iter().enumerate().take(seen) {
            let i = n - j;
            out.from_sensor[i] = z.forward;
            out.from_light[i] = z.reverse;
            out.delta[i] = z.delta && j + 1 < t;
            if j > 0 {
                out.rho[i] = z.rho;
            }
        }
        for (k, l) in across.light.into_iter().enumerate() {
            // With s = 0, the first of the two is the light's own vertex.
            if s + k <= n {
                out.from_light[s + k] = l;
            }
        }
        for (k, p) in across.sensor.into_iter().enumerate() {
            if s > k {
                out.from_sensor[s - 1 - k] = p;
            }
        }
        if let (Some(link), true) = (connection, s > 0) {
            out.rho[s - 1] = link.rho;
        }
    }

    /// The contribution `f` over the densities of all strategies; `p` has the exact lane densities of walks and connection.
    fn weigh(
        &self,
        [s, t]: [usize; 2],
        f: Spectrum,
        p: Spectrum,
        link: Option<&Link>,
        lanes: u32,
    ) -> Spectrum {
        let divisor = match self.media {
            MediaDensities::Exact => self.strategies.divisor(s, p, lanes, self.heuristic),
            MediaDensities::Depth => {
                let rho = link.map_or(Spectrum::ONE, |l| mis::rho(&l.edge));
                let mut smooth = link.map_or(Spectrum::ONE, |l| l.smooth);
                if s > 1 {
                    smooth *= self.light.nodes()[s - 1].smooth;
                }
                if t > 1 {
                    smooth *= self.sensor.nodes()[t - 1].smooth;
                }
                f64::from((p * rho).mean(lanes))
                    / self.strategies.weight(s, smooth, lanes, self.heuristic)
            }
        };
        if divisor > 0.0 {
            f * (1.0 / divisor) as f32
        } else {
            Spectrum::ZERO
        }
    }
}

/// The density per area or volume at which `v` would find the vertex before it, coming across the connection.
fn reverse_at(e: &ScatterEval, v: &Vertex, before: &Vertex) -> f64 {
    f64::from(e.reverse) * conversion(v, before, Vec3::from(v.wo))
}

/// A vertex as the end of a connection that comes along `w`.
pub fn target(v: &Vertex, w: Vec3, distance: f32) -> LightSample {
    let surface = v.is(VertexKind::Surface);
    LightSample {
        wi: w.into(),
        distance,
        radiance: Spectrum::ONE,
        density: 1.0,
        light: NONE,
        // A point in space has no surface of its own to be kept from.
        flags: if surface { 0 } else { vertex_flags::DELTA },
        p: v.p,
        ng: v.ng,
        primitive: v.primitive,
        p_error: v.p_error,
    }
}

/// The vertex of a point chosen on a light.
fn emitter(light: &LightSample) -> Vertex {
    let infinite = light.flags & vertex_flags::INFINITE != 0;
    let delta = light.flags & vertex_flags::DELTA != 0;
    let surface = !infinite && !delta;
    let kind = if surface {
        VertexKind::Surface
    } else {
        VertexKind::Emitter
    };
    Vertex {
        kind: kind as u32,
        flags: light.flags | vertex_flags::EMITS,
        p: if infinite { light.wi } else { light.p },
        p_error: light.p_error,
        light: light.light,
        ng: light.ng,
        primitive: light.primitive,
        emitted: light.radiance,
        ..Vertex::empty()
    }
}

/// Radiance of the light's vertex `y` towards the sensor `z`, times its cosine, as if it had scattered.
fn shown(scene: &SceneView<'_>, y: &Vertex, z: &Vertex) -> Outcome<ScatterEval> {
    let mut e = ScatterEval::default();
    // Lights without extent can't be seen.
    if y.is(VertexKind::Surface) {
        e.f = scene.radiance(y, z)? * y.cosine(towards(y, z));
    }
    Ok(e)
}
