//! Phase function `tabulated`: measured or computed values over the scattering angle, grey or RGB.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `file` | file | | | | text file with the table |
//! | `at` | numbers | | | | the table's angles, instead of a file |
//! | `values` | numbers | any | | ≥ 0 | its values: one for each angle, or three (red, green, blue) |
//! | `abscissa` | `cosine`, `degrees` | | `cosine` | | what angles are given as: cos θ from −1 to 1, or θ from 0 to 180 |
//!
//! θ is the scattering angle: 0, cosine 1, is straight on. A file has one angle a line, followed by one value or three, separated
//! by blanks, tabs or commas; `#` starts a comment. Angles rise or fall strictly and reach from one end to the other. Between
//! them the function is linear in cos θ, also if they are given in degrees, so that it can be normalised and sampled exactly:
//! give narrow peaks as many angles as they need. Every channel is normalised by itself; values may have any unit.
//!
//! Directions are sampled from the mean of the channels by inverting its distribution function piece by piece, where it is a
//! quadratic: a grey table never changes the throughput, an RGB table by a factor of 3 at most. [`parse`] reads tables, [`table`]
//! evaluates and samples them.
//!
//! ```json
//! "phase": { "plugin": "tabulated", "params": { "file": "droplet_10um.txt", "abscissa": "degrees" } }
//! ```
//! ```json
//! "phase": { "plugin": "tabulated", "params": { "at": [-1, 0, 1], "values": [0.2, 0.1, 1] } }
//! ```

pub mod parse;
pub mod table;

#[cfg(test)]
mod tests;

use parse::Abscissa;
use resolvent_api::math::Frame;
use resolvent_api::math::hg::Angle;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Decl, Error, Mode, ParamDecl, Params, PhaseFunction, Plugin, Scatter, ScatterDraws,
    ScatterEval, ScatterSample, Vec3,
};
use std::fs::File;
use std::io::Read;
use table::Table;

/// The plugin.
#[derive(Clone, Debug)]
pub struct Tabulated {
    table: Table,
}

/// Its closure: the function is the same everywhere, and too large for a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Tabled<'a>(&'a Table);

impl Plugin for Tabulated {
    const NAME: &'static str = "tabulated";
    const SUMMARY: &'static str =
        "A table of values over the scattering angle, from a text file or inline, grey or RGB.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::file(
            "file",
            "text file: a line has an angle and one value or three",
        )
        .build(),
        Decl::numbers("at", "angles of an inline table").build(),
        Decl::numbers(
            "values",
            "values of an inline table: one for each angle, or three",
        )
        .at_least(0.0)
        .build(),
        Decl::choice(
            "abscissa",
            "cosine|degrees",
            "angles are cos θ from -1 to 1, or θ from 0 (straight on) to 180",
        )
        .default("\"cosine\"")
        .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let abscissa = match params.text("abscissa").as_deref() {
            Some("degrees") => Abscissa::Degrees,
            _ => Abscissa::Cosine,
        };
        let given = (
            params.text("file"),
            params.numbers("at"),
            params.numbers("values"),
        );
        let rows = match given {
            (Some(file), None, None) => {
                let text =
                    read(&file).map_err(|e| Error::new(format!("cannot read '{file}': {e}")))?;
                parse::text(&text, abscissa)
                    .map_err(|fault| Error::new(format!("'{file}', {fault}")))?
            }
            (None, Some(at), Some(values)) => parse::inline(at, values, abscissa)?,
            _ => {
                return Err(Error::new(
                    "a table is given by 'file', or else by 'at' and 'values' together",
                ));
            }
        };
        Ok(Self {
            table: Table::new(&rows)?,
        })
    }
}

impl PhaseFunction for Tabulated {
    type Closure<'a> = Tabled<'a>;

    fn closure(&self, _: &MediumPoint) -> Tabled<'_> {
        Tabled(&self.table)
    }
}

impl Scatter for Tabled<'_> {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        // Exact near both poles, where 1 ± wo·wi would have lost its digits.
        let (f, p) = self.0.value(Angle {
            one_minus_cos: 0.5 * (wo + wi).length_squared(),
            one_plus_cos: 0.5 * (wo - wi).length_squared(),
        });
        ScatterEval {
            f,
            forward: p,
            reverse: p,
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let (angle, f, p) = self.0.sample(u.dir[0])?;
        Some(ScatterSample {
            weight: f.map(|f| f / p),
            wi: angle.direction(Frame::around(-wo), u.dir[1]).into(),
            eta: 1.0,
            forward: p,
            reverse: p,
            measure: Measure::SolidAngle as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
}

/// Largest file that is read, bytes.
const MAX_FILE: u64 = 64 << 20;

fn read(file: &str) -> std::io::Result<String> {
    let mut text = String::new();
    File::open(file)?
        .take(MAX_FILE + 1)
        .read_to_string(&mut text)?;
    if text.len() as u64 > MAX_FILE {
        return Err(std::io::Error::other("has more than 64 MiB"));
    }
    Ok(text)
}

resolvent_api::export_plugin!(phase, Tabulated);
