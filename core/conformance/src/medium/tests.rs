//! The checks accept tracking through a medium that is right, and reject the mistakes they are made for.

use super::*;
use crate::Moments;
use resolvent_api::medium::medium_traits;
use resolvent_api::tracking::{Tracked, Transmittance};
use resolvent_api::{Aabb, Cell, Coefficients, Field, Lanes, MediumInfo};

/// Extinction that rises linearly along x through the unit cube, in cells of an eighth, with bounds as loose as one likes.
#[derive(Clone, Copy)]
struct Ramp<L> {
    top: L,
    /// Majorant over the largest extinction in a cell, minorant over the smallest.
    majorant: f32,
    minorant: f32,
    glow: f32,
}

struct Walk {
    o: Vec3,
    d: Vec3,
    t: f32,
    end: f32,
}

impl<L: Lanes> Ramp<L> {
    fn sigma(&self, x: f32) -> L {
        self.top * x.clamp(0.0, 1.0)
    }
    fn albedo() -> Spectrum {
        Spectrum::rgb(0.9, 0.5, 0.2)
    }
}

impl<L: Lanes> Field for Ramp<L> {
    type Lanes = L;
    const EMISSIVE: bool = true;
    type Cursor<'a> = Walk;

    fn info(&self) -> MediumInfo {
        let grey = if L::CHROMATIC { 0 } else { medium_traits::GREY };
        MediumInfo {
            bounds: Aabb::new(Vec3::ZERO, Vec3::ONE),
            traits: grey | medium_traits::EMISSIVE,
            sigma_max: self.top.spectrum(),
            ..MediumInfo::default()
        }
    }
    fn enter(&self, s: &Segment) -> Option<Walk> {
        let (o, d) = (Vec3::from(s.o), Vec3::from(s.d));
        let (t, end) = self.info().bounds.clip(o, d, s.t0, s.t1)?;
        Some(Walk { o, d, t, end })
    }
    fn next_cell(&self, c: &mut Walk) -> Option<Cell<L>> {
        if !(c.t < c.end) {
            return None;
        }
        let x = |t: f32| c.o.x + t * c.d.x;
        // The cell a little ahead, and where the ray leaves it.
        let ahead = x(c.t) * 8.0 + 1e-3 * c.d.x.signum();
        let low = ahead.floor();
        let border = if c.d.x > 0.0 { low + 1.0 } else { low };
        let mut t1 = (border / 8.0 - c.o.x) / c.d.x;
        if !(t1 > c.t && t1 < c.end) {
            t1 = c.end;
        }
        let cell = Cell {
            t0: c.t,
            t1,
            majorant: self.sigma((low + 1.002) / 8.0) * self.majorant,
            minorant: self.sigma((low - 0.002) / 8.0) * self.minorant,
        };
        c.t = t1;
        Some(cell)
    }
    fn extinction(&self, c: &mut Walk, t: f32, _: u64) -> L {
        self.sigma(c.o.x + t * c.d.x)
    }
    fn collision(&self, c: &mut Walk, t: f32, known: Option<L>, _: bool) -> (Spectrum, Spectrum) {
        let sigma = known.unwrap_or_else(|| self.extinction(c, t, 0)).spectrum();
        (sigma, sigma * Self::albedo())
    }
    fn emission(&self, c: &mut Walk, t: f32) -> Spectrum {
        Spectrum::rgb(1.0, 2.0, 0.5) * (self.glow * (c.o.y + t * c.d.y))
    }
    fn coefficients(&self, p: Vec3) -> Coefficients {
        if !self.info().bounds.contains(p) {
            return Coefficients::default();
        }
        let sigma = self.sigma(p.x).spectrum();
        Coefficients {
            sigma_t: sigma,
            sigma_s: sigma * Self::albedo(),
            emission: Spectrum::rgb(1.0, 2.0, 0.5) * (self.glow * p.y),
        }
    }
}

fn ramp<L: Lanes>(top: L, majorant: f32, minorant: f32) -> Ramp<L> {
    Ramp {
        top,
        majorant,
        minorant,
        glow: 1.0,
    }
}

fn ways() -> [Segment; 2] {
    [
        segment(Vec3::new(-0.5, 0.3, 0.2), Vec3::new(1.0, 0.6, 0.7), 4.0),
        segment(Vec3::new(0.9, 0.1, 0.5), Vec3::new(0.2, 0.8, 0.4), 3.0),
    ]
}

fn findings(medium: &impl Medium, ways: &[Segment]) -> Vec<String> {
    let mut suite = Suite::new();
    check(&mut suite, "ramp", medium, ways, 1e-5);
    suite.rejected(1e-3)
}

#[test]
fn tracking_is_unbiased() {
    let colours = Spectrum::rgb(0.7, 2.0, 6.0);
    // Tight and twice too loose majorants; no minorant, a tight one, half of one.
    for (majorant, minorant) in [(1.0, 0.0), (2.0, 0.0), (1.0, 1.0), (1.5, 0.5)] {
        for transmittance in [Transmittance::Ratio, Transmittance::Survival] {
            let grey = Tracked {
                field: ramp(3.0f32, majorant, minorant),
                transmittance,
            };
            let colour = Tracked {
                field: ramp(colours, majorant, minorant),
                transmittance,
            };
            let (grey, colour) = (findings(&grey, &ways()), findings(&colour, &ways()[..1]));
            let what = format!("{majorant}, {minorant}, {transmittance:?}");
            assert!(grey.is_empty(), "grey {what}: {:#?}", &grey[..1]);
            assert!(colour.is_empty(), "colour {what}: {:#?}", &colour[..1]);
        }
    }
}

/// A medium with a mistake.
struct Wrong<F: Fn(&mut Flight, bool)>(Tracked<Ramp<Spectrum>>, F);

impl<F: Fn(&mut Flight, bool) + Send + Sync> Medium for Wrong<F> {
    fn info(&self) -> MediumInfo {
        self.0.info()
    }
    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        let mut f = self.0.sample(s, u);
        (self.1)(&mut f, true);
        f
    }
    fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight {
        let mut f = self.0.transmit(s, u);
        (self.1)(&mut f, false);
        f
    }
    fn depth(&self, s: &Segment) -> Spectrum {
        self.0.depth(s)
    }
    fn coefficients(&self, p: Vec3) -> Coefficients {
        self.0.coefficients(p)
    }
}

#[test]
fn mistakes_are_found() {
    let caught = |word: &str, mistake: fn(&mut Flight, bool)| {
        let field = ramp(Spectrum::rgb(0.7, 2.0, 4.0), 1.5, 0.5);
        let transmittance = Transmittance::Ratio;
        let wrong = Wrong(
            Tracked {
                field,
                transmittance,
            },
            mistake,
        );
        let found = findings(&wrong, &ways()[..1]);
        assert!(
            found.iter().any(|f| f.contains(word)),
            "'{word}' passes: {found:?}"
        );
    };
    caught("survival", |f, _| f.value[2] *= 1.1);
    caught("connection", |f, sampled| {
        if !sampled {
            f.value *= 0.95;
        }
    });
    // The density of the other technique matters to nothing but the heuristic over both.
    caught("by both", |f, sampled| {
        if sampled {
            f.ratio *= 1.5;
        }
    });
    caught("collisions", |f, _| f.sigma_s[0] *= 0.9);
    caught("emission of lane 1", |f, _| f.emitted[1] *= 1.05);
    caught("where lane", |f, sampled| {
        if sampled && f.collided() {
            f.t *= 0.9;
        }
    });
    caught("from both ends", |f, sampled| {
        if sampled && f.collided() {
            f.track[1] *= 1.5;
        }
    });
    caught("NaN", |f, _| f.value[0] = f32::NAN);
}

#[test]
fn a_majorant_that_is_too_small_is_found() {
    let wrong = Tracked {
        field: ramp(3.0f32, 0.8, 0.0),
        transmittance: Transmittance::Ratio,
    };
    let found = findings(&wrong, &ways()[..1]);
    assert!(found.iter().any(|f| f.contains("majorant")), "{found:?}");
}

/// Ratio tracking is right nevertheless: its points may have any rate. Where the extinction is 2.5 times its majorant, weights are negative.
#[test]
fn ratio_tracking_allows_for_majorants_that_are_too_small() {
    let mut suite = Suite::new();
    for (majorant, minorant) in [(0.8, 0.0), (0.4, 0.0), (0.9, 0.5)] {
        let grey = ramp(3.0f32, majorant, minorant);
        let colours = ramp(Spectrum::rgb(0.7, 2.0, 4.0), majorant, minorant);
        let transmittance = Transmittance::Ratio;
        let grey: &dyn Medium = &Tracked {
            field: grey,
            transmittance,
        };
        let colours: &dyn Medium = &Tracked {
            field: colours,
            transmittance,
        };
        for (name, medium, top) in [("grey", grey, 3.0), ("colours", colours, 0.7)] {
            let s = ways()[0];
            let (mut all, mut negative, mut violations) = (Moments::default(), 0, 0);
            for i in 0..200_000 {
                let u = draws(77, i, Spectrum::ONE);
                let f = medium.transmit(&s, &u);
                let density = f.ratio.mean(u.lanes);
                all.add(f64::from(f.value[0] / density));
                negative += u32::from(f.value[0] < 0.0);
                violations += f.violations;
            }
            // ∫ top x dt where the segment is inside of the unit cube, x = x0 + t d.
            let (o, d) = (Vec3::from(s.o), Vec3::from(s.d));
            let inside = Aabb::new(Vec3::ZERO, Vec3::ONE).clip(o, d, s.t0, s.t1);
            let (a, b) = inside.unwrap_or_else(|| panic!("it passes by"));
            let x = |t: f32| f64::from(o.x + t * d.x);
            let depth = top * f64::from(b - a) * 0.5 * (x(a) + x(b));
            let what = format!("{name}, majorant {majorant}, minorant {minorant}");
            assert!(violations > 1000, "{what}: {violations} violations");
            assert!(
                majorant > 0.5 || negative > 1000,
                "{what}: {negative} negative"
            );
            suite.mean(what, &all, (-depth).exp(), 1e-6);
        }
    }
    suite.assert();
}

/// Emission as its expectation, given even when another medium may cut the flight short: right alone, wrong in company.
#[test]
fn expected_emission_is_right_only_alone() {
    struct Expectation(Ramp<f32>);
    impl Medium for Expectation {
        fn info(&self) -> MediumInfo {
            self.0.info()
        }
        fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
            let mut f = resolvent_api::tracking::delta::free_flight::<_, true>(&self.0, s, u);
            let march = March::new(self, s);
            let met = |lane: usize| march.integrate(lane, |n| n.at.emission[lane].into()) as f32;
            let mean = u.prior.mean(u.lanes);
            f.emitted = Spectrum::rgb(met(0), met(1), met(2)) * (1.0 / mean);
            f
        }
        fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight {
            resolvent_api::tracking::ratio::transmit(&self.0, s, u)
        }
        fn depth(&self, s: &Segment) -> Spectrum {
            self.0.depth(s)
        }
        fn coefficients(&self, p: Vec3) -> Coefficients {
            self.0.coefficients(p)
        }
    }
    let medium = Expectation(ramp(3.0f32, 1.5, 0.0));
    let mut suite = Suite::new();
    let truth = March::new(&medium, &ways()[0]);
    let few = 1000;
    emission::with(&mut suite, "e", &medium, &truth, Spectrum::ONE, 1e-5, few);
    let found = suite.rejected(1e-3);
    assert!(found.iter().any(|f| f.contains("beside")), "{found:?}");
    assert!(!found.iter().any(|f| f.contains("as it is")), "{found:?}");
}
