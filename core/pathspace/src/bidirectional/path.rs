//! Whole paths, recomputed from scratch in double precision: what tests hold the incremental sums against.

use super::{Bidirectional, Node};
use crate::measure::conversion;
use crate::mis::{self, Strategies};
use crate::scatter;
use resolvent_api::integrator::Outcome;
use resolvent_api::math::{DVec3, Vec3};
use resolvent_api::operator::{Mode, ScatterEval};
use resolvent_api::vertex::{Edge, vertex_flags};
use resolvent_api::{SceneView, Vertex, VertexKind};

/// A path x_0 … x_n from a light to the sensor, without delta events.
pub struct Path {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The edge from x_i to x_{i+1}.
    pub edges: Vec<Edge>,
    /// Importance of the sensor towards x_{n−1}, per steradian.
    pub importance: f64,
}

impl Path {
    /// The path of strategy (s, t) of two walks joined by `edge`; the walks must reach that far.
    pub fn of(walks: &Bidirectional, s: usize, t: usize, edge: Edge, importance: f64) -> Self {
        let (ys, zs) = (&walks.light.nodes()[..s], &walks.sensor.nodes()[..t]);
        let rest = |nodes: &[Node]| nodes.iter().skip(1).map(|n| n.edge).collect::<Vec<_>>();
        let vertices = ys.iter().chain(zs.iter().rev()).map(|n| n.vertex).collect();
        let mut edges = rest(ys);
        edges.push(edge);
        edges.extend(rest(zs).into_iter().rev());
        Self {
            vertices,
            edges,
            importance,
        }
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
    pub fn contribution(&self, scene: &SceneView<'_>) -> Outcome<[f64; 4]> {
        let n = self.edges.len();
        let light = &self.vertices[0];
        let shown = match light.is(VertexKind::Surface) {
            true => scene.radiance(light, &self.vertices[1])?,
            false => light.emitted,
        };
        let mut f = shown.0.map(f64::from);
        let mut scale = self.importance;
        if !light.is_infinite() {
            scale *= f64::from(light.cosine(self.direction(0)));
        }
        for i in 0..n {
            let (a, b) = (&self.vertices[i], &self.vertices[i + 1]);
            if !a.is_infinite() {
                let d = a.position().as_dvec3() - b.position().as_dvec3();
                scale /= d.length_squared();
            }
            for (lane, f) in f.iter_mut().enumerate() {
                *f *= f64::from(self.edges[i].value[lane]);
            }
        }
        for i in 1..n {
            let v = &self.vertices[i];
            let e = self.turn(scene, i, Mode::Radiance)?;
            scale *= f64::from(v.cosine(self.direction(i)));
            for (lane, f) in f.iter_mut().enumerate() {
                *f *= f64::from(e.f[lane]);
                if v.is(VertexKind::Medium) {
                    *f *= f64::from(v.sigma_s[lane]);
                }
            }
        }
        Ok(f.map(|v| v * scale))
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
        out.chosen = f64::from(scene.light_density(&x[1], &x[0])) * conversion(&x[1], &x[0], w(0));
        out.from_sensor[n - 1] = self.importance * conversion(&x[n], &x[n - 1], w(n - 1));
        for i in 1..n {
            let (to_sensor, to_light) = if i < s {
                let e = self.turn(scene, i, Mode::Importance)?;
                (e.forward, e.reverse)
            } else {
                let e = self.turn(scene, i, Mode::Radiance)?;
                (e.reverse, e.forward)
            };
            out.from_light[i + 1] = f64::from(to_sensor) * conversion(&x[i], &x[i + 1], w(i));
            out.from_sensor[i - 1] = f64::from(to_light) * conversion(&x[i], &x[i - 1], w(i - 1));
        }
        if x[0].flags & vertex_flags::DELTA != 0 {
            // Scattering never finds it.
            out.from_sensor[0] = 0.0;
        }
        for (rho, edge) in out.rho.iter_mut().zip(&self.edges) {
            *rho = mis::rho(edge);
        }
        Ok(out)
    }

    /// The lane densities under flights of all edges and collisions.
    pub fn track(&self) -> [f64; 4] {
        let mut out = [1.0; 4];
        for (lane, out) in out.iter_mut().enumerate() {
            for e in &self.edges {
                *out *= f64::from(mis::track(e)[lane]);
            }
            for v in &self.vertices {
                if v.is(VertexKind::Medium) {
                    *out *= f64::from(v.sigma_t[lane]);
                }
            }
        }
        out
    }
}
