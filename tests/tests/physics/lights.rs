//! Lights through the whole renderer: irradiance against closed forms and quadrature, and many lights against their sum.

use crate::harness::{self, Measured, Precision, each};
use crate::judge::Table;
use crate::scenes;
use glam::DVec3;
use resolvent_engine::light::Sky;
use resolvent_tests::quadrature::integrate;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A scene that sees a small receiver of albedo 0.5 at the origin, facing +z or what `normal` says; its radiance is E/2π.
fn receiver(normal: DVec3) -> Value {
    let n = normal.normalize();
    let mut scene = scenes::scene((n * 1e-3).to_array(), (-n).to_array());
    scenes::diffuse(&mut scene, "receiver", json!(0.5));
    let (a, b) = n.any_orthonormal_pair();
    let (a, b) = if a.cross(b).dot(n) < 0.0 {
        (b, a)
    } else {
        (a, b)
    };
    let size = 1e-5;
    scenes::add(
        &mut scene,
        "shapes",
        json!({
            "type": "rectangle", "corner": ((a + b) * (-0.5 * size)).to_array(),
            "edge_u": (a * size).to_array(), "edge_v": (b * size).to_array(), "material": "receiver"
        }),
    );
    scene
}

/// ∫ over a cylinder of radius r from `base` along `axis` of cos cos/d², from outside, at the origin with normal +z.
fn cylinder(base: DVec3, axis: DVec3, r: f64) -> f64 {
    let u = axis.normalize();
    let (x, y) = u.any_orthonormal_pair();
    integrate(0.0, 2.0 * PI, 2000, |phi| {
        let n = x * phi.cos() + y * phi.sin();
        integrate(0.0, axis.length(), 20, |h| {
            let q = base + u * h + n * r;
            let d2 = q.length_squared();
            (-n.dot(q)).max(0.0) * q.z.max(0.0) / (d2 * d2) * r
        })
    })
}

/// Irradiance from both sides of a disk, from cylinders, from a spot within its cone, its penumbra and beyond, and from sun and
/// sky.
#[test]
fn irradiance_of_lights() {
    let mut cases: Vec<(String, Value, [f64; 3])> = Vec::new();
    let grey = |e: f64| [0.5 / PI * e; 3];
    for (name, side, two_sided) in [("front", -1.0, false), ("back", 1.0, true)] {
        let mut scene = receiver(DVec3::Z);
        let (r, h) = (0.8, 1.5);
        scenes::add(
            &mut scene,
            "shapes",
            json!({
                "type": "disk", "center": [0, 0, h], "normal": [0, 0, side], "radius": r,
                "emission": 2, "two_sided": two_sided
            }),
        );
        // Closed form on the axis.
        let e = 2.0 * PI * r * r / (r * r + h * h);
        cases.push((format!("disk from its {name}"), scene, grey(e)));
    }
    for (name, base, axis, r) in [
        (
            "lying",
            DVec3::new(-1.0, 0.5, 1.0),
            DVec3::new(2.0, 0.0, 0.0),
            0.1,
        ),
        (
            "upright",
            DVec3::new(1.5, 0.0, 0.2),
            DVec3::new(0.0, 0.0, 2.0),
            0.4,
        ),
        (
            "slanted",
            DVec3::new(0.4, 0.3, 1.0),
            DVec3::new(0.5, 0.6, 0.7),
            0.25,
        ),
    ] {
        let mut scene = receiver(DVec3::Z);
        scenes::add(
            &mut scene,
            "shapes",
            json!({
                "type": "cylinder", "base": base.to_array(), "axis": axis.to_array(), "radius": r,
                "emission": 3
            }),
        );
        cases.push((
            format!("{name} cylinder"),
            scene,
            grey(3.0 * cylinder(base, axis, r)),
        ));
    }
    let axis = DVec3::new(0.1, 0.2, -1.0);
    for (name, at) in [
        ("within its cone", DVec3::new(0.0, -0.2, 2.0)),
        ("in its penumbra", DVec3::new(0.9, -0.3, 2.0)),
    ] {
        let mut scene = receiver(DVec3::Z);
        scenes::add(
            &mut scene,
            "lights",
            json!({
                "type": "spot", "position": at.to_array(), "direction": axis.to_array(),
                "intensity": [4, 5, 6], "angle_deg": 80, "inner_angle_deg": 30
            }),
        );
        let (co, ci) = (40f64.to_radians().cos(), 15f64.to_radians().cos());
        let cos = axis.normalize().dot(-at.normalize());
        let s = ((cos - co) / (ci - co)).clamp(0.0, 1.0);
        let e = s * s * (3.0 - 2.0 * s) * at.normalize().z / at.length_squared();
        assert!(e > 0.0 && (name == "within its cone") == (s == 1.0), "{s}");
        cases.push((
            format!("spot {name}"),
            scene,
            [4.0, 5.0, 6.0].map(|i| grey(i * e)[0]),
        ));
    }
    for (elevation, turbidity) in [(55.0, 2.5), (8.0, 6.0)] {
        let mut scene = receiver(DVec3::Y);
        scenes::add(
            &mut scene,
            "lights",
            json!({
                "type": "sun_sky", "elevation_deg": elevation, "azimuth_deg": 70,
                "turbidity": turbidity
            }),
        );
        let (sin, cos) = f64::to_radians(elevation).sin_cos();
        let (sa, ca) = 70f64.to_radians().sin_cos();
        let sky = Sky::new(DVec3::new(cos * sa, sin, cos * ca), turbidity);
        let exact = [0, 1, 2].map(|i| {
            let from_sky = integrate(0.0, 2.0 * PI, 40, |phi| {
                integrate(0.0, 0.5 * PI, 40, |theta| {
                    let (s, c) = theta.sin_cos();
                    let w = DVec3::new(s * phi.cos(), c, s * phi.sin());
                    sky.radiance(w)[i] * s * c
                })
            });
            0.5 / PI * (from_sky + sky.sun()[i] * sin)
        });
        cases.push((
            format!("sun {elevation}° high, turbidity {turbidity}"),
            scene,
            exact,
        ));
    }
    let mut out = Table::new("irradiance_of_lights");
    let found = each(&cases, |(name, scene, exact)| {
        harness::measure(scene, name, &Precision::of(*exact))
    });
    for ((name, _, exact), m) in cases.iter().zip(&found) {
        let lanes = [(0, exact[0]), (1, exact[1]), (2, exact[2])];
        out.row(name, m, &lanes, &Precision::of(*exact));
    }
    out.assert();
}

/// A dozen lights of all kinds over a receiver, clear and in fog that some of them stand in: chosen from by the tree, they look
/// like the sum of the pictures that each makes alone.
#[test]
fn many_lights_are_the_sum_of_each() {
    let lights: Vec<(&str, Value)> = (0..12)
        .map(|i| {
            let (s, c) = (2.4 * f64::from(i)).sin_cos();
            let (r, z) = (0.3 + 0.15 * f64::from(i), 0.5 + 0.1 * f64::from(i % 5));
            let p = [r * c, r * s, z];
            let l = 1.0 + f64::from(i);
            match i % 4 {
                0 => ("shapes", json!({ "type": "sphere", "center": p, "radius": 0.1, "emission": 3.0 * l })),
                1 => ("shapes", json!({
                    "type": "disk", "center": p, "normal": [-c, -s, -0.5], "radius": 0.2,
                    "emission": l, "two_sided": i > 6
                })),
                2 => ("shapes", json!({
                    "type": "cylinder", "base": p, "axis": [0.3 * s, -0.3 * c, 0.1], "radius": 0.05,
                    "emission": 2.0 * l
                })),
                _ => ("lights", json!({
                    "type": "spot", "position": [p[0], p[1], 2.2], "direction": [-0.3 * c, -0.3 * s, -1],
                    "intensity": 0.3 * l, "angle_deg": 70, "inner_angle_deg": 40
                })),
            }
        })
        .collect();
    let mut out = Table::new("many_lights");
    for fog in [false, true] {
        let empty = || {
            let mut scene = scenes::scene([0.05, -0.1, 1.9], [0.02, 0.05, -1.0]);
            scenes::diffuse(&mut scene, "floor", json!(0.4));
            scenes::add(
                &mut scene,
                "shapes",
                json!({
                    "type": "rectangle", "corner": [-3, -3, 0], "edge_u": [6, 0, 0],
                    "edge_v": [0, 6, 0], "material": "floor"
                }),
            );
            if fog {
                scenes::medium(
                    &mut scene,
                    "fog",
                    scenes::ball([0.0, 0.0, 0.5], 1.2, 0.2, 0.6, 0.4),
                );
            }
            scene
        };
        let mut together = empty();
        for (list, light) in &lights {
            scenes::add(&mut together, list, light.clone());
        }
        let precise = |value: f64| Precision {
            error: [value, f64::INFINITY, f64::INFINITY],
            limit: 3e7,
        };
        let name = if fog { "in fog" } else { "clear" };
        let rough = harness::measure(&together, name, &precise(1.0));
        let all = harness::measure(&together, name, &precise(0.004 * rough.mean[0]));
        // Others that stand in the way block what a light sends; so they stay, without emission.
        let each_alone = each(&(0..lights.len()).collect::<Vec<_>>(), |k| {
            let mut scene = empty();
            scenes::diffuse(&mut scene, "black", json!(0));
            for (i, (list, light)) in lights.iter().enumerate() {
                let mut light = light.clone();
                if i != *k && *list == "shapes" {
                    if let Some(keys) = light.as_object_mut() {
                        keys.remove("emission");
                        keys.remove("two_sided");
                    }
                    light["material"] = json!("black");
                }
                if i == *k || *list == "shapes" {
                    scenes::add(&mut scene, list, light);
                }
            }
            harness::measure(
                &scene,
                &format!("{name} {k}"),
                &precise(0.0015 * rough.mean[0]),
            )
        });
        let mut sum = Measured::default();
        for m in &each_alone {
            for lane in 0..3 {
                sum.mean[lane] += m.mean[lane];
                sum.error[lane] = sum.error[lane].hypot(m.error[lane]);
            }
            sum.samples += m.samples;
        }
        out.same(name, &all, &sum);
    }
    out.assert();
}
