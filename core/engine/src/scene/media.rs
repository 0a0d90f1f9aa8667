//! Media along a segment: none, one, or several that superpose.
//!
//! Extinctions add, so the collisions of overlapping media are independent Poisson processes: the nearest of the media's
//! own collisions is the collision of the sum, and transmittances multiply. No medium needs to know another.

use super::hierarchy::Walk;
use super::view::View;
use super::{PlacedMedium, Scene};
use resolvent_api::Vec3;
use resolvent_api::abi::{Status, scene_traits};
use resolvent_api::operator::{Flight, FlightDraws, Segment, flight_flags};
use resolvent_api::rng::derive;
use resolvent_api::{Aabb, Spectrum};
use std::sync::atomic::Ordering;

/// Kernels without media.
pub const NONE: u8 = 0;
/// Kernels with a single, free-standing medium.
pub const ONE: u8 = 1;
/// Kernels with any media.
pub const MANY: u8 = 2;
/// Kernels with media that all absorb only: light fades along the way, where an analogue walk would end in a collision that
/// scatters nothing. Free flights and connections are then the same technique, of the same density: `track` = `ratio`.
pub const FADING: u8 = 3;

/// The outcome of a free flight through all media on a segment.
pub struct Passage {
    /// The joint flight.
    pub flight: Flight,
    /// The medium that was collided with.
    pub medium: u32,
    /// True if any medium was met.
    pub met: bool,
}

impl View<'_> {
    /// Free flight along `o + t d` for `t0 ≤ t ≤ t1`.
    #[inline(always)]
    pub(super) fn fly<const MEDIA: u8>(
        &self,
        s: &Segment,
        inside: u64,
        u: &FlightDraws,
    ) -> Result<Passage, Status> {
        match MEDIA {
            NONE => Ok(nothing(s.t1)),
            ONE => {
                let m = &self.scene.media[0];
                let Some(clipped) = clip(m.medium.info.bounds, s) else {
                    return Ok(nothing(s.t1));
                };
                // Nothing else can cut the flight short.
                let u = FlightDraws {
                    flags: u.flags | flight_flags::ALONE,
                    ..*u
                };
                let mut flight = self.flight(m, &clipped, &u)?;
                if !flight.collided() {
                    flight.t = s.t1;
                }
                Ok(Passage {
                    flight,
                    medium: 0,
                    met: true,
                })
            }
            FADING => {
                let (mut flight, met) = self.fade(s, inside, u)?;
                if met && self.scene.traits & scene_traits::EMISSIVE_MEDIA != 0 {
                    flight.emitted = self.glow(s, inside, u)?;
                }
                Ok(Passage {
                    flight,
                    medium: 0,
                    met,
                })
            }
            _ => self.fly_through_all(s, inside, u),
        }
    }

    /// Transmittance of media that absorb only, as a flight that always arrives.
    fn fade(&self, s: &Segment, inside: u64, u: &FlightDraws) -> Result<(Flight, bool), Status> {
        let (mut joint, mut met) = (Flight::vacuum(s.t1), false);
        let mut near = Near::of(self.scene, inside);
        while let Some((i, m, part)) = near.next(s) {
            let flight = self.transmittance(m, &part, &keyed(u, i))?;
            met = true;
            // The lanes share one estimate, so its density counts lane by lane (one that did not survive has value 0).
            joint.value *= flight.value;
            joint.track *= flight.ratio;
            joint.ratio *= flight.ratio;
        }
        Ok((joint, met))
    }

    /// Emission on a segment through media that absorb only.
    fn glow(&self, s: &Segment, inside: u64, u: &FlightDraws) -> Result<Spectrum, Status> {
        let passage = match self.scene.media.as_slice() {
            [only] if only.free => self.fly::<ONE>(s, inside, u)?,
            _ => self.fly_through_all(s, inside, u)?,
        };
        Ok(passage.flight.emitted)
    }

    fn fly_through_all(
        &self,
        s: &Segment,
        inside: u64,
        u: &FlightDraws,
    ) -> Result<Passage, Status> {
        // Find the nearest collision; a flight that starts beyond what is already reached need not be sampled.
        let (mut reached, mut winner, mut met) = (s.t1, None, 0u32);
        let mut near = Near::of(self.scene, inside);
        while let Some((i, m, part)) = near.next(&Segment { t1: reached, ..*s }) {
            let flight = self.flight(m, &part, &keyed(u, i))?;
            met += 1;
            if flight.collided() && (flight.t < reached || winner.is_none()) {
                (reached, winner) = (flight.t, Some(i));
            }
        }
        if met == 0 {
            return Ok(nothing(s.t1));
        }
        // With several emitting media whose lanes differ, a point's lane densities are the product over media, which no
        // medium knows: there the hero speaks for itself alone, which is unbiased too.
        let alone = met > 1
            && self.scene.chromatic
            && self.scene.traits & scene_traits::EMISSIVE_MEDIA != 0;
        // Replay everything up to there: the same numbers give the same flight, cut short.
        let mut joint = Flight::vacuum(reached);
        let mut near = Near::of(self.scene, inside);
        // The winner's own segment may begin where it collides.
        let cut = Segment {
            t1: reached.next_up(),
            ..*s
        };
        while let Some((i, m)) = near.any(&cut) {
            let mut u = keyed(u, i);
            if alone {
                let hero = u.prior[u.hero as usize];
                u.prior = Spectrum::ZERO;
                u.prior[u.hero as usize] = hero;
            }
            // The winner's segment must not be cut, or its collision would count as survival.
            let end = if winner == Some(i) { s.t1 } else { reached };
            let Some(part) = clip(m.medium.info.bounds, &Segment { t1: end, ..*s }) else {
                continue;
            };
            let flight = self.flight(m, &part, &u)?;
            joint.value *= flight.value;
            joint.track *= flight.track;
            joint.ratio *= flight.ratio;
            let mut emitted = flight.emitted;
            if alone {
                let own = emitted[u.hero as usize];
                emitted = Spectrum::ZERO;
                emitted[u.hero as usize] = own;
            }
            joint.emitted += emitted;
            if winner == Some(i) {
                joint.sigma_t = flight.sigma_t;
                joint.sigma_s = flight.sigma_s;
                joint.phase = flight.phase;
                joint.event = flight.event;
                joint.t = flight.t;
            }
        }
        Ok(Passage {
            flight: joint,
            medium: winner.map_or(0, |i| i as u32),
            met: true,
        })
    }

    /// Transmittance along a segment: value, track and ratio multiply. `None` if nothing comes through.
    #[inline(always)]
    pub(super) fn pass<const MEDIA: u8>(
        &self,
        s: &Segment,
        inside: u64,
        u: &FlightDraws,
    ) -> Result<Option<(Flight, bool)>, Status> {
        match MEDIA {
            NONE => Ok(Some((Flight::vacuum(s.t1), false))),
            ONE => {
                let m = &self.scene.media[0];
                let Some(clipped) = clip(m.medium.info.bounds, s) else {
                    return Ok(Some((Flight::vacuum(s.t1), false)));
                };
                let flight = self.transmittance(m, &clipped, u)?;
                Ok((!flight.value.is_zero()).then_some((flight, true)))
            }
            FADING => {
                let (flight, met) = self.fade(s, inside, u)?;
                Ok((!flight.value.is_zero()).then_some((flight, met)))
            }
            _ => {
                let (mut joint, mut met) = (Flight::vacuum(s.t1), false);
                let mut near = Near::of(self.scene, inside);
                while let Some((i, m, part)) = near.next(s) {
                    let flight = self.transmittance(m, &part, &keyed(u, i))?;
                    if flight.value.is_zero() {
                        return Ok(None);
                    }
                    met = true;
                    joint.value *= flight.value;
                    joint.track *= flight.track;
                    joint.ratio *= flight.ratio;
                }
                Ok(Some((joint, met)))
            }
        }
    }

    /// Approximate optical depth of a segment.
    pub(super) fn depth(&self, s: &Segment, inside: u64) -> Result<Spectrum, Status> {
        let mut depth = Spectrum::ZERO;
        let mut near = Near::of(self.scene, inside);
        while let Some((_, m, part)) = near.next(s) {
            self.count(|c| c.depths += 1);
            depth += m
                .medium
                .depth(&part)
                .map_err(|f| self.medium_failed(&m.medium, &m.name, &f.0))?;
        }
        Ok(depth)
    }

    #[inline(always)]
    fn flight(&self, m: &PlacedMedium, s: &Segment, u: &FlightDraws) -> Result<Flight, Status> {
        let flight = m
            .medium
            .sample(s, u)
            .map_err(|f| self.medium_failed(&m.medium, &m.name, &f.0))?;
        if flight.violations > 0 {
            m.violated.store(true, Ordering::Relaxed);
        }
        self.count(|c| {
            c.flights += 1;
            c.collisions += u64::from(flight.event);
            c.nulls += u64::from(flight.nulls);
            c.lookups += u64::from(flight.lookups);
            c.violations += u64::from(flight.violations);
        });
        Ok(flight)
    }

    #[inline(always)]
    fn transmittance(
        &self,
        m: &PlacedMedium,
        s: &Segment,
        u: &FlightDraws,
    ) -> Result<Flight, Status> {
        let flight = m
            .medium
            .transmit(s, u)
            .map_err(|f| self.medium_failed(&m.medium, &m.name, &f.0))?;
        if flight.violations > 0 {
            m.violated.store(true, Ordering::Relaxed);
        }
        self.count(|c| {
            c.transmittances += 1;
            c.nulls += u64::from(flight.nulls);
            c.lookups += u64::from(flight.lookups);
            c.violations += u64::from(flight.violations);
        });
        Ok(flight)
    }
}

fn nothing(t: f32) -> Passage {
    Passage {
        flight: Flight::vacuum(t),
        medium: 0,
        met: false,
    }
}

/// Every medium has numbers of its own.
#[inline(always)]
fn keyed(u: &FlightDraws, i: usize) -> FlightDraws {
    if i == 0 {
        return *u;
    }
    let key = derive(u.key, i as u64);
    let mut numbers = resolvent_api::rng::Stream::new(key ^ 0x6d65_6469);
    FlightDraws {
        key,
        tau: numbers.uniform(),
        event: numbers.uniform(),
        ..*u
    }
}

#[inline(always)]
fn clip(bounds: Aabb, s: &Segment) -> Option<Segment> {
    let (t0, t1) = bounds.clip(Vec3::from(s.o), Vec3::from(s.d), s.t0, s.t1)?;
    Some(Segment { t0, t1, ..*s })
}

/// The media that segments of one ray meet.
struct Near<'s> {
    scene: &'s Scene,
    walk: Walk<'s>,
    /// The interiors that are not displaced.
    filling: u64,
}

impl<'s> Near<'s> {
    /// Where a ray is inside of the interiors `inside`.
    #[inline(always)]
    fn of(scene: &'s Scene, inside: u64) -> Self {
        Self {
            scene,
            walk: scene.hierarchy.walk(),
            filling: scene.interiors.filling(inside),
        }
    }

    /// The next medium that is there and that a segment may meet, and its number; its bounds are still to be asked. Segments may get
    /// shorter from call to call.
    #[inline(always)]
    fn any(&mut self, s: &Segment) -> Option<(usize, &'s PlacedMedium)> {
        loop {
            let i = self.walk.next(s)?;
            let m = &self.scene.media[i];
            if m.free || self.filling & m.interiors != 0 {
                return Some((i, m));
            }
        }
    }

    /// The next medium that can act on a segment, its number and the part that it can act on.
    #[inline(always)]
    fn next(&mut self, s: &Segment) -> Option<(usize, &'s PlacedMedium, Segment)> {
        loop {
            let (i, m) = self.any(s)?;
            if let Some(part) = clip(m.medium.info.bounds, s) {
                return Some((i, m, part));
            }
        }
    }
}
