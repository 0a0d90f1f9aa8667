//! Russian roulette: the only thing that ends a path by default. Unbiased whatever the survival probability, as long as that
//! depends on the path alone.

/// Below this weight a path takes part in the roulette.
pub const THRESHOLD: f32 = 0.25;
/// Weight a survivor is given back.
pub const TARGET: f32 = 0.5;

/// Survival probability of a path of weight `w` (largest lane, relative to its start).
///
/// Between threshold and 1 paths go on unchanged; light ones are thinned out until they weigh [`TARGET`]. Played at real
/// scattering only: at null collisions weights would grow with the majorant.
#[inline(always)]
pub fn survival(w: f32) -> f32 {
    if w >= THRESHOLD { 1.0 } else { w / TARGET }
}

/// Phase function value, relative to isotropic scattering, below which a connection plays roulette.
pub const CONNECTION_THRESHOLD: f32 = 1.0;

/// Probability of going on with a connection whose phase function value is `f` (sr⁻¹).
#[inline(always)]
pub fn connection(f: f32) -> f32 {
    (f * (4.0 * core::f32::consts::PI / CONNECTION_THRESHOLD)).min(1.0)
}
