//! Images of all directions.

use super::Texture;
use crate::error::{Error, Result};
use rayon::prelude::*;
use resolvent_image::Texels;
use resolvent_scene::{self as describe, ImageSource, Mapping};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// Width, height and pixels of an image in rows from the top.
pub type Rgb = (usize, usize, Vec<[f32; 3]>);

/// Reads the linear colour of an image of all directions as one of latitude and longitude. Other mappings are resampled with as
/// many rows as the image has across all directions, bilinearly.
///
/// # Errors
/// If the file cannot be read or has no colour.
pub fn read_environment(path: &Path, mapping: Mapping) -> Result<Rgb> {
    let (texels, _) = Texels::read(path).map_err(|e| Error::Input(e.to_string()))?;
    let mut described = describe::Texture::new(ImageSource::File(String::new()));
    described.wrap = [describe::Wrap::Clamp; 2];
    let (width, height) = (texels.width, texels.height);
    let image = Texture::new(Some(Arc::new(texels)), &described);
    let rgb = |v: [f32; 4]| [v[0], v[1], v[2]];
    if mapping == Mapping::LatLong {
        let texels = image.decoded().map(rgb).collect();
        return Ok((width, height, texels));
    }
    let rows = match mapping {
        Mapping::VerticalCross => height / 2,
        _ => height,
    };
    let rows = rows.clamp(2, 8192);
    let columns = 2 * rows;
    let mut out = vec![[0.0; 3]; rows * columns];
    out.par_chunks_mut(columns)
        .enumerate()
        .for_each(|(y, row)| {
            let (sin, cos) = (PI * (y as f64 + 0.5) / rows as f64).sin_cos();
            for (x, texel) in row.iter_mut().enumerate() {
                let turn = 2.0 * PI * (0.5 - (x as f64 + 0.5) / columns as f64);
                let w = [sin * turn.sin(), cos, sin * turn.cos()];
                let [u, v] = place(mapping, w, [1.0 / width as f64, 1.0 / height as f64]);
                *texel = rgb(image.at([u as f32, 1.0 - v as f32], &[1.0; 4]));
            }
        });
    Ok((columns, rows, out))
}

/// Where an image shows the unit direction `w`: (u, v) from the upper left corner. `texel` is the size of one.
fn place(mapping: Mapping, w: [f64; 3], texel: [f64; 2]) -> [f64; 2] {
    let [x, y, z] = w;
    match mapping {
        Mapping::LatLong => [
            0.5 - x.atan2(z) / (2.0 * PI),
            y.clamp(-1.0, 1.0).acos() / PI,
        ],
        Mapping::MirroredBall => {
            // The normal halves the angle between w and +z; at −z it is anywhere on the rim.
            let length = (2.0 + 2.0 * z).max(1e-12).sqrt();
            [0.5 + 0.5 * x / length, 0.5 - 0.5 * y / length]
        }
        Mapping::Angular => {
            let across = x.hypot(y);
            let r = across.atan2(z) / PI;
            let (x, y) = if across > 0.0 {
                (x / across, y / across)
            } else {
                (1.0, 0.0)
            };
            [0.5 + 0.5 * r * x, 0.5 - 0.5 * r * y]
        }
        Mapping::VerticalCross => {
            // Column and row of the face, and the place on it from −1 to 1, right and down.
            let [a, b, c] = w.map(f64::abs);
            let (column, row, right, down) = if c >= a && c >= b {
                if z > 0.0 {
                    (1.0, 1.0, -x / c, -y / c)
                } else {
                    (1.0, 3.0, -x / c, y / c)
                }
            } else if a >= b {
                if x > 0.0 {
                    (0.0, 1.0, z / a, -y / a)
                } else {
                    (2.0, 1.0, -z / a, -y / a)
                }
            } else if y > 0.0 {
                (1.0, 0.0, -x / b, z / b)
            } else {
                (1.0, 2.0, -x / b, -z / b)
            };
            // Half a texel from the edge: what lies beyond belongs to no face, or to another.
            let within = |f: f64, n: f64, texel: f64| {
                let half = (0.5 * texel * n).min(0.5);
                (0.5 + 0.5 * f).clamp(half, 1.0 - half)
            };
            [
                (column + within(right, 3.0, texel[0])) / 3.0,
                (row + within(down, 4.0, texel[1])) / 4.0,
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions whose places are known, and that neighbours lie near each other across the edges of the cross that are joined.
    #[test]
    fn places() {
        let texel = [0.0; 2];
        let at = |m, w| place(m, w, texel);
        let near = |a: [f64; 2], b: [f64; 2]| {
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-6, "{a:?} {b:?}");
        };
        for m in [Mapping::LatLong, Mapping::MirroredBall, Mapping::Angular] {
            near(at(m, [0.0, 0.0, 1.0]), [0.5, 0.5]);
        }
        let h = 0.5f64.sqrt();
        // A normal at 45° mirrors +z into +x.
        near(
            at(Mapping::MirroredBall, [1.0, 0.0, 0.0]),
            [0.5 + 0.5 * h, 0.5],
        );
        near(at(Mapping::Angular, [0.0, 1.0, 0.0]), [0.5, 0.25]);
        near(at(Mapping::LatLong, [1.0, 0.0, 0.0]), [0.25, 0.5]);
        let cross = |w| at(Mapping::VerticalCross, w);
        near(cross([0.0, 0.0, 1.0]), [0.5, 0.375]);
        near(cross([0.0, 1.0, 0.0]), [0.5, 0.125]);
        near(cross([1.0, 0.0, 0.0]), [1.0 / 6.0, 0.375]);
        near(cross([0.0, 0.0, -1.0]), [0.5, 0.875]);
        let e = 1e-9;
        for (a, b) in [
            ([h, 0.1, h + e], [h + e, 0.1, h]),
            ([-h, 0.1, h + e], [-h - e, 0.1, h]),
            ([0.1, h, h + e], [0.1, h + e, h]),
            ([0.1, -h, h + e], [0.1, -h - e, h]),
            ([0.1, -h, -h - e], [0.1, -h - e, -h]),
        ] {
            near(cross(a), cross(b));
        }
    }

    /// An image of the cosine to a direction, in each mapping, is read as the same image of latitude and longitude.
    #[test]
    fn resampled() {
        let axis = [0.36, 0.48, 0.8];
        let folder = std::env::temp_dir();
        for (mapping, width, height) in [
            (Mapping::MirroredBall, 256, 256),
            (Mapping::Angular, 256, 256),
            (Mapping::VerticalCross, 192, 256),
        ] {
            let mut values = vec![0f32; width * height];
            // Drawn by scattering many directions onto the image.
            let n = 4_000_000;
            for i in 0..n {
                let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
                let phi = f64::from(i) * 2.399_963_229_728_653;
                let r = (1.0 - y * y).sqrt();
                let w = [r * phi.cos(), y, r * phi.sin()];
                let [u, v] = place(mapping, w, [0.0; 2]);
                let x = ((u * width as f64) as usize).min(width - 1);
                let y = ((v * height as f64) as usize).min(height - 1);
                values[y * width + x] = (0..3).map(|k| w[k] * axis[k]).sum::<f64>() as f32 + 2.0;
            }
            let mut image = resolvent_image::Image::new(width, height);
            let planes = ["R", "G", "B"].map(|c| (c, values.clone()));
            image.push(resolvent_image::BEAUTY, planes);
            let path = folder.join(format!(
                "resolvent-mapping-{}-{mapping:?}.exr",
                std::process::id()
            ));
            image.write_exr(&path).unwrap();
            let (columns, rows, texels) = read_environment(&path, mapping).unwrap();
            std::fs::remove_file(&path).unwrap();
            for y in 0..rows {
                for x in 0..columns {
                    let (sin, cos) = (PI * (y as f64 + 0.5) / rows as f64).sin_cos();
                    let turn = 2.0 * PI * (0.5 - (x as f64 + 0.5) / columns as f64);
                    let w = [sin * turn.sin(), cos, sin * turn.cos()];
                    // Where the ball's rim shows all that is behind it, no image has digits.
                    if w[2] < -0.9 {
                        continue;
                    }
                    let expected = (0..3).map(|k| w[k] * axis[k]).sum::<f64>() + 2.0;
                    let found = f64::from(texels[y * columns + x][0]);
                    assert!(
                        (found - expected).abs() < 0.06,
                        "{mapping:?} {w:?}: {found} {expected}"
                    );
                }
            }
        }
    }
}
