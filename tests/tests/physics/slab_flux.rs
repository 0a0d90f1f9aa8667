//! Reflectance and transmittance of slabs, by reciprocity: a camera that looks at the middle of a slab under an upper
//! hemisphere of radiance 1 sees the reflectance for a beam along its view, and the transmittance with a lower one.
//!
//! Both hemispheres are lanes of one environment image, so a rendering gives R, T and R + T from the same paths.
//!
//! Standard errors are at most 0.3 % of the value or, in the default part, 3·10⁻⁴ of the incident flux for τ ≤ 4 and 10⁻³
//! for thicker slabs if that is more. Values below 10⁻⁴ are bounded only, since they reach down to 10⁻¹¹⁵.
//!
//! Thick slabs that hardly absorb are rendered without connections: hundreds of scatterings deep down, where a connection
//! carries nothing, would cost three times as much with them.

use crate::harness::{self, Measured, Precision, each, full, hash, number, table};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};

/// Standard error that is small enough for small values.
fn small(tau: f64) -> f64 {
    match tau {
        _ if full() => 0.0,
        t if t <= 4.0 => 3e-4,
        _ => 1e-3,
    }
}

/// Values below are only bounded.
const UNSEEN: f64 = 1e-4;
/// They are measured as exactly as this value would be.
const BOUND: f64 = 0.01;

/// Half-width that stands for infinity to 1e-4 (thin slabs, low beams) or better.
fn half_width(tau: f64) -> f64 {
    if tau < 1.0 { 100.0 } else { 20.0 }
}

fn view(mu: f64) -> [f64; 3] {
    [-(1.0 - mu * mu).sqrt(), 0.0, -mu]
}

struct Case {
    name: String,
    tau: f64,
    scene: Value,
    /// R and T.
    exact: [f64; 2],
}

impl Case {
    fn precision(&self) -> Precision {
        let [r, t] = self.exact.map(|v| if v < UNSEEN { BOUND } else { v });
        Precision::of([r, t, 1.0])
            .lanes(2)
            .at_least(small(self.tau))
    }

    fn judge(&self, m: &Measured, conservative: bool, out: &mut Table) {
        let p = self.precision();
        let (mut lanes, mut unseen) = (Vec::new(), Vec::new());
        for (i, v) in self.exact.into_iter().enumerate() {
            if v >= UNSEEN {
                lanes.push((i, v));
            } else {
                unseen.push((i, v));
            }
        }
        if conservative {
            lanes.push((2, 1.0));
        }
        out.row(&self.name, m, &lanes, &p);
        for (i, v) in unseen {
            out.near(&self.name, m.mean[i], v, 4.0 * p.error[i]);
        }
    }
}

/// The camera over the slab.
fn beam(e: &Value, mu0: f64) -> Value {
    let tau = number(e, "tau");
    let d = view(mu0);
    let mut s = scenes::scene(
        [0, 1, 2].map(|i| if i == 2 { 1.0 } else { 0.0 } - 2.0 * d[i]),
        d,
    );
    let albedo = number(e, "albedo");
    let slab = scenes::slab(tau, albedo, number(e, "g"), half_width(tau));
    scenes::medium(&mut s, "slab", slab);
    connect(&mut s, tau, albedo);
    s
}

/// Switches connections off where they cost more than they give.
fn connect(scene: &mut Value, tau: f64, albedo: f64) {
    let pays = tau < 16.0 || albedo < 0.999;
    scene["integrator"]["params"] = json!({ "sample_lights": pays });
}

/// All beams of an entry.
fn beams(e: &Value, add_light: impl Fn(&mut Value)) -> Vec<Case> {
    let [tau, albedo, g] = ["tau", "albedo", "g"].map(|k| number(e, k));
    let each = |b: &Value| {
        let mu0 = number(b, "mu0");
        let mut scene = beam(e, mu0);
        add_light(&mut scene);
        Case {
            name: format!("tau {tau} albedo {albedo} g {g} mu0 {mu0}"),
            tau,
            scene,
            exact: [number(b, "R"), number(b, "T")],
        }
    };
    harness::list(e, "beam").iter().map(each).collect()
}

fn run(name: &'static str, mut cases: Vec<(Case, bool)>) {
    cases.retain(|(c, _)| harness::chosen(&c.name));
    let mut out = Table::new(name);
    let found = each(&cases, |(c, _)| {
        harness::measure(&c.scene, &c.name, &c.precision())
    });
    for ((case, conservative), m) in cases.iter().zip(&found) {
        case.judge(m, *conservative, &mut out);
    }
    out.assert();
}

/// Default part: every eighth beam by a hash of its name, and the corners of the table (thinnest and thickest slab, albedo
/// 0.2 and 1, all g, at the steepest and the lowest beam).
#[test]
fn slab_flux() {
    let table = table("slab_flux");
    let mut cases = Vec::new();
    for e in harness::list(&table, "entries") {
        let [tau, albedo] = ["tau", "albedo"].map(|k| number(e, k));
        for (i, c) in beams(e, |s| scenes::add(s, "lights", scenes::hemispheres(true)))
            .into_iter()
            .enumerate()
        {
            let corner = (tau == 0.1 || tau == 256.0)
                && (albedo == 0.2 || albedo == 1.0)
                && (i == 0 || i == 3);
            if full() || corner || hash(&c.name).is_multiple_of(8) {
                cases.push((c, albedo == 1.0));
            }
        }
    }
    run("slab_flux", cases);
}

/// The same for isotropic incident light, with a tiny white patch that faces the slab and so shows the mean of the
/// radiance over the cosine-weighted hemisphere. Default part: every eighth entry up to τ = 64.
#[test]
fn slab_flux_diffuse() {
    let table = table("slab_flux");
    let mut cases = Vec::new();
    for e in harness::list(&table, "entries") {
        let [tau, albedo, g] = ["tau", "albedo", "g"].map(|k| number(e, k));
        let name = format!("tau {tau} albedo {albedo} g {g} diffuse");
        if !full() && (tau > 64.0 || !hash(&name).is_multiple_of(8)) {
            continue;
        }
        // The patch is so small that it shades a part of 1e-6 of what it sees, and so low that it sees a part of 1e-7 of
        // the world beyond the slab's edge.
        let (low, high, size) = (1.01, 1.02, 2e-5);
        let mut s = scenes::scene([0.0, 0.0, low], [0.0, 0.0, 1.0]);
        let w = 3.0 * half_width(tau);
        scenes::medium(&mut s, "slab", scenes::slab(tau, albedo, g, w));
        connect(&mut s, tau, albedo);
        scenes::add(&mut s, "lights", scenes::hemispheres(true));
        scenes::diffuse(&mut s, "white", json!(1));
        scenes::add(
            &mut s,
            "shapes",
            json!({
                "type": "rectangle", "corner": [-0.5 * size, -0.5 * size, high],
                "edge_u": [0, size, 0], "edge_v": [size, 0, 0], "material": "white"
            }),
        );
        let exact = ["R", "T"].map(|k| number(&e["diffuse"], k));
        cases.push((
            Case {
                name,
                tau,
                scene: s,
                exact,
            },
            albedo == 1.0,
        ));
    }
    run("slab_flux_diffuse", cases);
}

/// Slabs that rest on a Lambertian surface. Its emission of radiance 1, in the second lane, gives by reciprocity the flux
/// that arrives there.
#[test]
fn slab_flux_over_a_surface() {
    let table = table("slab_flux_lambert_surface");
    let mut cases = Vec::new();
    for e in harness::list(&table, "entries") {
        let w = half_width(number(e, "tau"));
        let found = beams(e, |s| {
            scenes::add(s, "lights", scenes::hemispheres(false));
            scenes::diffuse(s, "ground", e["surface_albedo"].clone());
            scenes::add(
                s,
                "shapes",
                json!({
                    "type": "rectangle", "corner": [-w, -w, 0], "edge_u": [2.0 * w, 0, 0],
                    "edge_v": [0, 2.0 * w, 0], "material": "ground", "emission": [0, 1, 0]
                }),
            );
        });
        cases.extend(
            found
                .into_iter()
                .enumerate()
                .filter_map(|(i, c)| (full() || i % 3 == 0).then_some((c, false))),
        );
    }
    run("slab_flux_lambert_surface", cases);
}
