//! The `vdb` medium: density, albedo and emission from the grids of an OpenVDB file.
//!
//! Extinction is `sigma_t · (density_scale · v + density_offset)` with v the grid's value (never below 0), interpolated
//! trilinearly between voxel centres as OpenVDB's `BoxSampler` does; outside the box of active voxels, grown by one voxel,
//! there is nothing. Only the grids named are read.
//!
//! | parameter | type | unit | default | meaning |
//! |---|---|---|---|---|
//! | `file` | file | | required | OpenVDB file |
//! | `grid` | text | | `density` | scalar grid; level sets are refused |
//! | `sigma_t` | spectrum ≥ 0 | 1/length | 1 | extinction where the density is 1 |
//! | `albedo` | spectrum 0..1 | | 1 | share of the extinction that scatters |
//! | `density_scale`, `density_offset` | float | | 1, 0 | applied to the grid's values |
//! | `albedo_grid`, `color_grid` | text | | none | float or vector grids that multiply the albedo |
//! | `…_scale`, `…_offset` | float | | 1, 0 | applied to their values, which are then limited to 0..1 |
//! | `…_file` | file | | the density's | file of the albedo, colour, `temperature` or emission grid |
//! | `…_transform` | 12 numbers | | identity | rows of the map from that grid's world to the density's, after its own transform |
//! | `temperature_grid` | text | | none | emits as a black body at these temperatures |
//! | `temperature_scale`, `temperature_offset` | float | K | 1, 0 | to kelvin |
//! | `emission_scale` | float ≥ 0 | 1/length | 1 | emission = this × absolute black-body radiance ([`blackbody`]) |
//! | `emission_grid` | text | | none | float or vector grid of emission |
//! | `emission_grid_scale`, `emission_grid_offset` | float | | 1, 0 | applied to its values |
//! | `emission` | spectrum ≥ 0 | W·sr⁻¹·m⁻³ | 1 | emission where that grid is 1 |
//! | `interpolation` | `trilinear`, `nearest` | | `trilinear` | between voxel centres |
//! | `transmittance` | `auto`, `ratio`, `survival` | | `auto` | estimator of connections; all are unbiased. `auto` takes survival above an optical thickness of 1.5 |
//! | `phase` | phase plugin | | isotropic | phase function |
//!
//! ```json
//! { "plugin": "vdb", "file": "cloud.vdb", "sigma_t": 24.56, "albedo": 0.99, "phase": { "plugin": "hg", "g": 0.85 } }
//! ```
//!
//! Negative values and NaN count as 0, with a warning that says how many and where; infinite values are an error. A background
//! other than 0 (after scale and offset) fills the box between the voxels.
//!
//! How it works, in reading order: [`voxel`] and [`index`] hold the data, [`load`] fills them, [`bounds`] makes majorants and
//! minorants, [`cursor`] and [`fine`] walk a ray through them, [`field`] is what tracking sees, [`build`] puts all together.

pub mod appearance;
pub mod blackbody;
pub mod bounds;
pub mod build;
pub mod channel;
pub mod coarse;
pub mod cursor;
pub mod field;
pub mod fine;
pub mod grid;
pub mod index;
pub mod load;
pub mod settings;
pub mod voxel;

#[cfg(test)]
mod tests;

use resolvent_api::math::Vec3;
use resolvent_api::params::Host;
use resolvent_api::{
    Coefficients, Error, Flight, FlightDraws, Medium, MediumInfo, ParamDecl, Params, Plugin,
    Segment, Spectrum, export_plugin,
};

/// The plugin: a medium whose kernel was chosen by what its grids hold.
pub struct Vdb(Box<dyn Medium>);

/// The host's threads, for the reader.
struct HostThreads(Host);

impl resolvent_vdb::Parallel for HostThreads {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        self.0.parallel_for(count, task);
    }
}

impl Plugin for Vdb {
    const NAME: &'static str = "vdb";
    const SUMMARY: &'static str = "density, albedo and emission from the grids of an OpenVDB file";
    const PARAMS: &'static [ParamDecl] = settings::PARAMS;

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let settings = settings::Settings::read(params)?;
        let host = params.host();
        let services = load::Services {
            parallel: &HostThreads(host),
            warn: &|message| host.warn(message),
        };
        build::build(&settings, services).map(Self)
    }
}

impl Medium for Vdb {
    fn info(&self) -> MediumInfo {
        self.0.info()
    }
    #[inline]
    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        self.0.sample(s, u)
    }
    #[inline]
    fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight {
        self.0.transmit(s, u)
    }
    fn depth(&self, s: &Segment) -> Spectrum {
        self.0.depth(s)
    }
    fn coefficients(&self, p: Vec3) -> Coefficients {
        self.0.coefficients(p)
    }
}

export_plugin!(medium, Vdb);
