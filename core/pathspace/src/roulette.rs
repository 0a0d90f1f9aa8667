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
