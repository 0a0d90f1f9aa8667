//! From primitive boxes to the eight-wide hierarchy.
//!
//! obvhs makes a binary hierarchy (PLOC with reinsertion); [`super::collapse`] finds the cheapest eight-wide one in it; this
//! file lays that out. obvhs sees boxes moved to the origin and scaled to unit size, since it panics on huge coordinates and
//! its costs would over- or underflow; the boxes that rays meet come from the primitives again.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::bvh8::{Bounds, Child, Node8};
use super::collapse::{MAX_LEAF, Plan, Step};
use super::input::Geometry;
use super::quadric::Quadric;
use super::traverse::{MAX_DEPTH, Tree};
use super::triangle::{self, LANES, Packet};

/// Deeper than this, subtrees are split evenly by count instead of by cost: eleven more levels hold 2³³ primitives, so that the
/// depth stays below [`MAX_DEPTH`] whatever the input.
const MAX_COST_DEPTH: usize = MAX_DEPTH - 12;

/// A primitive that takes part: triangles with equal vertices do not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    pub bounds: Bounds,
    /// Number among all primitives of the geometry.
    pub number: u32,
    pub item: Item,
}

/// What a primitive is made of.
#[derive(Clone, Copy, Debug)]
pub(super) enum Item {
    Triangle([[f32; 3]; 3]),
    Quadric(Quadric),
    /// Alone in its leaf.
    Instance,
}

impl Primitive {
    pub fn is_quadric(&self) -> bool {
        matches!(self.item, Item::Quadric(_))
    }
}

/// The primitives that can be hit, in order, and how many triangles were left out for having equal vertices.
pub(super) fn primitives(geometry: &Geometry) -> (Vec<Primitive>, usize) {
    let mut out = Vec::with_capacity(geometry.primitives());
    let mut degenerate = 0;
    let mut number = 0;
    for shape in &geometry.shapes {
        if let Some((quadric, bounds)) = Quadric::new(shape, number) {
            out.push(Primitive {
                bounds,
                number,
                item: Item::Quadric(quadric),
            });
            number += 1;
            continue;
        }
        for prim in 0..shape.primitives() as u32 {
            if let Some(vertices) = shape.triangle(prim) {
                let vertices = vertices.map(|v| v.to_array());
                if distinct(&vertices) {
                    let bounds = triangle::bounds(&vertices);
                    out.push(Primitive {
                        bounds,
                        number,
                        item: Item::Triangle(vertices),
                    });
                } else {
                    degenerate += 1;
                }
            }
            number += 1;
        }
    }
    (out, degenerate)
}

/// Whether all three vertices differ. A triangle with two equal vertices can be left out, since its neighbours meet along its
/// other two edges, which are one. A triangle with three different vertices on a line has no area either, but has to stay: its
/// neighbours' edges need not coincide once they are rounded, and it covers the gap.
fn distinct([a, b, c]: &[[f32; 3]; 3]) -> bool {
    a != b && b != c && c != a
}

/// The hierarchy over the boxes of instances, given with their numbers; `None` if there are none.
pub(super) fn build_top(boxes: &[(u32, Bounds)]) -> Option<Tree> {
    let primitives: Vec<Primitive> = boxes
        .iter()
        .map(|&(number, bounds)| Primitive {
            bounds,
            number,
            item: Item::Instance,
        })
        .collect();
    build_to(&primitives, MAX_COST_DEPTH)
}

/// The hierarchy over `primitives`; `None` if there are none.
pub(super) fn build(primitives: &[Primitive]) -> Option<Tree> {
    build_to(primitives, MAX_COST_DEPTH)
}

/// [`build`] with cost deciding down to a depth of `cost_depth`.
fn build_to(primitives: &[Primitive], cost_depth: usize) -> Option<Tree> {
    if primitives.is_empty() {
        return None;
    }
    let binary = build_binary(primitives);
    let alone = matches!(primitives[0].item, Item::Instance);
    let most = if alone { 1 } else { MAX_LEAF };
    let plan = Plan::new(&binary, most, |i| primitives[i as usize].is_quadric());
    let mut layout = Layout {
        primitives,
        binary: &binary,
        plan: &plan,
        cost_depth,
        alone,
        tree: Tree {
            nodes: Vec::with_capacity(primitives.len() / 6 + 1),
            packets: Vec::with_capacity(primitives.len() / 3 + 1),
            quadrics: Vec::new(),
            depth: 0,
        },
    };
    let steps = if plan.is_leaf(0) {
        vec![Step::Leaf(0)]
    } else {
        plan.children(&binary, 0)
    };
    layout.node(&steps, 1);
    let mut tree = layout.tree;
    tree.nodes.shrink_to_fit();
    tree.packets.shrink_to_fit();
    Some(tree)
}

fn build_binary(primitives: &[Primitive]) -> Bvh2 {
    let mut all = Bounds::EMPTY;
    for p in primitives {
        all.include(&p.bounds);
    }
    let center = [0, 1, 2].map(|i| 0.5 * (f64::from(all.min[i]) + f64::from(all.max[i])));
    let extent = (0..3)
        .map(|i| f64::from(all.max[i]) - f64::from(all.min[i]))
        .fold(0.0, f64::max);
    let scale = 1.0 / extent;
    let unit = |p: [f32; 3]| {
        glam::Vec3A::from_array([0, 1, 2].map(|i| ((f64::from(p[i]) - center[i]) * scale) as f32))
    };
    let boxes: Vec<Aabb> = primitives
        .iter()
        .map(|p| Aabb::new(unit(p.bounds.min), unit(p.bounds.max)))
        .collect();
    let indices = (0..boxes.len() as u32).collect();
    // The crate's "medium" preset without its collapse, which the plan replaces.
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &boxes,
        indices,
        SortPrecision::U64,
        3,
    );
    ReinsertionOptimizer::default().run(&mut binary, REINSERTION, None);
    binary
}

/// Share of the binary nodes that reinsertion tries to place better in its first pass: 0.15 gives incoherent rays 3 % more speed
/// than 0.05 for a tenth more time of building.
const REINSERTION: f32 = 0.15;

struct Layout<'a> {
    primitives: &'a [Primitive],
    binary: &'a Bvh2,
    plan: &'a Plan,
    cost_depth: usize,
    /// Primitives are instances.
    alone: bool,
    tree: Tree,
}

impl Layout<'_> {
    /// Appends a node with these children, then their subtrees, depth first. Returns its index and box.
    fn node(&mut self, steps: &[Step], depth: usize) -> (Child, Bounds) {
        self.tree.depth = self.tree.depth.max(depth);
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node8::EMPTY);
        let mut all = Bounds::EMPTY;
        for (lane, &step) in steps.iter().enumerate() {
            let (child, bounds) = match step {
                Step::Leaf(n) => {
                    let prims = self.plan.subtree(self.binary, n);
                    self.leaf(&prims)
                }
                Step::Inner(n) if depth < self.cost_depth => {
                    let steps = self.plan.children(self.binary, n);
                    self.node(&steps, depth + 1)
                }
                Step::Inner(n) => {
                    let prims = self.plan.subtree(self.binary, n);
                    self.balanced(&prims, depth + 1)
                }
            };
            self.tree.nodes[index].set(lane, &bounds, child);
            all.include(&bounds);
        }
        (Child::node(index), all)
    }

    /// Appends a subtree over `prims` that is split evenly by count.
    fn balanced(&mut self, prims: &[u32], depth: usize) -> (Child, Bounds) {
        let same_kind = |p: &[u32]| {
            p.iter().all(|&i| {
                self.primitives[i as usize].is_quadric()
                    == self.primitives[p[0] as usize].is_quadric()
            })
        };
        let most = if self.alone { 1 } else { LANES };
        if prims.len() <= most && same_kind(prims) {
            return self.leaf(prims);
        }
        self.tree.depth = self.tree.depth.max(depth);
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node8::EMPTY);
        let mut all = Bounds::EMPTY;
        for (lane, part) in prims.chunks(prims.len().div_ceil(8)).enumerate() {
            let (child, bounds) = self.balanced(part, depth + 1);
            self.tree.nodes[index].set(lane, &bounds, child);
            all.include(&bounds);
        }
        (Child::node(index), all)
    }

    /// Appends a leaf with `prims`, which are of one kind.
    fn leaf(&mut self, prims: &[u32]) -> (Child, Bounds) {
        let mut bounds = Bounds::EMPTY;
        let (packets, quadrics) = (self.tree.packets.len(), self.tree.quadrics.len());
        for (i, &p) in prims.iter().enumerate() {
            let p = &self.primitives[p as usize];
            bounds.include(&p.bounds);
            match p.item {
                Item::Instance => return (Child::leaf(true, p.number as usize, 1), p.bounds),
                Item::Quadric(quadric) => self.tree.quadrics.push(quadric),
                Item::Triangle(vertices) => {
                    if i % LANES == 0 {
                        self.tree.packets.push(Packet::EMPTY);
                    }
                    if let Some(packet) = self.tree.packets.last_mut() {
                        packet.set(i % LANES, vertices, p.number);
                    }
                }
            }
        }
        let child = if self.tree.quadrics.len() > quadrics {
            Child::leaf(true, quadrics, self.tree.quadrics.len() - quadrics)
        } else {
            Child::leaf(false, packets, self.tree.packets.len() - packets)
        };
        (child, bounds)
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::super::input::{Quad, Shape, Sphere};
    use super::super::portable::Portable;
    use super::super::ray::{Ray, RaySetup};
    use super::super::traverse::{Start, closest, occluded};
    use super::*;

    /// Subtrees split by count give the same hits as those split by cost, and keep the depth within bounds.
    #[test]
    fn splitting_by_count() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let mut vector = || vec3(random(), random(), random());
        let mut shapes = Vec::new();
        for i in 0..3000 {
            let (corner, edge_u, edge_v) = (vector(), vector() * 0.1, vector() * 0.1);
            shapes.push(if i % 3 == 0 {
                Shape::Sphere(Sphere {
                    center: corner,
                    radius: 0.03,
                })
            } else {
                Shape::Quad(Quad {
                    corner,
                    edge_u,
                    edge_v,
                })
            });
        }
        let (primitives, _) = primitives(&Geometry { shapes });
        let by_cost = build(&primitives).unwrap();
        for cost_depth in 1..4 {
            let by_count = build_to(&primitives, cost_depth).unwrap();
            assert!(by_count.depth <= cost_depth + 6, "{}", by_count.depth);
            let mut hits = 0;
            for _ in 0..2000 {
                let o: Vec3 = vector() * 2.0;
                let ray = RaySetup::new(&Ray::new(o, vector() - o)).unwrap();
                let expected = closest(Portable, &by_cost, &ray, Start::of(&ray), |_| true);
                assert_eq!(
                    closest(Portable, &by_count, &ray, Start::of(&ray), |_| true),
                    expected
                );
                hits += usize::from(expected.is_some());
            }
            assert!(hits > 500);
        }
    }

    /// A tree as deep as can be is traversed with the larger stack.
    #[test]
    fn deep_trees() {
        let corner = vec3(-1.0, -1.0, 0.0);
        let quad = |z: f32| {
            Shape::Quad(Quad {
                corner: corner + Vec3::Z * z,
                edge_u: Vec3::X * 2.0,
                edge_v: Vec3::Y * 2.0,
            })
        };
        let (primitives, _) = primitives(&Geometry {
            shapes: (0..8).map(|i| quad(-(i as f32))).collect(),
        });
        let mut tree = build(&primitives).unwrap();
        let root = tree.nodes[0].clone();
        // A chain: every node holds the original root's lanes but the last, and the next node.
        let whole = primitives.iter().fold(Bounds::EMPTY, |mut b, p| {
            b.include(&p.bounds);
            b
        });
        tree.nodes.clear();
        for i in 1..MAX_DEPTH {
            let mut node = root.clone();
            node.set(7, &whole, Child::node(i));
            for lane in 0..7 {
                node.set(lane, &whole, root.child[0]);
            }
            tree.nodes.push(node);
        }
        tree.nodes.push(root);
        tree.depth = MAX_DEPTH;
        let ray = RaySetup::new(&Ray::new(vec3(0.1, 0.2, 3.0), -Vec3::Z)).unwrap();
        let hit = closest(Portable, &tree, &ray, Start::of(&ray), |_| true).unwrap();
        assert!((hit.t - 3.0).abs() < 1e-6 && hit.prim / 2 == 0, "{hit:?}");
        assert!(closest(Portable, &tree, &ray, Start::of(&ray), |_| false).is_none());
        assert!(occluded(Portable, &tree, &ray));
        // Between two of them, in every box: all of the chain is walked for nothing.
        let mut between = Ray::new(vec3(0.1, 0.2, -0.1), -Vec3::Z);
        between.t_max = 0.8;
        let between = RaySetup::new(&between).unwrap();
        assert!(!occluded(Portable, &tree, &between));
    }
}
