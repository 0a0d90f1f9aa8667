//! What a picture tells of its first vertices beside their light: coverage, depth, albedo, normal.

use resolvent_api::abi::PixelSample;
use resolvent_api::operator::{Mode, Scatter};
use resolvent_api::vertex::Edge;
use resolvent_api::{ScatterDraws, Vec3, Vertex, VertexKind};

/// Fills a sample's coverage and, if wanted, its features, from the vertex that the camera's ray met and the edge to it.
#[inline(always)]
pub fn fill(out: &mut PixelSample, met: Option<&Vertex>, edge: &Edge, lanes: u32, wanted: bool) {
    match met {
        Some(v) if !v.is(VertexKind::Emitter) => {
            out.alpha = 1.0;
            if wanted {
                describe(out, v, edge.length);
            }
        }
        _ if edge.media != 0 => {
            // What absorbs only covers by what it takes away.
            let clear = edge.value.mean(lanes) / edge.track.mean(lanes);
            out.alpha = (1.0 - clear).max(0.0);
        }
        _ => {}
    }
}

fn describe(out: &mut PixelSample, v: &Vertex, length: f32) {
    out.depth = length;
    if v.is(VertexKind::Medium) {
        let albedo = v
            .sigma_s
            .zip(v.sigma_t, |s, t| if t > 0.0 { s / t } else { 0.0 });
        out.albedo = albedo.to_rgb();
        return;
    }
    out.normal = v.frame.n;
    // Directional albedo for light from the normal's side, with one sample per path: f·|cos|/density.
    let wo = v.frame.to_local(Vec3::from(v.wo));
    let u = ScatterDraws {
        lobe: 0.5,
        dir: [0.3, 0.7],
    };
    if let Some(s) = v.scatter.sample(wo, u, Mode::Radiance) {
        out.albedo = s.weight.to_rgb();
    }
}
