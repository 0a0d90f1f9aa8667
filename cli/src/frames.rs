//! Sequences of frames: which ones, and what their files are called.

use std::path::{Path, PathBuf};
use std::str::FromStr;

/// More frames than any shot has.
const MOST: f64 = 1e6;

/// `A-B` or `A-B:STEP`.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    first: f64,
    last: f64,
    step: f64,
}

impl FromStr for Frames {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("{text:?} is not of the form FIRST-LAST or FIRST-LAST:STEP, such as 1-100:2")
        };
        let number = |t: &str| {
            let plain = t.bytes().all(|b| b.is_ascii_digit() || b"-.".contains(&b));
            let value = t.parse::<f64>().ok().filter(|x| plain && x.is_finite());
            value.ok_or_else(wrong)
        };
        let (range, step) = text.split_once(':').unwrap_or((text, "1"));
        // The first number may have a sign of its own.
        let dash = range.bytes().skip(1).position(|b| b == b'-');
        let (first, last) = range.split_at(dash.ok_or_else(wrong)? + 1);
        let frames = Self {
            first: number(first)?,
            last: number(&last[1..])?,
            step: number(step)?,
        };
        if frames.step <= 0.0 || frames.last < frames.first {
            return Err(format!("{text:?} has no frames"));
        }
        if (frames.last - frames.first) / frames.step > MOST {
            return Err(format!("{text:?} has more than a million frames"));
        }
        Ok(frames)
    }
}

impl std::fmt::Display for Frames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", plain(self.first), plain(self.last))?;
        match self.step {
            1.0 => Ok(()),
            step => write!(f, ":{}", plain(step)),
        }
    }
}

impl Frames {
    /// Time codes of all frames.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        let Self { first, last, step } = *self;
        let count = ((last - first) / step + 1e-9) as u32;
        (0..=count).map(move |i| first + f64::from(i) * step)
    }

    /// What is left from this frame on.
    pub fn from(&self, first: f64) -> Self {
        Self {
            first,
            ..self.clone()
        }
    }
}

/// The file of a frame: `####` in its name is the number, with as many digits at least; without any #, `.0001` goes before the suffix.
pub fn file(pattern: &Path, frame: f64) -> PathBuf {
    let name = pattern.file_name().unwrap_or_default().to_string_lossy();
    let name = match (name.contains('#'), name.rsplit_once('.')) {
        (true, _) => name.into_owned(),
        (false, Some((stem, suffix))) if !stem.is_empty() => format!("{stem}.####.{suffix}"),
        (false, _) => format!("{name}.####"),
    };
    let start = name.find('#').unwrap_or(name.len());
    let digits = name[start..].bytes().take_while(|b| *b == b'#').count();
    let number = plain(frame);
    let (whole, part) = number.split_at(number.find('.').unwrap_or(number.len()));
    let (sign, whole) = match whole.strip_prefix('-') {
        Some(whole) => ("-", whole),
        None => ("", whole),
    };
    let width = digits - sign.len().min(digits);
    let (before, after) = (&name[..start], &name[start + digits..]);
    pattern.with_file_name(format!("{before}{sign}{whole:0>width$}{part}{after}"))
}

/// A frame's number without what arithmetic made up.
pub fn plain(frame: f64) -> String {
    // Adding zero turns −0 into 0.
    ((frame * 1e6).round() / 1e6 + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::{Frames, file};
    use std::path::Path;

    fn times(text: &str) -> Vec<f64> {
        text.parse::<Frames>().unwrap().times().collect()
    }

    #[test]
    fn frames() {
        assert_eq!(times("1-7:2"), [1.0, 3.0, 5.0, 7.0]);
        assert_eq!(times("1-4:2"), [1.0, 3.0]);
        assert_eq!(times("-2--1"), [-2.0, -1.0]);
        assert_eq!(times("-1-1"), [-1.0, 0.0, 1.0]);
        assert_eq!(times("0-0.3:0.1").len(), 4);
        for wrong in [
            "", "-", "5", "5-", "-5", "5-1", "1-2:0", "1-2:-1", "a-b", "1-2:3:4", "1-inf", "0-1e9",
            "0-9:1e-9",
        ] {
            assert!(wrong.parse::<Frames>().is_err(), "{wrong}");
        }
        assert!("0-2000000".parse::<Frames>().is_err());
        let rest = "1-100:2".parse::<Frames>().unwrap().from(7.0);
        assert_eq!(rest.to_string(), "7-100:2");
        assert_eq!("1-5".parse::<Frames>().unwrap().to_string(), "1-5");
    }

    #[test]
    fn names() {
        for (pattern, frame, name) in [
            ("a/shot.####.exr", 12.0, "a/shot.0012.exr"),
            ("shot.exr", 3.0, "shot.0003.exr"),
            ("s##_##.png", 123.0, "s123_##.png"),
            ("shot.####.exr", -5.0, "shot.-005.exr"),
            ("shot.####.exr", 2.5, "shot.0002.5.exr"),
            ("shot.#.exr", 0.1 + 0.2, "shot.0.3.exr"),
            ("ball", 1.0, "ball.0001"),
            ("shot.####.exr", 1_000_000.0, "shot.1000000.exr"),
        ] {
            assert_eq!(file(Path::new(pattern), frame), Path::new(name));
        }
    }
}
