//! Densities with their measure in the type, and the one conversion between them.

use resolvent_api::Vec3;
use resolvent_api::vertex::{Vertex, VertexKind};

/// A density per steradian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdfW(pub f32);

/// A density per area (surfaces) or volume (media): the product measure of path space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdfA(pub f32);

impl PdfW {
    /// The density at `to` of a direction sampled at `from` with this density: p_ω D(to)/|x−y|² (Jakob 2013, eq. 3.14).
    /// For a vertex at infinity the density stays one per steradian.
    pub fn at_vertex(self, from: &Vertex, to: &Vertex) -> PdfA {
        if to.is_infinite() || from.is_infinite() {
            return PdfA(self.0);
        }
        let d = to.position() - from.position();
        let d2 = d.length_squared();
        if d2 == 0.0 {
            return PdfA(0.0);
        }
        PdfA(self.0 * to.cosine(d / d2.sqrt()) / d2)
    }
}

/// The geometry term without visibility and transmittance: D_x(xy) D_y(yx)/|x−y|²; 0 for coincident points.
pub fn geometry_term(x: &Vertex, y: &Vertex) -> f32 {
    let d: Vec3 = y.position() - x.position();
    let d2 = d.length_squared();
    if d2 == 0.0 {
        return 0.0;
    }
    let w = d / d2.sqrt();
    x.cosine(w) * y.cosine(w) / d2
}

/// True if light can leave `v` in direction `w` and be counted by a smooth density.
pub fn is_connectible(v: &Vertex) -> bool {
    use resolvent_api::operator::{Scatter, lobes};
    v.is(VertexKind::Medium) || v.scatter.lobes() & lobes::SMOOTH != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::vertex::vertex_flags;

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
        let uniform = PdfW(0.25 * core::f32::consts::FRAC_1_PI);
        let n = 256;
        let (mut sum, mut terms) = (0f64, 0f64);
        for i in 0..n * n {
            let at = |k: usize| 2.0 * (k as f32 + 0.5) / n as f32 - 1.0;
            let to = vertex(VertexKind::Surface, [at(i % n), at(i / n), 1.0]);
            sum += f64::from(uniform.at_vertex(&from, &to).0);
            terms += f64::from(geometry_term(&from, &to));
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
        assert_eq!(PdfW(0.3).at_vertex(&from, &sky), PdfA(0.3));
        assert_eq!(PdfW(0.3).at_vertex(&from, &from), PdfA(0.0));
        assert_eq!(geometry_term(&from, &from), 0.0);
    }
}
