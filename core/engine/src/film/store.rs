//! Films in checkpoints.

use super::coverage::Coverage;
use super::fixed::{MOST_SAMPLES, Squares};
use super::tile::{self, Part};
use super::{FeatureSums, Film, orders, splat};
use crate::checkpoint::sections::{Fields, Reader, Writer};
use resolvent_pathspace::nets;
use std::collections::BTreeSet;

/// Bytes of a pixel, of its features, and of its splats.
const PIXEL: usize = 64 + SQUARES;
const FEATURES: usize = 120;
const SPLATS: usize = 48 + SQUARES;
const SQUARES: usize = 72;

fn put(out: &mut Vec<u8>, values: &[i128]) {
    for v in values {
        out.extend_from_slice(&v.to_le_bytes());
    }
}

fn put_squares(out: &mut Vec<u8>, squares: &[Squares; 3]) {
    for v in squares.iter().flat_map(|s| s.0) {
        out.extend_from_slice(&v.to_le_bytes());
    }
}

fn squares(f: &mut Fields) -> Result<[Squares; 3], String> {
    let mut out = [Squares::default(); 3];
    for v in out.iter_mut().flat_map(|s| &mut s.0) {
        *v = f.u64()?;
    }
    Ok(out)
}

impl Film {
    /// Writes the film without its twin; names of sections begin with `prefix`.
    pub(crate) fn write(&self, prefix: &str, out: &mut Writer) {
        out.section(&format!("{prefix}pixels"), |out| {
            out.reserve(self.pixels.len() * PIXEL);
            for p in &self.pixels {
                put(out, &p.sum);
                put(out, &[p.alpha]);
                put_squares(out, &p.squares);
            }
        });
        if !self.features.is_empty() {
            out.section(&format!("{prefix}features"), |out| {
                for f in &self.features {
                    put(out, &[f.depth]);
                    out.extend_from_slice(&f.hits.to_le_bytes());
                    put(out, &f.albedo);
                    put(out, &f.normal);
                }
            });
        }
        out.section(&format!("{prefix}tiles"), |out| {
            for v in [self.pieces.0, self.pieces.1] {
                out.extend_from_slice(&v.to_le_bytes());
            }
            for t in &self.tiles {
                let ranges = t.coverage().ranges();
                out.extend_from_slice(&(ranges.len() as u32).to_le_bytes());
                for v in ranges.iter().flat_map(|r| [r.start, r.end]) {
                    out.extend_from_slice(&v.to_le_bytes());
                }
                put(out, &t.splats);
                put_squares(out, &t.squares);
            }
        });
        out.section(&format!("{prefix}parts"), |out| {
            for ((tile, net), part) in &self.parts {
                for v in [*tile as u32, *net, part.samples] {
                    out.extend_from_slice(&v.to_le_bytes());
                }
                put(out, &part.splats);
                part.pixels.iter().for_each(|p| put(out, p));
            }
        });
        if let Some(orders) = &self.orders {
            out.section(&format!("{prefix}orders"), |out| {
                orders.sums().for_each(|s| put(out, s));
            });
        }
        if let Some(splats) = &self.splats {
            out.section(&format!("{prefix}splats"), |out| {
                for (sum, squares) in splats.sum.iter().zip(&splats.squares) {
                    put(out, sum);
                    put_squares(out, squares);
                }
            });
        }
    }

    /// Reads a film that [`Film::write`] wrote.
    ///
    /// # Errors
    /// If the sections are not those of a film of this window; what they say about each other is checked.
    pub(crate) fn read(
        prefix: &str,
        window: [u32; 4],
        features: bool,
        from: &mut Reader,
    ) -> Result<Self, String> {
        let count = (u64::from(window[2] - window[0]) * u64::from(window[3] - window[1])) as usize;
        // Sizes are checked before memory is asked for: it is never more than the file has.
        let mut pixels = from.take(&format!("{prefix}pixels"), Some(count * PIXEL))?;
        let mut film = Self::new(window, features);
        for p in &mut film.pixels {
            p.sum = pixels.three()?;
            p.alpha = pixels.i128()?;
            p.squares = squares(&mut pixels)?;
        }
        if features {
            let mut f = from.take(&format!("{prefix}features"), Some(count * FEATURES))?;
            for g in &mut film.features {
                *g = FeatureSums {
                    depth: f.i128()?,
                    hits: f.u64()?,
                    albedo: f.three()?,
                    normal: f.three()?,
                };
            }
        }
        film.read_tiles(from.take(&format!("{prefix}tiles"), None)?)?;
        film.read_parts(from.take(&format!("{prefix}parts"), None)?)?;
        let orders = format!("{prefix}orders");
        if from.has(&orders) {
            let f = from.take(&orders, None)?;
            film.orders = Some(orders::Orders::read(f, count)?);
        }
        let splats = format!("{prefix}splats");
        if from.has(&splats) {
            let mut f = from.take(&splats, Some(count * SPLATS))?;
            let mut sums = splat::Sums::new(count);
            for (sum, of) in sums.sum.iter_mut().zip(&mut sums.squares) {
                *sum = f.three()?;
                *of = squares(&mut f)?;
            }
            film.splats = Some(sums);
        }
        Ok(film)
    }

    fn read_tiles(&mut self, mut f: Fields) -> Result<(), String> {
        self.pieces = (f.u64()?, f.u64()?);
        let mut samples = 0;
        for (i, t) in self.tiles.iter_mut().enumerate() {
            let mut coverage = Coverage::default();
            for _ in 0..f.u32()? {
                let (begin, end) = (f.u32()?, f.u32()?);
                // As they are written: rising, with gaps between them.
                if end > MOST_SAMPLES || !coverage.push(begin..end) {
                    return Err(format!("tile {i} cannot have samples {begin}..{end}"));
                }
            }
            t.set(coverage);
            t.splats = f.three()?;
            t.squares = squares(&mut f)?;
            samples += u64::from(t.samples()) * tile::rect(self.window, i).pixels() as u64;
        }
        if samples != self.pieces.1 || self.pieces.0 > samples {
            return Err("its numbers of samples do not agree".into());
        }
        f.end()
    }

    fn read_parts(&mut self, mut f: Fields) -> Result<(), String> {
        let mut wanted = BTreeSet::new();
        for (i, t) in self.tiles.iter().enumerate() {
            let mut last = None;
            for r in t.coverage().ranges() {
                for net in [r.start, r.end - 1].map(nets::around) {
                    // A net is looked at once, however many ranges cut it.
                    if last.replace(net.start) != Some(net.start)
                        && !t.coverage().missing(net.clone()).is_empty()
                    {
                        wanted.insert((i, net.start));
                    }
                }
            }
        }
        while !f.is_empty() {
            let (tile, net, samples) = (f.u32()? as usize, f.u32()?, f.u32()?);
            let covered = |c: &Coverage| {
                let missing = c.missing(nets::around(net));
                nets::around(net).len() as u32 - missing.iter().map(|r| r.len() as u32).sum::<u32>()
            };
            if !wanted.remove(&(tile, net)) || covered(self.tiles[tile].coverage()) != samples {
                return Err(format!(
                    "tile {tile} cannot have a part of the net from sample {net}"
                ));
            }
            let splats = f.three()?;
            let pixels = (0..tile::rect(self.window, tile).pixels())
                .map(|_| f.three())
                .collect::<Result<_, _>>()?;
            let part = Part {
                samples,
                pixels,
                splats,
            };
            self.parts.insert((tile, net), part);
        }
        match wanted.first() {
            None => Ok(()),
            Some((tile, net)) => Err(format!(
                "tile {tile} misses its part of the net from sample {net}"
            )),
        }
    }
}
