//! Pictures: checked before rendering, made from the film after it.

use crate::args::{Tone, ToneCurve};
use crate::failure::{Failure, Outcome, failed, input};
use resolvent_engine::Rendered;
use resolvent_engine::film::{Estimate, Features};
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

/// Refuses a picture that memory cannot hold, before the system ends the program for it. `films` is how many times its sums are
/// held; `orders` of the layers are of light by scattering order.
pub fn check_memory(
    window: [u32; 4],
    features: bool,
    [layers, orders]: [usize; 2],
    films: usize,
) -> Outcome<()> {
    let pixels = u64::from(window[2] - window[0]) * u64::from(window[3] - window[1]);
    let sums = size_of::<resolvent_engine::film::Pixel>()
        + usize::from(features) * size_of::<resolvent_engine::film::FeatureSums>()
        // Walks from the sensor and from lights.
        + orders * 2 * size_of::<[i128; 3]>();
    // The picture is held as f32, and once more while it is written.
    let need = pixels * (films * sums + 2 * 4 * (4 + 3 * (layers + orders))) as u64;
    match crate::system::available_memory() {
        Some(free) if need > free => Err(input(format!(
            "a picture of {} x {} pixels needs {} of memory, {} are free: render it in parts with --crop",
            window[2] - window[0],
            window[3] - window[1],
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

/// The picture with its layers. Layers that cannot be known yet are left out; they are returned.
pub fn image(scene: &Scene, rendered: &Rendered) -> (Image, Vec<Aov>) {
    let film = &rendered.film;
    let [w, h] = film.size();
    let window = scene.film.window();
    let count = w as usize * h as usize;
    let estimates: Vec<Estimate> = (0..count).map(|i| film.estimate(i)).collect();
    let mut image = Image::new(w as usize, h as usize);
    image.origin = [window[0] as i32, window[1] as i32];
    image.full = scene.film.resolution.map(|n| n as usize);
    let of = |f: &dyn Fn(&Estimate) -> f64| -> Vec<f32> {
        estimates.iter().map(|e| f(e) as f32).collect()
    };
    image.push(
        BEAUTY,
        [
            ("R", of(&|e| e.mean[0])),
            ("G", of(&|e| e.mean[1])),
            ("B", of(&|e| e.mean[2])),
            ("A", of(&|e| e.alpha)),
        ],
    );
    let features: Vec<Features> = if wants_features(scene) {
        (0..count).map(|i| film.features(i)).collect()
    } else {
        Vec::new()
    };
    let per_feature = |f: &dyn Fn(&Features) -> f64| -> Vec<f32> {
        features.iter().map(|x| f(x) as f32).collect()
    };
    let mut missing = Vec::new();
    let mut aovs = scene.film.aovs.clone();
    aovs.sort();
    for aov in aovs {
        let name = aov.name();
        match aov {
            Aov::Depth => image.push(name, [("Z", per_feature(&|f| f.depth))]),
            Aov::Albedo => image.push(
                name,
                [
                    ("R", per_feature(&|f| f.albedo[0])),
                    ("G", per_feature(&|f| f.albedo[1])),
                    ("B", per_feature(&|f| f.albedo[2])),
                ],
            ),
            Aov::Normal => image.push(
                name,
                [
                    ("X", per_feature(&|f| f.normal[0])),
                    ("Y", per_feature(&|f| f.normal[1])),
                    ("Z", per_feature(&|f| f.normal[2])),
                ],
            ),
            Aov::Orders(n) if film.orders() != n as usize + 2 => missing.push(aov),
            Aov::Orders(n) => {
                for k in 0..=n as usize + 1 {
                    let of = |i: usize, lane: usize| film.order(i, k)[lane] as f32;
                    let lane = |lane: usize| (0..count).map(|i| of(i, lane)).collect();
                    let name = if k <= n as usize {
                        format!("order{k}")
                    } else {
                        "order_rest".to_owned()
                    };
                    image.push(&name, [("R", lane(0)), ("G", lane(1)), ("B", lane(2))]);
                }
            }
            Aov::Samples => image.push(name, [("N", of(&|e| f64::from(e.samples)))]),
            Aov::Variance if estimates.iter().all(|e| e.variance.is_none()) => missing.push(aov),
            // A pixel that was interrupted before its variance could be known says so.
            Aov::Variance => {
                let lane = |k: usize| of(&|e| e.variance.map_or(f64::NAN, |v| v[k]));
                image.push(name, [("R", lane(0)), ("G", lane(1)), ("B", lane(2))]);
            }
            Aov::Error95 => {
                let half_widths = film.half_widths();
                if half_widths.iter().all(|h| h[0].is_nan()) {
                    missing.push(aov);
                    continue;
                }
                let lane = |k: usize| half_widths.iter().map(|h| h[k] as f32).collect();
                image.push(name, [("R", lane(0)), ("G", lane(1)), ("B", lane(2))]);
            }
        }
    }
    (image, missing)
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
            "the layer '{}' is left out: it takes more samples to know it",
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
