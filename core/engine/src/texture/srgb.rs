//! The transfer curve of sRGB (IEC 61966-2-1): from encoded values to linear ones.

use std::sync::OnceLock;

/// Encoded value to linear one. Beyond [0, 1], where the standard is silent, the curve goes on and is odd.
pub fn linear(encoded: f64) -> f64 {
    let e = encoded.abs();
    let linear = if e <= 0.040_45 {
        e / 12.92
    } else {
        ((e + 0.055) / 1.055).powf(2.4)
    };
    linear.copysign(encoded)
}

/// The linear value of each encoded one of 8 bits.
pub fn table8() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| {
        (0..256)
            .map(|i| linear(f64::from(i) / 255.0) as f32)
            .collect()
    })
}

/// The linear value of each encoded one of 16 bits.
pub fn table16() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| {
        (0..65536)
            .map(|i| linear(f64::from(i) / 65535.0) as f32)
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_the_standards() {
        // Ends, the joint of the two pieces, and values of IEC 61966-2-1 as others tabulate them (8 bits 128 and 188).
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        assert!((linear(0.040_45) - 0.003_130_8).abs() < 1e-7);
        for (code, expected) in [(1, 0.000_303_527), (128, 0.215_860_5), (188, 0.502_886_5)] {
            assert!(
                (f64::from(table8()[code]) - expected).abs() < 1e-7,
                "{code}"
            );
        }
        for i in 0..256 {
            assert_eq!(table8()[i], table16()[i * 257]);
        }
        assert_eq!(linear(-0.5), -linear(0.5));
        assert!(table16().windows(2).all(|w| w[0] < w[1]));
    }
}
