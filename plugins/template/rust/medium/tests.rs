//! Tests of the plugin: enough to see a mistake in the bounds or in the density.

use super::*;
use resolvent_api::rng::Stream;

fn ball(sigma_t: f32) -> SoftBall {
    let cube = Extent::cuboid(
        &resolvent_api::Affine::IDENTITY,
        DVec3::splat(-1.0),
        DVec3::ONE,
    );
    // Outside the ball the density is 0, so its bounding cube is an extent as good as the ball.
    let extent = cube.unwrap().unwrap();
    SoftBall {
        extent,
        sigma_t,
        albedo: Spectrum::ONE,
        info: MediumInfo::default(),
    }
}

/// A ray that passes the centre at distance `b`; the optical depth is 4/3 σ h³ with half the chord h = √(1 − b²).
fn ray(b: f32) -> (Segment, f64) {
    let s = Segment {
        o: [-3.0, b, 0.0],
        t0: 0.0,
        d: [1.0, 0.0, 0.0],
        t1: 10.0,
    };
    (s, 4.0 / 3.0 * f64::from(1.0 - b * b).powf(1.5))
}

fn draws(stream: &mut Stream) -> FlightDraws {
    FlightDraws {
        key: stream.bits(),
        tau: stream.uniform(),
        event: stream.uniform(),
        lanes: 3,
        prior: Spectrum::ONE,
        ..FlightDraws::default()
    }
}

#[test]
fn transmittance_is_unbiased() {
    for (sigma_t, b) in [(1.5, 0.0), (4.0, 0.6), (10.0, 0.9)] {
        let m = Tracked {
            field: ball(sigma_t),
            transmittance: Transmittance::Ratio,
        };
        let (s, shape) = ray(b);
        let expected = (-f64::from(sigma_t) * shape).exp();
        let mut stream = Stream::new(1);
        let n = 40_000;
        let (mut survived, mut passed) = (0.0, 0.0);
        for _ in 0..n {
            let f = m.sample(&s, &draws(&mut stream));
            survived += f64::from(1 - f.event);
            let c = m.transmit(&s, &draws(&mut stream));
            passed += f64::from(c.value[0] / c.ratio[0]);
            assert_eq!((f.violations, c.violations), (0, 0));
        }
        // Survival is a coin toss; an unbiased transmittance below 1 varies less.
        let error = (expected * (1.0 - expected) / f64::from(n)).sqrt();
        for mean in [survived / f64::from(n), passed / f64::from(n)] {
            assert!((mean - expected).abs() < 4.0 * error, "{mean}, {expected}");
        }
    }
}

#[test]
fn bounds_hold_on_every_stretch() {
    let field = ball(7.0);
    for b in [0.0, 0.3, 0.6, 0.99] {
        let (s, _) = ray(b);
        let mut passage = field.enter(&s).unwrap();
        while let Some(cell) = field.next_cell(&mut passage) {
            for i in 0..=50 {
                let t = cell.t0 + (cell.t1 - cell.t0) * (i as f32 / 50.0);
                let sigma = field.extinction(&mut passage, t, 0);
                let slack = 1e-5 * field.sigma_t;
                assert!(sigma <= cell.majorant + slack && sigma >= cell.minorant - slack);
            }
        }
    }
}
