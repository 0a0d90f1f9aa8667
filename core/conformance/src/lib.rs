//! The conformance kit: statistics, and the checks that any plugin of a kind must pass.
//!
//! `resolvent plugin check` runs them on a library, and a plugin's own tests run them on its types. Findings gather in a
//! [`Suite`], each under the property it is about, and one family-wise significance level is applied to all of them at the end.
//! [`ztest`], [`chi2`] and [`moments`] are the statistics, [`quadrature`] the deterministic counterpart, [`scatter`] the checks of
//! phase functions and BSDFs, [`medium`] those of media, and [`host`] makes instances from JSON parameters without a program
//! around them.
//!
//! Random numbers come from fixed keys, so a test that passes once passes always; what the significance level bounds is the
//! chance that a correct plugin fails when its code changes.

pub mod chi2;
pub mod host;
pub mod medium;
pub mod moments;
#[cfg(test)]
mod nesting;
pub mod property;
pub mod quadrature;
pub mod scatter;
mod suite;
pub mod ztest;

pub use moments::Moments;
pub use suite::{Failure, Suite, Verdict};

/// Samples for a statistical test: all of them in release builds, a twentieth in debug builds.
pub fn samples(full: usize) -> usize {
    if cfg!(debug_assertions) {
        (full / 20).max(1000)
    } else {
        full
    }
}
