//! The textures of a scene in use.

use super::lookup::Texture;
use crate::error::{Error, Result};
use resolvent_image::{Limits, Texels};
use resolvent_scene::{self as describe, ImageSource};
use std::collections::HashMap;
use std::ffi::c_void;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A texture as one parameter sees it: clamped to the parameter's range. Its address is the handle that plugins hold.
pub struct Binding {
    texture: Arc<Texture>,
    min: f32,
    max: f32,
}

impl Binding {
    /// A texture for a parameter with values from `min` to `max`.
    pub fn new(texture: Arc<Texture>, min: f32, max: f32) -> Self {
        Self { texture, min, max }
    }

    /// Red, green, blue and alpha where the mesh has the colour `color`: finite, and all but alpha within the parameter's range.
    #[inline]
    pub fn at(&self, uv: [f32; 2], color: &[f32; 4]) -> [f32; 4] {
        self.bounded(self.texture.at(uv, color))
    }

    /// Mean over the texels of the image.
    pub fn mean(&self) -> [f32; 4] {
        self.texture.mean(|v| self.bounded(v))
    }

    #[inline(always)]
    fn bounded(&self, [r, g, b, a]: [f32; 4]) -> [f32; 4] {
        let [r, g, b] = [r, g, b].map(|v| bounded(v, self.min, self.max));
        [r, g, b, bounded(a, f32::MIN, f32::MAX)]
    }

    /// What plugins are given.
    pub fn handle(&self) -> *const c_void {
        (&raw const *self).cast()
    }
}

/// Clamped to a range; what overflowed to no number is the lower end.
#[inline(always)]
fn bounded(v: f32, min: f32, max: f32) -> f32 {
    if v > min {
        if v < max { v } else { max }
    } else {
        min
    }
}

/// What an image is known by.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Key {
    File(PathBuf),
    /// By its bytes' address, which the copy in [`ReadImage`] keeps from being used again.
    Memory(usize),
}

/// An image that was read.
#[derive(Clone)]
pub struct ReadImage {
    /// File, or name of the image in memory.
    pub name: String,
    /// Size of the file.
    pub file_bytes: u64,
    /// The decoded image.
    pub texels: Arc<Texels>,
    _bytes: Option<Arc<[u8]>>,
}

#[derive(Default)]
struct State {
    images: HashMap<Key, usize>,
    read: Vec<ReadImage>,
    textures: HashMap<String, Arc<Texture>>,
}

impl State {
    /// The texels of a texture's image, read if nobody has yet.
    fn image(
        &mut self,
        key: Key,
        name: &str,
        described: &describe::Texture,
        scene: &describe::Scene,
    ) -> Result<Arc<Texels>> {
        if let Some(index) = self.images.get(&key) {
            return Ok(self.read[*index].texels.clone());
        }
        let image = read(&described.image, scene).map_err(|e| {
            let what = format!("texture '{name}': {e}");
            describe::Problem::new(&scene.source.file, described.place.clone(), what)
        })?;
        let Some(image) = image else {
            return Err(Error::Input(format!("the texture '{name}' has no image")));
        };
        let texels = image.texels.clone();
        self.images.insert(key, self.read.len());
        self.read.push(image);
        Ok(texels)
    }
}

/// The textures of one scene: an image is read when the first user asks for a texture of it, and once.
#[derive(Default)]
pub struct Textures {
    state: Mutex<State>,
}

impl Textures {
    /// With nothing read yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The texture `name` of the scene.
    ///
    /// # Errors
    /// If there is none, or its image cannot be read.
    pub fn get(&self, name: &str, scene: &describe::Scene) -> Result<Arc<Texture>> {
        let mut state = self.state.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(texture) = state.textures.get(name) {
            return Ok(texture.clone());
        }
        let described = scene
            .textures
            .get(name)
            .ok_or_else(|| Error::Input(format!("there is no texture '{name}' in the scene")))?;
        let key = match &described.image {
            ImageSource::File(file) => {
                let path = scene.resolve(file);
                Some(Key::File(path.canonicalize().unwrap_or(path)))
            }
            ImageSource::Memory(image) => Some(Key::Memory(image.bytes.as_ptr().addr())),
            ImageSource::White => None,
        };
        let texels = match key {
            Some(key) => Some(state.image(key, name, described, scene)?),
            None => None,
        };
        let texture = Arc::new(Texture::new(texels, described));
        state.textures.insert(name.to_owned(), texture.clone());
        Ok(texture)
    }

    /// The images read so far, in order.
    pub fn read(&self) -> Vec<ReadImage> {
        let state = self.state.lock().unwrap_or_else(|e| e.into_inner());
        state.read.clone()
    }
}

fn read(
    source: &ImageSource,
    scene: &describe::Scene,
) -> std::result::Result<Option<ReadImage>, resolvent_image::Error> {
    Ok(Some(match source {
        ImageSource::File(file) => {
            let path = scene.resolve(file);
            let (texels, file_bytes) = Texels::read(&path)?;
            ReadImage {
                name: path.display().to_string(),
                file_bytes,
                texels: Arc::new(texels),
                _bytes: None,
            }
        }
        ImageSource::Memory(image) => ReadImage {
            name: image.name.clone(),
            file_bytes: image.bytes.len() as u64,
            texels: Arc::new(Texels::parse(&image.bytes, &image.name, Limits::default())?),
            _bytes: Some(image.bytes.clone()),
        },
        ImageSource::White => return Ok(None),
    }))
}
