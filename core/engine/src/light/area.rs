//! Emitting shapes.

use super::{Distribution, Shaping, per_solid_angle};
use crate::geometry::{Cylinder, Disk, Quad, Sphere, TriangleMesh, mixed};
use crate::texture::Binding;
use resolvent_api::Spectrum;
use resolvent_api::math::{Frame, Vec3, warp};
use resolvent_api::vertex::{LightSample, NONE};
use std::f32::consts::PI;

/// An emitting shape.
pub struct Area {
    /// Index of the shape it lies on.
    pub shape: u32,
    /// W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
    /// Emits on both sides of the surface, else only on the side of the normal.
    pub two_sided: bool,
    /// Where points are chosen.
    pub form: AreaShape,
    /// Surface area.
    pub area: f32,
    /// Further magnitudes of terms that made its coordinates, see [`AreaPoint::size`].
    pub terms: Vec3,
    /// What the radiance is multiplied with over the surface, and its mean; for meshes and parallelograms. Points are chosen
    /// without regard to it.
    texture: Option<(Binding, Spectrum)>,
    /// What the radiance is multiplied with by direction, and its mean.
    shaping: Option<Box<(Shaping, Spectrum)>>,
}

/// A point on an emitting shape.
#[derive(Clone, Copy, Debug)]
pub struct AreaPoint {
    /// Position.
    pub p: Vec3,
    /// Sum of the magnitudes of the terms that make each coordinate, of which rounding takes its share.
    pub size: Vec3,
    /// Unit normal.
    pub ng: Vec3,
    /// Primitive of the shape.
    pub prim: u32,
    /// Texture coordinates, on meshes and parallelograms; zero elsewhere.
    pub uv: [f32; 2],
    /// Colour of meshes that have colours; else white.
    pub color: [f32; 4],
}

impl AreaPoint {
    /// Bound of the rounding error in each coordinate: half an ulp for each of the few operations that gave it, relative to the
    /// terms involved. Where they cancel, the coordinate is small and its error is not.
    pub fn error(&self) -> Vec3 {
        self.size * 6e-7
    }
}

/// The form of an emitting shape.
pub enum AreaShape {
    /// A parallelogram and its unit normal; points are uniform in area.
    Quad(Quad, Vec3),
    /// A sphere; directions are uniform in the cone it fills as seen from outside, points uniform in area from inside.
    Sphere(Sphere),
    /// A disk, with a frame around its normal; points are uniform in area.
    Disk(Disk, Frame),
    /// The lateral surface of a cylinder, with a frame around its axis; points are uniform in area.
    Cylinder(Cylinder, Frame),
    /// Triangles; points are uniform in area.
    Mesh(TriangleMesh, Distribution),
}

impl Area {
    /// An emitting parallelogram.
    pub fn quad(shape: u32, quad: Quad, radiance: Spectrum, two_sided: bool) -> Self {
        let area = quad
            .edge_u
            .as_dvec3()
            .cross(quad.edge_v.as_dvec3())
            .length() as f32;
        Self {
            shape,
            radiance,
            two_sided,
            form: AreaShape::Quad(quad, quad.edge_u.cross(quad.edge_v).normalize_or_zero()),
            area,
            terms: Vec3::ZERO,
            texture: None,
            shaping: None,
        }
    }

    /// An emitting sphere.
    pub fn sphere(shape: u32, sphere: Sphere, radiance: Spectrum, two_sided: bool) -> Self {
        let area = 4.0 * PI * sphere.radius * sphere.radius;
        Self {
            shape,
            radiance,
            two_sided,
            form: AreaShape::Sphere(sphere),
            area,
            terms: Vec3::ZERO,
            texture: None,
            shaping: None,
        }
    }

    /// An emitting disk.
    pub fn disk(shape: u32, disk: Disk, radiance: Spectrum, two_sided: bool) -> Self {
        Self {
            shape,
            radiance,
            two_sided,
            form: AreaShape::Disk(disk, Frame::around(disk.normal)),
            area: PI * disk.radius * disk.radius,
            terms: Vec3::ZERO,
            texture: None,
            shaping: None,
        }
    }

    /// An emitting cylinder.
    pub fn cylinder(shape: u32, cylinder: Cylinder, radiance: Spectrum, two_sided: bool) -> Self {
        let axis = cylinder.axis.as_dvec3();
        let length = axis.length();
        Self {
            shape,
            radiance,
            two_sided,
            form: AreaShape::Cylinder(cylinder, Frame::around((axis / length).as_vec3())),
            area: (2.0 * std::f64::consts::PI * f64::from(cylinder.radius) * length) as f32,
            terms: Vec3::ZERO,
            texture: None,
            shaping: None,
        }
    }

    /// Emitting triangles; those without area are never chosen.
    pub fn mesh(shape: u32, mesh: TriangleMesh, radiance: Spectrum, two_sided: bool) -> Self {
        let areas: Vec<f64> = mesh
            .indices
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            })
            .collect();
        let area = areas.iter().sum::<f64>() as f32;
        let distribution = Distribution::new(&areas);
        Self {
            shape,
            radiance,
            two_sided,
            form: AreaShape::Mesh(mesh, distribution),
            area,
            terms: Vec3::ZERO,
            texture: None,
            shaping: None,
        }
    }

    /// As part of an instance: its coordinates are sums of terms of this magnitude, too.
    pub fn made_of(mut self, terms: Vec3) -> Self {
        self.terms = terms;
        self
    }

    /// The same with its radiance multiplied by a texture.
    pub fn textured(mut self, texture: Option<Binding>) -> Self {
        self.texture = texture.map(|t| {
            let [r, g, b, _] = t.mean();
            (t, Spectrum::rgb(r, g, b))
        });
        self
    }

    /// The same with its radiance multiplied by a factor that depends on direction.
    pub fn shaped(mut self, shaping: Option<Shaping>) -> Self {
        self.shaping = shaping.map(|s| {
            let normal = match &self.form {
                AreaShape::Quad(_, n) => Some(*n),
                AreaShape::Disk(d, _) => Some(d.normal),
                _ => None,
            };
            let mean = match normal {
                Some(n) if self.two_sided => (s.mean(Some(n)) + s.mean(Some(-n))) * 0.5,
                normal => s.mean(normal),
            };
            Box::new((s, mean))
        });
        self
    }

    /// Emitted radiance at texture coordinates, where the mesh has the colour `color`, in the unit direction `w`, away from the surface.
    #[inline]
    pub fn radiance_towards(&self, uv: [f32; 2], color: &[f32; 4], w: Vec3) -> Spectrum {
        match &self.shaping {
            None => self.radiance_at(uv, color),
            Some(shaping) => self.radiance_at(uv, color) * shaping.0.factor(w),
        }
    }

    /// The colour of the mesh at the point `p` of its triangle `prim`; white for shapes without colours.
    pub fn color_at(&self, prim: u32, p: Vec3) -> [f32; 4] {
        let AreaShape::Mesh(mesh, _) = &self.form else {
            return [1.0; 4];
        };
        let Some(corner) = mesh.indices.get(prim as usize) else {
            return [1.0; 4];
        };
        if mesh.colors.is_empty() {
            return [1.0; 4];
        }
        // Barycentric coordinates as quotients of areas.
        let [a, b, c] = corner.map(|i| mesh.positions[i as usize].as_dvec3());
        let n = (b - a).cross(c - a);
        let d = p.as_dvec3() - a;
        let s = (d.cross(c - a).dot(n) / n.length_squared()).clamp(0.0, 1.0);
        let t = ((b - a).cross(d).dot(n) / n.length_squared()).clamp(0.0, 1.0 - s);
        mixed(corner.map(|i| mesh.colors[i as usize]), s as f32, t as f32)
    }

    /// Emitted radiance at texture coordinates, where no direction is favoured.
    #[inline]
    fn radiance_at(&self, uv: [f32; 2], color: &[f32; 4]) -> Spectrum {
        match &self.texture {
            None => self.radiance,
            Some((texture, _)) => {
                let [r, g, b, _] = texture.at(uv, color);
                self.radiance * Spectrum::rgb(r, g, b)
            }
        }
    }

    /// Radiant power, W; of textured ones approximately, by the mean of the whole image, and of cylinders and meshes that favour
    /// directions as if their normals were spread evenly.
    pub fn power(&self, lanes: u32) -> f32 {
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        let radiance = match &self.texture {
            None => self.radiance,
            Some((_, mean)) => self.radiance * *mean,
        };
        let radiance = match &self.shaping {
            None => radiance,
            Some(shaping) => radiance * shaping.1,
        };
        sides * PI * self.area * radiance.mean(lanes)
    }

    /// Chooses a point for `from`; `None` if it shows nothing there.
    #[inline]
    pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        if let AreaShape::Sphere(s) = &self.form {
            return self.sample_sphere(s, from, u);
        }
        let at = self.point(u)?;
        let density = per_solid_angle(1.0 / self.area, from, at.p, at.ng);
        self.finish(from, &at, density)
    }

    /// Chooses a point, uniform in area.
    #[inline]
    pub fn point(&self, u: [f32; 2]) -> Option<AreaPoint> {
        let (mut uv, mut color) = ([0.0; 2], [1.0; 4]);
        let (p, size, ng, prim) = match &self.form {
            AreaShape::Quad(q, ng) => {
                let p = q.corner + q.edge_u * u[0] + q.edge_v * u[1];
                let size = q.corner.abs() + q.edge_u.abs() + q.edge_v.abs();
                uv = u;
                (p, size, *ng, u32::from(u[1] > u[0]))
            }
            AreaShape::Mesh(mesh, distribution) => {
                let (i, rest) = distribution.sample(u[0])?;
                let [a, b, c] = mesh.indices[i].map(|i| mesh.positions[i as usize]);
                // Uniform on the triangle by folding the square over its diagonal.
                let (mut s, mut t) = (rest, u[1]);
                if s + t > 1.0 {
                    (s, t) = (1.0 - s, 1.0 - t);
                }
                let p = a + (b - a) * s + (c - a) * t;
                let ng = (b - a).cross(c - a).normalize_or_zero();
                let size = a.abs() + (b - a).abs() + (c - a).abs();
                // Without coordinates they are the weights of the corners, as where a ray hits.
                uv = match &mesh.uvs[..] {
                    [] => [s, t],
                    uvs => {
                        let [a, b, c] = mesh.indices[i].map(|i| uvs[i as usize]);
                        (a + (b - a) * s + (c - a) * t).into()
                    }
                };
                if !mesh.colors.is_empty() {
                    color = mixed(mesh.indices[i].map(|i| mesh.colors[i as usize]), s, t);
                }
                (p, size, ng, i as u32)
            }
            AreaShape::Sphere(s) => {
                let n = warp::sphere(u);
                let size = s.center.abs() + Vec3::splat(s.radius);
                (s.center + n * s.radius, size, n, 0)
            }
            AreaShape::Disk(d, frame) => {
                let [x, y] = warp::disk(u);
                let p = d.center + frame.to_world(Vec3::new(x, y, 0.0)) * d.radius;
                let size = d.center.abs() + Vec3::splat(d.radius);
                (p, size, d.normal, 0)
            }
            AreaShape::Cylinder(c, frame) => {
                let (sin, cos) = (2.0 * PI * u[0]).sin_cos();
                let n = frame.to_world(Vec3::new(cos, sin, 0.0));
                let p = c.base + c.axis * u[1] + n * c.radius;
                let size = c.base.abs() + c.axis.abs() + Vec3::splat(c.radius);
                (p, size, n, 0)
            }
        };
        let size = size + self.terms;
        Some(AreaPoint {
            p,
            size,
            ng,
            prim,
            uv,
            color,
        })
    }

    #[inline(always)]
    fn finish(&self, from: Vec3, at: &AreaPoint, density: f32) -> Option<LightSample> {
        let (p, ng) = (at.p, at.ng);
        let d = p - from;
        let distance = d.length();
        let shows = self.two_sided || ng.dot(d) < 0.0;
        if !(shows && distance > 0.0 && density > 0.0 && density.is_finite()) {
            return None;
        }
        let wi = d / distance;
        Some(LightSample {
            wi: wi.into(),
            distance,
            radiance: self.radiance_towards(at.uv, &at.color, -wi),
            density,
            light: NONE,
            flags: 0,
            p: p.into(),
            ng: ng.into(),
            primitive: [self.shape, at.prim],
            p_error: at.error().into(),
        })
    }

    fn sample_sphere(&self, s: &Sphere, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let to_centre = s.center - from;
        let d2 = to_centre.length_squared();
        let Some(one_minus_cos) = cone_of(s, d2) else {
            let at = self.point(u)?;
            let density = per_solid_angle(1.0 / self.area, from, at.p, at.ng);
            return self.finish(from, &at, density);
        };
        let frame = Frame::around(to_centre.normalize());
        let w = frame.to_world(warp::cone(u, one_minus_cos));
        // Nearest intersection along w, from the centre's side to keep the digits of a small sphere far away.
        let along = to_centre.dot(w);
        let off = to_centre - w * along;
        let half = (s.radius * s.radius - off.length_squared()).max(0.0).sqrt();
        let n = (-off - w * half).normalize_or_zero();
        let at = AreaPoint {
            p: s.center + n * s.radius,
            size: s.center.abs() + Vec3::splat(s.radius) + self.terms,
            ng: n,
            prim: 0,
            uv: [0.0; 2],
            color: [1.0; 4],
        };
        self.finish(from, &at, 1.0 / (2.0 * PI * one_minus_cos))
    }

    /// Density (sr⁻¹) with which [`Area::sample`] at `from` finds the point `at` with normal `ng`.
    pub fn density(&self, from: Vec3, at: Vec3, ng: Vec3) -> f32 {
        if let AreaShape::Sphere(s) = &self.form
            && let Some(one_minus_cos) = cone_of(s, (s.center - from).length_squared())
        {
            return 1.0 / (2.0 * PI * one_minus_cos);
        }
        per_solid_angle(1.0 / self.area, from, at, ng)
    }
}

/// 1 − cosine of the half-angle a sphere fills at a squared distance `d2` of its centre; `None` from inside.
fn cone_of(s: &Sphere, d2: f32) -> Option<f32> {
    let sin2 = s.radius * s.radius / d2;
    // sin²/(1 + cos) = 1 − cos without cancellation.
    (sin2 < 1.0).then(|| sin2 / (1.0 + (1.0 - sin2).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Accel, Geometry, Ray, Shape, offset_origin};
    use resolvent_api::rng::Stream;

    /// Points chosen on a sphere are seen from where they were chosen for, to the very limb, and their mean cosine over density
    /// is the irradiance π r²/d² in closed form; also where the nearest points' coordinates cancel to 0.
    #[test]
    fn points_on_a_sphere_are_visible() {
        for height in [0.0, -2.0, 1000.0] {
            visible_from(Vec3::new(0.0, 0.0, height));
        }
    }

    fn visible_from(from: Vec3) {
        let sphere = Sphere {
            center: from + Vec3::new(0.0, 0.0, 3.0),
            radius: 1.0,
        };
        let area = Area::sphere(0, sphere, Spectrum::ONE, false);
        let accel = Accel::build(Geometry {
            shapes: vec![Shape::Sphere(sphere)],
        })
        .unwrap()
        .unwrap();
        let mut s = Stream::new(1);
        let n = 100_000;
        let (mut hidden, mut refused, mut sum) = (0, 0, 0f64);
        for _ in 0..n {
            let Some(p) = area.sample(from, s.uniform2()) else {
                refused += 1;
                continue;
            };
            let at = Vec3::from(p.p);
            let end = offset_origin(at, p.p_error.into(), p.ng.into(), from - at);
            hidden += u32::from(accel.occluded(&Ray::segment(from, end)));
            sum += f64::from(p.wi[2] / p.density);
        }
        let irradiance = sum / f64::from(n);
        let expected = std::f64::consts::PI / 9.0;
        assert!(
            (irradiance / expected - 1.0).abs() < 1e-3,
            "{irradiance} {expected}, {refused} refused"
        );
        assert_eq!((hidden, refused), (0, 0), "from {from}");
    }
}
