//! Emission that favours directions.

use resolvent_api::Spectrum;
use resolvent_api::math::{Frame, Vec3};
use std::f32::consts::PI;

/// A factor on the radiance of an emitting shape by the angle θ between the direction of emission and an axis: a cone with a
/// soft edge and a power of the cosine, as UsdLux's `ShapingAPI` defines them (OpenUSD 24.11),
///
/// f(θ) = [1 − smoothstep(θ; (1 − softness) θ_c, θ_c)] · [tint + (1 − tint) |cos θ|^focus],  0 beyond θ_c.
#[derive(Clone, Copy, Debug)]
pub struct Shaping {
    axis: Vec3,
    /// θ_c; beyond π for none.
    cutoff: f32,
    /// Where the soft edge begins.
    begin: f32,
    focus: f32,
    tint: Spectrum,
}

impl Shaping {
    /// About the unit vector `axis`, with the full angle of the cone in degrees (360: none), `softness` in [0, 1] and
    /// `focus` ≥ 0.
    pub fn new(axis: Vec3, angle_deg: f64, softness: f64, focus: f64, tint: Spectrum) -> Self {
        let cutoff = if angle_deg < 360.0 {
            (0.5 * angle_deg).to_radians()
        } else {
            f64::INFINITY
        };
        let begin = if softness > 0.0 {
            (1.0 - softness) * cutoff.min(std::f64::consts::PI)
        } else {
            cutoff
        };
        Self {
            axis,
            cutoff: cutoff as f32,
            begin: begin as f32,
            focus: focus as f32,
            tint,
        }
    }

    /// The same about another unit vector.
    pub fn about(mut self, axis: Vec3) -> Self {
        self.axis = axis;
        self
    }

    /// The axis, of length 1.
    pub fn axis(&self) -> Vec3 {
        self.axis
    }

    /// The factor in the unit direction `w`, away from the light.
    #[inline]
    pub fn factor(&self, w: Vec3) -> Spectrum {
        let cos = self.axis.dot(w);
        // atan2 keeps the digits of small and of straight angles.
        let theta = self.axis.cross(w).length().atan2(cos);
        if theta > self.cutoff {
            return Spectrum::ZERO;
        }
        let mut edge = 1.0;
        if theta > self.begin {
            let s = (theta - self.begin) / (self.cutoff.min(PI) - self.begin);
            edge = 1.0 - s * s * (3.0 - 2.0 * s);
        }
        let focus = if self.focus > 0.0 {
            cos.abs().powf(self.focus)
        } else {
            1.0
        };
        (self.tint + (Spectrum::ONE - self.tint) * focus) * edge
    }

    /// Mean of the factor over the light that leaves a plane with normal `n`, ∫ f cos θ_n dω / π, or over all directions.
    pub fn mean(&self, n: Option<Vec3>) -> Spectrum {
        const TURNS: usize = 64;
        const STEPS: usize = 256;
        // Around the axis, so that the cone's edge is where the steps end.
        let frame = Frame::around(self.axis);
        let reach = self.cutoff.min(PI);
        let (mut sum, step) = (Spectrum::ZERO, reach / STEPS as f32);
        for k in 0..STEPS {
            let theta = (k as f32 + 0.5) * step;
            let (sin, cos) = theta.sin_cos();
            let ring = 2.0 * PI * sin * step;
            let along = frame.to_world(Vec3::new(sin, 0.0, cos));
            let share = match n {
                None => 1.0 / (4.0 * PI),
                Some(n) => {
                    let cosines = (0..TURNS).map(|j| {
                        let phi = (j as f32 + 0.5) * 2.0 * PI / TURNS as f32;
                        let w = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                        n.dot(frame.to_world(w)).max(0.0)
                    });
                    cosines.sum::<f32>() / (TURNS as f32 * PI)
                }
            };
            sum += self.factor(along) * (ring * share);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor is the specification's formula, computed here in double precision.
    #[test]
    fn formula() {
        let axis = Vec3::new(0.3, -0.5, 0.8).normalize();
        let side = axis.any_orthonormal_vector();
        let tint = Spectrum::rgb(0.1, 0.0, 0.7);
        for (full, softness, focus) in [
            (70.0, 0.2, 4.0),
            (180.0, 0.0, 0.0),
            (360.0, 1.0, 0.5),
            (10.0, 1.0, 20.0),
            (360.0, 0.0, 3.0),
        ] {
            let shaping = Shaping::new(axis, full, softness, focus, tint);
            for k in 0..=90 {
                let theta = f64::from(k) * std::f64::consts::PI / 90.3;
                let w = axis.as_dvec3() * theta.cos() + side.as_dvec3() * theta.sin();
                let cutoff = (0.5f64 * full).to_radians();
                let begin = cutoff * (1.0 - softness);
                let s = ((theta - begin) / (cutoff - begin)).clamp(0.0, 1.0);
                let edge = if softness > 0.0 {
                    1.0 - s * s * (3.0 - 2.0 * s)
                } else {
                    f64::from(theta <= cutoff)
                };
                let power = theta.cos().abs().powf(focus);
                let found = shaping.factor(w.as_vec3());
                for lane in 0..3 {
                    let t = f64::from(tint[lane]);
                    let expected = edge * (power + t * (1.0 - power));
                    assert!(
                        (f64::from(found[lane]) - expected).abs() < 1e-5,
                        "{full} {softness} {focus} {k}: {} {expected}",
                        found[lane]
                    );
                }
            }
        }
    }

    /// Means in closed form: a cone about the normal lets sin² θ_c through, |cos|^n gives 2/(n + 2), over the sphere 1/(n + 1).
    #[test]
    fn means() {
        let n = Vec3::new(0.6, 0.0, 0.8);
        let cone = Shaping::new(n, 80.0, 0.0, 0.0, Spectrum::ZERO);
        let sin2 = 40f32.to_radians().sin().powi(2);
        assert!((cone.mean(Some(n))[0] / sin2 - 1.0).abs() < 1e-3);
        let focus = Shaping::new(n, 360.0, 0.0, 6.0, Spectrum::ZERO);
        assert!((focus.mean(Some(n))[0] * 4.0 - 1.0).abs() < 1e-3);
        assert!((focus.mean(None)[0] * 7.0 - 1.0).abs() < 1e-3);
        let tilted = Shaping::new(Vec3::X, 360.0, 0.0, 0.0, Spectrum::ZERO);
        assert!((tilted.mean(Some(n))[0] - 1.0).abs() < 1e-3);
    }
}
