//! The primary samples of a path sampled from both ends: from a net, or from a Markov chain.

use crate::sampler::{Purpose, Sampler};
use resolvent_api::rng::{Stream, derive};
use resolvent_api::{FlightDraws, ScatterDraws, Spectrum};

/// Which end a walk starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The sensor; radiance is carried.
    Sensor = 0,
    /// A light; importance is carried.
    Light = 1,
}

/// A source of primary samples, each uniform in [0, 1) and named by walk, bounce and purpose.
pub trait Draws {
    /// Four numbers.
    fn four(&mut self, end: End, bounce: u32, purpose: Purpose) -> [f32; 4];
    /// A key for streams of any length; in a chain it stays when the numbers move a little.
    fn key(&mut self, end: End, bounce: u32, purpose: Purpose) -> u64;
    /// The lane that leads.
    fn hero(&self) -> u32;
    /// Lanes in use.
    fn lanes(&self) -> u32;

    /// A free flight; `prior` is the path's density per lane.
    #[inline(always)]
    fn flight(&mut self, end: End, bounce: u32, prior: Spectrum) -> FlightDraws {
        let [tau, event, ..] = self.four(end, bounce, Purpose::Flight);
        FlightDraws {
            key: self.key(end, bounce, Purpose::Flight),
            tau,
            event,
            hero: self.hero(),
            lanes: self.lanes(),
            flags: 0,
            reserved: 0,
            prior,
        }
    }

    /// A scattering decision, and a number for the roulette after it.
    #[inline(always)]
    fn scatter(&mut self, end: End, bounce: u32) -> (ScatterDraws, f32) {
        let [a, b, c, d] = self.four(end, bounce, Purpose::Scatter);
        let dir = [a, b];
        (ScatterDraws { lobe: c, dir }, d)
    }

    /// The transmittance between vertex `s` of the walk from the light and vertex `t` of the walk from the sensor.
    #[inline(always)]
    fn connection(&mut self, s: u32, t: u32) -> FlightDraws {
        let key = derive(
            self.key(End::Sensor, t, Purpose::Connection),
            u64::from(s) ^ 0x7061_6972,
        );
        let mut numbers = Stream::new(key ^ 1);
        FlightDraws {
            key,
            tau: numbers.uniform(),
            event: numbers.uniform(),
            hero: self.hero(),
            lanes: self.lanes(),
            flags: 0,
            reserved: 0,
            prior: Spectrum::ONE,
        }
    }
}

/// Numbers of a net for both walks.
#[derive(Clone, Copy, Debug)]
pub struct NetDraws {
    walks: [Sampler; 2],
    lanes: u32,
}

impl NetDraws {
    /// The numbers of one sample of one pixel, see [`Sampler::new`].
    pub fn new(seed: u64, pixel: u64, sample: u32, lanes: u32) -> Self {
        let sensor = Sampler::new(seed, pixel, sample, lanes);
        Self {
            walks: [sensor, sensor.light_walk()],
            lanes,
        }
    }
}

impl Draws for NetDraws {
    #[inline(always)]
    fn four(&mut self, end: End, bounce: u32, purpose: Purpose) -> [f32; 4] {
        self.walks[end as usize].four(bounce, purpose)
    }

    #[inline(always)]
    fn key(&mut self, end: End, bounce: u32, purpose: Purpose) -> u64 {
        self.walks[end as usize].key(0x4000_0000 + u64::from(bounce) * 8 + purpose as u64)
    }

    #[inline(always)]
    fn hero(&self) -> u32 {
        self.walks[0].hero()
    }

    #[inline(always)]
    fn lanes(&self) -> u32 {
        self.lanes
    }
}
