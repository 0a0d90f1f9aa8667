//! Spot lights.

use resolvent_scene::{Light, Transform};
use serde_json::Value;

use crate::error::Fallible;
use crate::values::number;

/// A spot light (KHR_lights_punctual): full strength within its inner cone, none beyond its outer one. Between them
/// the specification leaves the falloff to the renderer, and it is the scene's.
pub(crate) fn spot(light: &Value, pose: &Transform, intensity: [f64; 3]) -> Fallible<Light> {
    let cone = light.get("spot").unwrap_or(&Value::Null);
    let right = std::f64::consts::FRAC_PI_2;
    // Half angles, in radians; rounded to f32 a right angle may be a little more.
    let range = [0.0, right * (1.0 + 1e-6)];
    let inner = number(cone, "innerConeAngle", 0.0, range)?;
    let outer = number(cone, "outerConeAngle", 0.5 * right, range)?;
    if !(outer > 0.0 && inner <= outer) {
        return Err(format!(
            "a spot light has cones of {inner} and {outer} radians"
        ));
    }
    Ok(Light::Spot {
        position: pose.point([0.0; 3]),
        direction: pose.vector([0.0, 0.0, -1.0]),
        intensity,
        angle_deg: 2.0 * outer.to_degrees(),
        inner_angle_deg: 2.0 * inner.to_degrees(),
    })
}
