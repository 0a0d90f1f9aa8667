//! Images that the scene refers to.

use crate::error::{Error, Result};
use std::path::Path;

/// Width, height and pixels of an image in rows from the top.
pub type Rgb = (usize, usize, Vec<[f32; 3]>);

/// Reads the colour of an OpenEXR image.
///
/// # Errors
/// If the file cannot be read or has no colour.
pub fn read_rgb(path: &Path) -> Result<Rgb> {
    let image = resolvent_image::Image::read_exr(path).map_err(|e| Error::Input(e.to_string()))?;
    let [r, g, b] = image.color().ok_or_else(|| {
        Error::Input(format!(
            "{}: has no colour channels R, G, B",
            path.display()
        ))
    })?;
    let texels = (0..image.pixels()).map(|i| [r[i], g[i], b[i]]).collect();
    Ok((image.width, image.height, texels))
}
