//! Drawings of lines, marks and text, written as SVG and as PNG.

use crate::error::{Error, Result};
use embedded_graphics::mono_font::{MonoTextStyle, ascii::FONT_6X12};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};
use std::fmt::Write as _;
use std::path::Path;

/// Red, green, blue.
pub type Color = [u8; 3];

/// Where a text's place is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// At its left end.
    Start,
    /// In its middle.
    Middle,
    /// At its right end.
    End,
}

/// One thing drawn.
#[derive(Clone, Debug)]
enum Item {
    Line {
        from: [f64; 2],
        to: [f64; 2],
        width: f64,
        color: Color,
    },
    Dot {
        at: [f64; 2],
        radius: f64,
        color: Color,
    },
    Text {
        at: [f64; 2],
        text: String,
        anchor: Anchor,
        color: Color,
    },
}

/// A drawing on white.
#[derive(Clone, Debug)]
pub struct Canvas {
    size: [usize; 2],
    items: Vec<Item>,
}

impl Canvas {
    /// An empty one.
    pub fn new(size: [usize; 2]) -> Self {
        Self {
            size,
            items: Vec::new(),
        }
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, color: Color) {
        self.items.push(Item::Line {
            from,
            to,
            width,
            color,
        });
    }

    /// A line of dashes of 5 pixels.
    pub fn dashed(&mut self, from: [f64; 2], to: [f64; 2], width: f64, color: Color) {
        let d = [to[0] - from[0], to[1] - from[1]];
        let n = (d[0].hypot(d[1]) / 10.0).ceil().max(1.0);
        let at = |t: f64| [from[0] + d[0] * t, from[1] + d[1] * t];
        for k in 0..n as usize {
            let t = k as f64 / n;
            self.line(at(t), at(t + 0.5 / n), width, color);
        }
    }

    /// A disk.
    pub fn dot(&mut self, at: [f64; 2], radius: f64, color: Color) {
        self.items.push(Item::Dot { at, radius, color });
    }

    /// ASCII text, 12 pixels high, its middle at a height.
    pub fn text(&mut self, at: [f64; 2], text: &str, anchor: Anchor, color: Color) {
        self.items.push(Item::Text {
            at,
            text: text.to_owned(),
            anchor,
            color,
        });
    }

    /// As SVG.
    pub fn svg(&self) -> String {
        let [w, h] = self.size;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" font-family=\"monospace\" font-size=\"10\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n"
        );
        let hex = |c: &Color| format!("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
        for item in &self.items {
            let _ = match item {
                Item::Line {
                    from,
                    to,
                    width,
                    color,
                } => writeln!(
                    out,
                    "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"{}\" stroke-width=\"{width}\"/>",
                    from[0],
                    from[1],
                    to[0],
                    to[1],
                    hex(color)
                ),
                Item::Dot { at, radius, color } => writeln!(
                    out,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{}\"/>",
                    at[0],
                    at[1],
                    hex(color)
                ),
                Item::Text {
                    at,
                    text,
                    anchor,
                    color,
                } => writeln!(
                    out,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{}\" fill=\"{}\">{}</text>",
                    at[0],
                    at[1] + 3.5,
                    match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    },
                    hex(color),
                    text.replace('&', "&amp;").replace('<', "&lt;")
                ),
            };
        }
        out.push_str("</svg>\n");
        out
    }

    /// Writes both forms, with their extensions added to `stem`.
    pub fn write(&self, stem: &Path) -> Result<()> {
        let svg = stem.with_extension("svg");
        std::fs::write(&svg, self.svg()).map_err(Error::io(&svg))?;
        let path = stem.with_extension("png");
        let file = std::fs::File::create(&path).map_err(Error::io(&path))?;
        let mut encoder = png::Encoder::new(
            std::io::BufWriter::new(file),
            self.size[0] as u32,
            self.size[1] as u32,
        );
        encoder.set_color(png::ColorType::Rgb);
        let failed = |e: png::EncodingError| {
            Error::invalid(format!("{}: cannot write: {e}", path.display()))
        };
        encoder
            .write_header()
            .and_then(|mut w| w.write_image_data(&self.pixels()))
            .map_err(failed)
    }

    /// Red, green and blue of every pixel.
    fn pixels(&self) -> Vec<u8> {
        let mut raster = Raster {
            size: self.size,
            data: vec![255; 3 * self.size[0] * self.size[1]],
            color: [0; 3],
        };
        for item in &self.items {
            match item {
                Item::Line {
                    from,
                    to,
                    width,
                    color,
                } => raster.stroke(*from, *to, 0.5 * width, *color),
                Item::Dot { at, radius, color } => raster.stroke(*at, *at, *radius, *color),
                Item::Text {
                    at,
                    text,
                    anchor,
                    color,
                } => raster.write(*at, text, *anchor, *color),
            }
        }
        raster.data
    }
}

struct Raster {
    size: [usize; 2],
    data: Vec<u8>,
    color: Color,
}

impl Raster {
    fn blend(&mut self, x: usize, y: usize, color: Color, cover: f64) {
        let at = 3 * (y * self.size[0] + x);
        for (old, new) in self.data[at..at + 3].iter_mut().zip(color) {
            *old = (f64::from(*old) + cover * (f64::from(new) - f64::from(*old))).round() as u8;
        }
    }

    /// What is not farther than `half` from a segment, with soft edges.
    fn stroke(&mut self, a: [f64; 2], b: [f64; 2], half: f64, color: Color) {
        let reach = half + 1.0;
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]) - reach, a[k].max(b[k]) + reach);
            let last = self.size[k] as f64 - 1.0;
            low.floor().clamp(0.0, last) as usize..=high.ceil().clamp(0.0, last) as usize
        };
        let (d, ys) = ([b[0] - a[0], b[1] - a[1]], range(1));
        let length2 = d[0] * d[0] + d[1] * d[1];
        let xs = range(0);
        for y in ys {
            for x in xs.clone() {
                let p = [x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]];
                let t = if length2 > 0.0 {
                    ((p[0] * d[0] + p[1] * d[1]) / length2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (p[0] - t * d[0]).hypot(p[1] - t * d[1]);
                let cover = (half + 0.5 - distance).clamp(0.0, 1.0).min(2.0 * half);
                if cover > 0.0 {
                    self.blend(x, y, color, cover);
                }
            }
        }
    }

    fn write(&mut self, at: [f64; 2], text: &str, anchor: Anchor, color: Color) {
        self.color = color;
        let style = TextStyleBuilder::new()
            .baseline(Baseline::Middle)
            .alignment(match anchor {
                Anchor::Start => Alignment::Left,
                Anchor::Middle => Alignment::Center,
                Anchor::End => Alignment::Right,
            })
            .build();
        let place =
            embedded_graphics::prelude::Point::new(at[0].round() as i32, at[1].round() as i32);
        let font = MonoTextStyle::new(&FONT_6X12, BinaryColor::On);
        // The raster takes every pixel, so this cannot fail.
        let _ = Text::with_text_style(text, place, font, style).draw(self);
    }
}

impl OriginDimensions for Raster {
    fn size(&self) -> Size {
        Size::new(self.size[0] as u32, self.size[1] as u32)
    }
}

impl DrawTarget for Raster {
    type Color = BinaryColor;
    type Error = std::convert::Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> std::result::Result<(), Self::Error>
    where
        I: IntoIterator<Item = Pixel<BinaryColor>>,
    {
        for Pixel(p, on) in pixels {
            let inside = p.x >= 0
                && p.y >= 0
                && (p.x as usize) < self.size[0]
                && (p.y as usize) < self.size[1];
            if inside && on.is_on() {
                self.blend(p.x as usize, p.y as usize, self.color, 1.0);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_where_it_should() {
        let mut c = Canvas::new([40, 30]);
        c.line([5.0, 10.5], [35.0, 10.5], 1.0, [255, 0, 0]);
        c.dot([20.0, 20.0], 3.0, [0, 0, 255]);
        c.text(
            [-50.0, 500.0],
            "off the canvas & <fine>",
            Anchor::Start,
            [0; 3],
        );
        let p = c.pixels();
        let at = |x: usize, y: usize| [0, 1, 2].map(|k| p[3 * (y * 40 + x) + k]);
        assert_eq!(at(20, 10), [255, 0, 0]);
        assert_eq!(at(20, 14), [255; 3]);
        assert_eq!(at(20, 19), [0, 0, 255]);
        assert!(c.svg().contains("&amp; &lt;fine>"));
    }
}
