//! Complex numbers, as far as amplitudes need them.

use core::ops::{Add, Mul, Sub};

/// What amplitudes are: complex, or real where all that meets is transparent, which takes a third of the time.
pub trait Amplitude:
    Copy + Sub<Output = Self> + Mul<Output = Self> + Mul<f32, Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// A real number.
    fn real(v: f32) -> Self;
    /// |z|².
    fn norm(self) -> f32;
    /// The quotient; 0 if the divisor is.
    fn over(self, d: Self) -> Self;
    /// As a complex number.
    fn complex(self) -> Complex;
    /// Real part of the product.
    fn real_of(self, o: Complex) -> f32;
}

impl Amplitude for f32 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn real(v: f32) -> Self {
        v
    }

    #[inline(always)]
    fn norm(self) -> f32 {
        self * self
    }

    #[inline(always)]
    fn over(self, d: Self) -> Self {
        if d == 0.0 { 0.0 } else { self / d }
    }

    #[inline(always)]
    fn complex(self) -> Complex {
        Complex::new(self, 0.0)
    }

    #[inline(always)]
    fn real_of(self, o: Complex) -> f32 {
        self * o.re
    }
}

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex {
    /// Real part.
    pub re: f32,
    /// Imaginary part.
    pub im: f32,
}

impl Complex {
    /// 1.
    pub const ONE: Self = Self::new(1.0, 0.0);

    /// From its parts.
    #[inline(always)]
    pub const fn new(re: f32, im: f32) -> Self {
        Self { re, im }
    }

    /// The root with parts ≥ 0, of a number whose imaginary part is.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        let modulus = self.norm().sqrt();
        let half = |v: f32| (0.5 * v.max(0.0)).sqrt();
        // Of the two parts the larger one is exact, the other follows from it.
        if self.re >= 0.0 {
            let re = half(modulus + self.re);
            let im = if re > 0.0 { 0.5 * self.im / re } else { 0.0 };
            Self::new(re, im)
        } else {
            let im = half(modulus - self.re);
            Self::new(0.5 * self.im / im, im)
        }
    }
}

impl Amplitude for Complex {
    const ZERO: Self = Self::new(0.0, 0.0);

    #[inline(always)]
    fn real(v: f32) -> Self {
        Self::new(v, 0.0)
    }

    #[inline(always)]
    fn norm(self) -> f32 {
        self.re * self.re + self.im * self.im
    }

    #[inline(always)]
    fn over(self, d: Self) -> Self {
        let norm = d.norm();
        if norm == 0.0 {
            return Self::default();
        }
        self * Self::new(d.re, -d.im) * (1.0 / norm)
    }

    #[inline(always)]
    fn complex(self) -> Complex {
        self
    }

    #[inline(always)]
    fn real_of(self, o: Complex) -> f32 {
        self.re * o.re - self.im * o.im
    }
}

impl Add for Complex {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.re + o.re, self.im + o.im)
    }
}

impl Sub for Complex {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.re - o.re, self.im - o.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self::new(
            self.re * o.re - self.im * o.im,
            self.re * o.im + self.im * o.re,
        )
    }
}

impl Mul<f32> for Complex {
    type Output = Self;
    #[inline(always)]
    fn mul(self, f: f32) -> Self {
        Self::new(self.re * f, self.im * f)
    }
}
