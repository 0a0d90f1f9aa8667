//! Integrator `single-scattering`: light that reaches the camera straight or after it was scattered once, by a surface or in a
//! medium. It has no parameters.
//!
//! Per sample: one flight from the camera, and one connection from the vertex it ends at to a point on a light, weighed by
//! the balance heuristic over the lanes (Wilkie et al. 2014; over null-collision paths Miller et al. 2019, eq. 15), so chromatic
//! media are exact. The picture is that of `pt` with `max_depth` 1, but for what no connection finds: surfaces that scatter by
//! delta lobes alone, and the light of a constant environment in media, which the host leaves to scattering
//! ([`SceneView::sample_light`]).

use resolvent_api::abi::{PixelSample, Tile, scene_traits};
use resolvent_api::integrator::{Outcome, SceneView};
use resolvent_api::operator::lobes;
use resolvent_api::rng::{Stream, derive};
use resolvent_api::vertex::vertex_flags;
use resolvent_api::{
    Edge, Error, FlightDraws, Integrator, Mode, Output, ParamDecl, Params, Plugin, Scatter,
    Spectrum, Transport, Vec3, Vertex, VertexKind,
};

/// The plugin.
pub struct SingleScattering;

impl Plugin for SingleScattering {
    const NAME: &'static str = "single-scattering";
    const SUMMARY: &'static str = "Light that was scattered at most once.";
    const PARAMS: &'static [ParamDecl] = &[];

    fn create(_: &Params<'_>) -> Result<Self, Error> {
        Ok(Self)
    }
}

impl Integrator for SingleScattering {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        for y in tile.min[1]..tile.max[1] {
            for x in tile.min[0]..tile.max[0] {
                for i in tile.sample_begin..tile.sample_end {
                    let pixel = u64::from(y) << 32 | u64::from(x);
                    let key = derive(derive(tile.seed, pixel), u64::from(i));
                    let sample = sample(scene, [x, y], &mut Stream::new(key))?;
                    out.add(x, y, &sample)?;
                }
            }
        }
        Ok(())
    }
}

fn sample(scene: &SceneView<'_>, pixel: [u32; 2], stream: &mut Stream) -> Outcome<PixelSample> {
    let mut out = PixelSample::default();
    let (film, lens) = (stream.uniform2(), stream.uniform2());
    let Some(ray) = scene.camera_ray(pixel, film, lens)? else {
        return Ok(out);
    };
    let hero = (stream.bits() % u64::from(scene.lanes())) as u32;
    let (mut edge, mut here) = (Edge::default(), Vertex::empty());
    let u = flight(scene, hero, Spectrum::ONE, stream);
    let met = scene.emerge(&ray, &u, &mut edge, &mut here)?;
    // What media emit on the way comes divided by its density.
    out.radiance += edge.emitted * ray.weight;
    if !met {
        return Ok(out);
    }
    let medium = here.is(VertexKind::Medium);
    // Contribution and density of the way here, lane by lane.
    let (mut f, mut p) = (edge.value * ray.weight, edge.track);
    if medium {
        (f, p) = (f * here.sigma_s, p * here.sigma_t);
    }
    let mean = p.mean(scene.lanes());
    if !(mean > 0.0) {
        return Ok(out);
    }
    (f, p) = (f / mean, p / mean);
    out.alpha = 1.0;
    if !medium && here.flags & vertex_flags::EMITS != 0 {
        out.radiance += f * here.emitted;
    }
    if here.is(VertexKind::Emitter) {
        out.alpha = 0.0;
        return Ok(out);
    }
    if scene.has(scene_traits::LIGHTS) {
        out.radiance += f * connected(scene, &here, p, hero, stream)?;
    }
    Ok(out)
}

/// Light from a point on a light, scattered at `here`; `p` is the density of the way there.
fn connected(
    scene: &SceneView<'_>,
    here: &Vertex,
    p: Spectrum,
    hero: u32,
    stream: &mut Stream,
) -> Outcome<Spectrum> {
    let none = Ok(Spectrum::ZERO);
    if here.scatter.lobes() & lobes::SMOOTH == 0 {
        return none;
    }
    let (choice, point) = (stream.uniform(), stream.uniform2());
    let Some(light) = scene.sample_light(here, choice, point)? else {
        return none;
    };
    let scattered = scattered(scene, here, light.wi.into())?;
    if scattered.is_zero() {
        return none;
    }
    let u = flight(scene, hero, p, stream);
    let Some(edge) = scene.connect(here, &light, &u)? else {
        return none;
    };
    let density = (p * edge.ratio).mean(scene.lanes()) * light.density;
    if !(density > 0.0) {
        return none;
    }
    Ok(scattered * light.radiance * edge.value / density)
}

/// The phase function, or the BSDF times the cosine, for light from `wi`.
fn scattered(scene: &SceneView<'_>, here: &Vertex, wi: Vec3) -> Outcome<Spectrum> {
    let wo = Vec3::from(here.wo);
    let fault = |_| scene.fault(here, "failed in eval");
    if here.is(VertexKind::Medium) {
        let e = here.scatter.try_eval(wo, wi, Mode::Radiance);
        return e.map(|e| e.f).map_err(fault);
    }
    // Where shading and geometric normal disagree about the side of a direction, light would leak.
    let (ng, ns) = (Vec3::from(here.ng), Vec3::from(here.frame.n));
    if ng.dot(wo) * ns.dot(wo) <= 0.0 || ng.dot(wi) * ns.dot(wi) <= 0.0 {
        return Ok(Spectrum::ZERO);
    }
    let (lo, li) = (here.frame.to_local(wo), here.frame.to_local(wi));
    let e = here.scatter.try_eval(lo, li, Mode::Radiance).map_err(fault)?;
    let mut f = e.f * li.z.abs();
    if lo.z * li.z < 0.0 {
        // Radiance that is refracted is as much denser as the square of the index says (Veach 1997, eq. 5.14).
        let eta = here.scatter.eta();
        let eta = if lo.z > 0.0 { eta } else { 1.0 / eta };
        f *= 1.0 / (eta * eta);
    }
    Ok(f)
}

/// The random numbers of a flight through media, after a way of density `prior`.
fn flight(scene: &SceneView<'_>, hero: u32, prior: Spectrum, stream: &mut Stream) -> FlightDraws {
    let [tau, event] = stream.uniform2();
    FlightDraws {
        key: stream.bits(),
        tau,
        event,
        hero,
        lanes: scene.lanes(),
        prior,
        ..FlightDraws::default()
    }
}

resolvent_api::export_plugin!(integrator, SingleScattering);
