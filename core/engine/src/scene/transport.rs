//! G for the whole scene: the next vertex along a ray, and connections to lights.

use super::normal_map::tangent_space;
use super::view::View;
use super::{Scene, Surface, media};
use crate::geometry::{Hit, Ray, SurfacePoint, offset_origin};
use crate::light::{Light, shows};
use resolvent_api::abi::{Status, scene_traits};
use resolvent_api::closure::Closure;
use resolvent_api::export::ScatterShim;
use resolvent_api::math::{Frame, Vec3, warp};
use resolvent_api::operator::{
    FlightDraws, Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample, Segment, lobes,
};
use resolvent_api::phase::MediumPoint;
use resolvent_api::rng::derive;
use resolvent_api::surface::SurfacePoint as BsdfPoint;
use resolvent_api::vertex::{
    Edge, LightSample, NONE, Vertex, VertexKind, WITH_MEDIA, vertex_flags,
};
use resolvent_api::{Event, Spectrum};

/// Boundaries a ray may pass before the scene is taken to be broken.
const MAX_BOUNDARIES: u32 = 100_000;

impl Scene {
    /// Origin and surrounding interiors of a ray that leaves `from` in direction `wi`.
    #[inline(always)]
    pub(super) fn leave(&self, from: &Vertex, wi: Vec3) -> (Vec3, u64) {
        let p = Vec3::from(from.p);
        if !from.is(VertexKind::Surface) {
            return (p, from.inside);
        }
        let ng = Vec3::from(from.ng);
        let crosses = (ng.dot(wi) < 0.0) != (ng.dot(Vec3::from(from.wo)) < 0.0);
        let inside = if crosses {
            self.cross(from.primitive[0], ng, wi, from.inside)
        } else {
            from.inside
        };
        (offset_origin(p, from.p_error.into(), ng, wi), inside)
    }

    /// The interiors behind a shape's surface, seen in direction `d`.
    #[inline(always)]
    fn cross(&self, shape: u32, ng: Vec3, d: Vec3, inside: u64) -> u64 {
        match self.surface(shape).interior {
            Some(i) if ng.dot(d) < 0.0 => self.interiors.entered(i, inside),
            Some(i) => self.interiors.left(i, inside),
            None => inside,
        }
    }

    /// Index of refraction on the outer side of a surface, of a ray that met it inside of `inside`: what the point is in, the shape
    /// itself aside.
    #[inline(always)]
    fn outside_ior(&self, surface: &Surface, inside: u64) -> f32 {
        let others = surface
            .interior
            .map_or(inside, |i| self.interiors.without(i, inside));
        self.interiors.ior(others)
    }

    /// The interiors at a point: the boundaries a ray from there leaves without having entered.
    pub(super) fn interiors_at(&self, p: Vec3) -> u64 {
        let Some(accel) = &self.accel else { return 0 };
        if self.interiors.is_empty() {
            return 0;
        }
        // A direction without symmetry, so that edges of axis-aligned shapes are not met.
        let mut ray = Ray::new(p, Vec3::new(0.267_3, 0.534_5, 0.801_8).normalize());
        let (mut entered, mut inside) = (0u64, 0u64);
        for _ in 0..MAX_BOUNDARIES {
            let Some(hit) = accel.closest(&ray) else {
                break;
            };
            let at = accel.interaction(&hit, &ray);
            if let Some(i) = self.surface(hit.shape).interior {
                if at.ng.dot(ray.d) < 0.0 {
                    entered = self.interiors.entered(i, entered);
                } else if self.interiors.has(i, entered) {
                    entered = self.interiors.left(i, entered);
                } else {
                    inside = self.interiors.entered(i, inside);
                }
            }
            ray = at.spawn(ray.d);
        }
        inside
    }

    /// The plugin that scatters at a vertex, as errors name it.
    pub(super) fn scatterer(&self, v: &Vertex) -> String {
        if v.is(VertexKind::Medium) {
            let m = &self.media[v.medium as usize];
            let title = m
                .medium
                .phases
                .get(v.phase as usize)
                .map_or("isotropic scattering".into(), |p| p.title());
            return format!("{title} in the medium '{}':", m.name);
        }
        let shape = v.primitive[0];
        let material = (shape != NONE).then(|| self.surface(shape).material);
        match material.flatten() {
            Some(m) => {
                let m = &self.materials[m as usize];
                format!("{} of the material '{}':", m.bsdf.title(), m.name)
            }
            None => "a vertex:".into(),
        }
    }
}

/// Scattering of a medium without a phase function of its own.
#[derive(Clone, Copy)]
struct Uniform;

impl Scatter for Uniform {
    fn eval(&self, _: Vec3, _: Vec3, _: Mode) -> ScatterEval {
        let f = warp::SPHERE_PDF;
        ScatterEval {
            f: Spectrum::splat(f),
            forward: f,
            reverse: f,
        }
    }
    fn sample(&self, _: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let f = warp::SPHERE_PDF;
        Some(ScatterSample {
            weight: Spectrum::ONE,
            wi: warp::sphere(u.dir).into(),
            eta: 1.0,
            forward: f,
            reverse: f,
            measure: 0,
            lobe: 0,
        })
    }
    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

static UNIFORM: resolvent_api::abi::ScatterTable = ScatterShim::<Uniform>::TABLE;

impl View<'_> {
    /// Follows the ray `o + t d` to its next vertex.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub(super) fn travel<const SURFACES: bool, const MEDIA: u8>(
        &self,
        o: Vec3,
        d: Vec3,
        inside: u64,
        u: &FlightDraws,
        edge: &mut Edge,
        next: &mut Vertex,
    ) -> Status {
        match self.try_travel::<SURFACES, MEDIA>(o, d, inside, u, edge, next) {
            Ok(true) => Status::OK,
            Ok(false) => Status::NONE,
            Err(status) => status,
        }
    }

    #[inline(always)]
    fn try_travel<const SURFACES: bool, const MEDIA: u8>(
        &self,
        mut o: Vec3,
        d: Vec3,
        mut inside: u64,
        u: &FlightDraws,
        edge: &mut Edge,
        next: &mut Vertex,
    ) -> Result<bool, Status> {
        self.go_on()?;
        if WITH_MEDIA {
            *edge = resolvent_pathspace::mis::clear(0.0);
        } else {
            edge.length = 0.0;
        }
        let (mut u, prior) = (*u, u.prior);
        for boundary in 0..MAX_BOUNDARIES {
            let hit = if SURFACES { self.closest(o, d) } else { None };
            let t1 = hit.as_ref().map_or(f32::INFINITY, |(h, _)| h.t);
            let segment = Segment {
                o: o.into(),
                t0: 0.0,
                d: d.into(),
                t1,
            };
            if MEDIA != media::NONE && t1 > 0.0 {
                let passage = self.fly::<MEDIA>(&segment, inside, &u)?;
                let f = &passage.flight;
                edge.emitted += edge.value * f.emitted;
                edge.value *= f.value;
                edge.track *= f.track;
                edge.ratio *= f.ratio;
                edge.media |= u32::from(passage.met);
                if f.event == Event::Collided as u32 {
                    edge.length += f.t;
                    next.inside = inside;
                    self.medium_vertex(passage.medium, f, o + d * f.t, d, next)?;
                    return Ok(true);
                }
            }
            let Some((hit, ray)) = hit else {
                edge.length = f32::INFINITY;
                return Ok(self.escape(d, next));
            };
            edge.length += hit.t;
            let at = self.scene.accel.as_ref().map(|a| a.interaction(&hit, &ray));
            let Some(at) = at else { return Ok(false) };
            let surface = self.scene.surface(hit.shape);
            if !surface.passes(inside, at.ng.dot(d) >= 0.0) {
                next.inside = inside;
                return self.surface_vertex(&at, d, next);
            }
            inside = self.scene.cross(hit.shape, at.ng, d, inside);
            o = at.offset(d);
            // What comes behind the boundary has numbers of its own and stands behind what came before.
            u.key = derive(u.key, 0x626f_756e ^ u64::from(boundary));
            let mut fresh = resolvent_api::rng::Stream::new(u.key ^ 1);
            (u.tau, u.event) = (fresh.uniform(), fresh.uniform());
            // `track` is of all that lies in front already.
            u.prior = prior * edge.track;
        }
        Err(self.fail(format!(
            "a ray passed {MAX_BOUNDARIES} boundaries without end at {o:?}"
        )))
    }

    #[inline(always)]
    fn closest(&self, o: Vec3, d: Vec3) -> Option<(Hit, Ray)> {
        self.count(|c| c.rays += 1);
        let ray = Ray::new(o, d);
        let hit = self.scene.accel.as_ref()?.closest(&ray)?;
        Some((hit, ray))
    }

    #[inline(always)]
    fn escape(&self, d: Vec3, next: &mut Vertex) -> bool {
        if self.scene.traits & scene_traits::ENVIRONMENT == 0 {
            return false;
        }
        let radiance = self.scene.lights.environment(false, d).0;
        next.kind = VertexKind::Emitter as u32;
        next.flags = vertex_flags::INFINITE | vertex_flags::EMITS;
        next.p = d.into();
        next.wo = (-d).into();
        next.light = NONE;
        next.emitted = radiance;
        !radiance.is_zero()
    }

    #[inline(always)]
    fn medium_vertex(
        &self,
        medium: u32,
        f: &resolvent_api::Flight,
        p: Vec3,
        d: Vec3,
        next: &mut Vertex,
    ) -> Result<(), Status> {
        next.kind = VertexKind::Medium as u32;
        next.flags = 0;
        next.p = p.into();
        next.wo = (-d).into();
        next.medium = medium;
        next.phase = f.phase;
        next.light = NONE;
        next.sigma_t = f.sigma_t;
        next.sigma_s = f.sigma_s;
        let m = &self.scene.media[medium as usize];
        if f.sigma_s.is_zero() {
            next.scatter = Closure::EMPTY;
            return Ok(());
        }
        match m.medium.phases.get(f.phase as usize) {
            Some(phase) => phase
                .closure(
                    &MediumPoint {
                        p: p.into(),
                        lanes: self.scene.lanes,
                    },
                    &mut next.scatter,
                )
                .map_err(|e| {
                    self.fail(format!(
                        "{} in the medium '{}': {}",
                        phase.title(),
                        m.name,
                        e.0
                    ))
                }),
            None => {
                // SAFETY: `UNIFORM` is the table made for `Uniform`.
                unsafe { Closure::store(&mut next.scatter, &raw const UNIFORM, Uniform) };
                Ok(())
            }
        }
    }

    #[inline(always)]
    fn surface_vertex(
        &self,
        at: &SurfacePoint,
        d: Vec3,
        next: &mut Vertex,
    ) -> Result<bool, Status> {
        let surface = self.scene.surface(at.shape);
        next.kind = VertexKind::Surface as u32;
        next.flags = 0;
        next.p = at.p.into();
        next.p_error = at.p_error.into();
        next.ng = at.ng.into();
        next.wo = (-d).into();
        next.uv = at.uv.into();
        next.primitive = [at.shape, at.prim];
        next.light = NONE;
        next.frame = shading_frame(at);
        if let Some(light) = surface.light {
            next.light = light;
            if let Light::Area(area) = &self.scene.lights.all[light as usize] {
                next.emitted = shows(area, at, -d);
                if !next.emitted.is_zero() {
                    next.flags = vertex_flags::EMITS;
                }
            }
        }
        let Some(material) = surface.material else {
            next.scatter = Closure::EMPTY;
            return Ok(next.flags & vertex_flags::EMITS != 0);
        };
        let material = &self.scene.materials[material as usize];
        let mut tangent = next.frame;
        if (material.normal_map.is_some() || material.bsdf.has_own_normals())
            && let Some(accel) = &self.scene.accel
        {
            tangent = tangent_space(&tangent, accel.uv_mirrored(at.shape, at.prim));
            if let Some(map) = &material.normal_map {
                next.frame = map.turn(&next.frame, &tangent, at.ng, next.uv);
            }
        }
        let point = BsdfPoint {
            p: next.p,
            ng: next.ng,
            frame: next.frame,
            uv: next.uv,
            lanes: self.scene.lanes,
            outside_ior: self.scene.outside_ior(surface, next.inside),
            color: at.color,
            tangent,
        };
        material
            .bsdf
            .closure(&point, &mut next.scatter)
            .map_err(|e| {
                self.fail(format!(
                    "{} of the material '{}': {}",
                    material.bsdf.title(),
                    material.name,
                    e.0
                ))
            })?;
        Ok(true)
    }

    /// Connects a vertex to a point on a light.
    #[inline(always)]
    pub(super) fn join<const SURFACES: bool, const MEDIA: u8>(
        &self,
        from: &Vertex,
        to: &LightSample,
        u: &FlightDraws,
        edge: &mut Edge,
    ) -> Status {
        match self.try_join::<SURFACES, MEDIA>(from, to, u, edge) {
            Ok(true) => Status::OK,
            Ok(false) => Status::NONE,
            Err(status) => status,
        }
    }

    #[inline(always)]
    fn try_join<const SURFACES: bool, const MEDIA: u8>(
        &self,
        from: &Vertex,
        to: &LightSample,
        u: &FlightDraws,
        edge: &mut Edge,
    ) -> Result<bool, Status> {
        self.go_on()?;
        let (o, inside) = self.scene.leave(from, to.wi.into());
        let ray = self.towards(o, to);
        if SURFACES && let Some(accel) = &self.scene.accel {
            self.count(|c| c.shadow_rays += 1);
            if self.scene.has_passable_surfaces {
                return self.join_through::<MEDIA>(ray, inside, u, edge);
            }
            if accel.occluded(&ray) {
                return Ok(false);
            }
        }
        if !WITH_MEDIA {
            edge.length = to.distance;
            return Ok(true);
        }
        let (segment, _) = unit_segment(&ray);
        let Some((f, met)) = self.pass::<MEDIA>(&segment, inside, u)? else {
            return Ok(false);
        };
        *edge = Edge {
            value: f.value,
            track: f.track,
            ratio: f.ratio,
            emitted: Spectrum::ZERO,
            length: to.distance,
            media: u32::from(met),
        };
        Ok(true)
    }

    /// A connection that passes boundaries of interior media: piece by piece.
    fn join_through<const MEDIA: u8>(
        &self,
        mut ray: Ray,
        mut inside: u64,
        u: &FlightDraws,
        edge: &mut Edge,
    ) -> Result<bool, Status> {
        *edge = resolvent_pathspace::mis::clear(0.0);
        let Some(accel) = &self.scene.accel else {
            return Ok(true);
        };
        let end = ray.at(ray.t_max);
        let finite = ray.t_max.is_finite();
        let mut u = *u;
        for boundary in 0..MAX_BOUNDARIES {
            let hit = match accel.closest(&ray) {
                None => None,
                Some(h) => {
                    let surface = self.scene.surface(h.shape);
                    if !surface.may_pass() {
                        return Ok(false);
                    }
                    let at = accel.interaction(&h, &ray);
                    if !surface.passes(inside, at.ng.dot(ray.d) >= 0.0) {
                        return Ok(false);
                    }
                    Some((h, at))
                }
            };
            let (mut segment, length) = unit_segment(&ray);
            if let Some((h, _)) = &hit {
                segment.t1 = h.t * length;
            }
            if segment.t1 > 0.0 {
                let Some((f, met)) = self.pass::<MEDIA>(&segment, inside, &u)? else {
                    return Ok(false);
                };
                edge.value *= f.value;
                edge.track *= f.track;
                edge.ratio *= f.ratio;
                edge.media |= u32::from(met);
            }
            edge.length += segment.t1;
            let Some((h, at)) = hit else {
                return Ok(true);
            };
            inside = self.scene.cross(h.shape, at.ng, ray.d, inside);
            let o = at.offset(ray.d);
            ray = if finite {
                Ray::segment(o, end)
            } else {
                Ray::new(o, ray.d)
            };
            u.key = derive(u.key, 0x626f_756e ^ u64::from(boundary));
            let mut fresh = resolvent_api::rng::Stream::new(u.key ^ 1);
            (u.tau, u.event) = (fresh.uniform(), fresh.uniform());
        }
        Err(self.fail(format!(
            "a connection passed {MAX_BOUNDARIES} boundaries without end"
        )))
    }

    /// The ray of a connection; it ends just before the light's own surface.
    #[inline(always)]
    fn towards(&self, o: Vec3, to: &LightSample) -> Ray {
        if to.flags & vertex_flags::INFINITE != 0 {
            return Ray::new(o, to.wi.into());
        }
        let (p, ng) = (Vec3::from(to.p), Vec3::from(to.ng));
        match &self.scene.accel {
            Some(accel) if to.flags & vertex_flags::DELTA == 0 => {
                accel.segment(o, p, to.p_error.into(), ng, to.primitive[0])
            }
            _ => Ray::segment(o, p),
        }
    }

    /// Approximate optical depth of a connection.
    pub(super) fn approximate_depth(
        &self,
        from: &Vertex,
        to: &LightSample,
    ) -> Result<Spectrum, Status> {
        let (o, inside) = self.scene.leave(from, to.wi.into());
        let segment = Segment {
            o: o.into(),
            t0: 0.0,
            d: to.wi,
            t1: to.distance,
        };
        self.depth(&segment, inside)
    }
}

/// The segment of a ray with a unit direction, and the length of the ray's own.
#[inline(always)]
fn unit_segment(ray: &Ray) -> (Segment, f32) {
    let length = if ray.t_max.is_finite() {
        ray.d.length()
    } else {
        1.0
    };
    let d = ray.d / length;
    (
        Segment {
            o: ray.o.into(),
            t0: 0.0,
            d: d.into(),
            t1: ray.t_max * length,
        },
        length,
    )
}

/// The shading frame: z along the shading normal, x along ∂p/∂u.
#[inline(always)]
fn shading_frame(at: &SurfacePoint) -> Frame {
    let n = at.ns;
    let s = at.dpdu - n * n.dot(at.dpdu);
    let l2 = s.length_squared();
    if !(l2 > 0.0 && l2.is_finite()) {
        return Frame::around(n);
    }
    let s = s / l2.sqrt();
    Frame {
        s: s.into(),
        t: n.cross(s).into(),
        n: n.into(),
    }
}
