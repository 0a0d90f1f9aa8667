//! The cloud: its density, the bounds of it, and the [`Field`] that tracking runs over.

mod grid;
mod noise;

use crate::Common;
use grid::{Grid, Walk};
use noise::Noise;
use resolvent_api::math::DVec3;
use resolvent_api::medium::medium_traits;
use resolvent_api::{
    Cell, Coefficients, Error, Extent, Field, Lanes, MediumInfo, Params, Segment, Spectrum, Vec3,
};

/// Cells of the grid of bounds along the longest edge.
const CELLS: f64 = 64.0;
/// Finest lattice along the longest edge that `f32` coordinates still resolve.
const FINEST: f64 = 65_536.0;

/// The density in [0, 1], in the coordinates of the grid of bounds.
pub struct Density {
    noise: Noise,
    coverage: f32,
    softness: f32,
    falloff: f32,
    ball: bool,
    /// Cells of the grid along each axis.
    cells: Vec3,
}

impl Density {
    /// Distance from the boundary in half-sizes: 1 at the centre, 0 on the boundary. `far` is how far out along each axis.
    #[inline(always)]
    fn inside(&self, far: Vec3) -> f32 {
        if self.ball {
            1.0 - far.length()
        } else {
            1.0 - far.max_element()
        }
    }

    /// Erosion in [0, 1] from the distance to the boundary.
    #[inline(always)]
    fn erosion(&self, inside: f32) -> f32 {
        if self.falloff > 0.0 {
            (inside / self.falloff).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }

    #[inline(always)]
    fn density(&self, noise: f32, erosion: f32) -> f32 {
        ((noise + self.coverage + erosion - 2.0) / self.softness).clamp(0.0, 1.0)
    }

    /// The density at a point of the grid.
    #[inline(always)]
    pub fn at(&self, g: Vec3) -> f32 {
        let erosion = self.erosion(self.inside((2.0 * g / self.cells - 1.0).abs()));
        // The noise is at most 1: where even that leaves nothing it need not be asked.
        if erosion + self.coverage <= 1.0 {
            return 0.0;
        }
        self.density(self.noise.at(g), erosion)
    }

    /// Bounds of the density over a box of the grid. Everything rises or falls monotonously, so the bounds follow from those
    /// of the noise and of the distance to the boundary.
    pub fn range(&self, low: Vec3, high: Vec3) -> (f32, f32) {
        let (a, b) = (2.0 * low / self.cells - 1.0, 2.0 * high / self.cells - 1.0);
        let farthest = a.abs().max(b.abs());
        // An interval that holds 0 comes as near as that.
        let nearest = a.max(-b).max(Vec3::ZERO);
        let (eroded, whole) = (
            self.erosion(self.inside(farthest)) - 1e-5,
            self.erosion(self.inside(nearest)) + 1e-5,
        );
        if whole + self.coverage <= 1.0 {
            return (0.0, 0.0);
        }
        let (least, most) = self.noise.range(low, high);
        (self.density(least, eroded), self.density(most, whole))
    }
}

/// The field.
pub struct Cloud<L> {
    extent: Extent,
    grid: Grid,
    density: Density,
    /// Extinction at density 1.
    sigma: L,
    albedo: Spectrum,
    info: MediumInfo,
}

/// Most null collisions that a flight may meet: it would seem to hang with more.
const THICKEST: f64 = 1e7;

impl<L: Lanes> Cloud<L> {
    /// Reads the cloud's parameters and finds its bounds, on all of the host's threads.
    pub(crate) fn new(params: &Params<'_>, sigma: L, common: Common) -> Result<Self, Error> {
        if common.extent.is_all() {
            return Err(Error::new(
                "a cloud needs 'bounds', or 'center' and 'radius'",
            ));
        }
        let (octaves, frequency) = (params.int("octaves")? as u32, params.float("frequency")?);
        let lacunarity = params.float("lacunarity")?;
        let finest = frequency * lacunarity.powi(octaves as i32 - 1);
        if !(finest <= FINEST) {
            return Err(Error::new(format!(
                "the finest layer has {finest:.0} features along the longest edge, more than {FINEST}: \
                 lower 'octaves', 'frequency' or 'lacunarity'"
            )));
        }
        let across = f64::from(common.extent.bounds().extent().length());
        let thickness = f64::from(common.sigma_t.max_lane()) * across;
        if !(thickness <= THICKEST) {
            return Err(Error::new(format!(
                "'sigma_t' makes an optical thickness of {thickness:.1e} across the cloud's bounds, more than {THICKEST:e}: lower it"
            )));
        }
        let (_, half) = common.extent.object_box();
        let longest = half.max_element();
        let counts = (half / longest * CELLS).ceil().max(DVec3::ONE);
        // Lattice cells per cell of the grid.
        let scale = (half / longest / counts * frequency).as_vec3();
        let density = Density {
            noise: Noise::new(
                octaves,
                scale,
                lacunarity as f32,
                params.float("gain")? as f32,
                params.int("seed")? as u64,
            ),
            coverage: params.float("coverage")? as f32,
            softness: params.float("softness")? as f32,
            falloff: params.float("falloff")? as f32,
            ball: common.extent.is_ball(),
            cells: counts.as_vec3(),
        };
        let grid = Grid::new(params.host(), counts.as_uvec3(), &density);
        let top = grid.largest();
        let mut traits = 0;
        let mut set = |bit, holds| traits |= if holds { bit } else { 0 };
        set(medium_traits::GREY, !L::CHROMATIC);
        set(medium_traits::EMPTY, top == 0.0);
        set(
            medium_traits::ABSORBS_ONLY,
            (common.sigma_t * common.albedo).is_zero(),
        );
        let info = MediumInfo {
            bounds: common.extent.bounds(),
            traits,
            sigma_max: common.sigma_t * top,
            memory: size_of::<Self>() as u64 + grid.memory(),
            ..MediumInfo::default()
        };
        Ok(Self {
            extent: common.extent,
            grid,
            density,
            sigma,
            albedo: common.albedo,
            info,
        })
    }

    /// World to grid.
    fn to_grid(&self, p: DVec3) -> Vec3 {
        let unit = self.extent.to_unit().point(p);
        (0.5 * (unit + 1.0) * self.density.cells.as_dvec3()).as_vec3()
    }
}

impl<L: Lanes> Field for Cloud<L> {
    type Lanes = L;
    const EMISSIVE: bool = false;
    type Cursor<'a> = Walk;

    fn info(&self) -> MediumInfo {
        self.info
    }

    fn enter(&self, s: &Segment) -> Option<Walk> {
        let (a, b) = self.extent.clip(s)?;
        // Rounded into the segment; what rounding cuts off is below the resolution of t.
        let (start, end) = ((a as f32).max(s.t0), (b as f32).min(s.t1));
        let wide = |v: [f32; 3]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
        let (o, d) = (wide(s.o), wide(s.d));
        let at = self.to_grid(o + f64::from(start) * d);
        let unit = self.extent.to_unit().vector(d);
        let rate = (0.5 * unit * self.density.cells.as_dvec3()).as_vec3();
        self.grid.walk(at, rate, start, end)
    }

    #[inline]
    fn next_cell(&self, c: &mut Walk) -> Option<Cell<L>> {
        let (t0, t1, bounds) = self.grid.next(c)?;
        Some(Cell {
            t0,
            t1,
            majorant: self.sigma * bounds.most,
            minorant: self.sigma * bounds.least,
        })
    }

    #[inline]
    fn extinction(&self, c: &mut Walk, t: f32, _: u64) -> L {
        self.sigma * self.density.at(c.at(t))
    }

    #[inline]
    fn collision(
        &self,
        c: &mut Walk,
        t: f32,
        known: Option<L>,
        exact: bool,
    ) -> (Spectrum, Spectrum) {
        // A collision accepted without a look-up needs only the lanes' ratios, which are the same everywhere.
        let sigma_t = match known {
            Some(sigma) => sigma,
            None if exact => self.extinction(c, t, 0),
            None => self.sigma,
        }
        .spectrum();
        (sigma_t, sigma_t * self.albedo)
    }

    fn emission(&self, _: &mut Walk, _: f32) -> Spectrum {
        Spectrum::ZERO
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = DVec3::new(p.x.into(), p.y.into(), p.z.into());
        if !self.extent.contains(p) {
            return Coefficients::default();
        }
        let sigma_t = (self.sigma * self.density.at(self.to_grid(p))).spectrum();
        Coefficients {
            sigma_t,
            sigma_s: sigma_t * self.albedo,
            emission: Spectrum::ZERO,
        }
    }

    /// From the cells' means: no look-up.
    fn depth(&self, s: &Segment) -> Spectrum {
        let Some(mut walk) = self.enter(s) else {
            return Spectrum::ZERO;
        };
        let mut depth = 0.0;
        while let Some((t0, t1, bounds)) = self.grid.next(&mut walk) {
            depth += bounds.mean * (t1 - t0);
        }
        (self.sigma * depth).spectrum()
    }
}
