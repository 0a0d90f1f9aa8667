//! Measuring a grid of densities: centre of mass and line integrals, without holding its voxels.

use rayon::prelude::*;
use resolvent_vdb::{
    File, GridInfo, Halves, Parallel, Result, Tile, Topology, Transform, ValueType,
};
use std::collections::HashMap;
use std::sync::Mutex;

/// The threads of the current pool, for the reader.
pub struct Rayon;

impl Parallel for Rayon {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..count).into_par_iter().for_each(task);
    }
}

/// What a density grid is like. Negative values and values that are no numbers count as 0.
#[derive(Clone, Debug)]
pub struct Measures {
    /// Centre of mass, world.
    pub centre: [f64; 3],
    /// Integrals of the grid along the world's x, y and z axes through the centre of mass, value × world length.
    pub lines: [f64; 3],
    /// Mean value of active voxels.
    pub mean: f64,
    /// Largest value.
    pub max: f64,
    /// Box of the active voxels, world.
    pub bounds: [[f64; 3]; 2],
    /// Points whose convex hull is about that of what is not nearly empty, world.
    pub outline: Vec<[f64; 3]>,
}

/// True if a grid holds one real number per voxel.
pub fn is_scalar(info: &GridInfo) -> bool {
    matches!(
        info.value_type,
        Some(ValueType::Float | ValueType::Double | ValueType::Int32 | ValueType::Int64)
    )
}

/// Bytes of one value in memory.
pub fn value_bytes(info: &GridInfo) -> u64 {
    let component = match info.value_type {
        Some(ValueType::Float | ValueType::Vec3s) if info.saved_as_half => 2,
        Some(ValueType::Float | ValueType::Vec3s | ValueType::Int32 | ValueType::Vec3i) => 4,
        Some(ValueType::Double | ValueType::Vec3d | ValueType::Int64) => 8,
        Some(ValueType::Bool | ValueType::Mask) | None => 1,
    };
    component * info.value_type.map_or(1, |t| t.components() as u64)
}

/// The world box around voxels `b` (index coordinates, both ends included), their full extent counted.
pub fn world_box(t: &Transform, b: [[i32; 3]; 2]) -> [[f64; 3]; 2] {
    let mut out = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for corner in corners(b) {
        let p = t.to_world(corner);
        for a in 0..3 {
            out[0][a] = out[0][a].min(p[a]);
            out[1][a] = out[1][a].max(p[a]);
        }
    }
    out
}

/// The eight corners of voxels `b`, index coordinates.
pub fn corners(b: [[i32; 3]; 2]) -> [[f64; 3]; 8] {
    std::array::from_fn(|i| {
        [0, 1, 2].map(|a| {
            if i >> a & 1 == 0 {
                f64::from(b[0][a]) - 0.5
            } else {
                f64::from(b[1][a]) + 0.5
            }
        })
    })
}

/// Mass and where it is, index coordinates.
#[derive(Clone, Copy, Default)]
struct Mass {
    sum: f64,
    moment: [f64; 3],
    max: f64,
}

impl Mass {
    fn add(&mut self, value: f64, at: [f64; 3], volume: f64) {
        // A NaN fails the comparison.
        if value > 0.0 && value.is_finite() {
            self.sum += value * volume;
            for (m, x) in self.moment.iter_mut().zip(at) {
                *m += value * volume * x;
            }
            self.max = self.max.max(value);
        }
    }

    fn merge(&mut self, o: &Self) {
        self.sum += o.sum;
        for (m, x) in self.moment.iter_mut().zip(o.moment) {
            *m += x;
        }
        self.max = self.max.max(o.max);
    }
}

/// Measures a grid; `None` if nothing in it is positive.
///
/// # Errors
/// What the grid is damaged by.
pub fn measure(file: &File, info: &GridInfo) -> Result<Option<Measures>> {
    let topology = file.read_topology(info)?;
    let (Some(transform), Some(active)) = (&info.transform, topology.active_bbox()) else {
        return Ok(None);
    };
    let (mass, leaves) = mass(file, info, &topology)?;
    if mass.sum <= 0.0 {
        return Ok(None);
    }
    let centre = mass.moment.map(|m| m / mass.sum);
    let lines = Lines::new(transform, active, centre);
    let lines = lines.integrate(file, info, &topology)?;
    Ok(Some(Measures {
        centre: transform.to_world(centre),
        lines,
        mean: mass.sum / topology.active_voxels().max(1) as f64,
        max: mass.max,
        bounds: world_box(transform, active),
        outline: outline(transform, &topology, &leaves, mass.max),
    }))
}

/// The mass of the grid, and that of each leaf.
fn mass(file: &File, info: &GridInfo, topology: &Topology) -> Result<(Mass, Vec<Mass>)> {
    // One slot per leaf, added up in order: the sums do not depend on the threads.
    let mut slots = vec![Mass::default(); topology.leaves().len()];
    file.read_leaves_into(
        info,
        topology,
        Halves::Widen,
        &Rayon,
        &mut slots,
        |index, values, slot| {
            let leaf = &topology.leaves()[index];
            for k in (0..512).filter(|k| leaf.is_active(*k)) {
                let at = [k >> 6, k >> 3 & 7, k & 7];
                let at = [0, 1, 2].map(|a| f64::from(leaf.origin[a]) + at[a] as f64);
                slot.add(values.get(k).to_f64()[0], at, 1.0);
            }
        },
    )?;
    let mut all = Mass::default();
    slots.iter().for_each(|m| all.merge(m));
    for t in topology.tiles().filter(|t| t.active) {
        let side = f64::from(t.dim);
        let at = t.origin.map(|o| f64::from(o) + 0.5 * (side - 1.0));
        all.add(t.value.to_f64()[0], at, side.powi(3));
    }
    Ok((all, slots))
}

/// Values below this share of the largest are a veil that a picture need not hold.
const VEIL: f64 = 0.005;
/// Directions in which the outline is searched.
const DIRECTIONS: usize = 256;

/// The farthest points of leaves and tiles in many directions: the vertices of a polytope inside the convex hull.
fn outline(transform: &Transform, topology: &Topology, masses: &[Mass], max: f64) -> Vec<[f64; 3]> {
    let leaves = topology.leaves().iter().zip(masses);
    let leaves = leaves
        .filter(|(_, m)| m.max > VEIL * max)
        .filter_map(|(l, _)| l.active_bbox());
    let tiles = topology
        .tiles()
        .filter(|t| t.active && t.value.to_f64()[0] > VEIL * max)
        .map(|t| {
            [
                t.origin,
                t.origin.map(|o| o.saturating_add(t.dim as i32 - 1)),
            ]
        });
    let directions: Vec<[f64; 3]> = (0..DIRECTIONS).map(|i| spread(i, DIRECTIONS)).collect();
    let mut best = vec![(f64::NEG_INFINITY, [0.0; 3]); DIRECTIONS];
    for corner in leaves.chain(tiles).flat_map(corners) {
        let p = transform.to_world(corner);
        for (d, best) in directions.iter().zip(&mut best) {
            let reach = d[0] * p[0] + d[1] * p[1] + d[2] * p[2];
            if reach > best.0 {
                *best = (reach, p);
            }
        }
    }
    best.into_iter().map(|(_, p)| p).collect()
}

/// Direction `i` of a Fibonacci lattice of `count` on the sphere.
pub fn spread(i: usize, count: usize) -> [f64; 3] {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
    let angle = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    [r * angle.cos(), r * angle.sin(), z]
}

/// Three lines through a point, as samples in index coordinates.
struct Lines {
    samples: [Vec<[f64; 3]>; 3],
    /// World length between samples.
    step: [f64; 3],
}

/// Samples per voxel along a line.
const PER_VOXEL: f64 = 4.0;
/// Most samples on a line: sparse grids can be very long.
const MOST: f64 = 100_000.0;

impl Lines {
    fn new(transform: &Transform, active: [[i32; 3]; 2], centre: [f64; 3]) -> Self {
        let mut samples: [Vec<[f64; 3]>; 3] = Default::default();
        let mut steps = [0.0; 3];
        let origin = transform.to_world(centre);
        for axis in 0..3 {
            // One world unit along the axis, in index coordinates.
            let mut tip = origin;
            tip[axis] += 1.0;
            let Some(tip) = transform.to_index(tip) else {
                continue;
            };
            let d = [0, 1, 2].map(|a| tip[a] - centre[a]);
            let Some((t0, t1)) = clip(centre, d, active) else {
                continue;
            };
            let speed = d.iter().map(|x| x * x).sum::<f64>().sqrt();
            let count = ((t1 - t0) * speed * PER_VOXEL).ceil().clamp(1.0, MOST);
            steps[axis] = (t1 - t0) / count;
            samples[axis] = (0..count as usize)
                .map(|i| {
                    let t = t0 + (i as f64 + 0.5) * steps[axis];
                    [0, 1, 2].map(|a| centre[a] + t * d[a])
                })
                .collect();
        }
        Self {
            samples,
            step: steps,
        }
    }

    /// The integrals by the midpoint rule, values interpolated trilinearly.
    fn integrate(&self, file: &File, info: &GridInfo, topology: &Topology) -> Result<[f64; 3]> {
        let leaves: HashMap<[i32; 3], usize> = topology
            .leaves()
            .iter()
            .enumerate()
            .map(|(i, l)| (l.origin, i))
            .collect();
        let mut needed = vec![false; topology.leaves().len()];
        for p in self.samples.iter().flatten() {
            for (at, _) in taps(*p) {
                if let Some(i) = leaves.get(&at.map(|c| c & !7)) {
                    needed[*i] = true;
                }
            }
        }
        let kept: Mutex<HashMap<usize, Box<[f64]>>> = Mutex::default();
        file.read_leaves(info, topology, Halves::Widen, &Rayon, |i, values| {
            if needed[i] {
                let values = (0..512).map(|k| values.get(k).to_f64()[0]).collect();
                let mut kept = kept.lock().unwrap_or_else(|e| e.into_inner());
                kept.insert(i, values);
            }
        })?;
        let kept = kept.into_inner().unwrap_or_else(|e| e.into_inner());
        let tiles: HashMap<(u32, [i32; 3]), Tile> =
            topology.tiles().map(|t| ((t.dim, t.origin), t)).collect();
        let background = topology.background().to_f64()[0];
        let value = |at: [i32; 3]| -> f64 {
            if let Some(values) = leaves.get(&at.map(|c| c & !7)).and_then(|i| kept.get(i)) {
                let k = (at[0] & 7) << 6 | (at[1] & 7) << 3 | at[2] & 7;
                return values[k as usize];
            }
            [8, 128, 4096]
                .iter()
                .find_map(|dim| tiles.get(&(*dim, at.map(|c| c & !(*dim as i32 - 1)))))
                .map_or(background, |t| t.value.to_f64()[0])
        };
        let density = |p: [f64; 3]| -> f64 {
            let sum: f64 = taps(p).map(|(at, w)| w * positive(value(at))).sum();
            sum
        };
        Ok([0, 1, 2].map(|axis| {
            self.samples[axis].iter().map(|p| density(*p)).sum::<f64>() * self.step[axis]
        }))
    }
}

/// The voxels that a trilinear interpolation looks at, with their weights.
fn taps(p: [f64; 3]) -> impl Iterator<Item = ([i32; 3], f64)> {
    let low = p.map(|c| c.floor() as i32);
    let f = [0, 1, 2].map(|a| p[a] - f64::from(low[a]));
    (0..8).map(move |n| {
        let bit = |a: usize| n >> a & 1;
        let at = [0, 1, 2].map(|a| low[a].saturating_add(bit(a)));
        let w = [0, 1, 2].map(|a| if bit(a) == 1 { f[a] } else { 1.0 - f[a] });
        (at, w[0] * w[1] * w[2])
    })
}

fn positive(v: f64) -> f64 {
    if v > 0.0 && v.is_finite() { v } else { 0.0 }
}

/// Where a line is inside the active voxels, one more on each side (where interpolation still sees them).
fn clip(o: [f64; 3], d: [f64; 3], active: [[i32; 3]; 2]) -> Option<(f64, f64)> {
    let (mut t0, mut t1) = (f64::NEG_INFINITY, f64::INFINITY);
    for a in 0..3 {
        let lo = f64::from(active[0][a]) - 1.0 - o[a];
        let hi = f64::from(active[1][a]) + 1.0 - o[a];
        if d[a] == 0.0 {
            if lo > 0.0 || hi < 0.0 {
                return None;
            }
            continue;
        }
        let (n, f) = (lo / d[a], hi / d[a]);
        t0 = t0.max(n.min(f));
        t1 = t1.min(n.max(f));
    }
    (t0 < t1 && t0.is_finite() && t1.is_finite()).then_some((t0, t1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_vdb::Tree;
    use std::path::Path;

    fn data(name: &str) -> File {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../formats/vdb/tests/data");
        File::open(folder.join(name)).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Against the reader's own interpolation of the whole tree, integrated by Simpson's rule in finer steps.
    #[test]
    fn lines_agree_with_the_whole_tree() {
        for name in [
            "cloud_s.vdb",
            "real/smoke_000002.vdb",
            "corpus/xform_affine_rotscale.vdb",
            "corpus/tiles_zip.vdb",
        ] {
            let file = data(name);
            let info = &file.grids()[0];
            let m = measure(&file, info).unwrap().unwrap();
            let tree = Tree::read(&file, info, &Rayon).unwrap();
            let transform = info.transform.as_ref().unwrap();
            for axis in 0..3 {
                let (lo, hi) = (m.bounds[0][axis], m.bounds[1][axis]);
                let pad = transform.voxel_size().into_iter().fold(0.0, f64::max);
                let (lo, hi) = (lo - pad, hi + pad);
                let n = 40_000;
                let at = |i: usize| {
                    let mut p = m.centre;
                    p[axis] = lo + (hi - lo) * i as f64 / n as f64;
                    positive(tree.sample(transform.to_index(p).unwrap())[0])
                };
                let weight = |i: usize| match i {
                    0 => 1.0,
                    i if i == n => 1.0,
                    i => 2.0 + 2.0 * (i % 2) as f64,
                };
                let sum: f64 = (0..=n).map(|i| weight(i) * at(i)).sum();
                let expected = sum * (hi - lo) / (3 * n) as f64;
                assert!(
                    (m.lines[axis] / expected - 1.0).abs() < 2e-3,
                    "{name} {axis}: {} {expected}",
                    m.lines[axis]
                );
            }
        }
    }

    /// A box of one value, of tiles and leaves: its middle is its centre of mass, and its edges its thickness.
    #[test]
    fn a_box_of_tiles() {
        let file = data("corpus/tiles_bigbox.vdb");
        let info = &file.grids()[0];
        let m = measure(&file, info).unwrap().unwrap();
        let [lo, hi] = m.bounds;
        for axis in 0..3 {
            let edge = hi[axis] - lo[axis];
            assert!((m.centre[axis] - 0.5 * (lo[axis] + hi[axis])).abs() < 1e-6 * edge);
            assert!((m.lines[axis] / (m.max * edge) - 1.0).abs() < 1e-3, "{m:?}");
        }
        assert!((m.mean / m.max - 1.0).abs() < 1e-9);
    }
}
