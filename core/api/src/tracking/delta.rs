//! Free flight by delta tracking (Woodcock et al. 1965) with local majorants, minorants and lane densities.

use super::{Draws, Steps, finish, fold, rescale};
use crate::medium::Field;
use crate::operator::{Event, Flight, FlightDraws, Segment, flight_flags};
use crate::spectrum::{Lanes, Spectrum};

/// Samples the next collision on a segment.
///
/// The hero lane decides distances and events; the other lanes carry the ratios of what their densities would have
/// been (Miller et al. 2019; spectral MIS over lanes as in Wilkie et al. 2014). `RATIO` says whether connections
/// are estimated by ratio tracking, whose density is then carried along; otherwise it equals `track`.
pub fn free_flight<F: Field, const RATIO: bool>(field: &F, s: &Segment, u: &FlightDraws) -> Flight {
    let mut out = Flight::vacuum(s.t1);
    let Some(mut cursor) = field.enter(s) else {
        return out;
    };
    let mut draws = Draws::new(u);
    let zero = F::Lanes::splat(0.0);
    let (mut value, mut ratio) = (F::Lanes::splat(1.0), F::Lanes::splat(1.0));
    // Logarithms relative to the hero lane's density, which is the common scale.
    let (mut log_value, mut log_ratio) = (zero, zero);
    let mut steps = Steps::new(u.tau);

    'flight: while let Some(cell) = field.next_cell(&mut cursor) {
        let (majorant, minorant) = (cell.majorant, cell.minorant);
        let hero = majorant.lane(u.hero);
        let sure = minorant.lane(u.hero);
        let mut t = cell.t0;
        loop {
            let (end, leaves) = steps.reach(t, hero, cell.t1);
            let dt = end - t;
            if F::EMISSIVE {
                let position = draws.next();
                // One point on the step, weighted by the chance that lane and step came to be (track-length estimator:
                // reaching the point already has the probability of the transmittance).
                let at = t + position.0[1] * dt;
                let emission = field.emission(&mut cursor, at);
                let weight = lane_weight::<F>(value, log_value, majorant, hero, at - t, u);
                out.emitted += emission * weight * dt;
            }
            if F::Lanes::CHROMATIC {
                log_value = log_value - (majorant - F::Lanes::splat(hero)) * dt;
            }
            if RATIO {
                log_ratio = log_ratio - (majorant - minorant - F::Lanes::splat(hero)) * dt;
            }
            if leaves {
                steps.leave(dt, hero);
                break;
            }
            let Some(at) = steps.arrive(t, end, cell.t1) else {
                break;
            };
            t = at;
            let ([event, next], jitter) = draws.next();
            steps.again(next);
            let mark = event * hero;
            let known = if mark < sure {
                None
            } else {
                out.lookups += 1;
                let sigma = field.extinction(&mut cursor, t, jitter);
                let sigma_hero = sigma.lane(u.hero);
                if sigma_hero > hero * 1.000_01 {
                    out.violations += 1;
                }
                if mark >= sigma_hero {
                    out.nulls += 1;
                    let null = hero - sigma_hero;
                    if F::Lanes::CHROMATIC {
                        value = value * ((majorant - sigma) / F::Lanes::splat(null));
                    }
                    if RATIO {
                        ratio = ratio * ((majorant - minorant) / F::Lanes::splat(null));
                    }
                    if F::Lanes::CHROMATIC {
                        fold(&mut value, &mut log_value);
                        fold(&mut ratio, &mut log_ratio);
                    }
                    if F::Lanes::CHROMATIC || RATIO {
                        rescale(&mut value, &mut ratio);
                    }
                    continue;
                }
                Some(sigma)
            };
            let exact = u.flags & flight_flags::EXACT != 0;
            (out.sigma_t, out.sigma_s) = field.collision(&mut cursor, t, known, exact);
            out.t = t;
            out.event = Event::Collided as u32;
            break 'flight;
        }
    }
    if F::Lanes::CHROMATIC || RATIO {
        let (v, r) = finish(value, log_value, ratio, log_ratio);
        out.value = v;
        out.track = v;
        out.ratio = if RATIO { r } else { v };
    }
    out
}

/// Weight of what is picked up at a distance `dt` into a step: the lanes' contributions over their mean density, which includes
/// the path's so far even where this medium doesn't tell lanes apart.
#[inline(always)]
fn lane_weight<F: Field>(
    value: F::Lanes,
    log_value: F::Lanes,
    majorant: F::Lanes,
    hero: f32,
    dt: f32,
    u: &FlightDraws,
) -> Spectrum {
    if !F::Lanes::CHROMATIC {
        return Spectrum::splat(1.0 / u.prior.mean(u.lanes));
    }
    let log = log_value - (majorant - F::Lanes::splat(hero)) * dt;
    let reached = (value * (log - F::Lanes::splat(log.max_lane())).exp()).spectrum();
    reached / (reached * u.prior).mean(u.lanes)
}
