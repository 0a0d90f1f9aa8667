//! The cheapest eight-wide hierarchy within a binary one, by dynamic programming.
//!
//! Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", §3.1, with leaf costs
//! counted in tests. C(n, i) is the least surface-area cost of the subtree of n as a forest of at most i roots:
//!
//!   C(n, 1) = min(leaf(n), A(n)·c_node + split(n, 8))
//!   C(n, i) = min(split(n, i), C(n, i − 1))
//!   split(n, i) = min over 0 < k < i of C(left, k) + C(right, i − k)

use obvhs::bvh2::Bvh2;

use super::triangle::LANES;

/// Cost of testing a node's eight boxes and sorting what is met.
const NODE_COST: f32 = 1.0;
/// Cost of testing a quadric, or the triangles of a leaf, which are tested two packets at a time. The ratio was found with
/// `examples/rays.rs`: 0.2 and 0.3 beat 0.5 and 1, and counting packets, since larger leaves also save memory traffic.
const LEAF_COST: f32 = 0.3;
/// Most primitives in one leaf: two packets of triangles, or as many quadrics.
pub(super) const MAX_LEAF: u32 = 2 * LANES as u32;

/// What becomes of a binary node: a leaf of the wide hierarchy, or a node of it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    Leaf(u32),
    Inner(u32),
}

#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// C(n, 1) … C(n, 7)
    cost: [f32; 7],
    /// Roots given to the left child in the best split into 2 … 8 roots; 0: one root fewer is better.
    left: [u8; 7],
    leaf: bool,
    triangles: u32,
    quadrics: u32,
}

/// Decisions for every binary node.
pub(super) struct Plan {
    entries: Vec<Entry>,
}

impl Plan {
    /// `most`: how many primitives a leaf may have, at most [`MAX_LEAF`].
    pub fn new(binary: &Bvh2, most: u32, is_quadric: impl Fn(u32) -> bool) -> Self {
        let mut entries = vec![Entry::default(); binary.nodes.len()];
        for &n in preorder(binary).iter().rev() {
            let node = &binary.nodes[n as usize];
            let area = node.aabb().half_area();
            entries[n as usize] = if node.is_leaf() {
                // The builder makes leaves of one primitive.
                let quadric = is_quadric(binary.primitive_indices[node.first_index as usize]);
                Entry {
                    cost: [area * LEAF_COST; 7],
                    left: [0; 7],
                    leaf: true,
                    triangles: u32::from(!quadric),
                    quadrics: u32::from(quadric),
                }
            } else {
                let children = node.first_index as usize;
                combine(area, most, &entries[children], &entries[children + 1])
            };
        }
        Self { entries }
    }

    pub fn is_leaf(&self, n: u32) -> bool {
        self.entries[n as usize].leaf
    }

    /// The up to eight children of inner node `n` of the wide hierarchy, largest first. Occlusion queries take children from the
    /// last, so that they try small boxes first: these are cheap, and likelier to hold something in the way (1.3 times the speed of
    /// shadow rays in the order that the splits give).
    pub fn children(&self, binary: &Bvh2, n: u32) -> Vec<Step> {
        let mut out = Vec::with_capacity(8);
        let first = binary.nodes[n as usize].first_index;
        let k = usize::from(self.entries[n as usize].left[6]);
        let mut todo = vec![(first + 1, 8 - k), (first, k)];
        while let Some((n, roots)) = todo.pop() {
            let e = &self.entries[n as usize];
            let mut roots = roots;
            while roots > 1 && e.left[roots - 2] == 0 {
                roots -= 1;
            }
            if roots > 1 {
                let first = binary.nodes[n as usize].first_index;
                let k = usize::from(e.left[roots - 2]);
                todo.push((first + 1, roots - k));
                todo.push((first, k));
            } else {
                out.push(if e.leaf {
                    Step::Leaf(n)
                } else {
                    Step::Inner(n)
                });
            }
        }
        let area = |s: &Step| match *s {
            Step::Leaf(n) | Step::Inner(n) => binary.nodes[n as usize].aabb().half_area(),
        };
        out.sort_by(|a, b| area(b).total_cmp(&area(a)));
        out
    }

    /// Primitives below binary node `n`.
    pub fn subtree(&self, binary: &Bvh2, n: u32) -> Vec<u32> {
        let e = &self.entries[n as usize];
        let mut out = Vec::with_capacity((e.triangles + e.quadrics) as usize);
        let mut todo = vec![n];
        while let Some(n) = todo.pop() {
            let node = &binary.nodes[n as usize];
            if node.is_leaf() {
                out.push(binary.primitive_indices[node.first_index as usize]);
            } else {
                todo.push(node.first_index + 1);
                todo.push(node.first_index);
            }
        }
        out
    }
}

/// Every node after its parent.
fn preorder(binary: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(binary.nodes.len());
    let mut todo = vec![0];
    while let Some(n) = todo.pop() {
        order.push(n);
        let node = &binary.nodes[n as usize];
        if !node.is_leaf() {
            todo.push(node.first_index);
            todo.push(node.first_index + 1);
        }
    }
    order
}

fn combine(area: f32, most: u32, left: &Entry, right: &Entry) -> Entry {
    let mut e = Entry {
        triangles: left.triangles + right.triangles,
        quadrics: left.quadrics + right.quadrics,
        ..Entry::default()
    };
    let split = |roots: usize| {
        let mut best = (f32::INFINITY, 0);
        for k in 1..roots.min(8) {
            if k <= 7 && roots - k <= 7 {
                let cost = left.cost[k - 1] + right.cost[roots - k - 1];
                if cost < best.0 {
                    best = (cost, k as u8);
                }
            }
        }
        best
    };
    let (below, k) = split(8);
    e.left[6] = k;
    e.cost[0] = area * NODE_COST + below;
    let count = e.triangles + e.quadrics;
    if count <= most && (e.triangles == 0 || e.quadrics == 0) {
        let tests = if e.quadrics > 0 {
            e.quadrics
        } else {
            e.triangles.div_ceil(MAX_LEAF)
        };
        let cost = area * LEAF_COST * tests as f32;
        if cost <= e.cost[0] {
            e.cost[0] = cost;
            e.leaf = true;
        }
    }
    for roots in 2..8 {
        let (cost, k) = split(roots);
        if cost < e.cost[roots - 2] {
            e.cost[roots - 1] = cost;
            e.left[roots - 2] = k;
        } else {
            e.cost[roots - 1] = e.cost[roots - 2];
        }
    }
    e
}
