//! Which media a segment may meet: a binary hierarchy over their bounds.
//!
//! With one or two media it is a single leaf, and costs what a loop does. A thousand puffs of which a ray meets dozens cost dozens.

use resolvent_api::operator::Segment;
use resolvent_api::{Aabb, Vec3};

/// Most media in a leaf.
const LEAF: usize = 4;
/// Halving makes a tree as deep as the logarithm of the number of its leaves.
const DEPTH: usize = 32;

/// A hierarchy over the bounds of media.
pub struct Hierarchy {
    nodes: Vec<Node>,
    /// Media in the order of the leaves.
    order: Vec<u32>,
}

struct Node {
    bounds: Aabb,
    /// Media of a leaf; 0 in inner nodes.
    count: u32,
    /// A leaf's first medium in `order`, or an inner node's second child; its first one is the next node.
    first: u32,
    /// The axis along which an inner node's children are apart.
    axis: u8,
}

impl Hierarchy {
    /// Over all media, by their bounds.
    pub fn new(bounds: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..bounds.len() as u32).collect();
        let mut nodes = Vec::new();
        if !order.is_empty() {
            split(bounds, &mut order, 0, &mut nodes);
        }
        Self { nodes, order }
    }

    /// Starts a walk through the media that segments of one ray may meet.
    #[inline(always)]
    pub fn walk(&self) -> Walk<'_> {
        Walk {
            tree: self,
            stack: [0; DEPTH],
            height: usize::from(!self.nodes.is_empty()),
            leaf: 0..0,
        }
    }
}

/// Appends the subtree over `order`, whose first place among all is `first`.
fn split(bounds: &[Aabb], order: &mut [u32], first: u32, nodes: &mut Vec<Node>) {
    let of = |i: &u32| bounds[*i as usize];
    let around = order.iter().map(of).reduce(Aabb::union);
    let around = around.unwrap_or(Aabb::EMPTY);
    let at = nodes.len();
    nodes.push(Node {
        bounds: around,
        count: order.len() as u32,
        first,
        axis: 0,
    });
    if order.len() <= LEAF {
        return;
    }
    // Where nothing bounds a medium there is no centre: such media come first, and are met anyway.
    let centre = |i: &u32| {
        let c = of(i).centre();
        if c.is_finite() { c } else { Vec3::MIN }
    };
    let spread = order
        .iter()
        .map(centre)
        .filter(|c| *c != Vec3::MIN)
        .fold(Aabb::EMPTY, Aabb::including)
        .extent();
    let axis = (0..3).max_by(|a, b| spread[*a].total_cmp(&spread[*b]));
    let axis = axis.unwrap_or(0);
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| {
        // Equal centres are told apart by number, so that the tree is the same every time.
        let by_place = centre(a)[axis].total_cmp(&centre(b)[axis]);
        by_place.then(a.cmp(b))
    });
    let (low, high) = order.split_at_mut(half);
    split(bounds, low, first, nodes);
    let second = nodes.len() as u32;
    split(bounds, high, first + half as u32, nodes);
    nodes[at].count = 0;
    nodes[at].first = second;
    nodes[at].axis = axis as u8;
}

/// A walk through the media near a ray, nearer subtrees first.
pub struct Walk<'a> {
    tree: &'a Hierarchy,
    stack: [u32; DEPTH],
    height: usize,
    leaf: std::ops::Range<usize>,
}

impl Walk<'_> {
    /// The next medium that the segment may meet; its own bounds are still to be asked. Segments may get shorter from call to call.
    #[inline(always)]
    pub fn next(&mut self, s: &Segment) -> Option<usize> {
        loop {
            if let Some(at) = self.leaf.next() {
                return Some(self.tree.order[at] as usize);
            }
            self.height = self.height.checked_sub(1)?;
            let at = self.stack[self.height];
            let node = &self.tree.nodes[at as usize];
            // The same arithmetic as for a medium's own bounds, which is monotonic: no medium is missed that meets the segment.
            if node
                .bounds
                .clip(Vec3::from(s.o), Vec3::from(s.d), s.t0, s.t1)
                .is_none()
            {
                continue;
            }
            if node.count > 0 {
                let first = node.first as usize;
                self.leaf = first..first + node.count as usize;
            } else {
                let (mut near, mut far) = (at + 1, node.first);
                if s.d[node.axis as usize] < 0.0 {
                    std::mem::swap(&mut near, &mut far);
                }
                self.stack[self.height] = far;
                self.stack[self.height + 1] = near;
                self.height += 2;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    fn segment(o: [f32; 3], d: [f32; 3], t1: f32) -> Segment {
        Segment { o, d, t0: 0.0, t1 }
    }

    /// Every medium whose bounds a segment meets is found, whatever the bounds, and few others.
    #[test]
    fn finds_what_a_loop_finds() {
        let mut u = Stream::new(7);
        for n in [0, 1, 4, 5, 63, 1000] {
            let mut bounds: Vec<Aabb> = (0..n)
                .map(|_| {
                    let c = Vec3::new(u.uniform(), u.uniform(), u.uniform());
                    Aabb::new(c, c + 0.05 * u.uniform())
                })
                .collect();
            if n == 63 {
                bounds[5] = Aabb::ALL;
                bounds[7].max[1] = f32::INFINITY;
                bounds[9] = Aabb::EMPTY;
                bounds[20] = bounds[21];
            }
            let tree = Hierarchy::new(&bounds);
            let mut asked = 0;
            for k in 0..2000 {
                let mut d = [0, 1, 2].map(|_| u.uniform() - 0.5);
                if k % 5 == 0 {
                    d[k % 3] = 0.0;
                }
                let o = [0, 1, 2].map(|_| 2.0 * u.uniform() - 0.5);
                let s = segment(o, d, 4.0 * u.uniform());
                let meets = |i: usize| bounds[i].clip(s.o.into(), s.d.into(), s.t0, s.t1).is_some();
                let mut walk = tree.walk();
                let mut found: Vec<usize> = std::iter::from_fn(|| walk.next(&s)).collect();
                asked += found.len();
                found.sort_unstable();
                assert!(found.is_sorted_by(|a, b| a < b), "asked twice");
                found.retain(|i| meets(*i));
                let all: Vec<usize> = (0..n).filter(|i| meets(*i)).collect();
                assert_eq!(found, all);
            }
            assert!(n < 1000 || asked < 2000 * 60, "{asked} bounds asked");
        }
    }
}
