//! Parameters as a value.

use crate::channel::Source;
use resolvent_api::{Affine, Decl, Error, ParamDecl, Params, Spectrum};

/// Declarations.
pub const PARAMS: &[ParamDecl] = &[
    Decl::file("file", "OpenVDB file").required().build(),
    Decl::text("grid", "name of the density grid")
        .default("\"density\"")
        .build(),
    Decl::spectrum("sigma_t", "extinction where the density is 1")
        .default("1")
        .unit("1/length")
        .at_least(0.0)
        .build(),
    Decl::spectrum("albedo", "share of the extinction that is scattering")
        .default("1")
        .at_least(0.0)
        .at_most(1.0)
        .build(),
    Decl::float("density_scale", "factor of the density grid's values")
        .default("1")
        .build(),
    Decl::float("density_offset", "added to the density after the factor")
        .default("0")
        .build(),
    Decl::text(
        "albedo_grid",
        "name of a float or vector grid that multiplies the albedo",
    )
    .build(),
    Decl::float("albedo_grid_scale", "factor of its values")
        .default("1")
        .build(),
    Decl::float(
        "albedo_grid_offset",
        "added after the factor; the result is limited to 0..1",
    )
    .default("0")
    .build(),
    Decl::file("albedo_grid_file", "its file, if not the density's").build(),
    Decl::numbers(
        "albedo_grid_transform",
        "three rows of four: from its world, after the grid's own transform, to the density's",
    )
    .build(),
    Decl::text(
        "color_grid",
        "name of another grid that multiplies the albedo",
    )
    .build(),
    Decl::float("color_grid_scale", "factor of its values")
        .default("1")
        .build(),
    Decl::float(
        "color_grid_offset",
        "added after the factor; the result is limited to 0..1",
    )
    .default("0")
    .build(),
    Decl::file("color_grid_file", "its file, if not the density's").build(),
    Decl::numbers(
        "color_grid_transform",
        "three rows of four: from its world, after the grid's own transform, to the density's",
    )
    .build(),
    Decl::text(
        "temperature_grid",
        "name of a grid of temperatures: emits as a black body",
    )
    .build(),
    Decl::float(
        "temperature_scale",
        "kelvin per unit of the temperature grid",
    )
    .default("1")
    .unit("K")
    .build(),
    Decl::float("temperature_offset", "added after the factor")
        .default("0")
        .unit("K")
        .build(),
    Decl::file("temperature_file", "its file, if not the density's").build(),
    Decl::numbers(
        "temperature_transform",
        "three rows of four: from its world, after the grid's own transform, to the density's",
    )
    .build(),
    Decl::float("emission_scale", "black-body radiance emitted per length")
        .default("1")
        .unit("1/length")
        .at_least(0.0)
        .build(),
    Decl::text(
        "emission_grid",
        "name of a float or vector grid of emission (flames)",
    )
    .build(),
    Decl::float("emission_grid_scale", "factor of its values")
        .default("1")
        .build(),
    Decl::float("emission_grid_offset", "added after the factor")
        .default("0")
        .build(),
    Decl::file("emission_grid_file", "its file, if not the density's").build(),
    Decl::numbers(
        "emission_grid_transform",
        "three rows of four: from its world, after the grid's own transform, to the density's",
    )
    .build(),
    Decl::spectrum("emission", "emission where the emission grid is 1")
        .default("1")
        .unit("W/(sr m^3)")
        .at_least(0.0)
        .build(),
    Decl::choice(
        "interpolation",
        "trilinear|nearest",
        "how values between voxel centres are found",
    )
    .default("\"trilinear\"")
    .build(),
    Decl::choice(
        "transmittance",
        "auto|ratio|survival",
        "how connections are estimated: unbiased all, they differ in cost and variance",
    )
    .default("\"auto\"")
    .build(),
    Decl::plugin("phase", "phase", "phase function").build(),
];

/// How connections are to be estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// By optical thickness.
    Auto,
    /// Ratio tracking.
    Ratio,
    /// Survival of a free flight.
    Survival,
}

/// See [`PARAMS`].
#[derive(Clone, Debug)]
pub struct Settings {
    /// Path.
    pub file: String,
    /// Density grid.
    pub density: Source,
    /// Extinction per unit of density, 1/length.
    pub sigma_t: Spectrum,
    /// Albedo.
    pub albedo: Spectrum,
    /// Grids that multiply it.
    pub tints: Vec<Source>,
    /// Temperatures in kelvin.
    pub temperature: Option<Source>,
    /// Factor of black-body radiance, 1/length.
    pub emission_scale: f32,
    /// Flames.
    pub flame: Option<Source>,
    /// Emission per unit of that grid, W·sr⁻¹·m⁻³.
    pub emission: Spectrum,
    /// Interpolate, or take the nearest voxel.
    pub trilinear: bool,
    /// Estimator of connections.
    pub transmittance: Choice,
    /// From the file's world to the scene.
    pub to_world: Affine,
    /// Lanes in use.
    pub lanes: u32,
}

/// A transform of three rows of four numbers.
fn placed(name: &str, rows: &[f64]) -> Result<Affine, Error> {
    match rows.as_chunks::<4>() {
        ([a, b, c], []) => Ok(Affine::from_rows([*a, *b, *c])),
        _ => Err(Error::new(format!(
            "'{name}_transform' must be 12 numbers, three rows of four, not {}",
            rows.len()
        ))),
    }
}

impl Settings {
    /// With everything but file and grid at its default.
    pub fn new(file: impl Into<String>, grid: &str) -> Self {
        Self {
            file: file.into(),
            density: Source::new(grid),
            sigma_t: Spectrum::rgb(1.0, 1.0, 1.0),
            albedo: Spectrum::rgb(1.0, 1.0, 1.0),
            tints: Vec::new(),
            temperature: None,
            emission_scale: 1.0,
            flame: None,
            emission: Spectrum::rgb(1.0, 1.0, 1.0),
            trilinear: true,
            transmittance: Choice::Auto,
            to_world: Affine::IDENTITY,
            lanes: 3,
        }
    }

    /// From the host.
    ///
    /// # Errors
    /// If a value is missing or out of range.
    pub fn read(params: &Params<'_>) -> Result<Self, Error> {
        let source = |grid: &str, name: &str| -> Result<Option<Source>, Error> {
            let Some(grid) = params.text(grid).filter(|name| !name.is_empty()) else {
                return Ok(None);
            };
            let beside = name != "density";
            let number = |what: &str| params.float(&format!("{name}_{what}"));
            let rows = match params.numbers(&format!("{name}_transform")) {
                Some(rows) if beside => Some(rows),
                _ => None,
            };
            Ok(Some(Source {
                scale: number("scale")?,
                offset: number("offset")?,
                file: params.text(&format!("{name}_file")).filter(|_| beside),
                transform: rows.map_or(Ok(Affine::IDENTITY), |r| placed(name, r))?,
                ..Source::new(grid)
            }))
        };
        let file = params
            .text("file")
            .ok_or_else(|| Error::new("the parameter 'file' has no value"))?;
        let density = source("grid", "density")?;
        let mut settings = Self::new(file, "density");
        settings.density = density.ok_or_else(|| Error::new("the parameter 'grid' is empty"))?;
        settings.tints.extend(source("albedo_grid", "albedo_grid")?);
        settings.tints.extend(source("color_grid", "color_grid")?);
        settings.temperature = source("temperature_grid", "temperature")?;
        settings.flame = source("emission_grid", "emission_grid")?;
        settings.emission_scale = params.float("emission_scale")? as f32;
        for (name, value) in [
            ("sigma_t", &mut settings.sigma_t),
            ("albedo", &mut settings.albedo),
            ("emission", &mut settings.emission),
        ] {
            if let Some(given) = params.spectrum(name) {
                *value = given;
            }
        }
        settings.trilinear = params.text("interpolation").as_deref() != Some("nearest");
        settings.transmittance = match params.text("transmittance").as_deref() {
            Some("ratio") => Choice::Ratio,
            Some("survival") => Choice::Survival,
            _ => Choice::Auto,
        };
        settings.to_world = params.to_world();
        settings.lanes = params.lanes();
        settings.check()?;
        Ok(settings)
    }

    /// Ranges, whoever filled the values in.
    ///
    /// # Errors
    /// Naming the parameter.
    pub fn check(&self) -> Result<(), Error> {
        let bad = |name: &str, v: Spectrum, most: f32| {
            let ok =
                v.0.iter()
                    .all(|c| c.is_finite() && (0.0..=most).contains(c));
            let range = if most == 1.0 {
                "between 0 and 1"
            } else {
                "finite and not negative"
            };
            if ok {
                Ok(())
            } else {
                Err(Error::new(format!(
                    "'{name}' must be {range}, not {:?}",
                    v.to_rgb()
                )))
            }
        };
        bad("sigma_t", self.sigma_t, f32::MAX)?;
        bad("albedo", self.albedo, 1.0)?;
        bad("emission", self.emission, f32::MAX)?;
        bad(
            "emission_scale",
            Spectrum::splat(self.emission_scale),
            f32::MAX,
        )?;
        let sources = [
            Some(&self.density),
            self.temperature.as_ref(),
            self.flame.as_ref(),
        ];
        for source in sources.into_iter().flatten().chain(&self.tints) {
            if !(source.scale.is_finite() && source.offset.is_finite()) {
                return Err(Error::new(format!(
                    "scale and offset of the grid '{}' must be finite",
                    source.grid
                )));
            }
        }
        Ok(())
    }
}
