//! A texture: decoded texels with the settings of a scene's texture, looked up at texture coordinates.

use super::srgb;
use resolvent_image::{TexelData, Texels};
use resolvent_scene::{self as describe, ColorSpace, TextureChannel, TextureFilter, Wrap};
use std::sync::Arc;

/// How the numbers of an image become linear ones; alpha is linear already.
#[derive(Clone, Copy)]
enum Curve {
    /// They are.
    None,
    /// By a table with one entry per code.
    Table(&'static [f32]),
    /// By the formula, for floating-point images.
    Formula,
}

/// What the values of a texture come from.
enum Pixels {
    /// No image: white everywhere.
    White,
    /// One image.
    Image(Arc<Texels>),
    /// Images of unit squares, by column + 10 row.
    Tiles(Box<[Option<Texture>]>),
}

/// An image, or several side by side, and how it is read.
pub struct Texture {
    pixels: Pixels,
    vertex_color: bool,
    curve: Curve,
    wrap: [Wrap; 2],
    nearest: bool,
    channel: Option<usize>,
    scale: [f32; 3],
    bias: [f32; 3],
    /// Rows of the map from the surface's coordinates to the image's.
    uv: [[f32; 3]; 2],
}

/// Columns of tiles.
pub(super) const COLUMNS: usize = 10;
/// The colour of meshes that have none.
const WHITE: [f32; 4] = [1.0; 4];

impl Texture {
    /// The image `texels` (white without one) with the settings of `t`.
    pub fn new(texels: Option<Arc<Texels>>, t: &describe::Texture) -> Self {
        let curve = texels.as_ref().map_or(Curve::None, |texels| {
            let srgb = match t.color_space {
                ColorSpace::Auto => !texels.data.is_float(),
                ColorSpace::Srgb => true,
                ColorSpace::Linear => false,
            };
            match (&texels.data, srgb) {
                (_, false) => Curve::None,
                (TexelData::U8(_), true) => Curve::Table(srgb::table8()),
                (TexelData::U16(_), true) => Curve::Table(srgb::table16()),
                (TexelData::F16(_) | TexelData::F32(_), true) => Curve::Formula,
            }
        });
        Self {
            pixels: texels.map_or(Pixels::White, Pixels::Image),
            vertex_color: t.vertex_color,
            curve,
            wrap: t.wrap,
            nearest: t.filter == TextureFilter::Nearest,
            channel: t.channel.map(|c| match c {
                TextureChannel::Red => 0,
                TextureChannel::Green => 1,
                TextureChannel::Blue => 2,
                TextureChannel::Alpha => 3,
            }),
            scale: t.scale.map(|v| v as f32),
            bias: t.bias.map(|v| v as f32),
            uv: t.uv.rows().map(|row| row.map(|v| v as f32)),
        }
    }

    /// Tiles by column + 10 row, with the settings of `t`.
    pub fn tiled(tiles: Vec<Option<Arc<Texels>>>, t: &describe::Texture) -> Self {
        // What is done to values is done once, to those of the whole.
        let settings = describe::Texture {
            uv: describe::UvTransform::default(),
            wrap: [Wrap::Clamp; 2],
            channel: None,
            scale: [1.0; 3],
            bias: [0.0; 3],
            vertex_color: false,
            ..t.clone()
        };
        let tile = |texels: Option<Arc<Texels>>| texels.map(|x| Self::new(Some(x), &settings));
        Self {
            pixels: Pixels::Tiles(tiles.into_iter().map(tile).collect()),
            ..Self::new(None, t)
        }
    }

    /// Red, green, blue and alpha at the surface's texture coordinates, where the mesh has the colour `color`.
    #[inline]
    pub fn at(&self, uv: [f32; 2], color: &[f32; 4]) -> [f32; 4] {
        let place = || self.uv.map(|r| r[0] * uv[0] + r[1] * uv[1] + r[2]);
        let mut v = match &self.pixels {
            Pixels::White => WHITE,
            Pixels::Image(texels) => self.image(texels, place()),
            Pixels::Tiles(tiles) => tile(tiles, place()),
        };
        if self.vertex_color {
            v.iter_mut().zip(color).for_each(|(v, c)| *v *= c);
        }
        self.finish(v)
    }

    #[inline(always)]
    fn image(&self, texels: &Texels, [x, y]: [f32; 2]) -> [f32; 4] {
        // The image's rows go down, its coordinates up.
        let x = Along::new(x, texels.width, self.wrap[0]);
        let y = Along::new(1.0 - y, texels.height, self.wrap[1]);
        if self.nearest {
            self.texel(texels, x.nearest(), y.nearest())
        } else {
            let ((x0, x1, fx), (y0, y1, fy)) = (x.pair(), y.pair());
            let [a, b, c, d] =
                [(x0, y0), (x1, y0), (x0, y1), (x1, y1)].map(|(x, y)| self.texel(texels, x, y));
            // Equal texels give exactly their value.
            let mix = |a: f32, b: f32, f: f32| a + (b - a) * f;
            [0, 1, 2, 3].map(|i| mix(mix(a[i], b[i], fx), mix(c[i], d[i], fx), fy))
        }
    }

    /// Mean over the texels of red, green, blue and alpha after `bound`, where the mesh is white.
    pub fn mean(&self, bound: &dyn Fn([f32; 4]) -> [f32; 4]) -> [f32; 4] {
        let mut sum = [0f64; 4];
        let mut add = |v: [f32; 4], n: usize| {
            (0..4).for_each(|i| sum[i] += f64::from(v[i]) / n as f64);
        };
        let finished = |v| bound(self.finish(v));
        match &self.pixels {
            Pixels::White => add(finished(WHITE), 1),
            Pixels::Image(t) => {
                for (x, y) in (0..t.height).flat_map(|y| (0..t.width).map(move |x| (x, y))) {
                    add(finished(self.texel(t, x, y)), t.width * t.height);
                }
            }
            Pixels::Tiles(tiles) => {
                let n = tiles.iter().flatten().count();
                for tile in tiles.iter().flatten() {
                    add(tile.mean(&finished), n);
                }
            }
        }
        sum.map(|v| v as f32)
    }

    /// Channel, factor and offset.
    #[inline(always)]
    fn finish(&self, mut v: [f32; 4]) -> [f32; 4] {
        if let Some(c) = self.channel {
            v = [v[c], v[c], v[c], v[3]];
        }
        let [r, g, b] = [0, 1, 2].map(|i| v[i] * self.scale[i] + self.bias[i]);
        [r, g, b, v[3]]
    }

    /// All texels of the image, decoded, in rows from its top; none without an image of its own.
    pub fn decoded(&self) -> impl Iterator<Item = [f32; 4]> {
        let image = match &self.pixels {
            Pixels::Image(t) => Some(&**t),
            _ => None,
        };
        image.into_iter().flat_map(move |t| {
            (0..t.height).flat_map(move |y| (0..t.width).map(move |x| self.texel(t, x, y)))
        })
    }

    /// The texel in column `x` of row `y`, decoded; nothing outside of the image.
    #[inline(always)]
    fn texel(&self, t: &Texels, x: usize, y: usize) -> [f32; 4] {
        if x >= t.width || y >= t.height {
            return [0.0; 4];
        }
        let first = (y * t.width + x) * t.channels;
        let range = first..first + t.channels;
        match &t.data {
            TexelData::U8(v) => self.decode(&v[range], |c| usize::from(*c), 1.0 / 255.0),
            TexelData::U16(v) => self.decode(&v[range], |c| usize::from(*c), 1.0 / 65535.0),
            TexelData::F16(v) => self.expand(&v[range], |c| c.to_f32()),
            TexelData::F32(v) => self.expand(&v[range], |c| *c),
        }
    }

    /// From codes; the last of an even number of channels is alpha.
    #[inline(always)]
    fn decode<C>(&self, codes: &[C], index: impl Fn(&C) -> usize, unit: f32) -> [f32; 4] {
        let color = |c: &C| match self.curve {
            Curve::Table(table) => table[index(c)],
            _ => index(c) as f32 * unit,
        };
        let alpha = |c: &C| index(c) as f32 * unit;
        spread(codes, color, alpha)
    }

    /// From floating-point values.
    #[inline(always)]
    fn expand<C>(&self, values: &[C], value: impl Fn(&C) -> f32) -> [f32; 4] {
        let color = |c: &C| match self.curve {
            Curve::Formula => srgb::linear(f64::from(value(c))) as f32,
            _ => value(c),
        };
        spread(values, color, &value)
    }
}

/// The value on the tile that lies under (x, y), nothing where there is none.
fn tile(tiles: &[Option<Texture>], [x, y]: [f32; 2]) -> [f32; 4] {
    let (column, row) = (x.floor(), y.floor());
    let lies = (0.0..COLUMNS as f32).contains(&column) && (0.0..1000.0).contains(&row);
    if !lies {
        return [0.0; 4];
    }
    match tiles.get(row as usize * COLUMNS + column as usize) {
        Some(Some(tile)) => tile.at([x - column, y - row], &WHITE),
        _ => [0.0; 4],
    }
}

/// One to four channels as four.
#[inline(always)]
fn spread<C>(channels: &[C], color: impl Fn(&C) -> f32, alpha: impl Fn(&C) -> f32) -> [f32; 4] {
    match channels {
        [y] => {
            let y = color(y);
            [y, y, y, 1.0]
        }
        [y, a] => {
            let y = color(y);
            [y, y, y, alpha(a)]
        }
        [r, g, b] => [color(r), color(g), color(b), 1.0],
        [r, g, b, a, ..] => [color(r), color(g), color(b), alpha(a)],
        [] => [0.0; 4],
    }
}

/// An index beyond every image.
const OUTSIDE: usize = usize::MAX;

/// A position along one axis of an image, wrapped: in texels from the first one's outer edge.
#[derive(Clone, Copy)]
struct Along {
    position: f32,
    size: usize,
    wrap: Wrap,
}

impl Along {
    #[inline(always)]
    fn new(coordinate: f32, size: usize, wrap: Wrap) -> Self {
        // A coordinate that is no number has to be somewhere.
        let c = if coordinate.is_finite() {
            coordinate
        } else {
            0.0
        };
        let unit = match wrap {
            Wrap::Repeat => c - c.floor(),
            Wrap::Clamp => c.clamp(0.0, 1.0),
            // Further out there is no more than one image away.
            Wrap::Black => c.clamp(-1.0, 2.0),
            Wrap::Mirror => {
                let period = c - 2.0 * (0.5 * c).floor();
                if period > 1.0 { 2.0 - period } else { period }
            }
        };
        Self {
            position: unit * size as f32,
            size,
            wrap,
        }
    }

    /// The texel whose square it lies in.
    #[inline(always)]
    fn nearest(&self) -> usize {
        if self.wrap == Wrap::Black && !(0.0..=self.size as f32).contains(&self.position) {
            return OUTSIDE;
        }
        // c − ⌊c⌋ rounds to 1 just below an integer: that is the last texel.
        (self.position as usize).min(self.size - 1)
    }

    /// The two texels whose middles it lies between, and the weight of the second.
    #[inline(always)]
    fn pair(&self) -> (usize, usize, f32) {
        let from_middle = self.position - 0.5;
        let low = from_middle.floor();
        let weight = from_middle - low;
        if self.wrap == Wrap::Black {
            let place = |i: f32| if i < 0.0 { OUTSIDE } else { i as usize };
            return (place(low), place(low + 1.0), weight);
        }
        // At most half a texel beyond either edge.
        let last = self.size - 1;
        let beyond = match self.wrap {
            Wrap::Repeat => (last, 0),
            Wrap::Clamp | Wrap::Mirror | Wrap::Black => (0, last),
        };
        let first = if low < 0.0 {
            beyond.0
        } else {
            (low as usize).min(last)
        };
        let second = if low < 0.0 { 0 } else { low as usize + 1 };
        let second = if second > last { beyond.1 } else { second };
        (first, second, weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use describe::{ImageSource, UvTransform};

    fn described() -> describe::Texture {
        describe::Texture {
            color_space: ColorSpace::Linear,
            ..describe::Texture::new(ImageSource::File("x.png".into()))
        }
    }

    /// A grey image of `width` columns; the first row is the top one.
    fn grey(width: usize, values: &[f32], edit: impl FnOnce(&mut describe::Texture)) -> Texture {
        let texels = Texels {
            width,
            height: values.len() / width,
            channels: 1,
            data: TexelData::F32(values.to_vec()),
        };
        let mut t = described();
        edit(&mut t);
        Texture::new(Some(Arc::new(texels)), &t)
    }

    fn red(t: &Texture, u: f32, v: f32) -> f32 {
        t.at([u, v], &WHITE)[0]
    }

    #[test]
    fn texels_are_met_in_their_middles_from_the_lower_left() {
        // 4 × 2: the upper row is 0 1 2 3, the lower 4 5 6 7.
        let values: Vec<f32> = (0..8u8).map(f32::from).collect();
        for filter in [TextureFilter::Bilinear, TextureFilter::Nearest] {
            let t = grey(4, &values, |t| t.filter = filter);
            for x in 0..4 {
                let u = (x as f32 + 0.5) / 4.0;
                assert_eq!(red(&t, u, 0.75), values[x]);
                assert_eq!(red(&t, u, 0.25), values[4 + x]);
            }
        }
    }

    #[test]
    fn between_middles_values_are_bilinear() {
        let t = grey(2, &[0.0, 8.0, 16.0, 64.0], |t| t.wrap = [Wrap::Clamp; 2]);
        // Middles are at 0.25 and 0.75; the upper row (v = 0.75) is 0 8, the lower 16 64.
        for (u, v, expected) in [
            (0.5, 0.75, 4.0),
            (0.5, 0.25, 40.0),
            (0.25, 0.5, 8.0),
            (0.375, 0.75, 2.0),
            // a quarter of the way right, three quarters of the way up: ¼·(16 + 12) + ¾·(0 + 2)
            (0.375, 0.625, 8.5),
            (0.0, 1.0, 0.0),
            (1.0, 0.0, 64.0),
        ] {
            assert_eq!(red(&t, u, v), expected, "({u}, {v})");
        }
    }

    #[test]
    fn beyond_the_edges() {
        let row = [1.0, 2.0, 4.0, 8.0];
        let at = |wrap: Wrap, u: f32| red(&grey(4, &row, |t| t.wrap[0] = wrap), u, 0.5);
        // Across the edge, halfway between the last middle and the next.
        assert_eq!(at(Wrap::Repeat, 0.0), 4.5);
        assert_eq!(at(Wrap::Repeat, 1.0), 4.5);
        assert_eq!(at(Wrap::Clamp, 0.0), 1.0);
        assert_eq!(at(Wrap::Clamp, 1.0), 8.0);
        assert_eq!(at(Wrap::Mirror, 0.0), 1.0);
        assert_eq!(at(Wrap::Mirror, 1.0), 8.0);
        // Black: halfway between the last middle and nothing, and nothing beyond.
        assert_eq!(at(Wrap::Black, 0.0), 0.5);
        assert_eq!(at(Wrap::Black, 1.0), 4.0);
        assert_eq!(at(Wrap::Black, 0.375), 2.0);
        for u in [-1e9, -2.0, -0.13, 1.13, 2.5, 1e9] {
            assert_eq!(at(Wrap::Black, u), 0.0, "{u}");
        }
        for i in -3i16..=3 {
            for (x, value) in row.iter().enumerate() {
                let u = f32::from(i) + (x as f32 + 0.5) / 4.0;
                assert_eq!(at(Wrap::Repeat, u), *value, "{u}");
                let mirrored = if i % 2 == 0 { *value } else { row[3 - x] };
                assert_eq!(at(Wrap::Mirror, u), mirrored, "{u}");
                let clamped = match i {
                    0 => *value,
                    i if i < 0 => 1.0,
                    _ => 8.0,
                };
                assert_eq!(at(Wrap::Clamp, u), clamped, "{u}");
            }
        }
        let sharp = grey(4, &row, |t| {
            t.wrap[0] = Wrap::Black;
            t.filter = TextureFilter::Nearest;
        });
        for (u, expected) in [(-0.01, 0.0), (0.0, 1.0), (0.99, 8.0), (1.01, 0.0)] {
            assert_eq!(red(&sharp, u, 0.5), expected, "{u}");
        }
        // Just below an integer, where u − ⌊u⌋ rounds to 1, and numbers that are none.
        let below = grey(4, &row, |t| t.filter = TextureFilter::Nearest);
        assert_eq!(red(&below, -1e-12, 0.5), 8.0);
        for odd in [f32::NAN, f32::INFINITY, f32::MIN, 1e30] {
            assert!(red(&below, odd, odd) >= 1.0);
        }
    }

    /// Tiles show their own square, upright, and nothing where there is none; factor and offset apply everywhere.
    #[test]
    fn tiles() {
        let tile = |v: [f32; 2]| {
            Some(Arc::new(Texels {
                width: 1,
                height: 2,
                channels: 1,
                data: TexelData::F32(v.to_vec()),
            }))
        };
        let mut all = vec![None; 12];
        (all[0], all[9], all[11]) = (tile([1.0, 2.0]), tile([3.0, 3.0]), tile([4.0, 5.0]));
        let mut t = described();
        t.scale = [2.0; 3];
        t.bias = [0.5; 3];
        let tiled = Texture::tiled(all, &t);
        for (u, v, expected) in [
            (0.5, 0.9, 1.0),
            (0.5, 0.1, 2.0),
            (9.5, 0.5, 3.0),
            (1.2, 1.8, 4.0),
            (1.2, 1.2, 5.0),
            (0.5, 1.5, 0.0),
            (-0.5, 0.5, 0.0),
            (10.5, 0.5, 0.0),
            (0.5, 1e20, 0.0),
            (f32::NAN, 0.5, 0.0),
        ] {
            assert_eq!(red(&tiled, u, v), 2.0 * expected + 0.5, "({u}, {v})");
        }
        assert_eq!(tiled.mean(&|v| v)[0], 2.0 * 3.0 + 0.5);
    }

    #[test]
    fn axes_wrap_on_their_own() {
        let t = grey(2, &[0.0, 1.0, 2.0, 3.0], |t| {
            t.wrap = [Wrap::Repeat, Wrap::Clamp];
            t.filter = TextureFilter::Nearest;
        });
        assert_eq!(red(&t, 1.25, 9.0), 0.0);
        assert_eq!(red(&t, -0.25, -9.0), 3.0);
    }

    /// 8 and 16 bits: exact ends, the standard's curve, interpolation after decoding, alpha linear.
    #[test]
    fn codes_are_decoded_before_they_are_interpolated() {
        let rgba = Texels {
            width: 2,
            height: 1,
            channels: 4,
            data: TexelData::U8(vec![0, 128, 255, 128, 255, 128, 0, 0]),
        };
        let srgb = describe::Texture::new(ImageSource::File("x.png".into()));
        let t = Texture::new(Some(Arc::new(rgba.clone())), &srgb);
        let half = srgb::linear(128.0 / 255.0) as f32;
        assert_eq!(t.at([0.25, 0.5], &WHITE), [0.0, half, 1.0, 128.0 / 255.0]);
        let middle = t.at([0.5, 0.5], &WHITE);
        assert_eq!(middle[0], 0.5);
        assert!((middle[3] - 64.0 / 255.0).abs() < 1e-7);
        let t = Texture::new(Some(Arc::new(rgba)), &described());
        assert_eq!(t.at([0.25, 0.5], &WHITE)[1], 128.0 / 255.0);
        let wide = Texels {
            width: 1,
            height: 1,
            channels: 3,
            data: TexelData::U16(vec![0, 32_896, 65_535]),
        };
        let t = Texture::new(Some(Arc::new(wide)), &srgb);
        assert_eq!(t.at([0.3, 0.3], &WHITE), [0.0, half, 1.0, 1.0]);
    }

    #[test]
    fn floats_are_linear_unless_said_otherwise() {
        let texels = Arc::new(Texels {
            width: 1,
            height: 1,
            channels: 3,
            data: TexelData::F16([0.5, -0.5, 4.0].map(half::f16::from_f32).to_vec()),
        });
        let auto = describe::Texture::new(ImageSource::File("x.exr".into()));
        assert_eq!(
            Texture::new(Some(texels.clone()), &auto).at([0.0, 0.0], &WHITE),
            [0.5, -0.5, 4.0, 1.0]
        );
        let srgb = describe::Texture {
            color_space: ColorSpace::Srgb,
            ..auto
        };
        let v = Texture::new(Some(texels), &srgb).at([0.0, 0.0], &WHITE);
        assert_eq!([v[0], v[1]], [0.5, -0.5].map(|x| srgb::linear(x) as f32));
    }

    #[test]
    fn channels_factors_and_the_mean() {
        let texels = Arc::new(Texels {
            width: 2,
            height: 1,
            channels: 2,
            data: TexelData::F32(vec![0.25, 0.5, 0.75, 1.0]),
        });
        let mut t = described();
        t.scale = [2.0, -1.0, 0.0];
        t.bias = [0.0, 1.0, 0.125];
        let grey = Texture::new(Some(texels.clone()), &t);
        assert_eq!(grey.at([0.25, 0.0], &WHITE), [0.5, 0.75, 0.125, 0.5]);
        assert_eq!(grey.mean(&|v| v), [1.0, 0.5, 0.125, 0.75]);
        t.channel = Some(TextureChannel::Alpha);
        let alpha = Texture::new(Some(texels), &t);
        assert_eq!(alpha.at([0.25, 0.0], &WHITE), [1.0, 0.5, 0.125, 0.5]);
    }

    /// Vertex colours are factors on texels, alpha included, before a channel is picked; without an image they stand alone.
    #[test]
    fn colours_of_vertices() {
        let texels = Arc::new(Texels {
            width: 1,
            height: 1,
            channels: 2,
            data: TexelData::F32(vec![0.5, 0.25]),
        });
        let color = [0.5, 1.0, 2.0, 0.5];
        let mut t = described();
        assert_eq!(
            Texture::new(Some(texels.clone()), &t).at([0.5; 2], &color),
            [0.5, 0.5, 0.5, 0.25]
        );
        t.vertex_color = true;
        let product = Texture::new(Some(texels.clone()), &t).at([0.5; 2], &color);
        assert_eq!(product, [0.25, 0.5, 1.0, 0.125]);
        assert_eq!(Texture::new(None, &t).at([0.5; 2], &color), color);
        t.channel = Some(TextureChannel::Alpha);
        t.scale = [2.0; 3];
        let alpha = Texture::new(Some(texels), &t).at([0.5; 2], &color);
        assert_eq!(alpha[..3], [0.25; 3]);
        assert_eq!(Texture::new(None, &t).mean(&|v| v)[..3], [2.0; 3]);
    }

    /// The transform scales, rotates counter-clockwise and moves, in this order.
    #[test]
    fn coordinates_are_transformed() {
        let values: Vec<f32> = (0..64u8).map(f32::from).collect();
        let plain = grey(8, &values, |_| {});
        let uv = UvTransform {
            scale: [2.0, 0.5],
            rotation_deg: 90.0,
            offset: [0.125, 0.25],
        };
        let turned = grey(8, &values, |t| t.uv = uv);
        for (u, v) in [(0.1, 0.7), (0.0, 0.0), (0.33, 0.9), (-0.4, 1.6)] {
            // (u, v) → (2u, v/2) → (−v/2, 2u) → + offset
            let expected = red(&plain, 0.125 - 0.5 * v, 0.25 + 2.0 * u);
            let found = red(&turned, u, v);
            assert!((found - expected).abs() < 1e-3, "{found} {expected}");
        }
    }
}
