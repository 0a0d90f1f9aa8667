//! Instances: a hierarchy over their boxes in the world, and one hierarchy for every prototype.

use super::build;
use super::bvh8::{Child, Node8};
use super::input::{Geometry, GeometryError};
use super::instance::{Instance, Place};
use super::portable::Kernel;
use super::ray::{Hit, Ray, RaySetup};
use super::surface::SurfacePoint;
use super::traverse::{self, Candidate, DEEP_STACK, SHALLOW_STACK, Start, Tree, entry};

/// Shapes that are placed by instances.
#[derive(Clone, Debug)]
pub(super) struct Prototype {
    pub geometry: Geometry,
    /// Number of the first primitive of each shape, and the total.
    first: Vec<u32>,
    tree: Tree,
    /// Diagonal of its box.
    size: f64,
}

/// All instances of a scene.
#[derive(Clone, Debug)]
pub(super) struct Instances {
    pub prototypes: Vec<Option<Prototype>>,
    places: Vec<Place>,
    /// Leaves hold one instance each, by its number.
    top: Tree,
    /// The number that hits give the first shape of the first instance.
    base: u32,
    /// Shape numbers that every instance has.
    stride: u32,
    pub degenerate_triangles: usize,
}

/// A hit on an instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub instance: u32,
    pub at: Candidate,
}

impl Instances {
    /// Builds the hierarchies. `base` is the number of shapes that stand by themselves. `None` if nothing can be hit.
    pub fn build(
        prototypes: Vec<Geometry>,
        instances: &[Instance],
        base: usize,
    ) -> Result<Option<Self>, GeometryError> {
        let stride = prototypes.iter().map(|g| g.shapes.len()).max().unwrap_or(0);
        let numbers = stride
            .checked_mul(instances.len())
            .and_then(|n| n.checked_add(base));
        if numbers.is_none_or(|n| n >= u32::MAX as usize) {
            return Err(GeometryError::TooManyInstances(instances.len()));
        }
        let mut degenerate_triangles = 0;
        let mut built = Vec::with_capacity(prototypes.len());
        for geometry in prototypes {
            geometry.check()?;
            let (primitives, degenerate) = build::primitives(&geometry);
            degenerate_triangles += degenerate;
            built.push(build::build(&primitives).map(|tree| Prototype {
                first: geometry.first_primitives(),
                geometry,
                size: tree.size(),
                tree,
            }));
        }
        let mut places = Vec::with_capacity(instances.len());
        let mut boxes = Vec::with_capacity(instances.len());
        for (number, instance) in instances.iter().enumerate() {
            let place = Place::new(instance, number)?;
            let prototype = built.get(instance.prototype as usize);
            let Some(prototype) = prototype else {
                return Err(GeometryError::NoPrototype {
                    instance: number,
                    prototype: instance.prototype,
                });
            };
            places.push(place);
            if let Some(p) = prototype {
                boxes.push((number as u32, place.bounds(&p.tree.nodes[0], number)?));
            }
        }
        Ok(build::build_top(&boxes).map(|top| Self {
            prototypes: built,
            places,
            top,
            base: base as u32,
            stride: stride as u32,
            degenerate_triangles,
        }))
    }

    /// Instance, and shape within its prototype, of a shape number; `None` for shapes that stand by themselves.
    #[inline(always)]
    pub fn decode(&self, shape: u32) -> Option<(u32, u32)> {
        let n = shape.checked_sub(self.base)?;
        Some((n / self.stride, n % self.stride))
    }

    /// The number of the first shape of an instance.
    pub fn first_shape(&self, instance: u32) -> u32 {
        self.base + instance * self.stride
    }

    pub fn place(&self, instance: u32) -> Option<&Place> {
        self.places.get(instance as usize)
    }

    pub fn hit(&self, placed: &Placed) -> Hit {
        let prototype = self.places[placed.instance as usize].prototype;
        let shape_prim = self.prototypes[prototype as usize].as_ref().map(|p| {
            let shape = p.first.partition_point(|&f| f <= placed.at.prim) - 1;
            (shape as u32, placed.at.prim - p.first[shape])
        });
        let (shape, prim) = shape_prim.unwrap_or_default();
        Hit {
            t: placed.at.t,
            shape: self.first_shape(placed.instance) + shape,
            prim,
            u: placed.at.u,
            v: placed.at.v,
        }
    }

    /// The surface at a hit; `None` if it is not on an instance.
    pub fn interaction(&self, hit: &Hit, ray: &Ray) -> Option<SurfacePoint> {
        let (instance, shape) = self.decode(hit.shape)?;
        let place = self.places.get(instance as usize)?;
        let prototype = self.prototypes[place.prototype as usize].as_ref()?;
        let at = place.interaction(
            &prototype.geometry,
            prototype.size,
            &Hit { shape, ..*hit },
            ray,
        );
        Some(SurfacePoint {
            shape: hit.shape,
            ..at
        })
    }

    /// [`Geometry::uv_mirrored`] of a shape of an instance; `None` if it is on none.
    pub fn uv_mirrored(&self, shape: u32, prim: u32) -> Option<bool> {
        let (instance, shape) = self.decode(shape)?;
        let place = self.places.get(instance as usize)?;
        let prototype = self.prototypes[place.prototype as usize].as_ref()?;
        Some(prototype.geometry.uv_mirrored(shape, prim) != place.mirrors())
    }

    /// The box of the whole, as (min, max).
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        self.top.bounds()
    }

    pub fn trees(&self) -> impl Iterator<Item = &Tree> {
        let prototypes = self.prototypes.iter().flatten().map(|p| &p.tree);
        std::iter::once(&self.top).chain(prototypes)
    }

    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// Memory of everything but geometry and trees.
    pub fn bytes(&self) -> usize {
        size_of::<Place>() * self.places.len()
    }

    /// The tree and the ray of an instance, from the ray's point at `start` on.
    #[inline(always)]
    fn enter(&self, instance: u32, ray: &Ray, start: f32) -> Option<(&Tree, RaySetup)> {
        let place = &self.places[instance as usize];
        let prototype = self.prototypes[place.prototype as usize].as_ref()?;
        Some((&prototype.tree, RaySetup::new(&place.ray(ray, start))?))
    }
}

/// Next subtree that may hold a hit at or before `t_max`, and where the ray enters its box.
#[inline(always)]
fn next<const N: usize>(stack: &[u64; N], height: &mut usize, t_max: f32) -> Option<(f32, Child)> {
    while *height > 0 {
        *height -= 1;
        let top = stack[*height];
        let near = f32::from_bits((top >> 32) as u32);
        if near <= t_max {
            return Some((near, Child(top as u32)));
        }
    }
    None
}

/// Nearest hit nearer than `limit`; of hits at equal t the one on the instance and primitive of lowest number.
#[inline(always)]
pub(super) fn closest<K: Kernel>(
    k: K,
    all: &Instances,
    ray: &Ray,
    setup: &RaySetup,
    limit: f32,
) -> Option<Placed> {
    if 7 * all.top.depth < SHALLOW_STACK {
        closest_sized::<K, SHALLOW_STACK>(k, all, ray, setup, limit)
    } else {
        closest_sized::<K, DEEP_STACK>(k, all, ray, setup, limit)
    }
}

#[inline(always)]
fn closest_sized<K: Kernel, const N: usize>(
    k: K,
    all: &Instances,
    ray: &Ray,
    setup: &RaySetup,
    limit: f32,
) -> Option<Placed> {
    let mut best: Option<Placed> = None;
    let mut reached = limit;
    let mut stack = [0u64; N];
    stack[0] = entry(setup.t_min, Child::node(0));
    let mut height = 1;
    while let Some((near, child)) = next(&stack, &mut height, reached) {
        if child.is_leaf() {
            // Rays start where they enter the box: from far away, the rounding of the origin would be that of the distance.
            let start = if near > setup.t_min { near } else { 0.0 };
            let instance = child.items().start as u32;
            let Some((tree, inner)) = all.enter(instance, ray, start) else {
                continue;
            };
            // At equal t the lower instance wins, whatever the order of traversal. The difference is rounded: a little more is
            // looked at, and the sum decides.
            let ties = best.is_some_and(|b| instance < b.instance);
            let from = Start {
                t: reached - start + reached * (2.0 * f32::EPSILON),
                ties: true,
            };
            let placed = |c: &Candidate| Placed {
                instance,
                at: Candidate {
                    t: c.t + start,
                    ..*c
                },
            };
            let found = traverse::closest(k, tree, &inner, from, |c| {
                let p = placed(c);
                p.at.t < reached || (ties && p.at.t == reached)
            });
            if let Some(c) = found {
                let hit = placed(&c);
                reached = reached.min(hit.at.t);
                best = Some(hit);
            }
            continue;
        }
        let node: &Node8 = &all.top.nodes[child.0 as usize];
        let (mut mask, near) = k.node(setup, node, reached);
        let base = height;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            let new = entry(near.0[lane], node.child[lane]);
            let mut at = height;
            while at > base && stack[at - 1] < new {
                stack[at] = stack[at - 1];
                at -= 1;
            }
            stack[at] = new;
            height += 1;
        }
    }
    best
}

/// Whether anything is hit.
#[inline(always)]
pub(super) fn occluded<K: Kernel>(k: K, all: &Instances, ray: &Ray, setup: &RaySetup) -> bool {
    let mut stack = [0u64; DEEP_STACK];
    stack[0] = entry(setup.t_min, Child::node(0));
    let mut height = 1;
    while let Some((near, child)) = next(&stack, &mut height, f32::INFINITY) {
        if child.is_leaf() {
            let start = if near > setup.t_min { near } else { 0.0 };
            let instance = child.items().start as u32;
            let Some((tree, inner)) = all.enter(instance, ray, start) else {
                continue;
            };
            if traverse::occluded(k, tree, &inner) {
                return true;
            }
            continue;
        }
        let node: &Node8 = &all.top.nodes[child.0 as usize];
        let (mut mask, near) = k.node(setup, node, setup.t_max);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            stack[height] = entry(near.0[lane], node.child[lane]);
            height += 1;
        }
    }
    false
}
