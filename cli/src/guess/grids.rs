//! Which grid is what.

use super::Notes;
use crate::args::Guesses;
use crate::failure::{Outcome, input};
use crate::volume;
use resolvent_vdb::{File, GridClass, GridInfo};

/// Names of densities, the most telling first.
const DENSITY: &[&str] = &[
    "density", "dens", "smoke", "cloud", "clouds", "fog", "volume",
];
/// Names of temperatures.
const TEMPERATURE: &[&str] = &["temperature", "temp", "heat"];
/// Names of fire.
const FLAME: &[&str] = &["flame", "flames", "fire", "emission"];

/// The grid of densities: the one asked for; else one with such a name; else the first fog volume; else the first grid of
/// numbers.
pub fn density<'f>(file: &'f File, g: &Guesses, notes: &mut Notes) -> Outcome<&'f GridInfo> {
    if let Some(name) = &g.grid {
        let info = file.grid(name).map_err(input)?;
        return usable(file, info).map(|()| info);
    }
    let candidates: Vec<&GridInfo> = file
        .grids()
        .iter()
        .filter(|i| usable(file, i).is_ok())
        .collect();
    let (info, why) = if let Some(i) = named(&candidates, DENSITY) {
        (i, "named like a density")
    } else if let Some(i) = candidates.iter().find(|i| i.class == GridClass::FogVolume) {
        (*i, "the first fog volume")
    } else if let Some(i) = candidates.iter().find(|i| {
        let one = [**i];
        named(&one, TEMPERATURE).is_none() && named(&one, FLAME).is_none()
    }) {
        (*i, "the first grid of numbers")
    } else {
        return Err(input(none(file)));
    };
    notes.add("--grid", &info.unique_name, why);
    Ok(info)
}

/// Why no grid was chosen.
fn none(file: &File) -> String {
    let path = file.path().display();
    match file.grids() {
        [] => match file.damage() {
            Some(damage) => damage.to_string(),
            None => format!("{path}: has no grids"),
        },
        // The reason, if there is but one grid to have one.
        [one] => match usable(file, one) {
            Err(why) => why.message,
            Ok(()) => format!(
                "{path}: the grid {} does not look like a density; --grid takes it for one",
                one.summary()
            ),
        },
        all => {
            let list: Vec<_> = all.iter().map(GridInfo::summary).collect();
            format!(
                "{path}: no grid looks like a density; --grid chooses one of: {}",
                list.join(", ")
            )
        }
    }
}

fn usable(file: &File, info: &GridInfo) -> Outcome<()> {
    if let Some(refusal) = &info.refusal {
        return Err(input(refusal));
    }
    let wrong = |why: &str| {
        Err(input(format!(
            "{}: grid '{}': {why}",
            file.path().display(),
            info.unique_name.escape_debug()
        )))
    };
    if info.class == GridClass::LevelSet {
        return wrong("is a level set, whose values are distances, not densities");
    }
    if !volume::is_scalar(info) {
        return wrong("does not hold one number per voxel, so it is no density");
    }
    Ok(())
}

/// The grid with the first of these names, whatever its case.
fn named<'f>(candidates: &[&'f GridInfo], names: &[&str]) -> Option<&'f GridInfo> {
    names.iter().find_map(|name| {
        candidates
            .iter()
            .find(|i| i.name.eq_ignore_ascii_case(name))
            .copied()
    })
}

/// A grid that glows, by option or by name; `None` also if the option is `none`.
fn glowing<'f>(
    file: &'f File,
    asked: Option<&str>,
    names: &[&str],
) -> Outcome<Option<(&'f GridInfo, bool)>> {
    if let Some(name) = asked {
        if name == "none" {
            return Ok(None);
        }
        return Ok(Some((file.grid(name).map_err(input)?, false)));
    }
    let candidates: Vec<&GridInfo> = file
        .grids()
        .iter()
        .filter(|i| i.refusal.is_none() && volume::is_scalar(i))
        .filter(|i| i.class != GridClass::LevelSet)
        .collect();
    Ok(named(&candidates, names).map(|i| (i, true)))
}

/// The grid of temperatures, and whether it was guessed.
pub fn temperature<'f>(file: &'f File, g: &Guesses) -> Outcome<Option<(&'f GridInfo, bool)>> {
    glowing(file, g.temperature_grid.as_deref(), TEMPERATURE)
}

/// The grid of emission, and whether it was guessed.
pub fn flame<'f>(file: &'f File, g: &Guesses) -> Outcome<Option<(&'f GridInfo, bool)>> {
    glowing(file, g.flame_grid.as_deref(), FLAME)
}
