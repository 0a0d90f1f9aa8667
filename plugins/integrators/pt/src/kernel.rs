//! One path.

use resolvent_api::abi::{PixelSample, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::operator::{Mode, Scatter, lobes};
use resolvent_api::vertex::{Edge, vertex_flags};
use resolvent_api::{SceneView, Spectrum, Transport, Vec3, Vertex, VertexKind};
use resolvent_pathspace::mis::Throughput;
use resolvent_pathspace::sampler::Sampler;
use resolvent_pathspace::{roulette, scatter};

/// What paths are made with.
pub struct Kernel<'a> {
    /// The scene.
    pub scene: &'a SceneView<'a>,
    /// Scattering events after which a path ends.
    pub max_depth: u32,
    /// Keep only light scattered exactly this often.
    pub order: Option<u32>,
}

/// How the direction to the next vertex was found, for the weight of light met there.
enum Found {
    /// By the camera or a delta lobe: no connection could have found it.
    Alone,
    /// By scattering with this density per steradian.
    With(f32),
}

impl Kernel<'_> {
    /// Traces the path of one sample of the pixel at `pixel`.
    pub fn path<const CHROMATIC: bool>(
        &self,
        sampler: &Sampler,
        pixel: [u32; 2],
        features: bool,
    ) -> Outcome<PixelSample> {
        let scene = self.scene;
        let lanes = scene.lanes();
        let mut out = PixelSample::default();
        let (film, lens) = sampler.camera();
        let Some(ray) = scene.camera_ray(pixel, film, lens)? else {
            return Ok(out);
        };

        let mut beta = Throughput::ONE;
        beta.f *= ray.weight;
        let (mut first, mut second) = (Vertex::empty(), Vertex::empty());
        // Vertices are large: they change roles, not places.
        let (mut here, mut next) = (&mut first, &mut second);
        let mut edge = Edge::default();
        let mut found = Found::Alone;
        let mut alive = scene.emerge(&ray, &sampler.flight(0, beta.p), &mut edge, next)?;
        let connects = scene.has(scene_traits::LIGHTS);
        let emissive = scene.has(scene_traits::EMISSIVE_MEDIA);

        for depth in 0.. {
            if emissive && self.keeps(depth) {
                out.radiance += beta.f * edge.emitted;
            }
            if !alive {
                break;
            }
            let medium = next.is(VertexKind::Medium);
            if !medium && next.flags & vertex_flags::EMITS != 0 && self.keeps(depth) {
                let other = match found {
                    Found::With(density) if connects => scene.light_density(here, next) / density,
                    _ => 0.0,
                };
                out.radiance += beta.found::<CHROMATIC>(&edge, other, lanes) * next.emitted;
            }
            if next.is(VertexKind::Emitter) {
                break;
            }
            if depth == 0 {
                out.alpha = 1.0;
                if features {
                    describe(&mut out, next, edge.length);
                }
            }
            beta.travel::<CHROMATIC>(&edge);
            if depth >= self.max_depth {
                break;
            }
            std::mem::swap(&mut here, &mut next);
            if medium {
                beta.collide::<CHROMATIC>(here.sigma_t, here.sigma_s, lanes);
                if beta.f.is_zero() {
                    break;
                }
            }
            if connects && self.keeps(depth + 1) {
                out.radiance += self.connect::<CHROMATIC>(here, &beta, sampler, depth)?;
            }

            let (draws, chance) = sampler.scatter(depth);
            let Some(s) = scatter::sample(scene, here, draws, Mode::Radiance)? else {
                break;
            };
            beta.f *= s.weight;
            let q = roulette::survival(beta.weight::<CHROMATIC>(lanes).max_lane());
            if q < 1.0 {
                if chance >= q {
                    break;
                }
                beta.f *= 1.0 / q;
            }
            found = if scatter::is_delta(&s) {
                Found::Alone
            } else {
                Found::With(s.forward)
            };
            let flight = sampler.flight(depth + 1, beta.p);
            alive = scene.propagate(here, Vec3::from(s.wi), &flight, &mut edge, next)?;
        }
        Ok(out)
    }

    /// True if light scattered `order` times is wanted.
    #[inline(always)]
    fn keeps(&self, order: u32) -> bool {
        self.order.is_none_or(|o| o == order)
    }

    /// Light that reaches `here` straight from a light chosen at random.
    #[inline(always)]
    fn connect<const CHROMATIC: bool>(
        &self,
        here: &Vertex,
        beta: &Throughput,
        sampler: &Sampler,
        depth: u32,
    ) -> Outcome<Spectrum> {
        let scene = self.scene;
        if here.is(VertexKind::Surface) && here.scatter.lobes() & lobes::SMOOTH == 0 {
            return Ok(Spectrum::ZERO);
        }
        let (choice, point, chance) = sampler.light(depth);
        let Some(light) = scene.sample_light(here, choice, point)? else {
            return Ok(Spectrum::ZERO);
        };
        let e = scatter::eval(scene, here, Vec3::from(light.wi), Mode::Radiance)?;
        if e.f.is_zero() {
            return Ok(Spectrum::ZERO);
        }
        let mut weight = e.f;
        if here.is(VertexKind::Medium) {
            // A peaked phase function rarely faces the light: most connections carry next to nothing. Roulette on the value
            // relative to isotropic scattering saves their transmittance.
            let q = roulette::connection(e.f.max_lane());
            if q < 1.0 {
                if chance >= q {
                    return Ok(Spectrum::ZERO);
                }
                weight *= 1.0 / q;
            }
        }
        let Some(edge) = scene.connect(here, &light, &sampler.connection(depth, beta.p))? else {
            return Ok(Spectrum::ZERO);
        };
        let delta = light.flags & vertex_flags::DELTA != 0;
        let other = if delta { 0.0 } else { e.forward };
        let found = beta.connected::<CHROMATIC>(&edge, light.density, other, scene.lanes());
        Ok(found * weight * light.radiance)
    }
}

/// Depth, albedo and normal of the first vertex.
fn describe(out: &mut PixelSample, v: &Vertex, length: f32) {
    out.depth = length;
    if v.is(VertexKind::Medium) {
        let albedo = v
            .sigma_s
            .zip(v.sigma_t, |s, t| if t > 0.0 { s / t } else { 0.0 });
        out.albedo = albedo.to_rgb();
        return;
    }
    out.normal = v.frame.n;
    // Directional albedo for light from the normal's side, with one sample per path: f·|cos|/density.
    let wo = v.frame.to_local(Vec3::from(v.wo));
    let u = resolvent_api::ScatterDraws {
        lobe: 0.5,
        dir: [0.3, 0.7],
    };
    if let Some(s) = v.scatter.sample(wo, u, Mode::Radiance) {
        out.albedo = s.weight.to_rgb();
    }
}
