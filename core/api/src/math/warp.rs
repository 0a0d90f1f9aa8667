//! Mappings from the unit square to directions and points, with their densities.

use super::Vec3;
use core::f32::consts::{FRAC_1_PI, PI};

/// Density of [`sphere`], 1/(4π) sr⁻¹.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform direction on the sphere.
#[inline(always)]
pub fn sphere(u: [f32; 2]) -> Vec3 {
    around_z(1.0 - 2.0 * u[0], u[1])
}

/// The unit vector with polar cosine `cos_theta` and azimuth 2π·`u`.
#[inline(always)]
pub fn around_z(cos_theta: f32, u: f32) -> Vec3 {
    // (1−c)(1+c) instead of 1−c²: near c = ±1 the product keeps the digits that the difference loses.
    let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
    let (s, c) = sin_cos_turn(u);
    Vec3::new(sin_theta * c, sin_theta * s, cos_theta)
}

/// (sin 2πu, cos 2πu) for u in [0, 1].
#[inline(always)]
pub fn sin_cos_turn(u: f32) -> (f32, f32) {
    (2.0 * PI * u).sin_cos()
}

/// Uniform point on the unit disk (Shirley & Chiu 1997: concentric, keeps stratification).
#[inline(always)]
pub fn disk(u: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    let (r, phi) = if a.abs() > b.abs() {
        (a, (PI / 4.0) * (b / a))
    } else {
        (b, PI / 2.0 - (PI / 4.0) * (a / b))
    };
    let (s, c) = phi.sin_cos();
    [r * c, r * s]
}

/// Cosine-weighted direction on the upper hemisphere; its density is z/π.
#[inline(always)]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = disk(u);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// Uniform direction in the cone around +z with half-angle cosine `cos_max`.
///
/// `one_minus_cos` = 1 − cos_max is passed by the caller, who can compute it without cancellation for a narrow cone.
#[inline(always)]
pub fn cone(u: [f32; 2], one_minus_cos: f32) -> Vec3 {
    let h = u[0] * one_minus_cos;
    let sin_theta = (h * (2.0 - h)).max(0.0).sqrt();
    let (s, c) = sin_cos_turn(u[1]);
    Vec3::new(sin_theta * c, sin_theta * s, 1.0 - h)
}
