//! Medium `perlin-worley`: a procedural cloud in a ball.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `sigma_t` | float | 1/length | 10 | ≥ 0 | extinction where the cloud is densest |
//! | `albedo` | spectrum | | 0.99 | [0, 1] | σ_s/σ_t |
//! | `radius` | float | length | 1 | > 0 | radius in object space |
//! | `frequency` | float | 1/radius | 2 | > 0 | features of the first octave |
//! | `octaves` | int | | 4 | [1, 8] | octaves of noise |
//! | `coverage` | float | | 0.5 | [0, 1] | how much of the ball is cloud |
//! | `seed` | int | | 0 | ≥ 0 | another cloud |
//! | `phase` | phase plugin | | isotropic | | phase function |
//!
//! σ_t(x) = `sigma_t` · clamp(4 (n(x) + b(r) − 1)), with the noise n ∈ [0, 1] of [`noise`] and b(r) = `coverage` · (1 − r²/R²)
//! · 2 − ½. As n ≤ 1, the extinction is at most `sigma_t` · clamp(4 b(r)): the majorant on a stretch of a ray is that at the point of
//! the stretch nearest to the centre, known without a look at the noise.

mod noise;

use resolvent_api::math::DVec3;
use resolvent_api::medium::medium_traits;
use resolvent_api::tracking::{Tracked, Transmittance};
use resolvent_api::{
    Cell, Coefficients, Decl, Error, Extent, Field, Flight, FlightDraws, Medium, MediumInfo,
    ParamDecl, Params, Plugin, Segment, Spectrum, Vec3,
};

/// Stretches a ray's way through the ball is cut into.
const STRETCHES: u32 = 16;
/// How fast the cloud's edge rises to full density.
const SLOPE: f64 = 4.0;

struct Cloud {
    extent: Extent,
    sigma_t: f32,
    albedo: Spectrum,
    frequency: f64,
    octaves: u32,
    coverage: f64,
    seed: u64,
    info: MediumInfo,
}

impl Cloud {
    /// b(r) from r²/R².
    fn body(&self, r2: f64) -> f64 {
        self.coverage * (1.0 - r2) * 2.0 - 0.5
    }

    /// Density relative to the largest, at a point of the unit ball.
    fn density(&self, p: DVec3) -> f32 {
        let r2 = p.length_squared();
        let body = self.body(r2);
        if r2 >= 1.0 || body <= 0.0 {
            return 0.0;
        }
        let n = noise::perlin_worley(p * self.frequency, self.octaves, self.seed);
        (SLOPE * (n + body - 1.0)).clamp(0.0, 1.0) as f32
    }

    /// A bound of it where r²/R² is at least this.
    fn bound(&self, r2: f64) -> f32 {
        // Rounded up: look-ups work in double precision, too, and round to nearest.
        ((SLOPE * self.body(r2)).clamp(0.0, 1.0) as f32).next_up()
    }
}

/// A ray on its way through the unit ball.
struct Passage {
    o: DVec3,
    d: DVec3,
    /// Where it is nearest to the centre, and half its way through the ball.
    middle: f64,
    half: f64,
    start: f32,
    end: f32,
    stretch: u32,
}

impl Passage {
    fn at(&self, t: f64) -> DVec3 {
        self.o + t * self.d
    }
}

impl Field for Cloud {
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
            o,
            d,
            middle,
            half: ((1.0 - clear).max(0.0) / rate).sqrt(),
            start: start as f32,
            end: end as f32,
            stretch: 0,
        })
    }

    fn next_cell(&self, p: &mut Passage) -> Option<Cell<f32>> {
        // Stretches divide the ray's whole way, wherever the segment begins and ends.
        let at = |i: u32| p.middle + p.half * (2.0 * f64::from(i) / f64::from(STRETCHES) - 1.0);
        while p.stretch < STRETCHES {
            let (a, b) = (at(p.stretch), at(p.stretch + 1));
            p.stretch += 1;
            let (t0, t1) = ((a as f32).max(p.start), (b as f32).min(p.end));
            if t0 < t1 {
                // An even number of stretches meets in the middle, so the nearest point is one of the ends; a little farther in, because
                // ends are rounded to single precision.
                let nearest = p.at(a).length_squared().min(p.at(b).length_squared());
                return Some(Cell {
                    t0,
                    t1,
                    majorant: self.sigma_t * self.bound(nearest - 1e-5),
                    minorant: 0.0,
                });
            }
        }
        None
    }

    fn extinction(&self, p: &mut Passage, t: f32, _: u64) -> f32 {
        self.sigma_t * self.density(p.at(t.into()))
    }

    fn collision(
        &self,
        p: &mut Passage,
        t: f32,
        known: Option<f32>,
        _: bool,
    ) -> (Spectrum, Spectrum) {
        let sigma_t = Spectrum::splat(known.unwrap_or_else(|| self.extinction(p, t, 0)));
        (sigma_t, sigma_t * self.albedo)
    }

    fn emission(&self, _: &mut Passage, _: f32) -> Spectrum {
        Spectrum::ZERO
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = DVec3::new(p.x.into(), p.y.into(), p.z.into());
        let sigma_t = self.sigma_t * self.density(self.extent.to_unit().point(p));
        let sigma_t = Spectrum::splat(sigma_t);
        Coefficients {
            sigma_t,
            sigma_s: sigma_t * self.albedo,
            emission: Spectrum::ZERO,
        }
    }
}

/// The plugin: the field with the tracking loops around it.
pub struct PerlinWorley(Tracked<Cloud>);

impl Plugin for PerlinWorley {
    const NAME: &'static str = "perlin-worley";
    const SUMMARY: &'static str = "A procedural cloud in a ball.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::float("sigma_t", "extinction where the cloud is densest")
            .unit("1/length")
            .default("10")
            .at_least(0.0)
            .build(),
        Decl::spectrum("albedo", "scattering over extinction")
            .default("0.99")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::float("radius", "radius in object space")
            .unit("length")
            .default("1")
            .above(0.0)
            .build(),
        Decl::float("frequency", "features of the first octave in a radius")
            .unit("1/radius")
            .default("2")
            .above(0.0)
            .build(),
        Decl::int("octaves", "octaves of noise")
            .default("4")
            .at_least(1.0)
            .at_most(8.0)
            .build(),
        Decl::float("coverage", "how much of the ball is cloud")
            .default("0.5")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::int("seed", "another cloud").default("0").at_least(0.0).build(),
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
        let coverage = params.float("coverage")?;
        let mut field = Cloud {
            extent,
            sigma_t,
            albedo: params.spectrum("albedo").unwrap_or(Spectrum::ONE),
            frequency: params.float("frequency")?,
            octaves: params.int("octaves")? as u32,
            coverage,
            seed: params.int("seed")? as u64,
            info: MediumInfo::default(),
        };
        let empty = sigma_t == 0.0 || field.body(0.0) <= 0.0;
        field.info = MediumInfo {
            bounds: field.extent.bounds(),
            traits: medium_traits::GREY | if empty { medium_traits::EMPTY } else { 0 },
            sigma_max: Spectrum::splat(sigma_t * field.bound(0.0)),
            memory: size_of::<Cloud>() as u64,
            ..MediumInfo::default()
        };
        Ok(Self(Tracked {
            field,
            transmittance: Transmittance::Ratio,
        }))
    }
}

impl Medium for PerlinWorley {
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

resolvent_api::export_plugin!(medium, PerlinWorley);
