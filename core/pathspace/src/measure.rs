//! The one conversion between densities per steradian and per area or volume.

use resolvent_api::Vec3;
use resolvent_api::vertex::{Vertex, VertexKind, vertex_flags};

/// The factor from a density per steradian at `from` to one per area or volume at `to`, which lies in direction `w`:
/// D(to)/|x−y|² (Jakob 2013, eq. 3.14); 0 for coincident points. A ray from infinity has a density per area across it; towards
/// infinity densities stay per steradian, and towards a point without extent what they are, probabilities.
pub fn conversion(from: &Vertex, to: &Vertex, w: Vec3) -> f64 {
    if to.flags & (vertex_flags::INFINITE | vertex_flags::DELTA) != 0 {
        return 1.0;
    }
    let cosine = f64::from(to.cosine(w));
    if from.is_infinite() {
        return cosine;
    }
    let d2 = (to.position() - from.position())
        .as_dvec3()
        .length_squared();
    if d2 > 0.0 { cosine / d2 } else { 0.0 }
}

/// True if light can leave `v` in direction `w` and be counted by a smooth density.
pub fn is_connectible(v: &Vertex) -> bool {
    use resolvent_api::operator::{Scatter, lobes};
    v.is(VertexKind::Medium) || v.scatter.lobes() & lobes::SMOOTH != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(kind: VertexKind, p: [f32; 3]) -> Vertex {
        Vertex {
            kind: kind as u32,
            p,
            ng: [0.0, 0.0, 1.0],
            ..Vertex::empty()
        }
    }

    /// Uniform directions over a square: the converted density integrates to its solid angle over 4π, in closed form
    /// 4 asin(1/2)/4π for the square of edge 2 at distance 1.
    #[test]
    fn converted_densities_integrate_to_the_solid_angle() {
        let from = vertex(VertexKind::Medium, [0.0, 0.0, 0.0]);
        let uniform = 0.25 * core::f64::consts::FRAC_1_PI;
        let n = 256;
        let (mut sum, mut terms) = (0f64, 0f64);
        for i in 0..n * n {
            let at = |k: usize| 2.0 * (k as f32 + 0.5) / n as f32 - 1.0;
            let to = vertex(VertexKind::Surface, [at(i % n), at(i / n), 1.0]);
            let w = to.position().normalize();
            sum += uniform * conversion(&from, &to, w);
            // The geometry term is the same in both directions.
            terms += f64::from(from.cosine(w)) * conversion(&from, &to, w);
        }
        let area = 4.0 / (n * n) as f64;
        let expected = (1.0f64 / 2.0).asin() / core::f64::consts::PI;
        assert!((sum * area - expected).abs() < 1e-5, "{}", sum * area);
        assert!((terms * area - 4.0 * core::f64::consts::PI * expected).abs() < 1e-4);
    }

    #[test]
    fn infinity_and_coincidence() {
        let from = vertex(VertexKind::Medium, [0.0; 3]);
        let mut sky = vertex(VertexKind::Emitter, [0.0, 1.0, 0.0]);
        sky.flags = vertex_flags::INFINITE;
        let w = sky.position();
        assert_eq!(0.3 * conversion(&from, &sky, w), 0.3);
        assert_eq!(0.3 * conversion(&from, &from, w), 0.0);
        assert_eq!(f64::from(from.cosine(w)) * conversion(&from, &from, w), 0.0);
    }
}
