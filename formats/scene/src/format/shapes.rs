//! Shapes and their copies.

use super::lights::SHAPING;
use super::range::{FAR, Range};
use super::{Field, Kind, Object, Rule, may, need};

const MATERIAL_NAME: Field = may("material", Kind::Name, "Name of a material");
const EMISSION: Field = may(
    "emission",
    Kind::Spectrum,
    "Radiance emitted from the outer side: one number or RGB",
);
const EMISSION_TEXTURE: Field = may(
    "emission_texture",
    Kind::Name,
    "Name of a texture that the emission is multiplied with",
);
const TWO_SIDED: Field = may("two_sided", Kind::Bool, "Emits from both sides (false)");
const SHAPING_KEY: Field = may(
    "shaping",
    Kind::Object(&SHAPING),
    "Directions that the emission favours",
);
const INTERIOR: Field = may(
    "interior",
    Kind::Name,
    "Name of the medium on its inner side",
);
const PRIORITY: Field = may(
    "priority",
    Kind::Signed(-1_000_000, 1_000_000),
    "Which of overlapping closed shapes that refract or have an interior fills the overlap: the highest (0)",
);
const TO_WORLD: Field = may("transform", Kind::Transform, "The shape's space to world");

static SPHERE: Object = Object {
    name: "sphere",
    help: "A sphere",
    fields: &[
        need("center", Kind::Vec3, "Its centre"),
        need("radius", Kind::Number(Range::above(0.0, FAR)), "Its radius"),
        MATERIAL_NAME,
        EMISSION,
        TWO_SIDED,
        SHAPING_KEY,
        INTERIOR,
        PRIORITY,
    ],
    rules: &[
        Rule::AtLeastOne(&["material", "emission", "interior"]),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

static RECTANGLE: Object = Object {
    name: "rectangle",
    help: "A parallelogram with normal edge_u × edge_v",
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
        MATERIAL_NAME,
        EMISSION,
        EMISSION_TEXTURE,
        TWO_SIDED,
        SHAPING_KEY,
        PRIORITY,
    ],
    rules: &[
        Rule::AtLeastOne(&["material", "emission"]),
        Rule::Needs("emission_texture", "emission"),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

static DISK: Object = Object {
    name: "disk",
    help: "A flat disk",
    fields: &[
        need("center", Kind::Vec3, "Its centre"),
        need("normal", Kind::Vec3, "Its normal, of any length"),
        need("radius", Kind::Number(Range::above(0.0, FAR)), "Its radius"),
        MATERIAL_NAME,
        EMISSION,
        TWO_SIDED,
        SHAPING_KEY,
        INTERIOR,
        PRIORITY,
    ],
    rules: &[
        Rule::AtLeastOne(&["material", "emission", "interior"]),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

static CYLINDER: Object = Object {
    name: "cylinder",
    help: "The lateral surface of a cylinder, without caps",
    fields: &[
        need("base", Kind::Vec3, "Middle of one end"),
        need(
            "axis",
            Kind::Vec3,
            "From there to the middle of the other end",
        ),
        need("radius", Kind::Number(Range::above(0.0, FAR)), "Its radius"),
        MATERIAL_NAME,
        EMISSION,
        TWO_SIDED,
        SHAPING_KEY,
        INTERIOR,
        PRIORITY,
    ],
    rules: &[
        Rule::AtLeastOne(&["material", "emission", "interior"]),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

static MESH: Object = Object {
    name: "mesh",
    help: "Triangles, counter-clockwise seen from outside",
    fields: &[
        need("positions", Kind::Vec3s, "Corners"),
        need(
            "indices",
            Kind::Triangles,
            "Three indices into positions per triangle",
        ),
        may("normals", Kind::Vec3s, "One shading normal per corner"),
        may("uvs", Kind::Pairs, "One texture coordinate per corner"),
        may(
            "colors",
            Kind::Colors,
            "One linear RGB or RGBA per corner, for textures with vertex_color",
        ),
        may(
            "tangents",
            Kind::Fours,
            "Direction of growing u per corner, and a sign: -1 where v grows on the other side",
        ),
        TO_WORLD,
        MATERIAL_NAME,
        EMISSION,
        EMISSION_TEXTURE,
        TWO_SIDED,
        SHAPING_KEY,
        INTERIOR,
        PRIORITY,
    ],
    rules: &[
        Rule::AtLeastOne(&["material", "emission", "interior"]),
        Rule::Needs("emission_texture", "emission"),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

static GLTF: Object = Object {
    name: "gltf",
    help: "The meshes and materials of a glTF 2.0 model (.gltf, .glb)",
    fields: &[
        need("file", Kind::Name, "The model, relative to the scene file"),
        TO_WORLD,
        may(
            "material",
            Kind::Name,
            "Name of a material in place of the model's",
        ),
        may(
            "emission",
            Kind::Spectrum,
            "Radiance emitted from the outer side in place of the model's: one number or RGB",
        ),
        EMISSION_TEXTURE,
        TWO_SIDED,
        SHAPING_KEY,
        may(
            "interior",
            Kind::Name,
            "Name of a medium in place of the model's",
        ),
        PRIORITY,
    ],
    rules: &[
        Rule::Needs("emission_texture", "emission"),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

static PLY: Object = Object {
    name: "ply",
    help: "Triangles of a PLY file, counter-clockwise seen from outside",
    fields: &[
        need(
            "file",
            Kind::Name,
            "The PLY file, relative to the scene file",
        ),
        TO_WORLD,
        MATERIAL_NAME,
        EMISSION,
        EMISSION_TEXTURE,
        TWO_SIDED,
        SHAPING_KEY,
        INTERIOR,
        PRIORITY,
    ],
    rules: &[
        Rule::AtLeastOne(&["material", "emission", "interior"]),
        Rule::Needs("emission_texture", "emission"),
        Rule::Needs("two_sided", "emission"),
        Rule::Needs("shaping", "emission"),
    ],
};

pub(super) const SHAPES: Kind = Kind::List(&Kind::Variants(&[
    &SPHERE, &RECTANGLE, &DISK, &CYLINDER, &MESH, &PLY, &GLTF,
]));

pub(super) static INSTANCE: Object = Object {
    name: "instance",
    help: "A copy of a prototype",
    fields: &[
        need("prototype", Kind::Name, "Name of the prototype"),
        may(
            "transform",
            Kind::Transform,
            "The prototype's space to world; with transforms, applied after each of them",
        ),
        may(
            "transforms",
            Kind::Name,
            "A NumPy file (.npy) of many copies' transforms: f32 or f64 of shape (n, 3, 4) or (n, 4, 4), rows of matrices that act on column vectors",
        ),
        may(
            "material",
            Kind::Name,
            "Name of the material that replaces those of the prototype",
        ),
    ],
    rules: &[],
};
