//! The voxels as tracking sees them.

use crate::appearance::Appearance;
use crate::bounds::Bounds;
use crate::coarse::Coarse;
use crate::cursor::{Cursor, ToLocal};
use crate::fine::Fine;
use crate::grid::Grid;
use crate::index::{Found, GROUP, UNIFORM, child};
use crate::voxel::Voxel;
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
    /// Bounds of the cells, in the order of the index's slots.
    pub cells: Vec<Bounds>,
    /// From world to local coordinates.
    pub to_local: ToLocal,
    /// The local box outside which there is nothing.
    pub lo: [f32; 3],
    /// Its upper corner.
    pub hi: [f32; 3],
    /// Albedo and emission.
    pub appearance: Appearance,
    /// Means for [`Field::depth`].
    pub coarse: Coarse,
}

/// Where a ray is: see [`Cursor`], and [`Fine`] inside a rough brick.
pub struct Walk {
    ray: Cursor,
    fine: Option<Fine>,
}

impl<L: Lanes, V: Voxel<Value = f32>, const EMISSIVE: bool> VdbField<L, V, EMISSIVE> {
    /// The value at `t` inside the current cell from a single voxel: ⌊x + u⌋ with u uniform in [0, 1)³ is each of the eight
    /// corners with the probability of its trilinear weight.
    #[inline(always)]
    fn tap(&self, ray: &Cursor, t: f32, jitter: u64) -> f32 {
        let p = ray.within(t);
        // 1 + u: the bits become a mantissa, which needs no conversion.
        let u = [jitter, jitter >> 21, jitter >> 42]
            .map(|b| f32::from_bits(0x3f80_0000 | (b as u32 & 0x1f_ffff) << 2));
        let v = if self.grid.trilinear {
            // Rounding may place `p` just outside the cell: the limits keep the voxel inside the cell's bounds.
            [0, 1, 2].map(|i| (p[i] + u[i]).clamp(1.0, 9.0) as i32 - 1)
        } else {
            p.map(|c| c.clamp(0.0, 7.0) as i32)
        };
        if (v[0] | v[1] | v[2]) < 8 {
            return self.grid.of_slot(ray.slot, crate::voxel::offset(v));
        }
        self.tap_beyond(ray, v)
    }

    /// A tap in one of the bricks behind the current one.
    #[inline]
    fn tap_beyond(&self, ray: &Cursor, v: [i32; 3]) -> f32 {
        let brick = [0, 1, 2].map(|i| ray.brick[i] + (v[i] >> 3));
        self.grid
            .of_slot(self.grid.index.slot(brick), crate::voxel::offset(v))
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

    /// The value at `t`, interpolated.
    #[inline]
    fn exact(&self, walk: &Walk, t: f32) -> f32 {
        match &walk.fine {
            Some(fine) => fine.value(&walk.ray, t),
            None => self.grid.sample(walk.ray.at(t)),
        }
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
        Some(Walk { ray, fine: None })
    }

    #[inline(always)]
    fn next_cell(&self, walk: &mut Walk) -> Option<Cell<L>> {
        loop {
            if let Some(fine) = &mut walk.fine {
                if let Some((t0, t1, bounds)) =
                    fine.next(&self.grid, &walk.ray, self.sigma.max_lane())
                {
                    return Some(self.cell(t0, t1, bounds));
                }
                walk.fine = None;
            }
            let ray = &mut walk.ray;
            if !(ray.t < ray.t1) {
                return None;
            }
            match self.grid.index.find(ray.next)? {
                Found::Group(group) => {
                    let cell = group as usize * GROUP + child(ray.next);
                    let bounds = self.cells[cell];
                    let (t0, t1) = ray.advance();
                    if bounds.max == 0.0 && !(EMISSIVE && self.appearance.emits(cell)) {
                        continue;
                    }
                    ray.slot = self.grid.index.slots[cell];
                    ray.cell = cell;
                    if bounds.min < 0.0 {
                        walk.fine = Some(Fine::new(ray, t0, t1));
                        continue;
                    }
                    return Some(self.cell(t0, t1, bounds));
                }
                Found::Uniform(constant, log) => {
                    let value = self.grid.constants[(constant & !UNIFORM) as usize];
                    ray.brick = ray.next;
                    ray.slot = constant;
                    ray.cell = usize::MAX;
                    let (t0, t1) = ray.advance_region(log);
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
            None => self.tap(&walk.ray, t, jitter),
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
        (sigma_t, sigma_t * self.appearance.albedo(walk.ray.at(t)))
    }

    #[inline(always)]
    fn emission(&self, walk: &mut Walk, t: f32) -> Spectrum {
        if !EMISSIVE || !self.appearance.emits(walk.ray.cell) {
            return Spectrum::ZERO;
        }
        self.appearance.emission(walk.ray.at(t))
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = self.to_local.point(p.into());
        if (0..3).any(|i| !(self.lo[i] <= p[i] && p[i] <= self.hi[i])) {
            return Coefficients::default();
        }
        let sigma_t = (self.sigma * self.grid.sample(p)).spectrum();
        Coefficients {
            sigma_t,
            sigma_s: sigma_t * self.appearance.albedo(p),
            emission: self.appearance.emission(p),
        }
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        match Cursor::new(&self.to_local, s, self.lo, self.hi) {
            Some(ray) => (self.sigma * self.coarse.integral(&ray)).spectrum(),
            None => Spectrum::ZERO,
        }
    }
}
