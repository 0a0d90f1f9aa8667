//! From the file to a [`Grid`]: decoded in parallel straight into the brick pool, sanitised on the way.

use crate::grid::Grid;
use crate::index::{Index, UNIFORM};
use crate::voxel::each;
use crate::voxel::{Brick, Voxel};
use resolvent_api::math::DVec3;
use resolvent_api::{Affine, Error};
use resolvent_vdb::{File, GridInfo, Halves, Parallel};
use std::collections::HashMap;
use std::sync::Mutex;

/// Voxels in index coordinates, both ends included.
pub type Box3 = [[i64; 3]; 2];

/// What becomes of a grid's values: `scale · v + offset`, then limited to 0..=`limit`.
#[derive(Clone, Copy, Debug)]
pub struct Values {
    /// Factor.
    pub scale: f64,
    /// Summand.
    pub offset: f64,
    /// Upper limit.
    pub limit: f32,
}

impl Values {
    fn is_identity(&self) -> bool {
        self.scale == 1.0 && self.offset == 0.0
    }
}

/// Where threads and warnings go.
#[derive(Clone, Copy)]
pub struct Services<'a> {
    /// Threads.
    pub parallel: &'a dyn Parallel,
    /// Receives one sentence per warning.
    pub warn: &'a (dyn Fn(&str) + Sync),
}

/// A grid with what the file says about it.
pub struct Loaded<V: Voxel> {
    /// The voxels.
    pub grid: Grid<V>,
    /// From index coordinates (voxel centres at integers) to the file's world.
    pub to_world: Affine,
    /// Active voxels, `None` without any.
    pub active: Option<Box3>,
    /// Number of active voxels.
    pub voxels: u64,
    /// The active voxels, one more on each side, and what else was asked to be covered.
    pub domain: Box3,
}

/// The grid's transform.
///
/// # Errors
/// If the grid cannot be read.
pub fn transform(info: &GridInfo) -> Result<Affine, Error> {
    if let Some(refusal) = &info.refusal {
        return Err(Error::new(refusal.to_string()));
    }
    let Some(t) = &info.transform else {
        return Err(Error::new(format!(
            "the grid '{}' has no transform",
            info.unique_name
        )));
    };
    let m = &t.index_to_world;
    let affine = Affine::from_rows([m[0], m[1], m[2]]);
    if affine.inverse().is_none() {
        return Err(Error::new(format!(
            "the transform of the grid '{}' has no inverse",
            info.unique_name
        )));
    }
    Ok(affine)
}

/// A kind of fault in values: how many there were and the first, in the file's order.
#[derive(Default)]
struct Tally {
    count: u64,
    first: Option<(usize, [i64; 3])>,
}

impl Tally {
    fn add(&mut self, order: usize, at: [i64; 3]) {
        self.count += 1;
        if self.first.is_none_or(|(o, _)| order < o) {
            self.first = Some((order, at));
        }
    }

    fn place(&self) -> String {
        let first = self.first.map_or([0; 3], |f| f.1);
        let plural = if self.count == 1 { "voxel" } else { "voxels" };
        format!("{} {plural}, the first at index {first:?}", self.count)
    }
}

#[derive(Default)]
struct Faults {
    nan: Tally,
    infinite: Tally,
    negative: Tally,
    above: Tally,
}

impl Values {
    /// The value after scale, offset and limits; what was wrong with it goes to `faults`.
    fn apply(&self, v: f32, faults: &mut Faults, order: usize, at: [i64; 3]) -> f32 {
        let scaled = if self.is_identity() {
            v
        } else {
            (f64::from(v) * self.scale + self.offset) as f32
        };
        if v.is_nan() {
            faults.nan.add(order, at);
            0.0
        } else if v.is_infinite() {
            faults.infinite.add(order, at);
            0.0
        } else if scaled < 0.0 {
            faults.negative.add(order, at);
            0.0
        } else if scaled > self.limit {
            faults.above.add(order, at);
            self.limit
        } else {
            scaled + 0.0 // −0 becomes 0
        }
    }

    fn is_fine(&self, v: f32) -> bool {
        v.is_sign_positive() && v <= self.limit
    }
}

/// What the index of a grid shall hold beside its voxels.
#[derive(Clone, Copy, Default)]
pub struct Cover<'a> {
    /// Voxels outside the active ones that shall be in the domain.
    pub also: Option<Box3>,
    /// Cells will be walked: make the index ready for their bounds, after this has been called with it.
    pub cells: Option<&'a dyn Fn(&mut Index)>,
}

/// Reads a grid.
///
/// # Errors
/// What the file is damaged by, infinite values, and what memory cannot hold.
pub fn load<V: Voxel>(
    file: &File,
    info: &GridInfo,
    values: Values,
    trilinear: bool,
    cover: Cover<'_>,
    services: Services<'_>,
) -> Result<Loaded<V>, Error> {
    let name = &info.unique_name;
    let fail = |e: resolvent_vdb::Error| Error::new(e.to_string());
    let to_world = transform(info)?;
    let topology = file.read_topology(info).map_err(fail)?;
    let active = topology.active_bbox().map(|b| b.map(|c| c.map(i64::from)));
    let mut domain = active.map(|[lo, hi]| [lo.map(|c| c - 1), hi.map(|c| c + 1)]);
    domain = match (domain, cover.also) {
        (Some(a), Some(b)) => Some(union(a, b)),
        (a, b) => a.or(b),
    };
    let domain = domain.unwrap_or_default();
    let leaves = topology.leaves();
    let count = leaves.len() + topology.tiles().count();
    let also = match cover.also {
        Some(_) => " with the emission beside it",
        None => "",
    };
    let mut index = Index::new(domain, count)
        .map_err(|e| Error::new(format!("the grid '{name}'{also} cannot be indexed: {e}")))?;

    let faults = Mutex::new(Faults::default());
    let shape = || {
        let kind = if size_of::<V>() == 12 {
            "vectors"
        } else {
            "numbers"
        };
        Error::new(format!("the grid {} doesn't hold {kind}", info.summary()))
    };
    let mut constants: Vec<V::Value> = Vec::new();
    let mut known = HashMap::new();
    let mut constant = |value: &resolvent_vdb::Value, at: [i64; 3]| -> Result<u32, Error> {
        let mut value = V::of_tile(value).ok_or_else(shape)?;
        let mut faults = faults.lock().unwrap_or_else(|e| e.into_inner());
        for c in V::components(&mut value) {
            *c = values.apply(*c, &mut faults, usize::MAX, at);
        }
        let bits: Vec<_> = V::components(&mut value)
            .iter()
            .map(|c| c.to_bits())
            .collect();
        let next = constants.len() as u32;
        Ok(UNIFORM
            | *known.entry(bits).or_insert_with(|| {
                constants.push(value);
                next
            }))
    };
    constant(&topology.background(), [0; 3])?;
    for tile in topology.tiles() {
        let origin = tile.origin.map(i64::from);
        let slot = constant(&tile.value, origin)?;
        let log = tile.dim.trailing_zeros().saturating_sub(3);
        index.fill(index.brick_of(origin), log, slot);
    }
    for (i, leaf) in leaves.iter().enumerate() {
        let brick = index.brick_of(leaf.origin.map(i64::from));
        if brick
            .iter()
            .all(|c| (0..=i64::from(i32::MAX >> 3)).contains(c))
        {
            index.set(brick.map(|c| c as i32), i as u32);
        }
    }
    if let Some(prepare) = cover.cells {
        prepare(&mut index);
        if trilinear {
            index.dilate();
        }
    }

    let mut pool: Vec<Brick<V>> = Vec::new();
    pool.try_reserve_exact(leaves.len()).map_err(|_| {
        let bytes = leaves.len() * size_of::<Brick<V>>();
        Error::new(format!(
            "the grid '{name}' needs {bytes} bytes of memory, more than there are"
        ))
    })?;
    pool.resize(leaves.len(), [V::default(); 512]);
    let wrong_shape = std::sync::atomic::AtomicBool::new(false);
    file.read_leaves_into(
        info,
        &topology,
        Halves::Keep,
        services.parallel,
        &mut pool,
        |i, leaf, brick| {
            if !V::copy(&leaf, brick) {
                wrong_shape.store(true, std::sync::atomic::Ordering::Relaxed);
                return;
            }
            let fine = values.is_identity()
                && brick.iter().all(|v| {
                    V::components(&mut v.raw())
                        .iter()
                        .all(|c| values.is_fine(*c))
                });
            if fine {
                return;
            }
            let origin = leaves[i].origin.map(i64::from);
            let mut found = faults.lock().unwrap_or_else(|e| e.into_inner());
            for (k, v) in brick.iter_mut().enumerate() {
                let mut value = v.raw();
                let place = [k >> 6, k >> 3 & 7, k & 7];
                let at = each(|a| origin[a] + place[a] as i64);
                for c in V::components(&mut value) {
                    *c = values.apply(*c, &mut found, i * 512 + k, at);
                }
                *v = V::store(value);
            }
        },
    )
    .map_err(fail)?;
    if wrong_shape.into_inner() {
        return Err(shape());
    }
    report(
        name,
        &faults.into_inner().unwrap_or_else(|e| e.into_inner()),
        values,
        services,
    )?;
    Ok(Loaded {
        grid: Grid {
            index,
            pool,
            constants,
            trilinear,
        },
        to_world,
        active,
        voxels: topology.active_voxels(),
        domain,
    })
}

fn report(
    name: &str,
    faults: &Faults,
    values: Values,
    services: Services<'_>,
) -> Result<(), Error> {
    if faults.infinite.count > 0 {
        let place = faults.infinite.place();
        return Err(Error::new(format!(
            "the grid '{name}' has infinite values ({place})"
        )));
    }
    let warn = |tally: &Tally, what: &str| {
        if tally.count > 0 {
            (services.warn)(&format!("the grid '{name}' has {what} ({})", tally.place()));
        }
    };
    warn(&faults.nan, "values that are no numbers, taken as 0");
    let negative = if values.is_identity() {
        "negative values, taken as 0"
    } else {
        "values that are negative after scale and offset, taken as 0"
    };
    warn(&faults.negative, negative);
    warn(
        &faults.above,
        &format!("values above {:e}, taken as that", values.limit),
    );
    Ok(())
}

/// Smallest box around both.
pub fn union(a: Box3, b: Box3) -> Box3 {
    [
        each(|i| a[0][i].min(b[0][i])),
        each(|i| a[1][i].max(b[1][i])),
    ]
}

/// The lower and upper corner of a box as vectors.
pub fn corners([lo, hi]: Box3) -> (DVec3, DVec3) {
    let v = |c: [i64; 3]| DVec3::new(c[0] as f64, c[1] as f64, c[2] as f64);
    (v(lo), v(hi))
}
