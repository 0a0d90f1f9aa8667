//! Numbers in fixed point, whose sums do not depend on the order of addition.

/// Fractional bits of sums.
const FRACTION: i32 = 64;
/// Largest magnitude a single value may have; beyond, it is rejected like an infinity. Leaves room for [`MOST_SAMPLES`].
const LARGEST: f32 = 1e12;
/// Samples that a pixel's sums have room for. All samples come before the one of this number.
pub const MOST_SAMPLES: u32 = 1 << 23;

/// What is said of values that can't be added, after them.
pub const UNFIT: &str = "which is not finite or more than a film can hold";

/// True if a value can be added: it is finite, and not beyond [`LARGEST`].
#[inline(always)]
pub fn fits(v: f32) -> bool {
    v.abs() <= LARGEST
}

/// Rounds to the nearest number in fixed point, halves away from zero: what is cut off has no bias. The value must be one that
/// [`fits`].
#[inline(always)]
pub fn fix(v: f32) -> i128 {
    let bits = v.to_bits();
    let exponent = (bits >> 23 & 0xff) as i32;
    let mantissa = if exponent == 0 {
        0
    } else {
        bits & 0x7f_ffff | 0x80_0000
    };
    let shift = exponent - 150 + FRACTION;
    let magnitude = if shift >= 0 {
        i128::from(mantissa) << shift
    } else {
        let cut = (-shift).min(63);
        i128::from((u64::from(mantissa) + (1 << (cut - 1))) >> cut)
    };
    if bits >> 31 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// Back to floating point.
pub fn float(v: i128) -> f64 {
    v as f64 * (0.5f64).powi(FRACTION)
}

/// Adds `b` to `a`, lane by lane. Sums of what a renderer adds never wrap; those that a damaged file holds may.
#[inline(always)]
pub fn add(a: &mut [i128; 3], b: [i128; 3]) {
    for lane in 0..3 {
        a[lane] = a[lane].wrapping_add(b[lane]);
    }
}

/// A sum of squares: 192 bits, low ones first, 88 of them fractional. Squares have twice the range of values: this has room for
/// radiances up to [`LARGEST`]; for what is below, see [`is_faint`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Squares(pub [u64; 3]);

/// Fractional bits of sums of squares.
const SQUARES: i32 = 88;

/// True if a mean is so small that [`Squares`] cannot tell its variance.
///
/// The square of each net is cut off by up to 2⁻⁸⁸, so the variance of a mean of N samples is too low by up to 2·2⁻⁸⁸/N, that is by up
/// to (1.4·10⁻¹⁴)² with two nets of 16. Errors are relative to a tenth of the mean or more (see [`super::Errors`]): here, that is 0.14 %.
pub fn is_faint(mean: f64) -> bool {
    const FAINT: f64 = 1e-10;
    mean != 0.0 && mean.abs() < FAINT
}

impl Squares {
    /// A non-negative number, rounded toward zero. What does not fit becomes the largest number that does.
    pub fn new(v: f64) -> Self {
        let bits = v.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i32;
        let shift = exponent - 1075 + SQUARES;
        if !(v > 0.0) || exponent == 0 || shift <= -64 {
            return Self::default();
        }
        let mantissa = u128::from(bits & ((1 << 52) - 1) | 1 << 52);
        if shift < 0 {
            return Self([(mantissa >> -shift) as u64, 0, 0]);
        }
        let (limb, wide) = (shift as usize / 64, mantissa << (shift % 64));
        let mut out = [0; 3];
        if limb >= 3 || (limb == 2 && wide >> 64 != 0) {
            return Self([u64::MAX; 3]);
        }
        out[limb] = wide as u64;
        if limb < 2 {
            out[limb + 1] = (wide >> 64) as u64;
        }
        Self(out)
    }

    /// The square of a batch's sum over the number of its samples.
    pub fn of(sum: f64, samples: f64) -> Self {
        Self::new(sum * sum / samples)
    }

    /// Adds another sum.
    pub fn add(&mut self, o: Self) {
        let mut carry = false;
        for (a, b) in self.0.iter_mut().zip(o.0) {
            let (v, one) = a.overflowing_add(b);
            let (v, two) = v.overflowing_add(u64::from(carry));
            (*a, carry) = (v, one || two);
        }
    }

    /// Takes back what was added.
    pub fn subtract(&mut self, o: Self) {
        let mut borrow = false;
        for (a, b) in self.0.iter_mut().zip(o.0) {
            let (v, one) = a.overflowing_sub(b);
            let (v, two) = v.overflowing_sub(u64::from(borrow));
            (*a, borrow) = (v, one || two);
        }
    }

    /// Back to floating point.
    pub fn float(self) -> f64 {
        let [a, b, c] = self.0.map(|v| v as f64);
        let scale = |bits: i32| (2f64).powi(bits - SQUARES);
        c * scale(128) + b * scale(64) + a * scale(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    #[test]
    fn fixed_point_is_exact_for_ordinary_values() {
        for v in [0.0f32, 1.0, -0.1, 3.25e11, 1e-9, f32::MIN_POSITIVE] {
            let back = float(fix(v));
            assert!(
                (back - f64::from(v)).abs() <= 0.5f64.powi(FRACTION + 1),
                "{v} {back}"
            );
        }
    }

    /// A mean of numbers of a few last places is what it is without fixed point.
    #[test]
    fn rounding_has_no_bias() {
        let last = 0.5f32.powi(FRACTION);
        for (k, v) in [
            (0, 0.49),
            (1, 0.5),
            (1, 1.49),
            (2, 1.5),
            (1 << 24, 16777216.0),
        ] {
            assert_eq!(fix(v * last), k);
            assert_eq!(fix(-v * last), -k);
        }
        let mut s = Stream::new(2);
        let (mut sum, mut truth) = (0, 0.0);
        for _ in 0..100_000 {
            let v = 4.0 * last * s.uniform();
            sum += fix(v);
            truth += f64::from(v);
        }
        // Rounding has a standard error of 0.00046.
        assert!(
            (float(sum) / truth - 1.0).abs() < 0.002,
            "{}",
            float(sum) / truth
        );
    }

    #[test]
    fn squares_have_their_range() {
        for v in [0.0, 1.0, 3.7e-20, 1.23456789e28, 1e-26, 0.1, 1e5] {
            let back = Squares::new(v).float();
            assert!((back - v).abs() <= 1e-15 * v + 4e-27, "{v} {back}");
        }
        assert_eq!(Squares::new(f64::INFINITY), Squares([u64::MAX; 3]));
        assert_eq!(Squares::new(f64::NAN), Squares::default());
        assert_eq!(Squares::new(-1.0), Squares::default());
    }

    /// Any order gives the same sum, and taking back undoes adding.
    #[test]
    fn squares_commute() {
        let mut s = Stream::new(9);
        let values: Vec<Squares> = (0..1000)
            .map(|_| Squares::new((f64::from(s.uniform()) * 150.0 - 60.0).exp()))
            .collect();
        let (mut there, mut back) = (Squares::default(), Squares::default());
        values.iter().for_each(|v| there.add(*v));
        values.iter().rev().for_each(|v| back.add(*v));
        assert_eq!(there, back);
        assert!(there.0[1] > 0);
        values.iter().for_each(|v| there.subtract(*v));
        assert_eq!(there, Squares::default());
    }
}
