//! Reading the leaves of a grid: found one after another, decoded in parallel.
//!
//! A leaf's place is known only once the one before it has been measured, but measuring is cheap
//! (its length stands in front). So windows of the file are read and measured one ahead of the
//! decoding, and the leaves of a window are decoded in blocks by the caller's threads. Memory beside
//! what the caller keeps: two windows, and one leaf per thread.

use std::mem;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::encoding::{Encoding, Scratch};
use crate::error::{ErrorKind, Fault, Parsed};
use crate::leaf_record;
use crate::leaf_values::{Halves, LeafValues};
use crate::parallel::Parallel;
use crate::source::Source;
use crate::topology::{LeafNode, Topology};

/// Bytes of the file held at once (twice: one window is read while another is decoded).
const WINDOW: u64 = 4 << 20;
/// Leaves per task: 128 kB of floats, some 50 µs of work.
const BLOCK: usize = 64;

/// A part of the file and where leaves start in it.
#[derive(Default)]
struct Window {
    /// File offset of `bytes`.
    offset: u64,
    bytes: Vec<u8>,
    starts: Vec<u32>,
    /// File offset behind the last whole leaf.
    end: u64,
}

/// What to decode.
pub(crate) struct Job<'a> {
    pub source: &'a Source,
    pub encoding: &'a Encoding,
    pub topology: &'a Topology,
    pub limit: u64,
    pub halves: Halves,
}

impl Job<'_> {
    /// Decodes all leaves; each gets its own element of `places`, which has one per leaf.
    pub fn run<T: Send>(
        &self,
        parallel: &dyn Parallel,
        mut places: &mut [T],
        each: &(dyn Fn(usize, LeafValues<'_>, &mut T) + Sync),
    ) -> Parsed<()> {
        let leaves = &self.topology.leaves[..];
        let scratch = Mutex::new(Vec::<Scratch>::new());
        let failed = AtomicBool::new(false);
        let fault = Mutex::new(None::<(usize, Fault)>);
        let fail = |index: usize, new: Fault| {
            failed.store(true, Ordering::Relaxed);
            let mut fault = lock(&fault);
            // Of several, the first in the file.
            if fault.as_ref().is_none_or(|(old, _)| index < *old) {
                *fault = Some((index, new));
            }
        };

        let mut done = 0;
        let mut window = Window::default();
        let mut spare = Window::default();
        if !leaves.is_empty() {
            self.fetch(self.topology.buffers, leaves.len(), &mut window)?;
        }
        while done < leaves.len() {
            let count = window.starts.len();
            let (here, later) = mem::take(&mut places).split_at_mut(count);
            places = later;
            let blocks: Vec<_> = here
                .chunks_mut(BLOCK)
                .map(|part| Mutex::new(Some(part)))
                .collect();
            let left = leaves.len() - done - count;
            let next = Mutex::new(mem::take(&mut spare));
            let finished = AtomicUsize::new(0);
            parallel.run(blocks.len() + 1, &|task| {
                if failed.load(Ordering::Relaxed) {
                    return;
                }
                if task == 0 {
                    if left > 0
                        && let Err(new) = self.fetch(window.end, left, &mut lock(&next))
                    {
                        fail(done + count, new);
                    }
                    finished.fetch_add(1, Ordering::Relaxed);
                    return;
                }
                let Some(places) = lock(&blocks[task - 1]).take() else {
                    return;
                };
                let mut memory = lock(&scratch).pop().unwrap_or_default();
                let first = (task - 1) * BLOCK;
                for (i, place) in places.iter_mut().enumerate() {
                    let index = done + first + i;
                    let start = window.starts[first + i] as usize;
                    let at = (&window.bytes[start..], window.offset + start as u64);
                    if let Err(new) =
                        self.decode(index, &leaves[index], at, &mut memory, place, each)
                    {
                        fail(index, new);
                        break;
                    }
                }
                lock(&scratch).push(memory);
                finished.fetch_add(1, Ordering::Relaxed);
            });
            if let Some((_, fault)) = lock(&fault).take() {
                return Err(fault);
            }
            if finished.into_inner() < blocks.len() + 1 {
                let reason = "reading was given up: the caller's threads left tasks undone";
                return Err(Fault::new(ErrorKind::Cancelled, None, reason));
            }
            done += count;
            spare = mem::replace(
                &mut window,
                next.into_inner().unwrap_or_else(|e| e.into_inner()),
            );
        }
        Ok(())
    }

    fn decode<T>(
        &self,
        index: usize,
        leaf: &LeafNode,
        at: (&[u8], u64),
        scratch: &mut Scratch,
        place: &mut T,
        each: &(dyn Fn(usize, LeafValues<'_>, &mut T) + Sync),
    ) -> Parsed<()> {
        let background = &self.topology.background_bytes;
        leaf_record::decode(
            self.encoding,
            background,
            leaf,
            self.halves,
            at,
            scratch,
            |values| {
                each(index, values, place);
            },
        )
    }

    /// Reads a window from `offset` and finds up to `most` leaves in it, at least one.
    fn fetch(&self, offset: u64, most: usize, window: &mut Window) -> Parsed<()> {
        let left = self.limit.saturating_sub(offset);
        let size = left.min(WINDOW) as usize;
        window.offset = offset;
        window.starts.clear();
        window.bytes.resize(size, 0);
        self.source.read_exact_at(offset, &mut window.bytes)?;
        let mut start = 0;
        while window.starts.len() < most {
            let at = offset + start as u64;
            let Some(length) = leaf_record::length(self.encoding, &window.bytes[start..], at)?
            else {
                break;
            };
            window.starts.push(start as u32);
            start += length;
        }
        if window.starts.is_empty() {
            return Err(Fault::invalid(
                offset,
                format!(
                    "a leaf needs more than the {left} bytes left; the file is cut short or damaged"
                ),
            ));
        }
        window.end = offset + start as u64;
        Ok(())
    }
}

/// Checks that the leaves of a topology can be in the bytes left for them, before anyone makes room.
pub(crate) fn check_room(topology: &Topology, encoding: &Encoding, limit: u64) -> Parsed<()> {
    let left = limit.saturating_sub(topology.buffers);
    let needed = topology
        .leaf_count
        .saturating_mul(leaf_record::shortest(encoding));
    if needed > left {
        let reason = format!(
            "{} leaves need at least {needed} bytes where {left} are left; the file is cut short or damaged",
            topology.leaf_count
        );
        return Err(Fault::invalid(topology.buffers, reason));
    }
    Ok(())
}

/// File offset behind the last leaf; for streams, where no offset says so.
pub(crate) fn skip(
    source: &Source,
    encoding: &Encoding,
    topology: &Topology,
    limit: u64,
) -> Parsed<u64> {
    let halves = Halves::Keep;
    let job = Job {
        source,
        encoding,
        topology,
        limit,
        halves,
    };
    let mut window = Window {
        end: topology.buffers,
        ..Window::default()
    };
    let mut left = topology.leaf_count;
    while left > 0 {
        job.fetch(
            window.end,
            usize::try_from(left).unwrap_or(usize::MAX),
            &mut window,
        )?;
        left -= window.starts.len() as u64;
    }
    Ok(window.end)
}

/// A panic in the caller's closure may have poisoned a lock; nothing behind these locks can be left
/// half done.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}
