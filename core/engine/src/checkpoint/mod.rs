//! Checkpoints: what a render has done, in a file.
//!
//! A checkpoint holds the film's sums, bit for bit, and which samples they are of. So a render that goes on from one ends with the same
//! bits as one that was never interrupted, and disjoint parts of a picture's samples join to the picture. What belongs together is
//! told by an identity, a JSON value that says what is rendered and with what: see [`difference`].

mod difference;
pub mod sections;

pub use difference::{Difference, difference};

use crate::error::{Error, Result};
use crate::film::Film;
use crate::render::{Adaptive, Rendered};
use crate::scene::Counters;
pub use sections::MAGIC;
use sections::{Reader, Writer};
use serde_json::{Value, json};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// What a render has done so far.
pub struct State {
    /// The film.
    pub film: Film,
    /// Counts over all workers.
    pub counters: Counters,
    /// Seconds of rendering.
    pub seconds: f64,
    /// How far an adaptive render has come.
    pub adaptive: Option<Adaptive>,
}

/// A checkpoint that was read.
pub struct Checkpoint {
    /// What is rendered, and with what: must agree for all that is put together.
    pub identity: Value,
    /// Anything else worth telling.
    pub about: Value,
    /// What was done.
    pub state: State,
}

impl State {
    /// Nothing yet.
    pub(crate) fn new(film: Film) -> Self {
        Self {
            film,
            counters: Counters::default(),
            seconds: 0.0,
            adaptive: None,
        }
    }

    /// The file that [`Checkpoint::read`] reads.
    pub fn to_bytes(&self, identity: &Value, about: &Value) -> Vec<u8> {
        let rest = (self.counters, self.seconds);
        write(identity, about, &self.film, rest, self.adaptive.as_ref())
    }

    fn read(header: &Value, mut from: Reader) -> std::result::Result<Self, String> {
        let numbers = |name: &str| -> Option<Vec<u64>> {
            header[name].as_array()?.iter().map(Value::as_u64).collect()
        };
        let four = |name: &str| -> Option<[u32; 4]> {
            let all = numbers(name)?;
            let all: Vec<u32> = all.iter().filter_map(|n| u32::try_from(*n).ok()).collect();
            all.try_into().ok()
        };
        let window = four("window").filter(|[x0, y0, x1, y1]| {
            x0 < x1 && y0 < y1 && u64::from(x1 - x0) * u64::from(y1 - y0) < 1 << 40
        });
        let window = window.ok_or("is damaged: it has no window")?;
        let features = header["features"] == true;
        let mut film = Film::read("", window, features, &mut from)?;
        let mut adaptive = None;
        if header["halves"] == 2 {
            let twin = Film::read("twin/", window, features, &mut from)?;
            if twin.orders() != film.orders() {
                return Err("is damaged: its halves differ in their layers".into());
            }
            film.set_twin(twin);
            adaptive = Some(Adaptive::read(&film, &mut from)?);
        }
        from.finish()?;
        let counters = numbers("counters").and_then(|n| Counters::from_array(&n));
        Ok(Self {
            film,
            counters: counters.ok_or("is damaged: it has no counters")?,
            seconds: header["seconds"].as_f64().unwrap_or(0.0).max(0.0),
            adaptive,
        })
    }
}

fn write(
    identity: &Value,
    about: &Value,
    film: &Film,
    (counters, seconds): (Counters, f64),
    adaptive: Option<&Adaptive>,
) -> Vec<u8> {
    let header = json!({
        "identity": identity,
        "about": about,
        "window": film.window(),
        "features": film.has_features(),
        "halves": film.halves().count(),
        "counters": counters.to_array(),
        "seconds": seconds,
    });
    let mut out = Writer::new(header.to_string().as_bytes());
    for (half, name) in film.halves().zip(["", "twin/"]) {
        half.write(name, &mut out);
    }
    if let Some(adaptive) = adaptive {
        adaptive.write(&mut out);
    }
    out.finish()
}

impl Rendered {
    /// The checkpoint of what was rendered, see [`State::to_bytes`].
    pub fn to_bytes(&self, identity: &Value, about: &Value) -> Vec<u8> {
        let rest = (self.counters, self.seconds);
        write(identity, about, &self.film, rest, self.adaptive.as_ref())
    }
}

/// The bytes of a file; of what is no checkpoint only the first ones.
fn read_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(std::io::Error::other("is not a regular file"));
    }
    let mut bytes = Vec::new();
    file.by_ref()
        .take(MAGIC.len() as u64)
        .read_to_end(&mut bytes)?;
    if bytes == MAGIC {
        file.read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

impl Checkpoint {
    /// Reads a file. Whatever it holds, the answer is a checkpoint or an error.
    ///
    /// # Errors
    /// If it cannot be read, is none, is damaged, or is of another version.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = read_bytes(path)
            .map_err(|e| Error::Input(format!("{}: cannot read: {e}", path.display())))?;
        Self::from_bytes(&bytes).map_err(|why| Error::Input(format!("{}: {why}", path.display())))
    }

    /// Reads what [`State::to_bytes`] made.
    ///
    /// # Errors
    /// What is wrong, in words that follow the name of the file.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, String> {
        let (header, sections) = Reader::new(bytes)?;
        let header: Value = serde_json::from_slice(header)
            .map_err(|e| format!("is damaged: its header is no JSON: {e}"))?;
        Ok(Self {
            identity: header["identity"].clone(),
            about: header["about"].clone(),
            state: State::read(&header, sections)?,
        })
    }

    /// Adds another checkpoint's samples.
    ///
    /// # Errors
    /// If they are not of one picture, or some are in both.
    pub fn join(&mut self, other: &Self) -> std::result::Result<(), String> {
        if let Some(d) = difference(&self.identity, &other.identity) {
            return Err(format!(
                "{} differs: {} in the first, {} in the second",
                d.place, d.first, d.second
            ));
        }
        self.state.film.join(&other.state.film)?;
        self.state.counters.add(&other.state.counters);
        self.state.seconds += other.state.seconds;
        Ok(())
    }
}

/// Tells files with different content apart, by their length and their CRC-32.
///
/// # Errors
/// If it cannot be read.
pub fn fingerprint(path: &Path) -> Result<String> {
    use std::io::Read;
    let failed = |e| Error::Input(format!("{}: cannot read: {e}", path.display()));
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let (mut hasher, mut bytes) = (crc32fast::Hasher::new(), 0u64);
    let mut buffer = vec![0; 1 << 20];
    loop {
        match file.read(&mut buffer).map_err(failed)? {
            0 => break,
            n => {
                hasher.update(&buffer[..n]);
                bytes += n as u64;
            }
        }
    }
    Ok(format!("{bytes} bytes, CRC-32 {:08x}", hasher.finalize()))
}

#[cfg(test)]
mod tests;
