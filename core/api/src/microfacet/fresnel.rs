//! Fresnel's equations for unpolarised light.

use crate::spectrum::Spectrum;

/// Reflectance of a boundary between dielectrics, and the cosine of the refracted direction (0 if reflection is total).
///
/// `cos` ≥ 0 is measured to the boundary's normal on the side of the light; `eta` is the index of refraction of the far
/// side over that of the near side.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    let cos = cos.clamp(0.0, 1.0);
    // cos²θt = 1 − (1 − cos²θ)/η², written so that nothing cancels at η near 1: (η² − 1 + cos²)/η².
    let squared = ((eta - 1.0) * (eta + 1.0) + cos * cos) / (eta * eta);
    if !(squared > 0.0) {
        return (1.0, 0.0);
    }
    let t = squared.sqrt().min(1.0);
    let parallel = (eta * cos - t) / (eta * cos + t);
    let perpendicular = (cos - eta * t) / (cos + eta * t);
    (
        (0.5 * (parallel * parallel + perpendicular * perpendicular)).min(1.0),
        t,
    )
}

/// Transmittance of a boundary between dielectrics, 1 − F, from the cosines on both sides (≥ 0): it keeps its digits where
/// nearly all is reflected, and is the same to the last one from both sides.
#[inline]
pub fn transmittance(cos: f32, cos_t: f32, eta: f32) -> f32 {
    let (parallel, perpendicular) = (eta * cos + cos_t, cos + eta * cos_t);
    let product = 2.0 * eta * cos * cos_t;
    if !(product > 0.0) {
        return 0.0;
    }
    product / (parallel * parallel) + product / (perpendicular * perpendicular)
}

/// Reflectance of a dielectric at normal incidence, ((η − 1)/(η + 1))².
#[inline]
pub fn normal_incidence(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Reflectance of a dielectric for diffuse light, 2 ∫ F(μ) μ dμ (Walsh's closed form, in Duntley 1942); for `eta` < 1 from
/// the inside, by 1 − F(1/η) = η² (1 − F(η)).
pub fn dielectric_average(eta: f32) -> f32 {
    let n = f64::from(eta.max(1.0 / eta));
    // Closer to 1 nothing is reflected that could be told from 0, but the terms would cancel.
    let outer = if n < 1.0 + 1e-4 {
        0.0
    } else {
        let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
        0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
            + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
            - 2.0 * n3 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
            + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * n.ln()
    };
    if eta >= 1.0 {
        outer as f32
    } else {
        (1.0 - (1.0 - outer) / (n * n)) as f32
    }
}

/// Reflectance of a conductor with complex index `eta` + i `k` against its surroundings, for light at cosine `cos`.
///
/// The exact equations with u² + v² = |(η + ik)² − sin²θ| (Born & Wolf, §14.2).
#[inline]
pub fn conductor(cos: f32, eta: f32, k: f32) -> f32 {
    let c = cos.clamp(0.0, 1.0);
    let (c2, s2) = (c * c, (1.0 - c) * (1.0 + c));
    let real = eta * eta - k * k - s2;
    let modulus = (real * real + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (modulus + real).max(0.0)).sqrt();
    let perpendicular = (modulus + c2 - 2.0 * a * c) / (modulus + c2 + 2.0 * a * c);
    let parallel = perpendicular * (modulus * c2 + s2 * s2 - 2.0 * a * c * s2)
        / (modulus * c2 + s2 * s2 + 2.0 * a * c * s2);
    let f = 0.5 * (perpendicular + parallel);
    // Without any index (an unused lane, say) there is 0/0 at normal incidence, between ones.
    if f.is_nan() { 1.0 } else { f.clamp(0.0, 1.0) }
}

/// Schlick's curve (1 − cos)⁵: 0 at normal incidence, 1 at grazing.
#[inline(always)]
pub fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// 2 ∫ (1 − μ)⁵ μ dμ.
pub const SCHLICK_AVERAGE: f32 = 1.0 / 21.0;

/// 2 ∫ μ (1 − μ)⁶ μ dμ.
pub const F82_AVERAGE: f32 = 1.0 / 126.0;

/// A conductor given by its colour at normal incidence and by the tint of its reflection at 82°, where metals dip most
/// (Kutz, Hašan & Edmondson 2021, "Novel aspects of the Adobe Standard Material", as in OpenPBR 1.1): Schlick's curve
/// F₀ + (1 − F₀)(1 − cos)⁵ less b cos (1 − cos)⁶, where b makes the value at cos = 1/7 the tint times Schlick's.
#[derive(Clone, Copy, Debug)]
pub struct Tinted {
    f0: Spectrum,
    b: Spectrum,
}

impl Tinted {
    /// From the colour at normal incidence and the tint at 82°, both in [0, 1].
    pub fn new(f0: Spectrum, edge: Spectrum) -> Self {
        const MU: f32 = 1.0 / 7.0;
        let m = 1.0 - MU;
        let m5 = m * m * m * m * m;
        let b = f0.zip(edge, |f0, edge| {
            (f0 + (1.0 - f0) * m5) * (1.0 - edge) / (MU * m5 * m)
        });
        Self { f0, b }
    }

    /// Reflectance at normal incidence.
    #[inline(always)]
    pub fn f0(&self) -> Spectrum {
        self.f0
    }

    /// Reflectance at cosine `cos`.
    #[inline]
    pub fn at(&self, cos: f32) -> Spectrum {
        let s = schlick(cos);
        let dip = cos * s * (1.0 - cos);
        self.f0
            .zip(self.b, |f0, b| (f0 + (1.0 - f0) * s - b * dip).max(0.0))
    }

    /// Its mean for diffuse light, 2 ∫ F(μ) μ dμ.
    pub fn average(&self) -> Spectrum {
        self.f0.zip(self.b, |f0, b| {
            (f0 + (1.0 - f0) * SCHLICK_AVERAGE - b * F82_AVERAGE).max(0.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean for diffuse light by the midpoint rule.
    fn average(f: impl Fn(f32) -> f32) -> f64 {
        let n = 100_000;
        let at = |i| (f64::from(i) + 0.5) / f64::from(n);
        (0..n)
            .map(|i| 2.0 * at(i) * f64::from(f(at(i) as f32)) / f64::from(n))
            .sum()
    }

    #[test]
    fn dielectric_closed_forms() {
        let (r, t) = dielectric(1.0, 1.5);
        assert!((r - 0.04).abs() < 1e-7 && (t - 1.0).abs() < 1e-7);
        // Brewster's angle, tan θ = η: nothing polarised parallel is reflected, and the refracted ray is perpendicular.
        let eta = 1.5f32;
        let cos = 1.0 / (1.0 + eta * eta).sqrt();
        let (r, t) = dielectric(cos, eta);
        let perpendicular = (1.0 - eta * eta) / (1.0 + eta * eta);
        assert!((r - 0.5 * perpendicular * perpendicular).abs() < 1e-6);
        assert!((t * t + cos * cos - 1.0).abs() < 1e-6);
        // 60° onto glass, from the textbook forms with angles.
        let (i, t) = (60f64.to_radians(), (60f64.to_radians().sin() / 1.5).asin());
        let rs = ((i - t).sin() / (i + t).sin()).powi(2);
        let rp = ((i - t).tan() / (i + t).tan()).powi(2);
        let (r, cos_t) = dielectric(0.5, 1.5);
        assert!((f64::from(r) - 0.5 * (rs + rp)).abs() < 1e-6);
        assert!((f64::from(cos_t) - t.cos()).abs() < 1e-6);
        for cos in [1.0, 0.7, 0.2, 0.01] {
            for eta in [1.5, 1.0 / 1.5, 1.0] {
                let (r, t) = dielectric(cos, eta);
                let sum = r + transmittance(cos, t, eta);
                assert!((sum - 1.0).abs() < 1e-6);
            }
        }
        // Total reflection beyond the critical angle, and grazing incidence.
        let critical = (1.0 - 1.0 / 2.25f32).sqrt();
        assert_eq!(dielectric(critical - 1e-3, 1.0 / 1.5), (1.0, 0.0));
        assert!(dielectric(critical + 1e-3, 1.0 / 1.5).0 < 0.9);
        assert_eq!(dielectric(0.0, 1.5).0, 1.0);
        // No boundary, no reflection.
        assert_eq!(dielectric(0.3, 1.0), (0.0, 0.3));
    }

    /// The same reflectance from both sides along one ray (closer to grazing, the refracted cosine no longer tells).
    #[test]
    fn both_sides_agree() {
        for i in 10..100 {
            let cos = i as f32 / 100.0;
            let (r, t) = dielectric(cos, 1.7);
            let (back, c) = dielectric(t, 1.0 / 1.7);
            assert!((r - back).abs() < 2e-5, "{r} {back}");
            assert!((cos - c).abs() < 2e-5);
        }
    }

    #[test]
    fn averages() {
        for eta in [1.1, 1.33, 1.5, 2.4, 1.0 / 1.5, 1.0 / 2.4] {
            let direct = average(|c| dielectric(c, eta).0);
            let closed = f64::from(dielectric_average(eta));
            assert!((direct - closed).abs() < 1e-5, "{eta}: {direct} {closed}");
        }
        assert_eq!(dielectric_average(1.0), 0.0);
        let metal = Tinted::new(Spectrum::rgb(0.9, 0.5, 0.1), Spectrum::rgb(1.0, 0.7, 0.6));
        for lane in 0..3 {
            let direct = average(|c| metal.at(c)[lane]);
            let closed = f64::from(metal.average()[lane]);
            assert!((direct - closed).abs() < 1e-5, "{direct} {closed}");
        }
    }

    #[test]
    fn conductor_closed_forms() {
        // Normal incidence: ((η − 1)² + k²)/((η + 1)² + k²), for silver in the green.
        let (eta, k) = (0.13f32, 3.0f32);
        let normal = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((conductor(1.0, eta, k) - normal).abs() < 1e-6);
        assert!((conductor(0.0, eta, k) - 1.0).abs() < 1e-6);
        assert_eq!(conductor(1.0, 0.0, 0.0), 1.0);
        // Without absorption it is a dielectric.
        for i in 0..=100 {
            let cos = i as f32 / 100.0;
            let (a, b) = (conductor(cos, 1.5, 0.0), dielectric(cos, 1.5).0);
            assert!((a - b).abs() < 1e-5, "{cos}: {a} {b}");
        }
        // 60°, by complex arithmetic written out in double precision.
        let (n, kk, c) = (1.0f64, 2.0f64, 0.5f64);
        let (re, im) = (n * n - kk * kk - 0.75, 2.0 * n * kk);
        let r = re.hypot(im);
        let (a, b) = ((0.5 * (r + re)).sqrt(), (0.5 * (r - re)).sqrt());
        let norm = |x: f64, y: f64| x * x + y * y;
        let rs = norm(c - a, b) / norm(c + a, b);
        let m = (n * n - kk * kk, 2.0 * n * kk);
        let rp = norm(m.0 * c - a, m.1 * c - b) / norm(m.0 * c + a, m.1 * c + b);
        assert!((f64::from(conductor(0.5, 1.0, 2.0)) - 0.5 * (rs + rp)).abs() < 1e-6);
    }

    #[test]
    fn the_tint_is_met_at_82_degrees() {
        let (f0, edge) = (Spectrum::splat(0.6), Spectrum::splat(0.8));
        let (cos, m) = (1.0 / 7.0, 6.0f32 / 7.0);
        let expected = 0.8 * (0.6 + 0.4 * m.powi(5));
        let metal = Tinted::new(f0, edge);
        assert!((metal.at(cos)[0] - expected).abs() < 1e-5);
        assert!((metal.at(1.0)[0] - 0.6).abs() < 1e-6 && (metal.at(0.0)[0] - 1.0).abs() < 1e-6);
    }
}
