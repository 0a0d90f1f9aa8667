//! Whole paths, recomputed from scratch in double precision: what the incremental sums are held against.

use super::depth;
use super::{Bidirectional, Node};
use crate::measure::conversion;
use crate::mis::{self, MediaDensities, Strategies};
use crate::scatter;
use resolvent_api::integrator::Outcome;
use resolvent_api::math::{DVec3, Vec3};
use resolvent_api::operator::{Mode, ScatterEval};
use resolvent_api::vertex::{Edge, vertex_flags};
use resolvent_api::{SceneView, Spectrum, Vertex, VertexKind};

/// What became of a walk at a vertex that cannot be asked again: a delta lobe has no values beside the one that it was sampled with.
#[derive(Clone, Copy)]
struct Turned {
    /// f̄ times both cosines, per lane, as if the lobe had had the density below.
    f: [f64; 4],
    /// Density at which the vertex's neighbour towards the sensor is found from it, and that towards the light.
    to: [f64; 2],
}

/// A product of many factors per lane, far beyond what a number holds: `lanes` times e to the power of `log`.
#[derive(Clone, Copy, Debug)]
pub struct Product {
    /// Relative to the largest.
    pub lanes: [f64; 4],
    /// Logarithm of what they are multiplied by.
    pub log: f64,
}

impl Default for Product {
    fn default() -> Self {
        Self {
            lanes: [1.0; 4],
            log: 0.0,
        }
    }
}

impl Product {
    fn times(&mut self, factors: [f64; 4]) {
        for (lane, f) in self.lanes.iter_mut().zip(factors) {
            *lane *= f;
        }
        let largest = self.lanes.into_iter().fold(0.0, f64::max);
        if largest > 0.0 {
            self.lanes = self.lanes.map(|l| l / largest);
            self.log += largest.ln();
        }
    }

    fn scale(&mut self, factor: f64) {
        self.times([factor; 4]);
    }

    /// The lanes as a spectrum.
    pub fn spectrum(&self) -> Spectrum {
        Spectrum(self.lanes.map(|l| l as f32))
    }
}

/// A path x_0 … x_n from a light to the sensor.
pub struct Path {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The edge from x_i to x_{i+1}.
    pub edges: Vec<Edge>,
    /// Importance of the sensor towards x_{n−1}, per steradian.
    pub importance: f64,
    turned: Vec<Option<Turned>>,
}

/// The vertex that a strategy adds to its walks, and the edge that closes the path.
pub(super) struct Joint {
    /// The point on a light (s = 1) or on the lens (t = 1).
    pub vertex: Option<Vertex>,
    /// Importance of the lens (t = 1).
    pub importance: f64,
    /// What connects the walks; s = 0 has nothing.
    pub edge: Option<Edge>,
}

impl Path {
    /// The path of strategy (s, t) of two walks; they must reach that far.
    pub(super) fn of(walks: &Bidirectional, s: usize, t: usize, joint: &Joint) -> Self {
        let ys = if s > 1 {
            &walks.light.nodes()[..s]
        } else {
            &[]
        };
        let zs = if t > 1 {
            &walks.sensor.nodes()[..t]
        } else {
            &[]
        };
        let rest = |nodes: &[Node]| nodes.iter().skip(1).map(|n| n.edge).collect::<Vec<_>>();
        let mut vertices: Vec<Vertex> = ys.iter().map(|n| n.vertex).collect();
        vertices.extend(joint.vertex);
        vertices.extend(zs.iter().rev().map(|n| n.vertex));
        let mut edges = rest(ys);
        edges.extend(joint.edge);
        edges.extend(rest(zs).into_iter().rev());
        let importance = if t > 1 {
            walks.sensor.start
        } else {
            joint.importance
        };
        let mut path = Self {
            turned: vec![None; vertices.len()],
            vertices,
            edges,
            importance,
        };
        let n = path.edges.len();
        for (nodes, from_light) in [(ys, true), (zs, false)] {
            for k in 1..nodes.len().saturating_sub(1) {
                if nodes[k].delta {
                    let i = if from_light { k } else { n - k };
                    path.turned[i] = Some(path.turned_at(i, nodes, k, from_light));
                }
            }
        }
        path
    }

    fn turned_at(&self, i: usize, nodes: &[Node], k: usize, from_light: bool) -> Turned {
        let (here, next) = (&nodes[k].vertex, &nodes[k + 1].vertex);
        let (w, back) = (self.direction(i), self.direction(i - 1));
        let (ahead, behind) = if from_light { (w, back) } else { (-back, -w) };
        let per_angle = nodes[k + 1].forward / conversion(here, next, ahead);
        let cosine = f64::from(here.cosine(behind));
        let f = nodes[k].turn.0.map(|v| f64::from(v) * per_angle * cosine);
        let (forward, reverse) = (nodes[k + 1].forward, nodes[k - 1].reverse);
        Turned {
            f,
            to: if from_light {
                [forward, reverse]
            } else {
                [reverse, forward]
            },
        }
    }

    /// True if x_i was turned at by a delta lobe: nothing connects there.
    pub fn is_delta(&self, i: usize) -> bool {
        self.turned[i].is_some()
    }

    /// Unit direction from x_i to x_{i+1}, away from the light.
    fn direction(&self, i: usize) -> Vec3 {
        let (a, b) = (&self.vertices[i], &self.vertices[i + 1]);
        if a.is_infinite() {
            return -a.position();
        }
        (b.position().as_dvec3() - a.position().as_dvec3())
            .normalize_or(DVec3::ZERO)
            .as_vec3()
    }

    /// By how much recomputed values may differ because directions come from rounded positions: the directions' error, over the
    /// cosines that they meet surfaces with.
    pub fn rounding(&self) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.edges.len() {
            let (a, b) = (&self.vertices[i], &self.vertices[i + 1]);
            if a.is_infinite() {
                continue;
            }
            let size = |v: &Vertex| v.position().abs().max_element();
            let d = (a.position().as_dvec3() - b.position().as_dvec3()).length();
            let w = self.direction(i);
            let cosine = a.cosine(w).min(b.cosine(w)).max(1e-6);
            sum += f64::from(f32::EPSILON * (size(a) + size(b))) / (d * f64::from(cosine));
        }
        sum
    }

    /// K at x_i, seen along the path in one direction or the other.
    fn turn(&self, scene: &SceneView<'_>, i: usize, mode: Mode) -> Outcome<ScatterEval> {
        let (to_light, to_sensor) = (-self.direction(i - 1), self.direction(i));
        let mut v = self.vertices[i];
        let (wo, wi) = match mode {
            Mode::Radiance => (to_sensor, to_light),
            Mode::Importance => (to_light, to_sensor),
        };
        v.wo = wo.into();
        scatter::eval(scene, &v, wi, mode)
    }

    /// The measurement contribution f (Veach 1997, eq. 8.7; Jakob 2013, eq. 3.8) in the product of area, volume and, for
    /// lights at infinity, solid angle; per lane, media's null collisions as they were.
    ///
    /// # Errors
    /// If a plugin breaks.
    pub fn contribution(&self, scene: &SceneView<'_>) -> Outcome<Product> {
        let n = self.edges.len();
        let light = &self.vertices[0];
        let shown = match light.is(VertexKind::Surface) {
            true => scene.radiance(light, &self.vertices[1])?,
            false => light.emitted,
        };
        let mut f = Product::default();
        f.times(shown.0.map(f64::from));
        f.scale(self.importance);
        if !light.is_infinite() {
            f.scale(f64::from(light.cosine(self.direction(0))));
        }
        for i in 0..n {
            let (a, b) = (&self.vertices[i], &self.vertices[i + 1]);
            if !a.is_infinite() {
                let d = a.position().as_dvec3() - b.position().as_dvec3();
                f.scale(1.0 / d.length_squared());
            }
            f.times(self.edges[i].value.0.map(f64::from));
        }
        for i in 1..n {
            let v = &self.vertices[i];
            match self.turned[i] {
                Some(turned) => f.times(turned.f),
                None => {
                    let e = self.turn(scene, i, Mode::Radiance)?;
                    f.times(e.f.0.map(f64::from));
                    f.scale(f64::from(v.cosine(self.direction(i))));
                }
            }
            if v.is(VertexKind::Medium) {
                f.times(v.sigma_s.0.map(f64::from));
            }
        }
        Ok(f)
    }

    /// The densities of all strategies, as a walk finds them that takes its first `s` vertices from the light: closures are
    /// asked in the direction of the walk that was at their vertex, so that every `s` asks for forward and reverse elsewhere.
    ///
    /// # Errors
    /// If a plugin breaks.
    pub fn densities(
        &self,
        scene: &SceneView<'_>,
        s: usize,
        light_walks: f64,
        media: MediaDensities,
    ) -> Outcome<Strategies> {
        let n = self.edges.len();
        let mut out = Strategies {
            light_walks,
            ..Strategies::default()
        };
        out.resize(n);
        let x = &self.vertices;
        let w = |i: usize| self.direction(i);
        let [position, direction] = scene.emission_density(&x[0], &x[1])?;
        out.from_light[0] = f64::from(position);
        out.from_light[1] = f64::from(direction) * conversion(&x[0], &x[1], w(0));
        out.chosen = f64::from(scene.light_density(&x[1], &x[0])) * conversion(&x[1], &x[0], -w(0));
        out.from_sensor[n - 1] = self.importance * conversion(&x[n], &x[n - 1], -w(n - 1));
        for i in 1..n {
            let [to_sensor, to_light] = match self.turned[i] {
                Some(turned) => {
                    out.delta[i] = true;
                    turned.to
                }
                None => {
                    let [to_sensor, to_light] = if i < s {
                        let e = self.turn(scene, i, Mode::Importance)?;
                        [e.forward, e.reverse]
                    } else {
                        let e = self.turn(scene, i, Mode::Radiance)?;
                        [e.reverse, e.forward]
                    };
                    [
                        f64::from(to_sensor) * conversion(&x[i], &x[i + 1], w(i)),
                        f64::from(to_light) * conversion(&x[i], &x[i - 1], -w(i - 1)),
                    ]
                }
            };
            out.from_light[i + 1] = to_sensor;
            out.from_sensor[i - 1] = to_light;
        }
        if x[0].flags & vertex_flags::DELTA != 0 {
            // Scattering never finds it.
            out.from_sensor[0] = 0.0;
        }
        for (i, edge) in self.edges.iter().enumerate() {
            out.rho[i] = match media {
                MediaDensities::Exact => mis::rho(edge),
                MediaDensities::Depth => depth::smooth(scene, &x[i + 1], &x[i])?.map(|t| 1.0 / t),
            };
        }
        Ok(out)
    }

    /// The lane densities under flights of all edges and collisions.
    ///
    /// # Errors
    /// If a plugin breaks.
    pub fn track(&self, scene: &SceneView<'_>, media: MediaDensities) -> Outcome<Product> {
        let mut out = Product::default();
        for (i, e) in self.edges.iter().enumerate() {
            let track = match media {
                MediaDensities::Exact => mis::track(e),
                MediaDensities::Depth => {
                    depth::smooth(scene, &self.vertices[i + 1], &self.vertices[i])?
                }
            };
            out.times(track.0.map(f64::from));
        }
        for v in self.vertices.iter().filter(|v| v.is(VertexKind::Medium)) {
            out.times(v.sigma_t.0.map(f64::from));
        }
        Ok(out)
    }
}
