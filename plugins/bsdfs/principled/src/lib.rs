//! BSDF `principled`: one material for most things, in the terms of OpenPBR where it has them.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `base_color` | spectrum | | 0.8 | [0, 1] | diffuse reflectance, or a metal's reflectance at normal incidence |
//! | `metallic` | float | | 0 | [0, 1] | from dielectric to metal |
//! | `roughness` | float | | 0.5 | [0, 1] | square root of the facets' width α; below 0.01 smooth |
//! | `anisotropy` | float | | 0 | [0, 1] | stretches highlights across x, at the same mean square slope |
//! | `specular` | float | | 1 | [0, 1] | strength of the dielectric's reflection at all angles |
//! | `specular_color` | spectrum | | 1 | ≥ 0 | tint of the dielectric's reflection at normal incidence |
//! | `f0` | spectrum | | | [0, 1] | reflectance at normal incidence itself, in place of that of `ior` |
//! | `edge_color` | spectrum | | 1 | [0, 1] | tint of a metal's reflection at 82° |
//! | `ior` | float | | 1.5 | [1, 5] | index of refraction |
//! | `transmission` | float | | 0 | [0, 1] | from opaque to transparent, of the dielectric part |
//! | `transmission_color` | spectrum | | `base_color` | [0, 1] | factor of what passes, at each crossing |
//! | `thin` | bool | | false | | the surface is a thin sheet: light passes unbent |
//! | `clearcoat` | float | | 0 | [0, 1] | presence of a coat of varnish |
//! | `clearcoat_roughness` | float | | 0 | [0, 1] | its roughness |
//! | `clearcoat_ior` | float | | 1.5 | [1, 3] | its index of refraction |
//! | `sheen` | float | | 0 | [0, 1] | presence of fuzz on top of everything |
//! | `sheen_color` | spectrum | | 1 | [0, 1] | its colour |
//! | `sheen_roughness` | float | | 0.3 | [0, 1] | spread of its fibres |
//!
//! **Layers**, from below. A base that mixes, by `metallic`, a metal with a dielectric, which mixes, by `transmission`, a
//! transparent body with a diffuse one under a reflecting boundary; all with facets of one GGX distribution. A coat, which reflects as its
//! index says. Fuzz, after Estevez & Kulla 2017. The dielectric's reflectance follows Fresnel's curve between its colour at normal
//! incidence and `specular` at grazing; the metal's is Schlick's with OpenPBR's edge tint.
//!
//! **Energy.** What facets lose by shadowing each other is returned (Kulla & Conty 2017), and the diffuse base gets exactly what
//! the boundary above it lets through in both directions, so that a white base, metal or not, loses nothing. Everything is
//! reciprocal: layers dim what is below by the smaller transmittance of the two directions, which loses a few percent where a
//! rough metal lies under a coat or fuzz.
//!
//! **Sides.** Where light can enter a body, coat and fuzz are on its outside only; elsewhere both sides are alike. The body's index
//! counts against what surrounds it. Emission belongs to the shape, absorption inside to its `interior` medium.
//!
//! **glTF** is `base_color`, `metallic`, `roughness`; KHR_materials_transmission `transmission`, with `thin` unless
//! KHR_materials_volume gives a thickness; _ior `ior` (the special value 0 is `f0` = specular colour); _clearcoat, _sheen (with `sheen`
//! 1); _specular `specular` and `specular_color`. **UsdPreviewSurface** is `base_color` = diffuseColor, `metallic`, `roughness`,
//! `ior`, `clearcoat`, `clearcoat_roughness`; in its specular workflow `f0` = specularColor and `metallic` 0; `opacity` is the
//! plugin `mask`, or `transmission` = 1 − opacity with `thin`.
//!
//! ```json
//! "materials": { "car": { "plugin": "principled", "params": {
//!   "base_color": [0.6, 0.02, 0.02], "metallic": 0.6, "roughness": 0.4, "clearcoat": 1 } } }
//! ```

mod sheen;
mod surface;
#[cfg(test)]
mod tests;

use resolvent_api::surface::bsdf_traits;
use resolvent_api::{Bsdf, Decl, Error, ParamDecl, Params, Plugin, Spectrum, SurfacePoint};
use surface::Surface;

/// The parameters at a point.
#[derive(Clone, Copy, Debug)]
pub struct Principled {
    base_color: Spectrum,
    metallic: f32,
    roughness: f32,
    anisotropy: f32,
    specular: f32,
    specular_color: Spectrum,
    f0: Option<Spectrum>,
    edge_color: Spectrum,
    ior: f32,
    transmission: f32,
    transmission_color: Option<Spectrum>,
    thin: bool,
    clearcoat: f32,
    clearcoat_roughness: f32,
    clearcoat_ior: f32,
    sheen: f32,
    sheen_color: Spectrum,
    sheen_roughness: f32,
}

const fn share(name: &'static str, default: &'static str, help: &'static str) -> ParamDecl {
    Decl::float(name, help)
        .default(default)
        .at_least(0.0)
        .at_most(1.0)
        .build()
}

const fn colour(name: &'static str, default: &'static str, help: &'static str) -> ParamDecl {
    Decl::spectrum(name, help)
        .default(default)
        .at_least(0.0)
        .at_most(1.0)
        .build()
}

impl Plugin for Principled {
    const NAME: &'static str = "principled";
    const SUMMARY: &'static str =
        "Metal, plastic, glass, varnish and cloth by a few intuitive parameters.";
    const PARAMS: &'static [ParamDecl] = &[
        colour(
            "base_color",
            "0.8",
            "diffuse reflectance, or a metal's at normal incidence",
        ),
        share("metallic", "0", "from dielectric to metal"),
        share(
            "roughness",
            "0.5",
            "square root of the facets' width; below 0.01 smooth",
        ),
        share("anisotropy", "0", "stretches highlights across x"),
        share("specular", "1", "strength of the dielectric's reflection"),
        Decl::spectrum(
            "specular_color",
            "tint of the dielectric's reflection at normal incidence",
        )
        .default("1")
        .at_least(0.0)
        .build(),
        Decl::spectrum(
            "f0",
            "reflectance at normal incidence, in place of that of the index",
        )
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        colour(
            "edge_color",
            "1",
            "tint of a metal's reflection at 82 degrees",
        ),
        Decl::float("ior", "index of refraction")
            .default("1.5")
            .at_least(1.0)
            .at_most(5.0)
            .build(),
        share("transmission", "0", "from opaque to transparent"),
        Decl::spectrum(
            "transmission_color",
            "factor of what passes; the base colour if not given",
        )
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        Decl::bool("thin", "a thin sheet, through which light passes unbent")
            .default("false")
            .build(),
        share("clearcoat", "0", "presence of a coat of varnish"),
        share("clearcoat_roughness", "0", "the coat's roughness"),
        Decl::float("clearcoat_ior", "the coat's index of refraction")
            .default("1.5")
            .at_least(1.0)
            .at_most(3.0)
            .build(),
        share("sheen", "0", "presence of fuzz"),
        colour("sheen_color", "1", "colour of the fuzz"),
        share("sheen_roughness", "0.3", "spread of the fuzz's fibres"),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let number = |name: &str| params.float(name).map(|v| v as f32);
        let colour = |name: &str| {
            params
                .spectrum(name)
                .ok_or_else(|| Error::new(format!("the parameter '{name}' has no value")))
        };
        Ok(Self {
            base_color: colour("base_color")?,
            metallic: number("metallic")?,
            roughness: number("roughness")?,
            anisotropy: number("anisotropy")?,
            specular: number("specular")?,
            specular_color: colour("specular_color")?,
            f0: params.spectrum("f0"),
            edge_color: colour("edge_color")?,
            ior: number("ior")?,
            transmission: number("transmission")?,
            transmission_color: params.spectrum("transmission_color"),
            thin: params.bool("thin")?,
            clearcoat: number("clearcoat")?,
            clearcoat_roughness: number("clearcoat_roughness")?,
            clearcoat_ior: number("clearcoat_ior")?,
            sheen: number("sheen")?,
            sheen_color: colour("sheen_color")?,
            sheen_roughness: number("sheen_roughness")?,
        })
    }
}

impl Bsdf for Principled {
    type Closure = Surface;

    fn traits(&self) -> u32 {
        bsdf_traits::UNIFORM
    }

    fn ior(&self) -> f32 {
        let enters = self.transmission > 0.0 && self.metallic < 1.0 && !self.thin;
        if enters { self.ior } else { 1.0 }
    }

    fn closure(&self, at: &SurfacePoint) -> Surface {
        Surface::new(self, at.outside_ior, at.lanes)
    }
}

resolvent_api::export_plugin!(bsdf, Principled);
