//! BSDF `rough-dielectric`: frosted glass.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `ior` | float | | 1.5 | [0.2, 5] | index of refraction inside |
//! | `roughness` | float | | 0.3 | [0, 1] | square root of the facets' width α; below 0.01 smooth |
//! | `anisotropy` | float | | 0 | [0, 1] | stretches highlights across x, at the same mean square slope |
//! | `thin` | bool | | false | | the surface is a thin sheet: light is scattered, but not bent |
//! | `reflection_tint` | spectrum | | 1 | [0, 1] | factor of what is reflected; 1 for real dielectrics |
//! | `transmission_tint` | spectrum | | 1 | [0, 1] | factor of what passes |
//!
//! Facets with the GGX distribution reflect and refract as in Walter et al. 2007; normals are sampled among those visible
//! (Heitz 2018; Dupuy & Benyoub 2023). Light that meets more than one facet is returned in two diffuse lobes, so that nothing is
//! lost (to 1 %; with anisotropy to 1.4 %, with more than 0.9 to 4 %) and the whole stays reciprocal ([`resolvent_api::microfacet::Interface`] has the equations). x follows ∂p/∂u.
//!
//! ```json
//! "materials": { "frosted": { "plugin": "rough-dielectric", "params": { "ior": 1.52, "roughness": 0.4 } } }
//! ```

#[cfg(test)]
mod tests;

use resolvent_api::microfacet::{Boundary, Interface, alpha, boundary};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{Bsdf, Decl, Error, ParamDecl, Params, Plugin, Spectrum, SurfacePoint};

/// The plugin.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    ior: f32,
    roughness: f32,
    anisotropy: f32,
    thin: bool,
    tints: [Spectrum; 2],
}

impl Plugin for RoughDielectric {
    const NAME: &'static str = "rough-dielectric";
    const SUMMARY: &'static str =
        "The rough boundary of a transparent body (GGX), or a thin frosted sheet.";
    const PARAMS: &'static [ParamDecl] = &[
        boundary::IOR,
        Decl::float(
            "roughness",
            "square root of the facets' width; below 0.01 smooth",
        )
        .default("0.3")
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        Decl::float("anisotropy", "stretches highlights across x")
            .default("0")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        boundary::THIN,
        boundary::REFLECTION_TINT,
        boundary::TRANSMISSION_TINT,
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            ior: params.float("ior")? as f32,
            roughness: params.float("roughness")? as f32,
            anisotropy: params.float("anisotropy")? as f32,
            thin: params.bool("thin")?,
            tints: Boundary::tints(params),
        })
    }
}

impl Bsdf for RoughDielectric {
    type Closure = Boundary;

    fn traits(&self) -> u32 {
        bsdf_traits::UNIFORM
    }

    fn ior(&self) -> f32 {
        if self.thin { 1.0 } else { self.ior }
    }

    fn closure(&self, at: &SurfacePoint) -> Boundary {
        let alpha = alpha(self.roughness, self.anisotropy);
        Boundary {
            interface: Interface::new(alpha, self.ior / at.outside_ior, self.thin),
            tints: self.tints,
        }
    }
}

resolvent_api::export_plugin!(bsdf, RoughDielectric);
