//! Light by scattering order: the terms (GK)^k G Le of the Neumann series one by one.
//!
//! Kernels say of all light that they find how often it was scattered. [`Together`] forgets it, at no cost; [`Orders`] keeps
//! it for the film's layers. Both give the same picture, bit for bit.

use resolvent_api::abi::PixelSample;
use resolvent_api::integrator::Outcome;
use resolvent_api::{Output, Spectrum};

/// What becomes of the light that the path of a sample finds.
pub trait Tally {
    /// Counts light of the sample in progress that was scattered `order` times. It is part of the sample's radiance.
    fn add(&mut self, order: usize, light: Spectrum);
    /// Adds the sample to the film, and begins the next one.
    ///
    /// # Errors
    /// If the render ended.
    fn finish(
        &mut self,
        out: &mut Output<'_>,
        pixel: [u32; 2],
        sample: &PixelSample,
    ) -> Outcome<()>;
    /// Adds light to the film at a position in pixels.
    ///
    /// # Errors
    /// As above.
    fn splat(
        &self,
        out: &mut Output<'_>,
        film: [f32; 2],
        radiance: Spectrum,
        order: usize,
    ) -> Outcome<()>;
}

/// All orders together: nobody wants to tell them apart.
pub struct Together;

impl Tally for Together {
    #[inline(always)]
    fn add(&mut self, _: usize, _: Spectrum) {}

    #[inline(always)]
    fn finish(
        &mut self,
        out: &mut Output<'_>,
        [x, y]: [u32; 2],
        sample: &PixelSample,
    ) -> Outcome<()> {
        out.add(x, y, sample)
    }

    #[inline(always)]
    fn splat(
        &self,
        out: &mut Output<'_>,
        film: [f32; 2],
        radiance: Spectrum,
        _: usize,
    ) -> Outcome<()> {
        out.splat(film, radiance)
    }
}

/// Light order by order; the last layer has all that was scattered more often.
pub struct Orders(Vec<Spectrum>);

impl Orders {
    /// As many layers as the film wants, at least one.
    pub fn new(layers: usize) -> Self {
        Self(vec![Spectrum::ZERO; layers.max(1)])
    }
}

impl Tally for Orders {
    #[inline]
    fn add(&mut self, order: usize, light: Spectrum) {
        let last = self.0.len() - 1;
        self.0[order.min(last)] += light;
    }

    fn finish(
        &mut self,
        out: &mut Output<'_>,
        [x, y]: [u32; 2],
        sample: &PixelSample,
    ) -> Outcome<()> {
        out.add_orders(x, y, sample, &self.0)?;
        self.0.fill(Spectrum::ZERO);
        Ok(())
    }

    fn splat(
        &self,
        out: &mut Output<'_>,
        film: [f32; 2],
        radiance: Spectrum,
        order: usize,
    ) -> Outcome<()> {
        out.splat_order(film, radiance, order.min(self.0.len() - 1) as u32)
    }
}
