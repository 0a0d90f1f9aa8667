//! The scene format as tables: one row per key.
//!
//! The checker ([`crate::check`]) and the JSON Schema ([`crate::schema`]) are both driven by them, so that
//! what the one accepts is what the other describes.

use crate::describe::Aov;

/// The format's version, the value of the key `resolvent`.
pub const VERSION: u32 = 1;

/// The largest coordinate, in scene units: its square is still an f32.
pub(crate) const FAR: f64 = 1e18;

/// The largest radiometric value.
const BRIGHT: f64 = 1e30;

/// A range of numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    pub min: f64,
    pub max: f64,
    pub min_excluded: bool,
    pub max_excluded: bool,
}

impl Range {
    const fn closed(min: f64, max: f64) -> Range {
        Range {
            min,
            max,
            min_excluded: false,
            max_excluded: false,
        }
    }

    const fn above(min: f64, max: f64) -> Range {
        Range {
            min,
            max,
            min_excluded: true,
            max_excluded: false,
        }
    }

    const fn open(min: f64, max: f64) -> Range {
        Range {
            min,
            max,
            min_excluded: true,
            max_excluded: true,
        }
    }

    pub fn contains(&self, x: f64) -> bool {
        (x > self.min || (x == self.min && !self.min_excluded))
            && (x < self.max || (x == self.max && !self.max_excluded))
    }
}

/// Words for a range: "in [0, 1)", "≥ 0", "> 0".
impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let left = if self.min_excluded { '(' } else { '[' };
        let right = if self.max_excluded { ')' } else { ']' };
        match (self.min.is_finite(), self.max.is_finite()) {
            (true, true) => write!(
                f,
                "in {left}{}, {}{right}",
                short(self.min),
                short(self.max)
            ),
            (true, false) => write!(
                f,
                "{} {}",
                if self.min_excluded { '>' } else { '≥' },
                short(self.min)
            ),
            (false, true) => write!(
                f,
                "{} {}",
                if self.max_excluded { '<' } else { '≤' },
                short(self.max)
            ),
            (false, false) => f.write_str("that is finite"),
        }
    }
}

/// Numbers as one would write them: 1e18, not 1000000000000000000.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-4..1e7).contains(&x.abs()) {
        format!("{x:e}")
    } else {
        format!("{x}")
    }
}

/// What may stand under a key.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    Bool,
    Number(Range),
    /// A whole number, not negative.
    Integer(u64, u64),
    /// A whole number of either sign.
    Signed(i64, i64),
    /// So many whole numbers.
    Integers(usize, u64, u64),
    /// Any text.
    Text,
    /// A text that is not empty: names and paths.
    Name,
    /// A list of different layers (see [`crate::Aov`]): these, and `orders:N` with N up to the number.
    Layers(&'static [&'static str], u32),
    /// One name out of these.
    Choice(&'static [&'static str]),
    /// Three coordinates.
    Vec3,
    /// Two numbers.
    Pair,
    /// One number or three, of any sign.
    Factor,
    /// A list of points or directions.
    Vec3s,
    /// A list of pairs of numbers.
    Pairs,
    /// A list of lists of four numbers.
    Fours,
    /// A list of lists of three or four numbers ≥ 0.
    Colors,
    /// A list of three indices each.
    Triangles,
    /// One number or three, ≥ 0.
    Spectrum,
    /// One number or three, from 0 to 1.
    Share,
    /// A matrix or a list of operations.
    Transform,
    /// The parameters of a plugin of this kind.
    Params(&'static str),
    Object(&'static Object),
    /// An object whose kind is the value of its key `type`.
    Variants(&'static [&'static Object]),
    List(&'static Kind),
    /// An object with names as keys.
    Named(&'static Kind),
}

/// An object with known keys.
#[derive(Debug)]
pub(crate) struct Object {
    /// Name in the schema; of a variant, its `type`.
    pub name: &'static str,
    pub help: &'static str,
    pub fields: &'static [Field],
    pub rules: &'static [Rule],
}

#[derive(Debug)]
pub(crate) struct Field {
    pub name: &'static str,
    pub kind: Kind,
    pub required: bool,
    /// One sentence; what holds if the key is left out stands at its end, in parentheses.
    pub help: &'static str,
}

/// Which keys go together.
#[derive(Debug)]
pub(crate) enum Rule {
    ExactlyOne(&'static [&'static str]),
    AtMostOne(&'static [&'static str]),
    AtLeastOne(&'static [&'static str]),
    /// The first key asks for the second.
    Needs(&'static str, &'static str),
}

const fn need(name: &'static str, kind: Kind, help: &'static str) -> Field {
    Field {
        name,
        kind,
        required: true,
        help,
    }
}

const fn may(name: &'static str, kind: Kind, help: &'static str) -> Field {
    Field {
        name,
        kind,
        required: false,
        help,
    }
}

pub(crate) static SCENE: Object = Object {
    name: "scene",
    help: "A Resolvent scene",
    fields: &[
        may(
            "$schema",
            Kind::Text,
            "Address of the JSON Schema, for editors",
        ),
        need(
            "resolvent",
            Kind::Integer(1, VERSION as u64),
            "Version of the scene format",
        ),
        may(
            "units",
            Kind::Object(&UNITS),
            "Physical meaning of the lengths",
        ),
        need(
            "camera",
            Kind::Variants(&[&PERSPECTIVE, &ORTHOGRAPHIC]),
            "The camera",
        ),
        may(
            "film",
            Kind::Object(&FILM),
            "Resolution and what is recorded",
        ),
        may(
            "sampling",
            Kind::Object(&SAMPLING),
            "How long to sample (64 samples per pixel)",
        ),
        may(
            "integrator",
            Kind::Object(&INTEGRATOR),
            "The integrator plugin (pt)",
        ),
        may(
            "lights",
            Kind::List(&Kind::Variants(&[
                &ENVIRONMENT,
                &DISTANT,
                &POINT,
                &SPOT,
                &SUN_SKY,
                &RECTANGLE_LIGHT,
            ])),
            "Lights",
        ),
        may(
            "textures",
            Kind::Named(&Kind::Object(&TEXTURE)),
            "Images that parameters of materials are read from, by name",
        ),
        may(
            "materials",
            Kind::Named(&Kind::Object(&MATERIAL)),
            "Materials by name",
        ),
        may(
            "media",
            Kind::Named(&Kind::Object(&MEDIUM)),
            "Media by name; free-standing unless a shape's interior",
        ),
        may("shapes", SHAPES, "Surfaces"),
        may(
            "prototypes",
            Kind::Named(&SHAPES),
            "Lists of surfaces by name, to be placed by instances",
        ),
        may(
            "instances",
            Kind::List(&Kind::Object(&INSTANCE)),
            "Copies of prototypes",
        ),
    ],
    rules: &[],
};

const SHAPES: Kind = Kind::List(&Kind::Variants(&[
    &SPHERE, &RECTANGLE, &DISK, &CYLINDER, &MESH, &PLY, &GLTF,
]));

static INSTANCE: Object = Object {
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

static UNITS: Object = Object {
    name: "units",
    help: "Physical meaning of the lengths",
    fields: &[may(
        "meters_per_unit",
        Kind::Number(Range::above(0.0, FAR)),
        "Metres per scene unit (1)",
    )],
    rules: &[],
};

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

static PERSPECTIVE: Object = Object {
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

static ORTHOGRAPHIC: Object = Object {
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

static FILM: Object = Object {
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
                &["depth", "albedo", "normal", "variance", "samples"],
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

static SAMPLING: Object = Object {
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

const PLUGIN: Field = need(
    "plugin",
    Kind::Name,
    "Name of the plugin, or path of its library",
);

static INTEGRATOR: Object = Object {
    name: "integrator",
    help: "An integrator plugin",
    fields: &[
        PLUGIN,
        may("params", Kind::Params("integrator"), "Its parameters"),
    ],
    rules: &[],
};

static MATERIAL: Object = Object {
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

const WRAP: Kind = Kind::Choice(&["repeat", "clamp", "mirror", "black"]);

static TEXTURE: Object = Object {
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

static MEDIUM: Object = Object {
    name: "medium",
    help: "A medium plugin",
    fields: &[
        PLUGIN,
        may("params", Kind::Params("medium"), "Its parameters"),
        may("transform", Kind::Transform, "The medium's space to world"),
    ],
    rules: &[],
};

const RADIANCE: &str = "Radiance, W/(sr m²): one number or RGB";

static ENVIRONMENT: Object = Object {
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

static DISTANT: Object = Object {
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

static POINT: Object = Object {
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

static SPOT: Object = Object {
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

static SUN_SKY: Object = Object {
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

static RECTANGLE_LIGHT: Object = Object {
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

static SHAPING: Object = Object {
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

/// The range of every coordinate.
pub(crate) const COORDINATE: Range = Range::closed(-FAR, FAR);

/// The range of albedos.
pub(crate) const SHARE: Range = Range::closed(0.0, 1.0);

/// The range of every radiometric value.
pub(crate) const POWER: Range = Range::closed(0.0, BRIGHT);
