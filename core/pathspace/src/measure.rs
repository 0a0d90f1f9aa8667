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
