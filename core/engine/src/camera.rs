//! Cameras: pinhole, thin lens and parallel rays.

use crate::filter::Filter;
use resolvent_api::math::{Affine, DVec3, Vec3, warp};
use resolvent_api::vertex::{CameraRay, LightSample, NONE, SensorSample, Vertex, vertex_flags};
use resolvent_api::{Aabb, Spectrum};
use resolvent_scene as describe;
use resolvent_scene::Projection;

/// A camera.
pub struct Camera {
    /// Lens centre; of parallel rays a point of the plane that they start from.
    origin: Vec3,
    /// Right, up and forward, unit length.
    axes: [Vec3; 3],
    /// Edges of a pixel on the plane at distance 1, or of a pixel if rays are parallel.
    scale: [f32; 2],
    /// Where the axis meets the film, and the film's size, pixels.
    centre: [f32; 2],
    size: [f32; 2],
    parallel: bool,
    lens_radius: f32,
    focus_distance: f32,
    exposure: f32,
    filter: Filter,
}

impl Camera {
    /// The camera `c` with the pose `to_world` (looks along −z, y up) before `film`.
    pub fn new(to_world: &Affine, c: &describe::Camera, film: &describe::Film) -> Self {
        let axis = |v: DVec3| to_world.vector(v).normalize().as_vec3();
        let [w, h] = film.resolution.map(f64::from);
        let (width, parallel) = match c.projection {
            Projection::Perspective { fov_x_deg } => {
                (2.0 * (0.5 * fov_x_deg).to_radians().tan(), false)
            }
            Projection::Orthographic { width } => (width, true),
        };
        let x = width / w;
        Self {
            origin: to_world.translation.as_vec3(),
            axes: [axis(DVec3::X), axis(DVec3::Y), axis(DVec3::NEG_Z)],
            scale: [x as f32, (x / film.pixel_aspect) as f32],
            centre: [
                ((0.5 - c.shift[0]) * w) as f32,
                ((0.5 + c.shift[1]) * h) as f32,
            ],
            size: [w as f32, h as f32],
            parallel,
            lens_radius: if parallel { 0.0 } else { c.lens_radius as f32 },
            focus_distance: c.focus_distance as f32,
            exposure: c.exposure.exp2() as f32,
            filter: Filter::new(film.filter),
        }
    }

    /// A box around all points that rays start from: the centre of the lens, all of the lens, or as much of a plane as the film
    /// and the filter beyond its edges see.
    pub fn starts(&self) -> Aabb {
        let [right, up, _] = self.axes;
        let around = |centre: Vec3, reach: Vec3| Aabb::new(centre - reach, centre + reach);
        if !self.parallel {
            return around(self.origin, (right.abs() + up.abs()) * self.lens_radius);
        }
        let beyond = self.filter.radius();
        let [x0, x1] =
            [-beyond, self.size[0] + beyond].map(|x| (x - self.centre[0]) * self.scale[0]);
        let [y0, y1] =
            [-beyond, self.size[1] + beyond].map(|y| (self.centre[1] - y) * self.scale[1]);
        let middle = self.origin + right * (0.5 * (x0 + x1)) + up * (0.5 * (y0 + y1));
        let reach = right.abs() * (0.5 * (x1 - x0)) + up.abs() * (0.5 * (y0 - y1));
        around(middle, reach)
    }

    /// The factor on the picture.
    pub fn exposure(&self) -> f32 {
        self.exposure
    }

    /// The reconstruction filter.
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// The ray of a sample of `pixel` (column, row), as if nothing filled the place that it starts from: `film` is what the filter
    /// turns into a position around the pixel's centre, `lens` chooses a point on the lens.
    #[inline]
    pub fn ray(&self, pixel: [u32; 2], film: [f32; 2], lens: [f32; 2]) -> CameraRay {
        let at = |i: usize| pixel[i] as f32 + 0.5 + self.filter.sample(film[i]);
        self.film_ray([at(0), at(1)], lens)
    }

    /// The same through the position `film` (pixels) and the point on the lens chosen by `lens`.
    #[inline]
    pub fn film_ray(&self, film: [f32; 2], lens: [f32; 2]) -> CameraRay {
        let x = (film[0] - self.centre[0]) * self.scale[0];
        let y = (self.centre[1] - film[1]) * self.scale[1];
        let [right, up, forward] = self.axes;
        let mut o = self.origin;
        if self.parallel {
            return CameraRay {
                o: (o + right * x + up * y).into(),
                d: forward.into(),
                weight: 1.0,
                inside: 0,
                density: self.density(1.0),
                flags: vertex_flags::PARALLEL,
            };
        }
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
            inside: 0,
            density: self.density(forward.dot(d)),
            flags: 0,
        }
    }

    /// Density (sr⁻¹) of a direction at the angle of `cosine` to the axis, from any point of the lens, for film positions of
    /// density 1 per pixel area: dA = dω/(a cos³ θ), a the area of a pixel on the plane at distance 1. Of parallel rays the density
    /// per area, for `cosine` = 1.
    fn density(&self, cosine: f32) -> f32 {
        1.0 / (self.scale[0] * self.scale[1] * cosine * cosine * cosine)
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
        if reference.is_infinite() {
            return None;
        }
        let [right, up, forward] = self.axes;
        let mut o = self.lens_point(lens);
        if self.parallel {
            let to = reference.position() - o;
            o += to - forward * forward.dot(to);
        }
        let to = reference.position() - o;
        let distance = to.length();
        if !(distance > 0.0) {
            return None;
        }
        let d = if self.parallel {
            forward
        } else {
            to / distance
        };
        let cosine = forward.dot(to / distance);
        if !(cosine > 0.0) {
            return None;
        }
        let plane = if self.lens_radius > 0.0 {
            self.focus_distance
        } else {
            1.0
        };
        let on_plane = (o - self.origin) + d * (plane / cosine);
        let film = [
            self.centre[0] + right.dot(on_plane) / (self.scale[0] * plane),
            self.centre[1] - up.dot(on_plane) / (self.scale[1] * plane),
        ];
        let margin = self.filter.radius();
        let on_film = |i: usize| film[i] > -margin && film[i] < self.size[i] + margin;
        if !(on_film(0) && on_film(1)) {
            return None;
        }
        Some(SensorSample {
            target: LightSample {
                wi: (-d).into(),
                distance,
                radiance: Spectrum::ONE,
                density: self.density(if self.parallel { 1.0 } else { cosine }),
                light: NONE,
                flags: if self.parallel {
                    vertex_flags::DELTA | vertex_flags::PARALLEL
                } else {
                    vertex_flags::DELTA
                },
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
    use resolvent_scene::{Film, Pose, Transform};

    fn camera(
        projection: Projection,
        resolution: [u32; 2],
        change: impl FnOnce(&mut describe::Camera, &mut Film),
    ) -> Camera {
        let mut c = describe::Camera {
            pose: Pose::Transform(Transform::IDENTITY),
            projection,
            lens_radius: 0.0,
            focus_distance: 1.0,
            shift: [0.0; 2],
            exposure: 0.0,
        };
        let mut film = Film {
            resolution,
            ..Film::default()
        };
        change(&mut c, &mut film);
        Camera::new(&Affine::IDENTITY, &c, &film)
    }

    fn perspective(fov_x_deg: f64) -> Projection {
        Projection::Perspective { fov_x_deg }
    }

    #[test]
    fn edges_of_the_film_span_the_field_of_view() {
        for fov in [1e-4, 44.0, 179.0, 179.9] {
            let c = camera(perspective(fov), [200, 100], |_, _| ());
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

    /// A shift moves the window on the plane at distance 1 by shares of its width and height; high pixels show more of it.
    #[test]
    fn a_shifted_window_with_oblong_pixels() {
        let c = camera(perspective(90.0), [200, 100], |c, film| {
            c.shift = [0.25, -0.5];
            film.pixel_aspect = 0.5;
        });
        // The window is 2 wide and 100 pixels of 0.02 high, and its middle is at (0.5, −1).
        for (film, x, y) in [([0.0, 0.0], -0.5, 0.0), ([200.0, 100.0], 1.5, -2.0)] {
            let d = Vec3::from(c.film_ray(film, [0.5; 2]).d);
            assert!((d.x / -d.z - x).abs() < 1e-5, "{d}");
            assert!((d.y / -d.z - y).abs() < 1e-5, "{d}");
        }
    }

    /// A point on a camera ray appears where the ray came from, with the same density.
    #[test]
    fn points_appear_where_rays_come_from() {
        let orthographic = Projection::Orthographic { width: 5.0 };
        for (projection, lens_radius) in [
            (perspective(70.0), 0.0),
            (perspective(70.0), 0.2),
            (orthographic, 0.0),
        ] {
            let c = camera(projection, [64, 32], |c, film| {
                (c.lens_radius, c.focus_distance) = (lens_radius, 3.0);
                c.shift = [0.1, 0.3];
                film.pixel_aspect = 1.5;
            });
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
                    assert!((s.target.distance / distance - 1.0).abs() < 1e-4);
                }
                v.p = (Vec3::from(r.o) - Vec3::from(r.d)).into();
                assert!(c.sense(&v, lens).is_none(), "behind the camera");
            }
        }
    }

    /// ∫ density dω over the film by midpoints on the plane at distance 1, dω = cos³ dA, is the film's area; so is the density of
    /// parallel rays times the area that they cover.
    #[test]
    fn densities_integrate_to_the_area_of_the_film() {
        let c = camera(perspective(90.0), [40, 20], |_, _| ());
        let n = 200;
        let mut sum = 0f64;
        for i in 0..n * n {
            let x = 2.0 * (f64::from(i % n) + 0.5) / f64::from(n) - 1.0;
            let y = (f64::from(i / n) + 0.5) / f64::from(n) - 0.5;
            let cosine = 1.0 / (1.0 + x * x + y * y).sqrt();
            sum += f64::from(c.density(cosine as f32)) * cosine.powi(3) * 2.0 / f64::from(n * n);
        }
        assert!((sum / 800.0 - 1.0).abs() < 1e-5, "{sum}");
        let c = camera(
            Projection::Orthographic { width: 3.0 },
            [40, 20],
            |_, film| {
                film.pixel_aspect = 2.0;
            },
        );
        // Pixels half as high as they are wide: 3 by 0.75.
        let area = 3.0 * 0.75 * c.film_ray([3.0, 4.0], [0.5; 2]).density;
        assert!((area / 800.0 - 1.0).abs() < 1e-5, "{area}");
    }

    #[test]
    fn a_lens_keeps_the_focal_plane_sharp() {
        let c = camera(perspective(60.0), [10, 10], |c, _| {
            (c.lens_radius, c.focus_distance) = (0.3, 4.0);
        });
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
