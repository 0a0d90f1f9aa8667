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

use resolvent_api::microfacet::Interface;
use resolvent_api::operator::lobes;
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Error, Mode, ParamDecl, Params, Plugin, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Spectrum, SurfacePoint, Vec3,
};

/// The plugin.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    ior: f32,
    thin: bool,
    tints: [Spectrum; 2],
}

/// The boundary at a point.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    interface: Interface,
    /// Factors of what is reflected and transmitted.
    tints: [Spectrum; 2],
}

impl Plugin for Dielectric {
    const NAME: &'static str = "dielectric";
    const SUMMARY: &'static str = "The smooth boundary of a transparent body, or a thin sheet.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::float("ior", "index of refraction inside")
            .default("1.5")
            .at_least(0.2)
            .at_most(5.0)
            .build(),
        Decl::bool("thin", "a thin sheet, through which light passes unbent")
            .default("false")
            .build(),
        Decl::spectrum("reflection_tint", "factor of what is reflected")
            .default("1")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::spectrum("transmission_tint", "factor of what passes")
            .default("1")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let tint = |name: &str| params.spectrum(name).unwrap_or(Spectrum::ONE);
        Ok(Self {
            ior: params.float("ior")? as f32,
            thin: params.bool("thin")?,
            tints: [tint("reflection_tint"), tint("transmission_tint")],
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

impl Scatter for Boundary {
    /// Delta lobes contribute nothing to any given pair of directions.
    fn eval(&self, _: Vec3, _: Vec3, _: Mode) -> ScatterEval {
        ScatterEval::default()
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let mut s = self.interface.sample(wo, u)?;
        s.weight *= self.tints[s.lobe as usize];
        (!s.weight.is_zero()).then_some(s)
    }

    fn lobes(&self) -> u32 {
        lobes::DELTA
    }

    fn eta(&self) -> f32 {
        self.interface.eta()
    }
}

resolvent_api::export_plugin!(bsdf, Dielectric);
