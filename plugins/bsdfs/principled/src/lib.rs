//! BSDF `principled`: one material for most things, in the terms of OpenPBR where it has them.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `base_color` | spectrum | | 0.8 | [0, 1] | diffuse reflectance, or a metal's reflectance at normal incidence |
//! | `diffuse_roughness` | float | | 0 | [0, 1] | of the diffuse base: 0 is Lambert's |
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
//! | `clearcoat_color` | spectrum | | 1 | [0, 1] | what white light has become after crossing it twice along the normal |
//! | `clearcoat_darkening` | float | | 0 | [0, 1] | how much the base darkens and saturates by reflections within the coat |
//! | `clearcoat_normal` | spectrum | | | [0, 1] | normal map of the coat: red, green and blue are components from −1 to 1 along growing u, growing v and the normal. `[0.5, 0.5, 1]` keeps the coat smooth over a bumpy base; not given, it follows the base |
//! | `clearcoat_normal_scale` | float | | 1 | | factor on the first two components |
//! | `thin_film` | float | | 0 | [0, 1] | presence of a thin film on the base, which iridesces |
//! | `thin_film_thickness` | float | nm | 500 | ≥ 0 | its thickness |
//! | `thin_film_ior` | float | | 1.4 | [1, 5] | its index of refraction |
//! | `sheen` | float | | 0 | [0, 1] | presence of fuzz on top of everything |
//! | `sheen_color` | spectrum | | 1 | [0, 1] | its colour |
//! | `sheen_roughness` | float | | 0.3 | [0, 1] | spread of its fibres |
//!
//! Every number and spectrum but the indices may be a texture; its values are clamped to the range.
//!
//! **Layers**, from below. A base that mixes, by `metallic`, a metal with a dielectric, which mixes, by `transmission`, a
//! transparent body with a diffuse one under a reflecting boundary; all with facets of one GGX distribution. A coat, which reflects as its
//! index says. Fuzz, after Estevez & Kulla 2017. The dielectric's reflectance follows Fresnel's curve between its colour at normal
//! incidence and `specular` at grazing; the metal's is Schlick's with OpenPBR's edge tint.
//!
//! **Films.** Light that is reflected at both faces of a thin film interferes, by Airy's sum for each polarisation and wavelength, as the three
//! colours see it ([`resolvent_api::microfacet::film`]; off by less than 0.001, at grazing incidence by 0.007). What it reflects does not pass.
//! It lies directly on metal, boundary and transparent body, below the coat, and counts against what is outside of that. Its lower face has the
//! phase of a metal that reflects `base_color` at 0° and what `edge_color` says at 82°: chromium and gold under oxide are within 0.03 of the exact
//! values for their indices. On a body of `ior` 1 it is a soap bubble; a `thin` sheet has one on either face.
//!
//! **Energy.** What facets lose by shadowing each other is returned (Kulla & Conty 2017); the diffuse base gets exactly what
//! the boundary above it lets through in both directions, and facets under coat or fuzz what both passages leave over the mean
//! passage ([`resolvent_api::microfacet::exits`]), for what the layers send back down is reflected again: a white base, metal, glass
//! or not, loses nothing, to 1 %. Everything is reciprocal. Under films it is 2 %, and on
//! the roughest glass, where several facets know only the mean of the film's colours, 3 %. With anisotropic facets under
//! a layer, or fuzz on a rough coat, it is 2 %. A coat with normals of its own is as shading normals are: its cosine is with them, walks
//! from lights take the adjoint, and what it would reflect below the surface is lost.
//!
//! **OpenPBR 1.1** is `base_color` = base weight times colour, `diffuse_roughness`, `metallic`, `roughness`, `anisotropy`,
//! `specular` and `specular_color`, `ior`, `edge_color` = specular colour of metals, `transmission`, `transmission_color` (without
//! a depth; with one an `interior` medium, as for transmission scatter and subsurface), `clearcoat`, `_roughness`, `_ior`,
//! `_color`, `_darkening`, `_normal`, `sheen…` for fuzz (another model of it), `thin`, `thin_film…` (thickness in nm); opacity is `mask`. Not there: dispersion,
//! anisotropy of the coat, light that diffuses through thin walls, and the coat's influence on the roughness and index below
//! it (give the `ior` over that of the coat).
//!
//! **Sides.** Where light can enter a body, coat and fuzz are on its outside only; elsewhere both sides are alike. The body's index
//! counts against what surrounds it. Emission belongs to the shape, absorption inside to its `interior` medium.
//!
//! **glTF** is `base_color`, `metallic`, `roughness`; KHR_materials_transmission `transmission`, with `thin` unless
//! KHR_materials_volume gives a thickness; _ior `ior` (the special value 0 is `f0` = specular colour); _clearcoat (whose
//! normals are never those of the base), _sheen (with `sheen` 1); _specular `specular` and `specular_color`; _iridescence `thin_film…`. **UsdPreviewSurface** is `base_color` = diffuseColor, `metallic`, `roughness`,
//! `ior`, `clearcoat`, `clearcoat_roughness`; in its specular workflow `f0` = specularColor and `metallic` 0; `opacity` is the
//! plugin `mask`, or `transmission` = 1 − opacity with `thin`.
//!
//! ```json
//! "materials": { "car": { "plugin": "principled", "params": {
//!   "base_color": [0.6, 0.02, 0.02], "metallic": 0.6, "roughness": 0.4, "clearcoat": 1 } } }
//! ```

mod boundary;
mod diffuse;
mod layers;
mod sheen;
mod skin;
mod surface;
#[cfg(test)]
mod tests;
mod tilt;

use resolvent_api::microfacet::Bare;
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Either, Error, ParamDecl, Params, Plugin, Slot, Spectrum, Stored, SurfacePoint,
    Textured, TexturedFloat, TexturedSpectrum, Vec3,
};
use skin::{Filmed, Skin};
use surface::Surface;

/// Minor version of the ABI that brought tangent spaces.
const OWN_NORMALS_SINCE: u32 = 3;

/// The closure of a point, without a film or with one.
type Look = Either<Surface<Bare>, Surface<Filmed>>;

/// The parameters at a point.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    base_color: Spectrum,
    diffuse_roughness: f32,
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
    clearcoat_color: Spectrum,
    clearcoat_darkening: f32,
    /// Of the coat, if it has one of its own: in the shading frame.
    clearcoat_normal: Option<Vec3>,
    thin_film: f32,
    thin_film_thickness: f32,
    thin_film_ior: f32,
    sheen: f32,
    sheen_color: Spectrum,
    sheen_roughness: f32,
}

/// A material that is the same everywhere.
#[derive(Debug)]
struct Constant {
    parameters: Parameters,
    /// Its layers in vacuum, as most vertices need them.
    look: Look,
    lanes: u32,
}

/// The plugin.
#[derive(Debug)]
pub struct Principled {
    base_color: TexturedSpectrum,
    diffuse_roughness: TexturedFloat,
    metallic: TexturedFloat,
    roughness: TexturedFloat,
    anisotropy: TexturedFloat,
    specular: TexturedFloat,
    specular_color: TexturedSpectrum,
    f0: Option<TexturedSpectrum>,
    edge_color: TexturedSpectrum,
    ior: f32,
    transmission: TexturedFloat,
    transmission_color: Option<TexturedSpectrum>,
    thin: bool,
    clearcoat: TexturedFloat,
    clearcoat_roughness: TexturedFloat,
    clearcoat_ior: f32,
    clearcoat_color: TexturedSpectrum,
    clearcoat_darkening: TexturedFloat,
    clearcoat_normal: Option<TexturedSpectrum>,
    clearcoat_normal_scale: f32,
    thin_film: TexturedFloat,
    thin_film_thickness: TexturedFloat,
    thin_film_ior: f32,
    sheen: TexturedFloat,
    sheen_color: TexturedSpectrum,
    sheen_roughness: TexturedFloat,
    /// What is the same everywhere, if all parameters are.
    constant: Option<Constant>,
}

const fn share(name: &'static str, default: &'static str, help: &'static str) -> ParamDecl {
    Decl::float(name, help)
        .default(default)
        .at_least(0.0)
        .at_most(1.0)
        .texturable()
        .build()
}

const fn colour(name: &'static str, default: &'static str, help: &'static str) -> ParamDecl {
    Decl::spectrum(name, help)
        .default(default)
        .at_least(0.0)
        .at_most(1.0)
        .texturable()
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
        share(
            "diffuse_roughness",
            "0",
            "of the diffuse base: 0 is Lambert's",
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
        .texturable()
        .build(),
        Decl::spectrum(
            "f0",
            "reflectance at normal incidence, in place of that of the index",
        )
        .at_least(0.0)
        .at_most(1.0)
        .texturable()
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
        .texturable()
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
        colour(
            "clearcoat_color",
            "1",
            "white light that has crossed the coat twice",
        ),
        share(
            "clearcoat_darkening",
            "0",
            "how much reflections within the coat darken the base",
        ),
        Decl::spectrum(
            "clearcoat_normal",
            "normal map of the coat, which follows the base if not given",
        )
        .at_least(0.0)
        .at_most(1.0)
        .texturable()
        .build(),
        Decl::float(
            "clearcoat_normal_scale",
            "factor on the slope of the coat's normals",
        )
        .default("1")
        .build(),
        share("thin_film", "0", "presence of a thin film on the base"),
        Decl::float("thin_film_thickness", "thickness of the film")
            .unit("nm")
            .default("500")
            .at_least(0.0)
            .texturable()
            .build(),
        Decl::float("thin_film_ior", "the film's index of refraction")
            .default("1.4")
            .at_least(1.0)
            .at_most(5.0)
            .build(),
        share("sheen", "0", "presence of fuzz"),
        colour("sheen_color", "1", "colour of the fuzz"),
        share("sheen_roughness", "0.3", "spread of the fuzz's fibres"),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let number = |name: &str| params.textured_float(name);
        let colour = |name: &str| {
            params
                .textured_spectrum(name)?
                .ok_or_else(|| Error::new(format!("the parameter '{name}' has no value")))
        };
        let mut all = Self {
            base_color: colour("base_color")?,
            diffuse_roughness: number("diffuse_roughness")?,
            metallic: number("metallic")?,
            roughness: number("roughness")?,
            anisotropy: number("anisotropy")?,
            specular: number("specular")?,
            specular_color: colour("specular_color")?,
            f0: params.textured_spectrum("f0")?,
            edge_color: colour("edge_color")?,
            ior: params.float("ior")? as f32,
            transmission: number("transmission")?,
            transmission_color: params.textured_spectrum("transmission_color")?,
            thin: params.bool("thin")?,
            clearcoat: number("clearcoat")?,
            clearcoat_roughness: number("clearcoat_roughness")?,
            clearcoat_ior: params.float("clearcoat_ior")? as f32,
            clearcoat_color: colour("clearcoat_color")?,
            clearcoat_darkening: number("clearcoat_darkening")?,
            clearcoat_normal: params.textured_spectrum("clearcoat_normal")?,
            clearcoat_normal_scale: params.float("clearcoat_normal_scale")? as f32,
            thin_film: number("thin_film")?,
            thin_film_thickness: number("thin_film_thickness")?,
            thin_film_ior: params.float("thin_film_ior")? as f32,
            sheen: number("sheen")?,
            sheen_color: colour("sheen_color")?,
            sheen_roughness: number("sheen_roughness")?,
            constant: None,
        };
        if all.clearcoat.constant() == Some(0.0) {
            all.clearcoat_normal = None;
        }
        if all.clearcoat_normal.is_some() && params.host_minor() < OWN_NORMALS_SINCE {
            return Err(Error::new(
                "'clearcoat_normal' needs a newer resolvent: this one does not tell tangent spaces",
            ));
        }
        if all.is_constant() {
            let parameters = all.resolve(&SurfacePoint::default());
            let lanes = params.lanes();
            all.constant = Some(Constant {
                parameters,
                look: if all.is_filmed() {
                    Look::B(Surface::new(&parameters, 1.0, lanes))
                } else {
                    Look::A(Surface::new(&parameters, 1.0, lanes))
                },
                lanes,
            });
        }
        Ok(all)
    }
}

impl Principled {
    fn is_constant(&self) -> bool {
        let numbers = [
            self.diffuse_roughness,
            self.clearcoat_darkening,
            self.metallic,
            self.roughness,
            self.anisotropy,
            self.specular,
            self.transmission,
            self.clearcoat,
            self.clearcoat_roughness,
            self.thin_film,
            self.thin_film_thickness,
            self.sheen,
            self.sheen_roughness,
        ];
        let colours = [
            Some(self.base_color),
            Some(self.specular_color),
            self.f0,
            Some(self.edge_color),
            self.transmission_color,
            Some(self.sheen_color),
            Some(self.clearcoat_color),
        ];
        self.clearcoat_normal.is_none()
            && numbers.iter().all(Textured::is_constant)
            && colours.iter().flatten().all(Textured::is_constant)
    }

    /// The parameters at a point.
    fn resolve(&self, at: &SurfacePoint) -> Parameters {
        Parameters {
            base_color: self.base_color.at(at),
            diffuse_roughness: self.diffuse_roughness.at(at),
            metallic: self.metallic.at(at),
            roughness: self.roughness.at(at),
            anisotropy: self.anisotropy.at(at),
            specular: self.specular.at(at),
            specular_color: self.specular_color.at(at),
            f0: self.f0.map(|c| c.at(at)),
            edge_color: self.edge_color.at(at),
            ior: self.ior,
            transmission: self.transmission.at(at),
            transmission_color: self.transmission_color.map(|c| c.at(at)),
            thin: self.thin,
            clearcoat: self.clearcoat.at(at),
            clearcoat_roughness: self.clearcoat_roughness.at(at),
            clearcoat_ior: self.clearcoat_ior,
            clearcoat_color: self.clearcoat_color.at(at),
            clearcoat_darkening: self.clearcoat_darkening.at(at),
            clearcoat_normal: self.coat_normal(at),
            thin_film: self.thin_film.at(at),
            thin_film_thickness: self.thin_film_thickness.at(at),
            thin_film_ior: self.thin_film_ior,
            sheen: self.sheen.at(at),
            sheen_color: self.sheen_color.at(at),
            sheen_roughness: self.sheen_roughness.at(at),
        }
    }
}

impl Principled {
    /// There is a film, somewhere.
    fn is_filmed(&self) -> bool {
        let there = |v: TexturedFloat| v.constant() != Some(0.0);
        there(self.thin_film) && there(self.thin_film_thickness)
    }

    /// The layers at a point.
    fn surface<S: Skin>(&self, at: &SurfacePoint) -> Surface<S> {
        match &self.constant {
            Some(c) => Surface::new(&c.parameters, at.outside_ior, at.lanes),
            None => Surface::new(&self.resolve(at), at.outside_ior, at.lanes),
        }
    }

    /// The coat's own normal in the shading frame.
    fn coat_normal(&self, at: &SurfacePoint) -> Option<Vec3> {
        let Spectrum([x, y, z, _]) = self.clearcoat_normal?.at(at);
        let n = at.mapped_normal([x, y, z], self.clearcoat_normal_scale);
        Some(n.map_or(Vec3::Z, |n| at.frame.to_local(n)))
    }
}

impl Bsdf for Principled {
    type Closure = Look;

    fn traits(&self) -> u32 {
        if self.constant.is_some() {
            bsdf_traits::UNIFORM
        } else if self.clearcoat_normal.is_some() {
            bsdf_traits::OWN_NORMALS
        } else {
            0
        }
    }

    fn ior(&self) -> f32 {
        // A textured share may be anything somewhere.
        let passes = self.transmission.constant() != Some(0.0);
        let enters = passes && self.metallic.constant() != Some(1.0) && !self.thin;
        if enters { self.ior } else { 1.0 }
    }

    fn closure(&self, at: &SurfacePoint) -> Look {
        match &self.constant {
            Some(c) if c.fits(at) => c.look,
            _ if self.is_filmed() => Look::B(self.surface(at)),
            _ => Look::A(self.surface(at)),
        }
    }

    fn store(&self, at: &SurfacePoint, slot: Slot<'_>) -> Stored {
        match &self.constant {
            Some(c) if c.fits(at) => c.look.put(slot),
            _ if self.is_filmed() => slot.put::<Surface<Filmed>>(self.surface(at)),
            _ => slot.put::<Surface<Bare>>(self.surface(at)),
        }
    }
}

impl Constant {
    /// The layers are those of this point.
    #[inline(always)]
    fn fits(&self, at: &SurfacePoint) -> bool {
        at.outside_ior == 1.0 && at.lanes == self.lanes
    }
}

resolvent_api::export_plugin!(bsdf, Principled);
