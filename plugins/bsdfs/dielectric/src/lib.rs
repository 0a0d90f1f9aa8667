//! BSDF `dielectric`: the smooth boundary of glass, water, air.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `ior` | float | | 1.5 | [0.2, 5] | index of refraction inside |
//! | `thin` | bool | | false | | the surface is a thin sheet: light passes unbent |
//! | `reflection_tint` | spectrum | | 1 | [0, 1] | factor of what is reflected; 1 for real dielectrics |
//! | `transmission_tint` | spectrum | | 1 | [0, 1] | factor of what passes |
//!
//! Light is reflected with Fresnel's reflectance for unpolarised light and refracted by Snell's law, both in single
//! directions. The inside is the side the geometric normal points away from; outside is vacuum, or the dielectric around this one.
//! Colour inside a solid is best given by an absorbing `interior` medium. A thin sheet reflects 2F/(1 + F), all reflections
//! between its two faces included.
//!
//! ```json
//! "materials": { "glass": { "plugin": "dielectric", "params": { "ior": 1.52 } } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::microfacet::{Boundary, Interface, boundary};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{Bsdf, Error, ParamDecl, Params, Plugin, Spectrum, SurfacePoint};

/// The plugin.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    ior: f32,
    thin: bool,
    tints: [Spectrum; 2],
}

impl Plugin for Dielectric {
    const NAME: &'static str = "dielectric";
    const SUMMARY: &'static str = "The smooth boundary of a transparent body, or a thin sheet.";
    const PARAMS: &'static [ParamDecl] = &[
        boundary::IOR,
        boundary::THIN,
        boundary::REFLECTION_TINT,
        boundary::TRANSMISSION_TINT,
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            ior: params.float("ior")? as f32,
            thin: params.bool("thin")?,
            tints: Boundary::tints(params),
        })
    }
}

impl Bsdf for Dielectric {
    type Closure = Boundary;

    fn traits(&self) -> u32 {
        bsdf_traits::UNIFORM
    }

    fn ior(&self) -> f32 {
        if self.thin { 1.0 } else { self.ior }
    }

    fn closure(&self, at: &SurfacePoint) -> Boundary {
        Boundary {
            interface: Interface::new([0.0; 2], self.ior / at.outside_ior, self.thin),
            tints: self.tints,
        }
    }
}

resolvent_api::export_plugin!(bsdf, Dielectric);
