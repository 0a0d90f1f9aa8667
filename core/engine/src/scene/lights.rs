//! From described lights and emitting shapes to the engine's.

use super::shapes::affine;
use crate::error::{Error, Result};
use crate::geometry::Shape;
use crate::light::{Area, ImageEnvironment, Light, Shaping, Spot, SunSky};
use crate::texture::{Binding, Textures};
use glam::{DMat3, DVec3};
use resolvent_api::{Spectrum, Vec3};
use resolvent_scene as describe;

pub(super) fn spectrum(rgb: [f64; 3]) -> Spectrum {
    Spectrum::rgb(rgb[0] as f32, rgb[1] as f32, rgb[2] as f32)
}

/// What a shape's emission is multiplied with.
pub(super) fn emission_texture(
    shape: &describe::Shape,
    scene: &describe::Scene,
    textures: &Textures,
) -> Result<Option<Binding>> {
    let Some(name) = &shape.emission_texture else {
        return Ok(None);
    };
    let texture = textures.get(name, scene)?;
    // No light is negative, and none so bright that sums of it overflow.
    Ok(Some(Binding::new(texture, 0.0, 1e30)))
}

pub(super) fn area(shape: &Shape, index: u32, radiance: Spectrum, two_sided: bool) -> Area {
    match shape {
        Shape::Quad(q) => Area::quad(index, *q, radiance, two_sided),
        Shape::Sphere(s) => Area::sphere(index, *s, radiance, two_sided),
        Shape::Disk(d) => Area::disk(index, *d, radiance, two_sided),
        Shape::Cylinder(c) => Area::cylinder(index, *c, radiance, two_sided),
        Shape::Mesh(m) => Area::mesh(index, m.clone(), radiance, two_sided),
    }
}

/// What directions a shape's emission favours.
pub(super) fn shaping(shape: &describe::Shape) -> Option<Shaping> {
    shape.shaping.map(|s| {
        let tint = spectrum(s.focus_tint);
        Shaping::new(unit(s.axis), s.angle_deg, s.softness, s.focus, tint)
    })
}

/// A direction of any length, scaled before it is squared.
pub(super) fn unit(v: [f64; 3]) -> Vec3 {
    let v = DVec3::from(v);
    (v / v.abs().max_element()).normalize().as_vec3()
}

/// A sky and its sun.
pub(super) fn sun_sky(light: &describe::Light) -> Vec<Light> {
    let describe::Light::SunSky {
        to_sun,
        turbidity,
        ground_albedo,
        scale,
        sun,
        sun_angle_deg,
        rotation,
    } = light
    else {
        return Vec::new();
    };
    if scale.iter().all(|v| *v == 0.0) {
        return Vec::new();
    }
    let [x_axis, y_axis, z_axis] = affine(rotation).columns;
    SunSky {
        to_sun: unit(*to_sun).as_dvec3().normalize(),
        turbidity: *turbidity,
        ground_albedo: *ground_albedo,
        scale: *scale,
        sun_angle_deg: sun.then_some(*sun_angle_deg),
        to_world: DMat3::from_cols(x_axis, y_axis, z_axis),
    }
    .lights()
}

/// Lights that are no surfaces; black ones are left out.
pub(super) fn distant_light(
    scene: &describe::Scene,
    light: &describe::Light,
    centre: DVec3,
) -> Result<Option<Light>> {
    let black = |rgb: &[f64; 3]| rgb.iter().all(|v| *v == 0.0);
    Ok(match light {
        describe::Light::Environment(describe::Environment::Constant { radiance }) => {
            (!black(radiance)).then(|| Light::Constant {
                radiance: spectrum(*radiance),
            })
        }
        describe::Light::Environment(describe::Environment::Image {
            file,
            mapping,
            scale,
            rotation,
        }) => {
            let path = scene.resolve(file);
            let (width, height, mut texels) = crate::texture::read_environment(&path, *mapping)?;
            for t in &mut texels {
                for (v, s) in t.iter_mut().zip(scale) {
                    *v *= *s as f32;
                }
                if t.iter().any(|v| !v.is_finite() || *v < 0.0) {
                    return Err(Error::Input(format!(
                        "{}: has a pixel that is negative or not finite, which no light can be",
                        path.display()
                    )));
                }
            }
            let r = affine(rotation).to_rows();
            let rows = [0, 1, 2].map(|i| DVec3::new(r[i][0], r[i][1], r[i][2]).as_vec3());
            Some(Light::Image(Box::new(ImageEnvironment::new(
                width, height, texels, rows,
            ))))
        }
        describe::Light::Distant {
            to_light,
            irradiance,
            angle_deg,
        } => {
            let to_light = unit(*to_light);
            let irradiance_rgb = spectrum(*irradiance);
            (!black(irradiance)).then(|| {
                if *angle_deg > 0.0 {
                    Light::disc(to_light, irradiance_rgb, *angle_deg)
                } else {
                    Light::Distant {
                        to_light,
                        irradiance: irradiance_rgb,
                    }
                }
            })
        }
        describe::Light::Point {
            position,
            intensity,
        } => (!black(intensity)).then(|| Light::Point {
            position: (DVec3::from(*position) - centre).as_vec3(),
            intensity: spectrum(*intensity),
        }),
        describe::Light::Spot {
            position,
            direction,
            intensity,
            angle_deg,
            inner_angle_deg,
        } => (!black(intensity)).then(|| {
            Light::Spot(Spot::new(
                (DVec3::from(*position) - centre).as_vec3(),
                unit(*direction),
                spectrum(*intensity),
                *angle_deg,
                *inner_angle_deg,
            ))
        }),
        describe::Light::Rectangle { .. } | describe::Light::SunSky { .. } => None,
    })
}
