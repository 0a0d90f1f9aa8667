//! glTF 2.0 models as parts of Resolvent's scenes.
//!
//! - [`Model::read`], [`Model::parse`]: a `.gltf` or `.glb` file → meshes with their places, materials, textures, media,
//!   cameras, lights, and warnings about everything that is in the file and has no effect.
//! - [`expand`]: the shapes of the type `gltf` of a scene become meshes of the scene.
//!
//! # What is converted
//!
//! Triangles, strips and fans with normals, colours (`COLOR_0`, factors of the base colour and its alpha), tangents where
//! there is a normal map, and one set of texture coordinates; sparse and quantised accessors; buffers in the
//! binary chunk, in data URIs and in files; images likewise. Node hierarchies; perspective cameras; KHR_lights_punctual.
//! Metallic-roughness materials with KHR_materials_clearcoat, _emissive_strength, _ior, _iridescence, _sheen, _specular,
//! _transmission, _unlit and _volume (a homogeneous medium that absorbs) become the BSDF `principled`; alpha modes the BSDF `mask` around it; normal
//! textures normal maps; emission that of the shapes. KHR_texture_transform and KHR_mesh_quantization.
//!
//! Photometric units are taken as radiometric ones, number by number (1 cd = 1 W/sr, 1 lx = 1 W/m², 1 nt = 1 W/(sr m²) in every
//! channel): the common factor between them is a matter of exposure.
//!
//! Not shown, and warned about: points and lines, further sets of colours, morph targets, skins, animations, occlusion textures, second
//! sets of coordinates, the coat's own normals, ranges of lights, orthographic cameras and unknown extensions. Surfaces are seen from both sides, whatever `doubleSided` says; it
//! decides on which sides a surface glows.
//!
//! Files are not trusted: no number of theirs is used as an index, a length or a depth before it is checked.

mod accessor;
mod buffers;
mod container;
mod error;
mod expand;
mod material;
mod mesh;
mod model;
mod named;
mod spot;
mod values;

pub use error::Error;
pub use expand::{expand, has_models};
pub use model::{Model, ModelCamera, ModelMesh};
pub use named::{is_model, named_files};

/// Extensions of glTF that have their effect.
pub const EXTENSIONS: &[&str] = &container::EXTENSIONS;
