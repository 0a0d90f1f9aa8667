//! Resolvent's JSON scene format: the description of a scene as plain data, its reading and writing, and
//! its JSON Schema.
//!
//! - [`Scene::read`], [`Scene::parse`]: a file or text → [`Scene`], or an [`Error`] with every
//!   [`Problem`] found: file, line, column, JSON path, what was expected, what was found, and the nearest
//!   known name. [`Scene::resolve`] finds the files that the scene names.
//! - [`Scene::write`], [`Scene::to_text`]: back to JSON, which reads as an equal scene.
//! - [`declare`]: what plugins declare about their parameters. [`PluginDecl::check`] compares a
//!   [`PluginBlock`] with it and fills in defaults.
//! - [`schema()`]: the JSON Schema of the format and of the plugins given; [`scene_reference`], [`plugin_reference`]: the same as
//!   pages for people.
//!
//! # The format
//!
//! ```
//! let text = r#"{
//!   "resolvent": 1,
//!   "camera": {"type": "perspective", "origin": [0, 1, 5], "target": [0, 1, 0], "fov_x_deg": 44},
//!   "film": {"resolution": [640, 360], "aovs": ["depth", "variance"]},
//!   "sampling": {"spp": 64, "seed": 7},
//!   "integrator": {"plugin": "pt"},
//!   "lights": [
//!     {"type": "environment", "radiance": 0.1},
//!     {"type": "distant", "to_light": [1, 2, 1], "irradiance": [3, 3, 2.8], "angle_deg": 0.53}
//!   ],
//!   "materials": {"floor": {"plugin": "diffuse", "params": {"reflectance": [0.6, 0.55, 0.5]}}},
//!   "media": {"fog": {"plugin": "homogeneous", "params": {"sigma_t": 0.5, "phase": {"plugin": "hg", "params": {"g": 0.8}}}}},
//!   "shapes": [
//!     {"type": "rectangle", "corner": [-5, 0, 5], "edge_u": [10, 0, 0], "edge_v": [0, 0, -10], "material": "floor"},
//!     {"type": "sphere", "center": [0, 1, 0], "radius": 1, "interior": "fog"}
//!   ]
//! }"#;
//! let scene = resolvent_scene::Scene::parse(text.as_bytes(), "scenes/fog.json").unwrap();
//! assert_eq!(scene.shapes[1].interior.as_deref(), Some("fog"));
//! let wrong = text.replace("radiance\": 0.1", "radiace\": 0.1");
//! let error = resolvent_scene::Scene::parse(wrong.as_bytes(), "fog.json").unwrap_err().to_string();
//! assert!(error.contains("fog.json:8:29: $.lights[0].radiace: environment has no key \"radiace\"; did you mean \"radiance\"?"));
//! ```
//!
//! Every key is described where the field it fills is: see [`Scene`]. Transforms are 4×4 matrices, row
//! by row, acting on column vectors, or lists of operations applied in order:
//! `[{"scale": 2}, {"rotate_deg": {"axis": [0, 1, 0], "angle": 30}}, {"translate": [0, 1, 0]}]`.
//! Unknown and repeated keys are errors.

mod base64;
mod check;
pub mod declare;
mod describe;
mod error;
mod format;
mod json;
mod nearest;
mod parse;
mod plugin;
mod read;
mod reference;
mod schema;
pub mod table;
mod texture;
mod transform;
mod write;

pub use declare::{Checked, ParamDecl, ParamKind, PluginDecl};
pub use describe::*;
pub use error::{Error, Place, Problem};
pub use format::VERSION;
pub use indexmap::IndexMap;
pub use nearest::nearest;
pub use plugin::{Param, PluginBlock, Value};
pub use reference::{plugin_reference, scene_reference};
pub use schema::schema;
pub use texture::{
    ColorSpace, ImageSource, MemoryImage, NormalMap, Texture, TextureChannel, TextureFilter,
    UvTransform, Wrap,
};
pub use transform::Transform;
