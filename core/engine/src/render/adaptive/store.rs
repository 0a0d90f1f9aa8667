//! Adaptive renders in checkpoints.

use super::{Adaptive, FIRST, after};
use crate::checkpoint::sections::{Fields, Reader, Writer};
use crate::film::{Film, Rect};
use resolvent_pathspace::nets;
use std::collections::BTreeMap;

/// More rounds than any render has.
const MOST_ROUNDS: u32 = 1 << 24;

/// Where the sections of a probe begin.
fn prefix(tile: usize, second: bool) -> String {
    format!("{tile}.{}/", u8::from(second))
}

impl Adaptive {
    pub(crate) fn write(&self, out: &mut Writer) {
        out.section("adaptive", |out| {
            out.extend_from_slice(&self.goal.to_bits().to_le_bytes());
            out.extend_from_slice(&self.round.to_le_bytes());
            out.extend_from_slice(&u32::from(self.floors.is_some()).to_le_bytes());
            for f in self.floors.unwrap_or_default() {
                out.extend_from_slice(&f.to_bits().to_le_bytes());
            }
            for count in self.counts.iter().flatten() {
                out.extend_from_slice(&count.unwrap_or(0).to_le_bytes());
            }
            for (tile, second) in self.probes.keys() {
                for v in [*tile as u32, u32::from(*second)] {
                    out.extend_from_slice(&v.to_le_bytes());
                }
            }
        });
        for ((tile, second), probe) in &self.probes {
            probe.write(&prefix(*tile, *second), out);
        }
    }

    /// Reads what [`Adaptive::write`] wrote for `film`.
    pub(crate) fn read(film: &Film, from: &mut Reader) -> Result<Self, String> {
        let mut f: Fields = from.take("adaptive", None)?;
        let goal = f64::from_bits(f.u64()?);
        let (round, has_floors) = (f.u32()?, f.u32()? == 1);
        let floors = [f64::from_bits(f.u64()?), f64::from_bits(f.u64()?)];
        if !(goal > 0.0) || round > MOST_ROUNDS || has_floors != (round >= FIRST) {
            return Err("is damaged: its progress does not agree with itself".into());
        }
        let rects: Vec<Rect> = film.tiles().collect();
        let mut count = || match f.u32()? {
            0 => Ok(None),
            n if has_floors && n >= after(FIRST) && n.is_multiple_of(nets::SMALLEST) => Ok(Some(n)),
            n => Err(format!("is damaged: half a tile cannot need {n} samples")),
        };
        let counts =
            (rects.iter().map(|_| Ok([count()?, count()?]))).collect::<Result<Vec<_>, String>>()?;
        let mut probes = BTreeMap::new();
        while !f.is_empty() {
            let (tile, second) = (f.u32()? as usize, f.u32()? == 1);
            let Some(Rect { min, max }) = rects.get(tile) else {
                return Err(format!("is damaged: there is no tile {tile}"));
            };
            let window = [min[0], min[1], max[0], max[1]];
            let probe = Film::read(&prefix(tile, second), window, false, from)?;
            if probe.orders() > 0 || probe.has_splats() {
                return Err(format!(
                    "is damaged: tile {tile} has layers beside the picture"
                ));
            }
            probes.insert((tile, second), probe);
        }
        let out = Self {
            goal,
            round,
            counts,
            floors: has_floors.then_some(floors),
            probes,
        };
        for tile in 0..rects.len() {
            for (half, second) in [false, true].into_iter().enumerate() {
                if out.probes.contains_key(&(tile, second)) != out.has_probe(tile, half) {
                    return Err(format!("is damaged: tile {tile} is decided in part"));
                }
            }
        }
        Ok(out)
    }
}
