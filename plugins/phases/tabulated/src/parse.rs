//! From text or numbers to a checked list of angles and values.

use core::fmt;
use resolvent_api::Error;

/// What the table's angles are given as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abscissa {
    /// cos θ, −1 to 1.
    Cosine,
    /// θ in degrees, 0 to 180.
    Degrees,
}

/// One angle of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// 1 − cos θ, 0 to 2.
    pub one_minus_cos: f64,
    /// Value in red, green and blue, of any unit.
    pub value: [f64; 3],
}

/// What is wrong with a table, and in which line.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// From 1; 0 if the whole table is meant.
    pub line: usize,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        f.write_str(&self.what)
    }
}

/// The rows of a text, sorted from straight on to straight back.
///
/// # Errors
/// With the line: what is no number, rows of unequal length, values below 0, angles out of range or order.
pub fn text(text: &str, abscissa: Abscissa) -> Result<Vec<Row>, Fault> {
    let mut rows = Rows::new(abscissa);
    let mut width = 0;
    for (i, line) in text.lines().enumerate() {
        let fault = |what| Fault { line: i + 1, what };
        let content = line.split('#').next().unwrap_or_default();
        let mut numbers = [0.0; 4];
        let mut count = 0;
        for word in content
            .split(|c: char| c == ',' || c.is_whitespace())
            .filter(|w| !w.is_empty())
        {
            let number: f64 = word
                .parse()
                .map_err(|_| fault(format!("'{}' is no number", shortened(word))))?;
            *numbers
                .get_mut(count)
                .ok_or_else(|| fault("more than an angle and three values".into()))? = number;
            count += 1;
        }
        match count {
            0 => continue,
            2 | 4 if width == 0 || width == count => width = count,
            2 | 4 => {
                return Err(fault(format!(
                    "{} numbers, but the lines before have {width}",
                    count
                )));
            }
            _ => {
                return Err(fault(format!(
                    "an angle and one value or three are expected, not {count} numbers"
                )));
            }
        }
        let [angle, r, g, b] = numbers;
        let value = if count == 2 { [r; 3] } else { [r, g, b] };
        rows.push(angle, value).map_err(fault)?;
    }
    rows.finish().map_err(|what| Fault { line: 0, what })
}

/// The rows of inline numbers.
///
/// # Errors
/// As [`text`], with the index of the angle.
pub fn inline(at: &[f64], values: &[f64], abscissa: Abscissa) -> Result<Vec<Row>, Error> {
    let mut rows = Rows::new(abscissa);
    let width = if values.len() == at.len() {
        1
    } else if values.len() == 3 * at.len() {
        3
    } else {
        return Err(Error::new(format!(
            "'values' has {} numbers for the {} of 'at': one for each is expected, or three",
            values.len(),
            at.len()
        )));
    };
    for (i, (&angle, value)) in at.iter().zip(values.chunks_exact(width)).enumerate() {
        let value = [value[0], value[width / 2], value[width - 1]];
        rows.push(angle, value)
            .map_err(|what| Error::new(format!("'at' [{i}]: {what}")))?;
    }
    rows.finish().map_err(Error)
}

/// A word of a foreign file as it may stand in a message.
fn shortened(word: &str) -> String {
    let mut out: String = word.chars().take(24).collect();
    if out.len() < word.len() {
        out.push('…');
    }
    out
}

/// Collects rows and checks them.
struct Rows {
    abscissa: Abscissa,
    rows: Vec<Row>,
    last: f64,
}

impl Rows {
    fn new(abscissa: Abscissa) -> Self {
        Self {
            abscissa,
            rows: Vec::new(),
            last: f64::NAN,
        }
    }

    fn push(&mut self, angle: f64, value: [f64; 3]) -> Result<(), String> {
        let (low, high) = match self.abscissa {
            Abscissa::Cosine => (-1.0, 1.0),
            Abscissa::Degrees => (0.0, 180.0),
        };
        if !(low..=high).contains(&angle) {
            return Err(format!(
                "the angle {angle} is outside of {low} to {high} (see 'abscissa')"
            ));
        }
        if let Some(bad) = value.iter().find(|v| !(0.0..f64::INFINITY).contains(*v)) {
            return Err(format!("the value {bad} is not finite and at least 0"));
        }
        let one_minus_cos = match self.abscissa {
            Abscissa::Cosine => 1.0 - angle,
            // Twice the squared sine of the half angle, which has all digits at both ends.
            Abscissa::Degrees if angle == 180.0 => 2.0,
            Abscissa::Degrees => 2.0 * (0.5 * angle.to_radians()).sin().powi(2),
        };
        // The first step decides whether angles rise or fall.
        let step = |a: f64, b: f64| (b - a).signum();
        let in_order = match self.rows.as_slice() {
            [] => true,
            [first] => one_minus_cos != first.one_minus_cos,
            [a, b, ..] => {
                let last = self.rows[self.rows.len() - 1].one_minus_cos;
                one_minus_cos != last
                    && step(a.one_minus_cos, b.one_minus_cos) == step(last, one_minus_cos)
            }
        };
        if !in_order {
            return Err(format!(
                "angles must rise or fall strictly, and {angle} follows {}",
                self.last
            ));
        }
        self.last = angle;
        self.rows.push(Row {
            one_minus_cos,
            value,
        });
        Ok(())
    }

    fn finish(mut self) -> Result<Vec<Row>, String> {
        let ends = [self.rows.first(), self.rows.last()].map(|r| r.map(|r| r.one_minus_cos));
        match ends {
            [Some(2.0), Some(0.0)] => self.rows.reverse(),
            [Some(0.0), Some(2.0)] => {}
            _ => {
                let range = match self.abscissa {
                    Abscissa::Cosine => "cosine -1 to 1",
                    Abscissa::Degrees => "0 to 180 degrees",
                };
                return Err(format!(
                    "a table of {} angles that must reach from {range} but does not",
                    self.rows.len()
                ));
            }
        }
        Ok(self.rows)
    }
}
