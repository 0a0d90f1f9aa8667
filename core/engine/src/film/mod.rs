//! The film: sums per pixel in fixed point, so that they do not depend on the order of addition.
//!
//! Every sample is rounded once, to a multiple of 2⁻⁶⁴, and added as an integer. Any division of the work into tiles, sample
//! ranges, threads or machines gives the same bits. Errors are estimated from the spread of [`nets`], which are independent; the
//! parts of a net that is cut by a sample range count as a net of their own until the rest arrives.

mod buffer;
mod coverage;
mod error;
mod fixed;
mod interval;
mod orders;
mod splat;
mod store;
mod tile;

pub use buffer::{Buffer, FeatureSums};
pub use coverage::Coverage;
pub use error::Errors;
pub use error::TOO_FAINT;
pub use fixed::MOST_SAMPLES;
pub(crate) use fixed::UNFIT;
pub use interval::Interval;
pub use splat::Splats;
pub use tile::{Rect, TILE};

use crate::filter::Filter;
use fixed::{Squares, add, float};
use resolvent_pathspace::nets;
use std::collections::BTreeMap;
use std::ops::Range;
use tile::{Part, TileSums};

/// Sums of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Radiance, three lanes.
    sum: [i128; 3],
    /// Coverage.
    alpha: i128,
    /// Σ over nets of (sum of the net)²/samples of the net.
    squares: [Squares; 3],
}

/// Bytes of memory that a film takes for each pixel: with features, `orders` layers by scattering order, light from walks that started
/// at lights, and so many nets that are there in part.
pub(crate) fn pixel_bytes(features: bool, orders: usize, splats: bool, parts: usize) -> usize {
    let lanes = size_of::<[i128; 3]>();
    let of_tile = size_of::<TileSums>() + parts * size_of::<((usize, u32), Part)>();
    size_of::<Pixel>()
        + usize::from(features) * size_of::<FeatureSums>()
        + 2 * orders * lanes
        + usize::from(splats) * (2 * lanes + size_of::<[Squares; 3]>())
        + parts * lanes
        + of_tile.div_ceil((TILE * TILE) as usize)
}

/// The sums of a whole image.
#[derive(Clone, Debug)]
pub struct Film {
    /// Window that is rendered: x0, y0, x1, y1 in pixels of the full image.
    window: [u32; 4],
    pixels: Vec<Pixel>,
    features: Vec<FeatureSums>,
    tiles: Vec<TileSums>,
    /// Parts of nets, by tile and first sample of the net.
    parts: BTreeMap<(usize, u32), Part>,
    /// Light by scattering order, if wanted.
    orders: Option<orders::Orders>,
    /// Light from walks that started at lights, once there is any.
    splats: Option<splat::Sums>,
    /// Pieces of work merged, and their samples.
    pieces: (u64, u64),
    /// The other half of an adaptive render: the picture is the mean of both.
    twin: Option<Box<Film>>,
}

/// One pixel's estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean radiance.
    pub mean: [f64; 3],
    /// Variance of that mean; `None` with fewer than two nets.
    pub variance: Option<[f64; 3]>,
    /// Mean coverage.
    pub alpha: f64,
    /// Samples taken.
    pub samples: u32,
    /// Degrees of freedom of the variance.
    pub degrees: [f64; 3],
}

/// Variances of three lanes, and their degrees of freedom.
type Spread = ([f64; 3], [f64; 3]);

impl Estimate {
    fn spread(&self) -> Option<Spread> {
        self.variance.map(|v| (v, self.degrees))
    }
}

/// The variance of a sum of two independent estimates, with its degrees of freedom (Satterthwaite 1946).
fn sum_of(a: Option<Spread>, b: Option<Spread>) -> Option<Spread> {
    let ((va, da), (vb, db)) = (a?, b?);
    let variance = [0, 1, 2].map(|k| va[k] + vb[k]);
    let degrees = [0, 1, 2].map(|k| {
        let d = variance[k] * variance[k] / (va[k] * va[k] / da[k] + vb[k] * vb[k] / db[k]);
        if d.is_finite() { d } else { da[k].min(db[k]) }
    });
    Some((variance, degrees))
}

/// One pixel's features: means over the samples that met something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Distance.
    pub depth: f64,
    /// Albedo.
    pub albedo: [f64; 3],
    /// Normal, of length at most 1.
    pub normal: [f64; 3],
}

impl Film {
    /// An empty film.
    pub fn new(window: [u32; 4], features: bool) -> Self {
        let count = (window[2] - window[0]) as usize * (window[3] - window[1]) as usize;
        Self {
            window,
            pixels: vec![Pixel::default(); count],
            features: if features {
                vec![FeatureSums::default(); count]
            } else {
                Vec::new()
            },
            tiles: vec![TileSums::default(); tile::count(window)],
            parts: BTreeMap::new(),
            orders: None,
            splats: None,
            pieces: (0, 0),
            twin: None,
        }
    }

    /// An empty film for an adaptive render, in halves.
    pub fn in_halves(window: [u32; 4], features: bool) -> Self {
        Self {
            twin: Some(Box::new(Self::new(window, features))),
            ..Self::new(window, features)
        }
    }

    /// With `count` layers of light by scattering order, the last for all that was scattered more often; in all halves.
    pub fn with_orders(mut self, count: usize) -> Self {
        self.orders = (count > 0).then(|| orders::Orders::new(count, self.pixels.len()));
        self.twin = self.twin.map(|t| Box::new(t.with_orders(count)));
        self
    }

    /// Number of layers of light by scattering order.
    pub fn orders(&self) -> usize {
        self.orders.as_ref().map_or(0, |o| o.walks.count())
    }

    /// The first half, or the second.
    pub(crate) fn half(&mut self, second: bool) -> &mut Self {
        if !second || self.twin.is_none() {
            return self;
        }
        self.twin
            .as_deref_mut()
            .unwrap_or_else(|| unreachable!("there is a twin"))
    }

    /// The halves, or the film that has none.
    pub(crate) fn halves(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.twin.as_deref())
    }

    /// Makes this film the first half, and another the second.
    pub(crate) fn set_twin(&mut self, twin: Self) {
        self.twin = Some(Box::new(twin));
    }

    /// True if features are kept.
    pub(crate) fn has_features(&self) -> bool {
        !self.features.is_empty()
    }

    /// Makes one film of the halves, which must be of the same samples but for those in progress.
    pub(crate) fn unite(&mut self) -> Result<(), String> {
        match self.twin.take() {
            Some(twin) => self.join(&twin),
            None => Ok(()),
        }
    }

    /// Width and height of the window.
    pub fn size(&self) -> [u32; 2] {
        [
            self.window[2] - self.window[0],
            self.window[3] - self.window[1],
        ]
    }

    /// The window that is rendered: x0, y0, x1, y1 in pixels of the full image.
    pub fn window(&self) -> [u32; 4] {
        self.window
    }

    /// The tiles, in rows from the top.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = Rect> + use<> {
        tile::all(self.window)
    }

    /// Which samples tile `tile` has; of an adaptive render those of its first half.
    pub fn coverage(&self, tile: usize) -> &Coverage {
        self.tiles[tile].coverage()
    }

    /// Samples that every pixel has.
    pub fn least_samples(&self) -> u32 {
        (0..self.tiles.len())
            .map(|i| self.halves().map(|h| h.tiles[i].samples()).sum())
            .min()
            .unwrap_or(0)
    }

    /// True if walks from lights have left light.
    pub fn has_splats(&self) -> bool {
        self.halves().any(|h| h.splats.is_some())
    }

    /// Adds a finished buffer; `filter` spreads its splats.
    ///
    /// # Errors
    /// If some of its samples are there already, or it has some of two nets; then nothing is changed.
    pub fn merge(&mut self, b: Buffer, filter: &Filter) -> Result<(), String> {
        let tile = tile::at(self.window, b.min);
        let rect = tile::rect(self.window, tile);
        let net = nets::around(b.samples.start);
        if b.samples.end > net.end || (rect.min, rect.pixels()) != (b.min, b.pixels.len()) {
            return Err("a piece of work is a tile and samples of one net".into());
        }
        self.tiles[tile]
            .cover(b.samples.clone())
            .map_err(|twice| format!("samples {}..{} are taken twice", twice.start, twice.end))?;
        let mut part = Part {
            samples: b.samples.end - b.samples.start,
            pixels: b.pixels.iter().map(|p| p.radiance).collect(),
            splats: [0; 3],
        };
        let samples = u64::from(part.samples) * b.pixels.len() as u64;
        if !b.splats.is_empty() {
            let sums = self
                .splats
                .get_or_insert_with(|| splat::Sums::new(self.pixels.len()));
            let orders = &mut self.orders;
            let heard = |i, order, value| {
                if let Some(orders) = orders {
                    orders.splats.deposit(i, order, value);
                }
            };
            part.splats = sums.add(&b.splats, self.window, filter, samples, heard);
            add(&mut self.tiles[tile].splats, part.splats);
        }
        self.pieces.0 += 1;
        self.pieces.1 += samples;
        for (i, at) in rect.indices(self.window).enumerate() {
            let (p, q) = (&b.pixels[i], &mut self.pixels[at]);
            add(&mut q.sum, p.radiance);
            q.alpha = q.alpha.wrapping_add(p.alpha);
            if let (Some(f), Some(g)) = (b.features.get(i), self.features.get_mut(at)) {
                g.add(f);
            }
            if let (Some(f), Some(g)) = (&b.orders, &mut self.orders) {
                g.walks.merge(at, f, i);
            }
        }
        self.complete(tile, net.start, part);
        Ok(())
    }

    /// Counts a part of a net, together with what else is there of it.
    fn complete(&mut self, tile: usize, net: u32, mut part: Part) {
        if let Some(before) = self.parts.remove(&(tile, net)) {
            self.count(tile, &before, Squares::subtract);
            part.join(&before);
        }
        self.count(tile, &part, Squares::add);
        if part.samples < nets::around(net).len() as u32 {
            self.parts.insert((tile, net), part);
        }
    }

    /// Counts a net, or a part of it, for the variance, or takes that back.
    fn count(&mut self, tile: usize, part: &Part, change: fn(&mut Squares, Squares)) {
        let rect = tile::rect(self.window, tile);
        let n = f64::from(part.samples);
        for (at, sum) in rect.indices(self.window).zip(&part.pixels) {
            for (square, sum) in self.pixels[at].squares.iter_mut().zip(sum) {
                change(square, Squares::of(float(*sum), n));
            }
        }
        let mean = part.mean(self.pixels.len());
        for (square, mean) in self.tiles[tile].squares.iter_mut().zip(mean) {
            change(square, Squares::of(mean, n));
        }
    }

    /// Adds another film of the same picture.
    ///
    /// # Errors
    /// If they are not parts of one picture, or have samples in common; then nothing is changed.
    pub fn join(&mut self, other: &Self) -> Result<(), String> {
        let layers = |f: &Self| (f.features.len(), f.orders());
        if self.window != other.window || layers(self) != layers(other) {
            return Err("they are not of one picture".into());
        }
        if self.twin.is_some() || other.twin.is_some() {
            return Err("adaptive renders have no sample ranges".into());
        }
        let mut tiles = self.tiles.clone();
        for (i, (a, b)) in tiles.iter_mut().zip(&other.tiles).enumerate() {
            a.join(b).map_err(|twice| {
                let [x, y] = tile::rect(self.window, i).min;
                let Range { start, end } = twice;
                format!("both have samples {start}..{end} of the tile at ({x}, {y})")
            })?;
        }
        self.tiles = tiles;
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            add(&mut a.sum, b.sum);
            a.alpha = a.alpha.wrapping_add(b.alpha);
            let squares = a.squares.iter_mut().zip(b.squares);
            squares.for_each(|(a, b)| a.add(b));
        }
        for (a, b) in self.features.iter_mut().zip(&other.features) {
            a.add(b);
        }
        if let (Some(a), Some(b)) = (&mut self.orders, &other.orders) {
            a.join(b);
        }
        if let Some(splats) = &other.splats {
            self.splats
                .get_or_insert_with(|| splat::Sums::new(self.pixels.len()))
                .join(splats);
        }
        self.pieces.0 = self.pieces.0.wrapping_add(other.pieces.0);
        self.pieces.1 = self.pieces.1.wrapping_add(other.pieces.1);
        for ((tile, net), part) in &other.parts {
            // Both have counted what they have of the net.
            self.count(*tile, part, Squares::subtract);
            self.complete(*tile, *net, part.clone());
        }
        Ok(())
    }

    /// One tile as a film of its own, without features and splats.
    pub(crate) fn cut(&self, tile: usize) -> Self {
        let rect = tile::rect(self.window, tile);
        let mut out = Self::new([rect.min[0], rect.min[1], rect.max[0], rect.max[1]], false);
        out.pixels = rect.indices(self.window).map(|i| self.pixels[i]).collect();
        let tile_sums = self.tiles[tile].clone();
        let samples = u64::from(tile_sums.samples()) * rect.pixels() as u64;
        out.pieces = (tile_sums.nets().into(), samples);
        out.tiles[0] = tile_sums;
        let parts = self.parts.range((tile, 0)..(tile + 1, 0));
        out.parts = parts
            .map(|((_, net), part)| ((0, *net), part.clone()))
            .collect();
        out
    }

    /// True if no pixel has a sample yet.
    pub fn is_empty(&self) -> bool {
        self.halves().all(|h| h.pieces.1 == 0)
    }

    /// The estimates of pixel `i`, counted in rows from the top of the window.
    pub fn estimate(&self, i: usize) -> Estimate {
        let own = self.half_estimate(i);
        let Some(twin) = &self.twin else {
            return own;
        };
        let other = twin.half_estimate(i);
        // Only before both have begun, by an interruption: nothing was decided by then.
        if own.samples == 0 || other.samples == 0 {
            return if own.samples == 0 { other } else { own };
        }
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let sum = sum_of(own.spread(), other.spread());
        Estimate {
            mean: [0, 1, 2].map(|k| mean(own.mean[k], other.mean[k])),
            variance: sum.map(|(v, _)| v.map(|v| 0.25 * v)),
            alpha: mean(own.alpha, other.alpha),
            samples: own.samples + other.samples,
            degrees: sum.map_or([0.0; 3], |(_, d)| d),
        }
    }

    fn half_estimate(&self, i: usize) -> Estimate {
        let p = &self.pixels[i];
        let tile = &self.tiles[tile::of_pixel(self.window, i)];
        let (samples, nets) = (tile.samples(), tile.nets());
        let n = f64::from(samples.max(1));
        let mut mean = p.sum.map(|s| float(s) / n);
        let degrees = f64::from(nets) - 1.0;
        let mut spread = (nets >= 2).then(|| {
            let variance = [0, 1, 2].map(|lane| {
                let spread = p.squares[lane].float() - n * mean[lane] * mean[lane];
                spread.max(0.0) / (degrees * n)
            });
            (variance, [degrees; 3])
        });
        if let Some(splats) = &self.splats {
            let (m, v) = splats.estimate(i, self.pieces);
            mean = [0, 1, 2].map(|lane| mean[lane] + m[lane]);
            // A pixel's own samples and what falls on it from all others' are all but independent.
            let pieces = self.pieces.0 as f64;
            spread = sum_of(spread, v.map(|v| (v, [pieces - 1.0; 3])));
        }
        Estimate {
            mean,
            variance: spread.map(|(v, _)| v),
            alpha: float(p.alpha) / n,
            samples,
            degrees: spread.map_or([0.0; 3], |(_, d)| d),
        }
    }

    /// Mean radiance of layer `k` by scattering order at pixel `i`; zero if there are no layers.
    pub fn order(&self, i: usize, k: usize) -> [f64; 3] {
        let tile = tile::of_pixel(self.window, i);
        // As the picture's: halves that have not begun do not count.
        let begun = |h: &&Self| h.tiles[tile].samples() > 0;
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for h in self.halves().filter(begun) {
            let Some(orders) = &h.orders else { continue };
            let n = f64::from(h.tiles[tile].samples());
            let (a, b) = (orders.walks.sum(i, k), orders.splats.sum(i, k));
            let m = h.pieces.1.max(1) as f64;
            sum = [0, 1, 2].map(|lane| sum[lane] + float(a[lane]) / n + float(b[lane]) / m);
            count += 1.0;
        }
        sum.map(|v| v / f64::max(count, 1.0))
    }

    /// The features of pixel `i`; zero if they were not asked for.
    pub fn features(&self, i: usize) -> Features {
        let mut f = FeatureSums::default();
        for h in self.halves().filter_map(|h| h.features.get(i)) {
            f.add(h);
        }
        if f.hits == 0 {
            return Features::default();
        }
        let n = f.hits as f64;
        Features {
            depth: float(f.depth) / n,
            albedo: f.albedo.map(|v| float(v) / n),
            normal: f.normal.map(|v| float(v) / n),
        }
    }
}

#[cfg(test)]
mod tests;
