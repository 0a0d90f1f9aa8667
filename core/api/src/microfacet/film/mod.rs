//! Thin films: what one transparent layer, as thin as waves of light are long, makes of the reflectance below it.
//!
//! With amplitudes r₁₂ of the film's upper face and r₂₃ of its lower one, what goes to and fro between them adds up to Airy's sum,
//! of which each polarisation has its own (Born & Wolf, §7.6 and §14.4):
//!
//!   R(λ) = |(r₁₂ + r₂₃ e^{iδ})/(1 + r₁₂ r₂₃ e^{iδ})|²,   δ = 2πD/λ,   D = 2 n d cos θ₂
//!        = 1 − K (1 + 2 Σₘ Re(zᵐ e^{imδ})),   z = −r₁₂ r₂₃,   K = (1 − |r₁₂|²)(1 − |r₂₃|²)/(1 − |z|²).
//!
//! The last line is Poisson's kernel. A lane that sees wavelengths with the sensitivity s sees e^{imδ} as ŝ(mD), s's Fourier transform:
//! the idea of Belcour & Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", with
//! transforms of the sensitivities themselves in place of Gaussians.
//!
//! What lies below is known by the reflectance it has without the film, R₁₃, which may be any curve that an artist likes, and the phase that its
//! index gives it: r₂₃ = (r₁₃ − r₁₂)/(1 − r₁₂ r₁₃) is what a film of no thickness would need for that. So whatever the curve, the
//! film's reflectance goes to it where the film becomes thin or its index that of the surroundings, and no wavelength ever gains.

mod complex;
mod response;
#[cfg(test)]
mod tests;

use super::fresnel;
use crate::spectrum::Spectrum;
use complex::Amplitude;
pub use complex::Complex;
use response::{Colour, END, Response};

/// Terms of the sum that are added one by one.
const TERMS: usize = 12;
/// What the terms that are left out may come to.
const NEGLIGIBLE: f32 = 5e-5;

/// Amplitudes of one boundary for light polarised across the plane of incidence, and in it: (Y₁ − Y₂)/(Y₁ + Y₂) with the admittances
/// Y = n cos θ and n/cos θ.
type Amplitudes<A> = [A; 2];

/// What adds up to the reflectance of one lane and polarisation.
#[derive(Clone, Copy)]
struct Series<A> {
    z: A,
    /// K.
    k: f32,
    /// 1 − K, the mean over all phases.
    mean: f32,
}

impl<A: Amplitude> Series<A> {
    /// Everything is reflected.
    const TOTAL: Self = Self {
        z: A::ZERO,
        k: 0.0,
        mean: 1.0,
    };
}

/// A film as the light outside meets it.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    /// Its index over that of what is outside.
    eta: f32,
    /// Optical path there and back along the normal, 2 n d, nm.
    path: f32,
    /// How much of the surface it covers.
    weight: f32,
}

impl Film {
    /// From the share of the surface that it covers, its thickness in nanometres, its index and that outside.
    pub fn new(weight: f32, thickness: f32, ior: f32, outside: f32) -> Self {
        let path = 2.0 * ior * thickness;
        Self {
            eta: ior / outside,
            path: if path > 0.0 { path } else { 0.0 },
            weight,
        }
    }

    /// Reflectance over a dielectric of an index `eta` against the outside, for light from outside at cosine `cos` ≥ 0.
    #[inline]
    pub fn dielectric(&self, cos: f32, eta: f32) -> Spectrum {
        let cos = cos.clamp(0.0, 1.0);
        let Some(bare) = real_amplitudes(cos, eta) else {
            return Spectrum::ONE;
        };
        let without = 0.5 * (bare[0].norm() + bare[1].norm());
        self.blend(cos, Spectrum::splat(without), [bare; 3])
    }

    /// The same over what has the reflectance `bare` at this cosine without the film, and is else like a dielectric of index `eta`.
    #[inline]
    pub fn plastic(&self, cos: f32, bare: Spectrum, eta: f32) -> Spectrum {
        let cos = cos.clamp(0.0, 1.0);
        let Some(r13) = real_amplitudes(cos, eta) else {
            return Spectrum::ONE;
        };
        self.blend(cos, bare, [0, 1, 2].map(|i| scaled(r13, bare[i])))
    }

    /// The same over a metal: with the phases that the square of its complex index against the outside has, one for each colour.
    #[inline]
    pub fn metal(&self, cos: f32, bare: Spectrum, square: Colour<Complex>) -> Spectrum {
        let cos = cos.clamp(0.0, 1.0);
        let r13 = [0, 1, 2].map(|i| scaled(amplitudes(cos, square[i]), bare[i]));
        self.blend(cos, bare, r13)
    }

    /// Mean for diffuse light of what a function of the cosine gives, 2 ∫ f(μ) μ dμ.
    pub fn average(f: impl Fn(f32) -> Spectrum) -> Spectrum {
        const N: u32 = 8;
        let mut sum = Spectrum::ZERO;
        for i in 0..N {
            sum += f(((i as f32 + 0.5) / N as f32).sqrt());
        }
        sum * (1.0 / N as f32)
    }

    #[inline(always)]
    fn blend<A: Amplitude>(
        &self,
        cos: f32,
        bare: Spectrum,
        r13: Colour<Amplitudes<A>>,
    ) -> Spectrum {
        if self.path == 0.0 {
            return bare;
        }
        let [r, g, b] = self.interfere(cos, &r13);
        let under = Spectrum([r, g, b, bare[3]]);
        bare + (under - bare) * self.weight
    }

    /// The lanes' reflectances, from the amplitudes without the film.
    #[inline(always)]
    fn interfere<A: Amplitude>(&self, c: f32, r13: &Colour<Amplitudes<A>>) -> Colour<f32> {
        let eta = self.eta;
        // cos² θ₂, written so that nothing cancels, as in `fresnel::dielectric`.
        let squared = ((eta - 1.0) * (eta + 1.0) + c * c) / (eta * eta);
        if !(squared > 0.0) {
            let r13 = r13.map(|r| r.map(A::complex));
            return self.evanesce(c, (-squared).max(0.0).sqrt(), &r13);
        }
        let c2 = squared.sqrt().min(1.0);
        let sums = [c + eta * c2, c2 + eta * c];
        let r12 = [(c - eta * c2) / sums[0], (c2 - eta * c) / sums[1]];
        // 1 − r₁₂².
        let enters = sums.map(|s| 4.0 * eta * c * c2 / (s * s));
        let mut all = [[Series::TOTAL; 2]; 3];
        let (mut longest, mut strongest) = (0f32, 0f32);
        for i in 0..3 {
            for p in 0..2 {
                let r = r13[i][p];
                let undone = A::real(1.0) - r * r12[p];
                let r23 = (r - A::real(r12[p])).over(undone);
                // 1 − |r₂₃|² and 1 − |z|².
                let passes = enters[p] * (1.0 - r.norm()).max(0.0) / undone.norm().max(1e-20);
                let open = enters[p] + (1.0 - enters[p]) * passes;
                if open < 1e-12 {
                    continue;
                }
                let (z, k) = (r23 * -r12[p], enters[p] * passes / open);
                // Where little is reflected this keeps its digits.
                let mean = (r12[p] * r12[p] * passes + r23.norm() * enters[p]) / open;
                all[i][p] = Series { z, k, mean };
                longest = longest.max(z.norm());
                strongest = strongest.max(k);
            }
        }
        self.sum(self.path * c2, &all, strongest, longest.min(1.0).sqrt())
    }

    /// 1 − K − 2K Σ Re(zᵐ ŝ(mD)), the mean of both polarisations. None of the z is longer than `longest`, no K larger than `strongest`.
    #[inline(always)]
    fn sum<A: Amplitude>(
        &self,
        path: f32,
        all: &Colour<[Series<A>; 2]>,
        strongest: f32,
        longest: f32,
    ) -> Colour<f32> {
        let response = Response::get();
        let mut powers = all.map(|s| s.map(|s| s.z));
        let mut sums = [[0f32; 2]; 3];
        let mut bound = 2.0 * strongest * longest / (1.0 - longest).max(1e-6);
        let mut first = None;
        for m in 1..=TERMS {
            let d = path * m as f32;
            if d >= END || bound < NEGLIGIBLE {
                break;
            }
            bound *= longest;
            let seen = response.at(d);
            let first = *first.get_or_insert(seen);
            for i in 0..3 {
                for p in 0..2 {
                    let z = all[i][p].z;
                    sums[i][p] += powers[i][p].real_of(seen[i]);
                    if m == TERMS {
                        // The rest as if lanes saw one wavelength each, which is what they do where films are so thin that it matters.
                        let term = powers[i][p].complex() * seen[i];
                        let next = z.complex() * within(first[i]);
                        sums[i][p] += (term * next).over(Complex::ONE - next).re;
                    }
                    powers[i][p] = powers[i][p] * z;
                }
            }
        }
        [0, 1, 2].map(|i| {
            let of = |p: usize| all[i][p].mean - 2.0 * all[i][p].k * sums[i][p];
            // Sensitivities are negative where a colour is more saturated than the lanes' own.
            (0.5 * (of(0) + of(1))).clamp(0.0, 1.0)
        })
    }

    /// Total reflection at the film's upper face: waves that fade, to cos θ₂ = i·`kappa`, reach its lower one if it is near. They do not
    /// oscillate, and one wavelength stands for all that a lane sees.
    #[cold]
    fn evanesce(&self, c: f32, kappa: f32, r13: &Colour<Amplitudes<Complex>>) -> Colour<f32> {
        let wave_number = Response::get().wave_number;
        let y = self.eta * kappa;
        let r12 = [
            Complex::new(c, -y).over(Complex::new(c, y)),
            Complex::new(-self.eta * c, kappa).over(Complex::new(self.eta * c, kappa)),
        ];
        [0, 1, 2].map(|i| {
            let fades = (-core::f32::consts::TAU * self.path * kappa * wave_number[i]).exp();
            let of = |p: usize| {
                let r = r13[i][p];
                let r23 = (r - r12[p]).over(Complex::ONE - r12[p] * r) * fades;
                (r12[p] + r23).over(Complex::ONE + r12[p] * r23).norm()
            };
            (0.5 * (of(0) + of(1))).clamp(0.0, 1.0)
        })
    }
}

/// Not longer than 1.
#[inline(always)]
fn within(z: Complex) -> Complex {
    let norm = z.norm();
    if norm > 1.0 {
        z * (1.0 / norm.sqrt())
    } else {
        z
    }
}

/// Amplitudes without a film, from the square of the index.
#[inline(always)]
fn amplitudes(c: f32, square: Complex) -> Amplitudes<Complex> {
    let s2 = (1.0 - c) * (1.0 + c);
    // n cos θ inside.
    let y = Complex::new(square.re - s2, square.im).sqrt();
    let c1 = Complex::new(c, 0.0);
    let inside = square * c;
    [(c1 - y).over(c1 + y), (y - inside).over(y + inside)]
}

/// The same of a dielectric; `None` if all is reflected.
#[inline(always)]
fn real_amplitudes(c: f32, eta: f32) -> Option<Amplitudes<f32>> {
    // n² cos² θ inside, as in `fresnel::dielectric`.
    let squared = (eta - 1.0) * (eta + 1.0) + c * c;
    if !(squared > 0.0) {
        return None;
    }
    let (y, inside) = (squared.sqrt(), eta * eta * c);
    Some([(c - y) / (c + y), (y - inside) / (y + inside)])
}

/// The amplitudes with which both polarisations together reflect `bare`, in proportion as far as neither gains.
#[inline(always)]
fn scaled<A: Amplitude>(r: Amplitudes<A>, bare: f32) -> Amplitudes<A> {
    let [s, p] = r.map(A::norm);
    let gain = 2.0 * bare / (s + p).max(1e-12);
    let across = (gain * s).min(1.0);
    let along = (2.0 * bare - across).clamp(0.0, 1.0);
    let stretch = |r: A, from: f32, to: f32| {
        if from > 0.0 {
            r * (to / from).sqrt()
        } else {
            A::real(to.sqrt())
        }
    };
    [stretch(r[0], s, across), stretch(r[1], p, along)]
}

/// Reflectance at normal incidence beyond which a film shows nothing.
const BRIGHTEST: f32 = 0.9999;

/// k of a metal that reflects `f0` at normal incidence, `n` being the real part of its index: k² = (f₀ (n + 1)² − (n − 1)²)/(1 − f₀)
/// (Gulbrandsen 2014, "Artist Friendly Metallic Fresnel", eq. 6).
#[inline(always)]
fn extinction(f0: f32, n: f32) -> f32 {
    let (more, less) = (n + 1.0, n - 1.0);
    ((f0 * more * more - less * less) / (1.0 - f0))
        .max(0.0)
        .sqrt()
}

/// (n + ik)² of a metal.
#[inline(always)]
pub fn square(n: f32, k: f32) -> Complex {
    Complex::new((n - k) * (n + k), 2.0 * n * k)
}

/// [`square`] of a metal that reflects `f0` at normal incidence.
#[inline(always)]
pub fn square_of(f0: f32, n: f32) -> Complex {
    square(n, extinction(f0.clamp(0.0, BRIGHTEST), n))
}

/// The real part of the index of a metal that reflects `f0` at normal incidence and `f82` at cos θ = 1/7. The two say what it is, since
/// the latter falls as n grows; for what no metal reflects it is that of the nearest one.
pub fn index(f0: f32, f82: f32) -> f32 {
    let f0 = f0.clamp(0.0, BRIGHTEST);
    let root = f0.sqrt();
    let (mut low, mut high) = ((1.0 - f0) / (1.0 + f0), (1.0 + root) / (1.0 - root));
    for _ in 0..16 {
        let n = (low * high).sqrt();
        if fresnel::conductor(1.0 / 7.0, n, extinction(f0, n)) > f82 {
            low = n;
        } else {
            high = n;
        }
    }
    (low * high).sqrt()
}
