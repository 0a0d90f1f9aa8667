//! From settings to a medium: reads the grids, finds what is true of them, and chooses the kernel.

use crate::appearance::Appearance;
use crate::blackbody::{Blackbody, COLDEST};
use crate::bounds::{Bounds, BrickCell, summarise};
use crate::channel::{Channel, local_shift};
use crate::coarse::Coarse;
use crate::cursor::ToLocal;
use crate::field::VdbField;
use crate::index::{Found, GROUP, Index, WIDEST, child};
use crate::load::{self, Box3, Cover, Loaded, Services, Values, corners, load, union};
use crate::settings::{Choice, Settings};
use crate::voxel::each;
use crate::voxel::{Half, Voxel};
use resolvent_api::math::DVec3;
use resolvent_api::math::Vec3;
use resolvent_api::medium::medium_traits as traits;
use resolvent_api::tracking::{Tracked, Transmittance};
use resolvent_api::{Affine, Error, Field, Lanes, Medium, MediumInfo, Segment};
use resolvent_vdb::{File, GridClass, GridInfo, ValueType};

/// Optical thickness of one voxel above which a density is cut off: e^−10⁶ is 0 in any arithmetic, and steps stay far above
/// the resolution of `f32`.
const THICKEST_VOXEL: f64 = 1e6;
/// Expected null collisions on the way through one brick above which its voxels are visited one by one.
const ROUGH: f32 = 512.0;
/// Optical thickness above which connections are estimated by survival.
///
/// Ratio tracking looks at the whole way, survival at a free path. Measured from scattering vertices in a smoke plume, with 400 ns
/// for the rest of a vertex: at thickness 6 survival makes 1.6 × the efficiency 1/(variance · time), at 2.4 still 1.2 ×, at 0.8
/// ratio tracking 1.15 ×. (Eight voxels a look-up instead of one take an eighth off the variance and double the time.)
const THICK: f32 = 1.5;
/// Voxels from the origin of index coordinates within which `f64` tells tenths of a voxel apart.
const FARTHEST: f64 = (1u64 << 48) as f64;
/// Groups that are made for emission where there is no density; beyond, emission is sampled by larger regions.
const EMISSION_GROUPS: usize = 1 << 12;

/// Reads the file and makes the medium.
///
/// # Errors
/// In one sentence.
pub fn build(settings: &Settings, services: Services<'_>) -> Result<Box<dyn Medium>, Error> {
    settings.check()?;
    let file = File::open(&settings.file).map_err(|e| Error::new(e.to_string()))?;
    build_from(settings, &file, services)
}

/// As [`build`], with the file opened.
///
/// # Errors
/// As [`build`].
pub fn build_from(
    settings: &Settings,
    file: &File,
    services: Services<'_>,
) -> Result<Box<dyn Medium>, Error> {
    let info = file
        .grid(&settings.density.grid)
        .map_err(|e| Error::new(e.to_string()))?;
    let index_to_world = load::transform(info)?;
    if info.class == GridClass::LevelSet {
        return Err(Error::new(format!(
            "the grid {} is a level set (signed distances), not a density; convert it to a fog volume first",
            info.summary()
        )));
    }
    if info.value_type.is_none_or(|t| t.components() != 1) {
        let list: Vec<_> = file.grids().iter().map(GridInfo::summary).collect();
        return Err(Error::new(format!(
            "the grid {} is no density: it holds vectors; the file has: {}",
            info.summary(),
            list.join(", ")
        )));
    }
    let real = matches!(info.value_type, Some(ValueType::Float | ValueType::Double));
    let untouched = settings.density.offset == 0.0 && settings.density.scale >= 0.0;
    let plan = Plan {
        settings,
        file,
        info,
        services,
        full_transform: settings.to_world.after(&index_to_world),
        index_to_world,
        untouched,
    };
    if info.saved_as_half && real && untouched {
        plan.with::<Half>()
    } else {
        plan.with::<f32>()
    }
}

struct Plan<'a> {
    settings: &'a Settings,
    file: &'a File,
    info: &'a GridInfo,
    services: Services<'a>,
    index_to_world: Affine,
    /// Index coordinates to the scene.
    full_transform: Affine,
    /// The density's values stay as they are in the file; the scale goes into σ_t.
    untouched: bool,
}

impl Plan<'_> {
    fn with<V: Voxel<Value = f32>>(&self) -> Result<Box<dyn Medium>, Error> {
        let s = self.settings;
        let mut appearance = self.appearance()?;
        let also = self.emission_domain(&appearance)?;
        let sigma = s.sigma_t
            * if self.untouched {
                s.density.scale as f32
            } else {
                1.0
            };
        if !sigma.is_finite() {
            return Err(Error::new("'sigma_t' times 'density_scale' is too large"));
        }
        let edges = self.full_transform.columns.map(DVec3::length);
        let shortest = edges[0].min(edges[1]).min(edges[2]);
        let limit =
            (THICKEST_VOXEL / (f64::from(sigma.max_lane()) * shortest)).min(f64::from(f32::MAX));
        let mut values = Values {
            scale: 1.0,
            offset: 0.0,
            limit: limit as f32,
        };
        if !self.untouched {
            (values.scale, values.offset) = (s.density.scale, s.density.offset);
        }
        let mark = |index: &mut Index| {
            self.each_emitting_brick(&appearance, index, &mut |index, brick, groups| {
                if groups < EMISSION_GROUPS {
                    index.group(brick);
                }
            });
        };
        let cover = Cover {
            also,
            cells: Some(&mark),
        };
        let loaded: Loaded<V> = load(
            self.file,
            self.info,
            values,
            s.trilinear,
            cover,
            self.services,
        )?;
        let grid = &loaded.grid;
        let local_to_index = local_shift(grid);
        appearance.attach(&self.index_to_world.after(&local_to_index))?;
        appearance.emitting = self.emitting_cells(&appearance, &grid.index);

        let longest = edges[0].max(edges[1]).max(edges[2]);
        let length = 8.0 * longest as f32 * sigma.max_lane();
        // Null collisions to be expected on the way through a brick.
        let rough = |b: Bounds| (b.max - b.min) * length > ROUGH && b.min < 0.5 * b.max;
        let summary = summarise(grid, self.services.parallel, rough);
        let coarse = Coarse::new(grid, &summary.means);
        let top = summary
            .cells
            .iter()
            .fold(0.0f32, |m, c| m.max(c.bounds.max));
        let mut peak = top;
        grid.index
            .uniform(&mut |_, _, constant| peak = peak.max(grid.of_slot(constant, 0)));

        // Local box: to the outermost voxels' centres and one voxel on, or to their faces.
        let (lo, hi) = corners(loaded.domain);
        let inset = if s.trilinear { 0.0 } else { 1.0 };
        let base = DVec3::new(
            grid.index.base[0] as f64,
            grid.index.base[1] as f64,
            grid.index.base[2] as f64,
        );
        let (local_lo, local_hi) = (lo - base + DVec3::splat(inset), hi - base);
        let full = self.full_transform.after(&local_to_index);
        let inverse = full.inverse().ok_or_else(|| {
            Error::new(format!(
                "the transform of the grid '{}' together with 'to_world' has no inverse",
                self.info.unique_name
            ))
        })?;

        let nothing = !(sigma.max_lane() * peak > 0.0);
        let mut info = MediumInfo {
            bounds: full.bounds(local_lo, local_hi),
            grids_read: 1
                + s.tints.len() as u32
                + u32::from(s.temperature.is_some())
                + u32::from(s.flame.is_some()),
            sigma_max: sigma * peak,
            bytes_read: self.file.bytes_read(),
            voxels: loaded.voxels,
            ..MediumInfo::default()
        };
        let emissive = appearance.is_emissive();
        let mut set = |on: bool, bit: u32| info.traits |= if on { bit } else { 0 };
        set(sigma.is_grey(s.lanes), traits::GREY);
        set(emissive, traits::EMISSIVE);
        set(appearance.albedo.is_zero(), traits::ABSORBS_ONLY);
        set(nothing && !emissive, traits::EMPTY);
        info.memory = (grid.memory()
            + appearance.memory()
            + coarse.memory()
            + summary.cells.len() * size_of::<BrickCell>()) as u64;

        let field = VdbField::<_, V, true> {
            info,
            sigma,
            grid: loaded.grid,
            cells: summary.cells,
            to_local: ToLocal::new(&full, &inverse, 0.5 * (local_lo + local_hi)),
            lo: local_lo.as_vec3a(),
            hi: local_hi.as_vec3a(),
            appearance,
            coarse,
        };
        let transmittance = match s.transmittance {
            Choice::Ratio => Transmittance::Ratio,
            Choice::Survival => Transmittance::Survival,
            Choice::Auto if thickness(&field) > THICK => Transmittance::Survival,
            Choice::Auto => Transmittance::Ratio,
        };
        Ok(match (sigma.is_grey(s.lanes), emissive) {
            (true, false) => tracked(field.of::<_, false>(sigma[0]), transmittance),
            (true, true) => tracked(field.of::<_, true>(sigma[0]), transmittance),
            (false, false) => tracked(field.of::<_, false>(sigma), transmittance),
            (false, true) => tracked(field, transmittance),
        })
    }

    fn appearance(&self) -> Result<Appearance, Error> {
        let s = self.settings;
        let channel = |source: &crate::channel::Source, limit: f32| {
            let other = source.file.as_ref().map(File::open).transpose();
            let other = other.map_err(|e| Error::new(e.to_string()))?;
            let file = other.as_ref().unwrap_or(self.file);
            Channel::load(file, source, limit, s.trilinear, self.services)
        };
        let mut appearance = Appearance {
            albedo: s.albedo,
            ..Appearance::default()
        };
        for tint in &s.tints {
            appearance.tints.push(channel(tint, 1.0)?);
        }
        if let Some(source) = &s.temperature {
            let temperature = channel(source, f32::MAX)?;
            appearance.temperature = Some((temperature, s.emission_scale, Blackbody::default()));
        }
        if let Some(source) = &s.flame {
            appearance.flame = Some((channel(source, f32::MAX)?, s.emission));
        }
        Ok(appearance)
    }

    /// Voxels of the density's index space that emission reaches into.
    fn emission_domain(&self, appearance: &Appearance) -> Result<Option<Box3>, Error> {
        let to_index = self
            .index_to_world
            .inverse()
            .ok_or_else(|| Error::new("the density grid's transform has no inverse"))?;
        let s = self.settings;
        let mut all = None;
        let channels = [
            (
                &s.temperature,
                appearance.temperature.as_ref().map(|t| &t.0),
            ),
            (&s.flame, appearance.flame.as_ref().map(|f| &f.0)),
        ];
        for (source, channel) in channels {
            let (Some(source), Some(channel)) = (source, channel) else {
                continue;
            };
            let (domain, to_world) = channel.domain();
            let (lo, hi) = corners(domain);
            let [lo, hi] = bounds(&to_index.after(to_world), lo, hi);
            // Before the conversion to integers, which would take infinities and NaN for numbers.
            let fits = |i: usize| {
                lo[i].abs().max(hi[i].abs()) <= FARTHEST && hi[i] - lo[i] <= WIDEST as f64
            };
            if !(0..3).all(fits) {
                return Err(Error::new(format!(
                    "{}: the grid '{}' emits from {lo:?} to {hi:?} in voxels of the density grid '{}' of {}; an axis holds \
                     {WIDEST} of them, so give both grids transforms of about one scale",
                    source.file.as_deref().unwrap_or(&s.file),
                    source.grid,
                    self.info.unique_name,
                    s.file,
                )));
            }
            let b = [lo.map(|c| c.floor() as i64), hi.map(|c| c.ceil() as i64)];
            all = Some(all.map_or(b, |a| union(a, b)));
        }
        Ok(all)
    }

    /// Calls `visit` for a voxel's brick in each group that emission reaches, with the number of groups there are.
    fn each_emitting_brick(
        &self,
        appearance: &Appearance,
        index: &mut Index,
        visit: &mut dyn FnMut(&mut Index, [i32; 3], usize),
    ) {
        let extent = index.extent();
        self.emission_boxes(appearance, index.base, &mut |lo, hi| {
            let from = each(|i| (lo[i] >> 3).clamp(0, extent[i] - 1));
            let to = each(|i| (hi[i] >> 3).clamp(0, extent[i] - 1));
            for x in (from[0]..=to[0]).step_by(8).chain([to[0]]) {
                for y in (from[1]..=to[1]).step_by(8).chain([to[1]]) {
                    for z in (from[2]..=to[2]).step_by(8).chain([to[2]]) {
                        let groups = index.places.len();
                        if groups >= EMISSION_GROUPS {
                            return;
                        }
                        visit(index, [x, y, z], groups);
                    }
                }
            }
        });
    }

    /// Boxes of voxels, in local coordinates of an index with this base, that together hold all emission.
    fn emission_boxes(
        &self,
        appearance: &Appearance,
        base: [i64; 3],
        visit: &mut dyn FnMut([i32; 3], [i32; 3]),
    ) {
        let Some(to_index) = self.index_to_world.inverse() else {
            return;
        };
        let half = if self.settings.trilinear { 0.0 } else { 0.5 };
        let shift = DVec3::new(
            base[0] as f64 - half,
            base[1] as f64 - half,
            base[2] as f64 - half,
        );
        let to_local = Affine::from_translation(-shift).after(&to_index);
        let mut give = |lo: [f64; 3], hi: [f64; 3], to_world: &Affine| {
            // A hundredth of a voxel more covers the rounding of positions in `f32`.
            let (lo, hi) = (DVec3::from(lo) - 0.01, DVec3::from(hi) + 0.01);
            let [lo, hi] = bounds(&to_local.after(to_world), lo, hi);
            visit(lo.map(|c| c.floor() as i32), hi.map(|c| c.ceil() as i32));
        };
        if let Some((channel, _, _)) = &appearance.temperature {
            channel.boxes(COLDEST, &mut give);
        }
        if let Some((channel, _)) = &appearance.flame {
            channel.boxes(0.0, &mut give);
        }
    }

    /// One bit per cell of the groups: whether something in it may emit.
    fn emitting_cells(&self, appearance: &Appearance, index: &Index) -> Vec<u64> {
        if !appearance.is_emissive() {
            return Vec::new();
        }
        let mut bits = vec![0u64; index.slots.len() / 64];
        let extent = index.extent();
        self.emission_boxes(appearance, index.base, &mut |lo, hi| {
            let from = each(|i| (lo[i] >> 3).clamp(0, extent[i] - 1));
            let to = each(|i| (hi[i] >> 3).clamp(0, extent[i] - 1));
            for x in from[0]..=to[0] {
                for y in from[1]..=to[1] {
                    let mut z = from[2];
                    while z <= to[2] {
                        match index.find([x, y, z]) {
                            Some(Found::Group(group)) => {
                                let cell = group as usize * GROUP + child([x, y, z]);
                                bits[cell >> 6] |= 1 << (cell & 63);
                                z += 1;
                            }
                            Some(Found::Uniform(_, log)) => z = (z >> log << log) + (1 << log),
                            None => break,
                        }
                    }
                }
            }
        });
        bits
    }
}

/// The box around the image of a box.
fn bounds(map: &Affine, lo: DVec3, hi: DVec3) -> [[f64; 3]; 2] {
    let mut out = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for corner in 0..8 {
        let pick = |i: usize| if corner >> i & 1 == 0 { lo[i] } else { hi[i] };
        let p = map.point(DVec3::new(pick(0), pick(1), pick(2)));
        for i in 0..3 {
            out[0][i] = out[0][i].min(p[i]);
            out[1][i] = out[1][i].max(p[i]);
        }
    }
    out
}

/// Largest optical thickness along the axes through the middle of the bounds.
fn thickness<F: Field>(field: &F) -> f32 {
    let bounds = field.info().bounds;
    if bounds.is_empty() {
        return 0.0;
    }
    let middle = bounds.centre();
    let mut most = 0.0f32;
    for axis in 0..3 {
        let mut d = [0.0; 3];
        d[axis] = 1.0;
        let half = 0.5 * bounds.extent()[axis];
        let o = middle - half * Vec3::from(d);
        let s = Segment {
            o: o.into(),
            t0: 0.0,
            d,
            t1: 2.0 * half,
        };
        most = most.max(field.depth(&s).max_lane());
    }
    most
}

fn tracked<L: Lanes, V: Voxel<Value = f32>, const E: bool>(
    field: VdbField<L, V, E>,
    transmittance: Transmittance,
) -> Box<dyn Medium> {
    Box::new(Tracked {
        field,
        transmittance,
    })
}

impl<V: Voxel<Value = f32>> VdbField<resolvent_api::Spectrum, V, true> {
    /// The same field with a kernel for what is true of it.
    fn of<L: Lanes, const E: bool>(self, sigma: L) -> VdbField<L, V, E> {
        let Self {
            info,
            grid,
            cells,
            to_local,
            lo,
            hi,
            appearance,
            coarse,
            ..
        } = self;
        VdbField {
            info,
            sigma,
            grid,
            cells,
            to_local,
            lo,
            hi,
            appearance,
            coarse,
        }
    }
}

impl Appearance {
    fn attach(&mut self, density_to_world: &Affine) -> Result<(), Error> {
        let emission = [
            self.temperature.as_mut().map(|t| &mut t.0),
            self.flame.as_mut().map(|f| &mut f.0),
        ];
        for channel in self.tints.iter_mut().chain(emission.into_iter().flatten()) {
            channel.attach(density_to_world)?;
        }
        Ok(())
    }
}
