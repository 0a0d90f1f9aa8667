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
    // Which of the two is larger is as good as random: selected, not branched on.
    let swap = b.abs() >= a.abs();
    let (r, other) = if swap { (b, a) } else { (a, b) };
    let (s, c) = sin_cos_eighth((PI / 4.0) * (other / r));
    let (x, y) = if swap { (s, c) } else { (c, s) };
    [r * x, r * y]
}

/// (sin x, cos x) for |x| ≤ π/4, to about an ulp (minimax polynomials of the Cephes library's `sinf` and `cosf`, S. Moshier).
#[inline(always)]
fn sin_cos_eighth(x: f32) -> (f32, f32) {
    let z = x * x;
    let s = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 0.166_666_55) * z * x + x;
    let c = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    (s, c)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Against double precision, over the whole eighth of a turn and its ends.
    #[test]
    fn sine_and_cosine_of_an_eighth() {
        for i in -100_000..=100_000 {
            let x = i as f32 * (PI / 4.0 / 100_000.0);
            let (s, c) = sin_cos_eighth(x);
            let (s64, c64) = f64::from(x).sin_cos();
            assert!((f64::from(s) - s64).abs() <= 1.2e-7 * s64.abs(), "sin {x}");
            assert!((f64::from(c) - c64).abs() <= 1.2e-7 * c64, "cos {x}");
        }
    }

    /// The map as its authors give it, sector by sector, and the corners on the circle.
    #[test]
    fn disk_is_concentric() {
        for i in 0..=64 {
            for j in 0..=64 {
                let u = [i as f32 / 64.0, j as f32 / 64.0];
                let (a, b) = (2.0 * f64::from(u[0]) - 1.0, 2.0 * f64::from(u[1]) - 1.0);
                let quarter = core::f64::consts::FRAC_PI_4;
                let (r, phi) = match (a, b) {
                    _ if a == 0.0 && b == 0.0 => (0.0, 0.0),
                    _ if a.abs() > b.abs() => (a, quarter * (b / a)),
                    _ => (b, 2.0 * quarter - quarter * (a / b)),
                };
                let [x, y] = disk(u);
                let (dx, dy) = (f64::from(x) - r * phi.cos(), f64::from(y) - r * phi.sin());
                assert!(dx.abs().max(dy.abs()) < 3e-7, "{u:?}: {x} {y}");
            }
        }
    }
}
