//! One piece of work: an integrator's call, and where its samples go.

use crate::film::{Buffer, UNFIT};
use crate::plugin::ForeignIntegrator;
use crate::scene::{Counters, Scene, Until, View};
use resolvent_api::Spectrum;
use resolvent_api::abi::{OutputTable, PixelSample, Status, Tile};
use std::ffi::c_void;

/// A piece of work that is complete.
pub struct Finished {
    pub buffer: Buffer,
    pub counters: Counters,
}

/// Renders a piece of work; `None` if it was stopped before it was done.
///
/// # Errors
/// If a plugin breaks, or the integrator does not give what it was asked for.
pub fn render(
    scene: &Scene,
    integrator: &ForeignIntegrator,
    tile: &Tile,
    orders: usize,
    until: Until<'_>,
) -> Result<Option<Finished>, String> {
    let view = View::new(scene, until);
    let samples = tile.sample_begin..tile.sample_end;
    let wanted = samples.len();
    let mut sink = Sink {
        buffer: Buffer::new(tile.min, tile.max, samples, tile.features != 0).with_orders(orders),
        exposure: scene.camera.exposure(),
        error: None,
    };
    let out = OutputTable {
        size: size_of::<OutputTable>() as u32,
        orders: orders as u32,
        ctx: (&raw mut sink).cast(),
        add,
        splat,
        add_orders,
        splat_order,
    };
    let result = integrator.render(&view.table(), tile, &out);
    if view.is_stopped() {
        return Ok(None);
    }
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
    Ok(Some(Finished {
        buffer: sink.buffer,
        counters: view.counters(),
    }))
}

struct Sink {
    buffer: Buffer,
    /// Factor on all light. Integrators do not see it: none of their decisions depends on it.
    exposure: f32,
    error: Option<String>,
}

/// What an integrator did that cannot tell scattering orders apart.
const UNORDERED: &str =
    "does not tell light by scattering order: render without the layers \"orders\"";

impl Sink {
    fn fail(&mut self, why: String) -> Status {
        self.error.get_or_insert(why);
        Status::ERROR
    }

    fn expose(&self, sample: &PixelSample) -> PixelSample {
        PixelSample {
            radiance: sample.radiance * self.exposure,
            ..*sample
        }
    }

    fn splat(&mut self, film: [f32; 2], radiance: Spectrum, order: u32) -> Status {
        if !self
            .buffer
            .splats
            .add_order(film, radiance * self.exposure, order)
        {
            let ([x, y], [r, g, b, _]) = (film, radiance.0);
            return self.fail(format!(
                "added the radiance {r:e} {g:e} {b:e} at ({x}, {y}) of the film, {UNFIT}"
            ));
        }
        Status::OK
    }
}

unsafe extern "C" fn add(ctx: *mut c_void, x: u32, y: u32, sample: *const PixelSample) -> Status {
    // SAFETY: ctx is the `Sink` of this table, used by one integrator call on one thread.
    let (sink, sample) = unsafe { (&mut *ctx.cast::<Sink>(), &*sample) };
    if sink.buffer.orders() > 0 {
        return sink.fail(UNORDERED.into());
    }
    let exposed = sink.expose(sample);
    match sink.buffer.add(x, y, &exposed) {
        Ok(()) => Status::OK,
        Err(why) => sink.fail(why),
    }
}

unsafe extern "C" fn add_orders(
    ctx: *mut c_void,
    x: u32,
    y: u32,
    sample: *const PixelSample,
    layers: *const Spectrum,
) -> Status {
    // SAFETY: as above.
    let (sink, sample) = unsafe { (&mut *ctx.cast::<Sink>(), &*sample) };
    let count = sink.buffer.orders();
    if count == 0 {
        return sink.fail("gave layers by scattering order that nobody asked for".into());
    }
    // SAFETY: there are as many layers as the table asks for.
    let layers = unsafe { std::slice::from_raw_parts(layers, count) };
    let (exposed, exposure) = (sink.expose(sample), sink.exposure);
    match sink.buffer.add_orders(x, y, &exposed, layers, exposure) {
        Ok(()) => Status::OK,
        Err(why) => sink.fail(why),
    }
}

unsafe extern "C" fn splat(
    ctx: *mut c_void,
    film: *const [f32; 2],
    radiance: *const Spectrum,
) -> Status {
    // SAFETY: as above.
    let (sink, film, radiance) = unsafe { (&mut *ctx.cast::<Sink>(), *film, *radiance) };
    if sink.buffer.orders() > 0 {
        return sink.fail(UNORDERED.into());
    }
    sink.splat(film, radiance, 0)
}

unsafe extern "C" fn splat_order(
    ctx: *mut c_void,
    film: *const [f32; 2],
    radiance: *const Spectrum,
    order: u32,
) -> Status {
    // SAFETY: as above.
    let (sink, film, radiance) = unsafe { (&mut *ctx.cast::<Sink>(), *film, *radiance) };
    sink.splat(film, radiance, order)
}
