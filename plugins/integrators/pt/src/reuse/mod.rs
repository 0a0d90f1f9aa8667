//! Paths of neighbouring pixels that share what they find (Bekaert, Sbert & Halton 2002, "Accelerating Path Tracing by Re-Using
//! Paths").
//!
//! A block of pixels takes one sample of each at a time. Every path has a first vertex y_k, seen from the camera, and a second, x_k,
//! on a surface or in a medium. The light that reaches x_i is what any y_k would find there: so all y_k are connected to all x_i.
//! A path (y_k, x_i, …) may thus have come about by scattering at any first vertex; the balance heuristic over all of these, and at x_i
//! over scattering and connecting as ever, divides its contribution by
//!
//!   Σ over k of p_k(x_i) ρ_k q(x_i; wo_k, wi)
//!
//! with p_k the density of the direction from y_k to x_i times the geometry term, and q that of the direction `wi` at x_i, seen from y_k.
//! ρ_k is what the media leave of light between the two, 0 behind a surface. It is estimated once for every pair, by null collisions:
//! for k = i they are those of the flight that found x_i, for the others those of a connection. Together with x_i, the null
//! collisions of all these edges are the point of a space in which every y_k could have made the flight and all others the connections;
//! the densities of both are known (Miller et al. 2019), and what divides one by the other is ρ_k = track/ratio. Edges that a path does not
//! have integrate to 1. So the weights are exact, and at most 1.
//!
//! Given the first vertices, each x_i is an independent sample: no pixel is biased. But the errors of a block's pixels are
//! alike, which those of other pixels are not.
//!
//! Only what a smooth density chose can be shared: a path that a delta lobe turns at y or at x goes on alone. So does light that is
//! found by fewer than two scatterings. Media must be grey, since the hero lane of one path is not that of another; and no branches towards
//! the sun leave from y and x, whose weights would tie the two ends of a path together.

mod path;
mod share;

use crate::kernel::Kernel;
use resolvent_api::abi::{PixelSample, Tile};
use resolvent_api::integrator::Outcome;
use resolvent_api::rng::derive;
use resolvent_api::vertex::LightSample;
use resolvent_api::{Output, Spectrum, Vec3, Vertex};
use resolvent_pathspace::sampler::Sampler;
use share::Way;

/// What reaches a second vertex from the direction that scattering chose.
#[derive(Clone, Copy)]
struct Arrival {
    wi: Vec3,
    /// Radiance of a light, and the density of `wi` by connecting to it.
    emitted: Spectrum,
    connecting: f32,
    /// Radiance of what is no light itself.
    scattered: Spectrum,
}

/// The path of one pixel.
struct Member {
    pixel: [u32; 2],
    sample: PixelSample,
    sampler: Sampler,
    /// What the camera makes of light scattered at the first vertex: the ray's weight, in a medium times its albedo.
    weight: Spectrum,
    first: Vertex,
    second: Vertex,
    /// The first vertex can be connected to second ones.
    connects: bool,
    /// Density of the edge between the two by flight over that by connection.
    clear: f32,
    /// Albedo of the medium at the second vertex, or 1.
    albedo: Spectrum,
    /// For the roulette of its connection to a light.
    chance: f32,
    /// The second can be connected to first ones.
    shares: bool,
    /// A point on a light chosen for the second vertex; whether anything is in between is not known yet.
    light: Option<LightSample>,
    arrival: Option<Arrival>,
}

impl Member {
    fn new() -> Self {
        Self {
            pixel: [0; 2],
            sample: PixelSample::default(),
            sampler: Sampler::new(0, 0, 0, 1),
            weight: Spectrum::ZERO,
            clear: 1.0,
            albedo: Spectrum::ONE,
            chance: 0.0,
            first: Vertex::empty(),
            second: Vertex::empty(),
            connects: false,
            shares: false,
            light: None,
            arrival: None,
        }
    }
}

/// A block of pixels and what it needs; kept for the next one.
struct Block {
    members: Vec<Member>,
    ways: Vec<Way>,
    /// The next vertices of a walk.
    scratch: [Vertex; 2],
}

/// Renders a tile in blocks of up to `edge` × `edge` pixels.
pub fn render(kernel: &Kernel<'_>, edge: u32, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
    let mut block = Block {
        members: Vec::with_capacity((edge * edge) as usize),
        ways: Vec::with_capacity((edge * edge) as usize),
        scratch: [Vertex::empty(); 2],
    };
    let size = [0, 1].map(|k| tile.max[k] - tile.min[k]);
    let across = size.map(|n| n.div_ceil(edge));
    for sample in tile.sample_begin..tile.sample_end {
        // Blocks lie elsewhere for every sample, and go round at the tile's edges: none of their own shows.
        let place = derive(tile.seed ^ 0x626c_6f63_6b73, u64::from(sample));
        let shift = [place as u32, (place >> 32) as u32];
        let corner = u64::from(tile.min[1]) << 32 | u64::from(tile.min[0]);
        let together = Sampler::new(
            tile.seed ^ 0x7469_6c65,
            corner,
            sample,
            kernel.scene.lanes(),
        );
        let flight = together.flight(0, Spectrum::ONE);
        for b in 0..across[0] * across[1] {
            let at = [b % across[0], b / across[0]];
            let span = |k: usize| {
                let cut = |i: u32| i * size[k] / across[k];
                let shifted = move |i| tile.min[k] + (i + shift[k] % size[k]) % size[k];
                (cut(at[k])..cut(at[k] + 1)).map(shifted)
            };
            let mut count = 0;
            for y in span(1) {
                for x in span(0) {
                    if count == block.members.len() {
                        block.members.push(Member::new());
                    }
                    let m = &mut block.members[count];
                    kernel.set_out(tile, [x, y], sample, &flight, m, &mut block.scratch)?;
                    count += 1;
                }
            }
            let members = &mut block.members[..count];
            kernel.share(members, &mut block.ways)?;
            for m in members {
                out.add(m.pixel[0], m.pixel[1], &m.sample)?;
            }
        }
    }
    Ok(())
}
