//! Ordered traversal of the eight-wide hierarchy, generic over the kernel that tests boxes and triangles.

use super::bvh8::{Child, Node8};
use super::portable::Kernel;
use super::quadric::Quadric;
use super::ray::RaySetup;
use super::triangle::{LANES, Packet, PacketHits};

/// Deepest hierarchy the builder makes, counted in nodes on a path from the root.
pub(super) const MAX_DEPTH: usize = 36;

/// Each level leaves at most seven siblings behind.
pub(super) const DEEP_STACK: usize = 7 * MAX_DEPTH + 1;

/// Enough for depth 9. Clearing the stack is a measurable part of a ray, hence two sizes.
pub(super) const SHALLOW_STACK: usize = 64;

/// What is traversed: nodes from the root (index 0), triangle packets, quadrics.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node8>,
    pub packets: Vec<Packet>,
    pub quadrics: Vec<Quadric>,
    /// Nodes on the longest path from the root.
    pub depth: usize,
}

impl Tree {
    /// Box of the whole, as (min, max).
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let fold = |row: usize, f: fn(f32, f32) -> f32, start: f32| {
            self.nodes[0].bounds[row].iter().copied().fold(start, f)
        };
        (
            [0, 2, 4].map(|r| fold(r, f32::min, f32::INFINITY)),
            [1, 3, 5].map(|r| fold(r, f32::max, f32::NEG_INFINITY)),
        )
    }

    /// Diagonal of that box.
    pub fn size(&self) -> f64 {
        let (min, max) = self.bounds();
        let [min, max] = [min, max].map(|p| glam::Vec3::from_array(p).as_dvec3());
        (max - min).length()
    }

    /// A tree that no ray meets.
    pub fn nothing() -> Self {
        Self {
            nodes: vec![Node8::EMPTY],
            packets: Vec::new(),
            quadrics: Vec::new(),
            depth: 1,
        }
    }
}

/// A hit on primitive `prim`, numbered through all shapes of the geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub t: f32,
    pub prim: u32,
    pub u: f32,
    pub v: f32,
}

/// What a search for the nearest hit has to beat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Hits beyond this are ignored; not beyond the ray's own end.
    pub t: f32,
    /// Hits at exactly `t` count.
    pub ties: bool,
}

impl Start {
    /// The whole ray.
    #[inline(always)]
    pub fn of(ray: &RaySetup) -> Self {
        Self {
            t: ray.t_max,
            ties: false,
        }
    }
}

/// Nearest accepted hit; of hits at equal t the one with the lowest primitive number, whatever the order of traversal.
#[inline(always)]
pub(super) fn closest<K: Kernel, F>(
    k: K,
    tree: &Tree,
    ray: &RaySetup,
    start: Start,
    accept: F,
) -> Option<Candidate>
where
    F: FnMut(&Candidate) -> bool,
{
    if 7 * tree.depth < SHALLOW_STACK {
        closest_sized::<K, F, SHALLOW_STACK>(k, tree, ray, start, accept)
    } else {
        closest_sized::<K, F, DEEP_STACK>(k, tree, ray, start, accept)
    }
}

/// Whether anything is hit.
#[inline(always)]
pub(super) fn occluded<K: Kernel>(k: K, tree: &Tree, ray: &RaySetup) -> bool {
    if 7 * tree.depth < SHALLOW_STACK {
        occluded_sized::<K, SHALLOW_STACK>(k, tree, ray)
    } else {
        occluded_sized::<K, DEEP_STACK>(k, tree, ray)
    }
}

/// Stack entry: entry distance in the upper half, child in the lower, so that entries compare by distance. Distances are not
/// negative, and the bits of such floats are ordered like their values.
#[inline(always)]
pub(super) fn entry(near: f32, child: Child) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(child.0)
}

#[inline(always)]
fn closest_sized<K: Kernel, F, const N: usize>(
    k: K,
    tree: &Tree,
    ray: &RaySetup,
    start: Start,
    mut accept: F,
) -> Option<Candidate>
where
    F: FnMut(&Candidate) -> bool,
{
    // prim 0 makes "equal t, lower number" false for a hit exactly at t_max, which is excluded.
    let mut best = Candidate {
        t: start.t,
        prim: if start.ties { u32::MAX } else { 0 },
        u: 0.0,
        v: 0.0,
    };
    let mut found = false;
    let mut consider = |c: Candidate, best: &mut Candidate| {
        if (c.t < best.t || (c.t == best.t && c.prim < best.prim)) && accept(&c) {
            *best = c;
            found = true;
        }
    };
    let mut stack = [0u64; N];
    let mut height = 0;
    let mut current = Child::node(0);
    'walk: loop {
        while !current.is_leaf() {
            let node = &tree.nodes[current.0 as usize];
            let (mut mask, near) = k.node(ray, node, best.t);
            if mask == 0 {
                match pop(&stack, &mut height, best.t) {
                    Some(next) => current = next,
                    None => break 'walk,
                }
                continue;
            }
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if mask == 0 {
                current = node.child[lane & 7];
                continue;
            }
            k.prefetch(tree, node.child[lane & 7]);
            // The nearest stays in a register; the others are pushed in order of decreasing distance, by insertion.
            let base = height;
            let mut nearest = entry(near.0[lane & 7], node.child[lane & 7]);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                k.prefetch(tree, node.child[lane]);
                let new = entry(near.0[lane], node.child[lane]);
                let later = nearest.max(new);
                nearest = nearest.min(new);
                let mut at = height;
                while at > base && stack[at - 1] < later {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = later;
                height += 1;
            }
            current = Child(nearest as u32);
        }
        if current.is_quadrics() {
            for quadric in &tree.quadrics[current.items()] {
                if let Some(t) = quadric.intersect(ray, best.t) {
                    consider(
                        Candidate {
                            t,
                            prim: quadric.prim,
                            u: 0.0,
                            v: 0.0,
                        },
                        &mut best,
                    );
                }
            }
        } else {
            let mut hits = PacketHits::NONE;
            for packets in tree.packets[current.items()].chunks(2) {
                let mut mask = k.packets(ray, packets, best.t, &mut hits);
                while mask != 0 {
                    let i = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    consider(
                        Candidate {
                            t: hits.t[i],
                            prim: packets[i / LANES].prim[i % LANES],
                            u: hits.u[i],
                            v: hits.v[i],
                        },
                        &mut best,
                    );
                }
            }
        }
        match pop(&stack, &mut height, best.t) {
            Some(next) => current = next,
            None => break,
        }
    }
    found.then_some(best)
}

/// Next subtree that may hold a hit at or before `t_max`.
#[inline(always)]
fn pop<const N: usize>(stack: &[u64; N], height: &mut usize, t_max: f32) -> Option<Child> {
    while *height > 0 {
        *height -= 1;
        let top = stack[*height];
        if f32::from_bits((top >> 32) as u32) <= t_max {
            return Some(Child(top as u32));
        }
    }
    None
}

#[inline(always)]
fn occluded_sized<K: Kernel, const N: usize>(k: K, tree: &Tree, ray: &RaySetup) -> bool {
    let t_max = ray.t_max;
    let mut stack = [0u32; N];
    let mut height = 0;
    let mut current = Child::node(0);
    loop {
        if !current.is_leaf() {
            let node = &tree.nodes[current.0 as usize];
            let (mut mask, _) = k.node(ray, node, t_max);
            if mask != 0 {
                loop {
                    let lane = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    if mask == 0 {
                        current = node.child[lane];
                        break;
                    }
                    k.prefetch(tree, node.child[lane]);
                    stack[height] = node.child[lane].0;
                    height += 1;
                }
                continue;
            }
        } else if current.is_quadrics() {
            for quadric in &tree.quadrics[current.items()] {
                if quadric.intersect(ray, t_max).is_some_and(|t| t < t_max) {
                    return true;
                }
            }
        } else {
            let mut hits = PacketHits::NONE;
            for packets in tree.packets[current.items()].chunks(2) {
                let mut mask = k.packets(ray, packets, t_max, &mut hits);
                while mask != 0 {
                    let i = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    if hits.t[i] < t_max {
                        return true;
                    }
                }
            }
        }
        if height == 0 {
            return false;
        }
        height -= 1;
        current = Child(stack[height]);
    }
}
