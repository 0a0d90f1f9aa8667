//! Volumes of any size, made at run time: writes the one kind of OpenVDB file that needs no library, and dense arrays for peers.

use crate::error::{Error, Result};
use resolvent_vdb::{File, Halves, Serial};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Edges of leaves and of the nodes above them, voxels.
const LEAF: i32 = 8;
const LOWER: i32 = 128;
const UPPER: i32 = 4096;

/// A round cloud of about `voxels` active voxels: a ball that thins out towards its rim, with waves in it.
///
/// Values are 0.2 to 1 inside; sums of sines per axis, so that hundreds of millions of them are quick to make.
#[derive(Clone, Debug)]
pub struct Ball {
    /// Radius in voxels.
    radius: f64,
    waves: Vec<f32>,
}

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

    /// Edge of a voxel if the ball's radius is 1.
    pub fn voxel_size(&self) -> f64 {
        1.0 / self.radius
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

    /// The 512 values of the leaf at an origin; x varies slowest. `None` if all are 0.
    fn leaf(&self, origin: [i32; 3]) -> Option<[f32; 512]> {
        // The nearest and farthest a voxel of the leaf can be.
        let near = origin.map(|o| f64::from(o.max(-o - LEAF + 1).max(0)));
        if near.iter().map(|d| d * d).sum::<f64>() >= self.radius * self.radius {
            return None;
        }
        let mut out = [0.0; 512];
        for (i, v) in out.iter_mut().enumerate() {
            let i = i as i32;
            let at = [i >> 6, i >> 3 & 7, i & 7];
            *v = self.value([0, 1, 2].map(|k| origin[k] + at[k]));
        }
        out.iter().any(|v| *v > 0.0).then_some(out)
    }

    /// Writes the ball, of radius 1 round the origin, as the float grid `density`. Returns the number of active voxels.
    pub fn write(&self, path: &Path) -> Result<u64> {
        let file = std::fs::File::create(path).map_err(Error::io(path))?;
        let mut out = BufWriter::with_capacity(1 << 20, file);
        let count = self.write_to(&mut out).map_err(Error::io(path))?;
        out.flush().map_err(Error::io(path))?;
        Ok(count)
    }

    fn write_to(&self, out: &mut impl Write) -> std::io::Result<u64> {
        let r = self.radius.ceil() as i32 + 1;
        let nodes = |edge: i32, low: i32, high: i32| {
            (low.div_euclid(edge)..=high.div_euclid(edge)).map(move |k| k * edge)
        };
        let cells = |edge: i32, within: Option<([i32; 3], i32)>| -> Vec<[i32; 3]> {
            let range = |k: usize| {
                let (low, high) =
                    within.map_or((-r, r), |(o, e)| (o[k].max(-r), (o[k] + e - 1).min(r)));
                nodes(edge, low, high).collect::<Vec<_>>()
            };
            let (xs, ys, zs) = (range(0), range(1), range(2));
            let mut all = Vec::new();
            for x in &xs {
                for y in &ys {
                    all.extend(zs.iter().map(|z| [*x, *y, *z]));
                }
            }
            all
        };
        let mask_of = |values: &[f32; 512]| {
            let mut mask = [0u8; 64];
            for (i, v) in values.iter().enumerate() {
                mask[i / 8] |= u8::from(*v > 0.0) << (i % 8);
            }
            mask
        };
        // Masks of children and of active tiles (none), then the code of a node without values.
        let node = |edge: i32, origin: [i32; 3], step: i32, children: &[[i32; 3]]| {
            let n = (edge / step) as usize;
            let mut masks = vec![0u8; 2 * n * n * n / 8];
            for c in children {
                let at = [0, 1, 2].map(|k| ((c[k] - origin[k]) / step) as usize);
                let slot = (at[0] * n + at[1]) * n + at[2];
                masks[slot / 8] |= 1 << (slot % 8);
            }
            masks.push(0);
            masks
        };
        // Leaves in the file's order: upper nodes, in them lower nodes, in them leaves, each by x, y, z.
        let mut leaves: Vec<[i32; 3]> = Vec::new();
        let mut topology = Vec::new();
        let uppers = cells(UPPER, None);
        for upper in &uppers {
            topology.extend(upper.iter().flat_map(|c| c.to_le_bytes()));
            let mut lowers = Vec::new();
            for lower in cells(LOWER, Some((*upper, UPPER))) {
                let inside: Vec<_> = cells(LEAF, Some((lower, LOWER)))
                    .into_iter()
                    .filter_map(|o| self.leaf(o).map(|v| (o, mask_of(&v))))
                    .collect();
                if !inside.is_empty() {
                    lowers.push((lower, inside));
                }
            }
            let origins: Vec<_> = lowers.iter().map(|l| l.0).collect();
            topology.extend(node(UPPER, *upper, LOWER, &origins));
            for (lower, inside) in lowers {
                let origins: Vec<_> = inside.iter().map(|l| l.0).collect();
                topology.extend(node(LOWER, lower, LEAF, &origins));
                inside.iter().for_each(|l| topology.extend(l.1));
                leaves.extend(origins);
            }
        }

        let text = |t: &str| [&(t.len() as u32).to_le_bytes()[..], t.as_bytes()].concat();
        let mut head = 0x5644_4220_i64.to_le_bytes().to_vec();
        for word in [224u32, 10, 0] {
            head.extend(word.to_le_bytes());
        }
        head.push(1); // grids know their offsets
        head.extend([b'0'; 36]);
        head.extend(0u32.to_le_bytes());
        head.extend(1i32.to_le_bytes());
        for part in ["density", "Tree_float_5_4_3", ""] {
            head.extend(text(part));
        }
        let mut grid = 2u32.to_le_bytes().to_vec(); // values of active voxels only
        grid.extend(1u32.to_le_bytes());
        for part in ["class", "string", "fog volume"] {
            grid.extend(text(part));
        }
        grid.extend(text("UniformScaleMap"));
        let size = self.voxel_size();
        // scale, voxel size, inverse scale, its square, half of the inverse
        let (inverse, half) = (1.0 / size, 0.5 / size);
        for v in [size, size, inverse, inverse * inverse, half] {
            (0..3).for_each(|_| grid.extend(v.to_le_bytes()));
        }
        grid.extend(1u32.to_le_bytes()); // buffers
        grid.extend(0f32.to_le_bytes()); // background
        grid.extend(0u32.to_le_bytes()); // tiles of the root
        grid.extend((uppers.len() as u32).to_le_bytes());
        grid.extend(topology);

        let mut active = 0u64;
        let mut values_length = 0u64;
        for o in &leaves {
            let mask = self.leaf(*o).map_or([0; 64], |v| mask_of(&v));
            let count: u32 = mask.iter().map(|b| b.count_ones()).sum();
            active += u64::from(count);
            values_length += 65 + 4 * u64::from(count);
        }
        let start = head.len() as u64 + 24;
        let blocks = start + grid.len() as u64;
        for offset in [start, blocks, blocks + values_length] {
            head.extend(offset.to_le_bytes());
        }
        out.write_all(&head)?;
        out.write_all(&grid)?;
        for o in &leaves {
            let Some(values) = self.leaf(*o) else {
                continue;
            };
            out.write_all(&mask_of(&values))?;
            out.write_all(&[0])?; // inactive voxels have the background's value
            for v in values.iter().filter(|v| **v > 0.0) {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        Ok(active)
    }
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
        for k in 0..3 {
            low[k] = low[k].min(at[k]);
            high[k] = high[k].max(at[k]);
        }
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
            assert!((world[0] - 3.0 * ball.voxel_size()).abs() < 1e-12);

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
