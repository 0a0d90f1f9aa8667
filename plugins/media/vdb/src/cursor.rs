//! A ray on its way through the cells, in local coordinates.
//!
//! Cells are cubes of any size: empty regions, groups of bricks, bricks, parts of bricks, voxels. The ray is transformed once;
//! its direction is not normalised again, so t stays world length. Planes are intersected from their whole coordinates each time,
//! never by accumulation, and the end of a cell is the start of the next: stretches are monotone and leave no gaps, whatever the
//! rounding. Every step crosses at least one plane of the cell in the ray's direction and stays within the cell's extent on the
//! other axes, so the walk ends. Where a ray leaves through an edge or a corner, it crosses all its planes at once.
//!
//! Coordinates of voxels are whole numbers in `f32`, exact below 2²⁴: three of them share a vector register with what they are
//! compared with, and [`whole`] turns them into integers where an index is needed.

use crate::voxel::each;
use glam::{DVec3, Vec3A};
use resolvent_api::{Affine, Segment};

/// Adding 2²³ leaves no room for a fraction.
const TWO_23: f32 = 8_388_608.0;

/// Whole numbers in 0..2²² as integers. Of other numbers in that range, the nearest.
#[inline(always)]
pub fn whole(v: Vec3A) -> [i32; 3] {
    let shifted = (v + Vec3A::splat(TWO_23)).to_array();
    each(|i| (shifted[i].to_bits() & 0x7f_ffff) as i32)
}

/// The nearest multiples of `size`, a power of two, to numbers below 2²² in size.
#[inline(always)]
fn nearest(v: Vec3A, size: f32) -> Vec3A {
    let shift = Vec3A::splat(1.5 * TWO_23 * size);
    (v + shift) - shift
}

/// From world to local coordinates, in `f32`: positions are first taken relative to a point near the grid, where nothing is
/// lost, so that a scene far from its origin is no less accurate than its positions are.
#[derive(Clone, Copy)]
pub struct ToLocal {
    columns: [Vec3A; 3],
    /// A world position near the grid,
    near: Vec3A,
    /// and the local one it maps to.
    at: Vec3A,
}

impl ToLocal {
    /// From the transform of local coordinates to the world, and its inverse; `middle` is a local position near the data.
    pub fn new(to_world: &Affine, inverse: &Affine, middle: DVec3) -> Self {
        let near = to_world.point(middle).as_vec3a();
        Self {
            columns: inverse.columns.map(|c| c.as_vec3a()),
            near,
            at: inverse.point(near.as_dvec3()).as_vec3a(),
        }
    }

    /// A point.
    #[inline(always)]
    pub fn point(&self, p: [f32; 3]) -> Vec3A {
        self.vector(Vec3A::from(p) - self.near) + self.at
    }

    #[inline(always)]
    fn vector(&self, v: Vec3A) -> Vec3A {
        let [x, y, z] = self.columns;
        x * v.x + y * v.y + z * v.z
    }
}

/// The ray and where it is.
#[derive(Clone, Copy)]
pub struct Cursor {
    /// Origin.
    o: Vec3A,
    /// Direction per world length.
    d: Vec3A,
    /// 1/`d`.
    inv: Vec3A,
    /// 1 where the ray goes up, else 0.
    up: Vec3A,
    /// −∞ along axes that the ray moves on, +∞ along the others, whose planes it never reaches.
    never: Vec3A,
    /// Start of the next cell.
    pub t: f32,
    /// End of the ray.
    pub t1: f32,
    /// A voxel of the next cell.
    next: Vec3A,
    /// Lower corner and edge of the current cell.
    corner: Vec3A,
    edge: f32,
    /// Where the ray reaches its planes.
    planes: Vec3A,
}

impl Cursor {
    /// A ray clipped to the local box `lo..hi`; `None` if it misses.
    #[inline(always)]
    pub fn new(to_local: &ToLocal, s: &Segment, lo: Vec3A, hi: Vec3A) -> Option<Self> {
        let (o, d) = (to_local.point(s.o), to_local.vector(s.d.into()));
        let infinity = Vec3A::splat(f32::INFINITY);
        // Slower than this, a ray doesn't get from one voxel to the next within the widest domain.
        let idle = d.abs().cmple(Vec3A::splat(1e-12 * d.abs().max_element()));
        let d = Vec3A::select(idle, Vec3A::ZERO, d);
        let inv = d.recip();
        let (a, b) = ((lo - o) * inv, (hi - o) * inv);
        // Along an idle axis (0·∞ included) the ray is in the box for ever, or not at all: then the last test fails.
        let near = Vec3A::select(idle, -infinity, a.min(b)).max_element();
        let far = Vec3A::select(idle, infinity, a.max(b)).min_element();
        let t = if near > s.t0 { near } else { s.t0 };
        let t1 = if far < s.t1 { far } else { s.t1 };
        let outside = idle & (o.cmplt(lo) | o.cmpgt(hi));
        // A NaN in the ray makes the sum one.
        let sound = (o + d).element_sum() + t < f32::INFINITY;
        if !(t < t1 && sound) || outside.any() {
            return None;
        }
        let p = (o + d * t).max(lo).min(hi);
        Some(Self {
            o,
            d,
            inv,
            up: Vec3A::select(d.cmpgt(Vec3A::ZERO), Vec3A::ONE, Vec3A::ZERO),
            never: Vec3A::select(idle, infinity, -infinity),
            t,
            t1,
            // Any voxel that holds `p`, on a face either of two: the nearest whole number to p − ½.
            next: nearest(p - Vec3A::splat(0.5), 1.0).max(Vec3A::ZERO),
            corner: Vec3A::ZERO,
            edge: 0.0,
            planes: Vec3A::ZERO,
        })
    }

    /// A voxel of the next cell; large numbers outside the domain.
    #[inline(always)]
    pub fn next_voxel(&mut self) -> [i32; 3] {
        if self.edge > 0.0 {
            self.cross();
        }
        whole(self.next)
    }

    /// Finds a voxel of the cell behind the current one.
    #[inline(always)]
    fn cross(&mut self) {
        let last = Vec3A::splat(self.edge - 1.0);
        let crossed = self.planes.cmple(Vec3A::splat(self.planes.min_element()));
        let across = self.corner + self.up * (self.edge + 1.0) - Vec3A::ONE;
        // Along the other axes the position says which voxel, within the face that the ray goes through.
        let p = self.o + self.d * self.t;
        let along = nearest(p - Vec3A::splat(0.5), 1.0);
        let along = along.max(self.corner).min(self.corner + last);
        self.next = Vec3A::select(crossed, across, along);
    }

    /// Makes the cell of this edge (a power of two) around the next voxel the current one. Returns where it starts and ends.
    #[inline(always)]
    pub fn enter(&mut self, edge: f32) -> (f32, f32) {
        let start = self.t;
        // The middle of a cell's voxels is less than half an edge from its corner, plus the half that is taken off.
        self.corner = nearest(self.next - Vec3A::splat(0.5 * (edge - 1.0)), edge);
        self.edge = edge;
        self.planes = ((self.corner + self.up * edge - self.o) * self.inv).max(self.never);
        let t = self.planes.min_element();
        self.t = if t > start { t } else { start };
        (start, if self.t < self.t1 { self.t } else { self.t1 })
    }

    /// Lower corner of the current cell.
    #[inline(always)]
    pub fn corner(&self) -> Vec3A {
        self.corner
    }

    /// The current cell's last voxel, relative to its first.
    #[inline(always)]
    pub fn last(&self) -> Vec3A {
        Vec3A::splat(self.edge - 1.0)
    }

    /// Position relative to the current cell's corner, not outside the cell.
    #[inline(always)]
    pub fn within(&self, t: f32) -> Vec3A {
        let p = (self.o - self.corner) + self.d * t;
        p.max(Vec3A::ZERO).min(Vec3A::splat(self.edge))
    }

    /// Position.
    #[inline(always)]
    pub fn at(&self, t: f32) -> Vec3A {
        self.o + self.d * t
    }
}
