//! Tests of the plugin.

mod films;

use super::*;
use resolvent_api::math::Frame;
use resolvent_api::math::warp::around_z;
use resolvent_api::microfacet::fresnel;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::{Mode, Scatter, ScatterDraws, ScatterEval, Vec3};
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Measured, Symmetry, albedo, check_around, directions, examine};

fn surface(params: &str) -> Look {
    let plugin: Principled = create(params).unwrap_or_else(|e| panic!("{params}: {e}"));
    plugin.closure(&SurfacePoint::default())
}

fn at(z: f32, turn: f32) -> Vec3 {
    around_z(z, turn).normalize()
}

fn draw(lobe: f32) -> ScatterDraws {
    ScatterDraws {
        lobe,
        dir: [0.3, 0.6],
    }
}

/// Parameters follow their textures, and a point has the closure of its values.
#[test]
fn textures_are_resolved_at_every_point() {
    let plugin: Principled = create(
        r#"{ "base_color": { "texture": "uv" }, "roughness": { "texture": "uv" }, "metallic": 0.5 }"#,
    )
    .unwrap();
    assert_eq!(plugin.traits(), 0);
    for uv in [[0.25f32, 0.75], [0.9, 0.1]] {
        let k = plugin.closure(&SurfacePoint {
            uv,
            ..SurfacePoint::default()
        });
        let same = surface(&format!(
            r#"{{ "base_color": [{0}, {1}, 0], "roughness": {0}, "metallic": 0.5 }}"#,
            uv[0], uv[1]
        ));
        let (wo, wi) = (at(0.6, 0.3), at(0.7, 2.0));
        let (a, b) = (
            k.eval(wo, wi, Mode::Radiance),
            same.eval(wo, wi, Mode::Radiance),
        );
        assert_eq!(a, b);
    }
    // What is transparent somewhere has an inside.
    let plugin: Principled = create(r#"{ "transmission": { "texture": "uv" } }"#).unwrap();
    assert_eq!(plugin.ior(), 1.5);
    assert!(create::<Principled>(r#"{ "ior": { "texture": "uv" } }"#).is_err());
}

/// χ², weights, densities both ways, reciprocity and modes over the layers.
#[test]
fn samples_follow_their_density() {
    let mut suite = Suite::new();
    for (params, wo) in [
        (r#"{ "roughness": 0.6 }"#, at(0.8, 0.1)),
        (
            r#"{ "base_color": [0.9, 0.5, 0.1], "metallic": 0.5, "roughness": 0.5, "anisotropy": 0.5,
                 "edge_color": [1, 0.8, 0.5] }"#,
            at(-0.5, 0.3),
        ),
        (
            r#"{ "base_color": 0.2, "roughness": 0.7, "specular": 0.5, "specular_color": [1, 0.5, 3],
                 "clearcoat": 0.8, "clearcoat_roughness": 0.5 }"#,
            at(0.3, 0.9),
        ),
        (
            r#"{ "sheen": 1, "sheen_color": [0.9, 0.3, 0.3], "sheen_roughness": 0.5, "roughness": 1 }"#,
            at(0.6, 0.4),
        ),
        (
            r#"{ "transmission": 0.7, "roughness": 0.5, "base_color": [0.9, 0.8, 0.7], "metallic": 0.2,
                 "clearcoat": 0.5, "clearcoat_roughness": 0.6, "sheen": 0.4 }"#,
            at(0.9, 0.2),
        ),
        (
            r#"{ "transmission": 0.7, "roughness": 0.5, "base_color": [0.9, 0.8, 0.7], "metallic": 0.2,
                 "clearcoat": 0.5, "clearcoat_roughness": 0.6, "sheen": 0.4 }"#,
            at(-0.8, 0.6),
        ),
        (
            r#"{ "transmission": 1, "roughness": 0.6, "thin": true, "transmission_color": [1, 0.5, 0] }"#,
            at(0.5, 0.7),
        ),
        (
            r#"{ "base_color": [0.9, 0.6, 0.2], "diffuse_roughness": 0.8, "metallic": 0.5, "clearcoat": 1,
                 "clearcoat_roughness": 0.3, "clearcoat_color": [0.9, 0.5, 0.3], "clearcoat_darkening": 1 }"#,
            at(0.7, 0.2),
        ),
    ] {
        let k = surface(params);
        assert_eq!(k.lobes(), lobes::SMOOTH);
        check_around(&mut suite, params, &k, Measured::Bsdf, wo, Vec3::Z, 0.012);
    }
    suite.assert();
}

/// Over a bumpy base, with its own normals: a rough coat, one on both sides, one over glass and under fuzz.
fn coated(params: &str) -> Look {
    let plugin: Principled = create(params).unwrap_or_else(|e| panic!("{params}: {e}"));
    assert_eq!(plugin.traits(), bsdf_traits::OWN_NORMALS);
    // The surface's own normal leans away from the base's.
    let smooth = Frame::around(Vec3::new(0.25, -0.2, 0.95).normalize());
    plugin.closure(&SurfacePoint {
        ng: smooth.n,
        tangent: smooth,
        ..SurfacePoint::default()
    })
}

/// A coat with normals of its own: χ², weights and densities in both modes, which are each other's adjoints.
#[test]
fn a_coat_may_have_its_own_normals() {
    let mut suite = Suite::new();
    for (params, wo) in [
        (
            r#"{ "base_color": 0.3, "roughness": 0.6, "clearcoat": 1, "clearcoat_roughness": 0.3,
                 "clearcoat_normal": [0.5, 0.5, 1] }"#,
            at(0.6, 0.3),
        ),
        (
            r#"{ "base_color": 0.3, "metallic": 1, "roughness": 0.6, "clearcoat": 0.8, "clearcoat_roughness": 0.5,
                 "clearcoat_normal": [0.7, 0.4, 0.9], "clearcoat_normal_scale": 0.5 }"#,
            at(-0.4, 0.7),
        ),
        (
            r#"{ "transmission": 0.7, "roughness": 0.5, "clearcoat": 1, "clearcoat_roughness": 0.6, "sheen": 0.5,
                 "clearcoat_color": [0.9, 0.5, 0.3], "clearcoat_normal": [0.5, 0.5, 1] }"#,
            at(0.15, 0.9),
        ),
        (
            r#"{ "roughness": 0.6, "clearcoat": 1, "clearcoat_normal": [0.5, 0.5, 1], "sheen": 0.4 }"#,
            at(0.6, 0.2),
        ),
    ] {
        let k = coated(params);
        examine(
            &mut suite,
            params,
            &k,
            Measured::Bsdf,
            wo,
            0.012,
            Symmetry::Adjoint,
        );
    }
    suite.assert();
}

/// The coat's mirror image is where its own normal says, as bright as Fresnel's law does, whatever the base's normal.
#[test]
fn a_smooth_coat_mirrors_about_its_normal() {
    let k = coated(
        r#"{ "base_color": 0, "specular": 0, "clearcoat": 1, "clearcoat_normal": [0.5, 0.5, 1] }"#,
    );
    let n = Vec3::new(0.25, -0.2, 0.95).normalize();
    for wo in [at(0.9, 0.1), at(0.5, 0.6), at(0.7, 0.8)] {
        let s = k.sample(wo, draw(0.0), Mode::Radiance).unwrap();
        let mirrored = n * (2.0 * n.dot(wo)) - wo;
        let wi = Vec3::from(s.wi);
        assert!((wi - mirrored).length() < 2e-4, "{wi} {mirrored}");
        let exact = fresnel::dielectric(n.dot(wo), 1.5).0;
        let close = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-3;
        assert!(close(s.weight[0] * s.forward, exact), "{s:?} {exact}");
        // From a light, with the cosines the other way round.
        let back = k.sample(wi, draw(0.0), Mode::Importance).unwrap();
        assert!((Vec3::from(back.wi) - wo).length() < 1e-5);
        let adjoint = exact * wo.z / wi.z;
        assert!(
            close(back.weight[0] * back.forward, adjoint),
            "{back:?} {adjoint}"
        );
        assert_eq!((s.forward, s.reverse), (back.reverse, back.forward));
    }
}

/// Without anything that turns it, the coat's own normal is the base's.
#[test]
fn a_level_normal_changes_nothing() {
    for rough in [0.0, 0.4] {
        let params = |normal: &str| {
            format!(
                r#"{{ "roughness": 0.5, "anisotropy": 0.4, "clearcoat": 0.7, "clearcoat_roughness": {rough}, "sheen": 0.2{normal} }}"#
            )
        };
        let own: Principled = create(&params(r#", "clearcoat_normal": [0.5, 0.5, 1]"#)).unwrap();
        let (own, base) = (own.closure(&SurfacePoint::default()), surface(&params("")));
        for wi in directions(50, 3) {
            let wo = at(0.4, 0.3);
            let [a, b] = [own, base].map(|k| k.eval(wo, wi, Mode::Radiance));
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * b.abs();
            assert!(
                near(a.f[0], b.f[0]) && near(a.forward, b.forward),
                "{a:?} {b:?}"
            );
        }
    }
}

/// White furnace: white dielectrics, metals, glass and sheets lose nothing, from either side.
#[test]
fn a_white_base_loses_nothing() {
    let mut suite = Suite::new();
    for kind in [
        r#""metallic": 0"#,
        r#""metallic": 0, "ior": 2.2"#,
        r#""metallic": 0, "f0": [0.3, 0.04, 1]"#,
        r#""metallic": 0, "specular": 0.3"#,
        r#""metallic": 0, "specular": 0"#,
        r#""metallic": 1"#,
        r#""metallic": 0.5"#,
        r#""metallic": 0.4, "transmission": 0.5"#,
        r#""transmission": 1, "ior": 1.4"#,
        r#""transmission": 0.5"#,
        r#""transmission": 1, "thin": true"#,
    ] {
        for roughness in [0.0, 0.3, 0.6, 1.0] {
            let params = format!(r#"{{ "base_color": 1, "roughness": {roughness}, {kind} }}"#);
            let k = surface(&params);
            for wo in [at(1.0, 0.0), at(0.6, 0.2), at(0.15, 0.5), at(-0.7, 0.9)] {
                let a = albedo(&k, wo, 40_000);
                for (lane, a) in a[..3].iter().enumerate() {
                    let what = format!("{params} at {wo}, lane {lane}");
                    suite.close(&what, *a, 1.0, 0.0, 0.01);
                }
            }
        }
    }
    suite.assert();
}

/// White furnace under layers: coat and fuzz over a white base of any kind lose nothing (to 1 %) and make nothing (to
/// 1.25 %), from either side; narrow fuzz to 1.2 %, a rough coat under fuzz and anisotropic facets to 2 %.
#[test]
fn layers_lose_nothing() {
    let mut suite = Suite::new();
    let layers = [
        (r#""clearcoat": 1"#, 0.99),
        (r#""clearcoat": 0.6, "clearcoat_ior": 1.8"#, 0.99),
        (r#""clearcoat": 1, "clearcoat_roughness": 0.6"#, 0.99),
        (
            r#""clearcoat": 1, "clearcoat_roughness": 1, "clearcoat_darkening": 1"#,
            0.99,
        ),
        (r#""sheen": 1"#, 0.988),
        (r#""sheen": 0.7, "sheen_roughness": 1"#, 0.99),
        (
            r#""sheen": 1, "sheen_roughness": 0.8, "clearcoat": 0.5, "clearcoat_roughness": 0.5"#,
            0.98,
        ),
    ];
    let bases = [
        r#""roughness": 0.5"#,
        r#""roughness": 1, "diffuse_roughness": 1"#,
        r#""metallic": 1, "roughness": 0"#,
        r#""metallic": 1, "roughness": 0.3"#,
        r#""metallic": 1, "roughness": 0.6, "anisotropy": 0.6"#,
        r#""metallic": 1, "roughness": 1"#,
        r#""transmission": 1, "roughness": 0"#,
        r#""transmission": 1, "roughness": 0.4"#,
        r#""transmission": 1, "roughness": 1, "ior": 1.3"#,
        r#""transmission": 1, "roughness": 0.5, "thin": true"#,
    ];
    for base in bases {
        for (layer, least) in layers {
            let params = format!(r#"{{ "base_color": 1, {base}, {layer} }}"#);
            let k = surface(&params);
            for wo in [
                at(1.0, 0.0),
                at(0.6, 0.2),
                at(0.2, 0.5),
                at(0.05, 0.1),
                at(-0.9, 0.9),
                at(-0.5, 0.3),
                at(-0.15, 0.7),
            ] {
                let a = albedo(&k, wo, 20_000)[0];
                // The exits of anisotropic facets are taken for those of isotropic ones as wide as they look.
                let slack = if base.contains("anisotropy") {
                    0.01
                } else {
                    0.0
                };
                let most = slack + if wo.z.abs() < 0.1 { 1.015 } else { 1.0125 };
                suite.claim(a > least - slack && a < most, || {
                    format!("{params} at {wo}: {a}")
                });
            }
        }
    }
    suite.assert();
}

/// Coloured metal under a coat: darkening makes it darker and more saturated, colour tints it, white stays.
#[test]
fn colour_and_darkening_of_the_coat() {
    let albedo_of = |rest: &str| {
        let k = surface(&format!(
            r#"{{ "base_color": [0.9, 0.5, 0.2], "metallic": 1, "roughness": 0.3, "clearcoat": 1{rest} }}"#
        ));
        albedo(&k, at(0.8, 0.1), 20_000)
    };
    let (plain, dark) = (albedo_of(""), albedo_of(r#", "clearcoat_darkening": 1"#));
    assert!(dark[0] < plain[0] && dark[2] / dark[0] < plain[2] / plain[0]);
    // (1 − K)/(1 − 0.5 K) with K the inner reflectance of glass for diffuse light, 0.596; the coat's own share stays.
    let k = f64::from(fresnel::dielectric_average(1.0 / 1.5));
    let coat = f64::from(fresnel::dielectric(0.8, 1.5).0);
    let expected = coat + (plain[1] - coat) * (1.0 - k) / (1.0 - 0.5 * k);
    assert!((dark[1] - expected).abs() < 2e-3, "{dark:?} {expected}");
    // At normal incidence, along which a smooth base reflects, two passages.
    let k = surface(
        r#"{ "base_color": 1, "metallic": 1, "roughness": 0, "clearcoat": 1, "clearcoat_color": [1, 0.25, 0] }"#,
    );
    let a = albedo(&k, Vec3::Z, 20_000);
    for (a, color) in a.iter().zip([1.0, 0.25, 1e-6]) {
        assert!((a - (0.04 + 0.96 * color)).abs() < 2e-3, "{a} {color}");
    }
}

/// The rough diffuse base alone: no loss where white, the closed albedo and value of the paper's single scattering.
#[test]
fn rough_diffuse_base() {
    let mut suite = Suite::new();
    let base = |roughness: f32, color: f32| {
        surface(&format!(
            r#"{{ "base_color": {color}, "specular": 0, "diffuse_roughness": {roughness} }}"#
        ))
    };
    for roughness in [0.0, 0.3, 1.0] {
        for z in [1.0, 0.5, 0.1] {
            let a = albedo(&base(roughness, 1.0), at(z, 0.3), 50_000)[0];
            suite.close("white", a, 1.0, 0.0, 2e-3);
        }
    }
    // Black in the limit: single scattering by hand at 60° and 45°, azimuths 0 and π/3 apart.
    let k = base(1.0, 1e-3);
    let (wo, wi) = (at(0.5, 0.0), at(0.5f32.sqrt(), 1.0 / 6.0));
    let pi = core::f64::consts::PI;
    let s = 0.75f64.sqrt() * 0.5f64.sqrt() * (pi / 3.0).cos();
    let a = 1.0 / (1.0 + 0.5 - 2.0 / (3.0 * pi));
    let f = 1e-3 / pi * a * (1.0 + s / 0.5f64.sqrt());
    let found = f64::from(k.eval(wo, wi, Mode::Radiance).f[0]);
    suite.close("single", found, f, 1e-3, 0.0);
    suite.assert();
}

/// A smooth boundary over a diffuse base: Fresnel's share is mirrored, and the base gets what both passages leave.
#[test]
fn smooth_plastic_in_closed_form() {
    let mut suite = Suite::new();
    let k = surface(r#"{ "base_color": [0.5, 0.25, 1], "roughness": 0 }"#);
    assert_eq!(k.lobes(), lobes::SMOOTH | lobes::DELTA);
    let mean = 1.0 - fresnel::dielectric_average(1.5);
    for (wo, wi) in [(at(1.0, 0.0), at(0.5, 0.3)), (at(-0.3, 0.1), at(-0.8, 0.8))] {
        let e = k.eval(wo, wi, Mode::Radiance);
        let pass = |w: Vec3| f64::from(1.0 - fresnel::dielectric(w.z.abs(), 1.5).0);
        for (lane, rho) in [0.5, 0.25, 1.0].into_iter().enumerate() {
            let f = rho * pass(wo) * pass(wi) / (core::f64::consts::PI * f64::from(mean));
            suite.close("base", f64::from(e.f[lane]), f, 1e-5, 0.0);
        }
        // The mirrored share, from all draws that come to it.
        let (mut mirrored, n) = (0.0, 10_000);
        for i in 0..n {
            let u = draw((i as f32 + 0.5) / n as f32);
            let s = k.sample(wo, u, Mode::Radiance);
            if let Some(s) = s.filter(|s| s.measure == Measure::Discrete as u32) {
                suite.claim(s.wi == [-wo.x, -wo.y, wo.z], || format!("{s:?}"));
                mirrored += f64::from(s.weight[0]) / f64::from(n);
            }
        }
        let f = f64::from(fresnel::dielectric(wo.z.abs(), 1.5).0);
        suite.close("mirrored", mirrored, f, 1e-3, 2e-4);
    }
    suite.assert();
}

/// A smooth metal is a mirror of its colour, and of white at grazing angles.
#[test]
fn smooth_metal() {
    let k = surface(
        r#"{ "base_color": [0.9, 0.6, 0.3], "metallic": 1, "roughness": 0, "edge_color": [1, 1, 0.5] }"#,
    );
    assert_eq!(k.lobes(), lobes::DELTA);
    let s = k.sample(Vec3::Z, draw(0.4), Mode::Radiance).unwrap();
    for (a, b) in s.weight.to_rgb().into_iter().zip([0.9, 0.6, 0.3]) {
        assert!((a - b).abs() < 1e-5, "{s:?}");
    }
    let s = k
        .sample(at(1.0 / 7.0, 0.1), draw(0.4), Mode::Radiance)
        .unwrap();
    let m5 = (6.0f32 / 7.0).powi(5);
    let expected = [0.9 + 0.1 * m5, 0.6 + 0.4 * m5, 0.5 * (0.3 + 0.7 * m5)];
    for (a, b) in s.weight.to_rgb().into_iter().zip(expected) {
        assert!((a - b).abs() < 1e-4, "{s:?} {expected:?}");
    }
}

/// Smooth glass is the plugin `dielectric`, with its index against the surroundings and its colour at each crossing.
#[test]
fn smooth_glass() {
    let plugin: Principled = create(
        r#"{ "base_color": [1, 0.5, 0.25], "transmission": 1, "roughness": 0, "ior": 1.6 }"#,
    )
    .unwrap();
    assert_eq!(plugin.ior(), 1.6);
    let k = plugin.closure(&SurfacePoint {
        outside_ior: 1.2,
        ..SurfacePoint::default()
    });
    let eta = 1.6 / 1.2;
    assert!((k.eta() - eta).abs() < 1e-6 && k.lobes() == lobes::DELTA);
    let wo = at(0.6, 0.0);
    let f = fresnel::dielectric(0.6, eta).0;
    let s = k.sample(wo, draw(0.999), Mode::Radiance).unwrap();
    assert!((s.wi[0] + wo.x / eta).abs() < 1e-6 && s.wi[2] < 0.0);
    assert!((s.forward - (1.0 - f)).abs() < 1e-6 && (s.reverse - s.forward).abs() < 1e-5);
    assert!((s.eta - eta).abs() < 1e-6);
    assert_eq!(s.weight.to_rgb(), [1.0, 0.5, 0.25]);
    let s = k.sample(wo, draw(0.0), Mode::Radiance).unwrap();
    assert_eq!((s.wi, s.eta), ([-wo.x, -wo.y, wo.z], 1.0));
    // Inside, all is reflected beyond the critical angle.
    let s = k
        .sample(at(-0.3, 0.0), draw(0.999), Mode::Radiance)
        .unwrap();
    assert_eq!((s.forward, s.weight.to_rgb()), (1.0, [1.0; 3]));
    assert!(s.wi[2] < 0.0);
    for (params, ior) in [
        ("{}", 1.0),
        (r#"{ "transmission": 1, "thin": true }"#, 1.0),
        (r#"{ "transmission": 1, "metallic": 1 }"#, 1.0),
        (r#"{ "transmission": 0.1 }"#, 1.5),
    ] {
        assert_eq!(create::<Principled>(params).unwrap().ior(), ior, "{params}");
    }
}

/// A path that is walked backwards has the densities that were stated for it, also where lobes are single directions.
#[test]
fn delta_lobes_backwards() {
    let mut suite = Suite::new();
    for params in [
        r#"{ "transmission": 0.6, "roughness": 0, "metallic": 0.3, "base_color": [0.9, 0.5, 0.2] }"#,
        r#"{ "transmission": 0.6, "roughness": 0, "clearcoat": 0.7, "sheen": 0.5 }"#,
        r#"{ "transmission": 1, "roughness": 0, "clearcoat": 1, "clearcoat_color": [1, 0.5, 0.2] }"#,
        r#"{ "transmission": 1, "roughness": 0, "thin": true, "clearcoat": 0.4 }"#,
        r#"{ "roughness": 0.4, "anisotropy": 0.5, "clearcoat": 1 }"#,
        r#"{ "transmission": 0.6, "roughness": 0, "metallic": 0.3, "thin_film": 1, "thin_film_ior": 2 }"#,
        r#"{ "transmission": 1, "roughness": 0, "clearcoat": 0.7, "thin_film": 0.5, "thin_film_ior": 1.8 }"#,
    ] {
        let k = surface(params);
        for wo in directions(40, 0xde1) {
            for lobe in [0.02, 0.2, 0.5, 0.8, 0.97] {
                let there = k.sample(wo, draw(lobe), Mode::Radiance);
                let Some(s) = there.filter(|s| s.measure == Measure::Discrete as u32) else {
                    continue;
                };
                let wi = Vec3::from(s.wi);
                if wi.z.abs() < 0.05 {
                    continue;
                }
                let back = (0..400).find_map(|i| {
                    let b = k.sample(wi, draw((i as f32 + 0.5) / 400.0), Mode::Radiance)?;
                    let same = b.lobe == s.lobe
                        && b.measure == s.measure
                        && (Vec3::from(b.wi) - wo).length() < 1e-4;
                    same.then_some(b)
                });
                let Some(b) = back else {
                    // Too unlikely to be met by 400 draws.
                    suite.claim(s.reverse < 0.01, || {
                        format!("{params}: {s:?} has no way back")
                    });
                    continue;
                };
                let what = format!("{params} at {wo}");
                suite.close(&what, s.reverse.into(), b.forward.into(), 1e-3, 1e-5);
                suite.close(&what, s.forward.into(), b.reverse.into(), 1e-3, 1e-5);
                suite.close(&what, (s.eta * b.eta).into(), 1.0, 1e-5, 0.0);
            }
        }
    }
    suite.assert();
}

/// A coat's mirrored share is Fresnel's; f0, specular and its colour set the boundary's at normal incidence.
#[test]
fn reflectances_at_normal_incidence() {
    let mirrored = |params: &str| {
        let k = surface(params);
        let mut sum = [0.0; 3];
        let n = 20_000;
        for i in 0..n {
            let u = draw((i as f32 + 0.5) / n as f32);
            let s = k.sample(Vec3::Z, u, Mode::Radiance);
            if let Some(s) = s.filter(|s| s.measure == Measure::Discrete as u32) {
                for (a, w) in sum.iter_mut().zip(s.weight.to_rgb()) {
                    *a += f64::from(w) / f64::from(n);
                }
            }
        }
        sum
    };
    let mut suite = Suite::new();
    for (params, expected) in [
        (r#"{ "roughness": 0 }"#, [0.04; 3]),
        (r#"{ "roughness": 0, "ior": 2 }"#, [1.0 / 9.0; 3]),
        (r#"{ "roughness": 0, "specular": 0.5 }"#, [0.02; 3]),
        (
            r#"{ "roughness": 0, "specular_color": [2, 0, 100] }"#,
            [0.08, 0.0, 1.0],
        ),
        (
            r#"{ "roughness": 0, "f0": [0.2, 0.5, 0.9] }"#,
            [0.2, 0.5, 0.9],
        ),
        (r#"{ "clearcoat": 0.5 }"#, [0.02; 3]),
        // Beneath the coat the boundary's share shrinks.
        (
            r#"{ "clearcoat": 1, "roughness": 0 }"#,
            [0.04 + 0.96 * 0.04; 3],
        ),
    ] {
        for (a, b) in mirrored(params).into_iter().zip(expected) {
            suite.close(params, a, b, 2e-3, 2e-4);
        }
    }
    suite.assert();
}

/// What the layers below are dimmed by covers what the fuzz reflects, which is never more than arrives.
#[test]
fn albedo_of_fuzz() {
    let mut suite = Suite::new();
    for roughness in [0.0, 0.1, 0.3, 0.52, 0.81, 1.0] {
        for mu in [0.003, 0.02, 0.11, 0.37, 0.73, 1.0] {
            let stated = f64::from(sheen::albedo(mu, roughness));
            let reflected = sheen::integrate(mu, roughness, sheen::value);
            let what = format!("fuzz of {roughness} at {mu}");
            // Closest to grazing, where values change within a cell, table and sum are coarse.
            let coarse = if mu < 0.01 {
                0.02
            } else {
                0.004 + 0.02 * stated
            };
            suite.claim(reflected <= stated + coarse && stated <= 1.0, || {
                format!("{what}: {reflected} of {stated}")
            });
            // Where nothing had to be divided out they are the same.
            if mu > 0.3 {
                suite.close(&what, reflected, stated, 0.03, 0.004);
            }
        }
    }
    // From the paper's model by hand, at normal incidence and 60°: h at 30°, α = 1/4.
    let (wo, wi) = (Vec3::Z, Vec3::new(0.75f32.sqrt(), 0.0, 0.5));
    let d = 6.0 * 0.5f64.powi(4) / (2.0 * core::f64::consts::PI);
    let sharp = 0.5625;
    let mix = |p0: f64, p1: f64| sharp * p0 + (1.0 - sharp) * p1;
    let l = |x: f64| {
        mix(25.3245, 21.5473) / (1.0 + mix(3.32435, 3.82987) * x.powf(mix(0.16801, 0.19823)))
            + mix(-1.2739, -1.9776) * x
            + mix(-4.85967, -4.32054)
    };
    let lambda = [(2.0 * l(0.5) - l(0.0)).exp(), l(0.5).exp()];
    let f = d / (4.0 * 0.5 * (1.0 + lambda[0] + lambda[1]));
    suite.close("f", f64::from(sheen::value(wo, wi, 0.5)), f, 1e-4, 0.0);
    suite.assert();
}

#[test]
fn nothing_is_ever_nan() {
    let mut suite = Suite::new();
    let mut all = directions(30, 0xa7);
    for z in [1e-8f32, -1e-8, 1e-6, -1e-4, 1e-3, 0.0] {
        all.push(Vec3::new(1.0, 0.0, z));
        all.push(Vec3::new(-0.6, -0.8, z));
    }
    for params in [
        "{}",
        r#"{ "base_color": 0, "specular": 0 }"#,
        r#"{ "roughness": 0.01, "anisotropy": 1, "metallic": 1 }"#,
        r#"{ "roughness": 1, "anisotropy": 1, "transmission": 0.5 }"#,
        r#"{ "f0": 1, "ior": 1, "roughness": 0.3 }"#,
        r#"{ "ior": 1, "transmission": 1, "roughness": 0.4 }"#,
        r#"{ "ior": 5, "clearcoat": 1, "clearcoat_ior": 1, "sheen": 1, "sheen_roughness": 0 }"#,
        r#"{ "clearcoat": 1, "clearcoat_roughness": 0.01, "transmission": 1, "thin": true }"#,
        r#"{ "specular_color": 1000, "edge_color": 0, "metallic": 0.5, "base_color": 1 }"#,
        r#"{ "diffuse_roughness": 1, "clearcoat": 1, "clearcoat_color": 0, "clearcoat_darkening": 1, "base_color": 1 }"#,
        r#"{ "transmission": 1, "roughness": 0.5, "ior": 1, "clearcoat": 1, "sheen": 1 }"#,
        r#"{ "transmission": 0.5, "roughness": 0.5, "thin_film": 1, "thin_film_ior": 5, "thin_film_thickness": 1e30 }"#,
        r#"{ "transmission": 1, "roughness": 0, "ior": 1, "thin_film": 1 }"#,
        r#"{ "metallic": 0.5, "base_color": 1, "f0": 1, "thin_film": 1, "thin_film_ior": 1, "roughness": 0.01 }"#,
        r#"{ "metallic": 0.5, "base_color": 0, "f0": 0, "thin_film": 1, "edge_color": 0, "thin_film_thickness": 1e-30 }"#,
    ] {
        let k = surface(params);
        for (i, &wo) in all.iter().enumerate() {
            for &wi in &all {
                let e = k.eval(wo, wi, Mode::Radiance);
                let all = [e.f[0], e.f[1], e.f[2], e.f[3], e.forward, e.reverse];
                suite.claim(all.iter().all(|v| v.is_finite() && *v >= 0.0), || {
                    format!("{params}: {e:?} at {wo} {wi}")
                });
            }
            for j in 0..6 {
                let u = ScatterDraws {
                    lobe: (j as f32 + 0.5) / 6.0,
                    dir: [(0.755 * i as f32).fract(), (0.57 * i as f32).fract()],
                };
                if let Some(s) = k.sample(wo, u, Mode::Importance) {
                    suite.claim(
                        s.weight.is_finite() && s.weight[0] >= 0.0 && s.forward > 0.0,
                        || format!("{params}: {s:?}"),
                    );
                }
            }
        }
    }
    suite.assert();
}

#[test]
fn black_scatters_nothing() {
    let k = surface(r#"{ "base_color": 0, "specular": 0 }"#);
    assert!(k.sample(Vec3::Z, draw(0.5), Mode::Radiance).is_none());
    let e = k.eval(Vec3::Z, at(0.5, 0.1), Mode::Radiance);
    assert_eq!(e, ScatterEval::default());
    for bad in [
        r#"{ "metallic": 1.5 }"#,
        r#"{ "base_color": [0.5, 2, 0.5] }"#,
        r#"{ "ior": 0.5 }"#,
        r#"{ "colour": 1 }"#,
    ] {
        assert!(create::<Principled>(bad).is_err(), "{bad}");
    }
}
