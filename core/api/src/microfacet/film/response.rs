//! How the colour lanes see fringes: the Fourier transform of their sensitivities.

use super::complex::Complex;
use crate::observer;
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Distance of the table's entries, nm: at the shortest wavelengths interpolation then loses (2π STEP/λ)²/8 = 10⁻³ of a fringe.
const STEP: f64 = 5.0;
/// The path difference where it ends, nm: beyond it no lane sees fringes of more than 1 % any more, and fewer the further.
pub const END: f32 = 16_000.0;
const ENTRIES: usize = (END as f64 / STEP) as usize + 1;
/// Wavelengths that are summed over, nm.
const WAVELENGTHS: std::ops::RangeInclusive<u32> = 380..=780;

/// Of the lanes red, green and blue.
pub type Colour<T> = [T; 3];

/// ŝ(D) = ∫ s(λ) e^{2πiD/λ} dλ for the sensitivities s to reflectances in the white of Rec. 709, which sum up to 1: daylight D65
/// times the colour matching functions of the primaries.
pub struct Response {
    rows: Vec<Colour<Complex>>,
    /// ∫ s(λ)/λ dλ, nm⁻¹.
    pub wave_number: Colour<f32>,
}

impl Response {
    /// The table, made when it is first asked for, in a few milliseconds.
    pub fn get() -> &'static Self {
        static RESPONSE: OnceLock<Response> = OnceLock::new();
        RESPONSE.get_or_init(Self::new)
    }

    fn new() -> Self {
        let (mut rows, mut wave_number) = (vec![[[0.0; 2]; 3]; ENTRIES], [0.0; 3]);
        let sensitivities: Vec<Colour<f64>> = WAVELENGTHS.map(sensitivity).collect();
        let sums = [0, 1, 2].map(|i| sensitivities.iter().map(|s| s[i]).sum::<f64>());
        for (nm, s) in WAVELENGTHS.zip(sensitivities) {
            let s = [0, 1, 2].map(|i| s[i] / sums[i]);
            let nm = f64::from(nm);
            let (sin, cos) = (TAU * STEP / nm).sin_cos();
            let mut phasor = [1.0, 0.0];
            for row in &mut rows {
                for (sum, s) in row.iter_mut().zip(s) {
                    sum[0] += s * phasor[0];
                    sum[1] += s * phasor[1];
                }
                let [x, y] = phasor;
                phasor = [x * cos - y * sin, x * sin + y * cos];
            }
            wave_number = [0, 1, 2].map(|i| wave_number[i] + s[i] / nm);
        }
        let single = |[re, im]: [f64; 2]| Complex::new(re as f32, im as f32);
        Self {
            rows: rows.iter().map(|row| row.map(single)).collect(),
            wave_number: wave_number.map(|v| v as f32),
        }
    }

    /// The value at a path difference from 0 to [`END`], nm.
    #[inline(always)]
    pub fn at(&self, path: f32) -> Colour<Complex> {
        let x = path.max(0.0) * (1.0 / STEP as f32);
        let k = (x as usize).min(ENTRIES - 2);
        let f = x - k as f32;
        let (a, b) = (&self.rows[k], &self.rows[k + 1]);
        [0, 1, 2].map(|i| a[i] * (1.0 - f) + b[i] * f)
    }
}

fn sensitivity(nm: u32) -> Colour<f64> {
    let nm = f64::from(nm);
    observer::rgb(observer::matching(nm)).map(|s| s * observer::daylight(nm))
}
