//! What the standard observer makes of wavelengths, in the renderer's colours: linear Rec. 709.

/// CIE 1931 colour matching functions in the fit of Wyman, Sloan & Shirley 2013, eq. 4, for a wavelength in nanometres.
pub fn matching(nm: f64) -> [f64; 3] {
    let lobe = |height: f64, middle: f64, below: f64, above: f64| {
        let t = (nm - middle) / if nm < middle { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    [
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7)
            - lobe(0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    ]
}

/// Linear Rec. 709 of CIE XYZ; below 0 for colours that are more saturated than its primaries.
pub fn rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266_0 * x + 1.876_010_8 * y + 0.041_556_0 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ]
}

/// Relative power of daylight D65, the white of Rec. 709, from 380 to 780 nm in steps of 10 nm (CIE 15).
const D65: [f64; 41] = [
    49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81,
    109.35, 107.80, 104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60,
    87.70, 83.29, 83.70, 80.03, 80.21, 82.28, 78.28, 69.72, 71.61, 74.35, 61.60, 69.89, 75.09,
    63.59, 46.42, 66.81, 63.38,
];

/// Relative power of daylight D65 at a wavelength from 380 to 780 nm, interpolated linearly.
pub fn daylight(nm: f64) -> f64 {
    let x = ((nm - 380.0) / 10.0).clamp(0.0, 40.0);
    let k = (x as usize).min(39);
    let f = x - k as f64;
    D65[k] * (1.0 - f) + D65[k + 1] * f
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Daylight is white: (1, 1, 1) to 1 % for the fit and steps of 5 nm.
    #[test]
    fn daylight_is_white() {
        let mut xyz = [0.0; 3];
        for i in 0..=80 {
            let nm = 380.0 + 5.0 * f64::from(i);
            for (sum, m) in xyz.iter_mut().zip(matching(nm)) {
                *sum += m * daylight(nm);
            }
        }
        let white = rgb(xyz.map(|v| v / xyz[1]));
        for v in white {
            assert!((v - 1.0).abs() < 0.01, "{white:?}");
        }
    }
}
