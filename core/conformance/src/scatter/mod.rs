//! Checks that every phase function and BSDF must pass.
//!
//! [`check`] runs all of them. They need nothing but the [`Scatter`] trait: the density over the sphere is integrated
//! numerically and everything else, the samples, their weights and the mean cosine, is compared with that.

mod delta;
mod density;
mod edges;
mod pairs;
mod samples;

pub use density::Density;
pub use edges::edges;
pub use pairs::Symmetry;

use crate::{Suite, property};
use resolvent_api::math::DVec3;
use resolvent_api::rng::Stream;
use resolvent_api::{Mode, Scatter, ScatterDraws, Vec3};

/// How K's value weighs a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// Directly: phase functions, in world coordinates.
    Phase,
    /// With |cos θ| against z: BSDFs, in the shading frame.
    Bsdf,
}

impl Measured {
    /// The factor.
    pub fn cosine(self, w: Vec3) -> f64 {
        match self {
            Self::Phase => 1.0,
            Self::Bsdf => f64::from(w.z.abs()),
        }
    }
}

/// All checks of a closure with smooth lobes for one `wo`: sampling against the density (χ²), weights and densities of
/// samples against `eval`, energy by quadrature and by sampling, mean cosine, reciprocity, both modes.
pub fn check(suite: &mut Suite, name: &str, k: &impl Scatter, measured: Measured, wo: Vec3) {
    // The peak, if there is one, lies around −wo for phase functions and is symmetric to z for BSDFs: the grid's poles are there.
    let axis = match measured {
        Measured::Phase => -wo,
        Measured::Bsdf => Vec3::Z,
    };
    check_around(suite, name, k, measured, wo, axis, 2e-4);
}

/// As [`check`], with the poles of the grid of directions, where it is finest, at ±`axis`, and the albedo up to 1 + `gain`: what
/// the closure's tables may be off by.
pub fn check_around(
    suite: &mut Suite,
    name: &str,
    k: &impl Scatter,
    measured: Measured,
    wo: Vec3,
    axis: Vec3,
    gain: f64,
) {
    let name = format!("{name}, wo = {wo}");
    let density = Density::new(k, measured, wo, axis, Mode::Radiance);
    normalised(suite, &name, measured, &density);
    suite.about(property::SAMPLING);
    samples::histogram(suite, &name, k, &density);
    samples::weights(suite, &name, k, &density, gain);
    pairs::symmetry(suite, &name, k, wo, Symmetry::Reciprocal);
    pairs::modes(suite, &name, k, wo);
}

/// What `plugin check` finds out about a closure of which nothing is known: as [`check_around`], also if it has delta lobes, and
/// with the density against the walk by its own χ² test. `symmetry` is what it claims.
pub fn examine(
    suite: &mut Suite,
    name: &str,
    k: &impl Scatter,
    measured: Measured,
    wo: Vec3,
    gain: f64,
    symmetry: Symmetry,
) {
    let name = format!("{name}, wo = {wo}");
    let axis = match measured {
        Measured::Phase => -wo,
        Measured::Bsdf => Vec3::new(-wo.x, -wo.y, wo.z),
    };
    let density = Density::new(k, measured, wo, axis, Mode::Radiance);
    normalised(suite, &name, measured, &density);
    suite.about(property::SAMPLING);
    samples::histogram(suite, &name, k, &density);
    samples::weights(suite, &name, k, &density, gain);
    suite.about(property::ADJOINT);
    let adjoint = Density::adjoint(k, measured, wo, axis, Mode::Importance);
    samples::histogram(suite, &format!("{name}, against the walk"), k, &adjoint);
    pairs::symmetry(suite, &name, k, wo, symmetry);
    if symmetry == Symmetry::Adjoint {
        let light = Density::new(k, measured, wo, axis, Mode::Importance);
        samples::weights(
            suite,
            &format!("{name}, from lights"),
            k,
            &light,
            f64::INFINITY,
        );
    } else {
        pairs::modes(suite, &name, k, wo);
    }
    delta::pairs(suite, &name, k, wo);
}

fn normalised(suite: &mut Suite, name: &str, measured: Measured, density: &Density) {
    suite.about(property::NORMALISATION);
    suite.at_most(density.total, 1.0 + 2e-4, || {
        format!("{name}: the density integrates to {:.6}", density.total)
    });
    if measured == Measured::Phase {
        for (lane, albedo) in density.albedo.iter().take(3).enumerate() {
            suite.close(
                &format!("{name}: integral of the value, lane {lane}"),
                *albedo,
                1.0,
                0.0,
                1e-3,
            );
        }
    }
}

/// Mean weight of samples for `wo` per lane over `n` well spread draws: the albedo, also of delta lobes.
pub fn albedo(k: &impl Scatter, wo: Vec3, n: u32) -> [f64; 4] {
    albedo_in(k, wo, n, Mode::Importance)
}

/// As [`albedo`], in a mode: that of lobes with normals of their own is in radiance mode.
pub fn albedo_in(k: &impl Scatter, wo: Vec3, n: u32, mode: Mode) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for i in 0..n {
        // Roberts' sequence in three dimensions.
        let at = |a: f64| (0.5 + a * f64::from(i)).fract() as f32;
        let u = ScatterDraws {
            lobe: at(0.819_172_513_396_164_4).min(1.0 - f32::EPSILON),
            dir: [at(0.671_043_606_703_789_2), at(0.549_700_477_901_970_3)]
                .map(|u| u.min(1.0 - f32::EPSILON)),
        };
        if let Some(s) = k.sample(wo, u, mode) {
            for (sum, w) in sum.iter_mut().zip(s.weight.0) {
                *sum += f64::from(w) / f64::from(n);
            }
        }
    }
    sum
}

/// Directions over the whole sphere, the same in every run.
pub fn directions(count: usize, key: u64) -> Vec<Vec3> {
    let mut stream = Stream::new(key);
    (0..count)
        .map(|_| resolvent_api::math::warp::sphere(stream.uniform2()).normalize())
        .collect()
}

pub(crate) fn draws(stream: &mut Stream) -> ScatterDraws {
    ScatterDraws {
        lobe: stream.uniform(),
        dir: stream.uniform2(),
    }
}

pub(crate) fn wide(v: Vec3) -> DVec3 {
    DVec3::new(v.x.into(), v.y.into(), v.z.into())
}
