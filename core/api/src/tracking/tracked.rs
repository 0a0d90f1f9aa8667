//! A medium made of a field and the tracking loops.

use super::{delta, ratio};
use crate::math::Vec3;
use crate::medium::{Field, Medium, MediumInfo, medium_traits};
use crate::operator::{Coefficients, Flight, FlightDraws, Segment};
use crate::spectrum::Spectrum;

/// How connections through a medium are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmittance {
    /// Residual ratio tracking: low variance, looks at the whole segment.
    Ratio,
    /// Survival of a free flight: more variance, but ends at the first collision.
    Survival,
}

/// Makes a [`Medium`] of a [`Field`].
pub struct Tracked<F> {
    /// The field.
    pub field: F,
    /// The estimator of connections.
    pub transmittance: Transmittance,
}

impl<F: Field> Medium for Tracked<F> {
    fn info(&self) -> MediumInfo {
        let mut info = self.field.info();
        if self.transmittance == Transmittance::Survival {
            info.traits |= medium_traits::ANALOG_TRANSMIT;
        }
        info
    }

    #[inline]
    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        match self.transmittance {
            Transmittance::Ratio => delta::free_flight::<F, true>(&self.field, s, u),
            Transmittance::Survival => delta::free_flight::<F, false>(&self.field, s, u),
        }
    }

    #[inline]
    fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight {
        match self.transmittance {
            Transmittance::Ratio => ratio::transmit(&self.field, s, u),
            Transmittance::Survival => ratio::survive(&self.field, s, u),
        }
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        self.field.depth(s)
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        self.field.coefficients(p)
    }
}
