//! Values on the command line and how they are read.

use resolvent_scene::{Aov, nearest};
use std::ops::Range;
use std::str::FromStr;

/// `WxH`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size(pub [u32; 2]);

/// Largest width or height, as in scene files.
pub const MAX_SIZE: u32 = 65_536;

impl FromStr for Size {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (w, h) = text
            .split_once(['x', 'X', '×'])
            .ok_or("expected WIDTHxHEIGHT, such as 640x360")?;
        let side = |t: &str| match t.trim().parse::<u32>() {
            Ok(n) if (1..=MAX_SIZE).contains(&n) => Ok(n),
            _ => Err(format!("{t:?} is no number of pixels from 1 to {MAX_SIZE}")),
        };
        Ok(Self([side(w)?, side(h)?]))
    }
}

/// A layer, as in scene files.
pub fn layer(text: &str) -> Result<Aov, String> {
    Aov::parse(text).ok_or_else(|| {
        let known = Aov::NAMED.map(Aov::name);
        match nearest(text, known) {
            _ if text.starts_with("orders") => {
                let most = Aov::MOST_ORDERS;
                format!("expected orders:N with N from 0 to {most}, such as orders:4")
            }
            Some(near) => format!("there is no such layer; did you mean {near}?"),
            None => format!("expected {} or orders:N", known.join(", ")),
        }
    })
}

/// `X0,Y0,X1,Y1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window(pub [u32; 4]);

impl FromStr for Window {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected X0,Y0,X1,Y1 in pixels, such as 0,0,320,180; got {text:?}");
        let all: Vec<u32> = text
            .split(',')
            .map(|t| t.trim().parse().map_err(|_| wrong()))
            .collect::<Result<_, _>>()?;
        let [x0, y0, x1, y1] = all.try_into().map_err(|_| wrong())?;
        if x0 >= x1 || y0 >= y1 {
            return Err(format!(
                "the window {text} is empty: X1 must be greater than X0, and Y1 than Y0"
            ));
        }
        Ok(Self([x0, y0, x1, y1]))
    }
}

/// `A..B`: samples A up to, not including, B.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples(pub Range<u32>);

impl FromStr for Samples {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected A..B, such as 64..128".to_owned();
        let (a, b) = text.split_once("..").ok_or_else(wrong)?;
        let number = |t: &str| t.trim().parse::<u32>().map_err(|_| wrong());
        let range = number(a)?..number(b)?;
        if range.is_empty() {
            return Err(format!(
                "{text} holds no samples: B itself is not included, so B must be greater than A"
            ));
        }
        Ok(Self(range))
    }
}

/// Numbers with commas between them, all finite.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|t| match t.trim().parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(format!("{t:?} is no finite number")),
        })
        .collect()
}

/// One number, or three as `R,G,B`; none negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Color(pub [f64; 3]);

impl FromStr for Color {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let all = numbers(text)?;
        let color = match all[..] {
            [x] => [x; 3],
            [r, g, b] => [r, g, b],
            _ => return Err("expected one number, or three as R,G,B".into()),
        };
        if color.iter().any(|x| *x < 0.0) {
            return Err("must not be negative".into());
        }
        Ok(Self(color))
    }
}

/// A [`Color`], or `none`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaybeColor(pub Option<[f64; 3]>);

impl FromStr for MaybeColor {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self(None));
        }
        text.parse().map(|Color(c)| Self(Some(c)))
    }
}

/// A direction `X,Y,Z`, or `none`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaybeDirection(pub Option<[f64; 3]>);

impl FromStr for MaybeDirection {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self(None));
        }
        let v: [f64; 3] = numbers(text)?
            .try_into()
            .map_err(|_| "expected a direction X,Y,Z, or none")?;
        if v.iter().all(|x| *x == 0.0) {
            return Err("0,0,0 is no direction".into());
        }
        Ok(Self(Some(v)))
    }
}

/// Where a camera stands and a point in the middle of the picture: `X,Y,Z,TX,TY,TZ`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where it stands.
    pub origin: [f64; 3],
    /// What it looks at.
    pub target: [f64; 3],
}

impl FromStr for View {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let all: [f64; 6] = numbers(text)?.try_into().map_err(|_| {
            "expected six numbers: where the camera stands and what it looks at, X,Y,Z,TX,TY,TZ"
        })?;
        let [x, y, z, a, b, c] = all;
        let view = Self {
            origin: [x, y, z],
            target: [a, b, c],
        };
        if view.origin == view.target {
            return Err("the camera cannot look at the point where it stands".into());
        }
        Ok(view)
    }
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("must be a finite number greater than 0".into()),
    }
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err("must be a finite number".into()),
    }
}

/// A mean cosine, in (−1, 1).
pub fn cosine(text: &str) -> Result<f64, String> {
    finite(text)
        .ok()
        .filter(|g| g.abs() < 1.0)
        .ok_or("must be a number between -1 and 1, both excluded".into())
}

/// A share per lane, in [0, 1].
pub fn share(text: &str) -> Result<Color, String> {
    let c: Color = text.parse()?;
    if c.0.iter().any(|x| *x > 1.0) {
        return Err("must not be above 1".into());
    }
    Ok(c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!("640x360".parse(), Ok(Size([640, 360])));
        for bad in ["640", "0x3", "3x", "-1x4", "65537x1", "4x99999999999"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
    }

    #[test]
    fn windows_and_ranges() {
        assert_eq!("1,2,3,4".parse(), Ok(Window([1, 2, 3, 4])));
        assert_eq!("3..7".parse(), Ok(Samples(3..7)));
        for bad in ["1,2,1,4", "1,2,3", "1,2,3,-4", "a,b,c,d", "5,0,4,9"] {
            assert!(bad.parse::<Window>().is_err(), "{bad}");
        }
        for bad in [
            "7..3",
            "3..3",
            "3",
            "3..=4",
            "..4",
            "-1..4",
            "0..99999999999",
        ] {
            assert!(bad.parse::<Samples>().is_err(), "{bad}");
        }
    }

    #[test]
    fn colours_and_directions() {
        assert_eq!("0.5".parse(), Ok(Color([0.5; 3])));
        assert_eq!("1,2,3".parse(), Ok(Color([1.0, 2.0, 3.0])));
        for bad in ["1,2", "-1", "nan", "inf", "1,,2", ""] {
            assert!(bad.parse::<Color>().is_err(), "{bad}");
        }
        assert_eq!("none".parse(), Ok(MaybeDirection(None)));
        assert!("0,0,0".parse::<MaybeDirection>().is_err());
        assert!("0,0,1,0,0,1".parse::<View>().is_err());
        assert!(share("1.1").is_err() && share("1,0,0.5").is_ok());
        assert!(cosine("1").is_err() && cosine("-0.99").is_ok() && cosine("nan").is_err());
        assert!(positive("0").is_err() && positive("inf").is_err() && positive("2").is_ok());
    }
}
