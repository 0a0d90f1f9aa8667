//! The properties that the kit checks, by the names that reports use.

/// The declarations fit themselves, and what they promise is true of `create`.
pub const PARAMETERS: &str = "parameters";
/// Instances are independent, and end without leaving anything behind.
pub const INSTANCES: &str = "instances";
/// The same input gives the same bits, from another instance and in another order as well.
pub const DETERMINISM: &str = "determinism";
/// The same from eight threads at once.
pub const THREADS: &str = "threads";
/// Extreme, denormal and impossible input gets a possible answer, and a bad one never ends the program.
pub const EDGES: &str = "edges";

/// Sampled directions follow the density that `eval` states (χ²).
pub const SAMPLING: &str = "sampling";
/// The same against the walk: the stated reverse density is that of the swapped pair, whatever is carried.
pub const ADJOINT: &str = "adjoint";
/// The density integrates to 1, or to less where sampling may fail; the value of a phase function to 1.
pub const NORMALISATION: &str = "normalisation";
/// A sample's weight is f cos / density, its densities are those of `eval`, its direction has unit length.
pub const WEIGHTS: &str = "weights";
/// f(wo, wi) = η² f(wi, wo), unless declared otherwise.
pub const RECIPROCITY: &str = "reciprocity";
/// Nothing scatters more than it receives.
pub const ENERGY: &str = "energy";

/// No extinction above its majorant: at random points, at those an ascent leads to, and on the way of flights.
pub const MAJORANT: &str = "majorant";
/// Flights collide where quadrature of the coefficients says.
pub const COLLISIONS: &str = "free flight";
/// Free flights, connections and quadrature agree on the transmittance.
pub const TRANSMITTANCE: &str = "transmittance";
/// What flights pick up is the emission along the way.
pub const EMISSION: &str = "emission";
/// A path's density is the same from both of its ends.
pub const REVERSAL: &str = "reversal";
/// Equal draws give equal flights.
pub const REPLAY: &str = "replay";
/// A flight cut short is its own beginning.
pub const PREFIX: &str = "prefix";
/// Bounds and traits are true of the coefficients.
pub const FACTS: &str = "facts";

/// Every sample is finite, each pixel gets as many as were asked for, and no two of them are the same on purpose.
pub const SAMPLES: &str = "samples";

/// No call fails that has nothing wrong with its input; panics stay inside.
pub const FAILURES: &str = "failures";
/// The process is still there afterwards, and not for ever.
pub const SURVIVAL: &str = "survival";

/// What is filed under no property.
pub const OTHER: &str = "other";

/// All of them.
pub const ALL: [&str; 23] = [
    PARAMETERS,
    INSTANCES,
    DETERMINISM,
    THREADS,
    EDGES,
    SAMPLING,
    ADJOINT,
    NORMALISATION,
    WEIGHTS,
    RECIPROCITY,
    ENERGY,
    MAJORANT,
    COLLISIONS,
    TRANSMITTANCE,
    EMISSION,
    REVERSAL,
    REPLAY,
    PREFIX,
    FACTS,
    SAMPLES,
    FAILURES,
    SURVIVAL,
    OTHER,
];

/// The property of a name.
pub fn known(name: &str) -> Option<&'static str> {
    ALL.into_iter().find(|p| *p == name)
}
