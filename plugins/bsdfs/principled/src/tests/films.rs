//! Tests of thin films on metal, plastic and glass.

use super::*;
use resolvent_api::ScatterSample;
use resolvent_api::microfacet::film::{Film, square};

/// Metal, plastic of every kind of colour, glass from both sides and sheets, under films.
const FILMED: [&str; 8] = [
    r#""metallic": 1, "base_color": [0.9, 0.6, 0.3], "edge_color": [1, 0.9, 0.8], "thin_film_ior": 2.2, "thin_film_thickness": 280"#,
    r#""base_color": 1, "thin_film_ior": 2"#,
    r#""base_color": 1, "f0": [0.3, 0.04, 0.9], "thin_film_thickness": 700"#,
    r#""base_color": 1, "specular": 0.4, "specular_color": [2, 0.2, 1], "thin_film_ior": 1.8"#,
    r#""metallic": 0.5, "base_color": [0.9, 0.7, 1], "transmission": 0.5, "thin_film_ior": 1.7"#,
    r#""transmission": 1, "transmission_color": 1, "ior": 1.5, "thin_film_ior": 2.1"#,
    r#""transmission": 1, "transmission_color": 1, "thin": true, "ior": 1.3, "thin_film_ior": 1.8, "thin_film_thickness": 350"#,
    r#""transmission": 1, "transmission_color": 1, "ior": 1.45, "clearcoat": 0.6, "clearcoat_roughness": 0.3, "sheen": 0.3"#,
];

fn filmed(film: f32, roughness: f32, rest: &str) -> String {
    format!(r#"{{ "thin_film": {film}, "roughness": {roughness}, {rest} }}"#)
}

/// χ², weights, densities both ways, reciprocity and modes.
#[test]
fn filmed_samples_follow_their_density() {
    let mut suite = Suite::new();
    for i in [0, 2, 4, 5, 6, 7] {
        let params = filmed(1.0 - 0.1 * i as f32, 0.55, FILMED[i]);
        let k = surface(&params);
        assert!(matches!(k, Look::B(_)));
        // Glass from both sides.
        let wo = [at(0.7, 0.1), at(-0.8, 0.6)][i % 2];
        check_around(&mut suite, &params, &k, Measured::Bsdf, wo, Vec3::Z, 0.012);
    }
    suite.assert();
}

/// White furnace: what films keep from reflection passes, and the other way round. To 1.5 %, near grazing 2 %: over a diffuse base shares are
/// known to 1 %. What meets several facets of glass knows of the film in the mean of all colours, which is 3 % off for single ones on the roughest.
#[test]
fn films_lose_nothing() {
    let mut suite = Suite::new();
    for white in FILMED[1..4].iter().chain(&FILMED[5..7]) {
        for roughness in [0.0, 0.3, 0.6, 1.0] {
            let params = filmed(1.0, roughness, white);
            let k = surface(&params);
            for wo in [at(1.0, 0.0), at(0.6, 0.2), at(0.15, 0.5), at(-0.7, 0.9)] {
                let a = albedo(&k, wo, 20_000);
                for (lane, a) in a[..3].iter().enumerate() {
                    let what = format!("{params} at {wo}, lane {lane}");
                    let bound = match roughness {
                        _ if wo.z < 0.2 => 0.02,
                        1.0 if white.contains("2.1") => 0.035,
                        _ => 0.015,
                    };
                    suite.close(&what, *a, 1.0, 0.0, bound);
                }
            }
        }
    }
    suite.assert();
}

/// The share that is mirrored, from all draws that come to it.
fn mirrored(k: &impl Scatter, wo: Vec3) -> [f64; 3] {
    let (mut sum, n) = ([0.0; 3], 20_000);
    for i in 0..n {
        let u = draw((i as f32 + 0.5) / n as f32);
        let s = k.sample(wo, u, Mode::Radiance);
        let same_side = |s: &ScatterSample| s.wi[2] * wo.z > 0.0;
        if let Some(s) = s
            .filter(|s| s.measure == Measure::Discrete as u32)
            .filter(same_side)
        {
            for (a, w) in sum.iter_mut().zip(s.weight.to_rgb()) {
                *a += f64::from(w) / f64::from(n);
            }
        }
    }
    sum
}

/// Smooth surfaces mirror what the film's equations say: plastic, glass from outside and along the same ray from within, a sheet with a
/// film on both faces, and metals that were given by the two colours that their indices have.
#[test]
fn smooth_films_are_exact() {
    let mut suite = Suite::new();
    let film = Film::new(1.0, 420.0, 1.8, 1.0);
    let rest = r#""base_color": 0, "thin_film_ior": 1.8, "thin_film_thickness": 420"#;
    let mut close = |what: &str, found: [f64; 3], exact: Spectrum, bound: f64| {
        for (a, b) in found.into_iter().zip(exact.to_rgb()) {
            suite.close(what, a, f64::from(b), 0.0, bound);
        }
    };
    for z in [1.0f32, 0.7, 0.4, 0.15] {
        let wo = at(z, 0.3);
        let exact = film.dielectric(z, 1.5);
        let plastic = surface(&filmed(1.0, 0.0, rest));
        close("plastic", mirrored(&plastic, wo), exact, 3e-4);
        let half = surface(&filmed(0.5, 0.0, &format!(r#"{rest}, "specular": 0.5"#)));
        let bare = Spectrum::splat(fresnel::dielectric(z, 1.5).0);
        let expected = (exact + bare) * 0.25;
        close("half", mirrored(&half, wo), expected, 3e-4);
        let glass = surface(&filmed(1.0, 0.0, &format!(r#"{rest}, "transmission": 1"#)));
        close("glass", mirrored(&glass, wo), exact, 3e-4);
        let within = (1.0 - (1.0 - z * z) / 2.25).sqrt();
        let from_within = mirrored(&glass, at(-within, 0.3));
        close("from within", from_within, exact, 3e-4);
        let thin = format!(r#"{rest}, "transmission": 1, "thin": true"#);
        let sheet = surface(&filmed(1.0, 0.0, &thin));
        let twice = exact.map(|f| 2.0 * f / (1.0 + f));
        close("sheet", mirrored(&sheet, wo), twice, 3e-4);
    }
    // Gold, chromium and iridium in three lanes.
    for (eta, k) in [
        ([0.143f32, 0.375, 1.44], [3.98f32, 2.39, 1.60]),
        ([4.37, 2.92, 1.65], [5.21, 4.23, 3.75]),
        ([3.09, 2.08, 1.62], [5.59, 4.07, 3.27]),
    ] {
        let reflects = |cos: f32| [0, 1, 2].map(|i| fresnel::conductor(cos, eta[i], k[i]));
        let (f0, f82) = (reflects(1.0), reflects(1.0 / 7.0));
        let m5 = (6.0f32 / 7.0).powi(5);
        let edge = [0, 1, 2].map(|i| (f82[i] / (f0[i] + (1.0 - f0[i]) * m5)).min(1.0));
        let metal = surface(&format!(
            r#"{{ "base_color": {f0:?}, "edge_color": {edge:?}, "metallic": 1, "roughness": 0, "thin_film": 1,
                  "thin_film_ior": 1.8, "thin_film_thickness": 420 }}"#
        ));
        for z in [1.0f32, 0.7, 0.4, 0.15] {
            let [r, g, b] = reflects(z);
            let squares = [0, 1, 2].map(|i| square(eta[i], k[i]));
            let exact = film.metal(z, Spectrum::rgb(r, g, b), squares);
            // The curve between 0° and 82° is not quite the metal's: 0.028 at most.
            close("metal", mirrored(&metal, at(z, 0.1)), exact, 0.03);
        }
    }
    suite.assert();
}

/// Where there is no film, closures are those of materials without one, bit for bit; and films go to nothing continuously.
#[test]
fn without_a_film() {
    let rest = r#""base_color": [0.5, 0.7, 0.2], "metallic": 0.4, "transmission": 0.3"#;
    let none = surface(&format!(r#"{{ "roughness": 0.4, {rest} }}"#));
    assert!(matches!(none, Look::A(_)));
    for off in [
        r#""thin_film": 0"#,
        r#""thin_film": 1, "thin_film_thickness": 0"#,
    ] {
        let k = surface(&format!(r#"{{ "roughness": 0.4, {rest}, {off} }}"#));
        assert!(matches!(k, Look::A(_)));
    }
    for (faint, bound) in [
        (r#""thin_film": 1e-4"#, 2e-4),
        (r#""thin_film": 1, "thin_film_thickness": 0.01"#, 2e-3),
        (r#""thin_film": 1, "thin_film_ior": 1"#, 2e-3),
    ] {
        let k = surface(&format!(r#"{{ "roughness": 0.4, {rest}, {faint} }}"#));
        for wo in directions(12, 5) {
            for wi in directions(12, 6) {
                let [a, b] = [k, none].map(|k| k.eval(wo, wi, Mode::Radiance));
                let scale = b.f.max_lane().max(1e-3);
                let d = (a.f - b.f).map(f32::abs).max_lane();
                assert!(d < bound * scale, "{faint}: {a:?} {b:?} at {wo} {wi}");
            }
        }
    }
}

/// A textured thickness is resolved at every point.
#[test]
fn thickness_follows_its_texture() {
    let plugin: Principled = create(
        r#"{ "metallic": 1, "thin_film": 1, "thin_film_thickness": { "texture": "uv" }, "roughness": 0 }"#,
    )
    .unwrap();
    assert_eq!(plugin.traits(), 0);
    for u in [0.25f32, 0.75] {
        let k = plugin.closure(&SurfacePoint {
            uv: [u, 0.5],
            ..SurfacePoint::default()
        });
        let same = surface(&format!(
            r#"{{ "metallic": 1, "thin_film": 1, "thin_film_thickness": {u}, "roughness": 0 }}"#
        ));
        let [a, b] = [k, same].map(|k| k.sample(Vec3::Z, draw(0.5), Mode::Radiance));
        assert_eq!(a, b);
    }
    for bad in [
        r#"{ "thin_film": 1.5 }"#,
        r#"{ "thin_film_thickness": -1 }"#,
        r#"{ "thin_film_ior": 0.5 }"#,
        r#"{ "thin_film_ior": { "texture": "uv" } }"#,
    ] {
        assert!(create::<Principled>(bad).is_err(), "{bad}");
    }
}
