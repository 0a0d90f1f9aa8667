//! Tests of the plugin, over a diffuse reflector of its own.

use super::*;
use core::f32::consts::FRAC_1_PI;
use resolvent_api::math::warp;
use resolvent_tests::host::{Nested, create_with};
use resolvent_tests::scatter::{Density, Measured, albedo, directions};
use resolvent_tests::{Moments, Suite};

/// Reflects diffusely; says an index, to see that it is passed on.
#[derive(Clone, Copy)]
struct Clay {
    value: f32,
}

impl Plugin for Clay {
    const NAME: &'static str = "clay";
    const SUMMARY: &'static str = "Reflects diffusely.";
    const PARAMS: &'static [ParamDecl] = &[Decl::float("value", "").default("0.6").build()];
    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            value: params.float("value")? as f32,
        })
    }
}

impl Bsdf for Clay {
    type Closure = Self;
    fn traits(&self) -> u32 {
        bsdf_traits::UNIFORM
    }
    fn ior(&self) -> f32 {
        1.25
    }
    fn closure(&self, _: &SurfacePoint) -> Self {
        *self
    }
}

impl Scatter for Clay {
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        if wo.z * wi.z <= 0.0 {
            return ScatterEval::default();
        }
        ScatterEval {
            f: Spectrum::splat(self.value * FRAC_1_PI),
            forward: wi.z.abs() * FRAC_1_PI,
            reverse: wo.z.abs() * FRAC_1_PI,
        }
    }
    fn sample(&self, wo: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        let w = warp::cosine_hemisphere(u.dir);
        Some(ScatterSample {
            weight: Spectrum::splat(self.value),
            wi: [w.x, w.y, w.z.copysign(wo.z)],
            eta: 1.0,
            forward: w.z * FRAC_1_PI,
            reverse: wo.z.abs() * FRAC_1_PI,
            measure: 0,
            lobe: 3,
        })
    }
    fn lobes(&self) -> u32 {
        lobes::SMOOTH
    }
    fn eta(&self) -> f32 {
        1.25
    }
}

fn mask(params: &str) -> Mask {
    let clay = Nested::bsdf::<Clay>("{}", &[]).unwrap_or_else(|e| panic!("{e}"));
    create_with(params, &[("bsdf", clay)]).unwrap_or_else(|e| panic!("{e}"))
}

fn masked(params: &str) -> Masked {
    mask(params).closure(&SurfacePoint::default())
}

/// Shares, densities and weights of what is met and what passes; the whole is the energy of both.
#[test]
fn shares() {
    let mut suite = Suite::new();
    let k = masked(r#"{ "opacity": 0.3 }"#);
    assert_eq!(k.lobes(), lobes::SMOOTH | lobes::DELTA);
    for wo in directions(6, 5) {
        let density = Density::new(&k, Measured::Bsdf, wo, Vec3::Z, Mode::Radiance);
        suite.close("density", density.total, 0.3, 1e-4, 0.0);
        suite.close("reflected", density.albedo[0], 0.18, 1e-4, 0.0);
        suite.close("energy", albedo(&k, wo, 20_000)[0], 0.18 + 0.7, 1e-3, 0.0);
        let mut passed = Moments::default();
        let mut stream = resolvent_api::rng::Stream::new(1);
        for mode in [Mode::Radiance, Mode::Importance] {
            for _ in 0..20_000 {
                let u = ScatterDraws {
                    lobe: stream.uniform(),
                    dir: stream.uniform2(),
                };
                let Some(s) = k.sample(wo, u, mode) else {
                    suite.claim(false, || "nothing absorbs here".into());
                    continue;
                };
                let discrete = s.measure == Measure::Discrete as u32;
                passed.add(f64::from(u8::from(discrete)));
                let wi = Vec3::from(s.wi);
                if discrete {
                    let same = wi == -wo && s.weight == Spectrum::ONE && s.eta == 1.0;
                    suite.claim(same && s.lobe == PASSED, || format!("{s:?}"));
                    suite.close("p", s.forward.into(), 0.7, 1e-6, 0.0);
                    suite.close("p", s.reverse.into(), 0.7, 1e-6, 0.0);
                } else {
                    let e = k.eval(wo, wi, mode);
                    suite.close("forward", s.forward.into(), e.forward.into(), 1e-5, 0.0);
                    suite.close("reverse", s.reverse.into(), e.reverse.into(), 1e-5, 0.0);
                    let w = e.f[0] * wi.z.abs() / e.forward;
                    suite.close("weight", s.weight[0].into(), w.into(), 1e-5, 0.0);
                }
            }
        }
        suite.mean("passed", &passed, 0.7, 1e-6);
    }
    suite.assert();
}

#[test]
fn the_ends_and_the_cutoff() {
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for (params, opacity) in [
        (r#"{ "opacity": 0 }"#, 0.0),
        ("{}", 1.0),
        (r#"{ "opacity": 0.4, "cutoff": 0.5 }"#, 0.0),
        (r#"{ "opacity": 0.5, "cutoff": 0.5 }"#, 1.0),
        (r#"{ "opacity": 0, "cutoff": 0 }"#, 1.0),
    ] {
        let (plugin, k) = (mask(params), masked(params));
        let gone = opacity == 0.0;
        assert_eq!(plugin.traits() & bsdf_traits::NULL != 0, gone, "{params}");
        assert_eq!(k.lobes(), if gone { lobes::PASSES } else { lobes::SMOOTH });
        for lobe in [0.0, 0.5, 0.999_999] {
            let u = ScatterDraws {
                lobe,
                dir: [0.5; 2],
            };
            let s = k.sample(wo, u, Mode::Radiance).unwrap();
            assert_eq!(s.lobe, if gone { PASSED } else { 3 });
        }
        let f = k.eval(wo, wo, Mode::Radiance).f[0];
        assert!((f - opacity * 0.6 * FRAC_1_PI).abs() < 1e-6);
        assert_eq!((plugin.ior(), k.eta()), (1.25, 1.25));
    }
    assert!(create_with::<Mask>("{}", &[]).is_err());
}

/// A textured opacity is that of the point, after the cutoff; holes are vertices that pass everything.
#[test]
fn opacity_follows_a_texture() {
    let plain = mask(r#"{ "opacity": { "texture": "uv" } }"#);
    let cut = mask(r#"{ "opacity": { "texture": "uv" }, "cutoff": 0.5 }"#);
    assert_eq!((plain.traits(), cut.traits()), (0, 0));
    for (u, after) in [(0.0, 0.0), (0.25, 0.0), (0.5, 1.0), (1.0, 1.0)] {
        let at = SurfacePoint {
            uv: [u, 0.9],
            ..SurfacePoint::default()
        };
        assert_eq!(plain.closure(&at).opacity, u);
        assert_eq!(cut.closure(&at).opacity, after);
    }
    let hole = plain.closure(&SurfacePoint::default());
    assert_eq!(hole.lobes(), lobes::DELTA);
    let s = hole
        .sample(Vec3::Z, ScatterDraws::default(), Mode::Radiance)
        .unwrap();
    assert_eq!((s.wi, s.forward), ([0.0, 0.0, -1.0], 1.0));
}
