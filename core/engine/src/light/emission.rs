//! Rays that leave lights: how light walks start, and with which densities.
//!
//! A ray from a light at infinity comes from a disk across its direction that covers the scene's bounding sphere
//! (Veach 1997, §10.3.4; Pharr et al. 2023, §12.5).

use super::{Light, Lights};
use crate::geometry::offset_origin;
use resolvent_api::Spectrum;
use resolvent_api::closure::Closure;
use resolvent_api::math::{Frame, Vec3, warp};
use resolvent_api::vertex::{LightRay, NONE, Vertex, VertexKind, vertex_flags};
use std::f32::consts::FRAC_1_PI;

/// A sphere around everything that can scatter.
#[derive(Clone, Copy, Debug)]
pub struct BoundingSphere {
    /// Its centre.
    pub center: Vec3,
    /// Its radius.
    pub radius: f32,
}

impl BoundingSphere {
    /// Density per area of a point on a disk of its section.
    fn section_density(&self) -> f32 {
        FRAC_1_PI / (self.radius * self.radius)
    }

    /// A point on the disk that stands before it, seen from `towards`.
    fn before(&self, towards: Vec3, u: [f32; 2]) -> Vec3 {
        let [x, y] = warp::disk(u);
        let frame = Frame::around(towards);
        self.center + frame.to_world(Vec3::new(x, y, 1.0)) * self.radius
    }
}

impl Lights {
    /// Chooses a light in proportion to its power, a vertex on it (filled into `vertex`) and a ray that leaves it. The interior
    /// media it starts in are left to the caller.
    pub fn emit(
        &self,
        choice: f32,
        position: [f32; 2],
        direction: [f32; 2],
        vertex: &mut Vertex,
    ) -> Option<LightRay> {
        let (i, probability, _) = self.chooser(false).choose(choice)?;
        *vertex = Vertex {
            kind: VertexKind::Emitter as u32,
            light: i,
            scatter: Closure::EMPTY,
            ..Vertex::empty()
        };
        let around = self.bounds.section_density();
        match &self.all[i as usize] {
            Light::Area(area) => {
                let at = area.point(position)?;
                let (mut u, mut side) = (direction, 1.0);
                let mut density = FRAC_1_PI;
                if area.two_sided {
                    density *= 0.5;
                    u[0] *= 2.0;
                    if u[0] >= 1.0 {
                        u[0] -= 1.0;
                        side = -1.0;
                    }
                }
                let local = warp::cosine_hemisphere(u);
                if !(local.z > 0.0) {
                    return None;
                }
                let frame = Frame::around(at.ng);
                let d = frame.to_world(Vec3::new(local.x, local.y, side * local.z));
                vertex.kind = VertexKind::Surface as u32;
                vertex.flags = vertex_flags::EMITS;
                vertex.p = at.p.into();
                vertex.p_error = at.error().into();
                vertex.ng = at.ng.into();
                vertex.frame = frame;
                vertex.primitive = [area.shape, at.prim];
                vertex.wo = d.into();
                // It may be dark in this direction and seen from another: the ray counts, even if it carries nothing.
                let radiance = area.radiance_towards(at.uv, &at.color, d);
                vertex.uv = at.uv;
                vertex.emitted = radiance;
                let o = offset_origin(at.p, at.error(), at.ng, d);
                let per_area = probability / area.area;
                // The cosine is both in the flux and in the density.
                let weight = radiance / (per_area * density);
                Some(ray(o, d, per_area, density * local.z, weight))
            }
            Light::Point {
                position: p,
                intensity,
            } => {
                let d = warp::sphere(direction);
                vertex.flags = vertex_flags::DELTA;
                vertex.p = (*p).into();
                vertex.emitted = *intensity;
                let weight = *intensity / (probability * warp::SPHERE_PDF);
                Some(ray(*p, d, probability, warp::SPHERE_PDF, weight))
            }
            Light::Spot(spot) => {
                let d = spot.direction(direction);
                let intensity = spot.towards(d);
                let density = spot.direction_density(d);
                if !(density > 0.0) || intensity.is_zero() {
                    return None;
                }
                vertex.flags = vertex_flags::DELTA;
                vertex.p = spot.position.into();
                vertex.wo = d.into();
                vertex.emitted = intensity;
                let weight = intensity / (probability * density);
                Some(ray(spot.position, d, probability, density, weight))
            }
            Light::Distant {
                to_light,
                irradiance,
            } => {
                vertex.flags = vertex_flags::DELTA | vertex_flags::INFINITE;
                vertex.p = (*to_light).into();
                vertex.emitted = *irradiance;
                let o = self.bounds.before(*to_light, position);
                let weight = *irradiance / (probability * around);
                Some(ray(o, -*to_light, probability, around, weight))
            }
            infinite => {
                let wi = Vec3::from(infinite.sample(Vec3::ZERO, direction)?.wi);
                // One technique for all of them together.
                let (radiance, per_direction) = self.mixture(self.chooser(false), wi);
                if !(per_direction > 0.0) || radiance.is_zero() {
                    return None;
                }
                vertex.flags = vertex_flags::INFINITE | vertex_flags::EMITS;
                vertex.p = wi.into();
                vertex.wo = (-wi).into();
                vertex.light = NONE;
                vertex.emitted = radiance;
                let o = self.bounds.before(wi, position);
                let weight = radiance / (per_direction * around);
                Some(ray(o, -wi, per_direction, around, weight))
            }
        }
    }

    /// Radiance that the vertex `light` on an emitting surface sends towards `to`.
    pub fn radiance(&self, light: &Vertex, to: &Vertex) -> Spectrum {
        match self.all.get(light.light as usize) {
            Some(Light::Area(area)) => {
                let w = (to.position() - light.position()).normalize_or_zero();
                let shows = area.two_sided || w.dot(light.ng.into()) > 0.0;
                if shows {
                    let color = area.color_at(light.primitive[1], light.position());
                    area.radiance_towards(light.uv, &color, w)
                } else {
                    Spectrum::ZERO
                }
            }
            _ => Spectrum::ZERO,
        }
    }

    /// The densities (position, direction) with which [`Lights::emit`] gives the vertex `light` and a ray to `to`.
    pub fn emission_density(&self, light: &Vertex, to: &Vertex) -> [f32; 2] {
        let chooser = self.chooser(false);
        if light.is_infinite() {
            let position = if light.flags & vertex_flags::DELTA != 0 {
                chooser.probability(light.light)
            } else {
                self.mixture(chooser, light.position()).1
            };
            return [position, self.bounds.section_density()];
        }
        let Some(emitter) = self.all.get(light.light as usize) else {
            return [0.0; 2];
        };
        let probability = chooser.probability(light.light);
        match emitter {
            Light::Area(area) => {
                let d = (to.position() - light.position()).normalize_or_zero();
                let cosine = d.dot(light.ng.into());
                let density = if area.two_sided {
                    0.5 * cosine.abs() * FRAC_1_PI
                } else {
                    cosine.max(0.0) * FRAC_1_PI
                };
                [probability / area.area, density]
            }
            Light::Point { .. } => [probability, warp::SPHERE_PDF],
            Light::Spot(spot) => {
                let d = (to.position() - spot.position).normalize_or_zero();
                [probability, spot.direction_density(d)]
            }
            _ => [0.0; 2],
        }
    }
}

fn ray(o: Vec3, d: Vec3, position: f32, direction: f32, weight: Spectrum) -> LightRay {
    LightRay {
        o: o.into(),
        position,
        d: d.into(),
        direction,
        weight,
        inside: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Cylinder, Disk, Quad, Sphere};
    use crate::light::{Area, Shaping, Spot};
    use resolvent_api::rng::Stream;
    use std::f32::consts::PI;

    fn lights() -> Lights {
        let quad = Quad {
            corner: Vec3::new(0.2, 0.1, -0.3),
            edge_u: Vec3::new(0.5, 0.0, 0.1),
            edge_v: Vec3::new(0.0, 0.4, 0.0),
        };
        let sphere = Sphere {
            center: Vec3::new(-0.5, 0.0, 0.2),
            radius: 0.3,
        };
        let to_light = Vec3::new(0.3, 0.5, 0.8).normalize();
        let disk = Disk {
            center: Vec3::new(0.1, 0.6, 0.3),
            normal: to_light,
            radius: 0.4,
        };
        let cylinder = Cylinder {
            base: Vec3::new(0.2, -0.6, 0.1),
            axis: Vec3::new(0.1, 0.2, 0.7),
            radius: 0.15,
        };
        let all =
            vec![
                Light::Area(Area::quad(0, quad, Spectrum::splat(2.0), true)),
                Light::Area(Area::sphere(1, sphere, Spectrum::splat(1.0), false)),
                Light::Point {
                    position: Vec3::new(0.0, 0.7, 0.0),
                    intensity: Spectrum::splat(0.5),
                },
                Light::Distant {
                    to_light,
                    irradiance: Spectrum::splat(1.5),
                },
                Light::Constant {
                    radiance: Spectrum::splat(0.3),
                },
                Light::disc(-to_light, Spectrum::splat(0.8), 20.0),
                Light::Spot(Spot::new(
                    Vec3::new(0.3, -0.4, 0.5),
                    -to_light,
                    Spectrum::splat(4.0),
                    70.0,
                    20.0,
                )),
                Light::Area(Area::disk(2, disk, Spectrum::splat(1.2), false)),
                Light::Area(Area::cylinder(3, cylinder, Spectrum::splat(0.7), true)),
                Light::Area(Area::disk(4, disk, Spectrum::splat(3.0), true).shaped(Some(
                    Shaping::new(
                        Vec3::new(0.6, 0.0, 0.8),
                        250.0,
                        0.5,
                        2.0,
                        Spectrum::splat(0.1),
                    ),
                ))),
                Light::Area(
                    Area::sphere(5, sphere, Spectrum::splat(5.0), false)
                        .shaped(Some(Shaping::new(Vec3::Y, 80.0, 1.0, 0.0, Spectrum::ZERO))),
                ),
            ];
        let bounds = BoundingSphere {
            center: Vec3::new(0.1, 0.0, 0.0),
            radius: 1.5,
        };
        Lights::new(all, bounds, 3)
    }

    /// The mean weight of each light's rays is its power, and the densities are those that are stated.
    #[test]
    fn rays_carry_the_power_of_their_light() {
        let lights = lights();
        let mut s = Stream::new(3);
        let mut sums = [[0f64; 2]; 11];
        let n = 400_000;
        let mut v = Vertex::empty();
        for _ in 0..n {
            let (choice, p, d) = (s.uniform(), s.uniform2(), s.uniform2());
            let Some(r) = lights.emit(choice, p, d, &mut v) else {
                continue;
            };
            let (o, d) = (Vec3::from(r.o), Vec3::from(r.d));
            let to = Vertex {
                p: (o + d).into(),
                ..Vertex::empty()
            };
            let [position, direction] = lights.emission_density(&v, &to);
            assert!((position / r.position - 1.0).abs() < 1e-4, "{r:?}");
            assert!(
                (direction / r.direction - 1.0).abs() < 1e-3,
                "{r:?} {direction}"
            );
            // The infinite lights are one mixture.
            let i = if v.light == NONE { 4 } else { v.light as usize };
            sums[i][0] += f64::from(r.weight[0]);
            sums[i][1] += f64::from(r.weight[0]).powi(2);
        }
        let power = |i: usize| f64::from(lights.all[i].power(1.5, 3));
        // The mixture's power stands with its first light.
        for i in [0, 1, 2, 3, 4, 6, 7, 8, 9, 10] {
            let expected = power(i) + if i == 4 { power(5) } else { 0.0 };
            let mean = sums[i][0] / f64::from(n);
            let error = ((sums[i][1] / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            assert!(
                (mean - expected).abs() < 4.0 * error + 3e-4 * expected,
                "light {i}: {mean} +- {error}, expected {expected}"
            );
        }
    }

    /// Rays of infinite lights hit the bounding sphere's section uniformly: second moments of their distance from the centre.
    #[test]
    fn rays_from_infinity_cover_the_scene() {
        let bounds = BoundingSphere {
            center: Vec3::new(1.0, 2.0, 3.0),
            radius: 2.0,
        };
        let mut s = Stream::new(8);
        let (n, mut sum) = (100_000, 0f64);
        for _ in 0..n {
            let w = warp::sphere(s.uniform2());
            let o = bounds.before(w, s.uniform2()) - bounds.center;
            assert!((o.dot(w) / bounds.radius - 1.0).abs() < 1e-5);
            sum += f64::from((o - w * o.dot(w)).length_squared());
        }
        // Mean squared radius of a uniform disk: R²/2 = 2.
        assert!((sum / f64::from(n) / 2.0 - 1.0).abs() < 0.01);
        assert!((bounds.section_density() * 4.0 * PI - 1.0).abs() < 1e-6);
    }
}
