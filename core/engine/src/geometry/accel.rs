//! The one type that answers ray queries.

use std::time::Instant;

use super::build;
use super::bvh8::Node8;
use super::input::{Geometry, GeometryError};
use super::portable::Portable;
use super::ray::{Hit, Ray, RaySetup};
#[cfg(target_arch = "x86_64")]
use super::simd::Avx2;
use super::sphere::Ball;
use super::surface::SurfacePoint;
use super::traverse::{self, Candidate, Tree};
use super::triangle::Packet;

/// Geometry ready for rays. Queries take `&self`, allocate nothing and may run on any number of threads.
#[derive(Clone, Debug)]
pub struct Accel {
    geometry: Geometry,
    /// Number of the first primitive of each shape, and the total.
    first: Vec<u32>,
    tree: Tree,
    kernel: Dispatch,
    stats: AccelStats,
}

/// What building cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelStats {
    /// Hierarchies built: 1 (a scene without surfaces has no [`Accel`]).
    pub bvhs: usize,
    /// Eight-wide nodes.
    pub nodes: usize,
    /// Nodes on the longest path from the root.
    pub depth: usize,
    /// Triangles that can be hit, those of quads included.
    pub triangles: usize,
    /// Spheres.
    pub spheres: usize,
    /// Triangles left out because two of their vertices are equal. (Three different vertices on a line stay: a gap between
    /// their neighbours may need them.)
    pub degenerate_triangles: usize,
    /// Memory of nodes, triangle packets and spheres (without the geometry itself).
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
    pub fn build(geometry: Geometry) -> Result<Option<Self>, GeometryError> {
        let start = Instant::now();
        geometry.check()?;
        let (primitives, degenerate_triangles) = build::primitives(&geometry);
        let spheres = primitives.iter().filter(|p| p.is_ball()).count();
        let triangles = primitives.len() - spheres;
        let Some(tree) = build::build(&primitives) else {
            return Ok(None);
        };
        let mut first = vec![0];
        let mut total = 0;
        for shape in &geometry.shapes {
            total += shape.primitives() as u32;
            first.push(total);
        }
        let stats = AccelStats {
            bvhs: 1,
            nodes: tree.nodes.len(),
            depth: tree.depth,
            triangles,
            spheres,
            degenerate_triangles,
            bytes: size_of::<Node8>() * tree.nodes.len()
                + size_of::<Packet>() * tree.packets.len()
                + size_of::<Ball>() * tree.balls.len(),
            build_seconds: start.elapsed().as_secs_f64(),
        };
        Ok(Some(Self {
            geometry,
            first,
            tree,
            kernel: Dispatch::detect(),
            stats,
        }))
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
        self.closest_candidate(ray, |_| true).map(|c| self.hit(&c))
    }

    /// Nearest hit that `accept` takes. It is asked about hits in no particular order, about some more than once or needlessly.
    /// A sphere whose nearer hit is refused is passed altogether: filters are meant to refuse primitives, not points.
    #[inline]
    pub fn closest_with(&self, ray: &Ray, mut accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        self.closest_candidate(ray, |c| accept(&self.hit(c)))
            .map(|c| self.hit(&c))
    }

    /// Whether anything is hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.any_candidate(ray, |_| true)
    }

    /// Whether anything is hit that `opaque` says blocks the ray. It is asked in no particular order; see
    /// [`Self::closest_with`] about spheres.
    #[inline]
    pub fn occluded_with(&self, ray: &Ray, mut opaque: impl FnMut(&Hit) -> bool) -> bool {
        self.any_candidate(ray, |c| opaque(&self.hit(c)))
    }

    /// The surface at a hit of this `ray`.
    #[inline]
    pub fn interaction(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        self.geometry.interaction(hit, ray)
    }

    #[inline(always)]
    fn closest_candidate(
        &self,
        ray: &Ray,
        accept: impl FnMut(&Candidate) -> bool,
    ) -> Option<Candidate> {
        let setup = RaySetup::new(ray)?;
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(k) => k.closest(&self.tree, &setup, accept),
            Dispatch::Portable => traverse::closest(Portable, &self.tree, &setup, accept),
        }
    }

    #[inline(always)]
    fn any_candidate(&self, ray: &Ray, opaque: impl FnMut(&Candidate) -> bool) -> bool {
        let Some(setup) = RaySetup::new(ray) else {
            return false;
        };
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2(k) => k.occluded(&self.tree, &setup, opaque),
            Dispatch::Portable => traverse::occluded(Portable, &self.tree, &setup, opaque),
        }
    }

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
