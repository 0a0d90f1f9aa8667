//! Textures: images that parameters of materials are read from.

use std::fmt;
use std::sync::Arc;

use crate::describe::{Mapping, Vec3};
use crate::error::Place;

/// An image and how it is read at texture coordinates (u, v). The image covers the unit square: (0, 0) is its lower left
/// corner and (1, 1) its upper right one.
///
/// A value is found in this order: coordinates are transformed ([`Texture::uv`]), wrapped into the image and texels
/// interpolated, each decoded to linear values first; with [`Texture::vertex_color`] they are multiplied with the colour and
/// opacity that the mesh has at the point; then [`Texture::channel`] picks one, which becomes red, green
/// and blue; then it is multiplied with [`Texture::scale`] and [`Texture::bias`] is added. Parameters that take one
/// number take red. The parameter's declared range bounds the outcome: what lies outside is clamped to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Where the image is.
    pub image: ImageSource,
    /// Multiplied with the mesh's colours, see [`crate::Mesh::colors`]; shapes without any are white.
    pub vertex_color: bool,
    /// What its numbers mean.
    pub color_space: ColorSpace,
    /// What lies beyond its edges, across and up.
    pub wrap: [Wrap; 2],
    /// What lies between its texels.
    pub filter: TextureFilter,
    /// The channel that is used alone, if any.
    pub channel: Option<TextureChannel>,
    /// Factor on red, green and blue.
    pub scale: Vec3,
    /// Added to red, green and blue after the factor.
    pub bias: Vec3,
    /// From the surface's coordinates to the image's.
    pub uv: UvTransform,
    /// Where the texture stands in the scene file.
    pub place: Place,
}

impl Texture {
    /// The image as it is: its colour space by its kind, repeated, interpolated.
    pub fn new(image: ImageSource) -> Texture {
        Texture {
            image,
            vertex_color: false,
            color_space: ColorSpace::Auto,
            wrap: [Wrap::Repeat; 2],
            filter: TextureFilter::Bilinear,
            channel: None,
            scale: [1.0; 3],
            bias: [0.0; 3],
            uv: UvTransform::default(),
            place: Place::default(),
        }
    }
}

/// Where an image is. PNG, JPEG, OpenEXR and Radiance HDR are read; what it is, its first bytes say.
#[derive(Clone, PartialEq)]
pub enum ImageSource {
    /// A file, as the scene names it; see [`crate::Scene::resolve`]. `<UDIM>` in its name stands for the numbers of tiles that
    /// lie side by side: the unit square whose lower left corner is (i, j), 0 ≤ i < 10, shows the file with the number
    /// 1001 + i + 10 j, and nothing (0) if there is none. Between tiles nothing is interpolated.
    File(String),
    /// The bytes of an image file.
    Memory(MemoryImage),
    /// None: white everywhere, for colours of vertices alone.
    White,
}

/// The bytes of an image file, held in memory and shared.
#[derive(Clone, PartialEq)]
pub struct MemoryImage {
    /// What errors call it.
    pub name: String,
    /// The file's bytes.
    pub bytes: Arc<[u8]>,
}

impl fmt::Debug for MemoryImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} bytes)", self.name, self.bytes.len())
    }
}

impl fmt::Debug for ImageSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImageSource::File(file) => write!(f, "{file:?}"),
            ImageSource::Memory(image) => image.fmt(f),
            ImageSource::White => f.write_str("white"),
        }
    }
}

/// What the numbers of an image mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorSpace {
    /// sRGB for images of 8 and 16 bits, linear for floating-point ones.
    #[default]
    Auto,
    /// Red, green and blue are encoded by the curve of IEC 61966-2-1; alpha is linear.
    Srgb,
    /// As they are: linear Rec. 709 colour, or data such as roughness and normals.
    Linear,
}

/// What lies beyond an image's edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// Its outermost texels.
    Clamp,
    /// Its mirror image.
    Mirror,
    /// Nothing: 0 in all channels, before factor and offset.
    Black,
}

/// What lies between the middles of texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TextureFilter {
    /// The four nearest texels, interpolated.
    #[default]
    Bilinear,
    /// The nearest texel.
    Nearest,
}

/// A channel of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextureChannel {
    /// Red; of grey images the grey.
    Red,
    /// Green; of grey images the grey.
    Green,
    /// Blue; of grey images the grey.
    Blue,
    /// Opacity; 1 where the image has none.
    Alpha,
}

/// From a surface's texture coordinates to an image's: scaled, then rotated counter-clockwise, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UvTransform {
    /// Factors; 2 shows the image twice.
    pub scale: [f64; 2],
    /// Degrees, counter-clockwise around (0, 0) of the coordinates (the image turns clockwise).
    pub rotation_deg: f64,
    /// Added at the end.
    pub offset: [f64; 2],
}

impl Default for UvTransform {
    fn default() -> UvTransform {
        UvTransform {
            scale: [1.0; 2],
            rotation_deg: 0.0,
            offset: [0.0; 2],
        }
    }
}

impl UvTransform {
    /// The rows of the affine map: u' = r₀·(u, v, 1), v' = r₁·(u, v, 1).
    pub fn rows(&self) -> [[f64; 3]; 2] {
        let (s, c) = self.rotation_deg.to_radians().sin_cos();
        let ([a, b], [x, y]) = (self.scale, self.offset);
        [[c * a, -s * b, x], [s * a, c * b, y]]
    }
}

/// A texture of normals that turns a material's shading frame before its BSDF sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMap {
    /// Name in [`crate::Scene::textures`]. Red, green and blue in [0, 1] stand for the components in [−1, 1] along ∂p/∂u, ∂p/∂v
    /// and the shading normal, as glTF and OpenGL have it (green is up). Its image is usually meant to be linear.
    pub texture: String,
    /// Factor on the components along ∂p/∂u and ∂p/∂v.
    pub scale: f64,
}

/// The words of the scene format for each setting; of several words for one value the first is written.
pub(crate) const COLOR_SPACES: [(&str, ColorSpace); 4] = [
    ("auto", ColorSpace::Auto),
    ("srgb", ColorSpace::Srgb),
    ("linear", ColorSpace::Linear),
    ("raw", ColorSpace::Linear),
];
pub(crate) const WRAPS: [(&str, Wrap); 4] = [
    ("repeat", Wrap::Repeat),
    ("clamp", Wrap::Clamp),
    ("mirror", Wrap::Mirror),
    ("black", Wrap::Black),
];
pub(crate) const FILTERS: [(&str, TextureFilter); 2] = [
    ("bilinear", TextureFilter::Bilinear),
    ("nearest", TextureFilter::Nearest),
];
pub(crate) const CHANNELS: [(&str, TextureChannel); 4] = [
    ("r", TextureChannel::Red),
    ("g", TextureChannel::Green),
    ("b", TextureChannel::Blue),
    ("a", TextureChannel::Alpha),
];

pub(crate) const MAPPINGS: [(&str, Mapping); 4] = [
    ("latlong", Mapping::LatLong),
    ("mirrored_ball", Mapping::MirroredBall),
    ("angular", Mapping::Angular),
    ("vertical_cross", Mapping::VerticalCross),
];

/// What a word stands for.
pub(crate) fn named<T: Copy>(words: &[(&str, T)], word: &str) -> Option<T> {
    words.iter().find(|(w, _)| *w == word).map(|(_, v)| *v)
}

/// The word for a value.
pub(crate) fn word<T: PartialEq>(words: &[(&'static str, T)], value: T) -> &'static str {
    words
        .iter()
        .find(|(_, v)| *v == value)
        .map_or("", |(w, _)| w)
}
