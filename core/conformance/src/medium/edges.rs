//! Segments that break media: axis-parallel, grazing, tiny, infinite, far away.

use super::{LANES, draws, inspect};
use crate::{Suite, property};
use resolvent_api::medium::medium_traits;
use resolvent_api::rng::Stream;
use resolvent_api::{Aabb, Medium, Segment, Spectrum, Vec3};

/// Every answer must be possible: finite, not negative, inside the segment, never above the majorant; the facts the medium
/// states about itself must hold.
pub fn edges(suite: &mut Suite, name: &str, medium: &impl Medium) {
    suite.about(property::FACTS);
    let info = medium.info();
    suite.claim(!info.bounds.is_empty(), || format!("{name}: empty bounds"));
    let unbounded = !Vec3::from(info.bounds.min).is_finite();
    let (centre, extent) = place(medium);
    suite.about(property::EDGES);
    for (i, s) in nasty(centre, extent).iter().enumerate() {
        for k in 0..200 {
            let u = draws(7, k, Spectrum::ONE);
            let (a, b) = (medium.sample(s, &u), medium.transmit(s, &u));
            // What happened must have had a density: that of free flight, or that of connections.
            let hero = u.hero as usize;
            for (f, density) in [(a, a.track[hero]), (b, b.ratio[hero])] {
                inspect(suite, &f, s, || format!("{name}: edge {i}"));
                let bright = f.emitted.is_finite() || (unbounded && s.t1 == f32::INFINITY);
                suite.claim(density > 0.0 && bright, || {
                    format!("{name}: edge {i} {s:?}: impossible: {f:?}")
                });
            }
        }
        let depth = medium.depth(s);
        let finite = depth.is_finite() || s.t1 == f32::INFINITY;
        suite.claim(finite && depth.0.iter().all(|&d| d >= 0.0), || {
            format!("{name}: edge {i} {s:?} has depth {depth:?}")
        });
    }
    // No answer to these is right or wrong, but there must be one.
    for bad in [f32::NAN, f32::INFINITY, 1e38] {
        let s = Segment {
            o: [bad, 0.0, 0.0],
            t0: 0.0,
            d: [1.0, 0.0, 0.0],
            t1: 1.0,
        };
        for s in [
            s,
            Segment {
                o: [0.0; 3],
                d: [bad; 3],
                ..s
            },
            Segment {
                o: [0.0; 3],
                t1: bad,
                ..s
            },
        ] {
            let u = draws(8, 0, Spectrum::ONE);
            medium.sample(&s, &u);
            medium.transmit(&s, &u);
            medium.depth(&s);
        }
        medium.coefficients(Vec3::splat(bad));
    }
    facts(suite, name, medium, centre, extent);
}

/// Middle and size of a medium; of the cube from −1 to 1 if it fills all space.
pub(super) fn place(medium: &impl Medium) -> (Vec3, Vec3) {
    let bounds = match medium.info().bounds {
        b if Vec3::from(b.min).is_finite() => b,
        _ => Aabb::new(Vec3::splat(-1.0), Vec3::ONE),
    };
    (bounds.centre(), bounds.extent())
}

fn nasty(centre: Vec3, extent: Vec3) -> Vec<Segment> {
    let size = extent.max_element();
    let mut out = Vec::new();
    let mut add = |o: Vec3, d: Vec3, t0: f32, t1: f32| {
        out.push(Segment {
            o: o.into(),
            t0,
            d: d.into(),
            t1,
        })
    };
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for d in [axis, -axis] {
            // From outside through the centre, from inside, in a face, past the body, and from very far.
            add(centre - 2.0 * size * d, d, 0.0, 5.0 * size);
            add(centre - 2.0 * size * d, d, 0.0, f32::INFINITY);
            add(centre, d, 0.0, size);
            add(centre, d, 0.0, f32::MIN_POSITIVE);
            let side = Vec3::new(axis.y, axis.z, axis.x) * extent * 0.5;
            add(centre + side - 2.0 * size * d, d, 0.0, 5.0 * size);
            add(centre + 3.0 * side - 2.0 * size * d, d, 0.0, 5.0 * size);
            add(centre - 1e5 * size * d, d, 0.0, 2e5 * size);
        }
    }
    let corner = centre + 0.5 * extent;
    let diagonal = extent.normalize_or(Vec3::X);
    add(corner, diagonal, 0.0, size);
    add(corner, -diagonal, 0.0, f32::INFINITY);
    add(centre - size * diagonal, diagonal, size, size.next_up());
    let skew = Vec3::new(0.48, -0.6, 0.64);
    add(centre - size * skew, skew, 0.3 * size, 1.4 * size);
    add(centre - size * skew, skew, 100.0 * size, f32::INFINITY);
    out
}

/// Bounds, and the traits that promise something about coefficients.
fn facts(suite: &mut Suite, name: &str, medium: &impl Medium, centre: Vec3, extent: Vec3) {
    suite.about(property::FACTS);
    let info = medium.info();
    let has = |bit: u32| info.traits & bit != 0;
    let mut stream = Stream::new(0xfac7);
    for _ in 0..suite.samples(20_000) {
        let u = Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let p = centre + (u - 0.5) * extent * 1.05;
        let c = medium.coefficients(p);
        for lane in 0..LANES as usize {
            let (t, s, j) = (c.sigma_t[lane], c.sigma_s[lane], c.emission[lane]);
            let possible = t >= 0.0 && t.is_finite() && s >= 0.0 && j >= 0.0;
            suite.claim(possible, || format!("{name}: {c:?} at {p}"));
            suite.claim_about(property::ENERGY, s <= t * 1.000_01, || {
                format!("{name}: scatters more than it extinguishes, {c:?} at {p}")
            });
            suite.claim(j == 0.0 || has(medium_traits::EMISSIVE), || {
                format!("{name}: emission {j} at {p} without the trait")
            });
            suite.claim(s == 0.0 || !has(medium_traits::ABSORBS_ONLY), || {
                format!("{name}: scatters at {p}, but says it only absorbs")
            });
        }
        suite.claim(
            c.sigma_t.is_grey(LANES) || !has(medium_traits::GREY),
            || format!("{name}: lanes differ at {p}, but it says it is grey"),
        );
        suite.claim(
            info.bounds.contains(p) || (c.sigma_t.is_zero() && c.emission.is_zero()),
            || format!("{name}: something outside its bounds at {p}"),
        );
    }
}
