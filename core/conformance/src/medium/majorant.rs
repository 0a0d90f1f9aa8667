//! The largest extinction a medium states, against those that it has.

use super::LANES;
use super::edges::place;
use crate::{Suite, property};
use resolvent_api::rng::Stream;
use resolvent_api::{Medium, Vec3};

/// Rounding of an extinction and its bound.
const SLACK: f64 = 1.000_01;
/// Points that an ascent starts from: where checks are to be thorough, and where they are not.
const CLIMBERS: [usize; 2] = [16, 2];

/// σ_t ≤ `sigma_max` at random points, at corners and the middle, and where an ascent from the densest of them leads. Local majorants are
/// hidden inside of the medium; flights count where they are exceeded.
pub fn majorant(suite: &mut Suite, name: &str, medium: &impl Medium) {
    suite.about(property::MAJORANT);
    let info = medium.info();
    let (centre, extent) = place(medium);
    let mut stream = Stream::new(0x3a90);
    let mut cube = |size: f32| {
        let [u, v] = stream.uniform2();
        (Vec3::new(u, v, stream.uniform()) - 0.5) * size
    };
    // How far a point is above the bound, in the worst lane.
    let excess = |p: Vec3| {
        let sigma = medium.coefficients(p).sigma_t;
        (0..LANES as usize)
            .filter(|&lane| sigma[lane] > 0.0)
            .map(|lane| f64::from(sigma[lane]) / f64::from(info.sigma_max[lane]))
            .fold(0.0, f64::max)
    };
    let mut points: Vec<Vec3> = (0..suite.samples(20_000)).map(|_| cube(1.0)).collect();
    points.push(Vec3::ZERO);
    for i in 0..8 {
        let sign = |bit: i32| if i & bit == 0 { -0.4999 } else { 0.4999 };
        points.push(Vec3::new(sign(1), sign(2), sign(4)));
    }
    let mut found: Vec<(f64, Vec3)> = points
        .into_iter()
        .map(|p| (excess(centre + p * extent), p))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(CLIMBERS[usize::from(!suite.is_thorough())]);
    for (best, at) in &mut found {
        // Steps around the best point, shorter each time none of them leads up.
        let mut step = 0.1;
        while step > 1e-5 {
            let tries =
                (0..8).map(|_| (*at + cube(step)).clamp(Vec3::splat(-0.5), Vec3::splat(0.5)));
            let tries = tries.map(|p| (excess(centre + p * extent), p));
            let Some(top) = tries.max_by(|a, b| a.0.total_cmp(&b.0)) else {
                break;
            };
            if top.0 > *best {
                (*best, *at) = top;
            } else {
                step *= 0.5;
            }
        }
    }
    for (ratio, p) in found {
        let at = centre + p * extent;
        suite.at_most(ratio, SLACK, || {
            format!(
                "{name}: extinction over the stated maximum {:?} is {ratio:.5} at {at}",
                info.sigma_max.0
            )
        });
    }
}
