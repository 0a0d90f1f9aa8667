//! From a description to a scene: plugins, geometry, lights, and the facts that choose the kernels.

use super::enclosure::{self, Filled};
use super::hierarchy::Hierarchy;
use super::instances::{Copies, Groups, emits};
use super::interiors::{Collected, Interior, Interiors};
use super::lights::{area, distant_light, emission_texture, shaping, spectrum, sun_sky};
use super::shapes::{Wide, affine};
use super::starts::Starts;
use super::{Material, NormalMap, PlacedMedium, Surface};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::{Accel, Geometry, Shape};
use crate::light::{Area, BoundingSphere, Light, Lights};
use crate::plugin::{ForeignBsdf, ForeignMedium, Registry, warn};
use crate::texture::{ReadImage, Textures};
use glam::DVec3;
use resolvent_api::abi::scene_traits;
use resolvent_api::medium::medium_traits;
use resolvent_api::{Aabb, Affine, PluginKind, Vec3};
use resolvent_scene as describe;
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Lanes in use: red, green and blue.
pub const RGB_LANES: u32 = 3;

/// What building a scene took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Preparation {
    /// Seconds for media (reading their files included).
    pub media_seconds: f64,
    /// Seconds for geometry.
    pub geometry_seconds: f64,
    /// Seconds for everything, plugins and lights included.
    pub total_seconds: f64,
}

/// A scene, ready to be rendered.
pub struct Scene {
    pub(crate) accel: Option<Accel>,
    /// Behind the shapes that stand by themselves; see [`Scene::surface`].
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) copies: Copies,
    pub(crate) interiors: Interiors,
    pub(crate) has_passable_surfaces: bool,
    /// All media absorb only.
    pub(crate) fades: bool,
    /// Some medium's extinction differs between lanes.
    pub(crate) chromatic: bool,
    /// Materials in use.
    pub materials: Vec<Material>,
    /// Media in use.
    pub media: Vec<PlacedMedium>,
    /// Over their bounds.
    pub(super) hierarchy: Hierarchy,
    pub(crate) lights: Lights,
    pub(crate) camera: Camera,
    /// Bits of [`scene_traits`].
    pub traits: u32,
    /// Lanes in use.
    pub lanes: u32,
    /// The point of the world that is the origin of everything here.
    pub centre: DVec3,
    pub(super) starts: Starts,
    /// The images that textures in use were read from.
    pub textures: Vec<ReadImage>,
    /// What building took.
    pub preparation: Preparation,
}

impl Scene {
    /// Builds what `scene` describes, with plugins from `registry`.
    ///
    /// # Errors
    /// Whatever is wrong with the scene or its plugins, with its place.
    pub fn build(scene: &describe::Scene, registry: &Registry) -> Result<Self> {
        let start = Instant::now();
        let lanes = RGB_LANES;
        let expanded = with_models(scene)?;
        let scene = &*expanded;
        let wide: Vec<Wide> = scene
            .shapes
            .iter()
            .map(|s| Wide::read(scene, &s.geometry))
            .collect::<Result<_>>()?;
        let groups = Groups::read(scene)?;
        let camera_to_world = affine(&scene.camera.to_world());
        let centre = centre(scene, &wide, &groups, camera_to_world.translation);
        let to_local = Affine::from_translation(-centre);

        let textures = Textures::new();
        let mut materials = Vec::new();
        let mut media_of: Vec<Option<u32>> = vec![None; scene.media.len()];
        let mut media = Vec::new();
        let free: Vec<&str> = scene.free_standing().map(|(name, _)| name).collect();
        let media_start = Instant::now();
        for (k, (name, described)) in scene.media.iter().enumerate() {
            let to_world = to_local.after(&affine(&described.transform));
            let instance = registry.instantiate(
                PluginKind::Medium,
                &described.block,
                scene,
                &to_world,
                lanes,
            )?;
            let medium = ForeignMedium::new(instance)?;
            let free = free.contains(&name.as_str());
            if medium.info.traits & medium_traits::EMPTY != 0 {
                continue;
            }
            if free && !medium.info.bounds.extent().is_finite() {
                return Err(describe::Problem::new(
                    &scene.source.file,
                    described.block.place.clone(),
                    format!("the medium '{name}' has no bounds of its own: give it some, or make it a shape's \"interior\""),
                )
                .into());
            }
            media_of[k] = Some(media.len() as u32);
            media.push(PlacedMedium {
                name: name.clone(),
                medium,
                free,
                interiors: 0,
                violated: AtomicBool::new(false),
            });
        }
        let media_seconds = media_start.elapsed().as_secs_f64();
        let geometry_start = Instant::now();
        let mut lights: Vec<Light> = Vec::new();
        let mut surfaces = Vec::new();
        let mut shapes = Vec::new();
        let mut collected = Collected::default();
        let priorities = scene.all_shapes().map(|s| s.priority);
        let lowest = priorities.min().unwrap_or(0);
        // What stands behind a shape, emission aside; the material of an instance replaces its own.
        let mut behind = |described: &describe::Shape, replaced: Option<&str>| -> Result<Surface> {
            let material = match replaced.or(described.material.as_deref()) {
                Some(name) => Some(material(
                    name,
                    scene,
                    registry,
                    lanes,
                    &textures,
                    &mut materials,
                )?),
                None => None,
            };
            let ior = material.map_or(1.0, |m| materials[m as usize].bsdf.ior());
            let medium = described
                .interior
                .as_deref()
                .and_then(|name| scene.media.get_index_of(name))
                .and_then(|k| media_of[k]);
            let null = match material {
                None => described.interior.is_some(),
                Some(m) => materials_null(&materials, m),
            };
            // A vacuum matters only where it displaces something.
            let hollow = described.priority > lowest
                && (null || material.is_some_and(|m| materials[m as usize].bsdf.refracts()));
            let interior = (medium.is_some() || ior != 1.0 || hollow).then(|| {
                collected.add(Interior {
                    medium,
                    ior,
                    priority: described.priority,
                })
            });
            Ok(Surface {
                material,
                light: None,
                interior,
                null,
                hidden_by: 0,
                body: 0,
            })
        };
        // Which of the described shapes the first of these are.
        let mut numbers = Vec::new();
        for (number, (described, wide)) in scene.shapes.iter().zip(wide).enumerate() {
            let shape = wide.narrow(centre);
            let mut surface = behind(described, None)?;
            if let Some(e) = described.emission.filter(|_| emits(described)) {
                let (index, sides) = (shapes.len() as u32, described.two_sided);
                let glow = emission_texture(described, scene, &textures)?;
                let emitter = area(&shape, index, spectrum(e), sides)
                    .textured(glow)
                    .shaped(shaping(described));
                lights.push(Light::Area(emitter));
                surface.light = Some(lights.len() as u32 - 1);
                surface.null = false;
            }
            if surface.null && surface.interior.is_none() {
                // It changes nothing: leave it out of the hierarchy.
                continue;
            }
            numbers.push(number);
            surfaces.push(surface);
            shapes.push(shape);
        }
        for light in &scene.lights {
            match light {
                describe::Light::Rectangle {
                    corner,
                    edge_u,
                    edge_v,
                    radiance,
                    two_sided,
                } => {
                    if radiance.iter().all(|v| *v == 0.0) {
                        continue;
                    }
                    let wide = Wide::Quad([*corner, *edge_u, *edge_v].map(DVec3::from));
                    let Shape::Quad(quad) = wide.narrow(centre) else {
                        continue;
                    };
                    let index = shapes.len() as u32;
                    lights.push(Light::Area(Area::quad(
                        index,
                        quad,
                        spectrum(*radiance),
                        *two_sided,
                    )));
                    surfaces.push(Surface {
                        material: None,
                        light: Some(lights.len() as u32 - 1),
                        interior: None,
                        null: false,
                        hidden_by: 0,
                        body: 0,
                    });
                    shapes.push(Shape::Quad(quad));
                }
                describe::Light::SunSky { .. } => lights.extend(sun_sky(light)),
                other => lights.extend(distant_light(scene, other, centre)?),
            }
        }
        // Area lights without area never shine.
        let (prototypes, placed) = groups.geometry(centre)?;
        let accel = Accel::build_instanced(Geometry { shapes }, prototypes, &placed)
            .map_err(|e| Error::Input(format!("{}: {e}", scene.source.file.display())))?;
        let mut copies = match &accel {
            Some(accel) if accel.stats().instances > 0 => groups.surfaces(
                accel,
                &placed,
                &mut behind,
                |described, shape, at, size, to_world| {
                    let radiance = spectrum(described.emission.unwrap_or_default());
                    let emitter = area(shape, at, radiance, described.two_sided);
                    let glow = emission_texture(described, scene, &textures)?;
                    let turned = shaping(described).map(|s| {
                        let axis = to_world.vector(s.axis().as_dvec3());
                        s.about(axis.try_normalize().map_or(s.axis(), |a| a.as_vec3()))
                    });
                    let emitter = emitter.made_of(size).textured(glow).shaped(turned);
                    lights.push(Light::Area(emitter));
                    Ok(lights.len() as u32 - 1)
                },
            )?,
            _ => Copies::default(),
        };
        let endless = media.iter().filter(|m| enclosure::is_endless(m, lanes));
        for medium in endless {
            let world = accel.iter().flat_map(|a| &a.geometry().shapes);
            let world = numbers.iter().zip(world).map(|(number, shape)| Filled {
                described: &scene.shapes[*number],
                place: format!("$.shapes[{number}]"),
                shape,
            });
            enclosure::check(scene, medium, &materials, world)?;
            for (name, described, shapes) in groups.bodies() {
                let body = described.iter().zip(&shapes).enumerate();
                let body = body.map(|(k, (described, shape))| Filled {
                    described,
                    place: format!("$.prototypes.{name}[{k}]"),
                    shape,
                });
                enclosure::check(scene, medium, &materials, body)?;
            }
        }
        let interiors = collected
            .sort(surfaces.iter_mut().chain(copies.surfaces_mut()))
            .map_err(|n| {
                Error::Input(format!(
                    "{n} interiors of shapes that differ in medium, index of refraction or priority; at most 64 can be told apart"
                ))
            })?;
        for (i, m) in (0..).zip(&mut media) {
            m.interiors = interiors.filled_by(i);
        }
        drop((groups, placed));
        let geometry_seconds = geometry_start.elapsed().as_secs_f64();

        let mut bounds = Aabb::EMPTY;
        for m in media.iter().filter(|m| m.free) {
            bounds = bounds.union(m.medium.info.bounds);
        }
        if let Some(accel) = &accel {
            let shapes = &accel.geometry().shapes;
            bounds = shapes.iter().fold(bounds, |b, s| shape_bounds(s, b));
            if let Some((lo, hi)) = accel.instance_bounds() {
                bounds = bounds.including(lo).including(hi);
            }
        }
        let radius = (0.5 * bounds.extent().length()).max(f32::MIN_POSITIVE);
        let center = if bounds.is_empty() {
            Vec3::ZERO
        } else {
            bounds.centre()
        };
        let lights = Lights::new(lights, BoundingSphere { center, radius }, lanes);

        let camera_pose = to_local.after(&camera_to_world);
        let camera = Camera::new(&camera_pose, &scene.camera, &scene.film);
        let has_passable_surfaces = surfaces
            .iter()
            .chain(copies.surfaces())
            .any(Surface::may_pass);
        let fades = media.iter().all(absorbs_only);
        let chromatic = media.iter().any(|m| is_chromatic(m, lanes));
        let mut traits = traits(&media, accel.is_some(), &lights);
        if chromatic || (fades && !media.is_empty()) {
            // Where light fades, its value is not its density: integrators must not leave both out.
            traits |= scene_traits::CHROMATIC_MEDIA;
        }
        let dark = lights.all.is_empty() && traits & scene_traits::EMISSIVE_MEDIA == 0;
        if dark {
            warn("the scene has no light: the picture will be black");
        }
        let mut built = Self {
            accel,
            surfaces,
            copies,
            interiors,
            has_passable_surfaces,
            fades,
            chromatic,
            materials,
            hierarchy: Hierarchy::new(
                &media
                    .iter()
                    .map(|m| m.medium.info.bounds)
                    .collect::<Vec<_>>(),
            ),
            media,
            lights,
            camera,
            traits,
            lanes,
            centre,
            starts: Starts::default(),
            textures: textures.read(),
            preparation: Preparation {
                media_seconds,
                geometry_seconds,
                total_seconds: 0.0,
            },
        };
        built.starts = Starts::new(&built);
        built.preparation.total_seconds = start.elapsed().as_secs_f64();
        Ok(built)
    }

    /// How many primitives can be hit, 0 without a hierarchy.
    pub fn accel(&self) -> Option<&Accel> {
        self.accel.as_ref()
    }

    /// What stands behind a shape, numbered as in hits.
    #[inline(always)]
    pub(crate) fn surface(&self, shape: u32) -> &Surface {
        match self.surfaces.get(shape as usize) {
            Some(surface) => surface,
            None => self.copied_surface(shape),
        }
    }

    #[inline(never)]
    fn copied_surface(&self, shape: u32) -> &Surface {
        let place = self.accel.as_ref().and_then(|a| a.instance_of(shape));
        let (instance, shape) = place.unwrap_or_default();
        self.copies.surface(instance, shape)
    }

    /// How many lights there are.
    pub fn light_count(&self) -> usize {
        self.lights.all.len()
    }
}

/// The scene with the meshes of its models, said what could not be shown as it is meant.
fn with_models(scene: &describe::Scene) -> Result<Cow<'_, describe::Scene>> {
    if !resolvent_gltf::has_models(scene) {
        return Ok(Cow::Borrowed(scene));
    }
    let mut expanded = scene.clone();
    let warnings =
        resolvent_gltf::expand(&mut expanded).map_err(|e| Error::Input(e.to_string()))?;
    warnings.into_iter().for_each(warn);
    Ok(Cow::Owned(expanded))
}

/// Index of the material `name`, made on first use.
fn material(
    name: &str,
    scene: &describe::Scene,
    registry: &Registry,
    lanes: u32,
    textures: &Textures,
    materials: &mut Vec<Material>,
) -> Result<u32> {
    if let Some(i) = materials.iter().position(|m| m.name == name) {
        return Ok(i as u32);
    }
    let described = scene
        .materials
        .get(name)
        .ok_or_else(|| Error::Input(format!("there is no material '{name}' in the scene")))?;
    let instance = registry.instantiate_textured(
        PluginKind::Bsdf,
        &described.block,
        scene,
        &Affine::IDENTITY,
        lanes,
        textures,
    )?;
    let bsdf = ForeignBsdf::new(Arc::new(instance))?;
    let normal_map = match &described.normal_map {
        Some(map) => Some(NormalMap::new(
            textures.get(&map.texture, scene)?,
            map.scale,
        )),
        None => None,
    };
    materials.push(Material {
        name: name.to_owned(),
        bsdf,
        normal_map,
    });
    Ok(materials.len() as u32 - 1)
}

fn is_chromatic(m: &PlacedMedium, lanes: u32) -> bool {
    m.medium.info.traits & medium_traits::GREY == 0 && !m.medium.info.sigma_max.is_grey(lanes)
}

fn absorbs_only(m: &PlacedMedium) -> bool {
    m.medium.info.traits & medium_traits::ABSORBS_ONLY != 0
}

pub(super) fn materials_null(materials: &[Material], m: u32) -> bool {
    materials[m as usize].bsdf.is_null()
}

/// The middle of what stands at a finite place: relative to it, coordinates keep their digits.
fn centre(scene: &describe::Scene, shapes: &[Wide], groups: &Groups, camera: DVec3) -> DVec3 {
    let mut boxes: Vec<(DVec3, DVec3)> = shapes.iter().filter_map(Wide::bounds).collect();
    boxes.extend(groups.boxes());
    for m in scene.media.values() {
        // A medium's own bounds are known only once it is made; its place is what keeps far-away scenes precise.
        let t = affine(&m.transform).translation;
        if t != DVec3::ZERO {
            boxes.push((t, t));
        }
    }
    let (lo, hi) = boxes
        .into_iter()
        .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
        .unwrap_or((camera, camera));
    let middle = 0.5 * (lo + hi);
    if middle.is_finite() {
        middle
    } else {
        DVec3::ZERO
    }
}

pub(super) fn shape_bounds(shape: &Shape, bounds: Aabb) -> Aabb {
    match shape {
        Shape::Sphere(s) => {
            let r = Vec3::splat(s.radius);
            bounds.including(s.center - r).including(s.center + r)
        }
        Shape::Disk(d) => {
            let r = Vec3::splat(d.radius);
            bounds.including(d.center - r).including(d.center + r)
        }
        Shape::Cylinder(c) => {
            let r = Vec3::splat(c.radius);
            [c.base, c.base + c.axis]
                .iter()
                .fold(bounds, |b, p| b.including(p - r).including(p + r))
        }
        Shape::Quad(q) => [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
            .iter()
            .fold(bounds, |b, (s, t)| {
                b.including(q.corner + q.edge_u * *s + q.edge_v * *t)
            }),
        Shape::Mesh(m) => m.positions.iter().fold(bounds, |b, p| b.including(*p)),
    }
}

/// The facts that choose the kernels.
fn traits(media: &[PlacedMedium], surfaces: bool, lights: &Lights) -> u32 {
    let mut t = 0;
    let mut set = |on: bool, bit: u32| t |= if on { bit } else { 0 };
    set(surfaces, scene_traits::SURFACES);
    set(!media.is_empty(), scene_traits::MEDIA);
    let tracked = |m: &PlacedMedium| m.medium.info.traits & medium_traits::ANALYTIC == 0;
    let emissive = |m: &PlacedMedium| m.medium.info.traits & medium_traits::EMISSIVE != 0;
    set(media.iter().any(emissive), scene_traits::EMISSIVE_MEDIA);
    set(media.iter().any(tracked), scene_traits::TRACKED_MEDIA);
    let surface_lights = surfaces && !lights.chooser(false).is_empty();
    let medium_lights = !media.is_empty() && !lights.chooser(true).is_empty();
    set(surface_lights || medium_lights, scene_traits::LIGHTS);
    set(
        lights.all.iter().any(Light::is_hittable),
        scene_traits::HITTABLE_LIGHTS,
    );
    set(lights.has_environment(), scene_traits::ENVIRONMENT);
    t
}
