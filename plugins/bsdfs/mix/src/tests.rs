//! Tests of the plugin, with parts of its own.

use super::*;
use core::f32::consts::FRAC_1_PI;
use resolvent_api::Spectrum;
use resolvent_api::math::warp;
use resolvent_api::microfacet::Interface;
use resolvent_tests::Suite;
use resolvent_tests::host::{Nested, create_with};
use resolvent_tests::scatter::{Measured, albedo, check, directions};

/// A coloured diffuse reflector (`kind` 0), a diffuse transmitter that doesn't bend (1), a mirror (2), a rough boundary of index
/// `ior` (3), or nothing (4).
#[derive(Clone, Copy)]
struct Part {
    kind: i64,
    value: f32,
    ior: f32,
    /// A closure too large to be held beside another.
    _fill: [f32; 48],
}

impl Plugin for Part {
    const NAME: &'static str = "part";
    const SUMMARY: &'static str = "One of several simple parts.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::int("kind", "").required().build(),
        Decl::float("value", "").default("1").build(),
        Decl::float("ior", "").default("1").build(),
    ];
    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            kind: params.int("kind")?,
            value: params.float("value")? as f32,
            ior: params.float("ior")? as f32,
            _fill: [0.0; 48],
        })
    }
}

impl Bsdf for Part {
    type Closure = Self;
    fn traits(&self) -> u32 {
        if self.kind == 7 {
            bsdf_traits::OWN_NORMALS | bsdf_traits::NON_RECIPROCAL
        } else {
            bsdf_traits::UNIFORM
        }
    }
    fn ior(&self) -> f32 {
        self.ior
    }
    fn closure(&self, _: &SurfacePoint) -> Self {
        *self
    }
}

impl Part {
    fn boundary(&self) -> Interface {
        Interface::new([0.3; 2], self.ior, false)
    }
}

impl Scatter for Part {
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let crosses = wo.z * wi.z < 0.0;
        match self.kind {
            3 => self.boundary().eval(wo, wi),
            k @ (0 | 1) if crosses == (k == 1) => ScatterEval {
                f: Spectrum::rgb(self.value, 0.5 * self.value, 0.1) * FRAC_1_PI,
                forward: wi.z.abs() * FRAC_1_PI,
                reverse: wo.z.abs() * FRAC_1_PI,
            },
            _ => ScatterEval::default(),
        }
    }
    fn sample(&self, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        match self.kind {
            3 => return self.boundary().sample(wo, u),
            4 => return None,
            2 => {
                return Some(ScatterSample {
                    weight: Spectrum::splat(self.value),
                    wi: [-wo.x, -wo.y, wo.z],
                    eta: 1.0,
                    forward: 1.0,
                    reverse: 1.0,
                    measure: Measure::Discrete as u32,
                    lobe: 0,
                });
            }
            _ => {}
        }
        let w = warp::cosine_hemisphere(u.dir);
        let sign = 1f32.copysign(wo.z) * if self.kind == 1 { -1.0 } else { 1.0 };
        let wi = Vec3::new(w.x, w.y, w.z * sign);
        let e = self.eval(wo, wi, mode);
        Some(ScatterSample {
            weight: e.f * (w.z / e.forward),
            wi: wi.into(),
            eta: 1.0,
            forward: e.forward,
            reverse: e.reverse,
            measure: 0,
            lobe: 0,
        })
    }
    fn lobes(&self) -> u32 {
        match self.kind {
            2 => lobes::DELTA,
            4 => 0,
            _ => lobes::SMOOTH,
        }
    }
    fn eta(&self) -> f32 {
        self.ior
    }
}

fn part(kind: i64, ior: f32) -> Nested {
    let value = if kind == 2 { 0.5 } else { 0.8 };
    let params = format!(r#"{{ "kind": {kind}, "value": {value}, "ior": {ior} }}"#);
    Nested::bsdf::<Part>(&params, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn mix(a: Nested, b: Nested, weight: f32) -> Mixture {
    let params = format!(r#"{{ "weight": {weight} }}"#);
    let plugin: Mix = create_with(&params, &[("a", a), ("b", b)]).unwrap_or_else(|e| panic!("{e}"));
    plugin.closure(&SurfacePoint::default())
}

fn draw(lobe: f32) -> ScatterDraws {
    ScatterDraws {
        lobe,
        dir: [0.3, 0.6],
    }
}

/// χ², weights, densities both ways, reciprocity: a reflector with a refracting boundary, and mixtures in mixtures.
#[test]
fn samples_follow_their_density() {
    let mut suite = Suite::new();
    let (clay, veil, glass) = (part(0, 1.0), part(1, 1.0), part(3, 1.5));
    let inner = Nested::bsdf::<Mix>(r#"{ "weight": 0.25 }"#, &[("a", clay), ("b", veil)]).unwrap();
    for (name, k) in [
        ("clay and glass", mix(clay, glass, 0.4)),
        ("glass and clay", mix(glass, clay, 0.9)),
        ("a mixture in a mixture", mix(inner, clay, 0.5)),
    ] {
        for wo in [
            Vec3::new(0.3, 0.2, 0.9).normalize(),
            Vec3::new(-0.5, 0.1, -0.6).normalize(),
        ] {
            check(&mut suite, name, &k, Measured::Bsdf, wo);
        }
    }
    suite.assert();
}

/// The value is the weighted sum, whether the closures are held inline or not.
#[test]
fn values_add_up() {
    let (clay, veil) = (part(0, 1.0), part(1, 1.0));
    let k = mix(clay, veil, 0.3);
    assert!(k.closures.is_inline(0) && k.closures.is_inline(1));
    let inner = Nested::bsdf::<Mix>("{}", &[("a", clay), ("b", veil)]).unwrap();
    let nested = mix(inner, veil, 0.5);
    assert!(!nested.closures.is_inline(0));
    let (up, down) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, -0.8));
    for (k, above, below) in [(k, 0.7, 0.3), (nested, 0.25, 0.75)] {
        for (wi, share) in [(up, above), (down, below)] {
            let e = k.eval(up, wi, Mode::Importance);
            assert!((e.f[0] - share * 0.8 * FRAC_1_PI).abs() < 1e-6);
            assert!((e.f[1] - share * 0.4 * FRAC_1_PI).abs() < 1e-6);
            assert!((e.forward - share * 0.8 * FRAC_1_PI).abs() < 1e-6);
        }
        let a = albedo(&k, up, 20_000);
        assert!(
            (a[0] - 0.8).abs() < 1e-3 && (a[1] - 0.4).abs() < 1e-3,
            "{a:?}"
        );
        assert_eq!(k.eta(), 1.0);
    }
}

/// A mirror in a mixture is a delta lobe with the probability of its choice.
#[test]
fn delta_parts() {
    let k = mix(part(0, 1.0), part(2, 1.0), 0.25);
    assert_eq!(k.lobes(), lobes::SMOOTH | lobes::DELTA);
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let s = k.sample(wo, draw(0.8), Mode::Radiance).unwrap();
    assert_eq!(
        (s.wi, s.measure),
        ([-0.6, 0.0, 0.8], Measure::Discrete as u32)
    );
    assert!((s.forward - 0.25).abs() < 1e-6 && (s.reverse - 0.25).abs() < 1e-6);
    assert!((s.weight[0] - 0.5).abs() < 1e-6);
    let s = k.sample(wo, draw(0.7), Mode::Radiance).unwrap();
    let e = k.eval(wo, s.wi.into(), Mode::Radiance);
    assert_eq!((s.forward, s.measure), (e.forward, 0));
    // What scatters nothing is never chosen, but takes its share.
    let k = mix(part(4, 1.0), part(2, 1.0), 0.25);
    for lobe in [0.0, 0.5, 0.999] {
        let s = k.sample(wo, draw(lobe), Mode::Radiance).unwrap();
        assert!((s.weight[0] - 0.125).abs() < 1e-6 && s.forward == 1.0);
    }
    // The ends of the range.
    for (weight, kind) in [(0.0, 0), (1.0, 2)] {
        let k = mix(part(0, 1.0), part(2, 1.0), weight);
        assert_eq!(k.lobes(), [lobes::SMOOTH, 0, lobes::DELTA][kind]);
        for lobe in [0.0, 0.999_999] {
            assert!(k.sample(wo, draw(lobe), Mode::Radiance).is_some());
        }
    }
}

/// Radiance through a part that bends is compressed, through one that doesn't it is not: after the core's division by η² each
/// has its own factor, in values and in samples.
#[test]
fn each_part_keeps_its_index() {
    let (veil, glass) = (part(1, 1.0), part(3, 1.5));
    let k = mix(veil, glass, 0.5);
    assert_eq!(k.eta(), 1.5);
    let single = |kind| {
        let p = if kind == 1 { veil } else { glass };
        mix(p, p, 0.5)
    };
    let (bent, unbent) = (single(3), single(1));
    for wo in directions(20, 9) {
        for wi in directions(20, 10) {
            if wo.z * wi.z > 0.0 {
                continue;
            }
            let eta2 = if wo.z > 0.0 { 2.25 } else { 1.0 / 2.25 };
            let f = |k: &Mixture, mode| k.eval(wo, wi, mode).f[0];
            let power = 0.5 * (f(&bent, Mode::Importance) + f(&unbent, Mode::Importance));
            let got = f(&k, Mode::Importance);
            assert!((got - power).abs() < 1e-5 * power, "{got} {power}");
            let radiance = 0.5 * (f(&bent, Mode::Radiance) / eta2 + f(&unbent, Mode::Radiance));
            let got = f(&k, Mode::Radiance) / eta2;
            assert!((got - radiance).abs() < 1e-5 * radiance, "{got} {radiance}");
        }
        for lobe in [0.1, 0.4, 0.6, 0.9] {
            let Some(s) = k.sample(wo, draw(lobe), Mode::Radiance) else {
                continue;
            };
            let wi = Vec3::from(s.wi);
            if wi.z * wo.z > 0.0 {
                continue;
            }
            let e = k.eval(wo, wi, Mode::Radiance);
            let eta = if wo.z > 0.0 { 1.5 } else { 1.0 / 1.5 };
            let (a, b) = (
                s.weight[0] / (s.eta * s.eta) * s.forward,
                e.f[0] / (eta * eta) * wi.z.abs(),
            );
            assert!((a - b).abs() < 1e-4 * b, "{lobe}: {a} {b}");
        }
    }
}

/// What one part is not, the mixture isn't.
#[test]
fn facts_of_parts_are_passed_on() {
    let of = |a, b| {
        let nested = [("a", part(a, 1.0)), ("b", part(b, 1.0))];
        create_with::<Mix>("{}", &nested).unwrap().traits()
    };
    let both = bsdf_traits::OWN_NORMALS | bsdf_traits::NON_RECIPROCAL;
    assert_eq!(of(0, 0), bsdf_traits::UNIFORM);
    assert_eq!([of(7, 0), of(0, 7), of(7, 7)], [both; 3]);
}

#[test]
fn bodies_have_one_index() {
    let nested = [("a", part(3, 1.5)), ("b", part(3, 1.33))];
    let Err(why) = create_with::<Mix>("{}", &nested) else {
        panic!("accepted");
    };
    assert!(why.contains("1.5 and 1.33"), "{why}");
    let plugin: Mix = create_with("{}", &[("a", part(0, 1.0)), ("b", part(3, 1.33))]).unwrap();
    assert_eq!(plugin.ior(), 1.33);
    assert_eq!(plugin.traits(), bsdf_traits::UNIFORM);
    assert!(create_with::<Mix>("{}", &[("a", part(0, 1.0))]).is_err());
    assert!(create_with::<Mix>(r#"{ "weight": 2 }"#, &nested).is_err());
}
