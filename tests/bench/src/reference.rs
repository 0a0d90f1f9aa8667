//! References: converged pictures that are stored with their own error.
//!
//! A reference holds the mean and its standard error (layer `error`), both rounded to the 11 bits of a half, which ZIP
//! compression then packs as well as halves. The rounding adds a relative variance of 2⁻²⁴/3, far below any reference's noise.

use crate::error::{Error, Result};
use crate::renderer::{Failure, Job, Renderer};
use crate::score::{DARK, Picture};
use crate::suite::{Case, Suite, resolution};
use half::f16;
use resolvent_image::{BEAUTY, Image};
use std::path::{Path, PathBuf};

/// Renders a reference with another integrator than the one that is measured, for about so many CPU seconds.
pub fn render(
    suite: &Suite,
    case: &Case,
    integrator: &str,
    seconds: f64,
    seed: u64,
    work: &Path,
) -> Result<String> {
    let renderer = Renderer::own(Some(integrator.to_owned()))?;
    let scene = suite.scene(case, work)?;
    let size = resolution(&scene)?;
    let run = |spp: u64, seed: u64| {
        let job = Job {
            scene: &scene,
            size,
            spp,
            seed,
            threads: 0,
            work,
        };
        renderer.run(&job).map_err(|f| match f {
            Failure::Broken(e) => e,
            Failure::Unsupported(why) => Error::invalid(why),
        })
    };
    let (_, pilot) = run(32, seed ^ 0x70_696c)?;
    let spp = ((32.0 * seconds / pilot.render_cpu) as u64 / 16 * 16).max(64);
    let (picture, _) = run(spp, seed)?;
    let by = format!(
        "resolvent {} {integrator}, {spp} samples a pixel, seed {seed}",
        env!("CARGO_PKG_VERSION")
    );
    save(suite, case, &picture, &by)
}

/// Makes a reference of pictures that are independent of each other, such as a peer's with different seeds. Their relative spread,
/// over 7 × 7 pixels, is its error.
pub fn merge(suite: &Suite, case: &Case, files: &[PathBuf], by: &str) -> Result<String> {
    let all: Vec<Picture> = files
        .iter()
        .map(|f| Picture::read(f))
        .collect::<Result<_>>()?;
    let Some(first) = all.first() else {
        return Err(Error::invalid("--from needs pictures"));
    };
    if let Some(k) = all.iter().position(|p| p.size != first.size) {
        return Err(Error::invalid(format!(
            "{}: has another size than {}",
            files[k].display(),
            files[0].display()
        )));
    }
    let n = all.len() as f64;
    let pixels = first.color.len();
    let mean: Vec<[f64; 3]> = (0..pixels)
        .map(|i| [0, 1, 2].map(|k| all.iter().map(|p| p.color[i][k]).sum::<f64>() / n))
        .collect();
    let variance = (all.len() > 1).then(|| spread(&all, &mean));
    let picture = Picture {
        size: first.size,
        color: mean,
        variance,
    };
    save(suite, case, &picture, by)
}

/// Variance of the mean of several pictures, by their spread over 7 × 7 pixels: relative to what scores divide by, so that the
/// noise of a lamp does not spread to the wall beside it.
fn spread(all: &[Picture], mean: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let [w, h] = all[0].size;
    let n = all.len() as f64;
    let scale = |i: usize, k: usize| mean[i][k] * mean[i][k] + DARK;
    let relative = |i: usize, k: usize| {
        let d = |p: &Picture| (p.color[i][k] - mean[i][k]).powi(2);
        all.iter().map(d).sum::<f64>() / (n - 1.0) / n / scale(i, k)
    };
    let around = |i: usize| {
        let (x, y) = (i % w, i / w);
        let (xs, ys) = (
            x.saturating_sub(3)..(x + 4).min(w),
            y.saturating_sub(3)..(y + 4).min(h),
        );
        let count = (xs.len() * ys.len()) as f64;
        let sum = |k: usize| -> f64 {
            let row = |y: usize| xs.clone().map(|x| relative(y * w + x, k)).sum::<f64>();
            ys.clone().map(row).sum()
        };
        [0, 1, 2].map(|k| sum(k) / count * scale(i, k))
    };
    (0..w * h).map(around).collect()
}

fn save(suite: &Suite, case: &Case, picture: &Picture, by: &str) -> Result<String> {
    let rounded = |v: f64| f16::from_f64(v).to_f32();
    let lanes = |v: &[[f64; 3]], f: fn(f64) -> f64| {
        [("R", 0), ("G", 1), ("B", 2)]
            .map(|(name, k)| (name, v.iter().map(|p| rounded(f(p[k]))).collect::<Vec<_>>()))
    };
    let mut image = Image::new(picture.size[0], picture.size[1]);
    image.push(BEAUTY, lanes(&picture.color, |v| v));
    let mut noise = 0.0;
    if let Some(v) = &picture.variance {
        image.push("error", lanes(v, f64::sqrt));
        for (c, v) in picture.color.iter().zip(v) {
            noise += (0..3).map(|k| v[k] / (c[k] * c[k] + DARK)).sum::<f64>() / 3.0;
        }
        noise /= picture.color.len() as f64;
    }
    image.metadata.insert("by".into(), by.to_owned());
    let path = suite.reference_path(case);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    }
    image.write_exr(&path)?;
    Ok(format!(
        "{}: {by}; relative variance {noise:.1e}",
        path.display()
    ))
}

/// Writes the scenes that are made at run time, with their volumes, into a folder.
pub fn write_scenes(suite: &Suite, cases: &[&Case], folder: &Path) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    cases
        .iter()
        .filter(|c| c.source != crate::suite::Source::File)
        .map(|c| suite.scene(c, folder))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lamp of radiance 100 in a dim room: its noise is strong but relatively small, and must not count for the wall.
    #[test]
    fn a_lamp_leaves_the_wall_its_noise() {
        let picture = |sign: f64| Picture {
            size: [15, 15],
            color: (0..225)
                .map(|i| {
                    [if i == 112 {
                        100.0 + sign
                    } else {
                        0.1 + 1e-3 * sign
                    }; 3]
                })
                .collect(),
            variance: None,
        };
        let all = [picture(1.0), picture(-1.0)];
        let mean: Vec<_> = (0..225)
            .map(|i| [if i == 112 { 100.0 } else { 0.1 }; 3])
            .collect();
        let relative = |v: &[[f64; 3]]| {
            let of = |(v, m): (&[f64; 3], &[f64; 3])| v[0] / (m[0] * m[0] + DARK);
            v.iter().zip(&mean).map(of).sum::<f64>() / 225.0
        };
        // Half the squared difference, over two pictures.
        let exact = (224.0 * 1e-6 / 0.02 + 1.0 / 10_000.01) / 225.0;
        let found = relative(&spread(&all, &mean));
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} for {exact}");
    }
}
