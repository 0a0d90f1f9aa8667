//! Normal maps: the shading frame turned by a texture.

use crate::texture::Texture;
use resolvent_api::math::{Frame, Vec3};
use resolvent_api::surface::mapped_normal;
use std::sync::Arc;

/// A texture of normals in tangent space.
///
/// Red, green and blue from 0 to 1 are the components from −1 to 1 along ∂p/∂u (perpendicular to the shading normal), the
/// direction of growing v, and the shading normal.
pub struct NormalMap {
    texture: Arc<Texture>,
    /// Factor on the first two components.
    scale: f32,
}

impl NormalMap {
    /// A map with a factor on its slope.
    pub fn new(texture: Arc<Texture>, scale: f64) -> Self {
        Self {
            texture,
            scale: scale as f32,
        }
    }

    /// The frame that the BSDF is given instead of `frame`, in the tangent space `tangent`, whose normal is that of `frame`.
    /// `ng` is the geometric normal.
    pub fn turn(&self, frame: &Frame, tangent: &Frame, ng: Vec3, uv: [f32; 2]) -> Frame {
        let [r, g, b, _] = self.texture.at(uv, &[1.0; 4]);
        // A texel without direction says nothing.
        let Some(n) = mapped_normal(tangent, ng, [r, g, b], self.scale) else {
            return *frame;
        };
        let s = Vec3::from(frame.s);
        let s = s - n * n.dot(s);
        let l = s.length();
        if !(l > 1e-6) {
            return Frame::around(n);
        }
        // Twice, because little is left of a tangent that the normal was turned towards.
        let s = s / l;
        let s = (s - n * n.dot(s)).normalize_or(s);
        Frame {
            s: s.into(),
            t: n.cross(s).into(),
            n: n.into(),
        }
    }
}

/// The tangent space of normal maps: the shading frame with `t` towards growing v.
#[inline(always)]
pub(super) fn tangent_space(frame: &Frame, mirrored: bool) -> Frame {
    let t = if mirrored {
        frame.t.map(|x| -x)
    } else {
        frame.t
    };
    Frame { t, ..*frame }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_image::{TexelData, Texels};
    use resolvent_scene::{self as describe, ImageSource};

    /// A map that is `rgb` everywhere.
    fn map(rgb: [f32; 3], scale: f64) -> NormalMap {
        let texels = Texels {
            width: 1,
            height: 1,
            channels: 3,
            data: TexelData::F32(rgb.to_vec()),
        };
        let described = describe::Texture::new(ImageSource::File("n.exr".into()));
        NormalMap::new(
            Arc::new(Texture::new(Some(Arc::new(texels)), &described)),
            scale,
        )
    }

    fn close(a: [f32; 3], b: Vec3) -> bool {
        (Vec3::from(a) - b).length() < 1e-6
    }

    #[test]
    fn components_follow_the_tangent_space() {
        let frame = Frame::around(Vec3::new(0.6, 0.0, 0.8));
        let ng = Vec3::from(frame.n);
        let turn = |rgb, scale, mirrored| {
            map(rgb, scale).turn(&frame, &tangent_space(&frame, mirrored), ng, [0.0; 2])
        };
        let flat = turn([0.5, 0.5, 1.0], 1.0, false);
        assert!(close(flat.n, ng) && close(flat.s, frame.s.into()));
        // (0.6, 0, 0.8), (0, 0.6, 0.8), and the same with the texture's v running the other way.
        let leans = turn([0.8, 0.5, 0.9], 1.0, false);
        assert!(close(leans.n, frame.to_world(Vec3::new(0.6, 0.0, 0.8))));
        let leans = turn([0.5, 0.8, 0.9], 1.0, false);
        assert!(close(leans.n, frame.to_world(Vec3::new(0.0, 0.6, 0.8))));
        let leans = turn([0.5, 0.8, 0.9], 1.0, true);
        assert!(close(leans.n, frame.to_world(Vec3::new(0.0, -0.6, 0.8))));
        // The scale acts on the slope.
        let leans = turn([0.8, 0.5, 0.9], 0.5, false);
        let expected = Vec3::new(0.3, 0.0, 0.8).normalize();
        assert!(close(leans.n, frame.to_world(expected)));
    }

    #[test]
    fn frames_stay_orthonormal_and_on_the_outer_side() {
        let frame = Frame::around(Vec3::new(0.0, 0.6, 0.8));
        let ng = Vec3::Z;
        for i in 0..1000u32 {
            let c = |k: u32| ((i * 7919 + k * 104_729) % 1009) as f32 / 1008.0;
            let tangent = tangent_space(&frame, i % 2 == 0);
            let f = map([c(0), c(1), c(2)], 3.0).turn(&frame, &tangent, ng, [0.3, 0.4]);
            let [s, t, n] = [f.s, f.t, f.n].map(Vec3::from);
            for (a, b, expected) in [
                (s, s, 1.0),
                (t, t, 1.0),
                (n, n, 1.0),
                (s, t, 0.0),
                (s, n, 0.0),
            ] {
                assert!((a.dot(b) - expected).abs() < 1e-5, "{f:?}");
            }
            assert!(s.cross(t).dot(n) > 0.99 && n.dot(ng) > 0.0, "{f:?}");
        }
        // Nothing is said by a texel at the origin.
        let f = map([0.5; 3], 1.0).turn(&frame, &frame, ng, [0.0; 2]);
        assert_eq!(f.n, frame.n);
    }
}
