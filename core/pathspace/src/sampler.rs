//! The primary samples of a path: Owen-scrambled Sobol' for the first bounces, hashed numbers beyond.
//!
//! Samples come in [`nets`] that are scrambled independently of each other: the spread of nets is what errors are estimated from.
//! Every number is a function of (seed, pixel, sample, bounce, purpose) alone.
//!
//! The first two directions of a walk share one four-dimensional net: light scattered three times is an integral over both. (On
//! bench/surface_only that errs by 4 % less than nets of a direction and the point on a light that is connected to where it leads,
//! which is how the numbers of later bounces are laid out.)

use crate::{nets, sobol};
use resolvent_api::rng::{derive, mix, unit};
use resolvent_api::{FlightDraws, ScatterDraws, Spectrum};

/// Bounces whose decisions use the net. Later ones gain nothing from it (their integrand has too many dimensions).
const NET_BOUNCES: u32 = 2;

/// What a group of numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Film and lens.
    Camera = 0,
    /// A free flight.
    Flight = 1,
    /// A direction, and a roulette.
    Scatter = 2,
    /// A light and a point on it.
    Light = 3,
    /// A transmittance.
    Connection = 4,
    /// A branch of the walk.
    Branch = 5,
    /// The vertex a light walk starts from.
    Emission = 6,
    /// The direction it starts in, and a point on the lens.
    Ray = 7,
}

/// The numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    net_key: u64,
    sample_key: u64,
    index: u32,
    lanes: u32,
    hero: u32,
    flights: bool,
}

/// The numbers of one vertex of a walk.
#[derive(Clone, Copy, Debug)]
pub struct Bounce {
    /// Chooses a light to connect to.
    pub choice: f32,
    /// Chooses the point on it.
    pub point: [f32; 2],
    /// For the roulette of the connection.
    pub chance: f32,
    /// Chooses the direction to go on in.
    pub scatter: ScatterDraws,
    /// For the roulette of the walk.
    pub roulette: f32,
    /// For the vertex in that direction.
    pub next: [f32; 2],
}

impl Sampler {
    /// The numbers of sample `sample` of pixel `pixel` of the image `seed`, for `lanes` lanes in use.
    #[inline(always)]
    pub fn new(seed: u64, pixel: u64, sample: u32, lanes: u32) -> Self {
        let pixel_key = derive(mix(seed ^ 0x5eed), pixel);
        let begin = nets::around(sample).start;
        let index = sample - begin;
        let net_key = derive(pixel_key, u64::from(begin));
        let sample_key = derive(net_key, 0x1_0000 + u64::from(index));
        // One lane after the other from a random start: within a net every lane leads about equally often.
        let hero = (((net_key >> 40) as u32).wrapping_add(index)) % lanes;
        Self {
            net_key,
            sample_key,
            index,
            lanes,
            hero,
            flights: true,
        }
    }

    /// The same numbers but for those of flights, which are left out: for scenes without media.
    #[inline(always)]
    pub fn without_flights(mut self, without: bool) -> Self {
        self.flights = !without;
        self
    }

    /// The numbers of a branch that leaves the path at a vertex: unrelated to those of the path.
    #[inline(always)]
    pub fn branch(&self, bounce: u32) -> Self {
        let purpose = 0x6272_616e_6300_0000 + u64::from(bounce);
        Self {
            net_key: derive(self.net_key, purpose),
            sample_key: derive(self.sample_key, purpose),
            ..*self
        }
    }

    /// The numbers of a walk from a light: unrelated to those of the walk from the sensor, but with the same hero.
    #[inline(always)]
    pub fn light_walk(&self) -> Self {
        let purpose = 0x6c69_6768_7400_0000;
        Self {
            net_key: derive(self.net_key, purpose),
            sample_key: derive(self.sample_key, purpose),
            ..*self
        }
    }

    /// The lane that leads.
    #[inline(always)]
    pub fn hero(&self) -> u32 {
        self.hero
    }

    /// A key for streams of any length.
    #[inline(always)]
    pub fn key(&self, purpose: u64) -> u64 {
        derive(self.sample_key, purpose)
    }

    /// Four numbers for a purpose at a bounce.
    #[inline(always)]
    pub fn four(&self, bounce: u32, purpose: Purpose) -> [f32; 4] {
        let dimension = u64::from(bounce) * 8 + purpose as u64;
        if bounce < NET_BOUNCES {
            let [a, b, c, d] = sobol::point(self.index, derive(self.net_key, 0x2000 + dimension));
            [unit(a), unit(b), unit(c), unit(d)]
        } else {
            let a = derive(self.sample_key, dimension);
            let b = mix(a.wrapping_add(STEP));
            [
                unit((a >> 32) as u32),
                unit(a as u32),
                unit((b >> 32) as u32),
                unit(b as u32),
            ]
        }
    }

    /// The first two numbers of [`Sampler::four`], or the last two.
    #[inline(always)]
    fn two(&self, bounce: u32, purpose: Purpose, last: bool) -> [f32; 2] {
        let dimension = u64::from(bounce) * 8 + purpose as u64;
        if bounce < NET_BOUNCES {
            let key = derive(self.net_key, 0x2000 + dimension);
            sobol::half(self.index, key, last).map(unit)
        } else {
            let a = derive(self.sample_key, dimension);
            let bits = if last { mix(a.wrapping_add(STEP)) } else { a };
            [unit((bits >> 32) as u32), unit(bits as u32)]
        }
    }

    /// The numbers of the vertex after `bounce` bounces. `shared` is [`Bounce::next`] of the vertex before, at the first one
    /// [`Sampler::first_point`].
    #[inline(always)]
    pub fn bounce(&self, bounce: u32, shared: [f32; 2]) -> Bounce {
        let [choice, chance, lobe, roulette] = self.four(bounce, Purpose::Light);
        let [x, y, a, b] = self.four(bounce, Purpose::Scatter);
        let (dir, point) = if bounce == 1 {
            (shared, [x, y])
        } else {
            ([x, y], shared)
        };
        Bounce {
            choice,
            point,
            chance,
            scatter: ScatterDraws { lobe, dir },
            roulette,
            next: [a, b],
        }
    }

    /// The point on a light that the first vertex is connected to.
    #[inline(always)]
    pub fn first_point(&self) -> [f32; 2] {
        self.two(0, Purpose::Camera, true)
    }

    /// Film offset within the pixel and lens position.
    #[inline(always)]
    pub fn camera(&self) -> ([f32; 2], [f32; 2]) {
        (
            self.two(0, Purpose::Camera, false),
            self.two(0, Purpose::Flight, true),
        )
    }

    /// A free flight; `prior` is the path's density per lane.
    #[inline(always)]
    pub fn flight(&self, bounce: u32, prior: Spectrum) -> FlightDraws {
        self.draws(bounce, Purpose::Flight, prior)
    }

    /// The transmittance of a connection.
    #[inline(always)]
    pub fn connection(&self, bounce: u32, prior: Spectrum) -> FlightDraws {
        self.draws(bounce, Purpose::Connection, prior)
    }

    /// A transmittance beside those of the path; `purpose` tells them apart.
    #[inline(always)]
    pub fn unrelated(&self, purpose: u64) -> FlightDraws {
        let key = if self.flights { self.key(purpose) } else { 0 };
        FlightDraws {
            key,
            tau: unit((key >> 32) as u32),
            event: unit(key as u32),
            hero: self.hero,
            lanes: self.lanes,
            prior: Spectrum::ONE,
            ..FlightDraws::default()
        }
    }

    #[inline(always)]
    fn draws(&self, bounce: u32, purpose: Purpose, prior: Spectrum) -> FlightDraws {
        if !self.flights {
            return FlightDraws {
                hero: self.hero,
                lanes: self.lanes,
                prior,
                ..FlightDraws::default()
            };
        }
        let [tau, event] = self.two(bounce, purpose, false);
        FlightDraws {
            key: derive(
                self.sample_key,
                0x4000_0000 + u64::from(bounce) * 8 + purpose as u64,
            ),
            tau,
            event,
            hero: self.hero,
            lanes: self.lanes,
            flags: 0,
            reserved: 0,
            prior,
        }
    }

    /// Whether a branch leaves the path, and its direction.
    #[inline(always)]
    pub fn branching(&self, bounce: u32) -> (f32, ScatterDraws) {
        let [a, b, c, d] = self.four(bounce, Purpose::Branch);
        (
            d,
            ScatterDraws {
                lobe: c,
                dir: [a, b],
            },
        )
    }
}

/// Between the two words that a hash gives four numbers from.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_repeat_and_differ() {
        let a = Sampler::new(7, 123, 45, 3);
        let b = Sampler::new(7, 123, 45, 3);
        let c = Sampler::new(7, 124, 45, 3);
        let numbers = |s: Sampler, bounce| {
            let b = s.bounce(bounce, s.first_point());
            let ScatterDraws { lobe, dir } = b.scatter;
            [
                b.choice, b.chance, b.roulette, lobe, b.point[0], dir[0], dir[1], b.next[1],
            ]
        };
        for bounce in [0, 3] {
            assert_eq!(numbers(a, bounce), numbers(b, bounce));
            let (x, y) = (numbers(a, bounce), numbers(c, bounce));
            assert!(x.iter().zip(y).all(|(x, y)| *x != y), "{x:?} {y:?}");
        }
        assert_ne!(a.camera(), c.camera());
        assert_ne!(
            a.flight(0, Spectrum::ONE).key,
            a.connection(0, Spectrum::ONE).key
        );
    }

    /// Every lane leads equally often.
    #[test]
    fn heroes_are_uniform() {
        let n = 30_000;
        let mut count = [0u32; 3];
        for sample in 0..n {
            count[Sampler::new(1, 9, sample, 3).flight(0, Spectrum::ONE).hero as usize] += 1;
        }
        for c in count {
            let expected = n as f64 / 3.0;
            assert!(
                (c as f64 - expected).abs() < 5.0 * (expected * 2.0 / 3.0).sqrt(),
                "{count:?}"
            );
        }
    }
}
