//! One piece of work: an integrator's call, and where its samples go.

use crate::film::Buffer;
use crate::plugin::ForeignIntegrator;
use crate::scene::{Counters, Scene, View};
use resolvent_api::Spectrum;
use resolvent_api::abi::{OutputTable, PixelSample, Status, Tile};
use std::ffi::c_void;

/// A piece of work that is complete.
pub struct Finished {
    pub buffer: Buffer,
    pub counters: Counters,
}

/// Renders a piece of work.
///
/// # Errors
/// If a plugin breaks, or the integrator does not give what it was asked for.
pub fn render(
    scene: &Scene,
    integrator: &ForeignIntegrator,
    tile: &Tile,
) -> Result<Finished, String> {
    let view = View::new(scene);
    let samples = tile.sample_begin..tile.sample_end;
    let wanted = samples.len();
    let mut sink = Sink {
        buffer: Buffer::new(tile.min, tile.max, samples, tile.features != 0),
        error: None,
    };
    let out = OutputTable {
        size: size_of::<OutputTable>() as u32,
        reserved: 0,
        ctx: (&raw mut sink).cast(),
        add,
        splat,
    };
    let result = integrator.render(&view.table(), tile, &out);
    if let Some(why) = view.take_error().or_else(|| {
        sink.error
            .take()
            .map(|e| format!("{} {e}", integrator.title()))
    }) {
        return Err(why);
    }
    if let Err(f) = result {
        return Err(format!("{}: {}", integrator.title(), f.0));
    }
    if let Some(([x, y], n)) = sink.buffer.uneven() {
        let title = integrator.title();
        return Err(format!(
            "{title} added {n} samples to pixel ({x}, {y}) instead of {wanted}"
        ));
    }
    let mut counters = view.counters();
    counters.rejected = sink.buffer.rejected;
    Ok(Finished {
        buffer: sink.buffer,
        counters,
    })
}

struct Sink {
    buffer: Buffer,
    error: Option<String>,
}

unsafe extern "C" fn add(ctx: *mut c_void, x: u32, y: u32, sample: *const PixelSample) -> Status {
    // SAFETY: ctx is the `Sink` of this table, used by one integrator call on one thread.
    let (sink, sample) = unsafe { (&mut *ctx.cast::<Sink>(), &*sample) };
    match sink.buffer.add(x, y, sample) {
        Ok(()) => Status::OK,
        Err(why) => {
            sink.error.get_or_insert(why);
            Status::ERROR
        }
    }
}

unsafe extern "C" fn splat(
    ctx: *mut c_void,
    film: *const [f32; 2],
    radiance: *const Spectrum,
) -> Status {
    // SAFETY: as above.
    let (sink, film, radiance) = unsafe { (&mut *ctx.cast::<Sink>(), *film, *radiance) };
    if !sink.buffer.splats.add(film, radiance) {
        sink.buffer.rejected += 1;
        let at = film.map(|v| v.max(0.0) as u32);
        sink.buffer.rejected_at.get_or_insert(at);
    }
    Status::OK
}
