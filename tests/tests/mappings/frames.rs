//! Frames and transforms.

use crate::cases;
use proptest::prelude::*;
use resolvent_api::Affine;
use resolvent_api::math::{DVec3, Frame, Vec3, warp};

fn direction() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        6 => [0f32..1.0, 0f32..1.0].prop_map(warp::sphere),
        // Close to an axis, where frames have their seam.
        1 => (0usize..6, -1e-3f32..1e-3, -1e-6f32..1e-6).prop_map(|(k, a, b)| {
            let mut v = [a, b, a * b];
            v[k / 2] = if k % 2 == 0 { 1.0 } else { -1.0 };
            Vec3::from(v).normalize()
        }),
        1 => Just(Vec3::new(0.0, -0.0, -1.0)),
    ]
}

/// A rotation, a stretch over eight decades, a mirror, a move.
fn transform() -> impl Strategy<Value = Affine> {
    let part = (
        direction(),
        direction(),
        [-4f64..4.0, -4f64..4.0, -4f64..4.0],
    );
    (
        part,
        [-1e6f64..1e6, -1e6f64..1e6, -1e6f64..1e6],
        any::<bool>(),
    )
        .prop_filter_map("axes too close", |((x, y, log), t, mirrored)| {
            let x = DVec3::new(x.x.into(), x.y.into(), x.z.into()).normalize();
            let y = DVec3::new(y.x.into(), y.y.into(), y.z.into());
            let z = x.cross(y);
            if z.length() < 0.1 {
                return None;
            }
            let z = z.normalize() * if mirrored { -1.0 } else { 1.0 };
            // Not orthogonal: y keeps its share of x, a shear.
            let scale = log.map(|l| 10f64.powf(l));
            Some(Affine {
                columns: [x * scale[0], y * scale[1], z * scale[2]],
                translation: t.into(),
            })
        })
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn frames_are_orthonormal(n in direction()) {
        let f = Frame::around(n);
        let [s, t, n] = [f.s, f.t, f.n].map(Vec3::from);
        for (a, b) in [(s, t), (t, n), (n, s)] {
            prop_assert!(a.dot(b).abs() < 3e-7, "{a} {b}");
        }
        for v in [s, t, n] {
            prop_assert!((v.length() - 1.0).abs() < 3e-7);
        }
        prop_assert!(s.cross(t).dot(n) > 0.999_99);
    }

    #[test]
    fn frames_there_and_back(n in direction(), v in direction()) {
        let f = Frame::around(n);
        let back = f.to_local(f.to_world(v));
        prop_assert!((back - v).length() < 1e-6, "{v} {back}");
    }

    #[test]
    fn transforms_there_and_back(a in transform(), p in [-1e3f64..1e3, -1e3f64..1e3, -1e3f64..1e3]) {
        let p = DVec3::from(p);
        let inverse = a.inverse();
        prop_assert!(inverse.is_some(), "{a:?}");
        let q = a.point(p);
        let back = inverse.map(|i| i.point(q)).unwrap_or(DVec3::NAN);
        // What rounding q costs, seen through the inverse.
        let least = a.columns.iter().map(|c| c.length()).fold(f64::INFINITY, f64::min);
        let size = q.length() + a.translation.length();
        prop_assert!((back - p).length() <= 1e-14 * size / (0.1 * least) + 1e-12 * p.length(), "{p} {back}");
        let again = a.after(&inverse.unwrap_or(Affine::IDENTITY));
        for (k, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            prop_assert!((again.columns[k] - unit).length() < 1e-6);
        }
        prop_assert!((a.determinant() * inverse.map_or(0.0, |i| i.determinant()) - 1.0).abs() < 1e-9);
        prop_assert_eq!(Affine::from_rows(a.to_rows()), a);
    }

    /// Boxes of images hold the images.
    #[test]
    fn bounds_hold_what_they_bound(a in transform(), u in [0f64..1.0, 0f64..1.0, 0f64..1.0]) {
        let (low, high) = (DVec3::new(-1.0, -2.0, 0.0), DVec3::new(1.0, 0.5, 3.0));
        let p = a.point(low + (high - low) * DVec3::from(u));
        let b = a.bounds(low, high);
        for k in 0..3 {
            prop_assert!(f64::from(b.min[k]) <= p[k] && p[k] <= f64::from(b.max[k]));
        }
    }
}
