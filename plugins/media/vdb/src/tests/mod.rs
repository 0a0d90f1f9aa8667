//! Tests of the medium.

mod bench;
mod conformance;
mod corpus;
mod emission;
mod file;
mod index;
mod loading;
mod stress;

use crate::build::{build, build_from};
use crate::load::Services;
use crate::settings::Settings;
use file::Voxels;
use resolvent_api::{FlightDraws, Medium, Segment, Spectrum, rng::Stream};
use resolvent_vdb::{File, Serial};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// A medium of settings; warnings fail the test.
pub fn medium(settings: &Settings) -> Box<dyn Medium> {
    let services = Services {
        parallel: &Serial,
        warn: &|w| panic!("unexpected warning: {w}"),
    };
    build(settings, services).unwrap_or_else(|e| panic!("{e}"))
}

/// A medium of voxels, its warnings or its error.
pub fn made(
    voxels: &Voxels,
    change: impl FnOnce(&mut Settings),
) -> Result<(Box<dyn Medium>, Vec<String>), String> {
    let mut settings = Settings::new("voxels.vdb", "density");
    change(&mut settings);
    let file = File::from_bytes("voxels.vdb", voxels.bytes()).map_err(|e| e.to_string())?;
    let warnings = Mutex::new(Vec::new());
    let medium = {
        let warn = |w: &str| warnings.lock().unwrap().push(w.to_owned());
        let services = Services {
            parallel: &Serial,
            warn: &warn,
        };
        build_from(&settings, &file, services).map_err(|e| e.0)?
    };
    Ok((medium, warnings.into_inner().unwrap()))
}

/// A medium of voxels that gives no cause for warnings.
pub fn of(voxels: &Voxels, change: impl FnOnce(&mut Settings)) -> Box<dyn Medium> {
    let (medium, warnings) = made(voxels, change).unwrap_or_else(|e| panic!("{e}"));
    assert!(warnings.is_empty(), "{warnings:?}");
    medium
}

/// A file of the reader's test data.
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../formats/vdb/tests/data")
        .join(name)
}

/// Draws of one flight.
pub fn draws(stream: &mut Stream) -> FlightDraws {
    let [tau, event] = stream.uniform2();
    FlightDraws {
        key: stream.bits(),
        tau,
        event,
        hero: (stream.bits() % 3) as u32,
        lanes: 3,
        flags: 0,
        reserved: 0,
        prior: Spectrum::ONE,
    }
}

/// The segment from `o` along `d`, which need not be of unit length.
pub fn ray(o: [f32; 3], d: [f32; 3], t1: f32) -> Segment {
    let n = d.iter().map(|c| c * c).sum::<f32>().sqrt();
    Segment {
        o,
        t0: 0.0,
        d: d.map(|c| if n == 1.0 { c } else { c / n }),
        t1,
    }
}
