//! The light tree: chooses among many lights by an estimate of what each sends to a point.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", without the splitting: one
//! light is chosen, going down from the root by the importance of the two children, or now and then any one ([`UNIFORM`]). Vertices in media have no normal, and so
//! leave the cosine at the receiver out.

use super::Light;
use super::Reference;
use super::bound::{Bound, Group};

/// Buckets in which splits are looked for.
const BUCKETS: usize = 12;

/// Beyond this depth groups are halved by count, so that the depth stays bounded whatever the lights.
const MAX_COST_DEPTH: u32 = 40;

/// Distance, relative to the extent of all lights, below which a light does not gain importance.
const NEAR: f32 = 1e-4;

/// Share of the choices that are uniform over all lights in the tree: importance knows nothing of what stands in between, and
/// a weak light that is the only one to reach a point must not be starved by a strong one behind a wall.
pub const UNIFORM: f64 = 0.1;

#[derive(Clone, Copy, Debug)]
struct Node {
    group: Group,
    parent: u32,
    /// The right child, or the light of a leaf; the left child follows its parent.
    next: u32,
    leaf: bool,
}

/// A binary hierarchy over lights at finite places.
#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    /// The leaf of each light of the scene; [`NO_LEAF`] for lights that are not in it.
    leaf_of: Vec<u32>,
    /// The lights that are in it.
    lights: Vec<u32>,
    /// Squared distance below which lights do not gain importance.
    near: f32,
}

const NO_LEAF: u32 = u32::MAX;

impl Tree {
    /// Over all of `lights` at finite places; `None` if there are none.
    pub fn new(lights: &[Light], lanes: u32) -> Option<Self> {
        let mut items: Vec<(u32, Bound)> = (0..)
            .zip(lights)
            .filter_map(|(i, l)| Some((i, Bound::of(l, lanes)?)))
            .collect();
        let total: f64 = items.iter().map(|i| f64::from(i.1.intensity)).sum();
        if items.is_empty() {
            return None;
        }
        let all = items
            .iter()
            .map(|i| i.1)
            .reduce(|a, b| a.union(&b))
            .map_or(0.0, |b| (b.hi - b.lo).length());
        // A vertex at a point light would leave nothing to the others.
        let near = (NEAR * all).powi(2).max(f32::MIN_POSITIVE);
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * items.len() - 1),
            leaf_of: vec![NO_LEAF; lights.len()],
            lights: items.iter().map(|i| i.0).collect(),
            near,
        };
        // Shares of the total, so that sums over groups stay finite whatever the units and distances.
        for (_, bound) in &mut items {
            bound.intensity = (f64::from(bound.intensity) / total) as f32;
        }
        tree.build(&mut items, u32::MAX, 0);
        Some(tree)
    }

    fn build(&mut self, items: &mut [(u32, Bound)], parent: u32, depth: u32) -> Bound {
        let index = self.nodes.len() as u32;
        let first = items[0].1;
        let mut node = Node {
            group: Group::new(&first, self.near),
            parent,
            next: items[0].0,
            leaf: true,
        };
        self.nodes.push(node);
        if items.len() == 1 {
            self.leaf_of[items[0].0 as usize] = index;
            return first;
        }
        let at = split(items, depth);
        let (left, right) = items.split_at_mut(at);
        let left = self.build(left, index, depth + 1);
        node.next = self.nodes.len() as u32;
        let right = self.build(right, index, depth + 1);
        let bound = left.union(&right);
        (node.leaf, node.group) = (false, Group::new(&bound, self.near));
        self.nodes[index as usize] = node;
        bound
    }

    /// True if it is chosen through the tree.
    #[inline(always)]
    pub fn holds(&self, light: u32) -> bool {
        self.leaf_of
            .get(light as usize)
            .is_some_and(|l| *l != NO_LEAF)
    }

    /// How many lights are in it.
    pub fn count(&self) -> usize {
        self.lights.len()
    }

    /// Nodes on the longest way from the root.
    pub fn depth(&self) -> usize {
        let mut depths = vec![1; self.nodes.len()];
        for i in 1..self.nodes.len() {
            depths[i] = depths[self.nodes[i].parent as usize] + 1;
        }
        depths.into_iter().max().unwrap_or(0)
    }

    /// Chooses a light for `at` by `u` in [0, 1), with its probability. `None` if it comes to a group of which no light reaches
    /// `at`: bounds of groups are wider than those of their lights, so this has a probability, too.
    #[inline]
    pub fn choose(&self, at: &Reference, u: f64) -> Option<(u32, f32)> {
        let each = UNIFORM / self.lights.len() as f64;
        let (light, probability) = if u < UNIFORM {
            let k = ((u / each) as usize).min(self.lights.len() - 1);
            (self.lights[k], self.descent(at, self.lights[k]))
        } else {
            self.descend(at, (u - UNIFORM) / (1.0 - UNIFORM))?
        };
        Some((light, (each + (1.0 - UNIFORM) * probability) as f32))
    }

    /// Probability with which [`Tree::choose`] chooses `light` for `at`.
    #[inline]
    pub fn probability(&self, at: &Reference, light: u32) -> f32 {
        if !self.holds(light) {
            return 0.0;
        }
        let each = UNIFORM / self.lights.len() as f64;
        (each + (1.0 - UNIFORM) * self.descent(at, light)) as f32
    }

    /// Goes down from the root by importance.
    #[inline]
    fn descend(&self, at: &Reference, mut u: f64) -> Option<(u32, f64)> {
        let mut i = 0;
        let mut probability = 1.0f64;
        let mut node = &self.nodes[0];
        if node.leaf && !(node.group.importance(at) > 0.0) {
            return None;
        }
        while !node.leaf {
            let (left, right) = self.shares(i, at)?;
            if u < left {
                probability *= left;
                u /= left;
                i += 1;
            } else {
                probability *= right;
                u = ((u - left) / right).clamp(0.0, 1.0f64.next_down());
                i = node.next as usize;
            }
            node = &self.nodes[i];
        }
        Some((node.next, probability))
    }

    /// Probability of coming to `light`, which is in the tree, by importance alone.
    #[inline]
    pub fn descent(&self, at: &Reference, light: u32) -> f64 {
        let mut i = self.leaf_of[light as usize];
        if i == 0 {
            let reaches = self.nodes[0].group.importance(at) > 0.0;
            return if reaches { 1.0 } else { 0.0 };
        }
        let mut probability = 1.0f64;
        loop {
            let parent = self.nodes[i as usize].parent;
            if parent == u32::MAX {
                return probability;
            }
            let Some((left, right)) = self.shares(parent as usize, at) else {
                return 0.0;
            };
            probability *= if i == parent + 1 { left } else { right };
            i = parent;
        }
    }

    /// Probabilities of going left and right at an inner node; `None` if neither child reaches `at`. Each is a quotient of its own,
    /// in f64, so that a weak group beside a strong one keeps a probability.
    #[inline]
    fn shares(&self, i: usize, at: &Reference) -> Option<(f64, f64)> {
        let left = f64::from(self.nodes[i + 1].group.importance(at));
        let right = &self.nodes[self.nodes[i].next as usize].group;
        let right = f64::from(right.importance(at));
        let both = left + right;
        (both > 0.0).then(|| (left / both, right / both))
    }
}

/// Orders `items` and says where to split them: the cheapest of the planes between buckets along the three axes
/// (Conty Estevez & Kulla 2018, §4.4, "surface area orientation heuristic").
fn split(items: &mut [(u32, Bound)], depth: u32) -> usize {
    let half = items.len() / 2;
    let (mut lo, mut hi) = (glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY);
    for (_, b) in items.iter() {
        lo = lo.min(b.centre());
        hi = hi.max(b.centre());
    }
    let extent = hi - lo;
    let longest = extent.max_element();
    if items.len() == 2 || !(longest > 0.0) {
        return half;
    }
    let bucket = |b: &Bound, axis: usize| {
        let x = (b.centre()[axis] - lo[axis]) / extent[axis];
        ((x * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        if !(extent[axis] > 0.0) || depth >= MAX_COST_DEPTH {
            continue;
        }
        let mut sums: [Option<Bound>; BUCKETS] = [None; BUCKETS];
        for (_, b) in items.iter() {
            let sum = &mut sums[bucket(b, axis)];
            *sum = Some(sum.map_or(*b, |s| s.union(b)));
        }
        let mut below = [0.0; BUCKETS];
        let mut all: Option<Bound> = None;
        for (k, sum) in sums.iter().enumerate().take(BUCKETS - 1) {
            all = merged(all, sum);
            below[k + 1] = all.map_or(0.0, |b| b.cost());
        }
        let mut above: Option<Bound> = None;
        for k in (1..BUCKETS).rev() {
            above = merged(above, &sums[k]);
            // Thin groups are not to be split along their short sides.
            let regular = longest / extent[axis];
            let cost = regular * (below[k] + above.map_or(0.0, |b| b.cost()));
            let parts = sums[..k].iter().any(Option::is_some) && above.is_some();
            if parts && best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, k));
            }
        }
    }
    match best {
        Some((_, axis, k)) => {
            // Stable, so that equal scenes give equal trees.
            items.sort_by_key(|(_, b)| bucket(b, axis) >= k);
            items.partition_point(|(_, b)| bucket(b, axis) < k)
        }
        None => {
            let axis = (0..3).find(|a| extent[*a] == longest).unwrap_or(0);
            items.sort_by(|a, b| a.1.centre()[axis].total_cmp(&b.1.centre()[axis]));
            half
        }
    }
}

fn merged(a: Option<Bound>, b: &Option<Bound>) -> Option<Bound> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(*b),
    }
}
