//! The diffuse base: Lambert's, or rough after Oren & Nayar without loss (EON: Portsmouth, Kutz & Hill 2025, "EON: A
//! Practical Energy-Preserving Rough Diffuse BRDF", JCGT 14-1).

use core::f32::consts::PI;
use resolvent_api::microfacet::exits::{self, Curve, Exits, NODES, Packed};
use resolvent_api::{Spectrum, Vec3};

const C1: f32 = 0.5 - 2.0 / (3.0 * PI);
const C2: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// A diffuse base of a roughness, relative to Lambert's of the same colour.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    roughness: f32,
    /// Factor of single scattering, 1/(1 + C1 r).
    a: f32,
    /// Factor of (1 − E(ωo)) (1 − E(ωi)): multiple scattering over the colour.
    multiple: Spectrum,
    /// What [`Diffuse::value`] is divided by for each direction, where less than all light reaches the base.
    under: Packed,
}

impl Diffuse {
    pub fn new(roughness: f32, color: Spectrum) -> Self {
        let a = 1.0 / (1.0 + C1 * roughness);
        let average = a * (1.0 + C2 * roughness);
        let lost = (1.0 - average).max(1e-7);
        let multiple = color.map(|c| c * average / (1.0 - c * lost) / lost);
        Self {
            roughness,
            a,
            multiple,
            under: Packed::new(&[1.0; NODES]),
        }
    }

    /// Takes in what share `reaches` the base at a cosine: a rough base scatters grazing light on along the surface, where less of it
    /// comes out again, and Lambert's normalisation would lose it.
    pub fn below(mut self, reaches: impl Fn(f32) -> f32) -> Self {
        if self.roughness == 0.0 {
            return self;
        }
        let share: Curve = core::array::from_fn(|k| reaches(exits::mu_at(k)));
        let weights = exits::diffuse();
        let mean: f32 = share.iter().zip(weights).map(|(s, w)| s * w).sum();
        let exits: Exits = core::array::from_fn(|o| {
            let o = exits::mu_at(o);
            let row: Curve = core::array::from_fn(|k| weights[k] * self.around(o, exits::mu_at(k)));
            let sum: f32 = row.iter().sum();
            row.map(|v| v / sum)
        });
        let scale = 1.0 / mean.max(1e-4).sqrt();
        self.under = Packed::new(&exits::passage(&share, &exits).map(|b| (b * scale).max(1e-3)));
        self
    }

    /// The mean of π f over the azimuth, for a white base.
    fn around(&self, o: f32, i: f32) -> f32 {
        let sines = ((1.0 - o * o) * (1.0 - i * i)).max(0.0).sqrt();
        let s = sines / PI * (1.0 / o.max(i).max(1e-3) - 1.0);
        let once = self.a * (1.0 + self.roughness * s);
        let lost = 1.0 - self.a * (1.0 + C2 * self.roughness);
        once + (1.0 - self.once(o)) * (1.0 - self.once(i)) / lost.max(1e-7)
    }

    /// π f over the colour, for directions on one side.
    #[inline(always)]
    pub fn value(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if self.roughness == 0.0 {
            return Spectrum::ONE;
        }
        let (o, i) = (wo.z.abs().min(1.0), wi.z.abs().min(1.0));
        // Oren & Nayar's term in the form of Fujii (2013) for what is scattered once.
        let s = wo.x * wi.x + wo.y * wi.y;
        let s = if s > 0.0 { s / o.max(i).max(1e-6) } else { s };
        let once = self.a * (1.0 + self.roughness * s);
        let lost = (1.0 - self.once(o)) * (1.0 - self.once(i));
        let under = self.under.at(o) * self.under.at(i);
        self.multiple.map(|m| (once + m * lost) / under)
    }

    /// Albedo of single scattering at a cosine, for a white base.
    fn once(&self, mu: f32) -> f32 {
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        // G = sin (θ − sin cos) + 2/3 (tan (1 − sin³) − sin); the tangent's pole is none: 1 − sin³ goes with cos².
        let theta = mu.clamp(0.0, 1.0).acos();
        let tan = if mu > 1e-3 {
            sin / mu * (1.0 - sin * sin * sin)
        } else {
            1.5 * mu
        };
        let g = sin * (theta - sin * mu) + (tan - sin) * (2.0 / 3.0);
        self.a * (1.0 + self.roughness * g / PI)
    }
}
