//! Reading damaged files, and what that may cost.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::memory;
use resolvent_vdb::{File, Halves, Serial, Tree};

/// What became of one input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was read without complaint.
    Read,
    /// Something was refused.
    Refused,
}

/// Most bytes that reading a file of `size` bytes into memory may hold at once, the file itself
/// (which is in memory here) not counted.
///
/// A leaf takes at least 129 bytes of file (64 in the topology, 65 in the buffers) and at most
/// 512 × 24 bytes of memory; a node takes at least 8 kB and unpacks to at most 32,768 × 24 bytes,
/// twice while it is decoded. The constant covers tables of fixed size, foremost the inflater's.
pub fn allowance(size: usize) -> usize {
    256 * size + (192 << 10)
}

/// Reads everything in `bytes` in every way there is and checks what it may cost.
///
/// # Errors
/// A description of what went wrong: a panic, or too much memory.
pub fn read_everything(bytes: &[u8]) -> Result<Outcome, String> {
    let size = bytes.len();
    let bytes = bytes.to_vec();
    memory::start();
    let outcome = catch_unwind(AssertUnwindSafe(|| everything(bytes)));
    let peak = memory::peak();
    let outcome = outcome.map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        format!("panic: {}", text.unwrap_or_default())
    })?;
    if peak > allowance(size) {
        return Err(format!("{peak} bytes held for a file of {size}"));
    }
    Ok(outcome)
}

fn everything(bytes: Vec<u8>) -> Outcome {
    let file = match File::from_bytes("mutant.vdb", bytes) {
        Ok(file) => file,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return Outcome::Refused;
        }
    };
    let mut refused = file.damage().is_some();
    for entry in file.metadata().iter() {
        assert!(entry.value.to_string().len() <= 16 + 64 * file.size() as usize);
    }
    refused |= file.grid("no such grid").is_err() && file.grids().is_empty();
    // Many instances of one tree: reading each would be the caller's decision, not the file's.
    for grid in file.grids().iter().take(16) {
        refused |= read_grid(&file, grid).is_err();
    }
    if refused {
        Outcome::Refused
    } else {
        Outcome::Read
    }
}

fn read_grid(file: &File, grid: &resolvent_vdb::GridInfo) -> resolvent_vdb::Result<()> {
    let tree = Tree::read(file, grid, &Serial)?;
    let topology = tree.topology();
    let _ = topology.active_voxels();
    if let Some([low, high]) = topology.active_bbox() {
        assert!((0..3).all(|i| low[i] <= high[i]));
        tree.probe(low);
        tree.probe(high);
        tree.sample(high.map(f64::from));
    }
    for leaf in topology.leaves().iter().take(64) {
        assert!(leaf.origin.iter().all(|c| c & 7 == 0));
        tree.probe(leaf.origin.map(|c| c.wrapping_sub(1)));
    }
    for tile in topology.tiles().take(64) {
        assert!(tile.origin.iter().all(|c| c & (tile.dim as i32 - 1) == 0));
        let (value, active) = tree.probe(tile.origin);
        assert!(
            active == tile.active && (value == tile.value || format!("{value}").contains("NaN"))
        );
    }
    tree.sample([f64::NAN, 1e300, -1e300]);
    file.statistics(grid, &Serial)?;
    file.read_leaves(grid, topology, Halves::Keep, &Serial, |_, _| {})?;
    Ok(())
}
