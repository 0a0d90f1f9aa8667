//! The voxels as tracking sees them.

use crate::appearance::Appearance;
use crate::bounds::{Bounds, BrickCell};
use crate::coarse::Coarse;
use crate::cursor::{Cursor, ToLocal, whole};
use crate::fine::Fine;
use crate::grid::{Grid, trilinear};
use crate::index::{Found, GROUP, UNIFORM, child};
use crate::voxel::{Voxel, each};
use glam::Vec3A;
use resolvent_api::math::Vec3;
use resolvent_api::{Cell, Coefficients, Field, Lanes, MediumInfo, Segment, Spectrum};

/// A density grid with its cells, extinction σ_t = `sigma` · value.
///
/// `L` is `f32` if σ_t is grey; `V` is how voxels are stored; `EMISSIVE` compiles the look-ups of emission.
pub struct VdbField<L: Lanes, V: Voxel<Value = f32>, const EMISSIVE: bool> {
    /// Facts.
    pub info: MediumInfo,
    /// Extinction per unit of the grid's values, 1/length.
    pub sigma: L,
    /// The density.
    pub grid: Grid<V>,
    /// The cells, in the order of the index's slots.
    pub cells: Vec<BrickCell>,
    /// From world to local coordinates.
    pub to_local: ToLocal,
    /// The local box outside which there is nothing.
    pub lo: Vec3A,
    /// Its upper corner.
    pub hi: Vec3A,
    /// Albedo and emission.
    pub appearance: Appearance,
    /// Means for [`Field::depth`].
    pub coarse: Coarse,
}

/// Where a ray is.
pub struct Walk {
    ray: Cursor,
    /// Slot of the current brick.
    slot: u32,
    /// The current brick among all cells; `usize::MAX` outside groups.
    cell: usize,
    /// Inside a voxel's cell.
    fine: Option<Fine>,
}

impl<L: Lanes, V: Voxel<Value = f32>, const EMISSIVE: bool> VdbField<L, V, EMISSIVE> {
    /// The value at `t` inside the current cell from a single voxel: ⌊x + u⌋ with u uniform in [0, 1)³ is each of the eight
    /// corners with the probability of its trilinear weight.
    #[inline(always)]
    fn tap(&self, walk: &Walk, t: f32, jitter: u64) -> f32 {
        // Relative to the cell and inside it: rounding must not lead to voxels that its bounds don't know of.
        let p = walk.ray.within(t);
        let p = if self.grid.trilinear {
            // ⌊p + u⌋ as the whole number nearest to p + u − ½. The bits become the mantissa of 1 + u, which needs no
            // conversion, and 1.5 is taken off again without rounding.
            let bits = each(|i| (jitter >> (21 * i)) as u32 & 0x1f_ffff);
            let u = Vec3A::from(each(|i| f32::from_bits(0x3f80_0000 | bits[i] << 2)));
            p + (u - Vec3A::splat(1.5))
        } else {
            (p - Vec3A::splat(0.5)).min(walk.ray.last())
        };
        // A ½ at the far end rounds to even, which is the end: never out of the cell.
        let (within, corner) = (whole(p.max(Vec3A::ZERO)), whole(walk.ray.corner()));
        let at = each(|i| corner[i] + within[i]);
        let same = each(|i| at[i] ^ corner[i]);
        if (same[0] | same[1] | same[2]) < 8 {
            return self.grid.of_slot(walk.slot, crate::voxel::offset(at));
        }
        self.tap_beyond(at)
    }

    /// A tap in one of the bricks behind the current one.
    #[inline]
    fn tap_beyond(&self, at: [i32; 3]) -> f32 {
        self.grid.voxel(at)
    }

    #[inline(always)]
    fn cell(&self, t0: f32, t1: f32, bounds: Bounds) -> Cell<L> {
        Cell {
            t0,
            t1,
            majorant: self.sigma * bounds.max,
            minorant: self.sigma * bounds.min,
        }
    }

    #[cold]
    fn corners(&self, voxel: [i32; 3]) -> [f32; 8] {
        if self.grid.trilinear {
            self.grid.corners(voxel)
        } else {
            [self.grid.voxel(voxel); 8]
        }
    }

    /// The value at `t`, interpolated. The position is the one that [`Self::tap`] sees, so that what a tap can hit is never 0
    /// here.
    #[inline]
    fn exact(&self, walk: &Walk, t: f32) -> f32 {
        if let Some(fine) = &walk.fine {
            return fine.value(&walk.ray, t);
        }
        if !self.grid.trilinear {
            return self.tap(walk, t, 0);
        }
        let p = walk.ray.within(t);
        let floor = p.floor().min(walk.ray.last());
        let corners = self.grid.corners(whole(walk.ray.corner() + floor));
        trilinear(&corners, (p - floor).to_array())
    }
}

impl<L: Lanes, V: Voxel<Value = f32>, const EMISSIVE: bool> Field for VdbField<L, V, EMISSIVE> {
    type Lanes = L;
    const EMISSIVE: bool = EMISSIVE;
    type Cursor<'a>
        = Walk
    where
        Self: 'a;

    fn info(&self) -> MediumInfo {
        self.info
    }

    #[inline(always)]
    fn enter(&self, s: &Segment) -> Option<Walk> {
        let ray = Cursor::new(&self.to_local, s, self.lo, self.hi)?;
        Some(Walk {
            ray,
            slot: 0,
            cell: 0,
            fine: None,
        })
    }

    #[inline(always)]
    fn next_cell(&self, walk: &mut Walk) -> Option<Cell<L>> {
        loop {
            if let Some(fine) = &mut walk.fine {
                let vacuum = EMISSIVE && self.appearance.emits(walk.cell);
                let stretch = fine.next(&walk.ray, self.sigma.max_lane(), vacuum);
                if let Some((t0, t1, bounds)) = stretch {
                    return Some(self.cell(t0, t1, bounds));
                }
                walk.fine = None;
            }
            let ray = &mut walk.ray;
            if !(ray.t < ray.t1) {
                return None;
            }
            let voxel = ray.next_voxel();
            let brick = each(|i| voxel[i] >> 3);
            match self.grid.index.find(brick)? {
                Found::Group(group) => {
                    walk.cell = group as usize * GROUP + child(brick);
                    let BrickCell { bounds, slot } = self.cells[walk.cell];
                    walk.slot = slot;
                    if bounds.min < 0.0 {
                        let (t0, _) = ray.enter(1.0);
                        walk.fine = Some(Fine::new(t0, ray.t, self.corners(voxel)));
                        continue;
                    }
                    let (t0, t1) = ray.enter(8.0);
                    if bounds.max == 0.0 && !(EMISSIVE && self.appearance.emits(walk.cell)) {
                        continue;
                    }
                    return Some(self.cell(t0, t1, bounds));
                }
                Found::Uniform(constant, log) => {
                    let value = self.grid.constants[(constant & !UNIFORM) as usize];
                    (walk.slot, walk.cell) = (constant, usize::MAX);
                    let (t0, t1) = ray.enter((8u32 << log) as f32);
                    if value == 0.0 && !EMISSIVE {
                        continue;
                    }
                    let bounds = Bounds {
                        max: value,
                        min: value,
                    };
                    return Some(self.cell(t0, t1, bounds));
                }
            }
        }
    }

    #[inline(always)]
    fn extinction(&self, walk: &mut Walk, t: f32, jitter: u64) -> L {
        let value = match &walk.fine {
            Some(fine) => fine.value(&walk.ray, t),
            None => self.tap(walk, t, jitter),
        };
        self.sigma * value
    }

    #[inline(always)]
    fn collision(
        &self,
        walk: &mut Walk,
        t: f32,
        known: Option<L>,
        exact: bool,
    ) -> (Spectrum, Spectrum) {
        let sigma_t = match known {
            _ if exact => self.sigma * self.exact(walk, t),
            Some(sigma) => sigma,
            None => self.sigma,
        }
        .spectrum();
        (
            sigma_t,
            sigma_t * self.appearance.albedo(walk.ray.at(t).to_array()),
        )
    }

    #[inline(always)]
    fn emission(&self, walk: &mut Walk, t: f32) -> Spectrum {
        if !EMISSIVE || !self.appearance.emits(walk.cell) {
            return Spectrum::ZERO;
        }
        self.appearance.emission(walk.ray.at(t).to_array())
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = self.to_local.point(p.into());
        if !(self.lo.cmple(p) & p.cmple(self.hi)).all() {
            return Coefficients::default();
        }
        let p = p.to_array();
        let sigma_t = (self.sigma * self.grid.sample(p)).spectrum();
        Coefficients {
            sigma_t,
            sigma_s: sigma_t * self.appearance.albedo(p),
            emission: self.appearance.emission(p),
        }
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        match Cursor::new(&self.to_local, s, self.lo, self.hi) {
            Some(mut ray) => (self.sigma * self.coarse.integral(&mut ray)).spectrum(),
            None => Spectrum::ZERO,
        }
    }
}
