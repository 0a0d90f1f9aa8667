//! What system and processor a library was built for, from its first bytes, and whether all of it is there: the system's own message
//! names neither, and a file that was cut off ends the program.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes that are looked at: up to `e_machine` of an ELF header.
const HEAD: u64 = 20;

/// Processors by their number in ELF headers (`e_machine`), and 32 or 64 bits.
const PROCESSORS: [(u16, u8, &str); 6] = [
    (3, 1, "x86 (32 bits)"),
    (40, 1, "ARM (32 bits)"),
    (62, 2, "x86-64"),
    (62, 1, "x86-64 with 32-bit addresses"),
    (183, 2, "AArch64"),
    (243, 2, "RISC-V (64 bits)"),
];

/// Number and width of the processor this program runs on.
const OWN: (u16, u8) = if cfg!(target_arch = "x86_64") {
    (62, 2)
} else if cfg!(target_arch = "aarch64") {
    (183, 2)
} else if cfg!(target_arch = "riscv64") {
    (243, 2)
} else {
    (0, 0)
};

/// Says for what a library was built if that is something else than this program. What cannot be read or told is left to the
/// loader.
pub(super) fn check(path: &Path) -> Result<(), String> {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|f| f.take(HEAD).read_to_end(&mut head));
    if read.is_err() {
        return Ok(());
    }
    let starts = |bytes: &[u8]| head.starts_with(bytes);
    if starts(b"MZ") {
        return Err("it was built for Windows".into());
    }
    if [[0xcf, 0xfa, 0xed, 0xfe], [0xca, 0xfe, 0xba, 0xbe]]
        .iter()
        .any(|m| starts(m))
    {
        return Err("it was built for macOS".into());
    }
    let whole = head.len() as u64 == HEAD;
    if !starts(b"\x7fELF") || !whole || OWN.0 == 0 {
        return Ok(());
    }
    let bytes = [head[18], head[19]];
    let machine = match head[5] {
        2 => u16::from_be_bytes(bytes),
        _ => u16::from_le_bytes(bytes),
    };
    let built_for = (machine, head[4]);
    if built_for == OWN {
        return match File::open(path).ok().and_then(missing) {
            Some(bytes) => Err(format!("{bytes} bytes at its end are missing")),
            None => Ok(()),
        };
    }
    let name = |(machine, width): (u16, u8)| {
        PROCESSORS
            .iter()
            .find(|(m, w, _)| (*m, *w) == (machine, width))
            .map_or_else(
                || format!("processor {machine}"),
                |(.., name)| (*name).into(),
            )
    };
    Err(format!(
        "it was built for {}, and this is {}",
        name(built_for),
        name(OWN)
    ))
}

/// How many bytes of the parts of a 64-bit ELF file that are loaded lie beyond its end, if any do.
fn missing(mut file: File) -> Option<u64> {
    const LOADED: u32 = 1; // PT_LOAD
    const ENTRY: usize = 56; // sizeof(Elf64_Phdr)
    let size = file.metadata().ok()?.len();
    let mut head = [0; 64];
    if file.read_exact(&mut head).is_err() {
        return Some(64 - size.min(64)).filter(|n| *n > 0);
    }
    let word = |at: &[u8]| at.try_into().map(u64::from_ne_bytes);
    let half = |at: &[u8]| at.try_into().map(u16::from_ne_bytes);
    let (table, entry, count) = (
        word(&head[32..40]).ok()?,
        half(&head[54..56]).ok()?,
        half(&head[56..58]).ok()?,
    );
    // Another layout is the loader's business.
    if usize::from(entry) != ENTRY {
        return None;
    }
    file.seek(SeekFrom::Start(table)).ok()?;
    let mut parts = Vec::new();
    let length = ENTRY * usize::from(count);
    file.take(length as u64).read_to_end(&mut parts).ok()?;
    let ends = parts.chunks_exact(ENTRY).filter_map(|p| {
        let loaded = p[..4] == LOADED.to_ne_bytes();
        let end = word(&p[8..16]).ok()?.checked_add(word(&p[32..40]).ok()?)?;
        loaded.then_some(end)
    });
    let end = ends.chain([table.checked_add(length as u64)?]).max()?;
    end.checked_sub(size).filter(|n| *n > 0)
}
