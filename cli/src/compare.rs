//! `resolvent compare`.

use crate::args::Compare;
use crate::failure::{Code, Outcome, input};
use resolvent_image::{Comparison, Image, Regions};
use serde_json::{Value, json};
use std::path::Path;

/// Runs the command.
pub fn run(a: &Compare) -> Outcome {
    let image = read(&a.image)?;
    let reference = read(&a.reference)?;
    let grid = a.regions.0.map(|n| n as usize);
    let c = resolvent_image::compare(&image, &reference, grid).map_err(|e| {
        input(format!(
            "{} cannot be compared with {}: {e}",
            a.image.display(),
            a.reference.display()
        ))
    })?;
    if a.json {
        println!("{:#}", report(&c));
    } else {
        print(&c);
    }
    let passed = c.regions.as_ref().map(Regions::passed);
    if a.fail && passed.is_none() {
        return Err(input(
            "--fail needs a layer `variance` in at least one of the images; render with --aov variance",
        ));
    }
    Ok(if a.fail && passed == Some(false) {
        Code::Failed
    } else {
        Code::Done
    })
}

fn read(file: &Path) -> Outcome<Image> {
    // A PNG may be fine; it is no measure of light.
    if file.is_file() && !crate::input::is_exr(file) {
        return Err(input(format!(
            "{}: is no EXR image; compare takes EXR images, whose values are those of the render: write them with -o FILE.exr",
            file.display()
        )));
    }
    Image::read_exr(file).map_err(input)
}

fn report(c: &Comparison) -> Value {
    json!({
        "pixels": c.pixels,
        "not_finite": c.not_finite,
        "mse": c.mse,
        "rel_mse": c.rel_mse,
        "rel_mse_untrimmed": c.rel_mse_untrimmed,
        "mean": c.mean,
        "reference_mean": c.reference_mean,
        "mean_ratio": c.mean_ratio,
        "within_error_95": c.within_error_95,
        "z_test": c.regions.as_ref().map(|r| json!({
            "passed": r.passed(),
            "regions": r.grid,
            "tests": r.tests.len(),
            "max_z": r.max_z,
            "threshold": r.threshold,
            "p_value": r.p_value,
            "worst": r.worst().map(|t| json!({
                "region": t.region, "channel": t.channel, "difference": t.difference,
                "sigma": t.sigma, "z": t.z,
            })),
        })),
    })
}

fn print(c: &Comparison) {
    let three = |v: [f64; 3]| format!("{:.6} {:.6} {:.6}", v[0], v[1], v[2]);
    println!("pixels          {}", c.pixels);
    if c.not_finite > 0 {
        println!("not finite      {} pixels, left out", c.not_finite);
    }
    println!("MSE             {:.6e}", c.mse);
    println!(
        "relMSE          {:.6e} (all pixels: {:.6e})",
        c.rel_mse, c.rel_mse_untrimmed
    );
    println!("mean            {}", three(c.mean));
    println!("reference mean  {}", three(c.reference_mean));
    println!("mean ratio      {}", three(c.mean_ratio));
    if let Some(share) = c.within_error_95 {
        println!("within error_95 {:.2} % of the values", 100.0 * share);
    }
    let Some(r) = &c.regions else {
        println!("z-test          none: neither image has a layer `variance`");
        return;
    };
    println!(
        "z-test          {}: largest |z| {:.2} of {} tests in {} x {} regions, limit {:.2}, p = {:.3}",
        if r.passed() { "PASS" } else { "FAIL" },
        r.max_z,
        r.tests.len(),
        r.grid[0],
        r.grid[1],
        r.threshold,
        r.p_value
    );
    if let (false, Some(t)) = (r.passed(), r.worst()) {
        let [x0, y0, x1, y1] = t.region;
        println!(
            "worst           {} in ({x0}, {y0}) to ({x1}, {y1}): {:+.6} +- {:.6}",
            ["red", "green", "blue"][t.channel],
            t.difference,
            t.sigma
        );
    }
}
