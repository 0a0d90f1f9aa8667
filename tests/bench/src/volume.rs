//! Volumes of any size, made at run time: writes the one kind of OpenVDB file that needs no library, and dense arrays for peers.

use crate::error::{Error, Result};
use resolvent_vdb::{File, Halves, Serial};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Edges of leaves and of the nodes above them, voxels.
const LEAF: i32 = 8;
const LOWER: i32 = 128;
const UPPER: i32 = 4096;

/// Voxels round the origin, to be written as a file.
pub struct Voxels<'a> {
    /// No coordinate of a voxel that is not 0 is beyond ± this.
    pub reach: i32,
    /// Edge of a voxel.
    pub size: f64,
    /// The value at a voxel; those that are not 0 are active.
    pub value: &'a dyn Fn([i32; 3]) -> f32,
}

/// A round cloud of about `voxels` active voxels: a ball that thins out towards its rim, with waves in it.
///
/// Values are 0.2 to 1 inside; products of sines per axis, so that hundreds of millions of them are quick to make.
#[derive(Clone, Debug)]
pub struct Ball {
    /// Radius in voxels.
    radius: f64,
    waves: Vec<f32>,
}

/// Origin and mask of active voxels.
type Place = ([i32; 3], [u8; 64]);

impl Ball {
    /// A ball of about this many voxels.
    pub fn new(voxels: f64) -> Self {
        let radius = (voxels * 0.75 / std::f64::consts::PI).cbrt();
        let r = radius.ceil() as i32 + 1;
        // Seven waves across at every size.
        let wave = |i: i32| (f64::from(i) / radius * 7.0 * std::f64::consts::PI).sin() as f32;
        Self {
            radius,
            waves: (-r..=r).map(wave).collect(),
        }
    }

    fn value(&self, [x, y, z]: [i32; 3]) -> f32 {
        let r2 = f64::from(x).powi(2) + f64::from(y).powi(2) + f64::from(z).powi(2);
        let inside = 1.0 - r2 / (self.radius * self.radius);
        if inside <= 0.0 {
            return 0.0;
        }
        let middle = (self.waves.len() / 2) as i32;
        let wave = |i: i32| self.waves[(i + middle) as usize];
        let waves = 0.6 + 0.4 * wave(x) * wave(y) * wave(z);
        waves * (4.0 * inside).min(1.0) as f32
    }

    /// Writes the ball, of radius 1 round the origin, as the float grid `density`. Returns the number of active voxels.
    pub fn write(&self, path: &Path) -> Result<u64> {
        let voxels = Voxels {
            reach: self.radius.ceil() as i32,
            size: 1.0 / self.radius,
            value: &|at| self.value(at),
        };
        voxels.write(path)
    }
}

type Leaf = [f32; 512];

impl Voxels<'_> {
    /// Writes the float grid `density`. Returns the number of active voxels.
    pub fn write(&self, path: &Path) -> Result<u64> {
        let file = std::fs::File::create(path).map_err(Error::io(path))?;
        let mut out = BufWriter::with_capacity(1 << 20, file);
        let count = self.write_to(&mut out).map_err(Error::io(path))?;
        out.flush().map_err(Error::io(path))?;
        Ok(count)
    }

    /// The values of the leaf at an origin; x varies slowest. `None` if all are 0.
    fn leaf(&self, origin: [i32; 3]) -> Option<Leaf> {
        let mut out = [0.0; 512];
        for (i, v) in out.iter_mut().enumerate() {
            let i = i as i32;
            let at = [i >> 6, i >> 3 & 7, i & 7];
            *v = (self.value)([0, 1, 2].map(|k| origin[k] + at[k]));
        }
        out.iter().any(|v| *v != 0.0).then_some(out)
    }

    /// Origins of nodes of an edge that the voxels may reach, within a larger node; by x, y, z.
    fn nodes(&self, edge: i32, within: Option<([i32; 3], i32)>) -> Vec<[i32; 3]> {
        let range = |k: usize| {
            let r = self.reach;
            let (low, high) =
                within.map_or((-r, r), |(o, e)| (o[k].max(-r), (o[k] + e - 1).min(r)));
            (low.div_euclid(edge)..=high.div_euclid(edge)).map(move |n| n * edge)
        };
        let mut all = Vec::new();
        for x in range(0) {
            for y in range(1) {
                all.extend(range(2).map(|z| [x, y, z]));
            }
        }
        all
    }

    fn write_to(&self, out: &mut impl Write) -> std::io::Result<u64> {
        let (topology, leaves) = self.topology();
        let mut head = header();
        let mut grid = description(self.size);
        grid.extend(topology);
        let (mut active, mut length) = (0u64, 0u64);
        for (_, mask) in &leaves {
            let count = mask.iter().map(|b| u64::from(b.count_ones())).sum::<u64>();
            active += count;
            length += 65 + 4 * count;
        }
        let start = head.len() as u64 + 24;
        let blocks = start + grid.len() as u64;
        for offset in [start, blocks, blocks + length] {
            head.extend(offset.to_le_bytes());
        }
        out.write_all(&head)?;
        out.write_all(&grid)?;
        for (origin, mask) in &leaves {
            out.write_all(mask)?;
            out.write_all(&[0])?; // inactive voxels have the background's value
            let values = self.leaf(*origin).into_iter().flatten();
            for v in values.filter(|v| *v != 0.0) {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        Ok(active)
    }

    /// The tree without its values, and origin and mask of every leaf in the file's order: upper nodes, in them lower nodes, in
    /// them leaves.
    fn topology(&self) -> (Vec<u8>, Vec<Place>) {
        let (mut bytes, mut leaves) = (Vec::new(), Vec::new());
        let uppers = self.nodes(UPPER, None);
        bytes.extend((uppers.len() as u32).to_le_bytes());
        for upper in uppers {
            let mut lowers = Vec::new();
            for lower in self.nodes(LOWER, Some((upper, UPPER))) {
                let inside: Vec<_> = self
                    .nodes(LEAF, Some((lower, LOWER)))
                    .into_iter()
                    .filter_map(|o| self.leaf(o).map(|v| (o, mask_of(&v))))
                    .collect();
                if !inside.is_empty() {
                    lowers.push((lower, inside));
                }
            }
            bytes.extend(upper.iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend(node(UPPER, upper, LOWER, lowers.iter().map(|l| l.0)));
            for (lower, inside) in lowers {
                bytes.extend(node(LOWER, lower, LEAF, inside.iter().map(|l| l.0)));
                inside.iter().for_each(|l| bytes.extend(l.1));
                leaves.extend(inside);
            }
        }
        (bytes, leaves)
    }
}

fn mask_of(values: &Leaf) -> [u8; 64] {
    let mut mask = [0; 64];
    for (i, v) in values.iter().enumerate() {
        mask[i / 8] |= u8::from(*v != 0.0) << (i % 8);
    }
    mask
}

/// A node's masks of children and of active tiles (none), and the code for values (none).
fn node(
    edge: i32,
    origin: [i32; 3],
    step: i32,
    children: impl Iterator<Item = [i32; 3]>,
) -> Vec<u8> {
    let n = (edge / step) as usize;
    let mut masks = vec![0u8; 2 * n * n * n / 8];
    for c in children {
        let at = [0, 1, 2].map(|k| ((c[k] - origin[k]) / step) as usize);
        let slot = (at[0] * n + at[1]) * n + at[2];
        masks[slot / 8] |= 1 << (slot % 8);
    }
    masks.push(0);
    masks
}

fn text(t: &str) -> Vec<u8> {
    [&(t.len() as u32).to_le_bytes()[..], t.as_bytes()].concat()
}

/// Of a file with one grid, up to the grid's offsets.
fn header() -> Vec<u8> {
    let mut out = 0x5644_4220_i64.to_le_bytes().to_vec();
    for word in [224u32, 10, 0] {
        out.extend(word.to_le_bytes());
    }
    out.push(1); // grids know their offsets
    out.extend([b'0'; 36]);
    out.extend(0u32.to_le_bytes());
    out.extend(1i32.to_le_bytes());
    for part in ["density", "Tree_float_5_4_3", ""] {
        out.extend(text(part));
    }
    out
}

/// A grid up to the number of its root's children.
fn description(size: f64) -> Vec<u8> {
    let mut out = 2u32.to_le_bytes().to_vec(); // values of active voxels only
    out.extend(1u32.to_le_bytes());
    for part in ["class", "string", "fog volume"] {
        out.extend(text(part));
    }
    out.extend(text("UniformScaleMap"));
    // scale, voxel size, inverse scale, its square, half of the inverse
    for v in [size, size, 1.0 / size, size.powi(-2), 0.5 / size] {
        (0..3).for_each(|_| out.extend(v.to_le_bytes()));
    }
    out.extend(1u32.to_le_bytes()); // buffers
    out.extend(0f32.to_le_bytes()); // background
    out.extend(0u32.to_le_bytes()); // tiles of the root
    out
}

/// Writes a grid as a dense array for programs that read no OpenVDB: `f32`, x fastest, with one voxel of background round the
/// active ones; beside it, as JSON, shape, first voxel and the map from voxels to the world (rows of a 4 × 4 matrix).
pub fn write_dense(vdb: &Path, grid: &str, to: &Path) -> Result<()> {
    let file = File::open(vdb)?;
    let info = file.grid(grid)?;
    let topology = file.read_topology(info)?;
    if topology.tiles().next().is_some() {
        return Err(Error::invalid(format!(
            "{}: has tiles, which are not made dense",
            vdb.display()
        )));
    }
    let mut leaves = vec![[0f32; 512]; topology.leaves().len()];
    file.read_leaves_into(
        info,
        &topology,
        Halves::Widen,
        &Serial,
        &mut leaves,
        |_, values, brick| {
            let _ = values.to_f32(brick);
        },
    )?;
    let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
    for_active(&topology, |at, _, _| {
        low = [0, 1, 2].map(|k| at[k].min(low[k]));
        high = [0, 1, 2].map(|k| at[k].max(high[k]));
    });
    let low = low.map(|v| v - 1);
    let shape = [0, 1, 2].map(|k| (high[k] + 2 - low[k]) as usize);
    let mut dense = vec![0f32; shape[0] * shape[1] * shape[2]];
    for_active(&topology, |at, leaf, i| {
        let p = [0, 1, 2].map(|k| (at[k] - low[k]) as usize);
        dense[(p[2] * shape[1] + p[1]) * shape[0] + p[0]] = leaves[leaf][i];
    });
    let Some(transform) = &info.transform else {
        return Err(Error::invalid(format!(
            "{}: grid '{grid}' has a transform that is not linear",
            vdb.display()
        )));
    };
    let world = |at: [f64; 3]| transform.to_world(at);
    let origin = world([0.0; 3]);
    let column = |k: usize| {
        let mut unit = [0.0; 3];
        unit[k] = 1.0;
        let p = world(unit);
        [0, 1, 2].map(|i| p[i] - origin[i])
    };
    let columns = [column(0), column(1), column(2)];
    let rows: Vec<[f64; 4]> = (0..3)
        .map(|i| [columns[0][i], columns[1][i], columns[2][i], origin[i]])
        .collect();
    let json = serde_json::json!({"shape": shape, "first": low, "to_world": rows});
    let side = to.with_extension("json");
    std::fs::write(&side, json.to_string()).map_err(Error::io(&side))?;
    let bytes: Vec<u8> = dense.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(to, bytes).map_err(Error::io(to))
}

/// Calls `f` with place, leaf and offset of every active voxel.
fn for_active(topology: &resolvent_vdb::Topology, mut f: impl FnMut([i32; 3], usize, usize)) {
    for (n, leaf) in topology.leaves().iter().enumerate() {
        for i in 0..512usize {
            if leaf.mask[i / 64] >> (i % 64) & 1 == 1 {
                let at = [i >> 6, i >> 3 & 7, i & 7];
                f([0, 1, 2].map(|k| leaf.origin[k] + at[k] as i32), n, i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is written is read again: counts, values, places.
    #[test]
    fn reads_what_it_writes() {
        let folder = std::env::temp_dir().join(format!("resolvent-bench-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        // Across the origin, where eight upper nodes meet.
        for voxels in [1.0, 600.0, 30_000.0] {
            let path = folder.join("ball.vdb");
            let ball = Ball::new(voxels);
            let active = ball.write(&path).unwrap();
            assert!(
                (active as f64 / voxels - 1.0).abs() < 0.2 || voxels < 2.0,
                "{active}"
            );
            let file = File::open(&path).unwrap();
            let grid = file.grid("density").unwrap();
            let topology = file.read_topology(grid).unwrap();
            let mut count = 0;
            let mut leaves = vec![[0f32; 512]; topology.leaves().len()];
            file.read_leaves_into(
                grid,
                &topology,
                Halves::Widen,
                &Serial,
                &mut leaves,
                |_, v, out| {
                    let _ = v.to_f32(out);
                },
            )
            .unwrap();
            for_active(&topology, |at, leaf, i| {
                count += 1;
                assert_eq!(leaves[leaf][i], ball.value(at), "{at:?}");
            });
            assert_eq!(count, active);
            let world = grid.transform.as_ref().unwrap().to_world([3.0, 0.0, 0.0]);
            assert!((world[0] - 3.0 / ball.radius).abs() < 1e-12);

            write_dense(&path, "density", &folder.join("ball.raw")).unwrap();
            let dense = std::fs::read(folder.join("ball.raw")).unwrap();
            let sum: f64 = dense
                .chunks_exact(4)
                .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
                .sum();
            let expected: f64 = leaves.iter().flatten().map(|v| f64::from(*v)).sum();
            assert!((sum / expected - 1.0).abs() < 1e-12);
        }
        let _ = std::fs::remove_dir_all(folder);
    }
}
