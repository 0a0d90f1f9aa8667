//! Pictures: checked before rendering, made from the film after it.

use crate::args::{Tone, ToneCurve};
use crate::failure::{Failure, Outcome, failed, input};
use resolvent_engine::{Rendered, Settings};
use resolvent_image::{BEAUTY, Curve, Image, ToneMap};
use resolvent_scene::{Aov, Scene};
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

/// Formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

/// A picture to be written.
#[derive(Clone, Debug)]
pub struct Target {
    path: PathBuf,
    format: Format,
}

impl Target {
    /// Where it is written.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The pictures asked for, or the default one for `input_file`; their folders can be written to.
pub fn targets(asked: &[PathBuf], input_file: Option<&Path>) -> Outcome<Vec<Target>> {
    let mut paths = asked.to_vec();
    if let (true, Some(file)) = (paths.is_empty(), input_file) {
        let stem = file.file_stem().unwrap_or(file.as_os_str());
        let path = PathBuf::from(stem).with_extension("exr");
        crate::console::info(format!("no -o given: writing {}", path.display()));
        paths.push(path);
    }
    let mut targets: Vec<Target> = Vec::new();
    for path in paths {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let format = match extension.as_deref() {
            Some("exr") => Format::Exr,
            Some("png") => Format::Png,
            _ => {
                return Err(input(format!(
                    "{}: cannot tell the format: end the name in .exr or .png",
                    path.display()
                )));
            }
        };
        check_writable(&path)?;
        targets.push(Target { path, format });
    }
    Ok(targets)
}

/// Makes sure that a file can be written to a place, without touching what is there.
pub fn check_writable(path: &Path) -> Outcome<()> {
    let file = resolvent_image::destination(path).map_err(input)?;
    let folder = match file.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(input(format!(
            "{}: there is no folder {}",
            path.display(),
            folder.display()
        )));
    }
    let probe = folder.join(format!(".resolvent-{}.tmp", std::process::id()));
    match OpenOptions::new().write(true).create_new(true).open(&probe) {
        Ok(_) => {
            // Left over at worst: an empty file that says whose it is.
            let _ = std::fs::remove_file(&probe);
            Ok(())
        }
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => Ok(()),
        Err(e) => Err(input(format!(
            "{}: cannot write to the folder {}: {e}",
            path.display(),
            folder.display()
        ))),
    }
}

/// Bytes of memory that the sums and the picture take at most; `keeps`: with checkpoints.
pub fn memory(scene: &Scene, settings: &Settings, keeps: bool) -> u64 {
    let channels = |aov: &Aov| match aov {
        Aov::Depth | Aov::Samples => 1,
        Aov::Orders(_) => 3 * scene.film.order_layers(),
        _ => 3,
    };
    let channels = 4 + scene.film.aovs.iter().map(channels).sum::<usize>();
    let [x0, y0, x1, y1] = settings.window;
    let pixels = u64::from(x1 - x0) * u64::from(y1 - y0);
    // Held as f32, and once more while it is written. By then the last checkpoint, the sums once more, is on the disk.
    let picture = 2 * pixels * (channels * size_of::<f32>()) as u64;
    // Any other integrator may send walks from lights; that it does is known by the first of them.
    let sums = settings.film_bytes(scene.integrator.plugin != "pt");
    sums + picture.max(if keeps { sums } else { 0 })
}

/// Refuses a picture that memory cannot hold, before the system ends the program for it.
pub fn check_memory([x0, y0, x1, y1]: [u32; 4], need: u64) -> Outcome<()> {
    match crate::system::available_memory() {
        Some(free) if need > free => Err(input(format!(
            "a picture of {} x {} pixels needs {} of memory, {} are free: render it in parts with --crop",
            x1 - x0,
            y1 - y0,
            bytes(need),
            bytes(free)
        ))),
        _ => Ok(()),
    }
}

/// A number of bytes for people.
pub fn bytes(n: u64) -> String {
    let units = ["bytes", "kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    let digits = if unit == 0 || value >= 100.0 { 0 } else { 1 };
    format!("{value:.digits$} {}", units[unit])
}

/// The picture with its layers. Layers that cannot be known are left out; they are returned.
pub fn image(scene: &Scene, rendered: &Rendered) -> (Image, Vec<Aov>) {
    let film = &rendered.film;
    let [w, h] = film.size();
    let window = scene.film.window();
    let count = w as usize * h as usize;
    let mut image = Image::new(w as usize, h as usize);
    image.origin = [window[0] as i32, window[1] as i32];
    image.full = scene.film.resolution.map(|n| n as usize);
    push(&mut image, BEAUTY, ["R", "G", "B", "A"], |i| {
        let e = film.estimate(i);
        [e.mean[0], e.mean[1], e.mean[2], e.alpha]
    });
    let has_variance =
        || !film.is_faint() && (0..count).any(|i| film.estimate(i).variance.is_some());
    let mut missing = Vec::new();
    let mut aovs = scene.film.aovs.clone();
    aovs.sort();
    for aov in aovs {
        let (name, image) = (aov.name(), &mut image);
        match aov {
            Aov::Depth => push(image, name, ["Z"], |i| [film.features(i).depth]),
            Aov::Albedo => push(image, name, RGB, |i| film.features(i).albedo),
            Aov::Normal => push(image, name, ["X", "Y", "Z"], |i| film.features(i).normal),
            Aov::Orders(n) if film.orders() != n as usize + 2 => missing.push(aov),
            Aov::Orders(n) => {
                for k in 0..=n as usize + 1 {
                    let name = if k <= n as usize {
                        format!("order{k}")
                    } else {
                        "order_rest".to_owned()
                    };
                    push(image, &name, RGB, |i| film.order(i, k));
                }
            }
            Aov::Samples => push(image, name, ["N"], |i| [film.estimate(i).samples.into()]),
            Aov::Variance | Aov::Error95 if !has_variance() => missing.push(aov),
            // A pixel that was interrupted before its variance could be known says so.
            Aov::Variance => push(image, name, RGB, |i| {
                film.estimate(i).variance.unwrap_or([f64::NAN; 3])
            }),
            Aov::Error95 => {
                let half_widths = film.half_widths();
                push(image, name, RGB, |i| half_widths[i]);
            }
        }
    }
    (image, missing)
}

/// Channels of colours.
const RGB: [&str; 3] = ["R", "G", "B"];

/// Adds a layer by what its channels have at each pixel.
fn push<const N: usize>(
    image: &mut Image,
    layer: &str,
    names: [&str; N],
    of: impl Fn(usize) -> [f64; N],
) {
    let count = image.width * image.height;
    let mut channels = names.map(|name| (name, Vec::with_capacity(count)));
    for i in 0..count {
        for ((_, data), v) in channels.iter_mut().zip(of(i)) {
            data.push(v as f32);
        }
    }
    image.push(layer, channels);
}

/// True if a layer is asked for that only the first vertex of a path can tell.
pub fn wants_features(scene: &Scene) -> bool {
    let first = [Aov::Depth, Aov::Albedo, Aov::Normal];
    scene.film.aovs.iter().any(|a| first.contains(a))
}

/// Says which layers are left out.
pub fn tell_missing(missing: &[Aov]) {
    for layer in missing {
        crate::console::info(format!(
            "the layer '{}' is left out: it takes more samples, or more light, to know it",
            layer.name()
        ));
    }
}

/// What became of the files to write: one that fails keeps no other from being written.
#[derive(Debug, Default)]
pub struct Written {
    names: Vec<String>,
    failures: Vec<String>,
}

impl Written {
    /// What came of writing a file.
    pub fn note(&mut self, file: &Path, outcome: Outcome<()>) {
        match outcome {
            Ok(()) => self.names.push(file.display().to_string()),
            Err(Failure { message, .. }) => self.failures.push(message),
        }
    }

    /// Writes the picture to all targets.
    pub fn image(&mut self, a: &Tone, image: &Image, targets: &[Target]) {
        let tone = ToneMap {
            exposure: a.exposure as f32,
            curve: match a.tone_map {
                ToneCurve::Srgb => Curve::Srgb,
                ToneCurve::Filmic => Curve::Filmic,
            },
        };
        for t in targets {
            let outcome = match t.format {
                Format::Exr => image.write_exr(&t.path),
                Format::Png => image.write_png(&t.path, &tone),
            };
            self.note(&t.path, outcome.map_err(failed));
        }
    }

    /// The names of what is there, for messages.
    pub fn names(&self) -> String {
        self.names.join(", ")
    }

    /// An error that tells all failures, if there are any, and what is there all the same (`summary`).
    pub fn whole(&self, summary: &str) -> Outcome<()> {
        if self.failures.is_empty() {
            return Ok(());
        }
        let failures = self.failures.join("; ");
        Err(failed(if self.names.is_empty() {
            format!("{failures}; nothing is written")
        } else {
            format!("{failures}; written is {summary}")
        }))
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn bytes_for_people() {
        assert_eq!(super::bytes(999), "999 bytes");
        assert_eq!(super::bytes(1475137), "1.5 MB");
        assert_eq!(super::bytes(560_000_000_000), "560 GB");
    }
}
