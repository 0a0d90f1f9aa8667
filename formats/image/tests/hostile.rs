//! Damaged files give errors: no panic, no abort, no memory beyond what the file can hold.

use std::io::Cursor;

use exr::prelude::*;
use resolvent_image::{BEAUTY, Image, Limits};

/// A small generator (SplitMix64, Steele et al. 2014), so that every run does the same.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

const COMPRESSIONS: [Compression; 8] = [
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::ZIP16,
    Compression::PIZ,
    Compression::PXR24,
    Compression::B44,
    Compression::B44A,
];

/// A file with half, float and integer channels.
fn file(compression: Compression, blocks: Blocks, parts: usize) -> Vec<u8> {
    let size = Vec2(37, 41);
    let value = |i: usize| ((i * 7919) % 1000) as f32 * 0.01;
    let layer = |part: usize| {
        let channels = AnyChannels::sort(smallvec::smallvec![
            AnyChannel::new("R", FlatSamples::F32((0..size.area()).map(value).collect())),
            AnyChannel::new(
                "G",
                FlatSamples::F16(
                    (0..size.area())
                        .map(|i| half::f16::from_f32(value(i)))
                        .collect()
                )
            ),
            AnyChannel::new("B", FlatSamples::F32(vec![0.25; size.area()])),
            AnyChannel::new(
                "samples.N",
                FlatSamples::U32((0..size.area() as u32).collect())
            ),
        ]);
        let encoding = Encoding {
            compression,
            blocks,
            line_order: LineOrder::Increasing,
        };
        Layer::new(
            size,
            LayerAttributes::named(format!("part {part}").as_str()),
            encoding,
            channels,
        )
    };
    let mut bytes = Cursor::new(Vec::new());
    let layers: Vec<_> = (0..parts).map(layer).collect();
    let image = exr::image::Image::from_layers(
        ImageAttributes::new(IntegerBounds::from_dimensions(size)),
        layers,
    );
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn files() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for compression in COMPRESSIONS {
        all.push(file(compression, Blocks::ScanLines, 1));
        all.push(file(compression, Blocks::Tiles(Vec2(16, 16)), 1));
    }
    all.push(file(Compression::ZIP16, Blocks::ScanLines, 2));
    all
}

fn parse(bytes: &[u8]) -> std::result::Result<Image, resolvent_image::Error> {
    Image::parse_exr(bytes, "x.exr", Limits { values: 1 << 20 })
}

#[test]
fn all_kinds_are_read() {
    for bytes in files() {
        let image = parse(&bytes).unwrap();
        assert_eq!((image.width, image.height), (37, 41));
        let exact = (0..image.pixels()).map(|i| ((i * 7919) % 1000) as f32 * 0.01);
        let red = image.channel(BEAUTY, "R").unwrap();
        // PXR24 keeps 16 bits of the fraction; all other compressions keep f32 as it is.
        assert!(
            red.iter()
                .zip(exact)
                .all(|(a, b)| (a - b).abs() <= b * 2.0f32.powi(-16))
        );
        assert_eq!(image.channel("samples", "N").unwrap()[40], 40.0);
    }
    let two = parse(&file(Compression::ZIP16, Blocks::ScanLines, 2)).unwrap();
    assert!(two.channel("part 1", "R").is_some() && two.channel("part 1.samples", "N").is_some());
}

#[test]
fn truncated_files() {
    for bytes in files() {
        for end in (0..bytes.len().min(1200)).chain((1200..bytes.len()).step_by(97)) {
            assert!(
                parse(&bytes[..end]).is_err(),
                "cut after {end} of {}",
                bytes.len()
            );
        }
    }
}

#[test]
fn mutated_files() {
    let mut random = Random(1);
    let files = files();
    // RESOLVENT_FUZZ multiplies the work for a longer search.
    let times: usize = std::env::var("RESOLVENT_FUZZ")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(1);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..4000 * times {
        let mut bytes = files[random.below(files.len())].clone();
        let reach = if random.below(4) > 0 { 700 } else { usize::MAX };
        for _ in 0..1 + random.below(3) {
            let at = random.below(bytes.len().min(reach));
            match random.below(5) {
                0 => bytes[at] ^= 1 << random.below(8),
                1 => bytes[at] = random.next() as u8,
                2 => {
                    let word = [0, 1, -1, i32::MAX, i32::MIN, 1 << 24, 65_535][random.below(7)];
                    let end = (at + 4).min(bytes.len());
                    bytes[at..end].copy_from_slice(&word.to_le_bytes()[..end - at]);
                }
                3 => {
                    let count = random.below(8).min(bytes.len() - at - 1);
                    bytes.drain(at..at + count);
                }
                _ => {
                    let piece: Vec<u8> =
                        (0..random.below(8)).map(|_| random.next() as u8).collect();
                    bytes.splice(at..at, piece);
                }
            }
        }
        match parse(&bytes) {
            Ok(_) => read += 1,
            Err(error) => {
                assert!(error.to_string().starts_with("x.exr: "), "{error}");
                refused += 1;
            }
        }
    }
    assert!(
        read > 100 && refused > 100,
        "{read} read, {refused} refused"
    );
    check_memory();
}

/// A header that asks for much memory is refused before it gets it.
fn check_memory() {
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let peak = status.lines().find(|l| l.starts_with("VmPeak:")).unwrap();
        let kilobytes: u64 = peak.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(kilobytes < 4 << 20, "{peak}");
    }
}

#[test]
fn headers_that_promise_too_much() {
    let bytes = file(Compression::ZIP16, Blocks::ScanLines, 1);
    let find =
        |name: &[u8]| bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    for (width, height) in [
        (60_000, 60_000),
        (i32::MAX / 4, 4),
        (4, i32::MAX / 4),
        (i32::MAX - 2, i32::MAX - 2),
    ] {
        let mut huge = bytes.clone();
        for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
            let at = find(window);
            huge[at + 8..at + 12].copy_from_slice(&i32::to_le_bytes(width));
            huge[at + 12..at + 16].copy_from_slice(&i32::to_le_bytes(height));
        }
        let error = parse(&huge).unwrap_err().to_string();
        assert!(error.contains("x.exr: "), "{error}");
    }
    let large = Image::parse_exr(
        &bytes,
        "x.exr",
        Limits {
            values: 37 * 41 * 4 - 1,
        },
    )
    .unwrap_err();
    assert_eq!(
        large.to_string(),
        "x.exr: has 6068 values, more than the 6067 that are read"
    );
    check_memory();
}

#[test]
fn what_is_no_exr() {
    for bytes in [&b""[..], b"PNG", b"\x76\x2f\x31\x01", &[0; 1000]] {
        assert!(parse(bytes).is_err());
    }
    assert!(
        Image::read_exr("/dev/zero")
            .unwrap_err()
            .to_string()
            .contains("is not a file")
    );
    assert!(
        Image::read_exr("/")
            .unwrap_err()
            .to_string()
            .contains("is not a file")
    );
    let missing = Image::read_exr("/none/such.exr").unwrap_err().to_string();
    assert!(
        missing.contains("/none/such.exr: No such file"),
        "{missing}"
    );
}

/// More channels and layers than anybody has time to compare with each other.
#[test]
fn many_channels() {
    const CHANNELS: usize = 100_000;
    for layers in [1, CHANNELS] {
        let names = (0..CHANNELS).map(|i| format!("l{:06}.c{:06}", i % layers, i / layers));
        let channel = |name: String| AnyChannel::new(name.as_str(), FlatSamples::F32(vec![1.0]));
        let channels = AnyChannels::sort(names.map(channel).collect());
        let image = exr::prelude::Image::from_channels(Vec2(1, 1), channels);
        let mut bytes = Vec::new();
        image
            .write()
            .non_parallel()
            .to_buffered(Cursor::new(&mut bytes))
            .unwrap();
        let read = Image::parse_exr(&bytes, "many.exr", Limits::default()).unwrap();
        assert_eq!(read.layers.len(), layers);
    }
}
