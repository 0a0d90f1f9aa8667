//! Flights through constant coefficients.
//!
//! The hero lane draws the distance; every lane's transmittance over it is known. `value` = `track` = T lane by lane, and
//! since connections are deterministic their density `ratio` is 1: these three are already on a common scale that can't
//! underflow where it matters, because the hero lane never flies further than 37 mean free paths.

use crate::Homogeneous;
use resolvent_api::medium::optical_depth;
use resolvent_api::operator::flight_flags;
use resolvent_api::rng::{Stream, derive, exponential_fine};
use resolvent_api::{Event, Flight, FlightDraws, Segment, Spectrum};

/// The part of a segment that lies in the medium.
pub struct Part {
    /// Where it begins, in the segment's `t`.
    start: f64,
    /// World length of a unit of `t`: the length of the direction, whose rounding to `f32` counts at high optical depths.
    unit: f64,
    /// World length.
    pub length: f64,
}

/// a·b where nothing times infinity is nothing.
#[inline(always)]
fn amount(a: f32, b: f64) -> f32 {
    if a == 0.0 {
        0.0
    } else {
        (f64::from(a) * b) as f32
    }
}

impl Homogeneous {
    /// The part of the segment inside the medium.
    #[inline]
    pub(crate) fn inside(&self, s: &Segment) -> Option<Part> {
        let (a, b) = self.extent.as_ref()?.clip(s)?;
        let square = s.d.iter().map(|&x| f64::from(x) * f64::from(x));
        let unit = square.sum::<f64>().sqrt();
        Some(Part {
            start: a,
            unit,
            length: (b - a) * unit,
        })
    }

    /// Transmittance over a length.
    #[inline]
    fn transmittance(&self, length: f64) -> Spectrum {
        let one = |sigma: f32| (-optical_depth(sigma, length)).exp() as f32;
        if self.grey {
            Spectrum::splat(one(self.at.sigma_t[0]))
        } else {
            self.at.sigma_t.map(one)
        }
    }

    /// Free flight.
    #[inline]
    pub(crate) fn fly(&self, s: &Segment, part: &Part, u: &FlightDraws) -> Flight {
        let hero = f64::from(self.at.sigma_t[u.hero as usize & 3]);
        // A lane without extinction gives ∞ or NaN (0/0): both survive.
        let free = exponential_fine(u.tau, u.key) / hero;
        let t = (part.start + free / part.unit) as f32;
        // The rounded t decides too, so that a flight replayed up to `t` or less survives.
        let collided = free < part.length && t < s.t1;
        let length = if collided { free } else { part.length };
        let transmittance = self.transmittance(length);
        let mut out = Flight {
            value: transmittance,
            track: transmittance,
            ratio: Spectrum::ONE,
            emitted: self.emitted(part, length, u),
            t: s.t1,
            ..Flight::default()
        };
        if collided {
            out.t = t;
            out.event = Event::Collided as u32;
            out.sigma_t = self.at.sigma_t;
            out.sigma_s = self.at.sigma_s;
        }
        out
    }

    /// A connection: exact, so nothing is drawn.
    #[inline]
    pub(crate) fn connect(&self, s: &Segment, part: &Part) -> Flight {
        let transmittance = self.transmittance(part.length);
        Flight {
            value: transmittance,
            track: transmittance,
            ratio: Spectrum::ONE,
            t: s.t1,
            ..Flight::default()
        }
    }

    /// Emission met on a flight that went over `length` of the part.
    ///
    /// Reaching a point already has the probability of the transmittance, so what is met on the way counts fully: this
    /// track-length form stays unbiased if another medium's collision cuts the flight short. If that can't be, the
    /// expectation over the whole part, j (1 − exp(−σL))/σ, has no noise at all.
    #[inline]
    fn emitted(&self, part: &Part, length: f64, u: &FlightDraws) -> Spectrum {
        let j = self.at.emission;
        if j.is_zero() {
            return Spectrum::ZERO;
        }
        let before = f64::from(u.prior.mean(u.lanes));
        if u.flags & flight_flags::ALONE != 0 {
            return j.zip(self.at.sigma_t, |j, sigma| {
                let depth = optical_depth(sigma, part.length);
                // −expm1 keeps the digits that 1 − exp would lose in thin media.
                let path = if sigma == 0.0 {
                    part.length
                } else {
                    -(-depth).exp_m1() / f64::from(sigma)
                };
                amount(j, path / before)
            });
        }
        if self.grey {
            return j.map(|j| amount(j, length / before));
        }
        // Lane by lane T_λ over the mean of the lanes' T, at one point of the way: four exponentials over their sum have
        // no closed integral.
        let at = length * f64::from(Stream::new(derive(u.key, 1)).uniform());
        let least = (0..u.lanes as usize)
            .map(|i| optical_depth(self.at.sigma_t[i], at))
            .fold(f64::INFINITY, f64::min);
        let reached = self.at.sigma_t.map(|sigma| {
            // The least depth is taken out of all, so that the mean is never 0/0; ∞ − ∞ means no difference.
            let over = optical_depth(sigma, at) - least;
            if over.is_nan() {
                1.0
            } else {
                (-over).exp() as f32
            }
        });
        let mean = f64::from((reached * u.prior).mean(u.lanes));
        j.zip(reached, |j, w| amount(j * w, length / mean))
    }
}
