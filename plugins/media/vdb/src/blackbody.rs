//! Colour and strength of black bodies.
//!
//! Radiance of a black body of temperature T, seen by the CIE 1931 observer and expressed in linear sRGB primaries:
//! X = ∫ B_λ(T) x̄(λ) dλ and likewise Y, Z in W·sr⁻¹·m⁻², absolute, with B_λ Planck's law and x̄, ȳ, z̄ the multi-lobe fits
//! of Wyman, Sloan & Shirley 2013 ("Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2),
//! listing 1). Luminance in cd·m⁻² is 683 · Y. Components outside the gamut (blue below about 1900 K) become 0.

/// Temperatures below emit nothing that could be seen: at 400 K, Y is 10⁻¹⁷ of its value at 2000 K.
pub const COLDEST: f32 = 400.0;
const HOTTEST: f64 = 40_000.0;
const STEPS: usize = 2048;
/// Logarithm that stands for zero.
const NOTHING: f32 = -100.0;

/// Linear sRGB by temperature. Logarithms over 1/T are nearly straight lines (Wien's law), so few entries suffice.
pub struct Blackbody {
    table: Vec<[f32; 3]>,
}

impl Default for Blackbody {
    fn default() -> Self {
        let observed: Vec<_> = (360..=830).map(|nm| observer(f64::from(nm))).collect();
        let table = (0..=STEPS)
            .map(|i| {
                let inverse =
                    inverse(0.0) + (inverse(1.0) - inverse(0.0)) * i as f64 / STEPS as f64;
                rgb(1.0 / inverse, &observed)
                    .map(|v| if v > 1e-40 { v.ln() as f32 } else { NOTHING })
            })
            .collect();
        Self { table }
    }
}

/// 1/T from hot (0) to cold (1).
fn inverse(x: f64) -> f64 {
    let (hot, cold) = (1.0 / HOTTEST, 1.0 / f64::from(COLDEST));
    hot + x * (cold - hot)
}

impl Blackbody {
    /// Radiance in W·sr⁻¹·m⁻² at a temperature in kelvin; above 40 000 K it grows in proportion to T.
    pub fn radiance(&self, kelvin: f32) -> [f32; 3] {
        if !(kelvin >= COLDEST) {
            return [0.0; 3];
        }
        let hottest = HOTTEST as f32;
        let (hot, cold) = (1.0 / hottest, 1.0 / COLDEST);
        let x = (1.0 / kelvin.min(hottest) - hot) / (cold - hot) * STEPS as f32;
        let i = (x as usize).min(STEPS - 1);
        let w = x - i as f32;
        let beyond = (kelvin / hottest).max(1.0);
        [0, 1, 2].map(|c| {
            let (a, b) = (self.table[i][c], self.table[i + 1][c]);
            if a.min(b) <= NOTHING {
                0.0
            } else {
                beyond * (a + w * (b - a)).exp()
            }
        })
    }
}

/// Linear sRGB of a black body by integration from 360 to 830 nm, for the observer at these wavelengths.
fn rgb(kelvin: f64, observed: &[[f64; 3]]) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for (nm, matching) in (360..).zip(observed) {
        let b = planck(f64::from(nm), kelvin) * 1e-9;
        for c in 0..3 {
            xyz[c] += matching[c] * b;
        }
    }
    let [x, y, z] = xyz;
    // IEC 61966-2-1.
    [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ]
    .map(|v| v.max(0.0))
}

/// Spectral radiance in W·sr⁻¹·m⁻³ (per metre of wavelength).
fn planck(nm: f64, kelvin: f64) -> f64 {
    // 2hc² and hc/k of the SI (2019).
    let (c1, c2) = (1.191_042_972e-16, 1.438_776_877e-2);
    let l = nm * 1e-9;
    c1 / (l.powi(5) * (c2 / (l * kelvin)).exp_m1())
}

fn observer(nm: f64) -> [f64; 3] {
    let lobe = |peak: f64, below: f64, above: f64| {
        let t = (nm - peak) * if nm < peak { below } else { above };
        (-0.5 * t * t).exp()
    };
    [
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323)
            - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_of_the_old_candela() {
        // The candela was once 1/60 of the luminous intensity of 1 cm² of a black body at freezing platinum, 2041.4 K:
        // 60 cd/cm², so Y = 6·10⁵/683.
        let [r, g, b] = Blackbody::default().radiance(2041.4);
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        assert!((y / (6e5 / 683.0) - 1.0).abs() < 0.02, "{y}");
    }

    #[test]
    fn table_follows_the_integral() {
        let table = Blackbody::default();
        let observed: Vec<_> = (360..=830).map(|nm| observer(f64::from(nm))).collect();
        for kelvin in [401.0, 777.7, 1500.0, 2856.0, 6504.0, 25_000.0] {
            let (exact, got) = (rgb(kelvin, &observed), table.radiance(kelvin as f32));
            for c in 0..3 {
                let error = (f64::from(got[c]) - exact[c]).abs();
                assert!(
                    error <= 3e-4 * exact[c].max(1e-30),
                    "{kelvin} K: {got:?} {exact:?}"
                );
            }
        }
    }

    #[test]
    fn white_near_6504_kelvin() {
        // A little pinker than D65: the Planckian locus passes below it.
        let [r, g, b] = Blackbody::default().radiance(6504.0);
        assert!(
            (r / g - 1.05).abs() < 0.03 && (b / g - 1.05).abs() < 0.03,
            "{r} {g} {b}"
        );
        assert_eq!(Blackbody::default().radiance(300.0), [0.0; 3]);
        assert_eq!(Blackbody::default().radiance(f32::NAN), [0.0; 3]);
    }
}
