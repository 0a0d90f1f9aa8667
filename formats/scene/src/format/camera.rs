//! Cameras.

use super::range::{FAR, Range};
use super::{Field, Kind, Object, Rule, may, need};

const ORIGIN: Field = may("origin", Kind::Vec3, "Where the camera stands");
const TARGET: Field = may("target", Kind::Vec3, "A point in the middle of the picture");
const UP: Field = may(
    "up",
    Kind::Vec3,
    "A direction that is up in the picture ([0, 1, 0])",
);
const CAMERA_TO_WORLD: Field = may(
    "transform",
    Kind::Transform,
    "Camera to world; it looks along -z, y is up",
);
const SHIFT: Field = may(
    "shift",
    Kind::Pair,
    "How far the picture's middle lies off the viewing axis, to the right and up, in widths and heights of the picture ([0, 0])",
);
const EXPOSURE: Field = may(
    "exposure",
    Kind::Number(Range::closed(-100.0, 100.0)),
    "Stops: the picture is multiplied by 2^exposure (0)",
);

pub(super) static PERSPECTIVE: Object = Object {
    name: "perspective",
    help: "A pinhole camera, or a thin lens if lens_radius > 0",
    fields: &[
        ORIGIN,
        TARGET,
        UP,
        CAMERA_TO_WORLD,
        need(
            "fov_x_deg",
            Kind::Number(Range::open(0.0, 180.0)),
            "Full horizontal field of view in degrees",
        ),
        may(
            "lens_radius",
            Kind::Number(Range::closed(0.0, FAR)),
            "Radius of the lens; 0 is a pinhole (0)",
        ),
        may(
            "focus_distance",
            Kind::Number(Range::above(0.0, FAR)),
            "Distance to the plane in focus (the distance to the target)",
        ),
        SHIFT,
        EXPOSURE,
    ],
    rules: &POSE,
};

pub(super) static ORTHOGRAPHIC: Object = Object {
    name: "orthographic",
    help: "A camera with parallel rays, which start on the plane through its origin",
    fields: &[
        ORIGIN,
        TARGET,
        UP,
        CAMERA_TO_WORLD,
        need(
            "width",
            Kind::Number(Range::above(0.0, FAR)),
            "Width of the picture in scene units",
        ),
        SHIFT,
        EXPOSURE,
    ],
    rules: &POSE,
};

const POSE: [Rule; 4] = [
    Rule::ExactlyOne(&["origin", "transform"]),
    Rule::Needs("origin", "target"),
    Rule::AtMostOne(&["target", "transform"]),
    Rule::AtMostOne(&["up", "transform"]),
];
