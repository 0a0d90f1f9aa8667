//! The SDK's nested closures, tested with BSDFs of several sizes.

use crate::host::{Nested, create_with};
use resolvent_api::operator::lobes;
use resolvent_api::{
    Bsdf, Decl, Error, Mode, NestedBsdf, NestedClosures, ParamDecl, Params, Plugin, Scatter,
    ScatterDraws, ScatterEval, ScatterSample, Spectrum, SurfacePoint, Vec3,
};

/// Says its numbers: a closure of `BYTES` bytes and 8 more.
#[derive(Clone, Copy)]
struct Herald<const BYTES: usize> {
    value: f32,
    at: f32,
    fill: [u8; BYTES],
}

impl<const BYTES: usize> Plugin for Herald<BYTES> {
    const NAME: &'static str = "herald";
    const SUMMARY: &'static str = "Says its numbers.";
    const PARAMS: &'static [ParamDecl] = &[Decl::float("value", "").default("1").build()];
    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let value = params.float("value")? as f32;
        Ok(Self {
            value,
            at: 0.0,
            fill: [value as u8; BYTES],
        })
    }
}

impl<const BYTES: usize> Bsdf for Herald<BYTES> {
    type Closure = Self;
    fn traits(&self) -> u32 {
        0
    }
    fn ior(&self) -> f32 {
        1.0 + self.value
    }
    fn closure(&self, at: &SurfacePoint) -> Self {
        assert!(self.value < 100.0, "out of voice");
        Self {
            at: at.uv[0],
            ..*self
        }
    }
}

impl<const BYTES: usize> Scatter for Herald<BYTES> {
    fn eval(&self, _: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        let fill = f32::from(self.fill[BYTES - 1]);
        ScatterEval {
            f: Spectrum([self.value, self.at, fill, mode as u32 as f32]),
            forward: wi.x,
            reverse: wi.y,
        }
    }
    fn sample(&self, _: Vec3, u: ScatterDraws, _: Mode) -> Option<ScatterSample> {
        (u.lobe < 0.5).then(|| ScatterSample {
            eta: self.value,
            ..ScatterSample::default()
        })
    }
    fn lobes(&self) -> u32 {
        lobes::DELTA
    }
    fn eta(&self) -> f32 {
        0.5 * self.value
    }
}

/// Nests two.
struct Pair([NestedBsdf; 2]);

impl Plugin for Pair {
    const NAME: &'static str = "pair";
    const SUMMARY: &'static str = "Nests two.";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::plugin("a", "bsdf", "").required().build(),
        Decl::plugin("b", "bsdf", "").required().build(),
    ];
    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let get = |name: &str| params.bsdf(name)?.ok_or_else(|| Error::new("none"));
        Ok(Self([get("a")?, get("b")?]))
    }
}

fn pair(a: Nested, b: Nested) -> Pair {
    create_with(r#"{}"#, &[("a", a), ("b", b)]).unwrap()
}

fn herald<const BYTES: usize>(value: u32) -> Nested {
    Nested::bsdf::<Herald<BYTES>>(&format!(r#"{{ "value": {value} }}"#), &[]).unwrap()
}

fn point(u: f32) -> SurfacePoint {
    SurfacePoint {
        uv: [u, 0.0],
        ..SurfacePoint::default()
    }
}

/// Every answer is that of the nested closure, held inline or not.
#[test]
fn nested_closures_answer_for_themselves() {
    let small = |v| herald::<8>(v);
    let (large, huge) = (|v| herald::<200>(v), |v| herald::<488>(v));
    for (a, b, inline) in [
        (small(3), small(7), [true, true]),
        (large(3), large(7), [true, true]),
        // Beside 208 bytes there is no room for 496 in 432; then the point needs 80.
        (large(3), huge(7), [true, false]),
        (huge(3), large(7), [false, true]),
        (huge(3), huge(7), [false, false]),
    ] {
        let p = pair(a, b);
        assert_eq!(p.0.map(|n| n.ior()), [4.0, 8.0]);
        let held = NestedClosures::<2, 54>::resolve(p.0, &point(0.25));
        assert_eq!([held.is_inline(0), held.is_inline(1)], inline);
        for (i, value) in [3.0, 7.0].into_iter().enumerate() {
            let e = held.eval(i, Vec3::Z, Vec3::new(0.5, 0.125, 0.0), Mode::Importance);
            assert_eq!(e.f, Spectrum([value, 0.25, value, 1.0]));
            assert_eq!((e.forward, e.reverse), (0.5, 0.125));
            assert_eq!((held.lobes(i), held.eta(i)), (lobes::DELTA, 0.5 * value));
            let mut u = ScatterDraws::default();
            let s = held.sample(i, Vec3::Z, u, Mode::Radiance).unwrap();
            assert_eq!(s.eta, value);
            u.lobe = 0.75;
            assert!(held.sample(i, Vec3::Z, u, Mode::Radiance).is_none());
        }
    }
}

#[test]
#[should_panic(expected = "a nested BSDF failed")]
fn a_panic_inside_is_not_swallowed() {
    let p = pair(herald::<8>(3), herald::<8>(200));
    NestedClosures::<2, 54>::resolve(p.0, &point(0.0));
}
