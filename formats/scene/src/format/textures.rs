//! Textures.

use super::range::Range;
use super::{Kind, Object, Rule, may};

const WRAP: Kind = Kind::Choice(&["repeat", "clamp", "mirror", "black"]);

pub(super) static TEXTURE: Object = Object {
    name: "texture",
    help: "An image (PNG, JPEG, OpenEXR, Radiance HDR); (0, 0) is its lower left corner, (1, 1) the upper right one; or vertex colours",
    fields: &[
        may(
            "file",
            Kind::Name,
            "The image file, relative to the scene file; <UDIM> in it stands for the numbers of its tiles, 1001 + column + 10 row",
        ),
        may("data", Kind::Name, "The image file's bytes in base64"),
        may(
            "vertex_color",
            Kind::Bool,
            "Multiplies the image, or white without one, with the mesh's colours (false)",
        ),
        may(
            "color_space",
            Kind::Choice(&["auto", "srgb", "linear", "raw"]),
            "What its numbers mean; auto is srgb for 8 and 16 bits, linear for floating point (auto)",
        ),
        may("wrap", WRAP, "What lies beyond its edges (repeat)"),
        may("wrap_u", WRAP, "The same, left and right"),
        may("wrap_v", WRAP, "The same, below and above"),
        may(
            "filter",
            Kind::Choice(&["bilinear", "nearest"]),
            "What lies between its texels (bilinear)",
        ),
        may(
            "channel",
            Kind::Choice(&["r", "g", "b", "a"]),
            "The channel that is used alone",
        ),
        may(
            "scale",
            Kind::Factor,
            "Factor on its values: one number or RGB (1)",
        ),
        may(
            "bias",
            Kind::Factor,
            "Added after the factor: one number or RGB (0)",
        ),
        may(
            "uv_transform",
            Kind::Object(&UV_TRANSFORM),
            "From the surface's coordinates to the image's",
        ),
    ],
    rules: &[
        Rule::AtLeastOne(&["file", "data", "vertex_color"]),
        Rule::AtMostOne(&["file", "data"]),
        Rule::AtMostOne(&["wrap", "wrap_u"]),
        Rule::AtMostOne(&["wrap", "wrap_v"]),
    ],
};

static UV_TRANSFORM: Object = Object {
    name: "uv_transform",
    help: "Scaled, then rotated, then moved",
    fields: &[
        may("scale", Kind::Pair, "Factors on u and v ([1, 1])"),
        may(
            "rotation_deg",
            Kind::Number(Range::closed(-1e6, 1e6)),
            "Rotation of the coordinates, counter-clockwise (0)",
        ),
        may("offset", Kind::Pair, "Added at the end ([0, 0])"),
    ],
    rules: &[],
};
