//! An environment image, sampled in proportion to its radiance times solid angle.

use super::Distribution;
use resolvent_api::Spectrum;
use resolvent_api::math::Vec3;
use std::f32::consts::PI;

/// A latitude-longitude image: +y up in image space, a direction ω at u = ½ − atan2(ω_x, ω_z)/2π, v = acos(ω_y)/π
/// from the upper left corner. Radiance is constant over a texel, so that sampling is exact whatever the contrast.
pub struct ImageEnvironment {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
    rows: Distribution,
    columns: Vec<Distribution>,
    /// Image to world: rows of the rotation matrix and of its inverse.
    to_world: [Vec3; 3],
    to_image: [Vec3; 3],
    mean: Spectrum,
}

impl ImageEnvironment {
    /// From `width`·`height` texels in rows from the top, and a rotation (rows) from image to world space.
    pub fn new(width: usize, height: usize, texels: Vec<[f32; 3]>, to_world: [Vec3; 3]) -> Self {
        let mut columns = Vec::with_capacity(height);
        let mut totals = Vec::with_capacity(height);
        let mut sum = [0f64; 3];
        for y in 0..height {
            let area = Self::row_area(y, height);
            let row = &texels[y * width..(y + 1) * width];
            let weights: Vec<f64> = row
                .iter()
                .map(|t| t.iter().map(|v| f64::from(*v)).sum::<f64>())
                .collect();
            for t in row {
                for (s, v) in sum.iter_mut().zip(t) {
                    *s += f64::from(*v) * area / (width as f64 * 4.0 * std::f64::consts::PI);
                }
            }
            let d = Distribution::new(&weights);
            totals.push(d.total() * area);
            columns.push(d);
        }
        let [a, b, c] = to_world;
        let to_image = [
            Vec3::new(a.x, b.x, c.x),
            Vec3::new(a.y, b.y, c.y),
            Vec3::new(a.z, b.z, c.z),
        ];
        Self {
            width,
            height,
            texels,
            rows: Distribution::new(&totals),
            columns,
            to_world,
            to_image,
            mean: Spectrum::rgb(sum[0] as f32, sum[1] as f32, sum[2] as f32),
        }
    }

    /// Solid angle of a whole row of texels, 2π (cos θ0 − cos θ1).
    fn row_area(y: usize, height: usize) -> f64 {
        let theta = |y: usize| std::f64::consts::PI * y as f64 / height as f64;
        2.0 * std::f64::consts::PI * (theta(y).cos() - theta(y + 1).cos())
    }

    /// Mean radiance over the sphere.
    pub fn mean(&self) -> Spectrum {
        self.mean
    }

    /// A direction, its radiance and its density (sr⁻¹).
    pub fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Spectrum, f32)> {
        let (y, v) = self.rows.sample(u[1])?;
        let (x, s) = self.columns[y].sample(u[0])?;
        // Uniform in solid angle within the texel: uniform in cos θ and in azimuth.
        let cos = |y: usize| (std::f64::consts::PI * y as f64 / self.height as f64).cos();
        let cos_theta = (cos(y) + (cos(y + 1) - cos(y)) * f64::from(v)) as f32;
        let turn = 0.5 - (x as f32 + s) / self.width as f32;
        let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (2.0 * PI * turn).sin_cos();
        let w = rotate(
            &self.to_world,
            Vec3::new(sin_theta * sin_phi, cos_theta, sin_theta * cos_phi),
        );
        let t = self.texels[y * self.width + x];
        Some((
            w.normalize(),
            Spectrum::rgb(t[0], t[1], t[2]),
            self.density(x, y),
        ))
    }

    fn density(&self, x: usize, y: usize) -> f32 {
        let texel = Self::row_area(y, self.height) / self.width as f64;
        self.rows.probability(y) * self.columns[y].probability(x) / texel as f32
    }

    /// Radiance from direction `w`, and the density of sampling it.
    pub fn towards(&self, w: Vec3) -> (Spectrum, f32) {
        let d = rotate(&self.to_image, w);
        let u = 0.5 - d.x.atan2(d.z) / (2.0 * PI);
        let v = d.y.clamp(-1.0, 1.0).acos() / PI;
        let x = ((u * self.width as f32) as usize).min(self.width - 1);
        let y = ((v * self.height as f32) as usize).min(self.height - 1);
        let t = self.texels[y * self.width + x];
        (Spectrum::rgb(t[0], t[1], t[2]), self.density(x, y))
    }
}

fn rotate(rows: &[Vec3; 3], v: Vec3) -> Vec3 {
    Vec3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    /// Sampled directions come back with the radiance and density they were sampled with, and Σ L/p estimates ∫ L.
    #[test]
    fn sampling_agrees_with_look_up() {
        let (w, h) = (16, 8);
        let mut s = Stream::new(3);
        let mut texels: Vec<[f32; 3]> = (0..w * h)
            .map(|_| [s.uniform(), s.uniform(), s.uniform() + 0.1])
            .collect();
        texels[37] = [1e6, 2e6, 3e6];
        let (sin, cos) = 0.7f32.sin_cos();
        let rotation = [Vec3::new(cos, 0.0, sin), Vec3::Y, Vec3::new(-sin, 0.0, cos)];
        let env = ImageEnvironment::new(w, h, texels, rotation);
        let n = 20_000;
        let (mut sum, mut sum2, mut misses) = (0f64, 0f64, 0);
        for _ in 0..n {
            let (dir, radiance, density) = env.sample(s.uniform2()).unwrap();
            let (again, same) = env.towards(dir);
            // A direction within rounding of a texel's edge may be looked up in its neighbour.
            if again != radiance || (same - density).abs() > 1e-4 * density {
                misses += 1;
                continue;
            }
            let x = f64::from(radiance[0] / density);
            sum += x;
            sum2 += x * x;
        }
        assert!(misses < 20, "{misses}");
        let n = f64::from(n - misses);
        let mean = sum / n;
        let error = ((sum2 / n - mean * mean).max(0.0) / n).sqrt();
        let expected = f64::from(env.mean()[0]) * 4.0 * std::f64::consts::PI;
        assert!(
            (mean - expected).abs() < 4.0 * error + 2e-3 * expected,
            "{mean} {expected} {error}"
        );
    }
}
