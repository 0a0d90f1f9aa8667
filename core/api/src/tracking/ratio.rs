//! Transmittance of a connection: residual ratio tracking, and survival of a free flight.

use super::{Draws, Steps, finish, fold, rescale};
use crate::medium::Field;
use crate::operator::{Flight, FlightDraws, Segment};
use crate::spectrum::{Lanes, Spectrum};

/// Optical depth beyond which a transmittance is zero in `f32`.
const OPAQUE: f32 = 104.0;

/// Unbiased transmittance by residual ratio tracking with the minorant as control (Novák et al. 2014, §4.1, with a
/// local control that never exceeds the extinction, so that no weight is negative).
///
/// Null points have the rate majorant − minorant of the hero lane; `value/ratio` is the estimate.
pub fn transmit<F: Field>(field: &F, s: &Segment, u: &FlightDraws) -> Flight {
    let mut out = Flight::vacuum(s.t1);
    let Some(mut cursor) = field.enter(s) else {
        return out;
    };
    let mut draws = Draws::new(u);
    let zero = F::Lanes::splat(0.0);
    let (mut value, mut ratio) = (F::Lanes::splat(1.0), F::Lanes::splat(1.0));
    let (mut log_value, mut log_ratio) = (zero, zero);
    let mut steps = Steps::new(u.tau);

    while let Some(cell) = field.next_cell(&mut cursor) {
        let residual = cell.majorant - cell.minorant;
        let hero = residual.lane(u.hero);
        let mut t = cell.t0;
        loop {
            let (end, leaves) = steps.reach(t, hero, cell.t1);
            let dt = end - t;
            log_value = log_value - (cell.majorant - F::Lanes::splat(hero)) * dt;
            if F::Lanes::CHROMATIC {
                log_ratio = log_ratio - (residual - F::Lanes::splat(hero)) * dt;
            }
            if leaves {
                steps.leave(dt, hero);
                break;
            }
            let Some(at) = steps.arrive(t, end, cell.t1) else {
                break;
            };
            t = at;
            let ([_, next], jitter) = draws.next();
            steps.again(next);
            out.lookups += 1;
            out.nulls += 1;
            let sigma = field.extinction(&mut cursor, t, jitter);
            if sigma.lane(u.hero) > cell.majorant.lane(u.hero) * 1.000_01 {
                out.violations += 1;
            }
            value = value * ((cell.majorant - sigma) / F::Lanes::splat(hero));
            if F::Lanes::CHROMATIC {
                ratio = ratio * (residual / F::Lanes::splat(hero));
                fold(&mut value, &mut log_value);
                fold(&mut ratio, &mut log_ratio);
                rescale(&mut value, &mut ratio);
            }
            // Below zero is where the extinction is above the majorant: rare and wrong of the field, and yet no bias, because the rate of
            // the points may be any (Galtier et al. 2013).
            if !(value.max_lane() > 0.0 || (zero - value).max_lane() > 0.0) {
                return opaque(out);
            }
        }
        if (log_value - log_ratio).max_lane() < -OPAQUE {
            return opaque(out);
        }
    }
    let (v, r) = if F::Lanes::CHROMATIC {
        finish(value, log_value, ratio, log_ratio)
    } else {
        ((value * log_value.exp()).spectrum(), Spectrum::ONE)
    };
    out.value = v;
    out.track = v;
    out.ratio = r;
    out
}

/// A connection through which nothing comes.
fn opaque(mut out: Flight) -> Flight {
    out.value = Spectrum::ZERO;
    out.track = Spectrum::ZERO;
    out.ratio = Spectrum::ONE;
    out
}

/// Transmittance by survival: 1 if a free flight passes the segment, 0 if it collides, so that all three densities of a
/// passing flight agree. Cheap where the medium is thick: most flights end at once.
pub fn survive<F: Field>(field: &F, s: &Segment, u: &FlightDraws) -> Flight {
    let out = super::delta::free_flight::<F, false>(field, s, u);
    if out.collided() {
        let mut out = opaque(out);
        out.t = s.t1;
        out.event = 0;
        return out;
    }
    out
}
