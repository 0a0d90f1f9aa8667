//! Medium `@NAME@`: a ball that is densest at its centre and fades out towards its surface.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `sigma_t` | float | 1/length | 1 | ≥ 0 | extinction at the centre |
//! | `albedo` | spectrum | | 1 | [0, 1] | σ_s/σ_t |
//! | `center` | vec3 | length | 0 | | centre in object space |
//! | `radius` | float | length | 1 | > 0 | radius in object space |
//! | `phase` | phase plugin | | isotropic | | phase function |
//!
//! σ_t(r) = `sigma_t` · (1 − r²/R²). The transform may stretch the ball into an ellipsoid.
//!
//! ```json
//! "media": { "ball": { "plugin": "@NAME@", "params": { "sigma_t": 8, "radius": 2 } } }
//! ```
//!
//! # How it works, and what to change
//!
//! A [`Field`] says three things about a ray: on which stretches the extinction has which bounds ([`Field::next_cell`]), what the
//! extinction is at a point ([`Field::extinction`]), and what happens at a collision ([`Field::collision`]). Resolvent's tracking
//! loops do the rest; they are compiled into this library with the field inlined. The only promise to keep is that the
//! extinction lies between minorant and majorant on every stretch: a majorant that is too small makes wrong images (the
//! program counts such points), one that is too large only costs time.

#[cfg(test)]
mod tests;

use resolvent_api::math::DVec3;
use resolvent_api::medium::medium_traits;
use resolvent_api::tracking::{Tracked, Transmittance};
use resolvent_api::{
    Cell, Coefficients, Decl, Error, Extent, Field, Flight, FlightDraws, Medium, MediumInfo,
    ParamDecl, Params, Plugin, Segment, Spectrum, Vec3,
};

/// Stretches a ray's way through the ball is cut into: more of them means tighter bounds.
const STRETCHES: u32 = 8;

/// The field. Its lanes agree (`Lanes = f32`); a medium whose extinction has a colour uses [`Spectrum`] there.
struct SoftBall {
    extent: Extent,
    sigma_t: f32,
    albedo: Spectrum,
    info: MediumInfo,
}

/// A ray on its way through the ball: r²/R² = `clear` + (t − `middle`)² · `rate`.
struct Passage {
    clear: f32,
    middle: f32,
    rate: f32,
    /// Half the ray's way through the ball.
    half: f32,
    /// The part of it that the segment covers.
    start: f32,
    end: f32,
    /// Stretches returned so far.
    stretch: u32,
}

impl Passage {
    /// 1 − r²/R² at `t`.
    fn density(&self, t: f32) -> f32 {
        let from_middle = t - self.middle;
        (1.0 - self.clear - from_middle * from_middle * self.rate).max(0.0)
    }
}

impl Field for SoftBall {
    type Lanes = f32;
    const EMISSIVE: bool = false;
    type Cursor<'a> = Passage;

    fn info(&self) -> MediumInfo {
        self.info
    }

    fn enter(&self, s: &Segment) -> Option<Passage> {
        let (start, end) = self.extent.clip(s)?;
        let wide = |v: [f32; 3]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
        let o = self.extent.to_unit().point(wide(s.o));
        let d = self.extent.to_unit().vector(wide(s.d));
        let rate = d.length_squared();
        let middle = -o.dot(d) / rate;
        let clear = (o + middle * d).length_squared();
        Some(Passage {
            clear: clear as f32,
            middle: middle as f32,
            rate: rate as f32,
            half: ((1.0 - clear).max(0.0) / rate).sqrt() as f32,
            start: start as f32,
            end: end as f32,
            stretch: 0,
        })
    }

    fn next_cell(&self, p: &mut Passage) -> Option<Cell<f32>> {
        // Stretches divide the ray's whole way, wherever the segment begins and ends: its flights must be the beginning of those
        // on a longer one, which is what the host relies on where media overlap.
        let at = |i: u32| p.middle + p.half * (2.0 * i as f32 / STRETCHES as f32 - 1.0);
        while p.stretch < STRETCHES {
            let (a, b) = (at(p.stretch), at(p.stretch + 1));
            p.stretch += 1;
            let (t0, t1) = (a.max(p.start), b.min(p.end));
            if t0 < t1 {
                // The density rises to the middle and falls from there; an even number of stretches meets there.
                let (low, high) = (p.density(a), p.density(b));
                return Some(Cell {
                    t0,
                    t1,
                    majorant: self.sigma_t * low.max(high),
                    minorant: self.sigma_t * low.min(high),
                });
            }
        }
        None
    }

    fn extinction(&self, p: &mut Passage, t: f32, _: u64) -> f32 {
        self.sigma_t * p.density(t)
    }

    fn collision(
        &self,
        p: &mut Passage,
        t: f32,
        known: Option<f32>,
        exact: bool,
    ) -> (Spectrum, Spectrum) {
        // Below the minorant a collision is accepted without a look-up; unless it must be exact, any value with the right
        // ratios between lanes will do.
        let sigma_t = match known {
            Some(sigma_t) => sigma_t,
            None if exact => self.extinction(p, t, 0),
            None => self.sigma_t,
        };
        let sigma_t = Spectrum::splat(sigma_t);
        (sigma_t, sigma_t * self.albedo)
    }

    fn emission(&self, _: &mut Passage, _: f32) -> Spectrum {
        Spectrum::ZERO
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = DVec3::new(p.x.into(), p.y.into(), p.z.into());
        let r2 = self.extent.to_unit().point(p).length_squared();
        let sigma_t = Spectrum::splat(self.sigma_t * (1.0 - r2).max(0.0) as f32);
        Coefficients {
            sigma_t,
            sigma_s: sigma_t * self.albedo,
            emission: Spectrum::ZERO,
        }
    }
}

/// The plugin: the field with the tracking loops around it.
pub struct SoftBallMedium(Tracked<SoftBall>);

impl Plugin for SoftBallMedium {
    const NAME: &'static str = "@NAME@";
    const SUMMARY: &'static str =
        "A ball that is densest at its centre and fades out towards its surface.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::float("sigma_t", "extinction at the centre")
            .unit("1/length")
            .default("1")
            .at_least(0.0)
            .build(),
        Decl::spectrum("albedo", "scattering over extinction")
            .default("1")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Extent::CENTER,
        Decl::float("radius", "radius in object space")
            .unit("length")
            .default("1")
            .above(0.0)
            .build(),
        Decl::plugin("phase", "phase", "phase function; isotropic unless given").build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let sigma_t = params.float("sigma_t")? as f32;
        if !sigma_t.is_finite() {
            return Err(Error::new("'sigma_t' is too large for f32"));
        }
        let Some(extent) = Extent::from_params(params)? else {
            return Err(Error::new("the ball has no volume"));
        };
        let albedo = params.spectrum("albedo").unwrap_or(Spectrum::ONE);
        let empty = if sigma_t == 0.0 {
            medium_traits::EMPTY
        } else {
            0
        };
        let info = MediumInfo {
            bounds: extent.bounds(),
            traits: medium_traits::GREY | empty,
            sigma_max: Spectrum::splat(sigma_t),
            memory: size_of::<SoftBall>() as u64,
            ..MediumInfo::default()
        };
        Ok(Self(Tracked {
            field: SoftBall {
                extent,
                sigma_t,
                albedo,
                info,
            },
            transmittance: Transmittance::Ratio,
        }))
    }
}

impl Medium for SoftBallMedium {
    fn info(&self) -> MediumInfo {
        self.0.info()
    }

    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        self.0.sample(s, u)
    }

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

resolvent_api::export_plugin!(medium, SoftBallMedium);
