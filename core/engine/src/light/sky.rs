//! Sun and clear sky by the analytic model of Preetham, Shirley & Smits 1999, "A Practical Analytic Model for Daylight".
//!
//! Radiances are linear sRGB in W·sr⁻¹·m⁻² weighted by the eye's sensitivity: the luminance 0.2126 R + 0.7152 G + 0.0722 B times
//! 683 lm/W is in cd/m². Sun and sky share the unit, so that their ratio is the model's.
//!
//! There is a crate of the later model of Hosek & Wilkie (`hw-skymodel`), but it was published once, in 2023, and leaves the sun
//! out; this model is a page of formulae. It holds for turbidities from 2 to 10 and a sun above the horizon, and tells nothing of
//! the ground: below the horizon stands a Lambertian plane that reflects what sun and sky send onto it. Skies come out brighter than
//! measured ones, by half or so with the sun high up (Zotti, Wilkie & Purgathofer 2007).

use super::{ImageEnvironment, Light};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use resolvent_api::math::Vec3;
use resolvent_api::{Spectrum, observer};
use std::f64::consts::PI;

/// Luminous efficacy of the unit, lm/W.
pub const EFFICACY: f64 = 683.0;

/// Texels of the image the sky becomes.
const WIDTH: usize = 1024;
const HEIGHT: usize = 512;

/// Perez et al. 1993: relative luminance at the angles θ from the zenith and γ from the sun, coefficients A to E.
#[derive(Clone, Copy, Debug)]
struct Perez([f64; 5]);

impl Perez {
    fn at(&self, cos_theta: f64, gamma: f64) -> f64 {
        let [a, b, c, d, e] = self.0;
        let haze = 1.0 + a * (b / cos_theta.max(1e-3)).exp();
        haze * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
    }
}

/// A clear sky in its own space, +y up.
#[derive(Clone, Debug)]
pub struct Sky {
    to_sun: DVec3,
    turbidity: f64,
    /// For luminance (kcd/m²) and the chromaticities x and y.
    perez: [Perez; 3],
    /// Value at the zenith over the Perez function there.
    zenith: [f64; 3],
}

impl Sky {
    /// With the unit direction `to_sun` above the horizon (y ≥ 0) and a turbidity from 2 (clear) to 10 (hazy).
    pub fn new(to_sun: DVec3, turbidity: f64) -> Self {
        let t = turbidity;
        let line = |rows: [[f64; 2]; 5]| Perez(rows.map(|[slope, at_0]| slope * t + at_0));
        // Table 1 of the paper (appendix A.2).
        let perez = [
            line([
                [0.1787, -1.4630],
                [-0.3554, 0.4275],
                [-0.0227, 5.3251],
                [0.1206, -2.5771],
                [-0.0670, 0.3703],
            ]),
            line([
                [-0.0193, -0.2592],
                [-0.0665, 0.0008],
                [-0.0004, 0.2125],
                [-0.0641, -0.8989],
                [-0.0033, 0.0452],
            ]),
            line([
                [-0.0167, -0.2608],
                [-0.0950, 0.0092],
                [-0.0079, 0.2102],
                [-0.0441, -1.6537],
                [-0.0109, 0.0529],
            ]),
        ];
        let theta = to_sun.y.clamp(0.0, 1.0).acos();
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * theta);
        let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
        let chromaticity = |m: [[f64; 4]; 3]| {
            let row = |r: [f64; 4]| ((r[0] * theta + r[1]) * theta + r[2]) * theta + r[3];
            (row(m[0]) * t + row(m[1])) * t + row(m[2])
        };
        let x = chromaticity([
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]);
        let y = chromaticity([
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]);
        let over = |value: f64, p: &Perez| value / p.at(1.0, theta);
        Self {
            to_sun,
            turbidity,
            zenith: [
                over(luminance, &perez[0]),
                over(x, &perez[1]),
                over(y, &perez[2]),
            ],
            perez,
        }
    }

    /// Radiance from the unit direction `w` above the horizon.
    pub fn radiance(&self, w: DVec3) -> [f64; 3] {
        // atan2 keeps the digits of small angles.
        let gamma = w.cross(self.to_sun).length().atan2(w.dot(self.to_sun));
        let [luminance, x, y] = [0, 1, 2].map(|i| self.zenith[i] * self.perez[i].at(w.y, gamma));
        let bright = (luminance.max(0.0) * 1000.0) / EFFICACY;
        rgb([bright * x / y, bright, bright * (1.0 - x - y) / y])
    }

    /// Irradiance by the sun on a plane that faces it: the extraterrestrial spectrum after Rayleigh scattering, aerosols
    /// (Ångström) and ozone (appendix A.1). Water vapour and mixed gases absorb where the eye sees next to nothing.
    pub fn sun(&self) -> [f64; 3] {
        let elevation = self.to_sun.y.clamp(0.0, 1.0).asin().to_degrees();
        // Relative optical mass (Kasten 1966).
        let mass = 1.0 / (self.to_sun.y.max(0.0) + 0.15 * (elevation + 3.885).powf(-1.253));
        let beta = 0.04608 * self.turbidity - 0.04586;
        rgb(sunlight(|nm, ozone| {
            let um = 1e-3 * nm;
            let rayleigh = 0.008735 * um.powf(-4.08);
            let aerosol = beta * um.powf(-1.3);
            // 0.35 cm of ozone.
            (-mass * (rayleigh + aerosol + 0.35 * ozone)).exp()
        }))
    }
}

/// Linear sRGB of CIE XYZ; colours outside of it are moved to its edge.
fn rgb(xyz: [f64; 3]) -> [f64; 3] {
    observer::rgb(xyz).map(|v| v.max(0.0))
}

/// Radiance of the sun outside the atmosphere, 10 W·sr⁻¹·m⁻²·nm⁻¹, from 380 to 750 nm in steps of 10 nm (table 2 of the paper).
const SUN: [f64; 38] = [
    1655.9, 1623.37, 2112.75, 2588.82, 2582.91, 2423.23, 2676.05, 2965.83, 3054.54, 3005.75,
    3066.37, 2883.04, 2871.21, 2782.5, 2710.06, 2723.36, 2636.13, 2550.38, 2506.02, 2531.16,
    2535.59, 2513.42, 2463.15, 2417.32, 2368.53, 2321.21, 2282.77, 2233.98, 2197.02, 2152.67,
    2109.79, 2072.83, 2024.04, 1987.08, 1942.72, 1907.24, 1862.89, 1825.92,
];

/// Absorption by ozone, cm⁻¹, at the same wavelengths (ibid.).
const OZONE: [f64; 38] = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.003, 0.006, 0.009, 0.014, 0.021, 0.030, 0.040, 0.048,
    0.063, 0.075, 0.085, 0.103, 0.120, 0.120, 0.115, 0.125, 0.120, 0.105, 0.090, 0.079, 0.067,
    0.057, 0.048, 0.036, 0.028, 0.023, 0.018, 0.014, 0.011, 0.010, 0.009,
];

/// Solid angle of the sun, sr: a diameter of 1.39 at a distance of 150 million km (ibid.).
const SUN_SOLID_ANGLE: f64 = 0.25 * PI * 1.39 * 1.39 / (150.0 * 150.0);

/// XYZ of the sun's irradiance behind a transmittance of wavelength (nm) and ozone absorption.
fn sunlight(transmittance: impl Fn(f64, f64) -> f64) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for (i, (radiance, ozone)) in SUN.iter().zip(OZONE).enumerate() {
        let nm = 380.0 + 10.0 * i as f64;
        let power = 10.0 * radiance * SUN_SOLID_ANGLE * 10.0 * transmittance(nm, ozone);
        for (sum, matching) in xyz.iter_mut().zip(observer::matching(nm)) {
            *sum += power * matching;
        }
    }
    xyz
}

/// A sun and a sky as a scene describes them.
#[derive(Clone, Debug)]
pub struct SunSky {
    /// Unit direction towards the sun in the sky's own space, +y up.
    pub to_sun: DVec3,
    /// From 2 to 10.
    pub turbidity: f64,
    /// Of the plane below the horizon.
    pub ground_albedo: [f64; 3],
    /// Factor on everything.
    pub scale: [f64; 3],
    /// Full angle of the sun's disc, degrees, of which its irradiance does not depend; 0: parallel light; `None`: no sun, though
    /// the ground shows its light.
    pub sun_angle_deg: Option<f64>,
    /// The sky's space to world, a rotation.
    pub to_world: DMat3,
}

impl SunSky {
    /// The sky as an image and the sun.
    pub fn lights(&self) -> Vec<Light> {
        let sky = Sky::new(self.to_sun, self.turbidity);
        let sun = sky.sun();
        let mut texels = bake(&sky);
        let below = self.ground(&texels, sun);
        texels[WIDTH * HEIGHT / 2..].fill(below);
        let scale = |v: [f64; 3]| [0, 1, 2].map(|i| v[i] * self.scale[i]);
        for t in &mut texels {
            *t = [0, 1, 2].map(|i| t[i] * self.scale[i] as f32);
        }
        let rows = self.to_world.transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis].map(|r| r.as_vec3());
        let image = ImageEnvironment::new(WIDTH, HEIGHT, texels, rows);
        let mut lights = vec![Light::Image(Box::new(image))];
        let [r, g, b] = scale(sun).map(|v| v as f32);
        let irradiance = Spectrum::rgb(r, g, b);
        if let Some(angle) = self.sun_angle_deg.filter(|_| !irradiance.is_zero()) {
            let to_light: Vec3 = (self.to_world * self.to_sun).normalize().as_vec3();
            lights.push(if angle > 0.0 {
                Light::disc(to_light, irradiance, angle)
            } else {
                Light::Distant {
                    to_light,
                    irradiance,
                }
            });
        }
        lights
    }

    /// Radiance of the ground: Lambertian, under the whole sky and the sun.
    fn ground(&self, texels: &[[f32; 3]], sun: [f64; 3]) -> [f32; 3] {
        let mut irradiance = sun.map(|v| v * self.to_sun.y.max(0.0));
        for (y, row) in texels.chunks(WIDTH).enumerate().take(HEIGHT / 2) {
            // ∫ cos θ over a texel: Δφ (cos² θ_0 − cos² θ_1)/2.
            let [a, b] = [y, y + 1].map(|y| cos_of(y).powi(2));
            let projected = PI * (a - b) / WIDTH as f64;
            for t in row {
                for (sum, v) in irradiance.iter_mut().zip(t) {
                    *sum += f64::from(*v) * projected;
                }
            }
        }
        [0, 1, 2].map(|i| (irradiance[i] * self.ground_albedo[i] / PI) as f32)
    }
}

/// Cosine of the angle from the zenith of the upper edge of a row.
fn cos_of(y: usize) -> f64 {
    (PI * y as f64 / HEIGHT as f64).cos()
}

/// The upper half as a latitude-longitude image, [`ImageEnvironment`]'s convention; the lower half is 0.
fn bake(sky: &Sky) -> Vec<[f32; 3]> {
    let mut texels = vec![[0.0; 3]; WIDTH * HEIGHT];
    texels
        .par_chunks_mut(WIDTH)
        .take(HEIGHT / 2)
        .enumerate()
        .for_each(|(y, row)| {
            let cos = 0.5 * (cos_of(y) + cos_of(y + 1));
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            for (x, texel) in row.iter_mut().enumerate() {
                let turn = 0.5 - (x as f64 + 0.5) / WIDTH as f64;
                let (s, c) = (2.0 * PI * turn).sin_cos();
                *texel = sky
                    .radiance(DVec3::new(sin * s, cos, sin * c))
                    .map(|v| v as f32);
            }
        });
    texels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: [f64; 3]) -> f64 {
        EFFICACY * (0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2])
    }

    fn at(elevation_deg: f64) -> DVec3 {
        let (sin, cos) = elevation_deg.to_radians().sin_cos();
        DVec3::new(0.6 * cos, sin, 0.8 * cos)
    }

    /// The zenith has the luminance of the paper's formula: 5.140 kcd/m² for turbidity 3 and the sun 60° from it, by hand.
    #[test]
    fn zenith() {
        let found = luminance(Sky::new(at(30.0), 3.0).radiance(DVec3::Y));
        assert!((found / 5140.0 - 1.0).abs() < 1e-3, "{found}");
    }

    /// The sun outside the atmosphere gives the luminous solar constant, 133 to 134 klx; on the ground some 100 klx from the
    /// zenith through clear air, less through haze and from low down, and redder there.
    #[test]
    fn sun() {
        let outside = luminance(rgb(sunlight(|_, _| 1.0)));
        assert!((125e3..140e3).contains(&outside), "{outside}");
        let direct = |elevation: f64, turbidity: f64| Sky::new(at(elevation), turbidity).sun();
        let zenith = luminance(direct(90.0, 2.5));
        assert!((90e3..115e3).contains(&zenith), "{zenith}");
        let (mut last, mut red) = (f64::INFINITY, 0.0);
        for elevation in [90.0, 60.0, 30.0, 15.0, 5.0, 1.0] {
            let c = direct(elevation, 3.0);
            assert!(
                luminance(c) < last && c[0] / c[1].max(1e-9) > red,
                "{elevation}: {c:?}"
            );
            (last, red) = (luminance(c), c[0] / c[1].max(1e-9));
            assert!(luminance(direct(elevation, 8.0)) < last);
        }
    }

    /// Clear skies give some 10 to 20 klx on the ground with the sun high up; this model is known to be brighter (Zotti, Wilkie &
    /// Purgathofer 2007), 27 klx. They are blue away from the sun and brightest near it; no value is negative or infinite in the
    /// whole range.
    #[test]
    fn skies() {
        let sky = SunSky {
            to_sun: at(60.0),
            turbidity: 2.5,
            ground_albedo: [1.0; 3],
            scale: [1.0; 3],
            sun_angle_deg: None,
            to_world: DMat3::IDENTITY,
        };
        let model = Sky::new(sky.to_sun, sky.turbidity);
        let white = sky.ground(&bake(&model), [0.0; 3]).map(f64::from);
        let lux = luminance(white) * PI;
        assert!((10e3..30e3).contains(&lux), "{lux}");
        let away = model.radiance(DVec3::new(-0.6, 0.6, -0.8).normalize());
        assert!(away[2] > 1.5 * away[0], "{away:?}");
        for turbidity in [2.0, 4.0, 10.0] {
            for elevation in [0.0, 3.0, 20.0, 90.0] {
                let sky = Sky::new(at(elevation), turbidity);
                let texels = bake(&sky);
                assert!(texels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
                let most = luminance(sky.radiance(at(elevation)));
                let zenith = luminance(sky.radiance(DVec3::Y));
                assert!(most >= zenith && zenith > 0.0, "{turbidity} {elevation}");
            }
        }
    }

    /// The image shows the model where the model says, under a rotation too; the ground reflects all that falls onto it; the sun
    /// stands where it should and brings its irradiance whatever its angle.
    #[test]
    fn image_and_disc() {
        let to_world = DMat3::from_rotation_x(0.5) * DMat3::from_rotation_y(2.0);
        let described = SunSky {
            to_sun: at(40.0),
            turbidity: 3.0,
            ground_albedo: [0.2, 0.3, 0.4],
            scale: [2.0, 1.0, 0.5],
            sun_angle_deg: Some(3.0),
            to_world,
        };
        let lights = described.lights();
        let model = Sky::new(described.to_sun, 3.0);
        let [
            Light::Image(image),
            Light::Disc {
                frame,
                radiance,
                one_minus_cos,
            },
        ] = lights.as_slice()
        else {
            panic!("a sky and a sun");
        };
        for k in 0..200 {
            let (a, y) = (f64::from(k) * 2.4, 0.05 + 0.94 * f64::from(k) / 200.0);
            let s = (1.0 - y * y).sqrt();
            let w = DVec3::new(s * a.cos(), y, s * a.sin());
            let found = image.towards((to_world * w).as_vec3()).0;
            for (i, expected) in model.radiance(w).into_iter().enumerate() {
                let expected = expected * described.scale[i];
                // A texel is 0.35° wide.
                assert!(
                    (f64::from(found[i]) / expected - 1.0).abs() < 0.03,
                    "{w} {i}"
                );
            }
        }
        let ground = image.towards((to_world * -DVec3::Y).as_vec3()).0;
        let n = 400;
        for i in 0..3 {
            let mut e = model.sun()[i] * described.to_sun.y;
            for k in 0..n * n {
                let (u, v) = ((k % n) as f64 + 0.5, (k / n) as f64 + 0.5);
                // Cosine-weighted: r² and φ uniform.
                let (r, phi) = ((u / n as f64).sqrt(), 2.0 * PI * v / n as f64);
                let w = DVec3::new(r * phi.cos(), (1.0 - r * r).sqrt(), r * phi.sin());
                e += model.radiance(w)[i] * PI / (n * n) as f64;
            }
            let expected = e * described.ground_albedo[i] / PI * described.scale[i];
            assert!((f64::from(ground[i]) / expected - 1.0).abs() < 2e-3, "{i}");
        }
        let n = Vec3::from(frame.n).as_dvec3();
        assert!((n - to_world * described.to_sun).length() < 1e-6);
        let half = 1.5f64.to_radians();
        assert!((f64::from(*one_minus_cos) / (1.0 - half.cos()) - 1.0).abs() < 1e-4);
        let irradiance = f64::from(radiance[0]) * PI * half.sin().powi(2);
        assert!((irradiance / (2.0 * model.sun()[0]) - 1.0).abs() < 1e-5);
    }
}
