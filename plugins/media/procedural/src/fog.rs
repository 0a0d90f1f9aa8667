//! Exponential height fog, every flight in closed form.
//!
//! Along a ray the height is linear in t, so the profile exp(−(h − h₀)/H) is p exp(k t), whose integral over a length L is
//! g(L) = p (exp(k L) − 1)/k. All lanes share g: τ_λ = σ_λ g. A collision lies where g reaches −ln(1−u)/σ, at
//! L = ln(1 + k g/p)/k, or nowhere if the fog thins out before (k < 0 and k g/p ≤ −1).

use crate::Common;
use resolvent_api::math::DVec3;
use resolvent_api::medium::{medium_traits, optical_depth};
use resolvent_api::rng::exponential_fine;
use resolvent_api::{
    Aabb, Coefficients, Error, Event, Extent, Flight, FlightDraws, Medium, MediumInfo, Params,
    Segment, Spectrum, Vec3,
};

/// Fog.
pub struct Fog {
    extent: Extent,
    /// −(h − h₀)/H at a world point p is `rise`·p + `offset`.
    rise: DVec3,
    offset: f64,
    /// Nothing below h₀.
    floor: bool,
    sigma_t: Spectrum,
    albedo: Spectrum,
    info: MediumInfo,
}

/// The part of a ray in the fog.
struct Part {
    /// Where it begins, in the segment's `t`.
    start: f64,
    /// Its length in units of `t`.
    length: f64,
    /// World length of a unit of `t`.
    unit: f64,
    /// Logarithm of the profile at the start: the profile itself may be below the smallest number.
    log_p: f64,
    /// Rate of that logarithm, per unit of `t`.
    k: f64,
}

/// Below this the series' second term is beyond `f64`.
const TINY: f64 = 1e-8;
/// Above this 1 + y is y.
const HUGE: f64 = 1e17;

impl Part {
    /// ∫ profile over the first `l` of the part.
    #[inline]
    fn amount(&self, l: f64) -> f64 {
        let x = self.k * l;
        let per_unit = if self.k == 0.0 {
            self.log_p.exp() * l
        } else if x.abs() < TINY {
            self.log_p.exp() * l * (1.0 + 0.5 * x)
        } else if self.k > 0.0 {
            // From the dense end, so that nothing overflows on the way down from far above.
            (self.log_p + x).exp() * -(-x).exp_m1() / self.k
        } else {
            self.log_p.exp() * x.exp_m1() / self.k
        };
        per_unit * self.unit
    }

    /// The length over which [`Part::amount`] reaches `g`; infinite or NaN if it never does.
    #[inline]
    fn reach(&self, g: f64) -> f64 {
        let g = g / self.unit;
        let y = self.k * g * (-self.log_p).exp();
        if y.abs() < TINY {
            g * (-self.log_p).exp() * (1.0 - 0.5 * y)
        } else if y > HUGE {
            ((self.k * g).ln() - self.log_p) / self.k
        } else if y > -1.0 {
            y.ln_1p() / self.k
        } else {
            f64::INFINITY
        }
    }

    /// The profile after a length.
    #[inline]
    fn profile(&self, l: f64) -> f64 {
        (self.log_p + self.k * l).exp()
    }
}

impl Fog {
    /// Reads the fog's parameters.
    pub(crate) fn new(params: &Params<'_>, common: Common) -> Result<Self, Error> {
        let axis = params.vec3("axis").unwrap_or(DVec3::Y);
        let Some(axis) = axis.try_normalize() else {
            return Err(Error::new("'axis' must not be 0"));
        };
        let (height, scale) = (params.float("height")?, params.float("scale_height")?);
        let Some(to_object) = params.to_world().inverse() else {
            return Err(Error::new(
                "the transform squeezes space flat and can't be inverted",
            ));
        };
        let rise = -DVec3::from(to_object.columns.map(|c| c.dot(axis))) / scale;
        let offset = -(to_object.translation.dot(axis) - height) / scale;
        let floor = common.extent.is_all();
        // The lowest point inside is the densest.
        let top = if floor {
            0.0
        } else {
            let (center, half) = common.extent.object_box();
            let across = half * axis;
            let reach = if common.extent.is_ball() {
                across.length()
            } else {
                across.abs().element_sum()
            };
            -(center.dot(axis) - reach - height) / scale
        };
        // A few ulp: the profile is evaluated at positions rounded to f32.
        let sigma_max = common
            .sigma_t
            .map(|s| (f64::from(s) * top.exp() * 1.000_001) as f32);
        if !sigma_max.is_finite() || !rise.is_finite() || !offset.is_finite() {
            return Err(Error::new(format!(
                "the fog is too dense at the bottom of its extent: exp({top:.0}) times 'sigma_t'"
            )));
        }
        let mut traits = medium_traits::ANALYTIC;
        if common.sigma_t.is_grey(common.lanes) {
            traits |= medium_traits::GREY;
        }
        if (common.sigma_t * common.albedo).is_zero() {
            traits |= medium_traits::ABSORBS_ONLY;
        }
        let mut fog = Self {
            extent: common.extent,
            rise,
            offset,
            floor,
            sigma_t: common.sigma_t,
            albedo: common.albedo,
            info: MediumInfo {
                bounds: common.extent.bounds(),
                traits,
                sigma_max,
                memory: size_of::<Self>() as u64,
                ..MediumInfo::default()
            },
        };
        if floor {
            fog.info.bounds = fog.above();
        }
        Ok(fog)
    }

    /// Bounds of the half-space h ≥ h₀: half of everything if up is a coordinate axis of the world, else everything.
    fn above(&self) -> Aabb {
        let mut out = Aabb::ALL;
        for i in 0..3 {
            let along = self.rise[i];
            if along != 0.0 && along.abs() == self.rise.abs().element_sum() {
                let plane = (-self.offset / along) as f32;
                if along < 0.0 {
                    out.min[i] = plane.next_down();
                } else {
                    out.max[i] = plane.next_up();
                }
            }
        }
        out
    }

    /// −(h − h₀)/H at a point.
    fn exponent(&self, p: DVec3) -> f64 {
        self.rise.dot(p) + self.offset
    }

    fn part(&self, s: &Segment) -> Option<Part> {
        let (mut a, mut b) = self.extent.clip(s)?;
        let wide = |v: [f32; 3]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
        let (o, d) = (wide(s.o), wide(s.d));
        let (e, k) = (self.exponent(o), self.rise.dot(d));
        if self.floor {
            // Inside where e + k t ≤ 0.
            if k == 0.0 {
                if e > 0.0 {
                    return None;
                }
            } else if k > 0.0 {
                b = b.min(-e / k);
            } else {
                a = a.max(-e / k);
            }
            if !(a < b) {
                return None;
            }
        }
        Some(Part {
            start: a,
            length: b - a,
            unit: d.length(),
            log_p: e + k * a,
            k,
        })
    }

    fn transmittance(&self, g: f64) -> Spectrum {
        self.sigma_t.map(|s| (-optical_depth(s, g)).exp() as f32)
    }
}

impl Medium for Fog {
    fn info(&self) -> MediumInfo {
        self.info
    }

    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        let mut out = Flight::vacuum(s.t1);
        let Some(part) = self.part(s) else {
            return out;
        };
        let hero = f64::from(self.sigma_t[u.hero as usize & 3]);
        let drawn = exponential_fine(u.tau, u.key) / hero;
        let length = part.reach(drawn);
        let t = (part.start + length) as f32;
        // The rounded t decides too, so that a flight replayed up to `t` or less survives.
        let g = if length < part.length && t < s.t1 {
            out.t = t;
            out.event = Event::Collided as u32;
            let profile = part.profile(f64::from(t) - part.start);
            out.sigma_t = self.sigma_t * profile as f32;
            out.sigma_s = out.sigma_t * self.albedo;
            drawn
        } else {
            part.amount(part.length)
        };
        out.value = self.transmittance(g);
        out.track = out.value;
        out
    }

    fn transmit(&self, s: &Segment, _: &FlightDraws) -> Flight {
        let mut out = Flight::vacuum(s.t1);
        if let Some(part) = self.part(s) {
            out.value = self.transmittance(part.amount(part.length));
            out.track = out.value;
        }
        out
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        match self.part(s) {
            Some(part) => {
                let g = part.amount(part.length);
                self.sigma_t.map(|sigma| optical_depth(sigma, g) as f32)
            }
            None => Spectrum::ZERO,
        }
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let p = DVec3::new(p.x.into(), p.y.into(), p.z.into());
        let e = self.exponent(p);
        if !self.extent.contains(p) || (self.floor && e > 0.0) {
            return Coefficients::default();
        }
        let sigma_t = self.sigma_t * e.exp() as f32;
        Coefficients {
            sigma_t,
            sigma_s: sigma_t * self.albedo,
            emission: Spectrum::ZERO,
        }
    }
}
