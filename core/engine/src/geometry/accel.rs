//! The one type that answers ray queries.

use std::time::Instant;

use glam::Vec3;

use super::build;
use super::bvh8::Node8;
use super::input::{Geometry, GeometryError, Shape};
use super::instance::{Instance, Place};
use super::portable::Portable;
use super::quadric::Quadric;
use super::ray::{Hit, Ray, RaySetup};
#[cfg(target_arch = "x86_64")]
use super::simd::Avx2;
use super::surface::{Facet, SurfacePoint, offset_origin};
use super::traverse::{self, Candidate, Start, Tree};
use super::triangle::Packet;
use super::two_level::{self, Instances};

/// Geometry ready for rays. Queries take `&self`, allocate nothing and may run on any number of threads.
#[derive(Clone, Debug)]
pub struct Accel {
    geometry: Geometry,
    /// Number of the first primitive of each shape, and the total.
    first: Vec<u32>,
    tree: Tree,
    /// Where in `halves` a shape that is a quad has its own; beyond their end for other shapes.
    quads: Vec<u32>,
    halves: Vec<[Facet; 2]>,
    kernel: Dispatch,
    stats: AccelStats,
    instances: Option<Box<Instances>>,
}

/// What building cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelStats {
    /// Hierarchies built: 1 without instances (a scene without surfaces has no [`Accel`]); with them one for the boxes and one for each
    /// prototype besides.
    pub bvhs: usize,
    /// Instances.
    pub instances: usize,
    /// Eight-wide nodes of all hierarchies.
    pub nodes: usize,
    /// Nodes on the longest path from a root.
    pub depth: usize,
    /// Triangles that can be hit, those of quads included; those of prototypes once.
    pub triangles: usize,
    /// Spheres, disks and cylinders.
    pub quadrics: usize,
    /// Triangles left out because two of their vertices are equal. (Three different vertices on a line stay: a gap between
    /// their neighbours may need them.)
    pub degenerate_triangles: usize,
    /// Memory of nodes, triangle packets and quadrics (without the geometry itself).
    pub bytes: usize,
    /// Wall-clock time of the build.
    pub build_seconds: f64,
}

/// Which kernel this processor runs, found once at build.
#[derive(Clone, Copy, Debug)]
enum Dispatch {
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    Portable,
}

impl Dispatch {
    fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }
}

impl Accel {
    /// Checks `geometry` and builds the hierarchy over it.
    ///
    /// `Ok(None)` if nothing can be hit: no shapes, or nothing but triangles with equal vertices. Then nothing is built.
    ///
    /// # Errors
    /// What is wrong with the geometry.
    pub fn build(geometry: Geometry) -> Result<Option<Self>, GeometryError> {
        Self::build_instanced(geometry, Vec::new(), &[])
    }

    /// As [`Accel::build`], with copies of prototypes. Hits number shapes through: those of `geometry`, then for every instance
    /// those of its prototype (see [`Accel::instance_of`]).
    ///
    /// # Errors
    /// What is wrong with the geometry, a prototype or an instance. Errors of prototypes name the shape within the prototype: check
    /// them with [`Geometry::check`] before to know which.
    pub fn build_instanced(
        geometry: Geometry,
        prototypes: Vec<Geometry>,
        instances: &[Instance],
    ) -> Result<Option<Self>, GeometryError> {
        let start = Instant::now();
        geometry.check()?;
        let (primitives, degenerate) = build::primitives(&geometry);
        let instances = Instances::build(prototypes, instances, geometry.shapes.len())?;
        let tree = build::build(&primitives);
        drop(primitives);
        if tree.is_none() && instances.is_none() {
            return Ok(None);
        }
        let mut stats = AccelStats {
            degenerate_triangles: degenerate,
            ..AccelStats::default()
        };
        let further = instances.iter().flat_map(|i| i.trees());
        for tree in tree.iter().chain(further) {
            stats.bvhs += 1;
            stats.nodes += tree.nodes.len();
            stats.depth = stats.depth.max(tree.depth);
            stats.triangles += tree.packets.iter().map(Packet::count).sum::<usize>();
            stats.quadrics += tree.quadrics.len();
            stats.bytes += size_of::<Node8>() * tree.nodes.len()
                + size_of::<Packet>() * tree.packets.len()
                + size_of::<Quadric>() * tree.quadrics.len();
        }
        if let Some(i) = &instances {
            stats.instances = i.count();
            stats.bytes += i.bytes();
            stats.degenerate_triangles += i.degenerate_triangles;
        }
        stats.build_seconds = start.elapsed().as_secs_f64();
        let (mut quads, mut halves) = (Vec::with_capacity(geometry.shapes.len()), Vec::new());
        for shape in &geometry.shapes {
            quads.push(match shape {
                Shape::Quad(q) => {
                    halves.push(Facet::halves(q));
                    halves.len() as u32 - 1
                }
                _ => u32::MAX,
            });
        }
        Ok(Some(Self {
            quads,
            halves,
            first: geometry.first_primitives(),
            geometry,
            // If everything stands in instances, rays have the loose shapes behind them at once.
            tree: tree.unwrap_or_else(Tree::nothing),
            kernel: Dispatch::detect(),
            stats,
            instances: instances.map(Box::new),
        }))
    }

    /// The instance, and the shape within its prototype, that a hit's or a surface point's `shape` stands for; `None` if it is one
    /// of [`Accel::geometry`].
    #[inline]
    pub fn instance_of(&self, shape: u32) -> Option<(u32, u32)> {
        self.instances.as_ref()?.decode(shape)
    }

    /// The number that hits have for the first shape of an instance; 0 without instances.
    pub fn first_shape(&self, instance: u32) -> u32 {
        self.instances
            .as_ref()
            .map_or(0, |i| i.first_shape(instance))
    }

    /// Corners of a box around all instances.
    pub fn instance_bounds(&self) -> Option<(Vec3, Vec3)> {
        let (min, max) = self.instances.as_ref()?.bounds();
        Some((min.into(), max.into()))
    }

    /// The segment from `o` to just before the surface at `p`, which is known to within `p_error` along each axis and has the
    /// geometric normal `ng`; `shape` is the one that `p` lies on. `o` must have left its own surface ([`offset_origin`]).
    ///
    /// The direction of a segment is rounded, and so its end moves by up to half a unit in the last place of its length: what
    /// counts as the error of `p` grows with the distance.
    #[inline]
    pub fn segment(&self, o: Vec3, p: Vec3, p_error: Vec3, ng: Vec3, shape: u32) -> Ray {
        let d = p - o;
        let mut error = p_error + d.abs() * (1.01 / 16_777_216.0);
        if let Some(place) = self.placed(shape) {
            error += place.end_error(p, d);
        }
        Ray::segment(o, offset_origin(p, error, ng, -d))
    }

    #[inline]
    fn placed(&self, shape: u32) -> Option<&Place> {
        let all = self.instances.as_ref()?;
        all.place(all.decode(shape)?.0)
    }

    /// The shapes.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// What building cost.
    pub fn stats(&self) -> AccelStats {
        self.stats
    }

    /// Name of the kernel in use: "avx2" or "portable".
    pub fn kernel(&self) -> &'static str {
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(_) => "avx2",
            Dispatch::Portable => "portable",
        }
    }

    /// Makes queries use the plain Rust kernel, which returns the same hits. For comparisons.
    pub fn use_portable_kernel(&mut self) {
        self.kernel = Dispatch::Portable;
    }

    /// Nearest hit; of hits at equal t the one on the first shape and primitive.
    ///
    /// A ray with a non-finite component, an origin beyond 2·10¹⁸ or a direction without any component in 2⁻¹⁰⁰…2¹⁰⁰ hits
    /// nothing.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        if self.instances.is_some() {
            return self.closest_of_all(ray);
        }
        self.closest_candidate(ray).map(|c| self.hit(&c))
    }

    /// Whether anything is hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.any_candidate(ray) || self.occluded_by_instance(ray)
    }

    /// The surface at a hit of this `ray`.
    #[inline]
    pub fn interaction(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        if let Some(all) = &self.instances
            && let Some(at) = all.interaction(hit, ray)
        {
            return at;
        }
        let quad = self.quads.get(hit.shape as usize);
        match quad.and_then(|i| self.halves.get(*i as usize)) {
            Some(halves) => self.geometry.interaction_of_quad(hit, ray, halves),
            None => self.geometry.interaction(hit, ray),
        }
    }

    /// True where texture coordinates run clockwise seen from outside: ∂p/∂v is on the other side of ∂p/∂u than ng × ∂p/∂u.
    pub fn uv_mirrored(&self, shape: u32, prim: u32) -> bool {
        let placed = self
            .instances
            .as_ref()
            .and_then(|all| all.uv_mirrored(shape, prim));
        placed.unwrap_or_else(|| self.geometry.uv_mirrored(shape, prim))
    }

    /// [`Accel::closest`] for a scene with instances: first the shapes that stand by themselves, then the instances up to there.
    #[inline(never)]
    fn closest_of_all(&self, ray: &Ray) -> Option<Hit> {
        let loose = self.closest_candidate(ray).map(|c| self.hit(&c));
        let all = self.instances.as_ref()?;
        let setup = RaySetup::new(ray)?;
        let limit = loose.map_or(ray.t_max, |h| h.t);
        let placed = match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(k) => k.closest_instance(all, ray, &setup, limit),
            Dispatch::Portable => two_level::closest(Portable, all, ray, &setup, limit),
        };
        placed.map(|p| all.hit(&p)).or(loose)
    }

    #[inline]
    fn occluded_by_instance(&self, ray: &Ray) -> bool {
        self.instances.is_some() && self.occluded_by_some(ray)
    }

    #[inline(never)]
    fn occluded_by_some(&self, ray: &Ray) -> bool {
        let (Some(all), Some(setup)) = (&self.instances, RaySetup::new(ray)) else {
            return false;
        };
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(k) => k.occluded_instance(all, ray, &setup),
            Dispatch::Portable => two_level::occluded(Portable, all, ray, &setup),
        }
    }

    #[inline(always)]
    fn closest_candidate(&self, ray: &Ray) -> Option<Candidate> {
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(k) => k.closest(&self.tree, ray),
            Dispatch::Portable => closest_portable(&self.tree, ray),
        }
    }

    #[inline(always)]
    fn any_candidate(&self, ray: &Ray) -> bool {
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(k) => k.occluded(&self.tree, ray),
            Dispatch::Portable => occluded_portable(&self.tree, ray),
        }
    }

    #[inline]
    fn hit(&self, c: &Candidate) -> Hit {
        let shape = self.first.partition_point(|&f| f <= c.prim) - 1;
        Hit {
            t: c.t,
            shape: shape as u32,
            prim: c.prim - self.first[shape],
            u: c.u,
            v: c.v,
        }
    }
}

// Functions of their own: inlined beside the other kernel they cost it registers.
#[inline(never)]
fn closest_portable(tree: &Tree, ray: &Ray) -> Option<Candidate> {
    let ray = RaySetup::new(ray)?;
    traverse::closest(Portable, tree, &ray, Start::of(&ray), |_| true)
}

#[inline(never)]
fn occluded_portable(tree: &Tree, ray: &Ray) -> bool {
    RaySetup::new(ray).is_some_and(|ray| traverse::occluded(Portable, tree, &ray))
}
