//! The scene format as tables: one row per key.
//!
//! The checker ([`crate::check`]) and the JSON Schema ([`crate::schema`]) are both driven by them, so that
//! what the one accepts is what the other describes.

mod camera;
mod film;
mod lights;
mod plugins;
mod range;
mod shapes;
mod textures;

pub(crate) use range::{COORDINATE, FAR, POWER, Range, SHARE};

use camera::{ORTHOGRAPHIC, PERSPECTIVE};
use film::{FILM, SAMPLING};
use lights::{DISTANT, ENVIRONMENT, POINT, RECTANGLE_LIGHT, SPOT, SUN_SKY};
use plugins::{INTEGRATOR, MATERIAL, MEDIUM};
use shapes::{INSTANCE, SHAPES};
use textures::TEXTURE;

/// The format's version, the value of the key `resolvent`.
pub const VERSION: u32 = 1;

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
