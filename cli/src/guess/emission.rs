//! What glows: temperatures as black bodies, flames in the colour of fire.

use super::{Notes, grids};
use crate::args::Guesses;
use crate::failure::{Outcome, input};
use crate::info::short;
use crate::volume::{self, Measures};
use resolvent_scene::Value;
use resolvent_vdb::File;

/// Radiance of the brightest fire through a tenth of the volume: brighter than anything the guessed sun lights.
const RADIANCE: f64 = 20.0;
/// Temperature of the hottest voxel where the grid's values cannot be kelvin.
const HOTTEST: f64 = 2000.0;
/// Largest value of a grid that is not in kelvin: simulations normalise to 1 or some tens.
const NOT_KELVIN: f64 = 400.0;
/// Below, nothing glows visibly.
const DARK: f64 = 750.0;
/// Linear colour of a flame, about that of a black body of 2000 K.
const FIRE: [f64; 3] = [1.0, 0.36, 0.05];

/// Parameters of the medium, by name.
type Params = Vec<(&'static str, Value)>;

/// What glows, as parameters of the medium; empty if nothing does. A flame is preferred to a temperature, since smoke can be
/// hot without burning.
pub fn find(file: &File, g: &Guesses, density: &Measures, notes: &mut Notes) -> Outcome<Params> {
    let mut params = Params::new();
    let [lo, hi] = density.bounds;
    let depth = 0.1 * (0..3).map(|a| (hi[a] - lo[a]).powi(2)).sum::<f64>().sqrt();
    let factor = g.emission_scale.unwrap_or(1.0);
    let flame = grids::flame(file, g)?;
    if let Some((info, guessed)) = flame
        && let Some(m) = volume::measure(file, info).map_err(input)?
    {
        if guessed {
            let why = "glows like fire, or none; --emission-scale makes it brighter or dimmer";
            notes.add("--flame-grid", &info.unique_name, why);
        }
        let emission = FIRE.map(|c| c * factor * RADIANCE / depth);
        params.push(("emission_grid", info.unique_name.as_str().into()));
        params.push(("emission_grid_scale", (1.0 / m.max).into()));
        params.push(("emission", emission.into()));
    }
    let temperature = grids::temperature(file, g)?;
    if let Some((info, guessed)) = temperature
        && (!guessed || flame.is_none())
        && let Some(m) = volume::measure(file, info).map_err(input)?
    {
        let scale = if m.max < NOT_KELVIN {
            HOTTEST / m.max
        } else {
            1.0
        };
        let hottest = scale * m.max;
        if hottest < DARK {
            return Ok(params);
        }
        if guessed {
            let why = format!(
                "glows as a black body, {} K at the hottest, or none; --emission-scale makes it brighter or dimmer",
                short(hottest)
            );
            notes.add("--temperature-grid", &info.unique_name, why);
        }
        let emission = factor * RADIANCE / (depth * red(hottest));
        params.push(("temperature_grid", info.unique_name.as_str().into()));
        params.push(("temperature_scale", scale.into()));
        params.push(("emission_scale", emission.into()));
    }
    Ok(params)
}

/// About the red radiance of a black body, W·sr⁻¹·m⁻²: Planck's law at 600 nm over a band of 100 nm.
fn red(kelvin: f64) -> f64 {
    let (c1, c2, l) = (1.191_042_972e-16, 1.438_776_877e-2, 600e-9_f64);
    100e-9 * c1 / (l.powi(5) * (c2 / (l * kelvin)).exp_m1())
}
