//! Where to look from: a three-quarter view that the volume fills.

use super::{Notes, numbers};
use crate::args::{Render, Up};
use crate::info::short;
use resolvent_scene::{Camera, Pose, Projection};

/// Where the camera stands, seen from the volume: degrees from the front to the right, and above the horizon.
const AZIMUTH: f64 = 30.0;
const ELEVATION: f64 = 6.0;
/// Where the sun stands: degrees to the left of the camera, and above the horizon.
const SUN_LEFT: f64 = 65.0;
const SUN_ELEVATION: f64 = 38.0;
/// Horizontal field of view, degrees.
const FOV: f64 = 40.0;
/// Free space around the volume.
const MARGIN: f64 = 1.1;
/// Pixels of a picture whose size nobody asked for, and the range of its width over its height.
const PIXELS: f64 = 640.0 * 360.0;
const NARROWEST: f64 = 0.75;
const WIDEST: f64 = 16.0 / 9.0;

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V, b: V) -> V {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn normalize(a: V) -> V {
    let l = dot(a, a).sqrt();
    a.map(|x| x / l)
}

fn along(p: V, d: V, t: f64) -> V {
    [0, 1, 2].map(|i| p[i] + d[i] * t)
}

/// Directions of the view.
pub struct View {
    up: Up,
    /// Towards the camera.
    back: V,
    right: V,
    above: V,
}

impl View {
    /// The three-quarter view.
    pub fn new(up: Up) -> Self {
        Self::towards(up, direction(up, AZIMUTH, ELEVATION))
    }

    fn towards(up: Up, back: V) -> Self {
        let vertical = vertical(up);
        let side = cross(vertical, back);
        // Straight from above, any direction is right.
        let right = if dot(side, side) > 1e-12 {
            normalize(side)
        } else {
            [1.0, 0.0, 0.0]
        };
        let above = cross(back, right);
        Self {
            up,
            back,
            right,
            above,
        }
    }

    /// Direction to the sun, rounded so that it can be typed.
    pub fn sun(&self) -> V {
        direction(self.up, AZIMUTH - SUN_LEFT, SUN_ELEVATION).map(|x| (x * 1e4).round() / 1e4)
    }
}

fn vertical(up: Up) -> V {
    match up {
        Up::Y => [0.0, 1.0, 0.0],
        Up::Z => [0.0, 0.0, 1.0],
    }
}

/// The direction at `azimuth` degrees from the front to the right and `elevation` above the horizon. The front is +z where
/// y is up, and −y where z is up, as the programs have it.
fn direction(up: Up, azimuth: f64, elevation: f64) -> V {
    let (sa, ca) = azimuth.to_radians().sin_cos();
    let (se, ce) = elevation.to_radians().sin_cos();
    match up {
        Up::Y => [sa * ce, se, ca * ce],
        Up::Z => [sa * ce, -ca * ce, se],
    }
}

/// A camera and the picture it takes.
pub struct Shot {
    /// The camera.
    pub camera: Camera,
    /// Width and height, pixels.
    pub resolution: [u32; 2],
}

/// A camera that has all of the points in its picture; `what` they are of is for the notes.
pub fn frame(view: &View, points: &[V], what: &str, a: &Render, notes: &mut Notes) -> Shot {
    let g = &a.guesses;
    let fov = g.fov.map_or(FOV, |f| f.min(179.0));
    let asked = a.resolution.map(|r| r.0);
    // Extent across the view, as from far away.
    let extent = |d: V| {
        let along: Vec<f64> = points.iter().map(|p| dot(*p, d)).collect();
        let lo = along.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (lo, hi)
    };
    let (x, y, z) = (extent(view.right), extent(view.above), extent(view.back));
    let size = |e: (f64, f64)| (e.1 - e.0).max(1e-30);
    let resolution = asked.unwrap_or_else(|| resolution(size(x) / size(y)));
    let [w, h] = resolution.map(f64::from);

    let pose = match g.camera {
        Some(c) => (c.origin, c.target),
        None => {
            let middle = |e: (f64, f64)| 0.5 * (e.0 + e.1);
            let mut target = [0.0; 3];
            for (d, e) in [(view.right, x), (view.above, y), (view.back, z)] {
                target = along(target, d, middle(e));
            }
            let tan_x = (0.5 * fov).to_radians().tan();
            let tan_y = tan_x * h / w;
            // Every point must be within both half angles: distance ≥ z + |x|/tan.
            let distance = points
                .iter()
                .map(|p| {
                    let d = [0, 1, 2].map(|i| p[i] - target[i]);
                    let across =
                        (dot(d, view.right).abs() / tan_x).max(dot(d, view.above).abs() / tan_y);
                    dot(d, view.back) + MARGIN * across
                })
                .fold(0.0, f64::max);
            (along(target, view.back, distance), target)
        }
    };
    if asked.is_none() {
        let [w, h] = resolution;
        notes.add(
            "--resolution",
            format!("{w}x{h}"),
            format!("in the shape of the {what}"),
        );
    }
    if g.camera.is_none() {
        let (o, t) = pose;
        notes.add(
            "--camera",
            format!("{},{}", numbers(o), numbers(t)),
            "stands at, looks at: three-quarter view of all of it",
        );
    }
    if g.fov.is_none() {
        notes.add("--fov", short(FOV), "horizontal, degrees");
    }
    let (origin, target) = pose;
    let forward = [0, 1, 2].map(|i| target[i] - origin[i]);
    let mut up = vertical(view.up);
    let side = cross(forward, up);
    if dot(side, side) < 1e-12 * dot(forward, forward) {
        // Looks straight up or down: the front is below.
        up = direction(view.up, 180.0, 0.0);
    }
    Shot {
        camera: Camera {
            pose: Pose::LookAt { origin, target, up },
            projection: Projection::Perspective { fov_x_deg: fov },
            shift: [0.0; 2],
            exposure: 0.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
        },
        resolution,
    }
}

/// The size of a picture of this width over height, whose camera is known.
pub fn size(aspect: f64) -> [u32; 2] {
    resolution(aspect)
}

/// A picture of about [`PIXELS`] pixels with sides that are multiples of 16.
fn resolution(aspect: f64) -> [u32; 2] {
    let aspect = aspect.clamp(NARROWEST, WIDEST);
    let side = |x: f64| ((x / 16.0).round() as u32).max(1) * 16;
    [
        side((PIXELS * aspect).sqrt()),
        side((PIXELS / aspect).sqrt()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_view_is_right_handed_in_both_conventions() {
        for up in [Up::Y, Up::Z] {
            let v = View::new(up);
            assert!(dot(v.above, vertical(up)) > 0.9);
            assert!((dot(v.above, v.above) - 1.0).abs() < 1e-12);
            let r = cross(v.above, v.back);
            assert!((0..3).all(|i| (r[i] - v.right[i]).abs() < 1e-12));
            // The sun is left of the camera and above.
            assert!(dot(v.sun(), v.right) < -0.5 && dot(v.sun(), vertical(up)) > 0.5);
        }
    }

    #[test]
    fn pictures_have_the_shape_of_the_volume() {
        assert_eq!(resolution(16.0 / 9.0), [640, 368]);
        assert_eq!(resolution(100.0), [640, 368]);
        assert_eq!(resolution(1.0), [480, 480]);
        assert_eq!(resolution(0.01), [416, 560]);
    }
}
