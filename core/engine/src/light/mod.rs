//! Lights: sampled for connections, and met by scattered rays.
//!
//! Infinite lights (environment, suns with an angle) act as one mixture: a direction has the radiance of all of them and
//! the density of all of them, so a sun in front of a sky needs no special case.

mod area;
mod bound;
mod distribution;
mod emission;
mod image;
mod select;
mod shaping;
mod sky;
mod spot;
mod tree;

pub use area::{Area, AreaPoint, AreaShape};
pub use bound::Bound;
pub use distribution::Distribution;
pub use emission::BoundingSphere;
pub use image::ImageEnvironment;
pub use select::{Chooser, Lights, Reference, TREE_FROM};
pub use shaping::Shaping;
pub use sky::{EFFICACY, Sky, SunSky};
pub use spot::Spot;
pub use tree::Tree;

use crate::geometry::SurfacePoint;
use resolvent_api::Spectrum;
use resolvent_api::math::{Frame, Vec3, warp};
use resolvent_api::vertex::{LightSample, NONE, vertex_flags};
use std::f32::consts::PI;

/// A light.
pub enum Light {
    /// The same radiance from everywhere.
    Constant {
        /// W·sr⁻¹·m⁻².
        radiance: Spectrum,
    },
    /// A latitude-longitude image.
    Image(Box<ImageEnvironment>),
    /// Parallel light.
    Distant {
        /// Unit direction towards the light.
        to_light: Vec3,
        /// On a plane facing it, W·m⁻².
        irradiance: Spectrum,
    },
    /// A disc of constant radiance at infinity.
    Disc {
        /// Frame around the direction towards its centre.
        frame: Frame,
        /// W·sr⁻¹·m⁻².
        radiance: Spectrum,
        /// 1 − cosine of its half-angle, > 0.
        one_minus_cos: f32,
    },
    /// A point.
    Point {
        /// Position.
        position: Vec3,
        /// W·sr⁻¹.
        intensity: Spectrum,
    },
    /// A point that shines into a cone.
    Spot(Spot),
    /// An emitting shape.
    Area(Area),
}

/// A light sample with nothing but its direction, radiance and density.
fn at_infinity(wi: Vec3, radiance: Spectrum, density: f32, flags: u32) -> LightSample {
    LightSample {
        wi: wi.into(),
        distance: f32::INFINITY,
        radiance,
        density,
        light: NONE,
        flags: flags | vertex_flags::INFINITE,
        p: [0.0; 3],
        ng: [0.0; 3],
        primitive: [NONE; 2],
        p_error: [0.0; 3],
    }
}

/// A point light seen from `from`, with its intensity in a direction away from it; `None` if it shows nothing there.
fn at_point(
    position: Vec3,
    from: Vec3,
    intensity: impl FnOnce(Vec3) -> Spectrum,
) -> Option<LightSample> {
    let d = position - from;
    let d2 = d.length_squared();
    if !(d2 > 0.0) {
        return None;
    }
    let distance = d2.sqrt();
    let wi = d / distance;
    let intensity = intensity(-wi);
    if intensity.is_zero() {
        return None;
    }
    let mut s = at_infinity(wi, intensity / d2, 1.0, vertex_flags::DELTA);
    s.flags &= !vertex_flags::INFINITE;
    s.p = position.into();
    s.distance = distance;
    Some(s)
}

impl Light {
    /// A disc at infinity that gives `irradiance` (W·m⁻²) on a plane facing its centre, with the full angle `angle_deg`.
    pub fn disc(to_light: Vec3, irradiance: Spectrum, angle_deg: f64) -> Self {
        let half = (0.5 * angle_deg).to_radians();
        // 2 sin²(α/2) = 1 − cos α without cancellation; ∫ cos over the disc = π sin² α.
        let one_minus_cos = (2.0 * (0.5 * half).sin().powi(2)) as f32;
        let projected = (std::f64::consts::PI * half.sin().powi(2)) as f32;
        Self::Disc {
            frame: Frame::around(to_light),
            radiance: irradiance / projected,
            one_minus_cos,
        }
    }

    /// True if a scattered ray can meet it.
    pub fn is_hittable(&self) -> bool {
        !matches!(
            self,
            Self::Distant { .. } | Self::Point { .. } | Self::Spot(_)
        )
    }

    /// True if it is met by rays that leave the scene.
    pub fn is_environment(&self) -> bool {
        matches!(
            self,
            Self::Constant { .. } | Self::Image(_) | Self::Disc { .. }
        )
    }

    /// Chooses a point for `from` by the two numbers `u`. For infinite lights, density and radiance are this
    /// light's alone.
    #[inline]
    pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        match self {
            Self::Constant { radiance } => {
                Some(at_infinity(warp::sphere(u), *radiance, warp::SPHERE_PDF, 0))
            }
            Self::Image(image) => {
                let (wi, radiance, density) = image.sample(u)?;
                Some(at_infinity(wi, radiance, density, 0))
            }
            Self::Distant {
                to_light,
                irradiance,
            } => Some(at_infinity(
                *to_light,
                *irradiance,
                1.0,
                vertex_flags::DELTA,
            )),
            Self::Disc {
                frame,
                radiance,
                one_minus_cos,
            } => {
                let wi = frame.to_world(warp::cone(u, *one_minus_cos));
                Some(at_infinity(
                    wi,
                    *radiance,
                    1.0 / (2.0 * PI * one_minus_cos),
                    0,
                ))
            }
            Self::Point {
                position,
                intensity,
            } => at_point(*position, from, |_| *intensity),
            Self::Spot(spot) => at_point(spot.position, from, |w| spot.towards(w)),
            Self::Area(area) => area.sample(from, u),
        }
    }

    /// Radiance from the direction `w` and density of sampling it, for infinite lights.
    pub fn towards(&self, w: Vec3) -> (Spectrum, f32) {
        match self {
            Self::Constant { radiance } => (*radiance, warp::SPHERE_PDF),
            Self::Image(image) => image.towards(w),
            Self::Disc {
                frame,
                radiance,
                one_minus_cos,
            } => {
                // |w − n|² = 2 (1 − cos): exact for small angles.
                let inside = (w - Vec3::from(frame.n)).length_squared() <= 2.0 * one_minus_cos;
                if inside {
                    (*radiance, 1.0 / (2.0 * PI * one_minus_cos))
                } else {
                    (Spectrum::ZERO, 0.0)
                }
            }
            _ => (Spectrum::ZERO, 0.0),
        }
    }

    /// Radiant power into a scene of the given radius (W, averaged over lanes in use): what lights are chosen by.
    pub fn power(&self, radius: f32, lanes: u32) -> f32 {
        let section = PI * radius * radius;
        match self {
            Self::Constant { radiance } => 4.0 * PI * section * radiance.mean(lanes),
            Self::Image(image) => 4.0 * PI * section * image.mean().mean(lanes),
            Self::Distant { irradiance, .. } => section * irradiance.mean(lanes),
            Self::Disc {
                radiance,
                one_minus_cos,
                ..
            } => 2.0 * PI * one_minus_cos * section * radiance.mean(lanes),
            Self::Point { intensity, .. } => 4.0 * PI * intensity.mean(lanes),
            Self::Spot(spot) => spot.solid_angle() * spot.intensity.mean(lanes),
            Self::Area(area) => area.power(lanes),
        }
    }
}

/// Density (sr⁻¹) of a direction given the density per area at the point it leads to.
#[inline(always)]
fn per_solid_angle(per_area: f32, from: Vec3, at: Vec3, ng: Vec3) -> f32 {
    let d = at - from;
    let d2 = d.length_squared();
    let cosine = (ng.dot(d) / d2.sqrt()).abs();
    if cosine > 0.0 {
        per_area * d2 / cosine
    } else {
        0.0
    }
}

/// The radiance an area light shows towards `w` from the point with normal `ng`.
pub fn shows(area: &Area, at: &SurfacePoint, w: Vec3) -> Spectrum {
    if area.two_sided || at.ng.dot(w) > 0.0 {
        area.radiance_towards(at.uv.into(), &at.color, w)
    } else {
        Spectrum::ZERO
    }
}
