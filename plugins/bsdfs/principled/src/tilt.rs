//! The normal of a coat, packed into what is left of a closure.

use resolvent_api::Vec3;
use resolvent_api::math::Frame;

/// A unit vector with z > 0 by its x and y in units of 1/32767, or none: 4 bytes, so that a closure still fits into a mask's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tilt([i16; 2]);

const UNIT: f32 = 32767.0;
/// Longest x and y: normals from 88.6° on lean as much.
const LONGEST: f32 = 0.9997;

impl Tilt {
    /// No normal.
    pub const NONE: Self = Self([i16::MIN; 2]);

    /// The nearest to a unit vector.
    pub fn new(n: Vec3) -> Self {
        let across = n.truncate();
        let across = if n.z > 0.0 {
            across
        } else {
            across.normalize_or_zero()
        };
        let across = across.clamp_length_max(LONGEST);
        Self([across.x, across.y].map(|c| (c * UNIT).round() as i16))
    }

    /// True if there is a normal.
    #[inline(always)]
    pub fn is_some(self) -> bool {
        self != Self::NONE
    }

    /// A frame around the normal.
    #[inline(always)]
    fn frame(self) -> Frame {
        let [x, y] = self.0.map(|c| f32::from(c) * (1.0 / UNIT));
        Frame::around(Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()))
    }

    /// From the shading frame to one around the normal; unchanged without.
    #[inline(always)]
    pub fn enter(self, w: Vec3) -> Vec3 {
        if self.is_some() {
            self.frame().to_local(w)
        } else {
            w
        }
    }

    /// Back to the shading frame.
    #[inline(always)]
    pub fn leave(self, w: Vec3) -> Vec3 {
        if self.is_some() {
            self.frame().to_world(w)
        } else {
            w
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_kept() {
        for n in [
            Vec3::Z,
            Vec3::new(0.6, 0.0, 0.8),
            Vec3::new(-0.48, 0.64, 0.6),
            Vec3::new(0.1, -0.99, 0.1).normalize(),
        ] {
            let t = Tilt::new(n);
            assert!((t.leave(Vec3::Z) - n).length() < 2e-4, "{n}");
            let w = Vec3::new(0.36, -0.48, 0.8);
            assert!((t.leave(t.enter(w)) - w).length() < 1e-6);
            assert!((t.enter(w).z - n.dot(w)).abs() < 2e-4);
        }
        assert_eq!(Tilt::new(Vec3::Z).leave(Vec3::Z), Vec3::Z);
        assert_eq!(Tilt::NONE.enter(Vec3::X), Vec3::X);
        // What points below is lifted to just above.
        let lifted = Tilt::new(Vec3::new(0.8, 0.0, -0.6)).leave(Vec3::Z);
        assert!(lifted.x > 0.99 && lifted.z > 0.0);
    }
}
