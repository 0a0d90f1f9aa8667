//! Spot lights.

use resolvent_scene::{Light, Transform};
use serde_json::Value;

use crate::error::Fallible;
use crate::material::Materials;

/// A spot light as a point light: the scene has no cones yet.
pub(crate) fn spot(
    _light: &Value,
    pose: &Transform,
    intensity: [f64; 3],
    materials: &mut Materials,
) -> Fallible<Light> {
    materials.warn("spot lights", "they shine in all directions");
    Ok(Light::Point {
        position: pose.point([0.0; 3]),
        intensity,
    })
}
