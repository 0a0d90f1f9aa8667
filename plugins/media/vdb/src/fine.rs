//! Voxel by voxel through a rough brick.
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
use crate::grid::{Grid, trilinear};
use crate::voxel::{EDGE, Voxel};

/// Optical depth between the bounds of a stretch above which it is halved: as many null collisions are to be expected.
const MOST: f32 = 8.0;

/// State inside one rough brick.
#[derive(Clone, Copy)]
pub struct Fine {
    /// Next voxel, relative to the brick; all in 0..8 until the brick is done.
    next: [i32; 3],
    t: f32,
    t1: f32,
    /// Current voxel.
    voxel: [i32; 3],
    /// Where the ray leaves it.
    end: f32,
    corners: [f32; 8],
    bounds: Bounds,
}

impl Fine {
    /// Starts in the cursor's current brick, which it passes from `t` to `t1`.
    pub fn new(ray: &Cursor, t: f32, t1: f32) -> Self {
        Self {
            next: ray.within(t).map(|c| c.clamp(0.0, 7.0) as i32),
            t,
            t1,
            voxel: [0; 3],
            end: t,
            corners: [0.0; 8],
            bounds: Bounds::default(),
        }
    }

    /// The next stretch and its bounds along the ray; `None` at the end of the brick. `sigma` is the largest extinction per
    /// unit of the values.
    pub fn next<V: Voxel<Value = f32>>(
        &mut self,
        grid: &Grid<V>,
        ray: &Cursor,
        sigma: f32,
    ) -> Option<(f32, f32, Bounds)> {
        while self.t < self.t1 {
            if !(self.t < self.end) {
                self.enter(grid, ray);
                continue;
            }
            let start = self.t;
            let mut end = self.end;
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
            if self.bounds.max > 0.0 {
                return Some((start, end, self.bounds));
            }
        }
        None
    }

    /// Moves on to the next voxel.
    fn enter<V: Voxel<Value = f32>>(&mut self, grid: &Grid<V>, ray: &Cursor) {
        self.voxel = self.next;
        let (end, axis) = ray.exit(ray.rel, self.voxel, 1);
        self.next[axis] += ray.step(axis);
        // Where both round differently, the brick's own end counts.
        let inside = (0..EDGE).contains(&self.next[axis]);
        self.end = if inside { end.min(self.t1) } else { self.t1 };
        let at = [0, 1, 2].map(|i| ray.brick[i] * EDGE + self.voxel[i]);
        self.corners = if grid.trilinear {
            grid.corners(at)
        } else {
            [grid.voxel(at); 8]
        };
    }

    /// Bounds between two points in the current voxel.
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
        let (a, b) = (self.weights(ray, start), self.weights(ray, end));
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

    #[inline(always)]
    fn weights(&self, ray: &Cursor, t: f32) -> [f32; 3] {
        let p = ray.within(t);
        [0, 1, 2].map(|i| (p[i] - self.voxel[i] as f32).clamp(0.0, 1.0))
    }

    /// The interpolant at `t` in the current voxel, within the bounds given for it.
    #[inline]
    pub fn value(&self, ray: &Cursor, t: f32) -> f32 {
        trilinear(&self.corners, self.weights(ray, t)).clamp(self.bounds.min, self.bounds.max)
    }
}
