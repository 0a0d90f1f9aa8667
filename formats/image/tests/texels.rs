//! Images for textures: exact values in every format and precision, and damaged files.

use std::io::Cursor;

use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat};
use resolvent_image::{Image, Limits, TexelData, Texels};

fn parse(bytes: &[u8]) -> Texels {
    Texels::parse(bytes, "x", Limits::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn error(bytes: &[u8]) -> String {
    Texels::parse(bytes, "folder/x.png", Limits::default())
        .expect_err("a damaged file")
        .to_string()
}

fn png(pixels: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(pixels, width, height, color)
        .unwrap();
    out
}

#[test]
fn png_values_are_exact_in_8_and_16_bits() {
    let bytes: Vec<u8> = (0..48).map(|i| (i * 5) as u8).collect();
    for (color, channels, wide) in [
        (ExtendedColorType::L8, 1, false),
        (ExtendedColorType::La8, 2, false),
        (ExtendedColorType::Rgb8, 3, false),
        (ExtendedColorType::Rgba8, 4, false),
        (ExtendedColorType::L16, 1, true),
        (ExtendedColorType::La16, 2, true),
        (ExtendedColorType::Rgb16, 3, true),
        (ExtendedColorType::Rgba16, 4, true),
    ] {
        let size = channels * if wide { 2 } else { 1 };
        let height = 48 / (4 * size);
        let pixels = &bytes[..4 * height * size];
        let t = parse(&png(pixels, 4, height as u32, color));
        assert_eq!((t.width, t.height, t.channels), (4, height, channels));
        let expected = if wide {
            let words = pixels.chunks(2).map(|p| u16::from_ne_bytes([p[0], p[1]]));
            TexelData::U16(words.collect())
        } else {
            TexelData::U8(pixels.to_vec())
        };
        assert_eq!(t.data, expected, "{color:?}");
        assert_eq!(t.data.bytes(), pixels.len());
    }
}

#[test]
fn jpeg_is_read_near_its_values() {
    // Constant blocks survive quantisation within rounding.
    let rgb: Vec<u8> = [200, 100, 50].repeat(16 * 16);
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100)
        .write_image(&rgb, 16, 16, ExtendedColorType::Rgb8)
        .unwrap();
    let t = parse(&bytes);
    assert_eq!((t.width, t.height, t.channels), (16, 16, 3));
    let TexelData::U8(values) = t.data else {
        panic!()
    };
    for (v, e) in values.iter().zip(&rgb) {
        assert!(v.abs_diff(*e) <= 2, "{v} {e}");
    }
}

#[test]
fn radiance_files_keep_their_range() {
    // Values that RGBE holds exactly: mantissas of 8 bits and one exponent.
    let pixels = [
        [1024.0, 512.0, 8.0],
        [0.0; 3],
        [0.5, 0.25, 0.125],
        [1e-3; 3],
    ];
    let mut bytes = Vec::new();
    let rgb: Vec<_> = pixels.iter().map(|p| image::Rgb(*p)).collect();
    image::codecs::hdr::HdrEncoder::new(&mut bytes)
        .encode(&rgb, 2, 2)
        .unwrap();
    let t = parse(&bytes);
    assert_eq!((t.width, t.height, t.channels), (2, 2, 3));
    assert!(t.data.is_float());
    let values: Vec<f32> = match &t.data {
        TexelData::F16(v) => v.iter().map(|x| x.to_f32()).collect(),
        TexelData::F32(v) => v.clone(),
        _ => panic!(),
    };
    assert_eq!(values[..9], pixels.concat()[..9]);
    assert!((values[9] / 1e-3 - 1.0).abs() < 0.01);
}

#[test]
fn exr_is_half_where_that_changes_nothing() {
    let write = |values: Vec<f32>, alpha: bool| {
        let mut image = Image::new(2, 1);
        let n = values.len();
        let plane = |k: usize| vec![values[k % n], values[(k + 1) % n]];
        image.push("", [("R", plane(0)), ("G", plane(1)), ("B", plane(2))]);
        if alpha {
            image.push("", [("A", vec![0.5, 0.25])]);
        }
        let path = std::env::temp_dir().join(format!(
            "resolvent-texels-{}-{n}-{alpha}.exr",
            std::process::id()
        ));
        image.write_exr(&path).unwrap();
        let (texels, size) = Texels::read(&path).unwrap();
        assert_eq!(size, std::fs::metadata(&path).unwrap().len());
        std::fs::remove_file(path).unwrap();
        texels
    };
    let t = write(vec![0.5, 60_000.0, -0.125, 2.0], true);
    assert_eq!(t.channels, 4);
    let expected = [0.5, 60_000.0, -0.125, 0.5, 60_000.0, -0.125, 2.0, 0.25];
    let TexelData::F16(values) = &t.data else {
        panic!("{t:?}")
    };
    assert!(values.iter().zip(expected).all(|(a, b)| a.to_f32() == b));
    assert_eq!(t.data.bytes(), 16);
    // 0.1 is no half; 2⁻³⁰ is none either.
    let t = write(vec![0.1, 2f32.powi(-30), 7.0], false);
    assert_eq!(t.channels, 3);
    assert!(matches!(&t.data, TexelData::F32(v) if v[0] == 0.1 && v[1] == 2f32.powi(-30)));
}

#[test]
fn what_is_no_image_is_named() {
    for bytes in [&b""[..], b"P", b"GIF89a", b"hello, world"] {
        let e = error(bytes);
        assert!(
            e.starts_with("folder/x.png: is no image that can be read"),
            "{e}"
        );
    }
    let e = Texels::read("/nonexistent/wood.png")
        .unwrap_err()
        .to_string();
    assert!(e.contains("/nonexistent/wood.png"), "{e}");
    let e = Texels::read(std::env::temp_dir()).unwrap_err().to_string();
    assert!(e.contains("is not a file"), "{e}");
}

/// Headers that promise more than the file can hold are refused before anything is allocated: 65535² RGBA would be 16 GiB.
#[test]
fn promises_are_compared_with_the_file() {
    let small = png(&[7; 16], 2, 2, ExtendedColorType::Rgba8);
    let mut large = small.clone();
    for at in [16, 20] {
        large[at..at + 4].copy_from_slice(&65_535u32.to_be_bytes());
    }
    let crc = crc32(&large[12..29]);
    large[29..33].copy_from_slice(&crc.to_be_bytes());
    let e = error(&large);
    assert!(e.contains("65535 × 65535 pixels, more than"), "{e}");
    let e = error(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n");
    assert!(e.contains("folder/x.png: "), "{e}");
    let limits = Limits { values: 15 };
    let e = Texels::parse(&small, "x.png", limits).unwrap_err();
    assert!(e.to_string().contains("has 16 values"), "{e}");
    let mut image = Image::new(1, 1);
    let values = |v: f32| [("R", vec![v]), ("G", vec![0.0]), ("B", vec![0.0])];
    image.push("", values(f32::NAN));
    let path = std::env::temp_dir().join(format!("resolvent-nan-{}.exr", std::process::id()));
    image.write_exr(&path).unwrap();
    let e = Texels::read(&path).unwrap_err().to_string();
    std::fs::remove_file(path).unwrap();
    assert!(e.contains("infinite or no number"), "{e}");
}

/// CRC-32 of PNG chunks (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, b| {
        (0..8).fold(crc ^ u32::from(*b), |c, _| {
            if c & 1 == 1 {
                c >> 1 ^ 0xedb8_8320
            } else {
                c >> 1
            }
        })
    })
}

/// Every truncation, and bytes changed at random: an image of a sane size or an error.
#[test]
fn mutants_do_not_panic() {
    let rgb: Vec<u8> = (0..32 * 32 * 3).map(|i| (i * 31 % 256) as u8).collect();
    let image = image::RgbImage::from_raw(32, 32, rgb).unwrap();
    let image = DynamicImage::ImageRgb8(image);
    let encode = |format: ImageFormat| {
        let mut out = Cursor::new(Vec::new());
        let image = match format {
            ImageFormat::Hdr => DynamicImage::ImageRgb32F(image.to_rgb32f()),
            _ => image.clone(),
        };
        image.write_to(&mut out, format).unwrap();
        out.into_inner()
    };
    let mut state = 1u64;
    let mut next = |n: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as usize % n
    };
    let mut read = 0;
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Hdr] {
        let good = encode(format);
        assert_eq!(parse(&good).width, 32);
        let mut check = |bytes: &[u8]| {
            if let Ok(t) = Texels::parse(bytes, "x", Limits { values: 1 << 22 }) {
                assert_eq!(t.data.len(), t.width * t.height * t.channels);
                read += 1;
            }
        };
        for end in (0..good.len()).step_by(1 + good.len() / 200) {
            check(&good[..end]);
        }
        for _ in 0..400 {
            let mut bytes = good.clone();
            for _ in 0..1 + next(4) {
                let head = if next(2) == 0 { 64 } else { usize::MAX };
                let at = next(bytes.len().min(head));
                bytes[at] = next(256) as u8;
            }
            check(&bytes);
        }
    }
    assert!(read > 50, "some mutants are still images: {read}");
}
