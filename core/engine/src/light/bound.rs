//! Where a group of lights is and where it shines to: what the light tree chooses by.

use super::{Area, AreaShape, Light, Reference};
use resolvent_api::math::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// The bound of one light or of several (Conty Estevez & Kulla 2018, §4.1).
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Box.
    pub lo: Vec3,
    /// Box.
    pub hi: Vec3,
    /// Axis of a cone that holds all normals.
    pub axis: Vec3,
    /// Half-angle θ_o of that cone, 0 to π.
    pub spread: f32,
    /// Angle θ_e from a normal up to which light is emitted, up to π.
    pub reach: f32,
    /// Emits along the normals' opposites, too.
    pub two_sided: bool,
    /// Intensity along a normal, W·sr⁻¹, averaged over lanes.
    pub intensity: f32,
}

/// Widening of angles against rounding: a light must not be found unable to reach a point that it barely reaches.
const SLACK: f32 = 1e-3;

impl Bound {
    /// The bound of a light at a finite place; `None` for others and for black ones.
    pub fn of(light: &Light, lanes: u32) -> Option<Self> {
        let bound = match light {
            Light::Point {
                position,
                intensity,
            } => Self {
                lo: *position,
                hi: *position,
                axis: Vec3::Z,
                spread: PI,
                reach: FRAC_PI_2,
                two_sided: false,
                intensity: intensity.mean(lanes),
            },
            Light::Spot(s) => {
                let angle = |h: f32| 2.0 * (0.5 * h).sqrt().min(1.0).asin();
                let spread = angle(s.inner);
                Self {
                    lo: s.position,
                    hi: s.position,
                    axis: s.frame.n.into(),
                    spread,
                    reach: angle(s.outer) - spread + SLACK,
                    two_sided: false,
                    intensity: s.intensity.mean(lanes),
                }
            }
            Light::Area(area) => Self::of_area(area, lanes),
            _ => return None,
        };
        (bound.intensity > 0.0).then_some(bound)
    }

    fn of_area(area: &Area, lanes: u32) -> Self {
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut include = |p: Vec3| {
            lo = lo.min(p);
            hi = hi.max(p);
        };
        let (mut axis, mut spread) = (Vec3::Z, PI);
        // Area seen along the axis, over the whole.
        let mut facing = 1.0;
        match &area.form {
            AreaShape::Quad(q, normal) => {
                for (a, b) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    include(q.corner + q.edge_u * a + q.edge_v * b);
                }
                axis = normal.normalize_or(Vec3::Z);
                spread = SLACK;
            }
            AreaShape::Disk(d, _) => {
                let reach = (Vec3::ONE - d.normal * d.normal).max(Vec3::ZERO);
                let reach = Vec3::new(reach.x.sqrt(), reach.y.sqrt(), reach.z.sqrt()) * d.radius;
                include(d.center - reach);
                include(d.center + reach);
                axis = d.normal;
                spread = SLACK;
            }
            AreaShape::Sphere(s) => {
                include(s.center - s.radius);
                include(s.center + s.radius);
                facing = 0.25;
            }
            AreaShape::Cylinder(c, _) => {
                for p in [c.base, c.base + c.axis] {
                    include(p - c.radius);
                    include(p + c.radius);
                }
                facing = 1.0 / PI;
            }
            AreaShape::Mesh(mesh, _) => {
                let mut cone: Option<(Vec3, f32)> = None;
                for t in &mesh.indices {
                    let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                    [a, b, c].into_iter().for_each(&mut include);
                    if let Some(n) = (b - a).cross(c - a).try_normalize() {
                        cone = Some(cone.map_or((n, SLACK), |k| join(k, (n, SLACK))));
                    }
                }
                (axis, spread) = cone.unwrap_or((axis, spread));
                if spread > FRAC_PI_2 {
                    facing = 0.25;
                }
            }
        }
        Self {
            lo,
            hi,
            axis,
            spread,
            reach: FRAC_PI_2,
            two_sided: area.two_sided,
            intensity: area.radiance.mean(lanes) * area.area * facing,
        }
    }

    /// A bound of both.
    pub fn union(&self, o: &Self) -> Self {
        let (axis, spread) = join((self.axis, self.spread), (o.axis, o.spread));
        Self {
            lo: self.lo.min(o.lo),
            hi: self.hi.max(o.hi),
            axis,
            spread,
            reach: self.reach.max(o.reach),
            two_sided: self.two_sided || o.two_sided,
            intensity: self.intensity + o.intensity,
        }
    }

    /// Middle of the box.
    pub fn centre(&self) -> Vec3 {
        0.5 * (self.lo + self.hi)
    }

    /// What a group costs to choose from, up to a common factor: intensity times the surface of the box times M_Ω, the solid
    /// angle shone into weighted by the cosine beyond the cone of normals (Conty Estevez & Kulla 2018, eq. 1).
    pub fn cost(&self) -> f32 {
        let e = self.hi - self.lo;
        let surface = e.x * e.y + e.y * e.z + e.z * e.x;
        let (o, w) = (self.spread, (self.spread + self.reach).min(PI));
        let solid = 2.0 * PI * (1.0 - o.cos())
            + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        self.intensity * surface * solid.max(0.0) * sides
    }
}

/// The smallest cone (axis, half-angle) around two.
fn join(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (a, b) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    // atan2 keeps the digits of small and of nearly straight angles.
    let cross = a.0.cross(b.0);
    let between = cross.length().atan2(a.0.dot(b.0));
    if (between + b.1).min(PI) <= a.1 {
        return a;
    }
    let spread = 0.5 * (a.1 + between + b.1) + 1e-6;
    match cross.try_normalize() {
        Some(turn) if spread < PI => {
            let axis = glam::Quat::from_axis_angle(turn, spread - a.1) * a.0;
            (axis.normalize(), spread)
        }
        // Opposite axes, or all directions; equal axes were met above.
        _ => (a.0, PI),
    }
}

/// A bound as it is asked for its importance.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    centre: Vec3,
    /// Radius of the sphere around the box.
    radius: f32,
    /// Squared distance below which the distance says nothing.
    near: f32,
    axis: Vec3,
    cos_spread: f32,
    sin_spread: f32,
    cos_reach: f32,
    intensity: f32,
    two_sided: bool,
}

impl Group {
    /// From a bound; below the squared distance `near` it gains no importance.
    pub fn new(b: &Bound, near: f32) -> Self {
        let (sin_spread, cos_spread) = b.spread.min(PI).sin_cos();
        let radius = 0.5 * (b.hi - b.lo).length() * (1.0 + SLACK);
        Self {
            centre: b.centre(),
            radius,
            near: (radius * radius).max(near),
            axis: b.axis,
            cos_spread,
            sin_spread,
            cos_reach: b.reach.min(PI).cos(),
            intensity: b.intensity,
            two_sided: b.two_sided,
        }
    }

    /// An estimate of the light that reaches `at`, greater than 0 wherever there can be any
    /// (Conty Estevez & Kulla 2018, eq. 3; on surfaces with |cos θ_i|, since light may be transmitted).
    #[inline]
    pub fn importance(&self, at: &Reference) -> f32 {
        let d = at.p - self.centre;
        let d2 = d.length_squared();
        let r2 = self.radius * self.radius;
        let nearness = 1.0 / d2.max(self.near);
        if !(d2 > r2) {
            return self.intensity * nearness;
        }
        let w = d / d2.sqrt();
        let sin2_b = (r2 / d2).min(1.0);
        let (sin_b, cos_b) = (sin2_b.sqrt(), (1.0 - sin2_b).sqrt());
        let cos_w = self.axis.dot(w);
        let cos_w = if self.two_sided { cos_w.abs() } else { cos_w };
        let sin_w = (1.0 - cos_w * cos_w).max(0.0).sqrt();
        // θ' = max(θ_w − θ_o − θ_b, 0).
        let cos_x = cos_difference(sin_w, cos_w, self.sin_spread, self.cos_spread);
        let sin_x = if cos_x < 1.0 {
            (1.0 - cos_x * cos_x).max(0.0).sqrt()
        } else {
            0.0
        };
        let cos_emitted = cos_difference(sin_x, cos_x, sin_b, cos_b);
        if cos_emitted <= self.cos_reach {
            return 0.0;
        }
        // Wide cones reach beyond a right angle, where the cosine is no estimate any more.
        let mut value = self.intensity * nearness * cos_emitted.max(SLACK);
        if let Some(n) = at.normal {
            let cos_i = n.dot(w).abs();
            let sin_i = (1.0 - cos_i * cos_i).max(0.0).sqrt();
            value *= cos_difference(sin_i, cos_i, sin_b, cos_b).max(SLACK);
        }
        value
    }
}

/// cos(max(a − b, 0)) for angles between 0 and π.
#[inline(always)]
fn cos_difference(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b {
        1.0
    } else {
        cos_a * cos_b + sin_a * sin_b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::math::warp;
    use resolvent_api::rng::Stream;

    /// The cone of two cones holds all their directions, and is no wider than it must be.
    #[test]
    fn joined_cones() {
        let mut s = Stream::new(5);
        for _ in 0..2000 {
            let mut cone = || (warp::sphere(s.uniform2()), s.uniform() * s.uniform() * PI);
            let (a, b) = (cone(), cone());
            let (axis, spread) = join(a, b);
            let angle = |x: Vec3, y: Vec3| x.cross(y).length().atan2(x.dot(y));
            for c in [a, b] {
                assert!(
                    spread >= PI || angle(axis, c.0) + c.1 <= spread + 1e-4,
                    "{a:?} {b:?}"
                );
            }
            let least = a.1.max(b.1).max(0.5 * (a.1 + b.1 + angle(a.0, b.0)));
            assert!(spread <= least + 1e-3 || spread == PI, "{spread} {least}");
        }
        assert_eq!(join((Vec3::Z, 0.1), (-Vec3::Z, 0.2)).1, PI);
        assert_eq!(join((Vec3::Z, 0.1), (Vec3::Z, 0.2)), (Vec3::Z, 0.2));
    }
}
