//! Inside one voxel's cell.
//!
//! One brick may hold 10⁶ beside 10⁻⁶: null-collision tracking with one majorant for all of it would take as many steps as the
//! largest value asks for, on rays that meet the smallest only. Such bricks are walked voxel by voxel, with bounds for the ray
//! at hand: along a straight line the trilinear interpolant is a cubic polynomial, and its Bernstein coefficients bound it.
//! The interpolant f(x, y, z) is affine in each argument, so its blossom gives them at once; with entry a and exit b
//!
//! ```text
//! b0 = f(a,a,a)   b1 = (f(b,a,a) + f(a,b,a) + f(a,a,b))/3   b2 = (f(a,b,b) + f(b,a,b) + f(b,b,a))/3   b3 = f(b,b,b)
//! ```
//! (Farin 2002, "Curves and Surfaces for CAGD", §4.1 and 5.1.) Where even that leaves many steps, the stretch is halved until
//! it doesn't.

use crate::bounds::Bounds;
use crate::cursor::Cursor;
use crate::grid::trilinear;

/// Optical depth between the bounds of a stretch above which it is halved: as many null collisions are to be expected.
const MOST: f32 = 8.0;

/// A voxel's cell, from some point on.
#[derive(Clone, Copy)]
pub struct Fine {
    t: f32,
    /// Where the ray leaves the cell; not cut off by the ray's end, on which stretches and bounds must not depend: a shorter
    /// segment replays the beginning of a longer one.
    exit: f32,
    corners: [f32; 8],
    bounds: Bounds,
}

impl Fine {
    /// A cell which the ray passes from `t` to `exit`, with the values at its corners.
    pub fn new(t: f32, exit: f32, corners: [f32; 8]) -> Self {
        Self {
            t,
            exit,
            corners,
            bounds: Bounds::default(),
        }
    }

    /// The next stretch and its bounds along the ray; `None` at the end of the cell. `sigma` is the largest extinction per
    /// unit of the values; `vacuum` says whether stretches of nothing are wanted, for what else may be there.
    pub fn next(&mut self, ray: &Cursor, sigma: f32, vacuum: bool) -> Option<(f32, f32, Bounds)> {
        while self.t < self.exit && self.t < ray.t1 {
            let (start, mut end) = (self.t, self.exit);
            self.bounds = self.along(ray, start, end);
            while (self.bounds.max - self.bounds.min) * sigma * (end - start) > MOST {
                let middle = start + 0.5 * (end - start);
                if !(start < middle && middle < end) {
                    break;
                }
                end = middle;
                self.bounds = self.along(ray, start, end);
            }
            self.t = end;
            if self.bounds.max > 0.0 || vacuum {
                return Some((start, end.min(ray.t1), self.bounds));
            }
        }
        None
    }

    /// Bounds between two points.
    fn along(&self, ray: &Cursor, start: f32, end: f32) -> Bounds {
        let c = &self.corners;
        let (mut lo, mut hi) = (c[0], c[0]);
        for v in c {
            lo = lo.min(*v);
            hi = hi.max(*v);
        }
        if lo == hi {
            return Bounds { max: hi, min: lo };
        }
        let (a, b) = (ray.within(start).to_array(), ray.within(end).to_array());
        let f = |x, y, z| trilinear(c, [x, y, z]);
        let third = 1.0 / 3.0;
        let b = [
            f(a[0], a[1], a[2]),
            third * (f(b[0], a[1], a[2]) + f(a[0], b[1], a[2]) + f(a[0], a[1], b[2])),
            third * (f(a[0], b[1], b[2]) + f(b[0], a[1], b[2]) + f(b[0], b[1], a[2])),
            f(b[0], b[1], b[2]),
        ];
        let max = b[0].max(b[1]).max(b[2]).max(b[3]);
        let min = b[0].min(b[1]).min(b[2]).min(b[3]);
        // `third` and the interpolation round.
        let slack = if min == max { 0.0 } else { 4e-7 * max };
        Bounds {
            max: (max + slack).min(hi),
            min: (min - slack).max(lo),
        }
    }

    /// The interpolant at `t`, within the bounds given for it.
    #[inline]
    pub fn value(&self, ray: &Cursor, t: f32) -> f32 {
        let w = ray.within(t).to_array();
        trilinear(&self.corners, w).clamp(self.bounds.min, self.bounds.max)
    }
}
