//! Spot lights.

use resolvent_api::Spectrum;
use resolvent_api::math::{Frame, Vec3, warp};
use std::f32::consts::PI;

/// A point that shines into a cone.
///
/// The intensity is constant within the inner cone and falls to 0 at the outer one as the smoothstep s²(3 − 2s) of
/// s = (cos θ − cos θ_outer)/(cos θ_inner − cos θ_outer), θ measured from the axis.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Position.
    pub position: Vec3,
    /// W·sr⁻¹ within the inner cone.
    pub intensity: Spectrum,
    /// Frame around the direction in which it shines.
    pub frame: Frame,
    /// 1 − cos θ_outer, > 0.
    pub outer: f32,
    /// 1 − cos θ_inner, at most `outer`.
    pub inner: f32,
}

/// 1 − cos of half a full angle given in degrees, without cancellation.
fn one_minus_cos(full_deg: f64) -> f32 {
    (2.0 * (0.25 * full_deg).to_radians().sin().powi(2)) as f32
}

impl Spot {
    /// A spot at `position` that shines along the unit vector `axis`, with the full angles of its cones in degrees,
    /// 0 ≤ inner ≤ outer ≤ 360, outer > 0.
    pub fn new(
        position: Vec3,
        axis: Vec3,
        intensity: Spectrum,
        outer_deg: f64,
        inner_deg: f64,
    ) -> Self {
        let outer = one_minus_cos(outer_deg);
        Self {
            position,
            intensity,
            frame: Frame::around(axis),
            outer,
            inner: one_minus_cos(inner_deg).min(outer),
        }
    }

    /// Intensity (W·sr⁻¹) in the unit direction `w`, away from the light.
    pub fn towards(&self, w: Vec3) -> Spectrum {
        // |w − axis|²/2 = 1 − cos θ, which keeps its digits in narrow cones.
        let h = 0.5 * (w - Vec3::from(self.frame.n)).length_squared();
        if h >= self.outer {
            return Spectrum::ZERO;
        }
        if h <= self.inner {
            return self.intensity;
        }
        let s = (self.outer - h) / (self.outer - self.inner);
        self.intensity * (s * s * (3.0 - 2.0 * s))
    }

    /// ∫ of the falloff over all directions, sr: the smoothstep's mean over cos θ is ½.
    pub fn solid_angle(&self) -> f32 {
        PI * (self.outer + self.inner)
    }

    /// A direction in the outer cone, uniform in solid angle.
    pub fn direction(&self, u: [f32; 2]) -> Vec3 {
        self.frame.to_world(warp::cone(u, self.outer))
    }

    /// Density (sr⁻¹) of [`Spot::direction`] in `w`.
    pub fn direction_density(&self, w: Vec3) -> f32 {
        let h = 0.5 * (w - Vec3::from(self.frame.n)).length_squared();
        if h < self.outer {
            1.0 / (2.0 * PI * self.outer)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The falloff is what is stated, at the cones' edges and between, also in a cone of an arc second.
    #[test]
    fn falloff() {
        let axis = Vec3::new(0.3, -0.5, 0.8).normalize();
        let side = axis.any_orthonormal_vector();
        for (outer, inner) in [(60.0, 30.0), (360.0, 0.0), (90.0, 90.0), (2e-4, 1e-4)] {
            let spot = Spot::new(Vec3::ZERO, axis, Spectrum::splat(2.0), outer, inner);
            let (co, ci) = (
                (0.5f64 * outer).to_radians().cos(),
                (0.5f64 * inner).to_radians().cos(),
            );
            for k in 0..=40 {
                let theta = (0.5 * outer * f64::from(k) / 32.0).to_radians();
                let w = axis.as_dvec3() * theta.cos() + side.as_dvec3() * theta.sin();
                let half = 0.5 * theta;
                // Differences of cosines as products of sines, exact for small angles.
                let (ho, hi) = (0.25 * outer.to_radians(), 0.25 * inner.to_radians());
                let s = if inner < outer {
                    ((ho.sin().powi(2) - half.sin().powi(2))
                        / (ho.sin().powi(2) - hi.sin().powi(2)))
                    .clamp(0.0, 1.0)
                } else {
                    f64::from(theta.cos() > co)
                };
                let expected = 2.0 * s * s * (3.0 - 2.0 * s);
                let edge = (theta.cos() - co).abs() < 1e-6 && inner == outer;
                let found = f64::from(spot.towards(w.as_vec3())[0]);
                // A direction of f32 is off by 1e-7, which is 5 % of the smallest cone.
                let tolerance = if outer < 1e-3 { 0.2 } else { 2e-5 };
                assert!(
                    edge || (found - expected).abs() < tolerance,
                    "{outer} {inner} {k}: {found} {expected}"
                );
            }
            let solid = std::f64::consts::PI * (2.0 - co - ci);
            assert!(
                outer < 1e-3 || (f64::from(spot.solid_angle()) / solid - 1.0).abs() < 1e-6,
                "{solid}"
            );
        }
    }
}
