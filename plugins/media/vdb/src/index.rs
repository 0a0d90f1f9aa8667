//! Which brick a voxel is in: a shallow tree with a fan-out of 8³ under a dense array.
//!
//! ```text
//! top    dense array over the domain; an entry covers 8^(k+1) bricks³, k chosen so that the array stays small
//! mid    nodes of 8³ entries, only where data are so far apart that k > 0
//! group  nodes of 8³ bricks (64³ voxels): one slot per brick
//! ```
//! An entry or slot is either the number of a node or brick, or [`UNIFORM`] | the number of a constant: a region of one
//! value takes no memory, at any level. For grids up to some thousand voxels along each axis the top array consists of groups
//! and a look-up is top → group → brick.
//!
//! Coordinates here are *local*: voxels counted from [`Index::base`], never negative inside the domain.

use crate::voxel::each;
use std::collections::HashMap;

/// Marks entries and slots that stand for a constant.
pub const UNIFORM: u32 = 1 << 31;
/// The constant of everything that is neither in a leaf nor in a tile.
pub const DEFAULT: u32 = UNIFORM;
/// Bricks in a group.
pub const GROUP: usize = 512;

/// Most voxels along an axis that coordinates in `f32` resolve.
pub const WIDEST: i64 = 1 << 22;

/// Where a group is.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// At these brick coordinates.
    At([i32; 3]),
    /// At many places that look alike: a group of the first constant whose seven neighbours towards +x, +y, +z (by the
    /// bits of the position in this array: 4 for x, 2 for y, 1 for z) consist of the other constants.
    Pattern([u32; 8]),
}

/// What a brick coordinate lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// A group.
    Group(u32),
    /// A region of one constant (its entry), with edges of 2^`log` bricks.
    Uniform(u32, u32),
}

/// Nodes shared by uniform regions with equal neighbours.
#[derive(Default)]
struct Patterns {
    /// By level and constants.
    known: HashMap<(u32, [u32; 8]), u32>,
    /// The constant that fills a shared `mid` node.
    fill: HashMap<u32, u32>,
}

/// See the module.
pub struct Index {
    /// Index coordinates of the local voxel (0, 0, 0).
    pub base: [i64; 3],
    /// An entry of `top` covers (2^`log`)³ bricks: 3, 6, 9 ….
    log: u32,
    dims: [i32; 3],
    top: Vec<u32>,
    mid: Vec<[u32; 512]>,
    /// The slots of all groups.
    pub slots: Vec<u32>,
    /// Where each group is.
    pub places: Vec<Place>,
}

/// Position of a brick or node in its parent, from coordinates counted in its own size.
#[inline(always)]
pub fn child(c: [i32; 3]) -> usize {
    crate::voxel::offset(c)
}

impl Index {
    /// An index whose domain holds the voxels `lo..=hi` (index coordinates), for about `count` bricks and tiles.
    ///
    /// # Errors
    /// If the domain is wider than coordinates in `f32` can resolve.
    pub fn new([lo, hi]: [[i64; 3]; 2], count: usize) -> Result<Self, String> {
        let width = |i: usize| hi[i].checked_sub(lo[i]);
        if (0..3).any(|i| width(i).is_none_or(|w| !(0..=WIDEST).contains(&w))) {
            return Err(format!(
                "its voxels from {lo:?} to {hi:?} are spread over more than {WIDEST} voxels along an axis; split it into several grids"
            ));
        }
        let most = (8 * count as i64).max(1 << 18);
        let mut log = 3;
        loop {
            let unit = 8i64 << log;
            let base = lo.map(|c| c.div_euclid(unit) * unit);
            let dims = each(|i| (hi[i] - base[i]) / unit + 1);
            let entries: i64 = dims.iter().product();
            if entries <= most {
                return Ok(Self {
                    base,
                    log,
                    dims: dims.map(|d| d as i32),
                    top: vec![DEFAULT; entries as usize],
                    mid: Vec::new(),
                    slots: Vec::new(),
                    places: Vec::new(),
                });
            }
            log += 3;
        }
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.top.capacity() * 4 + self.mid.capacity() * 2048 + self.slots.capacity() * 4
    }

    /// Bricks along each axis of the domain.
    pub fn extent(&self) -> [i32; 3] {
        self.dims.map(|d| d << self.log)
    }

    #[inline(always)]
    fn entry(&self, brick: [i32; 3]) -> Option<usize> {
        let [x, y, z] = each(|i| brick[i] >> self.log);
        let inside = (x as u32) < self.dims[0] as u32
            && (y as u32) < self.dims[1] as u32
            && (z as u32) < self.dims[2] as u32;
        inside.then(|| ((x * self.dims[1] + y) * self.dims[2] + z) as usize)
    }

    /// What the brick lies in; `None` outside the domain.
    #[inline(always)]
    pub fn find(&self, brick: [i32; 3]) -> Option<Found> {
        let mut entry = self.top[self.entry(brick)?];
        let mut log = self.log;
        while log > 3 && entry & UNIFORM == 0 {
            log -= 3;
            entry = self.mid[entry as usize][child(each(|i| brick[i] >> log))];
        }
        Some(if entry & UNIFORM != 0 {
            Found::Uniform(entry, log)
        } else {
            Found::Group(entry)
        })
    }

    /// The slot of a brick; [`DEFAULT`] outside the domain.
    #[inline(always)]
    pub fn slot(&self, brick: [i32; 3]) -> u32 {
        match self.find(brick) {
            Some(Found::Group(g)) => self.slots[g as usize * GROUP + child(brick)],
            Some(Found::Uniform(constant, _)) => constant,
            None => DEFAULT,
        }
    }

    /// Local brick coordinates of a voxel in index coordinates.
    pub fn brick_of(&self, voxel: [i64; 3]) -> [i64; 3] {
        each(|i| (voxel[i] - self.base[i]) >> 3)
    }

    /// The entry at `brick` for nodes with edges of 2^`log` bricks, made to exist.
    fn make(&mut self, brick: [i32; 3], log: u32) -> Option<&mut u32> {
        let at = self.entry(brick)?;
        let mut level = self.log;
        let mut node = None;
        while level > log {
            let next = self.mid.len() as u32;
            let entry = match node {
                None => &mut self.top[at],
                Some(n) => &mut self.mid[n as usize][child(brick.map(|c| c >> level))],
            };
            if *entry & UNIFORM != 0 {
                let fill = *entry;
                *entry = next;
                self.mid.push([fill; 512]);
                node = Some(next);
            } else {
                node = Some(*entry);
            }
            level -= 3;
        }
        Some(match node {
            None => &mut self.top[at],
            Some(n) => &mut self.mid[n as usize][child(brick.map(|c| c >> level))],
        })
    }

    /// The group at `brick`, made to exist with the constant that was there; `None` outside the domain.
    pub fn group(&mut self, brick: [i32; 3]) -> Option<u32> {
        let (next, at) = (self.places.len() as u32, brick.map(|c| c & !7));
        let entry = self.make(brick, 3)?;
        if *entry & UNIFORM == 0 {
            return Some(*entry);
        }
        let fill = *entry;
        *entry = next;
        self.slots.extend([fill; GROUP]);
        self.places.push(Place::At(at));
        Some(next)
    }

    /// Puts a brick or constant at a brick coordinate; outside the domain nothing happens.
    pub fn set(&mut self, brick: [i32; 3], slot: u32) {
        if let Some(group) = self.group(brick) {
            self.slots[group as usize * GROUP + child(brick)] = slot;
        }
    }

    /// Fills a cube of 2^`log` bricks along each edge with a constant, as far as it is in the domain.
    pub fn fill(&mut self, corner: [i64; 3], log: u32, constant: u32) {
        let extent = self.extent().map(i64::from);
        let unit = if log >= 3 {
            (log / 3 * 3).min(self.log)
        } else {
            0
        };
        let step = 1i64 << unit;
        let [x, y, z] = each(|i| {
            let (from, to) = (corner[i].max(0), (corner[i] + (1 << log)).min(extent[i]));
            (from..to).step_by(step as usize)
        });
        for x in x {
            for y in y.clone() {
                for z in z.clone() {
                    let brick = [x, y, z].map(|c| c as i32);
                    if unit == 0 {
                        self.set(brick, constant);
                    } else if let Some(entry) = self.make(brick, unit) {
                        *entry = constant;
                    }
                }
            }
        }
    }

    /// Makes groups of the uniform regions some of whose voxels have a neighbour towards +x, +y or +z with another
    /// value: interpolation there leaves the region, so one pair of bounds won't do.
    pub fn dilate(&mut self) {
        let mut next = 0;
        while next < self.places.len() {
            self.dilate_group(next);
            next += 1;
        }
        let mut patterns = Patterns::default();
        for x in 0..self.dims[0] {
            for y in 0..self.dims[1] {
                for z in 0..self.dims[2] {
                    let mut work = vec![(self.log, [x, y, z].map(|c| c << self.log))];
                    while let Some((log, at)) = work.pop() {
                        self.settle(log, at, &mut work, &mut patterns);
                    }
                }
            }
        }
        self.top.shrink_to_fit();
        self.mid.shrink_to_fit();
        self.slots.shrink_to_fit();
    }

    /// Makes groups of the seven neighbours towards −x, −y, −z of a group, where they are uniform and the layer of bricks
    /// that touches them is not of the same constant.
    fn dilate_group(&mut self, group: usize) {
        let Place::At(at) = self.places[group] else {
            return;
        };
        for side in 1..8usize {
            let step = [side >> 2 & 1, side >> 1 & 1, side & 1];
            let there = each(|i| at[i] - 8 * step[i] as i32);
            let Some(Found::Uniform(constant, _)) = self.find(there) else {
                continue;
            };
            let slots = &self.slots[group * GROUP..][..GROUP];
            let touches = (0..GROUP).any(|k| {
                let place = [k >> 6, k >> 3 & 7, k & 7];
                (0..3).all(|i| step[i] == 0 || place[i] == 0) && slots[k] != constant
            });
            if touches {
                self.group(there);
            }
        }
    }

    /// The constant that fills the node with edges of 2^`log` bricks at `brick`, or `None` if it isn't uniform.
    fn constant(&self, brick: [i32; 3], log: u32, patterns: &Patterns) -> Option<u32> {
        let Some(at) = self.entry(brick) else {
            return Some(DEFAULT);
        };
        let (mut entry, mut level) = (self.top[at], self.log);
        while level > log && entry & UNIFORM == 0 {
            level -= 3;
            entry = self.mid[entry as usize][child(brick.map(|c| c >> level))];
        }
        if entry & UNIFORM != 0 {
            return Some(entry);
        }
        if log > 3 {
            return patterns.fill.get(&entry).copied();
        }
        match self.places[entry as usize] {
            Place::Pattern(key) => Some(key[0]),
            Place::At(_) => None,
        }
    }

    /// True if the layer of a node that touches its neighbour in the direction −`step` consists of `constant`.
    fn touches(
        &self,
        at: [i32; 3],
        log: u32,
        step: [usize; 3],
        constant: u32,
        patterns: &Patterns,
    ) -> bool {
        if let Some(own) = self.constant(at, log, patterns) {
            return own == constant;
        }
        if log == 3 {
            return true; // a group: see `dilate_group`
        }
        let along = |i: usize| if step[i] == 1 { 0..1 } else { 0..8 };
        let size = 1 << (log - 3);
        along(0).all(|x| {
            along(1).all(|y| {
                along(2).all(|z| {
                    let below = [at[0] + x * size, at[1] + y * size, at[2] + z * size];
                    self.touches(below, log - 3, step, constant, patterns)
                })
            })
        })
    }

    /// Gives a uniform entry nodes if its neighbours differ. Uniform regions between uniform regions are alike in many
    /// places, so their nodes are shared: the surface of a large tile costs next to nothing.
    fn settle(
        &mut self,
        log: u32,
        at: [i32; 3],
        work: &mut Vec<(u32, [i32; 3])>,
        patterns: &mut Patterns,
    ) {
        let push_children = |work: &mut Vec<(u32, [i32; 3])>| {
            for k in 0..512 {
                let place = [k >> 6, k >> 3 & 7, k & 7];
                work.push((log - 3, each(|i| at[i] + (place[i] << (log - 3)))));
            }
        };
        let Some(own) = self.constant(at, log, patterns) else {
            if log > 3 {
                push_children(work);
            }
            return;
        };
        let mut key = [own; 8];
        let mut mixed = false;
        for (side, key) in key.iter_mut().enumerate().skip(1) {
            let step = [side >> 2 & 1, side >> 1 & 1, side & 1];
            let there = each(|i| at[i] + ((step[i] as i32) << log));
            match self.constant(there, log, patterns) {
                Some(constant) => *key = constant,
                // A group whose touching layer differs has had its neighbour made into a group already.
                None => mixed |= log > 3 && !self.touches(there, log, step, own, patterns),
            }
        }
        if mixed {
            // `make` below the entry turns it into a node of the same constant.
            self.make(at, log - 3);
            push_children(work);
        } else if key != [own; 8] {
            let node = self.pattern(log, key, patterns);
            if let Some(entry) = self.make(at, log) {
                *entry = node;
            }
        }
    }

    /// Calls `visit` with the corner and edge (in bricks) and the constant of each uniform region above the bricks, groups
    /// that are uniform included.
    pub fn uniform(&self, visit: &mut dyn FnMut([i32; 3], i32, u32)) {
        for x in 0..self.dims[0] {
            for y in 0..self.dims[1] {
                for z in 0..self.dims[2] {
                    let entry = self.top[((x * self.dims[1] + y) * self.dims[2] + z) as usize];
                    self.uniform_below(entry, self.log, [x, y, z].map(|c| c << self.log), visit);
                }
            }
        }
    }

    fn uniform_below(
        &self,
        entry: u32,
        log: u32,
        at: [i32; 3],
        visit: &mut dyn FnMut([i32; 3], i32, u32),
    ) {
        if entry & UNIFORM != 0 {
            visit(at, 1 << log, entry);
        } else if log == 3 {
            if let Place::Pattern(key) = self.places[entry as usize] {
                visit(at, 1 << log, key[0]);
            }
        } else {
            for (k, below) in self.mid[entry as usize].iter().enumerate() {
                let place = [k as i32 >> 6, k as i32 >> 3 & 7, k as i32 & 7];
                let at = each(|i| at[i] + (place[i] << (log - 3)));
                self.uniform_below(*below, log - 3, at, visit);
            }
        }
    }

    fn pattern(&mut self, log: u32, key: [u32; 8], patterns: &mut Patterns) -> u32 {
        if key == [key[0]; 8] {
            return key[0];
        }
        if let Some(&node) = patterns.known.get(&(log, key)) {
            return node;
        }
        let node = if log == 3 {
            self.slots.extend([key[0]; GROUP]);
            self.places.push(Place::Pattern(key));
            self.places.len() as u32 - 1
        } else {
            let mut children = [key[0]; 512];
            for (k, entry) in children.iter_mut().enumerate() {
                let edge = [k >> 6, k >> 3 & 7, k & 7].map(|c| usize::from(c == 7));
                let mask = edge[0] << 2 | edge[1] << 1 | edge[2];
                *entry = self.pattern(log - 3, std::array::from_fn(|i| key[i & mask]), patterns);
            }
            self.mid.push(children);
            let node = self.mid.len() as u32 - 1;
            patterns.fill.insert(node, key[0]);
            node
        };
        patterns.known.insert((log, key), node);
        node
    }
}
