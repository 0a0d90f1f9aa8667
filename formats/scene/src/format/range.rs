//! Ranges of numbers.

/// The largest coordinate, in scene units: its square is still an f32.
pub(crate) const FAR: f64 = 1e18;

/// The largest radiometric value.
const BRIGHT: f64 = 1e30;

/// A range of numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    pub min: f64,
    pub max: f64,
    pub min_excluded: bool,
    pub max_excluded: bool,
}

impl Range {
    pub(super) const fn closed(min: f64, max: f64) -> Range {
        Range {
            min,
            max,
            min_excluded: false,
            max_excluded: false,
        }
    }

    pub(super) const fn above(min: f64, max: f64) -> Range {
        Range {
            min,
            max,
            min_excluded: true,
            max_excluded: false,
        }
    }

    pub(super) const fn open(min: f64, max: f64) -> Range {
        Range {
            min,
            max,
            min_excluded: true,
            max_excluded: true,
        }
    }

    pub fn contains(&self, x: f64) -> bool {
        (x > self.min || (x == self.min && !self.min_excluded))
            && (x < self.max || (x == self.max && !self.max_excluded))
    }
}

/// Words for a range: "in [0, 1)", "≥ 0", "> 0".
impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let left = if self.min_excluded { '(' } else { '[' };
        let right = if self.max_excluded { ')' } else { ']' };
        match (self.min.is_finite(), self.max.is_finite()) {
            (true, true) => write!(
                f,
                "in {left}{}, {}{right}",
                short(self.min),
                short(self.max)
            ),
            (true, false) => write!(
                f,
                "{} {}",
                if self.min_excluded { '>' } else { '≥' },
                short(self.min)
            ),
            (false, true) => write!(
                f,
                "{} {}",
                if self.max_excluded { '<' } else { '≤' },
                short(self.max)
            ),
            (false, false) => f.write_str("that is finite"),
        }
    }
}

/// Numbers as one would write them: 1e18, not 1000000000000000000.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-4..1e7).contains(&x.abs()) {
        format!("{x:e}")
    } else {
        format!("{x}")
    }
}

/// The range of every coordinate.
pub(crate) const COORDINATE: Range = Range::closed(-FAR, FAR);

/// The range of albedos.
pub(crate) const SHARE: Range = Range::closed(0.0, 1.0);

/// The range of every radiometric value.
pub(crate) const POWER: Range = Range::closed(0.0, BRIGHT);
