//! Round trips, and writing that is all or nothing.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use resolvent_image::{BEAUTY, Error, ExrInfo, Image, ToneMap, write_atomically};

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Folder {
        let path =
            std::env::temp_dir().join(format!("resolvent-image-{test}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn plane(image: &Image, seed: u32) -> Vec<f32> {
    (0..image.pixels() as u32)
        .map(|i| (i.wrapping_mul(2_654_435_761).wrapping_add(seed) % 10_007) as f32 * 1e-3)
        .collect()
}

fn full() -> Image {
    let mut image = Image::new(50, 33);
    (image.origin, image.full) = ([7, 9], [64, 48]);
    let p = |seed| plane(&image, seed);
    let layers = [
        (
            BEAUTY,
            vec![("R", p(1)), ("G", p(2)), ("B", p(3)), ("A", p(4))],
        ),
        ("albedo", vec![("R", p(5)), ("G", p(6)), ("B", p(7))]),
        ("depth", vec![("Z", p(8))]),
        ("normal", vec![("X", p(9)), ("Y", p(10)), ("Z", p(11))]),
        ("samples", vec![("N", p(12))]),
        ("variance", vec![("R", p(13)), ("G", p(14)), ("B", p(15))]),
    ];
    for (name, channels) in layers {
        image.push(name, channels);
    }
    let texts = [
        ("scene", "scènes/☁.json"),
        ("seed", "18446744073709551615"),
        ("version", "0.1.0"),
        ("empty", ""),
        ("type", "x"),
    ];
    image
        .metadata
        .extend(texts.map(|(k, v)| (k.to_string(), v.to_string())));
    image
}

#[test]
fn exr_keeps_every_bit() {
    let folder = Folder::new("exr");
    let path = folder.0.join("full.exr");
    let mut image = full();
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -0.0,
        f32::MIN_POSITIVE,
        1e-45,
        f32::MAX,
        -1.5,
    ];
    image.layers[0].channels[1].data[..odd.len()].copy_from_slice(&odd);
    image.write_exr(&path).unwrap();
    let again = Image::read_exr(&path).unwrap();
    assert_eq!(
        (again.origin, again.full, &again.metadata),
        (image.origin, image.full, &image.metadata)
    );
    for layer in &image.layers {
        for channel in &layer.channels {
            let read = again.channel(&layer.name, &channel.name).unwrap();
            assert!(
                read.iter()
                    .zip(&channel.data)
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            );
        }
    }
    assert_eq!(again.layers.len(), image.layers.len());
    assert_eq!(folder.names(), ["full.exr"]);
}

#[test]
fn the_header_alone_tells() {
    let folder = Folder::new("info");
    let path = folder.0.join("full.exr");
    full().write_exr(&path).unwrap();
    let info = ExrInfo::read(&path).unwrap();
    assert_eq!(
        (info.width, info.height, info.origin, info.full),
        (50, 33, [7, 9], [64, 48])
    );
    assert_eq!(info.channels.len(), 15);
    assert!(
        info.channels
            .iter()
            .any(|c| (c.layer.as_str(), c.name.as_str(), c.kind) == ("depth", "Z", "float"))
    );
    assert_eq!(info.metadata["scene"], "scènes/☁.json");
    assert!(
        info.compression.to_lowercase().contains("zip"),
        "{}",
        info.compression
    );
}

#[test]
fn png_is_the_tone_mapped_picture() {
    let folder = Folder::new("png");
    let path = folder.0.join("x.png");
    let image = full();
    let tone = ToneMap {
        exposure: 0.5,
        ..ToneMap::default()
    };
    image.write_png(&path, &tone).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(
        (info.width, info.height, info.color_type),
        (50, 33, png::ColorType::Rgb)
    );
    let rgb = image.color().unwrap();
    let expected: Vec<u8> = (0..image.pixels())
        .flat_map(|i| [0, 1, 2].map(|c| tone.apply(rgb[c][i])))
        .collect();
    assert_eq!(pixels, expected);
    assert!(reader.info().srgb.is_some());
    let texts = &reader.info().utf8_text;
    assert!(
        texts
            .iter()
            .any(|t| t.keyword == "scene" && t.get_text().unwrap() == "scènes/☁.json")
    );
    assert_eq!(folder.names(), ["x.png"]);
}

#[test]
fn images_that_are_none_are_not_written() {
    let folder = Folder::new("refused");
    let path = folder.0.join("x.exr");
    type Edit = fn(&mut Image);
    let edits: [(Edit, &str); 7] = [
        (
            |i| i.layers[2].channels[0].data.truncate(5),
            "channel (\"depth\", \"Z\") has 5 values for 1650 pixels",
        ),
        (|i| i.layers.clear(), "the image has no channels"),
        (
            |i| i.layers[1].channels[0].name = "G".into(),
            "two channels are named (\"albedo\", \"G\")",
        ),
        (
            |i| i.layers[1].channels[0].name.clear(),
            "\"\" cannot be the name of a channel",
        ),
        (
            |i| (i.width, i.layers) = (0, Vec::new()),
            "an image of 0 × 33 pixels cannot be written",
        ),
        (
            |i| i.layers[1].name = "x".repeat(300),
            "cannot be a name in an EXR file",
        ),
        (
            |i| drop(i.metadata.insert("a\0b".into(), String::new())),
            "cannot be a name in an EXR file",
        ),
    ];
    for (edit, message) in edits {
        let mut image = full();
        edit(&mut image);
        let error = image.write_exr(&path).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
        assert!(folder.names().is_empty());
    }
    let mut grey = Image::new(2, 2);
    grey.push("depth", [("Z", vec![1.0; 4])]);
    assert!(
        grey.write_png(&path, &ToneMap::default())
            .unwrap_err()
            .to_string()
            .contains("R, G and B")
    );
}

#[test]
fn a_failed_write_leaves_the_old_file() {
    let folder = Folder::new("failed");
    let path = folder.0.join("old.txt");
    fs::write(&path, "old").unwrap();
    let failed = write_atomically(&path, |file| {
        file.write_all(&vec![b'x'; 1 << 20]).unwrap();
        Err(Error::Invalid {
            file: path.clone(),
            what: "changed my mind".into(),
        })
    });
    assert!(failed.unwrap_err().to_string().contains("changed my mind"));
    assert_eq!(
        (fs::read_to_string(&path).unwrap().as_str(), folder.names()),
        ("old", vec!["old.txt".to_string()])
    );
    let panicked =
        std::panic::catch_unwind(|| write_atomically(&path, |_| panic!("in the writer")));
    assert!(panicked.is_err());
    assert_eq!(folder.names(), ["old.txt"]);
    write_atomically(&path, |file| {
        file.write_all(b"new").unwrap();
        Ok(())
    })
    .unwrap();
    assert_eq!(
        (fs::read_to_string(&path).unwrap().as_str(), folder.names()),
        ("new", vec!["old.txt".to_string()])
    );
}

#[test]
fn places_that_cannot_be_written() {
    let folder = Folder::new("places");
    let write = |path: &Path| full().write_exr(path).unwrap_err().to_string();
    let missing = write(&folder.0.join("none/x.exr"));
    assert!(
        missing.contains("none/x.exr: the folder") && missing.contains("does not exist"),
        "{missing}"
    );
    assert!(write(&folder.0).contains("is a folder, not a file"));
    assert!(write(Path::new("/dev/null")).contains("is a device or a pipe, not a file"));
    assert!(write(Path::new("..")).contains("is a folder"));
    assert!(write(Path::new("")).contains("is not the name of a file"));
    fs::write(folder.0.join("file"), "").unwrap();
    assert!(write(&folder.0.join("file/x.exr")).contains("file/x.exr: "));
    assert_eq!(folder.names(), ["file"]);
}

#[cfg(unix)]
#[test]
fn links_are_followed() {
    let folder = Folder::new("links");
    let (real, link) = (folder.0.join("real.exr"), folder.0.join("link.exr"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    full().write_exr(&link).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(Image::read_exr(&real).unwrap(), full());
}

/// Not a test: what [`a_crash_leaves_the_old_file`] runs in another process.
#[test]
#[ignore = "crashes"]
fn crash_while_writing() {
    let Some(path) = std::env::var_os("RESOLVENT_CRASH") else {
        return;
    };
    let _ = write_atomically(PathBuf::from(path), |file| {
        file.write_all(&vec![b'x'; 1 << 20]).unwrap();
        file.flush().unwrap();
        std::process::abort()
    });
}

#[test]
fn a_crash_leaves_the_old_file() {
    let folder = Folder::new("crash");
    let path = folder.0.join("picture.exr");
    fs::write(&path, "old").unwrap();
    let crash = || {
        let mut child = Command::new(std::env::current_exe().unwrap());
        child
            .args(["--exact", "crash_while_writing", "--ignored"])
            .env("RESOLVENT_CRASH", &path);
        let output = child.output().unwrap();
        assert!(!output.status.success());
    };
    crash();
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    let left: Vec<_> = folder
        .names()
        .into_iter()
        .filter(|n| n != "picture.exr")
        .collect();
    assert!(
        left.len() == 1 && left[0].starts_with(".picture.exr.") && left[0].ends_with(".tmp"),
        "{left:?}"
    );
    // What was left over does not stand in the way.
    full().write_exr(&path).unwrap();
    assert_eq!(Image::read_exr(&path).unwrap(), full());
}
