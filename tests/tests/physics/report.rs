//! What tests say about themselves for `docs/accuracy.md`: with `RESOLVENT_REPORT=DIR` in the environment, lines are added to files
//! there, which `tests/accuracy.sh` makes a page of.

use std::io::Write;

/// Adds a line to a file of the report, if one is asked for.
pub fn line(file: &str, text: &str) {
    let Some(folder) = std::env::var_os("RESOLVENT_REPORT") else {
        return;
    };
    let path = std::path::Path::new(&folder).join(file);
    // One write a line: tests run side by side.
    let added = std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(&path)
        .and_then(|mut f| f.write_all(format!("{text}\n").as_bytes()));
    if let Err(e) = added {
        panic!("{}: {e}", path.display());
    }
}
