//! The samples of one piece of work: a rectangle of pixels, and samples of one net.

use super::fixed::{UNFIT, add, fits, fix};
use super::orders::Layers;
use super::splat::Splats;
use resolvent_api::Spectrum;
use resolvent_api::abi::PixelSample;
use std::ops::Range;

/// Sums of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Radiance, three lanes.
    pub radiance: [i128; 3],
    /// Coverage.
    pub alpha: i128,
    taken: u32,
}

/// Sums of one pixel's features.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeatureSums {
    pub(super) depth: i128,
    pub(super) hits: u64,
    pub(super) albedo: [i128; 3],
    pub(super) normal: [i128; 3],
}

impl FeatureSums {
    pub(super) fn add(&mut self, o: &Self) {
        self.depth = self.depth.wrapping_add(o.depth);
        self.hits = self.hits.wrapping_add(o.hits);
        add(&mut self.albedo, o.albedo);
        add(&mut self.normal, o.normal);
    }
}

/// A rectangle of pixels that one worker fills.
pub struct Buffer {
    pub(super) min: [u32; 2],
    pub(super) width: u32,
    pub(super) samples: Range<u32>,
    pub(super) pixels: Vec<Sums>,
    pub(super) features: Vec<FeatureSums>,
    /// Light by scattering order, if wanted.
    pub(super) orders: Option<Layers>,
    /// Light from walks that started at lights.
    pub splats: Splats,
}

impl Buffer {
    /// An empty buffer for pixels from `min` up to, not including, `max`, and samples of one net.
    pub fn new(min: [u32; 2], max: [u32; 2], samples: Range<u32>, features: bool) -> Self {
        let width = max[0] - min[0];
        let count = (width * (max[1] - min[1])) as usize;
        Self {
            min,
            width,
            samples,
            pixels: vec![Sums::default(); count],
            features: if features {
                vec![FeatureSums::default(); count]
            } else {
                Vec::new()
            },
            orders: None,
            splats: Splats::default(),
        }
    }

    /// With `count` layers of light by scattering order, the last for all that was scattered more often.
    pub fn with_orders(mut self, count: usize) -> Self {
        self.orders = (count > 0).then(|| Layers::new(count, self.pixels.len()));
        self
    }

    /// Number of layers of light by scattering order.
    pub fn orders(&self) -> usize {
        self.orders.as_ref().map_or(0, Layers::count)
    }

    /// As [`Buffer::add`], with the sample's radiance by scattering order, not yet multiplied by `exposure`.
    pub fn add_orders(
        &mut self,
        x: u32,
        y: u32,
        s: &PixelSample,
        layers: &[Spectrum],
        exposure: f32,
    ) -> Result<(), String> {
        self.add(x, y, s)?;
        let i = ((y - self.min[1]) * self.width + (x - self.min[0])) as usize;
        match &mut self.orders {
            Some(orders) => orders.add(i, s.radiance, layers, exposure),
            None => Ok(()),
        }
    }

    /// Adds the next sample of pixel (x, y).
    ///
    /// # Errors
    /// If the pixel is elsewhere, or the sample is not finite or more than a film can hold; in words that follow the integrator's name.
    #[inline]
    pub fn add(&mut self, x: u32, y: u32, s: &PixelSample) -> Result<(), String> {
        let (column, row) = (x.wrapping_sub(self.min[0]), y.wrapping_sub(self.min[1]));
        let index = (row as usize) * (self.width as usize) + column as usize;
        if column >= self.width || index >= self.pixels.len() {
            return Err(format!(
                "added a sample to pixel ({x}, {y}), which is not in its tile"
            ));
        }
        let good = s.radiance.0[..3].iter().all(|v| fits(*v)) && fits(s.alpha);
        if !good {
            let [r, g, b, _] = s.radiance.0;
            return Err(format!(
                "gave sample {} of pixel ({x}, {y}) the radiance {r:e} {g:e} {b:e} and the alpha {:e}, {UNFIT}",
                self.samples.start + self.pixels[index].taken,
                s.alpha
            ));
        }
        let p = &mut self.pixels[index];
        for lane in 0..3 {
            p.radiance[lane] += fix(s.radiance[lane]);
        }
        p.alpha += fix(s.alpha);
        p.taken += 1;
        if let Some(f) = self.features.get_mut(index)
            && s.depth > 0.0
            && fits(s.depth)
            && s.albedo.iter().chain(&s.normal).all(|v| fits(*v))
        {
            f.depth += fix(s.depth);
            f.hits += 1;
            for i in 0..3 {
                f.albedo[i] += fix(s.albedo[i]);
                f.normal[i] += fix(s.normal[i]);
            }
        }
        Ok(())
    }

    /// The radiance alone.
    pub(crate) fn bare(mut self) -> Self {
        self.features = Vec::new();
        self.orders = None;
        self.splats = Splats::default();
        self
    }

    /// The first pixel that has not exactly the samples that were asked for, with the number it has.
    pub fn uneven(&self) -> Option<([u32; 2], u32)> {
        let wanted = self.samples.end - self.samples.start;
        let i = self.pixels.iter().position(|p| p.taken != wanted)?;
        let at = [
            self.min[0] + i as u32 % self.width,
            self.min[1] + i as u32 / self.width,
        ];
        Some((at, self.pixels[i].taken))
    }
}
