//! Cameras: pinhole and thin lens.

use crate::filter::Filter;
use resolvent_api::Spectrum;
use resolvent_api::math::{Affine, DVec3, Vec3, warp};
use resolvent_api::vertex::{CameraRay, LightSample, NONE, SensorSample, Vertex, vertex_flags};

/// A perspective camera.
pub struct Camera {
    /// Lens centre.
    origin: Vec3,
    /// Right, up and forward, unit length.
    axes: [Vec3; 3],
    /// Film coordinates (pixels) to the plane at distance 1: scale and offset of x and y.
    scale: f32,
    centre: [f32; 2],
    lens_radius: f32,
    focus_distance: f32,
    filter: Filter,
    /// The interior media the camera is in.
    pub inside: u64,
}

impl Camera {
    /// A camera with the pose `to_world` (looks along −z, y up), the full horizontal field of view `fov_x_deg` over `width`
    /// square pixels, and a lens of radius 0 (pinhole) or more.
    pub fn new(
        to_world: &Affine,
        fov_x_deg: f64,
        resolution: [u32; 2],
        lens_radius: f64,
        focus_distance: f64,
        filter: Filter,
    ) -> Self {
        let axis = |v: DVec3| to_world.vector(v).normalize().as_vec3();
        let half = (0.5 * fov_x_deg).to_radians().tan();
        let [w, h] = resolution.map(f64::from);
        Self {
            origin: to_world.translation.as_vec3(),
            axes: [axis(DVec3::X), axis(DVec3::Y), axis(DVec3::NEG_Z)],
            scale: (2.0 * half / w) as f32,
            centre: [(0.5 * w) as f32, (0.5 * h) as f32],
            lens_radius: lens_radius as f32,
            focus_distance: focus_distance as f32,
            filter,
            inside: 0,
        }
    }

    /// Centre of the lens.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// The reconstruction filter.
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// The ray of a sample of `pixel` (column, row): `film` is what the filter turns into a position around the pixel's
    /// centre, `lens` chooses a point on the lens.
    #[inline]
    pub fn ray(&self, pixel: [u32; 2], film: [f32; 2], lens: [f32; 2]) -> CameraRay {
        let at = |i: usize| pixel[i] as f32 + 0.5 + self.filter.sample(film[i]);
        self.film_ray([at(0), at(1)], lens)
    }

    /// The ray through the position `film` (pixels) and the point on the lens chosen by `lens`.
    #[inline]
    pub fn film_ray(&self, film: [f32; 2], lens: [f32; 2]) -> CameraRay {
        let x = (film[0] - self.centre[0]) * self.scale;
        let y = (self.centre[1] - film[1]) * self.scale;
        let [right, up, forward] = self.axes;
        let mut o = self.origin;
        let mut d = forward + right * x + up * y;
        if self.lens_radius > 0.0 {
            let focus = o + d * self.focus_distance;
            o = self.lens_point(lens);
            d = focus - o;
        }
        let d = d.normalize();
        CameraRay {
            o: o.into(),
            d: d.into(),
            weight: 1.0,
            inside: self.inside,
            density: self.density(forward.dot(d)),
            reserved: 0,
        }
    }

    /// Density (sr⁻¹) of a direction at the angle of `cosine` to the axis, from any point of the lens, for film positions of
    /// density 1 per pixel area: dA = dω/(s² cos³ θ), s the edge of a pixel on the plane at distance 1.
    fn density(&self, cosine: f32) -> f32 {
        1.0 / (self.scale * self.scale * cosine * cosine * cosine)
    }

    fn lens_point(&self, u: [f32; 2]) -> Vec3 {
        if self.lens_radius == 0.0 {
            return self.origin;
        }
        let [right, up, _] = self.axes;
        let [a, b] = warp::disk(u);
        self.origin + (right * a + up * b) * self.lens_radius
    }

    /// The point on the lens chosen by `lens`, and the place on the film where `reference` appears through it; `None` if it
    /// is at infinity, behind the camera or beside the film.
    pub fn sense(&self, reference: &Vertex, lens: [f32; 2]) -> Option<SensorSample> {
        let o = self.lens_point(lens);
        if reference.is_infinite() {
            return None;
        }
        let to = reference.position() - o;
        let distance = to.length();
        if !(distance > 0.0) {
            return None;
        }
        let d = to / distance;
        let [right, up, forward] = self.axes;
        let cosine = forward.dot(d);
        if !(cosine > 0.0) {
            return None;
        }
        let plane = if self.lens_radius > 0.0 {
            self.focus_distance
        } else {
            1.0
        };
        let on_plane = (o - self.origin) + d * (plane / cosine);
        let per_pixel = self.scale * plane;
        let film = [
            self.centre[0] + right.dot(on_plane) / per_pixel,
            self.centre[1] - up.dot(on_plane) / per_pixel,
        ];
        let margin = self.filter.radius();
        let on_film = |i: usize| film[i] > -margin && film[i] < 2.0 * self.centre[i] + margin;
        if !(on_film(0) && on_film(1)) {
            return None;
        }
        Some(SensorSample {
            target: LightSample {
                wi: (-d).into(),
                distance,
                radiance: Spectrum::ONE,
                density: self.density(cosine),
                light: NONE,
                flags: vertex_flags::DELTA,
                p: o.into(),
                ng: [0.0; 3],
                primitive: [NONE; 2],
                p_error: [0.0; 3],
            },
            film,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_the_film_span_the_field_of_view() {
        for fov in [1e-4, 44.0, 179.0, 179.9] {
            let c = Camera::new(
                &Affine::IDENTITY,
                fov,
                [200, 100],
                0.0,
                1.0,
                Filter::Box(0.5),
            );
            let left = Vec3::from(c.ray([0, 49], [0.0, 1.0], [0.5; 2]).d).as_dvec3();
            let angle = left.x.abs().atan2(-left.z).to_degrees();
            assert!(
                (angle - 0.5 * fov).abs() < 1e-4 * fov + 1e-6,
                "{fov}: {angle}"
            );
            let centre = Vec3::from(c.ray([100, 50], [0.0, 0.0], [0.5; 2]).d);
            assert!((centre - Vec3::NEG_Z).length() < 1e-6);
        }
    }

    /// A point on a camera ray appears where the ray came from, and the directions' densities integrate to the film's area.
    #[test]
    fn points_appear_where_rays_come_from() {
        for lens_radius in [0.0, 0.2] {
            let film = Filter::Box(0.5);
            let c = Camera::new(&Affine::IDENTITY, 70.0, [64, 32], lens_radius, 3.0, film);
            for (at, lens) in [
                ([0.25, 0.75], [0.3, 0.9]),
                ([63.5, 20.0], [0.1, 0.2]),
                ([31.0, 31.9], [0.7, 0.5]),
            ] {
                let r = c.film_ray(at, lens);
                let mut v = Vertex::empty();
                for distance in [0.1f32, 7.0, 1000.0] {
                    v.p = (Vec3::from(r.o) + Vec3::from(r.d) * distance).into();
                    let s = c.sense(&v, lens).unwrap();
                    for i in 0..2 {
                        assert!((s.film[i] - at[i]).abs() < 1e-3, "{at:?} {:?}", s.film);
                    }
                    assert!((s.target.density / r.density - 1.0).abs() < 1e-5);
                }
            }
        }
        // ∫ density dω over the film by midpoints on the plane at distance 1: dω = cos³ dA.
        let c = Camera::new(
            &Affine::IDENTITY,
            90.0,
            [40, 20],
            0.0,
            1.0,
            Filter::Box(0.5),
        );
        let n = 200;
        let mut sum = 0f64;
        for i in 0..n * n {
            let x = 2.0 * (f64::from(i % n) + 0.5) / f64::from(n) - 1.0;
            let y = (f64::from(i / n) + 0.5) / f64::from(n) - 0.5;
            let cosine = 1.0 / (1.0 + x * x + y * y).sqrt();
            sum += f64::from(c.density(cosine as f32)) * cosine.powi(3) * 2.0 / f64::from(n * n);
        }
        assert!((sum / 800.0 - 1.0).abs() < 1e-5, "{sum}");
    }

    #[test]
    fn a_lens_keeps_the_focal_plane_sharp() {
        let c = Camera::new(
            &Affine::IDENTITY,
            60.0,
            [10, 10],
            0.3,
            4.0,
            Filter::Box(0.5),
        );
        let at = |lens| {
            let r = c.ray([2, 7], [0.0, 0.0], lens);
            let (o, d) = (Vec3::from(r.o), Vec3::from(r.d));
            o + d * ((-4.0 - o.z) / d.z)
        };
        let sharp = at([0.5, 0.5]);
        for lens in [[0.0, 0.0], [0.9, 0.2], [0.3, 0.99]] {
            assert!((at(lens) - sharp).length() < 1e-5);
        }
    }
}
