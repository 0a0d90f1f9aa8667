//! What system and processor a library was built for, from its first bytes: the system's own message names neither.

use std::io::Read;
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
    let read = std::fs::File::open(path).and_then(|f| f.take(HEAD).read_to_end(&mut head));
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
        return Ok(());
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
