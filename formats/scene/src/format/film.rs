//! The film, its filters, and how long it is exposed.

use super::range::Range;
use super::{Kind, Object, Rule, may};
use crate::describe::Aov;

pub(super) static FILM: Object = Object {
    name: "film",
    help: "Resolution and what is recorded",
    fields: &[
        may(
            "resolution",
            Kind::Integers(2, 1, 65_536),
            "Width and height in pixels ([1280, 720])",
        ),
        may(
            "pixel_aspect",
            Kind::Number(Range::closed(0.01, 100.0)),
            "Width of a pixel over its height (1)",
        ),
        may(
            "crop",
            Kind::Integers(4, 0, 65_536),
            "Window to render: x0, y0, x1, y1; x1 and y1 are outside",
        ),
        may(
            "filter",
            Kind::Variants(&[&BOX, &TENT, &GAUSSIAN]),
            "Reconstruction filter (box of radius 0.5)",
        ),
        may(
            "aovs",
            Kind::Layers(
                &[
                    "depth", "albedo", "normal", "variance", "error_95", "samples",
                ],
                Aov::MOST_ORDERS,
            ),
            "Further layers; \"orders:N\": light scattered 0 to N times, and the rest, in layers that sum to the picture",
        ),
    ],
    rules: &[],
};

const RADIUS: Kind = Kind::Number(Range::above(0.0, 64.0));

static BOX: Object = Object {
    name: "box",
    help: "Constant within the radius",
    fields: &[may("radius", RADIUS, "Half width in pixels (0.5)")],
    rules: &[],
};

static TENT: Object = Object {
    name: "tent",
    help: "Falls linearly to 0 at the radius",
    fields: &[may("radius", RADIUS, "Half width in pixels (1)")],
    rules: &[],
};

static GAUSSIAN: Object = Object {
    name: "gaussian",
    help: "exp(-x²/2σ²) - exp(-r²/2σ²)",
    fields: &[
        may("radius", RADIUS, "Half width in pixels (1.5)"),
        may("sigma", RADIUS, "σ in pixels (0.5)"),
    ],
    rules: &[],
};

pub(super) static SAMPLING: Object = Object {
    name: "sampling",
    help: "How long to sample, and with which random numbers",
    fields: &[
        may("spp", Kind::Integer(1, 1 << 40), "Samples per pixel"),
        may("time", Kind::Number(Range::above(0.0, 1e9)), "Seconds"),
        may(
            "error",
            Kind::Number(Range::above(0.0, 1e3)),
            "Estimated relative error that no tile of the picture shall exceed",
        ),
        may(
            "seed",
            Kind::Integer(0, u64::MAX),
            "Seed of all random numbers (0)",
        ),
    ],
    rules: &[Rule::AtMostOne(&["spp", "time", "error"])],
};
