//! Blocks that name a plugin: integrators, materials, media.

use super::range::COORDINATE;
use super::{Field, Kind, Object, may, need};

const PLUGIN: Field = need(
    "plugin",
    Kind::Name,
    "Name of the plugin, or path of its library",
);

pub(super) static INTEGRATOR: Object = Object {
    name: "integrator",
    help: "An integrator plugin",
    fields: &[
        PLUGIN,
        may("params", Kind::Params("integrator"), "Its parameters"),
    ],
    rules: &[],
};

pub(super) static MATERIAL: Object = Object {
    name: "material",
    help: "A BSDF plugin",
    fields: &[
        PLUGIN,
        may("params", Kind::Params("bsdf"), "Its parameters"),
        may(
            "normal_map",
            Kind::Object(&NORMAL_MAP),
            "Texture of normals that turns the shading frame",
        ),
    ],
    rules: &[],
};

static NORMAL_MAP: Object = Object {
    name: "normal_map",
    help: "A texture of normals in tangent space: red along dp/du, green along dp/dv, blue along the normal",
    fields: &[
        need("texture", Kind::Name, "Name of a texture"),
        may(
            "scale",
            Kind::Number(COORDINATE),
            "Factor on the components along the surface (1)",
        ),
    ],
    rules: &[],
};

pub(super) static MEDIUM: Object = Object {
    name: "medium",
    help: "A medium plugin",
    fields: &[
        PLUGIN,
        may("params", Kind::Params("medium"), "Its parameters"),
        may("transform", Kind::Transform, "The medium's space to world"),
    ],
    rules: &[],
};
