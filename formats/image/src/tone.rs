//! From linear radiance to the 8 bits of a display.

/// Exposure and curve. Every channel on its own: v = encode(curve(2^exposure · x)), where `encode` is the
/// sRGB transfer function (IEC 61966-2-1), then rounded to 0 … 255.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ToneMap {
    /// In stops: each one doubles.
    pub exposure: f32,
    /// How large values are brought into the display's range.
    pub curve: Curve,
}

/// How large values are brought into the display's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Curve {
    /// min(x, 1): what is brighter than 1 is white.
    Srgb,
    /// x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), clipped to 1: Narkowicz's fit of the ACES filmic curve
    /// (2015), reaching white at x ≈ 7.2.
    #[default]
    Filmic,
}

impl Curve {
    /// All curves.
    pub const ALL: [Curve; 2] = [Curve::Srgb, Curve::Filmic];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Curve::Srgb => "srgb",
            Curve::Filmic => "filmic",
        }
    }

    fn apply(self, x: f32) -> f32 {
        match self {
            Curve::Srgb => x,
            // Far beyond white, where the squares would overflow to NaN.
            Curve::Filmic if x > 1e6 => 1.0,
            Curve::Filmic => x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14),
        }
    }
}

impl ToneMap {
    /// One channel of one pixel. Negative values and NaN are black.
    pub fn apply(&self, x: f32) -> u8 {
        let x = x * self.exposure.exp2();
        // NaN fails the comparison.
        if x > 0.0 {
            (srgb_encode(self.curve.apply(x).min(1.0)) * 255.0).round() as u8
        } else {
            0
        }
    }
}

/// The sRGB transfer function, for x in [0, 1].
fn srgb_encode(x: f32) -> f32 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_srgb_curve_has_its_known_values() {
        let tone = ToneMap {
            exposure: 0.0,
            curve: Curve::Srgb,
        };
        // 0.214 is the linear value of middle grey, 128/255.
        let known = [
            (0.0, 0),
            (0.0031308, 10),
            (0.214_04, 127),
            (0.215_86, 128),
            (1.0, 255),
            (7.0, 255),
        ];
        for (x, v) in known {
            assert_eq!(tone.apply(x), v, "{x}");
        }
        for byte in 0..=255u8 {
            // The inverse of the standard's decoding.
            let v = f32::from(byte) / 255.0;
            let x = if v <= 0.04045 {
                v / 12.92
            } else {
                ((v + 0.055) / 1.055).powf(2.4)
            };
            assert_eq!(tone.apply(x), byte);
        }
    }

    #[test]
    fn curves_rise_and_take_anything() {
        for curve in Curve::ALL {
            let tone = ToneMap {
                exposure: 0.0,
                curve,
            };
            let mut last = 0;
            for i in 0..2000 {
                let v = tone.apply(i as f32 * 0.005);
                assert!(v >= last);
                last = v;
            }
            assert_eq!(last, 255);
            for (x, v) in [
                (f32::NAN, 0),
                (-1.0, 0),
                (f32::NEG_INFINITY, 0),
                (f32::INFINITY, 255),
                (f32::MAX, 255),
            ] {
                assert_eq!(tone.apply(x), v, "{x}");
            }
        }
    }

    #[test]
    fn the_filmic_curve_has_the_values_of_its_formula() {
        // Worked out apart: 255 · encode(x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)).
        for (x, v) in [(0.01, 12), (0.18, 141), (1.0, 232), (3.0, 250)] {
            assert_eq!(ToneMap::default().apply(x), v, "{x}");
        }
        assert!(Curve::Filmic.apply(7.2) < 1.0 && Curve::Filmic.apply(7.3) > 1.0);
    }

    #[test]
    fn a_stop_doubles() {
        let tone = ToneMap {
            exposure: 1.0,
            curve: Curve::Srgb,
        };
        let plain = ToneMap {
            exposure: 0.0,
            curve: Curve::Srgb,
        };
        assert!((0..500).all(|i| tone.apply(i as f32 * 0.001) == plain.apply(i as f32 * 0.002)));
    }
}
