//! What breaks media: extremes of extinction, albedo, anisotropy and lanes that differ.

use crate::harness::{self, Measured, Precision, build, each, full, measure};
use crate::judge::Table;
use crate::scenes;
use crate::transmittance::{exactly, once};
use serde_json::{Value, json};

const UNIT_BOX: [i32; 6] = [-1, -1, 0, 1, 1, 1];

/// A box of thickness 1 across the ray, before a background.
fn before(background: f64, params: Value) -> Value {
    let mut s = scenes::scene([0.1, 0.2, 3.0], [0.0, 0.0, -1.0]);
    let mut p = params;
    p["bounds"] = json!(UNIT_BOX);
    scenes::medium(&mut s, "m", p);
    if background > 0.0 {
        scenes::add(&mut s, "lights", scenes::dome(background));
    }
    s
}

/// Optical thickness 1e-6 to 1e6: transmittance, and the emission of a medium that glows like its walls.
#[test]
fn optical_thickness() {
    let mut out = Table::new("optical_thickness");
    for tau in [1e-6, 1e-4, 1e-2, 1.0, 10.0, 80.0, 100.0, 1e4, 1e6f64] {
        let s = before(1.0, json!({ "sigma_t": tau, "albedo": 0 }));
        let name = format!("transmittance of {tau}");
        exactly(&mut out, &name, &once(&s, &name), [(-tau).exp(); 3]);
        let s = before(0.0, json!({ "sigma_t": tau, "albedo": 0, "emission": tau }));
        let name = format!("emission of {tau}");
        exactly(&mut out, &name, &once(&s, &name), [-(-tau).exp_m1(); 3]);
    }
    out.assert();
}

/// White furnaces are white in every single sample: scattering at albedo 1 leaves the weight as it is, and constant
/// surroundings are found by scattering alone.
#[test]
fn white_furnace() {
    let mut out = Table::new("white_furnace");
    let mut taus = vec![1e-6, 1e-3, 1.0, 30.0, 1000.0];
    if full() {
        taus.push(1e5);
    }
    for tau in taus {
        let mut s = scenes::scene([0.3, 0.1, -5.0], [0.0, 0.0, 1.0]);
        s["film"]["resolution"] = json!([8, 8]);
        scenes::medium(&mut s, "m", scenes::ball([0.0; 3], 1.0, 0.0, tau, 0.85));
        scenes::add(&mut s, "lights", scenes::dome(1));
        let m = once(&s, &format!("sphere {tau}"));
        exactly(&mut out, &format!("white sphere of {tau}"), &m, [1.0; 3]);
    }
    // No bounce limit: 2 τ = 100 collisions on average, many more at times.
    let mut s = before(1.0, json!({}));
    scenes::medium(&mut s, "m", scenes::slab(50.0, 1.0, 0.0, 2000.0));
    exactly(&mut out, "white slab of 50", &once(&s, "slab"), [1.0; 3]);
    // With lanes that differ, weights vary but stay bounded.
    let mut s = scenes::scene([0.3, 0.1, -5.0], [0.0, 0.0, 1.0]);
    let p = json!({ "sigma_t": [0, 1, 1000], "albedo": 1, "center": [0, 0, 0], "radius": 1 });
    scenes::medium(&mut s, "m", p);
    scenes::add(&mut s, "lights", scenes::dome(1));
    s["film"]["resolution"] = json!([16, 16]);
    let m = once(&s, "chromatic furnace");
    for lane in 0..3 {
        let z = (m.mean[lane] - 1.0) / m.error[lane].hypot(2e-6);
        out.claim(z.abs() < 4.0 && m.error[lane] < 0.02, || {
            format!(
                "chromatic furnace [{lane}]: {} ± {}",
                m.mean[lane], m.error[lane]
            )
        });
    }
    out.assert();
}

/// Paths that enter a body isotropically collide 4 ∫ σ dV / S times on average, whatever the phase function.
#[test]
fn mean_number_of_collisions() {
    let mut out = Table::new("mean_number_of_collisions");
    let mut cases = vec![
        ("slab of 1", scenes::slab(1.0, 1.0, 0.0, 3000.0), 1.0, 2.0),
        (
            "forward slab of 1",
            scenes::slab(1.0, 1.0, 0.85, 3000.0),
            1.0,
            2.0,
        ),
        (
            "slab of 100",
            scenes::slab(100.0, 1.0, 0.0, 3000.0),
            1.0,
            200.0,
        ),
        (
            "sphere of 0.5",
            scenes::ball([0.0; 3], 1.0, 0.0, 0.5, -0.5),
            1.0,
            2.0 / 3.0,
        ),
        (
            "sphere of 50",
            scenes::ball([0.0; 3], 1.0, 0.0, 50.0, 0.5),
            1.0,
            200.0 / 3.0,
        ),
    ];
    if full() {
        let thick = scenes::slab(5000.0, 1.0, 0.0, 3000.0);
        cases.push(("slab of 5000", thick, 1.0, 1e4));
    }
    for (name, params, top, exact) in cases {
        // A white patch that faces the body sends paths into it with the cosine's distribution.
        let (low, high, size) = (top + 1e-4, top + 2e-4, 1e-6);
        let mut s = scenes::scene([0.0, 0.0, low], [0.0, 0.0, 1.0]);
        s["film"]["resolution"] = json!([16, 16]);
        scenes::medium(&mut s, "m", params);
        scenes::add(&mut s, "lights", scenes::dome(1));
        scenes::diffuse(&mut s, "white", json!(1));
        scenes::add(&mut s, "shapes", patch(high, size));
        let ready = build(&s).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut mean = resolvent_tests::Moments::default();
        for seed in 0..32 {
            let m = ready.measure_range(seed, 0, 16);
            mean.add(m.counters.collisions as f64 / m.samples);
        }
        let m = Measured {
            mean: [mean.mean(); 3],
            error: [mean.standard_error(); 3],
            samples: 32.0 * 4096.0,
            ..Measured::default()
        };
        // Few paths wander far: the spread is several times the mean.
        out.row(
            name,
            &m,
            &[(0, exact)],
            &Precision::relative([exact; 3], 0.03),
        );
    }
    out.assert();
}

/// A patch at height `z` that faces down.
fn patch(z: f64, size: f64) -> Value {
    json!({
        "type": "rectangle", "corner": [-0.5 * size, -0.5 * size, z],
        "edge_u": [0, size, 0], "edge_v": [size, 0, 0], "material": "white"
    })
}

/// Albedos so near 1 that `f32` holds a few bits of the difference, or one: the absorbed part, by Gauss quadrature over the
/// incident cosine.
#[test]
fn albedo_close_to_one() {
    let mut out = Table::new("albedo_close_to_one");
    let nodes = [
        (0.033_765_242_898_423_975f64, 0.085_662_246_189_585_17),
        (0.169_395_306_766_867_76, 0.180_380_786_524_069_3),
        (0.380_690_406_958_401_56, 0.233_956_967_286_345_52),
        (0.619_309_593_041_598_4, 0.233_956_967_286_345_52),
        (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
        (0.966_234_757_101_576, 0.085_662_246_189_585_17),
    ];
    for (albedo, tau, g, absorbed) in [
        (0.999_999_9, 100.0, 0.0, 1.999e-5),
        (0.999_999, 100.0, 0.85, 0.000_199_9),
        (0.9999, 30.0, 0.85, 0.00596),
    ] {
        let found = each(&nodes, |(mu, _)| {
            let d = [-(1.0 - mu * mu).sqrt(), 0.0, -*mu];
            let origin = [0, 1, 2].map(|i| if i == 2 { 1.0 } else { 0.0 } - 2.0 * d[i]);
            let mut s = scenes::scene(origin, d);
            scenes::medium(&mut s, "m", scenes::slab(tau, albedo, g, 3000.0));
            scenes::add(&mut s, "lights", scenes::dome(1));
            once(&s, &format!("albedo {albedo} mu {mu}"))
        });
        let (mut mean, mut square) = (0.0, 0.0);
        for ((mu, w), m) in nodes.iter().zip(&found) {
            mean += 2.0 * w * mu * (1.0 - m.mean[0]);
            square += (2.0 * w * mu * m.error[0]).powi(2);
        }
        let error = square.sqrt();
        // The albedo is rounded when it is read, when it scales σ_t and when it is taken out again, half a step of 2⁻²⁴
        // each; the exact value is given to 3 or 4 digits.
        let rounding = 1.5 * 0.5f64.powi(24) / (1.0 - albedo);
        let name = format!("albedo {albedo} tau {tau}");
        out.near(
            &name,
            mean,
            absorbed,
            3.0 * error + (1e-3 + rounding) * absorbed,
        );
        out.claim(mean > 0.0, || format!("{name}: gains"));
    }
    out.assert();
}

/// What does not scatter shows no light scattered; bad coefficients and anisotropies are refused with their names.
#[test]
fn coefficients() {
    let mut out = Table::new("coefficients");
    let mut s = before(0.0, json!({ "sigma_t": 2, "albedo": 0 }));
    let light = json!({ "type": "point", "position": [0.3, 0, 0.5], "intensity": 10 });
    scenes::add(&mut s, "lights", light);
    scenes::add(&mut s, "lights", scenes::beam([0.0, 0.3, -1.0], 3.0));
    out.claim(once(&s, "black").mean == [0.0; 3], || {
        "albedo 0 scatters".into()
    });
    for (params, name) in [
        (json!({ "sigma_t": 1, "albedo": 1.5 }), "albedo"),
        (json!({ "sigma_t": 1, "albedo": -0.1 }), "albedo"),
        (json!({ "sigma_a": 1, "sigma_s": -1 }), "sigma_s"),
        (json!({ "sigma_t": "NaN" }), "sigma_t"),
        (json!({ "sigma_t": 1, "phase": scenes::hg(1.2) }), "g"),
        (json!({ "sigma_t": 1, "phase": scenes::hg(-3.0) }), "g"),
    ] {
        let what = params.to_string();
        match build(&before(1.0, params)).err() {
            None => out.claim(false, || format!("{what} is accepted")),
            Some(e) => out.claim(e.contains(name) && e.contains("test.json:"), || {
                format!("{what}: the error names neither {name} nor its place: {e}")
            }),
        }
    }
    // g = ±1 is refused or exact: scattering straight on changes nothing.
    let (a, sigma_s) = (0.4f64, 2.0);
    let p = json!({ "sigma_a": a, "sigma_s": sigma_s, "phase": scenes::hg(1.0) });
    match build(&before(1.0, p)) {
        Err(e) => out.claim(e.contains('g') && e.contains("test.json:"), || e),
        Ok(ready) => {
            let m = ready.measure_range(1, 0, 64);
            out.near("g = 1", m.mean[0], (-a).exp(), 4.0 * m.error[0] + 2e-6);
        }
    }
    // Tiny anisotropies change nothing that shows.
    let at = |g: f64| {
        let mut s = before(0.0, json!({ "sigma_t": 1, "phase": scenes::hg(g) }));
        scenes::add(&mut s, "lights", scenes::beam([0.3, 0.0, -1.0], 1.0));
        once(&s, "small g").mean[0]
    };
    let zero = at(0.0);
    for g in [1e-9, 1e-6, -1e-6] {
        out.near(&format!("g = {g}"), at(g), zero, 1e-4 * zero);
    }
    out.assert();
}

/// Lanes that differ in extinction, albedo, light or emission.
#[test]
fn lanes() {
    let mut out = Table::new("lanes");
    let s = before(1.0, json!({ "sigma_t": [0, 1, 1e4], "albedo": 0 }));
    let m = once(&s, "clear lane");
    exactly(&mut out, "clear lane", &m, [1.0, (-1f64).exp(), 0.0]);
    out.claim(m.mean[0] == 1.0, || {
        "the clear lane is not exactly clear".into()
    });

    // A lane of albedo 0 sees absorption alone.
    let s = before(1.0, json!({ "sigma_t": 0.7, "albedo": [1, 0.5, 0] }));
    let p = Precision::of([1.0, 1.0, (-0.7f64).exp()]);
    let m = measure(&s, "black lane", &p);
    out.row("black lane", &m, &[(2, (-0.7f64).exp()), (0, 1.0)], &p);

    let params = json!({ "sigma_t": 1.3, "albedo": 0.9, "phase": scenes::hg(0.4) });
    let mut s = before(0.0, params.clone());
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.1, -1.0], 1.0));
    let m = once(&s, "grey");
    out.claim(m.mean[0] == m.mean[1] && m.mean[1] == m.mean[2], || {
        format!("equal lanes differ: {:?}", m.mean)
    });

    s["lights"][0]["irradiance"] = json!([1, 0, 0]);
    let m = once(&s, "red light");
    out.claim(
        m.mean[0] > 0.0 && m.mean[1] == 0.0 && m.mean[2] == 0.0,
        || format!("red light shows in other lanes: {:?}", m.mean),
    );

    let s = before(
        0.0,
        json!({ "sigma_t": [0, 1, 2], "albedo": 0, "emission": [0.15, 0, 0] }),
    );
    let p = Precision::of([0.15; 3]).lanes(1);
    let m = measure(&s, "glow without extinction", &p);
    out.row("glow without extinction", &m, &[(0, 0.15)], &p);

    // Lanes permuted: the same picture with its lanes permuted.
    let show = |sigma: [f64; 3], albedo: [f64; 3], light: [f64; 3], name: &str| {
        let mut s = before(0.0, json!({ "sigma_t": sigma, "albedo": albedo }));
        scenes::add(&mut s, "lights", scenes::beam([0.3, 0.1, -1.0], 1.0));
        s["lights"][0]["irradiance"] = json!(light);
        let p = Precision {
            error: [2e-4; 3],
            limit: 1e6,
        };
        measure(&s, name, &p)
    };
    let a = show([0.2, 1.0, 5.0], [1.0, 0.9, 0.8], [1.0, 2.0, 3.0], "lanes");
    let mut b = show(
        [5.0, 0.2, 1.0],
        [0.8, 1.0, 0.9],
        [3.0, 1.0, 2.0],
        "permuted",
    );
    b.mean.rotate_left(1);
    b.error.rotate_left(1);
    out.same("permuted lanes", &a, &b);
    out.assert();
}

/// Bit-identical films for any number of threads and any division into sample ranges.
#[test]
fn threads_and_ranges() {
    let mut s = before(
        0.2,
        json!({ "sigma_t": [1, 2, 3], "albedo": 0.9, "phase": scenes::hg(0.6) }),
    );
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.1, -1.0], 1.0));
    s["camera"] = scenes::camera([0.0, 0.0, 4.0], [0.0, 0.0, -1.0], 40.0);
    s["film"]["resolution"] = json!([47, 35]);
    let ready = build(&s).unwrap_or_else(|e| panic!("{e}"));
    let pixels = |threads: usize| -> Vec<[u64; 3]> {
        let run = || {
            let r = ready.render(5, 0, 48);
            (0..47 * 35)
                .map(|i| r.film.estimate(i).mean.map(f64::to_bits))
                .collect()
        };
        resolvent_engine::with_threads(threads, run).unwrap_or_else(|e| panic!("{e}"))
    };
    let one = pixels(1);
    assert!(
        one.iter().any(|p| p[0] != one[0][0]),
        "the picture is empty"
    );
    for threads in [2, 7] {
        assert!(
            pixels(threads) == one,
            "{threads} threads give other pixels"
        );
    }
    let whole = ready.measure_range(5, 0, 48).mean;
    let parts: Vec<_> = [(0, 16), (16, 48)]
        .map(|(a, b)| ready.measure_range(5, a, b).mean)
        .into();
    for lane in 0..3 {
        let merged = (parts[0][lane] + 2.0 * parts[1][lane]) / 3.0;
        assert!(
            (merged - whole[lane]).abs() < 1e-12,
            "{merged} {}",
            whole[lane]
        );
    }
    let _ = harness::full();
}
