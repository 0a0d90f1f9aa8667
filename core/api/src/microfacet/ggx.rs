//! The GGX distribution of facets, after Smith's masking.

use crate::math::Vec3;
use crate::math::warp::sin_cos_turn;
use core::f32::consts::PI;

/// The GGX distribution (Trowbridge & Reitz 1975; Walter et al. 2007), anisotropic.
///
/// With l(ω) = √(α_x² x² + α_y² y² + z²) Smith's masking is G₁ = 2|z|/(|z| + l), so that G₁/|z| stays finite at grazing
/// angles; everything here is written in these terms.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    /// Widths along x and y, above 0.
    pub alpha: [f32; 2],
}

impl Ggx {
    /// l(ω).
    #[inline(always)]
    fn length(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha[0] * w.x, self.alpha[1] * w.y);
        (x * x + y * y + w.z * w.z).sqrt()
    }

    /// Density of facet normals, D(h), per steradian: ∫ D(h) h_z dh = 1.
    #[inline(always)]
    pub fn d(&self, h: Vec3) -> f32 {
        let [a, b] = self.alpha;
        let (x, y) = (h.x / a, h.y / b);
        let s = x * x + y * y + h.z * h.z;
        1.0 / (PI * a * b * s * s)
    }

    /// Masking of one direction over its cosine, G₁(ω)/|z|.
    #[inline(always)]
    pub fn g1_over_cos(&self, w: Vec3) -> f32 {
        2.0 / (w.z.abs() + self.length(w))
    }

    /// Masking and shadowing, correlated by height (Heitz 2014, eq. 99), over both cosines: G₂(ωo, ωi)/(|z_o| |z_i|). The
    /// directions may lie on different sides.
    #[inline(always)]
    pub fn g2_over_cos(&self, wo: Vec3, wi: Vec3) -> f32 {
        2.0 / (wo.z.abs() * self.length(wi) + wi.z.abs() * self.length(wo))
    }

    /// Density of visible normals, per steradian of h: G₁(ωo) (ωo·h) D(h)/z_o (Heitz 2018, eq. 1), for `wo` above.
    #[inline(always)]
    pub fn visible(&self, wo: Vec3, h: Vec3) -> f32 {
        self.g1_over_cos(wo) * wo.dot(h).max(0.0) * self.d(h)
    }

    /// A normal visible from `wo`, which lies above, with the density [`visible`](Self::visible): a uniform point of the
    /// spherical cap that reflects `wo` upwards (Dupuy & Benyoub 2023, "Sampling visible GGX normals with spherical caps").
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let [a, b] = self.alpha;
        let v = Vec3::new(a * wo.x, b * wo.y, wo.z).normalize();
        let (s, c) = sin_cos_turn(u[0]);
        // z from −v.z to 1; 1 − z² as a product keeps its digits near the pole.
        let below = u[1] * (1.0 + v.z);
        let z = 1.0 - below;
        let r = (below * (2.0 - below)).max(0.0).sqrt();
        let n = Vec3::new(r * c + v.x, r * s + v.y, z + v.z);
        Vec3::new(a * n.x, b * n.y, n.z.max(0.0))
            .try_normalize()
            .unwrap_or(Vec3::Z)
    }
}

/// `wo` mirrored at the normal `h`.
#[inline(always)]
pub(super) fn reflect(wo: Vec3, h: Vec3) -> Vec3 {
    2.0 * wo.dot(h) * h - wo
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoints of `n`² cells of the upper hemisphere with their solid angle.
    fn hemisphere(n: u32) -> impl Iterator<Item = (Vec3, f64)> {
        (0..n * n).map(move |i| {
            let at = |k: u32| (k as f32 + 0.5) / n as f32;
            let (z, turn) = (at(i / n), at(i % n));
            let w = crate::math::warp::around_z(z, turn);
            (w, 2.0 * std::f64::consts::PI / f64::from(n * n))
        })
    }

    /// ∫ D h_z = 1, and the visible normals' projected area is that of the surface: ∫ G₁ (ω·h)⁺ D dh = z (Heitz 2014, eq. 16).
    #[test]
    fn areas() {
        let ggx = Ggx { alpha: [0.6, 0.3] };
        let whole: f64 = hemisphere(1000)
            .map(|(h, dh)| f64::from(ggx.d(h) * h.z) * dh)
            .sum();
        assert!((whole - 1.0).abs() < 1e-3, "{whole}");
        for wo in [
            Vec3::Z,
            Vec3::new(0.6, 0.0, 0.8),
            Vec3::new(-0.3, 0.94, 0.15),
        ] {
            let wo = wo.normalize();
            let seen: f64 = hemisphere(1000)
                .map(|(h, dh)| f64::from(ggx.visible(wo, h)) * dh)
                .sum();
            assert!((seen - 1.0).abs() < 2e-3, "{wo}: {seen}");
        }
    }

    /// Smith's function in its usual form, Λ = (√(1 + α² tan²θ) − 1)/2.
    #[test]
    fn smith() {
        let ggx = Ggx { alpha: [0.5, 0.5] };
        let lambda = |cos: f64| 0.5 * ((1.0 + 0.25 * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0);
        let w = |cos: f32| crate::math::warp::around_z(cos, 0.2);
        let g1 = 0.3 * f64::from(ggx.g1_over_cos(w(0.3)));
        assert!((g1 - 1.0 / (1.0 + lambda(0.3))).abs() < 1e-6);
        let g2 = 0.3 * 0.7 * f64::from(ggx.g2_over_cos(w(0.3), w(-0.7)));
        assert!((g2 - 1.0 / (1.0 + lambda(0.3) + lambda(0.7))).abs() < 1e-6);
        assert!(ggx.g1_over_cos(Vec3::X).is_finite());
    }

    /// Sampled normals have the moments of their density.
    #[test]
    fn samples_are_visible_normals() {
        let ggx = Ggx { alpha: [0.7, 0.2] };
        let wo = Vec3::new(0.7, 0.3, 0.2).normalize();
        let moments = |h: Vec3| [h.x, h.y, h.z, h.x * h.y].map(f64::from);
        let mut expected = [0.0; 4];
        for (h, dh) in hemisphere(1000) {
            let p = f64::from(ggx.visible(wo, h)) * dh;
            expected
                .iter_mut()
                .zip(moments(h))
                .for_each(|(e, m)| *e += m * p);
        }
        let mut mean = [0.0; 4];
        let n = 500;
        for i in 0..n * n {
            let at = |k: u32| (k as f32 + 0.5) / n as f32;
            let h = ggx.sample(wo, [at(i % n), at(i / n)]);
            mean.iter_mut()
                .zip(moments(h))
                .for_each(|(a, m)| *a += m / f64::from(n * n));
        }
        for (a, e) in mean.iter().zip(expected) {
            assert!((a - e).abs() < 2e-3, "{mean:?} {expected:?}");
        }
    }
}
