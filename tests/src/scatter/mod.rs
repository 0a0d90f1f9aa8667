//! Checks that every phase function and BSDF must pass.
//!
//! [`check`] runs all of them. They need nothing but the [`Scatter`] trait: the density over the sphere is integrated
//! numerically and everything else, the samples, their weights and the mean cosine, is compared with that.

mod density;
mod pairs;
mod samples;

pub use density::Density;

use crate::Suite;
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
    let name = format!("{name}, wo = {wo}");
    // The peak, if there is one, lies around −wo for phase functions and is symmetric to z for BSDFs: the grid's poles are there.
    let axis = match measured {
        Measured::Phase => -wo,
        Measured::Bsdf => Vec3::Z,
    };
    let density = Density::new(k, measured, wo, axis, Mode::Radiance);
    suite.claim(density.total <= 1.0 + 2e-4, || {
        format!("{name}: density integrates to {}", density.total)
    });
    samples::histogram(suite, &name, k, &density);
    samples::weights(suite, &name, k, &density);
    pairs::symmetry(suite, &name, k, wo);
    pairs::modes(suite, &name, k, wo);
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
