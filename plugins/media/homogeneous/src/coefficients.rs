//! The coefficients as parameters give them: σ_t and albedo, or σ_a and σ_s.

use resolvent_api::{Coefficients, Error, Params, Spectrum};

/// Reads σ_t, σ_s and the emission.
pub fn read(params: &Params<'_>) -> Result<Coefficients, Error> {
    let given = |name: &str| params.spectrum(name);
    let (sigma_t, sigma_s) = match (given("sigma_t"), given("sigma_a"), given("sigma_s")) {
        (Some(t), None, None) => {
            let albedo = given("albedo").unwrap_or(Spectrum::ONE);
            (t, t * albedo)
        }
        (None, None, None) => {
            return Err(Error::new(
                "give 'sigma_t' (and 'albedo'), or 'sigma_a' and 'sigma_s'",
            ));
        }
        (None, a, s) => {
            if given("albedo").is_some() {
                return Err(Error::new(
                    "'albedo' belongs to 'sigma_t'; with 'sigma_a' and 'sigma_s' it follows from them",
                ));
            }
            let (a, s) = (a.unwrap_or_default(), s.unwrap_or_default());
            (a + s, s)
        }
        (Some(_), _, _) => {
            return Err(Error::new(
                "'sigma_t' excludes 'sigma_a' and 'sigma_s': give one pair or the other",
            ));
        }
    };
    let emission = given("emission").unwrap_or_default();
    for (name, value) in [("extinction", sigma_t), ("emission", emission)] {
        if !value.is_finite() {
            return Err(Error::new(format!("the {name} is too large for f32")));
        }
    }
    Ok(Coefficients {
        sigma_t,
        sigma_s,
        emission,
    })
}
