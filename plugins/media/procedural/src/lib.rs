//! Medium `procedural`: media made of formulas, a noise cloud or a fog that thins out with height.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `kind` | choice | | `cloud` | `cloud`, `height_fog` | which formula |
//! | `sigma_t` | spectrum | 1/length | 1 | ≥ 0 | extinction of the cloud where it is densest, of the fog at `height` |
//! | `albedo` | spectrum | | 1 | [0, 1] | σ_s/σ_t |
//! | `bounds` | 6 numbers | length | | min ≤ max | box in object space: min x, y, z, max x, y, z |
//! | `center` | vec3 | length | 0 | | centre of a sphere in object space |
//! | `radius` | float | length | | ≥ 0 | its radius; excludes `bounds` |
//! | `phase` | phase plugin | | isotropic | | phase function |
//! | `octaves` | int | | 5 | 1 to 12 | cloud: layers of noise |
//! | `frequency` | float | | 4 | > 0 | cloud: features of the first layer along the longest edge |
//! | `lacunarity` | float | | 2 | [1, 4] | cloud: how much finer each layer is than the one before |
//! | `gain` | float | | 0.5 | [0, 1] | cloud: how much weaker it is |
//! | `coverage` | float | | 0.6 | [0, 1] | cloud: 0 leaves nothing, 1 fills the extent |
//! | `softness` | float | | 0.2 | (0, 1] | cloud: noise range from nothing to full density |
//! | `falloff` | float | | 0.4 | [0, 1] | cloud: share of the half-size over which the boundary erodes it |
//! | `seed` | int | | 0 | ≥ 0 | cloud: another cloud of the same kind |
//! | `axis` | vec3 | | 0, 1, 0 | not 0 | fog: up, in object space |
//! | `height` | float | length | 0 | | fog: where the extinction is `sigma_t`, along `axis` from the origin |
//! | `scale_height` | float | length | 1 | > 0 | fog: height over which it falls to 1/e |
//!
//! **cloud**: density = clamp((n − (1 − coverage) − (1 − e))/softness), n the noise in [0, 1] and e in [0, 1] the erosion: 1 inside,
//! falling to 0 at the boundary. It needs an extent. Majorants and minorants come from a grid of up to 64³ cells in which
//! the range of every layer of noise is known exactly, so tracking never meets an extinction above its majorant.
//!
//! **height_fog**: σ_t(h) = `sigma_t` · exp(−(h − `height`)/`scale_height`). Flights and transmittances are exact, in closed form.
//! Without an extent the fog fills the mesh whose interior it is, or reaches to the horizon where the host lets free media do
//! so; it then begins at `height`, and there is nothing below.
//!
//! ```json
//! "media": {
//!   "cloud": { "plugin": "procedural", "params": {
//!     "sigma_t": 20, "radius": 2, "phase": { "plugin": "hg", "params": { "g": 0.85 } }
//!   } },
//!   "fog": { "plugin": "procedural", "params": {
//!     "kind": "height_fog", "sigma_t": 0.1, "scale_height": 3, "albedo": 0.95,
//!     "bounds": [-500, 0, -500, 500, 20, 500]
//!   } }
//! }
//! ```

mod cloud;
mod fog;
#[cfg(test)]
mod tests;

use cloud::Cloud;
use fog::Fog;
use resolvent_api::medium::medium_traits;
use resolvent_api::tracking::{Tracked, Transmittance};
use resolvent_api::{
    Aabb, Coefficients, Decl, Error, Extent, Flight, FlightDraws, Medium, MediumInfo, ParamDecl,
    Params, Plugin, Segment, Spectrum, Vec3,
};

/// The plugin: one of its kinds, or nothing.
pub enum Procedural {
    /// No volume or no extinction.
    Nothing,
    /// A cloud whose lanes agree.
    GreyCloud(Box<Tracked<Cloud<f32>>>),
    /// A cloud whose lanes differ.
    Cloud(Box<Tracked<Cloud<Spectrum>>>),
    /// Fog.
    Fog(Box<Fog>),
}

/// What all kinds have.
pub(crate) struct Common {
    pub sigma_t: Spectrum,
    pub albedo: Spectrum,
    pub extent: Extent,
    /// Lanes in use.
    pub lanes: u32,
}

impl Plugin for Procedural {
    const NAME: &'static str = "procedural";
    const SUMMARY: &'static str =
        "A cloud of fractal noise, or fog that thins out exponentially with height.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::choice("kind", "cloud|height_fog", "which formula")
            .default("\"cloud\"")
            .build(),
        Decl::spectrum(
            "sigma_t",
            "extinction: densest in the cloud, at 'height' in the fog",
        )
        .unit("1/length")
        .default("1")
        .at_least(0.0)
        .build(),
        Decl::spectrum("albedo", "scattering over extinction")
            .default("1")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Extent::BOUNDS,
        Extent::CENTER,
        Extent::RADIUS,
        Decl::plugin("phase", "phase", "phase function; isotropic unless given").build(),
        Decl::int("octaves", "cloud: layers of noise")
            .default("5")
            .at_least(1.0)
            .at_most(12.0)
            .build(),
        Decl::float(
            "frequency",
            "cloud: features of the first layer along the longest edge",
        )
        .default("4")
        .above(0.0)
        .build(),
        Decl::float(
            "lacunarity",
            "cloud: how much finer each layer is than the one before",
        )
        .default("2")
        .at_least(1.0)
        .at_most(4.0)
        .build(),
        Decl::float(
            "gain",
            "cloud: how much weaker each layer is than the one before",
        )
        .default("0.5")
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        Decl::float("coverage", "cloud: 0 leaves nothing, 1 fills the extent")
            .default("0.6")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::float(
            "softness",
            "cloud: noise range from nothing to full density",
        )
        .default("0.2")
        .above(0.0)
        .at_most(1.0)
        .build(),
        Decl::float(
            "falloff",
            "cloud: share of the half-size over which the boundary erodes it",
        )
        .default("0.4")
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        Decl::int("seed", "cloud: another cloud of the same kind")
            .default("0")
            .at_least(0.0)
            .build(),
        Decl::vec3("axis", "fog: up, in object space")
            .default("[0, 1, 0]")
            .build(),
        Decl::float("height", "fog: where the extinction is sigma_t, along axis")
            .unit("length")
            .default("0")
            .build(),
        Decl::float(
            "scale_height",
            "fog: height over which the extinction falls to 1/e",
        )
        .unit("length")
        .default("1")
        .above(0.0)
        .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let spectrum = |name: &str| {
            params
                .spectrum(name)
                .filter(|s| s.is_finite())
                .ok_or_else(|| Error::new(format!("'{name}' has no value that f32 can hold")))
        };
        let (sigma_t, albedo) = (spectrum("sigma_t")?, spectrum("albedo")?);
        let Some(extent) = Extent::from_params(params)? else {
            return Ok(Self::Nothing);
        };
        if sigma_t.is_zero() {
            return Ok(Self::Nothing);
        }
        let common = Common {
            sigma_t,
            albedo,
            extent,
            lanes: params.lanes(),
        };
        if params.text("kind").as_deref() == Some("height_fog") {
            return Ok(Self::Fog(Box::new(Fog::new(params, common)?)));
        }
        let grey = sigma_t.is_grey(common.lanes);
        Ok(if grey {
            Self::GreyCloud(Box::new(tracked(Cloud::new(params, sigma_t[0], common)?)))
        } else {
            Self::Cloud(Box::new(tracked(Cloud::new(params, sigma_t, common)?)))
        })
    }
}

fn tracked<F>(field: F) -> Tracked<F> {
    Tracked {
        field,
        transmittance: Transmittance::Ratio,
    }
}

impl Medium for Procedural {
    fn info(&self) -> MediumInfo {
        match self {
            Self::Nothing => MediumInfo {
                bounds: Aabb::EMPTY,
                traits: medium_traits::EMPTY | medium_traits::GREY,
                ..MediumInfo::default()
            },
            Self::GreyCloud(m) => m.info(),
            Self::Cloud(m) => m.info(),
            Self::Fog(m) => m.info(),
        }
    }

    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        match self {
            Self::Nothing => Flight::vacuum(s.t1),
            Self::GreyCloud(m) => m.sample(s, u),
            Self::Cloud(m) => m.sample(s, u),
            Self::Fog(m) => m.sample(s, u),
        }
    }

    fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight {
        match self {
            Self::Nothing => Flight::vacuum(s.t1),
            Self::GreyCloud(m) => m.transmit(s, u),
            Self::Cloud(m) => m.transmit(s, u),
            Self::Fog(m) => m.transmit(s, u),
        }
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        match self {
            Self::Nothing => Spectrum::ZERO,
            Self::GreyCloud(m) => m.depth(s),
            Self::Cloud(m) => m.depth(s),
            Self::Fog(m) => m.depth(s),
        }
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        match self {
            Self::Nothing => Coefficients::default(),
            Self::GreyCloud(m) => m.coefficients(p),
            Self::Cloud(m) => m.coefficients(p),
            Self::Fog(m) => m.coefficients(p),
        }
    }
}

resolvent_api::export_plugin!(medium, Procedural);
