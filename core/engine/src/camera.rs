//! Cameras: pinhole and thin lens.

use crate::filter::Filter;
use resolvent_api::math::{Affine, DVec3, Vec3, warp};
use resolvent_api::vertex::CameraRay;

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

    /// The ray of a sample of `pixel` (column, row): `film` is what the filter turns into a position around the pixel's
    /// centre, `lens` chooses a point on the lens.
    #[inline]
    pub fn ray(&self, pixel: [u32; 2], film: [f32; 2], lens: [f32; 2]) -> CameraRay {
        let at = |i: usize| pixel[i] as f32 + 0.5 + self.filter.sample(film[i]);
        let x = (at(0) - self.centre[0]) * self.scale;
        let y = (self.centre[1] - at(1)) * self.scale;
        let [right, up, forward] = self.axes;
        let mut o = self.origin;
        let mut d = forward + right * x + up * y;
        if self.lens_radius > 0.0 {
            let focus = o + d * self.focus_distance;
            let [a, b] = warp::disk(lens);
            o += (right * a + up * b) * self.lens_radius;
            d = focus - o;
        }
        CameraRay {
            o: o.into(),
            d: d.normalize().into(),
            weight: 1.0,
            inside: self.inside,
        }
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
