//! The textures of a scene in use.

use super::lookup::Texture;
use crate::error::{Error, Result};
use resolvent_image::{Limits, Texels};
use resolvent_scene::{self as describe, ImageSource};
use std::collections::HashMap;
use std::ffi::c_void;
use std::path::{Path, PathBuf};
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
        self.texture.mean(&|v| self.bounded(v))
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

/// Stands for the number of a tile in the name of a file.
const UDIM: &str = "<UDIM>";

/// The files of a tiled image with their indices, column + 10 row, in order.
fn tiles_of(pattern: &Path) -> std::result::Result<Vec<(usize, PathBuf)>, resolvent_image::Error> {
    let unreadable = |source| resolvent_image::Error::Io {
        file: pattern.to_owned(),
        what: "",
        source,
    };
    let name = pattern.file_name().unwrap_or_default().to_string_lossy();
    let Some((before, after)) = name.split_once(UDIM) else {
        let what = std::io::Error::other("<UDIM> must stand in the file's name, not in a folder's");
        return Err(unreadable(what));
    };
    let folder = match pattern.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let folder = folder.canonicalize().map_err(unreadable)?;
    let mut tiles = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let number = name
            .strip_prefix(before)
            .and_then(|n| n.strip_suffix(after));
        if let Some(number) = number.filter(|n| n.len() == 4)
            && let Ok(number @ 1001..=9999) = number.parse::<usize>()
        {
            tiles.push((number - 1001, path));
        }
    }
    tiles.sort();
    if tiles.is_empty() {
        let what = std::io::Error::new(
            std::io::ErrorKind::NotFound,
            "no file with a tile's number (1001 to 9999) in place of <UDIM>",
        );
        return Err(unreadable(what));
    }
    Ok(tiles)
}

impl State {
    /// The texels of an image, read at the first time; `None` for no image.
    fn image(
        &mut self,
        source: &ImageSource,
        scene: &describe::Scene,
    ) -> std::result::Result<Option<Arc<Texels>>, resolvent_image::Error> {
        let key = match source {
            ImageSource::File(file) => {
                let path = scene.resolve(file);
                Key::File(path.canonicalize().unwrap_or(path))
            }
            ImageSource::Memory(image) => Key::Memory(image.bytes.as_ptr().addr()),
            ImageSource::White => return Ok(None),
        };
        let index = match self.images.get(&key) {
            Some(index) => *index,
            None => {
                let Some(image) = read(source, scene)? else {
                    return Ok(None);
                };
                self.read.push(image);
                let index = self.read.len() - 1;
                self.images.insert(key, index);
                index
            }
        };
        Ok(Some(self.read[index].texels.clone()))
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
        let problem = |e: resolvent_image::Error| {
            let what = format!("texture '{name}': {e}");
            describe::Problem::new(&scene.source.file, described.place.clone(), what)
        };
        let texture = match &described.image {
            ImageSource::File(file) if file.contains(UDIM) => {
                let mut tiles = Vec::new();
                for (number, path) in tiles_of(&scene.resolve(file)).map_err(problem)? {
                    tiles.resize(tiles.len().max(number + 1), None);
                    let file = ImageSource::File(path.to_string_lossy().into_owned());
                    tiles[number] = state.image(&file, scene).map_err(problem)?;
                }
                Texture::tiled(tiles, described)
            }
            image => Texture::new(state.image(image, scene).map_err(problem)?, described),
        };
        let texture = Arc::new(texture);
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
