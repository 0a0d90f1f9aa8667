//! The grid of bounds, and rays walking through it (Amanatides & Woo 1987).

use super::Density;
use glam::UVec3;
use resolvent_api::Vec3;
use resolvent_api::params::Host;
use std::sync::OnceLock;

/// How far beyond its cell a bound holds, in cells: covers what rounding does to positions.
const MARGIN: f32 = 1e-3;

/// What is known about the density in a cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounds {
    /// Lower bound.
    pub least: f32,
    /// Upper bound.
    pub most: f32,
    /// Mean of eight points.
    pub mean: f32,
}

/// The grid; its coordinates run from 0 to the number of cells along each axis.
pub struct Grid {
    counts: [i32; 3],
    cells: Vec<Bounds>,
}

/// A ray on its way through the grid.
pub struct Walk {
    /// Position at `start` and its change per unit of t.
    from: Vec3,
    rate: Vec3,
    start: f32,
    /// How far the walk has come, and where it ends.
    t: f32,
    end: f32,
    /// The cell that `t` is about to enter.
    cell: [i32; 3],
    /// Where the ray leaves it along each axis.
    leave: [f32; 3],
    /// Corner of the cell last returned.
    corner: Vec3,
}

impl Walk {
    /// Position at `t`, kept within the cell last returned: rounding must not carry it to where another bound holds.
    #[inline(always)]
    pub fn at(&self, t: f32) -> Vec3 {
        (self.from + (t - self.start) * self.rate).clamp(self.corner, self.corner + 1.0)
    }

    /// Where the ray leaves `cell` along axis `i`; from the start each time, so that no error builds up.
    #[inline(always)]
    fn border(&self, i: usize) -> f32 {
        let ahead = self.cell[i] + i32::from(self.rate[i] > 0.0);
        if self.rate[i] == 0.0 {
            f32::INFINITY
        } else {
            self.start + (ahead as f32 - self.from[i]) / self.rate[i]
        }
    }
}

impl Grid {
    /// Bounds of `density` in `counts` cells, layer by layer on the host's threads.
    pub fn new(host: Host, counts: UVec3, density: &Density) -> Self {
        let layers: Vec<OnceLock<Vec<Bounds>>> = (0..counts.z).map(|_| OnceLock::new()).collect();
        host.parallel_for(layers.len(), |z| {
            layers[z].get_or_init(|| layer(counts, z as u32, density));
        });
        Self {
            counts: counts.as_ivec3().to_array(),
            cells: layers
                .into_iter()
                .flat_map(|l| l.into_inner().unwrap_or_default())
                .collect(),
        }
    }

    /// Largest upper bound.
    pub fn largest(&self) -> f32 {
        self.cells.iter().fold(0.0, |m, c| m.max(c.most))
    }

    /// Bytes held.
    pub fn memory(&self) -> u64 {
        size_of_val(&self.cells[..]) as u64
    }

    /// Starts a walk at position `from` for t = `start`, moving by `rate` per unit of t.
    pub fn walk(&self, from: Vec3, rate: Vec3, start: f32, end: f32) -> Option<Walk> {
        if !(start < end) {
            return None;
        }
        let cell = [0, 1, 2].map(|i| (from[i].floor() as i32).clamp(0, self.counts[i] - 1));
        let mut walk = Walk {
            from,
            rate,
            start,
            t: start,
            end,
            cell,
            leave: [0.0; 3],
            corner: Vec3::ZERO,
        };
        walk.leave = [0, 1, 2].map(|i| walk.border(i));
        Some(walk)
    }

    /// The next cell that holds anything: where the ray enters and leaves it.
    #[inline]
    pub fn next(&self, w: &mut Walk) -> Option<(f32, f32, Bounds)> {
        while w.t < w.end {
            let [x, y, z] = w.cell;
            let [nx, ny, _] = self.counts;
            let bounds = self.cells[((z * ny + y) * nx + x) as usize];
            let axis = if w.leave[0] <= w.leave[1] && w.leave[0] <= w.leave[2] {
                0
            } else if w.leave[1] <= w.leave[2] {
                1
            } else {
                2
            };
            let t0 = w.t;
            let t1 = w.leave[axis].clamp(t0, w.end);
            w.corner = Vec3::new(x as f32, y as f32, z as f32);
            w.t = t1;
            if t1 < w.end {
                w.cell[axis] += if w.rate[axis] > 0.0 { 1 } else { -1 };
                if w.cell[axis] < 0 || w.cell[axis] >= self.counts[axis] {
                    w.t = w.end;
                } else {
                    w.leave[axis] = w.border(axis);
                }
            }
            if t1 > t0 && bounds.most > 0.0 {
                return Some((t0, t1, bounds));
            }
        }
        None
    }
}

/// Bounds of the cells with index `z` along the last axis.
fn layer(counts: UVec3, z: u32, density: &Density) -> Vec<Bounds> {
    let mut out = Vec::with_capacity((counts.x * counts.y) as usize);
    for y in 0..counts.y {
        for x in 0..counts.x {
            let corner = UVec3::new(x, y, z).as_vec3();
            let (least, most) = density.range(corner - MARGIN, corner + (1.0 + MARGIN));
            if most == 0.0 || least == 1.0 {
                out.push(Bounds {
                    least,
                    most,
                    mean: most,
                });
                continue;
            }
            let points = (0..8).map(|i| {
                // Gauss-Legendre points of each axis.
                let pick = |axis: u32| {
                    if i >> axis & 1 == 0 {
                        0.211_325
                    } else {
                        0.788_675
                    }
                };
                density.at(corner + Vec3::new(pick(0), pick(1), pick(2)))
            });
            out.push(Bounds {
                least,
                most,
                mean: points.sum::<f32>() / 8.0,
            });
        }
    }
    out
}
