//! Lights.

use super::range::Range;
use super::{Kind, Object, Rule, may, need};

const RADIANCE: &str = "Radiance, W/(sr m²): one number or RGB";

pub(super) static ENVIRONMENT: Object = Object {
    name: "environment",
    help: "Light from everywhere",
    fields: &[
        may("radiance", Kind::Spectrum, RADIANCE),
        may(
            "image",
            Kind::Name,
            "Image of all directions; +y is up, its centre is +z",
        ),
        may(
            "mapping",
            Kind::Choice(&["latlong", "mirrored_ball", "angular", "vertical_cross"]),
            "How the image shows the directions (latlong)",
        ),
        may("scale", Kind::Spectrum, "Factor on the image (1)"),
        may(
            "transform",
            Kind::Transform,
            "Image to world: a rotation, or one that mirrors",
        ),
    ],
    rules: &[
        Rule::ExactlyOne(&["radiance", "image"]),
        Rule::Needs("mapping", "image"),
        Rule::Needs("scale", "image"),
        Rule::Needs("transform", "image"),
    ],
};

pub(super) static DISTANT: Object = Object {
    name: "distant",
    help: "Light from one direction, such as a sun",
    fields: &[
        need("to_light", Kind::Vec3, "Direction towards the light"),
        need(
            "irradiance",
            Kind::Spectrum,
            "On a plane that faces the light, W/m²: one number or RGB",
        ),
        may(
            "angle_deg",
            Kind::Number(Range::closed(0.0, 180.0)),
            "Full angle of its disc in degrees; the sun's is 0.53 (0)",
        ),
    ],
    rules: &[],
};

pub(super) static POINT: Object = Object {
    name: "point",
    help: "Light from a point",
    fields: &[
        need("position", Kind::Vec3, "Where it is"),
        need(
            "intensity",
            Kind::Spectrum,
            "Radiant intensity, W/sr: one number or RGB",
        ),
    ],
    rules: &[],
};

pub(super) static SPOT: Object = Object {
    name: "spot",
    help: "Light from a point into a cone",
    fields: &[
        need("position", Kind::Vec3, "Where it is"),
        need("direction", Kind::Vec3, "The axis along which it shines"),
        need(
            "intensity",
            Kind::Spectrum,
            "Radiant intensity within the inner cone, W/sr: one number or RGB",
        ),
        need(
            "angle_deg",
            Kind::Number(Range::above(0.0, 360.0)),
            "Full angle of the cone in degrees",
        ),
        may(
            "inner_angle_deg",
            Kind::Number(Range::closed(0.0, 360.0)),
            "Full angle of the cone of full intensity, from which it falls to 0 as a smoothstep of the cosine (angle_deg)",
        ),
    ],
    rules: &[],
};

pub(super) static SUN_SKY: Object = Object {
    name: "sun_sky",
    help: "A clear sky with its sun, in linear sRGB, W/(sr m²) weighted by the eye's sensitivity (683 lm/W)",
    fields: &[
        may(
            "to_sun",
            Kind::Vec3,
            "Direction towards the sun, above the horizon; +y is up",
        ),
        may(
            "elevation_deg",
            Kind::Number(Range::closed(0.0, 90.0)),
            "Angle of the sun above the horizon",
        ),
        may(
            "azimuth_deg",
            Kind::Number(Range::closed(-360.0, 360.0)),
            "Angle of the sun from +z towards +x (0)",
        ),
        may(
            "turbidity",
            Kind::Number(Range::closed(2.0, 10.0)),
            "Haze, from 2 (clear) to 10 (3)",
        ),
        may(
            "ground_albedo",
            Kind::Share,
            "Albedo of the plane below the horizon (0.2)",
        ),
        may("scale", Kind::Spectrum, "Factor on everything (1)"),
        may(
            "sun",
            Kind::Bool,
            "There is a sun's disc; the ground shows its light in any case (true)",
        ),
        may(
            "sun_angle_deg",
            Kind::Number(Range::closed(0.0, 180.0)),
            "Full angle of the sun's disc in degrees, at equal irradiance (0.533)",
        ),
        may(
            "transform",
            Kind::Transform,
            "The sky's space to world: a rotation",
        ),
    ],
    rules: &[
        Rule::ExactlyOne(&["to_sun", "elevation_deg"]),
        Rule::Needs("azimuth_deg", "elevation_deg"),
    ],
};

pub(super) static RECTANGLE_LIGHT: Object = Object {
    name: "rectangle",
    help: "A parallelogram that emits from the side where edge_u × edge_v points",
    fields: &[
        need("corner", Kind::Vec3, "One corner"),
        need(
            "edge_u",
            Kind::Vec3,
            "From the corner to a neighbouring one",
        ),
        need(
            "edge_v",
            Kind::Vec3,
            "From the corner to the other neighbouring one",
        ),
        need("radiance", Kind::Spectrum, RADIANCE),
        may("two_sided", Kind::Bool, "Emits from both sides (false)"),
    ],
    rules: &[],
};

pub(super) static SHAPING: Object = Object {
    name: "shaping",
    help: "A factor on emission: a cone about an axis, and tint + (1 - tint) |cos|^focus of the angle from it",
    fields: &[
        need(
            "axis",
            Kind::Vec3,
            "Direction in which most is emitted, in world or in the prototype's space",
        ),
        may(
            "angle_deg",
            Kind::Number(Range::above(0.0, 360.0)),
            "Full angle of the cone in degrees; 360 is none (360)",
        ),
        may(
            "softness",
            Kind::Number(Range::closed(0.0, 1.0)),
            "Share of the cone's half angle over which the emission falls to 0 as a smoothstep of the angle (0)",
        ),
        may(
            "focus",
            Kind::Number(Range::closed(0.0, 1e6)),
            "Power of the cosine (0)",
        ),
        may(
            "focus_tint",
            Kind::Spectrum,
            "Factor that remains where the power of the cosine is 0: one number or RGB (0)",
        ),
    ],
    rules: &[],
};
