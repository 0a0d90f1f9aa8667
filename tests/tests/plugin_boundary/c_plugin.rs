//! A plugin in C.

use crate::build::{c_output, c_phase};
use crate::drive::{EDGE, Picture, fault, haze, picture, registry, says};
use resolvent_api::abi::*;
use resolvent_api::math::Frame;
use resolvent_api::operator::{ScatterDraws, ScatterEval, ScatterSample};
use resolvent_api::phase::MediumPoint;
use resolvent_api::{
    Closure, Coefficients, Flight, FlightDraws, MediumInfo, Segment, SurfacePoint,
};
use resolvent_tests::ztest::{sidak, z_test};
use serde_json::{Value, json};
use std::mem::offset_of;

/// Samples per pixel: enough for standard errors of 0.2 % in a block.
const SAMPLES: u32 = 128;

fn with_phase(phase: Value, seed: i64) -> Picture {
    let mut s = haze("none");
    s["media"]["haze"]["params"]["phase"] = phase;
    // Another camera position off the axis would change the picture; other random numbers do not.
    s["sampling"]["seed"] = seed.into();
    picture(&s, &registry(), SAMPLES).unwrap_or_else(|f| panic!("{}", f.text))
}

/// Largest deviation between blocks of two pictures, in standard errors, and the level for as many tests.
fn farthest(a: &Picture, b: &Picture) -> (f64, f64) {
    let (mut least, mut tests) = (1.0f64, 0);
    for y in (0..EDGE).step_by(8) {
        for x in (0..EDGE).step_by(8) {
            let block = [x, y, x + 8, y + 8];
            let ((m, e), (n, f)) = (a.block(1, block), b.block(1, block));
            // Where only the uniform environment is seen there is no noise and nothing to tell.
            if e > 0.0 || f > 0.0 {
                assert!(e.hypot(f) < 0.02 * n, "{e} {f} {n}");
                least = least.min(z_test(m, e.hypot(f), n, 1e-6).p);
                tests += 1;
            }
        }
    }
    assert!(tests >= 4);
    (least, sidak(1e-3, tests))
}

/// Isotropic scattering in C is the isotropic plugin, block by block; scattering that leans forward is not, so the comparison
/// would see a difference.
#[test]
fn a_phase_function_in_c_renders_as_the_one_in_rust() {
    let library = c_phase("linear", &[]);
    let of = |a: f64| with_phase(json!({ "plugin": library, "params": { "a": a } }), 1);
    let reference = with_phase(json!("isotropic"), 1);
    let same = of(0.0);
    assert!(same.counters.collisions > 10_000);
    assert_ne!(same.pixels, reference.pixels, "the paths should differ");
    let (p, level) = farthest(&same, &reference);
    assert!(p > level, "p = {p:.1e}, level {level:.1e}");
    let (p, level) = farthest(&of(1.0), &reference);
    assert!(p < level, "p = {p:.1e}, level {level:.1e}");
}

/// A C plugin's reasons arrive; without one that is said.
#[test]
fn a_c_plugin_says_why_it_fails() {
    let library = c_phase("linear_why", &[]);
    for (a, word) in [
        (0.125, "an eighth is not to its taste"),
        (0.25, "failed without saying why"),
    ] {
        let mut s = haze("none");
        s["media"]["haze"]["params"]["phase"] = json!({ "plugin": library, "params": { "a": a } });
        let title = format!("phase plugin 'linear' ({})", library.display());
        says(
            &fault(&s).text,
            &["$.media.haze.params.phase", &title, word],
        );
    }
}

/// Every size and offset of the C header.
#[test]
fn layouts_agree() {
    macro_rules! sizes {
        ($($name:literal: $t:ty { $($field:literal = $rust:ident),* }),* $(,)?) => {
            [$(($name.to_owned(), size_of::<$t>()), $((format!("{}.{}", $name, $field), offset_of!($t, $rust)),)*)*]
        };
    }
    let expected = sizes! {
        "text": Text {},
        "header": PluginHeader {
            "abi_major" = abi_major, "size" = size, "kind" = kind, "name" = name, "version" = version, "summary" = summary,
            "params" = params, "param_count" = param_count, "param_size" = param_size, "table" = table
        },
        "param_decl": ParamDecl {
            "default_" = default, "choices" = choices, "min" = min, "kind" = kind, "flags" = flags
        },
        "param": ParamValue {
            "kind" = kind, "count" = count, "numbers" = numbers, "text" = text, "header" = header, "instance" = instance
        },
        "host": HostTable {
            "ctx" = ctx, "log" = log, "fail" = fail, "parallel_for" = parallel_for, "texture" = texture, "texture_at" = texture_at
        },
        "create_args": CreateArgs { "params" = params, "host" = host, "to_world" = to_world, "lanes" = lanes },
        "scatter_draws": ScatterDraws {},
        "scatter_eval": ScatterEval { "forward" = forward },
        "scatter_sample": ScatterSample {
            "wi" = wi, "eta" = eta, "forward" = forward, "measure" = measure, "lobe" = lobe
        },
        "scatter_table": ScatterTable { "eval" = eval, "sample" = sample, "lobes" = lobes, "eta" = eta },
        "closure": Closure {},
        "medium_point": MediumPoint { "lanes" = lanes },
        "surface_point": SurfacePoint {
            "ng" = ng, "frame" = frame, "uv" = uv, "lanes" = lanes, "outside_ior" = outside_ior,
            "color" = color, "tangent" = tangent
        },
        "phase_table": PhaseTable { "create" = create, "closure" = closure },
        "bsdf_table": BsdfTable { "traits" = traits, "closure" = closure, "ior" = ior },
        "medium_info": MediumInfo {
            "traits" = traits, "sigma_max" = sigma_max, "memory" = memory, "voxels" = voxels
        },
        "segment": Segment { "t0" = t0, "d" = d, "t1" = t1 },
        "flight_draws": FlightDraws {
            "tau" = tau, "hero" = hero, "flags" = flags, "prior" = prior
        },
        "flight": Flight {
            "ratio" = ratio, "emitted" = emitted, "sigma_s" = sigma_s, "t" = t, "event" = event, "phase" = phase,
            "violations" = violations
        },
        "coefficients": Coefficients { "emission" = emission },
        "medium_table": MediumTable {
            "info" = info, "sample" = sample, "transmit" = transmit, "depth" = depth, "coefficients" = coefficients
        },
    };
    let text: String = expected
        .iter()
        .map(|(name, value)| format!("{name} {value}\n"))
        .collect();
    assert_eq!(c_output("layout.c"), text);
    assert_eq!(size_of::<Frame>(), 36);
}
