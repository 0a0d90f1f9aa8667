//! A ray on its way through the cells: hierarchical DDA in local coordinates.
//!
//! The ray is transformed once; its direction is not normalised again, so t stays world length. Planes of cells are
//! intersected from their integer coordinates each time, never by accumulation, and the end of a cell is the start of the next:
//! stretches are monotone and leave no gaps, whatever the rounding. Every step moves on by at least one brick or voxel, so
//! the walk ends.

use crate::voxel::EDGE;
use resolvent_api::Affine;
use resolvent_api::Segment;

/// From world to local coordinates.
#[derive(Clone, Copy, Debug)]
pub struct ToLocal {
    rows: [[f64; 4]; 3],
}

impl ToLocal {
    /// From the transform's inverse.
    pub fn new(affine: &Affine) -> Self {
        Self {
            rows: affine.to_rows(),
        }
    }

    /// A point; in double precision, since a scene may be far from its origin.
    #[inline(always)]
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = p.map(f64::from);
        self.rows
            .map(|r| (r[0] * x + r[1] * y + r[2] * z + r[3]) as f32)
    }

    #[inline(always)]
    fn vector(&self, v: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = v.map(f64::from);
        self.rows.map(|r| (r[0] * x + r[1] * y + r[2] * z) as f32)
    }
}

/// The ray and where it is.
#[derive(Clone, Copy)]
pub struct Cursor {
    /// Origin.
    pub o: [f32; 3],
    /// Direction per world length.
    pub d: [f32; 3],
    /// 1/`d`; +∞ along axes that the ray doesn't move on.
    inv: [f32; 3],
    /// Signs of `d`.
    step: [i32; 3],
    /// Start of the next cell.
    pub t: f32,
    /// End of the ray.
    pub t1: f32,
    /// Brick coordinates of the next cell.
    pub next: [i32; 3],
    /// Brick coordinates of the current cell.
    pub brick: [i32; 3],
    /// Origin relative to the current cell's brick.
    pub rel: [f32; 3],
    /// Slot of the current brick.
    pub slot: u32,
    /// Position of the current cell among all cells; only in groups.
    pub cell: usize,
}

impl Cursor {
    /// A ray clipped to the local box `lo..hi`; `None` if it misses.
    #[inline(always)]
    pub fn new(to_local: &ToLocal, s: &Segment, lo: [f32; 3], hi: [f32; 3]) -> Option<Self> {
        let (o, mut d) = (to_local.point(s.o), to_local.vector(s.d));
        if !(o[0] + o[1] + o[2]).is_finite() {
            return None;
        }
        let fastest = d[0].abs().max(d[1].abs()).max(d[2].abs());
        let (mut t, mut t1) = (s.t0, s.t1);
        let mut inv = [f32::INFINITY; 3];
        let mut step = [0; 3];
        for i in 0..3 {
            // Slower than this, a ray doesn't get from one voxel to the next within the widest domain.
            if d[i].abs() > 1e-12 * fastest {
                inv[i] = 1.0 / d[i];
                step[i] = if d[i] > 0.0 { 1 } else { -1 };
                let (a, b) = ((lo[i] - o[i]) * inv[i], (hi[i] - o[i]) * inv[i]);
                t = t.max(a.min(b));
                t1 = t1.min(a.max(b));
            } else {
                d[i] = 0.0;
                // On the faces counts as inside.
                if !(lo[i] <= o[i] && o[i] <= hi[i]) {
                    return None;
                }
            }
        }
        if !(t < t1) {
            return None;
        }
        let next = [0, 1, 2].map(|i| (o[i] + t * d[i]).clamp(lo[i], hi[i]) as i32 >> 3);
        Some(Self {
            o,
            d,
            inv,
            step,
            t,
            t1,
            next,
            brick: [0; 3],
            rel: [0.0; 3],
            slot: 0,
            cell: 0,
        })
    }

    /// Where the ray leaves the cube with edge `size` whose lower corner is `corner` relative to a point from which `o` is the
    /// origin: t, and the axis across whose face.
    #[inline(always)]
    pub fn exit(&self, o: [f32; 3], corner: [i32; 3], size: i32) -> (f32, usize) {
        let t = [0, 1, 2].map(|i| {
            // Along an axis the ray doesn't move on, `inv` = ∞ and the plane lies at ∞: ∞·∞, never 0·∞.
            let plane = if self.step[i] == 0 {
                f32::INFINITY
            } else {
                (corner[i] + if self.step[i] > 0 { size } else { 0 }) as f32
            };
            (plane - o[i]) * self.inv[i]
        });
        if t[0] <= t[1] && t[0] <= t[2] {
            (t[0], 0)
        } else if t[1] <= t[2] {
            (t[1], 1)
        } else {
            (t[2], 2)
        }
    }

    /// Makes the next brick the current one and moves on to the brick after it. Returns where the current one starts and
    /// ends.
    #[inline(always)]
    pub fn advance(&mut self) -> (f32, f32) {
        let start = self.t;
        self.brick = self.next;
        self.rel = [0, 1, 2].map(|i| self.o[i] - (self.brick[i] * EDGE) as f32);
        let (t, axis) = self.exit(self.rel, [0; 3], EDGE);
        self.next[axis] += self.step[axis];
        self.t = t.max(start);
        (start, self.t.min(self.t1))
    }

    /// As [`Cursor::advance`], for a region with edges of 2^`log` bricks around the next brick.
    pub fn advance_region(&mut self, log: u32) -> (f32, f32) {
        let start = self.t;
        let corner = self.next.map(|c| c >> log << log);
        let edge = 1 << log;
        let (t, axis) = self.exit(self.o, corner.map(|c| c * EDGE), edge * EDGE);
        self.t = t.max(start);
        self.next = [0, 1, 2].map(|i| {
            if i == axis {
                corner[i] + if self.step[i] > 0 { edge } else { -1 }
            } else {
                // The position says which brick, within the face that the ray goes through.
                let at = (self.o[i] + self.t * self.d[i]) as i32 >> 3;
                at.clamp(corner[i], corner[i] + edge - 1)
            }
        });
        (start, self.t.min(self.t1))
    }

    /// Steps of a voxel coordinate along an axis.
    #[inline(always)]
    pub fn step(&self, axis: usize) -> i32 {
        self.step[axis]
    }

    /// Position relative to the current brick.
    #[inline(always)]
    pub fn within(&self, t: f32) -> [f32; 3] {
        [0, 1, 2].map(|i| self.rel[i] + t * self.d[i])
    }

    /// Position.
    #[inline(always)]
    pub fn at(&self, t: f32) -> [f32; 3] {
        [0, 1, 2].map(|i| self.o[i] + t * self.d[i])
    }
}
