//! A grid beside the density: albedo, colour, temperature or emission.

use crate::grid::Grid;
use crate::index::{GROUP, Place, UNIFORM};
use crate::load::{self, Cover, Loaded, Services, Values};
use crate::voxel::{BRICK, Half, Voxel};
use resolvent_api::{Affine, Error};
use resolvent_vdb::{File, GridClass, ValueType};

/// A named grid with its scale and offset.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name of the grid.
    pub grid: String,
    /// Factor of its values.
    pub scale: f64,
    /// Summand, after the factor.
    pub offset: f64,
    /// The file it is in, if that is not the density's.
    pub file: Option<String>,
    /// From the grid's world, after its own transform, to the density's.
    pub transform: Affine,
}

impl Source {
    /// The grid as the density's file has it.
    pub fn new(grid: impl Into<String>) -> Self {
        Self {
            grid: grid.into(),
            scale: 1.0,
            offset: 0.0,
            file: None,
            transform: Affine::IDENTITY,
        }
    }
}

enum Data {
    Scalar(Grid<f32>),
    Half(Grid<Half>),
    Vector(Grid<[f32; 3]>),
}

/// Receives the corners of a box in local coordinates and the transform from these to the file's world.
pub type VisitBox<'a> = dyn FnMut([f64; 3], [f64; 3], &Affine) + 'a;

/// See the module.
pub struct Channel {
    data: Data,
    /// Applied to half values, which are kept as the file has them.
    factor: f32,
    /// From its local coordinates to the file's world.
    to_world: Affine,
    /// From the density's local coordinates to its own; `None` until [`Channel::attach`].
    from_density: [[f32; 4]; 3],
    /// Index coordinates of the box outside which it has its background's value only.
    domain: load::Box3,
    index_to_world: Affine,
}

impl Channel {
    /// Reads the grid.
    ///
    /// # Errors
    /// If it is missing or cannot be read.
    pub fn load(
        file: &File,
        source: &Source,
        limit: f32,
        trilinear: bool,
        services: Services<'_>,
    ) -> Result<Self, Error> {
        let info = file
            .grid(&source.grid)
            .map_err(|e| Error::new(e.to_string()))?;
        if info.class == GridClass::LevelSet {
            return Err(Error::new(format!(
                "the grid {} is a level set (signed distances), not a quantity inside a volume",
                info.summary()
            )));
        }
        let values = Values {
            scale: source.scale,
            offset: source.offset,
            limit,
        };
        let place = source.transform;
        if place.inverse().is_none() {
            return Err(Error::new(format!(
                "the transform given for the grid '{}' has no inverse",
                source.grid
            )));
        }
        let cover = Cover::default();
        let vector = info.value_type.is_some_and(|t| t.components() == 3);
        let real = matches!(info.value_type, Some(ValueType::Float | ValueType::Double));
        let halves = real && info.saved_as_half && values.scale >= 0.0 && values.offset == 0.0;
        if vector {
            let loaded = load::load(file, info, values, trilinear, cover, services)?;
            Ok(Self::new(loaded, &place, Data::Vector, 1.0))
        } else if halves {
            let limit = (f64::from(limit) / values.scale) as f32;
            let raw = Values {
                scale: 1.0,
                offset: 0.0,
                limit,
            };
            let loaded = load::load(file, info, raw, trilinear, cover, services)?;
            Ok(Self::new(loaded, &place, Data::Half, values.scale as f32))
        } else {
            let loaded = load::load(file, info, values, trilinear, cover, services)?;
            Ok(Self::new(loaded, &place, Data::Scalar, 1.0))
        }
    }

    fn new<V: Voxel>(
        loaded: Loaded<V>,
        place: &Affine,
        data: impl FnOnce(Grid<V>) -> Data,
        factor: f32,
    ) -> Self {
        let shift = local_shift(&loaded.grid);
        let index_to_world = place.after(&loaded.to_world);
        Self {
            to_world: index_to_world.after(&shift),
            index_to_world,
            domain: loaded.domain,
            data: data(loaded.grid),
            factor,
            from_density: [[0.0; 4]; 3],
        }
    }

    /// Tells it how the density's local coordinates map to the file's world.
    ///
    /// # Errors
    /// If its own transform has no inverse.
    pub fn attach(&mut self, density_to_world: &Affine) -> Result<(), Error> {
        let inverse = self
            .to_world
            .inverse()
            .ok_or_else(|| Error::new("a grid's transform has no inverse"))?;
        self.from_density = inverse
            .after(density_to_world)
            .to_rows()
            .map(|r| r.map(|v| v as f32));
        Ok(())
    }

    /// The box it covers, in index coordinates, and their transform to the file's world.
    pub fn domain(&self) -> (load::Box3, &Affine) {
        (self.domain, &self.index_to_world)
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        match &self.data {
            Data::Scalar(g) => g.memory(),
            Data::Half(g) => g.memory(),
            Data::Vector(g) => g.memory(),
        }
    }

    /// The value at a position in the density's local coordinates.
    #[inline]
    pub fn sample(&self, p: [f32; 3]) -> [f32; 3] {
        let p = self
            .from_density
            .map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3]);
        // Far outside there is the background; this also keeps the conversion to integers in range.
        let p = p.map(|c| c.clamp(-4.0, 1e7));
        match &self.data {
            Data::Scalar(g) => [g.sample(p); 3],
            Data::Half(g) => [self.factor * g.sample(p); 3],
            Data::Vector(g) => g.sample(p),
        }
    }

    /// Calls `visit` with boxes in the file's world coordinates that together hold every position where the value can reach
    /// `least`, and their transform to it: corners in the channel's local coordinates.
    pub fn boxes(&self, least: f32, visit: &mut VisitBox<'_>) {
        match &self.data {
            Data::Scalar(g) => boxes(g, least, &mut |lo, hi| visit(lo, hi, &self.to_world)),
            Data::Half(g) => {
                boxes(g, least / self.factor, &mut |lo, hi| {
                    visit(lo, hi, &self.to_world)
                });
            }
            Data::Vector(g) => boxes(g, least, &mut |lo, hi| visit(lo, hi, &self.to_world)),
        }
    }
}

/// From local to index coordinates.
pub fn local_shift<V: Voxel>(grid: &Grid<V>) -> Affine {
    let half = if grid.trilinear { 0.0 } else { 0.5 };
    let [x, y, z] = grid.index.base.map(|b| b as f64 - half);
    Affine::from_translation(resolvent_api::math::DVec3::new(x, y, z))
}

fn boxes<V: Voxel>(grid: &Grid<V>, least: f32, visit: &mut dyn FnMut([f64; 3], [f64; 3])) {
    let reaches = |mut v: V::Value| {
        V::components(&mut v)
            .iter()
            .any(|c| *c > 0.0 && *c >= least)
    };
    // Voxel v is felt from v − 1 to v + 1, or from v to v + 1 if the nearest one is taken.
    let below = if grid.trilinear { 1.0 } else { 0.0 };
    let mut give = |at: [i32; 3], voxels: f64| {
        let lo = at.map(|c| f64::from(c) * 8.0 - below);
        visit(lo, at.map(|c| f64::from(c) * 8.0 + voxels));
    };
    let value = |slot: u32| grid.of_slot(slot, 0);
    for (group, place) in grid.index.places.iter().enumerate() {
        let Place::At(at) = place else { continue };
        for (k, slot) in grid.index.slots[group * GROUP..][..GROUP]
            .iter()
            .enumerate()
        {
            let brick = [
                at[0] + (k >> 6) as i32,
                at[1] + (k >> 3 & 7) as i32,
                at[2] + (k & 7) as i32,
            ];
            let some = if slot & UNIFORM != 0 {
                reaches(value(*slot))
            } else {
                (0..BRICK).any(|i| reaches(grid.of_slot(*slot, i)))
            };
            if some {
                give(brick, 8.0);
            }
        }
    }
    grid.index.uniform(&mut |at, edge, constant| {
        if reaches(value(constant)) {
            give(at, f64::from(edge) * 8.0);
        }
    });
}
