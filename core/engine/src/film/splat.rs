//! Light that falls on any pixel, from walks that started at lights.
//!
//! Every pixel receives a splat times the value of its reconstruction filter there; sums are integers, so that the order in
//! which pieces of work arrive leaves no trace. Each piece is a batch for the variance, weighted by its samples.

use super::fixed::{Squares, add, fits, fix, float};
use crate::filter::Filter;
use resolvent_api::Spectrum;

/// The splats of one piece of work, in order: where, what, and how often scattered.
#[derive(Clone, Debug, Default)]
pub struct Splats(Vec<([f32; 2], [f32; 3], u32)>);

impl Splats {
    /// Adds light at a position in pixels; false if it is not finite, or too large, and left out.
    #[inline]
    pub fn add(&mut self, film: [f32; 2], radiance: Spectrum) -> bool {
        self.add_order(film, radiance, 0)
    }

    /// As [`Splats::add`], for light scattered `order` times.
    #[inline]
    pub fn add_order(&mut self, film: [f32; 2], radiance: Spectrum, order: u32) -> bool {
        let value = [radiance[0], radiance[1], radiance[2]];
        let good = value.iter().all(|v| fits(*v)) && film.iter().all(|v| v.is_finite());
        if good && value != [0.0; 3] {
            self.0.push((film, value, order));
        }
        good
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// The sums of a whole image.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    pub sum: Vec<[i128; 3]>,
    /// Σ over pieces of (sum of the piece)²/samples of the piece.
    pub squares: Vec<[Squares; 3]>,
    /// Sums of the piece in progress, and the pixels it touched.
    piece: Vec<[i128; 3]>,
    touched: Vec<u32>,
}

impl Sums {
    /// No light on `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self {
            sum: vec![[0; 3]; pixels],
            squares: vec![[Squares::default(); 3]; pixels],
            piece: vec![[0; 3]; pixels],
            touched: Vec::new(),
        }
    }

    /// Adds a piece of `samples` samples of a film with the given window; `heard` is told what each pixel gets, and its order.
    /// Returns its sum over all pixels.
    pub fn add(
        &mut self,
        splats: &Splats,
        window: [u32; 4],
        filter: &Filter,
        samples: u64,
        mut heard: impl FnMut(usize, u32, [i128; 3]),
    ) -> [i128; 3] {
        let [x0, y0, x1, y1] = window.map(|v| v as f32);
        let width = window[2] - window[0];
        let r = filter.radius();
        for (film, value, order) in &splats.0 {
            // Pixels whose centre is within the radius.
            let from = |v: f32, low: f32| (v - r - 0.5).ceil().max(low);
            let to = |v: f32, high: f32| (v + r - 0.5).floor().min(high - 1.0);
            let mut y = from(film[1], y0);
            while y <= to(film[1], y1) {
                let wy = filter.value(film[1] - (y + 0.5));
                let mut x = from(film[0], x0);
                while wy > 0.0 && x <= to(film[0], x1) {
                    let w = wy * filter.value(film[0] - (x + 0.5));
                    if w > 0.0 {
                        let i = (y as u32 - window[1]) * width + (x as u32 - window[0]);
                        let value = value.map(|v| fix(v * w));
                        self.deposit(i, value);
                        heard(i as usize, *order, value);
                    }
                    x += 1.0;
                }
                y += 1.0;
            }
        }
        let mut total = [0; 3];
        for i in self.touched.drain(..) {
            let i = i as usize;
            add(&mut self.sum[i], self.piece[i]);
            add(&mut total, self.piece[i]);
            for lane in 0..3 {
                let square = Squares::of(float(self.piece[i][lane]), samples.max(1) as f64);
                self.squares[i][lane].add(square);
            }
            self.piece[i] = [0; 3];
        }
        total
    }

    fn deposit(&mut self, i: u32, value: [i128; 3]) {
        let at = &mut self.piece[i as usize];
        if *at == [0; 3] {
            self.touched.push(i);
        }
        add(at, value);
    }

    /// Adds the sums of another film.
    pub fn join(&mut self, other: &Self) {
        for (a, b) in self.sum.iter_mut().zip(&other.sum) {
            add(a, *b);
        }
        for (a, b) in self.squares.iter_mut().zip(&other.squares) {
            a.iter_mut().zip(b).for_each(|(a, b)| a.add(*b));
        }
    }

    /// Mean of pixel `i` after some pieces with so many samples together, and its variance, if there were two.
    pub fn estimate(
        &self,
        i: usize,
        (pieces, samples): (u64, u64),
    ) -> ([f64; 3], Option<[f64; 3]>) {
        let n = samples.max(1) as f64;
        let mean = self.sum[i].map(|s| float(s) / n);
        let variance = (pieces >= 2).then(|| {
            [0, 1, 2].map(|lane| {
                let spread = self.squares[i][lane].float() - n * mean[lane] * mean[lane];
                spread.max(0.0) / ((pieces - 1) as f64 * n)
            })
        });
        (mean, variance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;
    use resolvent_scene::Filter as Described;

    const WINDOW: [u32; 4] = [2, 1, 12, 9];

    fn piece(key: u64, count: u32) -> Splats {
        let mut s = Stream::new(key);
        let mut out = Splats::default();
        for _ in 0..count {
            let film = [s.uniform() * 20.0 - 3.0, s.uniform() * 16.0 - 3.0];
            assert!(out.add(film, Spectrum::rgb(s.uniform(), 1.0, 0.0)));
        }
        out
    }

    /// Uniform light of density 1 gives every pixel 1, whatever the filter; its variance is that of repeated films.
    #[test]
    fn uniform_light_is_uniform() {
        for filter in [
            Filter::Box(0.5),
            Filter::new(Described::Gaussian {
                radius: 1.5,
                sigma: 0.5,
            }),
        ] {
            let mut sums = Sums::new(80);
            let mut estimates = Vec::new();
            for film in 0..40 {
                let mut one = Sums::new(80);
                for k in 0..8 {
                    // 320 positions on 20 × 16 pixels: the samples of a film where each pixel has one.
                    let p = piece(film * 8 + k, 320);
                    sums.add(&p, WINDOW, &filter, 320, |_, _, _| {});
                    one.add(&p, WINDOW, &filter, 320, |_, _, _| {});
                }
                let (mean, variance) = one.estimate(33, (8, 8 * 320));
                estimates.push((mean[1], variance.unwrap()[1]));
            }
            // Splats carry the inverse of their density, 1/320 of the samples: the mean of a pixel is 1/320.
            let (mut worst, mut chi2) = (0f64, 0f64);
            for i in 0..80 {
                let (mean, variance) = sums.estimate(i, (320, 320 * 320));
                let z = (mean[1] * 320.0 - 1.0) / (variance.unwrap()[1].sqrt() * 320.0);
                worst = worst.max(z.abs());
                chi2 += z * z;
            }
            assert!(worst < 4.5 && chi2 < 80.0 + 5.0 * 12.6, "{worst} {chi2}");
            let mean = estimates.iter().map(|e| e.0).sum::<f64>() / 40.0;
            let spread = estimates.iter().map(|e| (e.0 - mean).powi(2)).sum::<f64>() / 39.0;
            let stated = estimates.iter().map(|e| e.1).sum::<f64>() / 40.0;
            // The ratio of two variances with 39 degrees of freedom.
            assert!((0.4..2.5).contains(&(spread / stated)), "{spread} {stated}");
        }
    }

    /// Any order of pieces gives the same bits.
    #[test]
    fn pieces_commute() {
        let filter = Filter::Tent(1.2);
        let run = |order: &[u64]| {
            let mut sums = Sums::new(80);
            for k in order {
                sums.add(
                    &piece(*k, 100 + *k as u32),
                    WINDOW,
                    &filter,
                    50 + k,
                    |_, _, _| {},
                );
            }
            (sums.sum, sums.squares)
        };
        assert_eq!(run(&[1, 2, 3, 4]), run(&[3, 1, 4, 2]));
        let mut halves = Sums::new(80);
        for order in [[1, 3], [4, 2]] {
            let (sum, squares) = run(&order);
            let half = Sums {
                sum,
                squares,
                ..Sums::new(80)
            };
            halves.join(&half);
        }
        assert_eq!((halves.sum, halves.squares), run(&[1, 2, 3, 4]));
    }

    #[test]
    fn bad_splats_are_refused() {
        let mut s = Splats::default();
        assert!(!s.add([1.0, f32::NAN], Spectrum::ONE));
        assert!(!s.add([1.0, 1.0], Spectrum::splat(f32::INFINITY)));
        assert!(s.add([1.0, 1.0], Spectrum::ZERO));
        assert!(s.is_empty());
    }
}
