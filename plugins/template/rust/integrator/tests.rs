//! A test of the plugin; `resolvent plugin check` has more.

use super::*;

/// Directions from a surface lie on the side it is seen from, and their mean cosine is 2/3.
#[test]
fn directions_from_a_surface() {
    let mut v = Vertex::empty();
    v.kind = VertexKind::Surface as u32;
    v.frame = resolvent_api::math::Frame::around(Vec3::new(0.6, 0.0, 0.8));
    v.wo = [0.0, 0.0, -1.0];
    let n = Vec3::from(v.frame.n);
    let mut stream = Stream::new(1);
    let mut sum = 0.0;
    for _ in 0..10_000 {
        let cosine = -n.dot(direction(&v, stream.uniform2()));
        assert!(cosine > -1e-6);
        sum += f64::from(cosine);
    }
    // The cosine's standard deviation is 0.24.
    assert!((sum / 1e4 - 2.0 / 3.0).abs() < 4.0 * 0.24 / 100.0, "{sum}");
}
