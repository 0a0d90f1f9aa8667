//! Medium `homogeneous`: the same coefficients everywhere, every flight in closed form.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `sigma_t` | spectrum | 1/length | | ≥ 0 | extinction; give this (and `albedo`) or `sigma_a` and `sigma_s` |
//! | `albedo` | spectrum | | 1 | [0, 1] | σ_s/σ_t, with `sigma_t` only |
//! | `sigma_a` | spectrum | 1/length | 0 | ≥ 0 | absorption |
//! | `sigma_s` | spectrum | 1/length | 0 | ≥ 0 | scattering |
//! | `emission` | spectrum | W·sr⁻¹·m⁻³ | 0 | ≥ 0 | radiance emitted per length |
//! | `bounds` | 6 numbers | length | | min ≤ max | box in object space: min x, y, z, max x, y, z |
//! | `center` | vec3 | length | 0 | | centre of a sphere in object space |
//! | `radius` | float | length | | ≥ 0 | its radius; excludes `bounds` |
//! | `phase` | phase plugin | | isotropic | | phase function |
//!
//! Coefficients are per world length: the transform moves and shapes the extent (a sphere becomes an ellipsoid) and leaves
//! them alone. Without `bounds` and `radius` the medium has no boundary of its own, which is meant for the interior of a
//! mesh. A medium that emits, does not absorb and has no boundary shines infinitely towards an open sky.
//!
//! Transmittances are computed in `f64` and hold to 2·10⁻⁶ relative down to 10⁻³⁰, wherever in the scene the medium is.
//! Collisions are drawn with 53 bits, so optical depths from 10⁻⁶ to 10⁶ and beyond are sampled without a floor.
//!
//! ```json
//! "media": { "haze": { "plugin": "homogeneous", "params": {
//!   "sigma_t": 4, "albedo": [0.9, 0.95, 0.99], "bounds": [-1, 0, -1, 1, 1, 1],
//!   "phase": { "plugin": "hg", "params": { "g": 0.6 } }
//! } } }
//! ```

mod coefficients;
mod flight;
#[cfg(test)]
mod tests;

use resolvent_api::math::DVec3;
use resolvent_api::medium::{medium_traits, optical_depth};
use resolvent_api::{
    Aabb, Coefficients, Decl, Error, Extent, Flight, FlightDraws, Medium, MediumInfo, ParamDecl,
    Params, Plugin, Segment, Spectrum, Vec3,
};

/// The plugin.
#[derive(Clone, Copy, Debug)]
pub struct Homogeneous {
    /// `None`: no volume.
    extent: Option<Extent>,
    at: Coefficients,
    /// True if extinction is the same in all lanes in use.
    grey: bool,
    traits: u32,
}

impl Plugin for Homogeneous {
    const NAME: &'static str = "homogeneous";
    const SUMMARY: &'static str =
        "The same coefficients everywhere in a box, a sphere or a mesh; flights in closed form.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::spectrum("sigma_t", "extinction; excludes sigma_a and sigma_s")
            .unit("1/length")
            .at_least(0.0)
            .build(),
        Decl::spectrum(
            "albedo",
            "scattering over extinction, with sigma_t (1 unless given)",
        )
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        Decl::spectrum("sigma_a", "absorption (0 unless given); excludes sigma_t")
            .unit("1/length")
            .at_least(0.0)
            .build(),
        Decl::spectrum("sigma_s", "scattering (0 unless given); excludes sigma_t")
            .unit("1/length")
            .at_least(0.0)
            .build(),
        Decl::spectrum("emission", "radiance emitted per length")
            .unit("W/(sr m^3)")
            .default("0")
            .at_least(0.0)
            .build(),
        Extent::BOUNDS,
        Extent::CENTER,
        Extent::RADIUS,
        Decl::plugin("phase", "phase", "phase function; isotropic unless given").build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let at = coefficients::read(params)?;
        let extent = Extent::from_params(params)?;
        let lanes = params.lanes();
        let grey = at.sigma_t.is_grey(lanes);
        let mut traits = medium_traits::HOMOGENEOUS | medium_traits::ANALYTIC;
        let mut set = |bit, holds| traits |= if holds { bit } else { 0 };
        set(medium_traits::GREY, grey);
        set(medium_traits::EMISSIVE, !at.emission.is_zero());
        set(medium_traits::ABSORBS_ONLY, at.sigma_s.is_zero());
        set(
            medium_traits::EMPTY,
            extent.is_none() || (at.sigma_t.is_zero() && at.emission.is_zero()),
        );
        Ok(Self {
            extent,
            at,
            grey,
            traits,
        })
    }
}

impl Medium for Homogeneous {
    fn info(&self) -> MediumInfo {
        MediumInfo {
            bounds: self.extent.map_or(Aabb::EMPTY, |e| e.bounds()),
            traits: self.traits,
            sigma_max: self.at.sigma_t,
            memory: size_of::<Self>() as u64,
            ..MediumInfo::default()
        }
    }

    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        match self.inside(s) {
            Some(part) => self.fly(s, &part, u),
            None => Flight::vacuum(s.t1),
        }
    }

    fn transmit(&self, s: &Segment, _: &FlightDraws) -> Flight {
        match self.inside(s) {
            Some(part) => self.connect(s, &part),
            None => Flight::vacuum(s.t1),
        }
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        match self.inside(s) {
            Some(part) => self
                .at
                .sigma_t
                .map(|sigma| optical_depth(sigma, part.length) as f32),
            None => Spectrum::ZERO,
        }
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = DVec3::new(p.x.into(), p.y.into(), p.z.into());
        match self.extent {
            Some(e) if e.contains(p) => self.at,
            _ => Coefficients::default(),
        }
    }
}

resolvent_api::export_plugin!(medium, Homogeneous);
