//! Layers of light by scattering order, which sum to the picture exactly.
//!
//! They are sums of integers like the picture's own. A sample's layers sum to its radiance up to the rounding of the
//! integrator's sums; what is left by that goes to the largest of them. A splat belongs to one layer. So the layers' sums add up to
//! the picture's, bit for bit, and the picture is what it is without them.

use super::fixed::{add, fits, fix, float};
use crate::checkpoint::sections::Fields;
use resolvent_api::Spectrum;

/// By how much of its light a sample's layers may fail to sum to its radiance: what sums of some thousand f32 in another order
/// can differ by. Beyond, the integrator forgot light, or counted it twice.
const ROUNDING: f32 = 1e-3;

/// The layers of a rectangle of pixels.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    count: usize,
    /// Of every pixel all layers, first to last.
    sums: Vec<[i128; 3]>,
}

impl Layers {
    /// `count` black layers of `pixels` pixels.
    pub fn new(count: usize, pixels: usize) -> Self {
        Self {
            count,
            sums: vec![[0; 3]; count * pixels],
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds a sample of pixel `i` by its layers, which `exposure` multiplies; `radiance` is what the picture got of it.
    pub fn add(
        &mut self,
        i: usize,
        radiance: Spectrum,
        layers: &[Spectrum],
        exposure: f32,
    ) -> Result<(), String> {
        let sums = &mut self.sums[i * self.count..][..self.count];
        for lane in 0..3 {
            let (mut rest, mut total, mut largest) = (fix(radiance[lane]), 0f32, 0);
            for (k, (sum, layer)) in sums.iter_mut().zip(layers).enumerate() {
                let v = layer[lane] * exposure;
                if !fits(v) {
                    return Err(format!("gave light of {v} to the scattering order {k}"));
                }
                let fixed = fix(v);
                sum[lane] += fixed;
                rest -= fixed;
                total += v.abs();
                if v.abs() > (layers[largest][lane] * exposure).abs() {
                    largest = k;
                }
            }
            // The radiance and every layer are rounded to fixed point.
            let fixing = float(self.count as i128 + 1);
            if float(rest).abs() > f64::from(ROUNDING * total) + fixing {
                return Err(format!(
                    "told of the light {} by scattering order, but its sum is {}",
                    radiance[lane],
                    f64::from(radiance[lane]) - float(rest)
                ));
            }
            sums[largest][lane] += rest;
        }
        Ok(())
    }

    /// Adds light to layer `k` of pixel `i`.
    pub fn deposit(&mut self, i: usize, k: u32, value: [i128; 3]) {
        let k = (k as usize).min(self.count - 1);
        add(&mut self.sums[i * self.count + k], value);
    }

    /// Adds pixel `j` of other layers to pixel `i`.
    pub fn merge(&mut self, i: usize, other: &Self, j: usize) {
        let from = &other.sums[j * self.count..][..self.count];
        let to = &mut self.sums[i * self.count..][..self.count];
        to.iter_mut().zip(from).for_each(|(a, b)| add(a, *b));
    }

    /// The sum of layer `k` at pixel `i`.
    pub fn sum(&self, i: usize, k: usize) -> [i128; 3] {
        self.sums[i * self.count + k]
    }
}

/// The layers of a film.
#[derive(Clone, Debug)]
pub(super) struct Orders {
    /// Light from walks that started at the sensor.
    pub walks: Layers,
    /// Light from the others.
    pub splats: Layers,
}

impl Orders {
    /// `count` black layers of `pixels` pixels.
    pub fn new(count: usize, pixels: usize) -> Self {
        let walks = Layers::new(count, pixels);
        let splats = walks.clone();
        Self { walks, splats }
    }

    /// Adds the layers of another film.
    pub fn join(&mut self, other: &Self) {
        let pairs = [
            (&mut self.walks, &other.walks),
            (&mut self.splats, &other.splats),
        ];
        for (to, from) in pairs {
            let sums = to.sums.iter_mut().zip(&from.sums);
            sums.for_each(|(a, b)| add(a, *b));
        }
    }

    /// All sums, for a checkpoint.
    pub fn sums(&self) -> impl Iterator<Item = &[i128; 3]> {
        self.walks.sums.iter().chain(&self.splats.sums)
    }

    /// Reads what [`Orders::sums`] gave, for a film of `pixels` pixels.
    ///
    /// # Errors
    /// If that is no whole number of layers.
    pub fn read(mut f: Fields, pixels: usize) -> Result<Self, String> {
        let mut walks = Vec::new();
        while !f.is_empty() {
            walks.push(f.three()?);
        }
        if walks.is_empty() || !walks.len().is_multiple_of(2 * pixels) {
            return Err("its layers by scattering order are cut off".into());
        }
        let splats = walks.split_off(walks.len() / 2);
        let count = walks.len() / pixels;
        let layers = |sums| Layers { count, sums };
        Ok(Self {
            walks: layers(walks),
            splats: layers(splats),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Buffer, Film};
    use crate::filter::Filter;
    use resolvent_api::abi::PixelSample;
    use resolvent_api::rng::Stream;

    /// Samples whose radiance is summed in another order than their layers, and splats: the layers' integers sum to the
    /// picture's.
    #[test]
    fn layers_sum_to_the_picture() {
        const COUNT: usize = 5;
        let mut film = Film::new([0, 0, 4, 2], false).with_orders(COUNT);
        let mut s = Stream::new(3);
        for piece in 0..6 {
            let samples = 16 * piece..16 * (piece + 1);
            let mut b = Buffer::new([0, 0], [4, 2], samples, false).with_orders(COUNT);
            for (x, y) in (0..8).map(|i| (i % 4, i / 4)) {
                for _ in 0..16 {
                    let mut layers = [Spectrum::ZERO; COUNT];
                    let mut radiance = Spectrum::ZERO;
                    for _ in 0..40 {
                        let k = (s.uniform() * COUNT as f32) as usize;
                        let v = Spectrum::rgb(s.uniform(), 1e4 * s.uniform().powi(8), -1e-4);
                        layers[k] += v;
                        radiance += v;
                    }
                    let sample = PixelSample {
                        radiance,
                        ..PixelSample::default()
                    };
                    b.add_orders(x, y, &sample, &layers, 1.0).unwrap();
                }
            }
            for k in 0..200 {
                let at = [6.0 * s.uniform() - 1.0, 4.0 * s.uniform() - 1.0];
                assert!(b.splats.add_order(at, Spectrum::splat(s.uniform()), k % 7));
            }
            film.merge(b, &Filter::Tent(1.2)).unwrap();
        }
        let orders = film.orders.as_ref().unwrap();
        for (i, p) in film.pixels.iter().enumerate() {
            for lane in 0..3 {
                let sum: i128 = (0..COUNT).map(|k| orders.walks.sum(i, k)[lane]).sum();
                assert_eq!(sum, p.sum[lane]);
                let sum: i128 = (0..COUNT).map(|k| orders.splats.sum(i, k)[lane]).sum();
                assert_eq!(sum, film.splats.as_ref().unwrap().sum[i][lane]);
                let mean: f64 = (0..COUNT).map(|k| film.order(i, k)[lane]).sum();
                let whole = film.estimate(i).mean[lane];
                assert!((mean - whole).abs() < 1e-14 * whole.abs(), "{mean} {whole}");
            }
        }
    }

    #[test]
    fn forgotten_light_is_noticed() {
        let mut layers = Layers::new(2, 1);
        let (one, half) = (Spectrum::ONE, Spectrum::splat(0.5));
        layers.add(0, one, &[half, half], 1.0).unwrap();
        for wrong in [
            [half, Spectrum::ZERO],
            [one, half],
            [Spectrum::splat(f32::NAN), one],
        ] {
            layers.clone().add(0, one, &wrong, 1.0).unwrap_err();
        }
        // Light that cancels leaves the rounding of what it was.
        let dust = Spectrum::splat(1e-5);
        layers.add(0, dust, &[one, one * -1.0], 1.0).unwrap();
        // Exposure multiplies layers as it has multiplied the picture.
        layers.add(0, one, &[one, one], 0.5).unwrap();
    }

    /// However faint light is, its layers are not blamed for what fixed point cuts off.
    #[test]
    fn faint_light_is_light() {
        let mut s = Stream::new(5);
        for _ in 0..10_000 {
            let mut layers = Layers::new(7, 1);
            let exposure = 0.5f32.powf(30.0 + 50.0 * s.uniform());
            let own = [(); 7].map(|()| Spectrum::splat(s.uniform()));
            let radiance = own.iter().fold(Spectrum::ZERO, |a, b| a + *b) * exposure;
            layers.add(0, radiance, &own, exposure).unwrap();
            let sum: i128 = (0..7).map(|k| layers.sum(0, k)[0]).sum();
            assert_eq!(sum, fix(radiance[0]));
        }
    }
}
