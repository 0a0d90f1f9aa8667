//! Media.

use super::Stages;
use super::raw::{Failures, RawMedium};
use super::subject::Subject;
use super::variants::Variant;
use crate::failure::{Outcome, input};
use resolvent_api::medium::medium_traits;
use resolvent_api::{Aabb, Medium, Segment, Vec3};
use resolvent_conformance::medium::{along, edges, majorant, segment};
use resolvent_conformance::{Suite, property};
use resolvent_engine::plugin::Instance;

/// Corner to corner, along an axis off the middle, and from inside.
pub fn segments(medium: &impl Medium) -> Vec<Segment> {
    let bounds = match medium.info().bounds {
        b if Vec3::from(b.min).is_finite() && Vec3::from(b.max).is_finite() => b,
        _ => Aabb::new(Vec3::splat(-1.0), Vec3::ONE),
    };
    let (centre, size) = (bounds.centre(), bounds.extent());
    let corner = Vec3::from(bounds.min) - 0.1 * size;
    let side = centre + Vec3::new(-1.0, 0.13, -0.07) * size;
    let inside = centre + Vec3::new(0.11, -0.2, 0.05) * size;
    vec![
        segment(corner, centre + 0.02 * size, 1.3 * size.length()),
        segment(side, side + Vec3::X, 2.0 * size.x),
        segment(
            inside,
            centre + Vec3::new(0.3, 1.0, -0.7) * size,
            0.4 * size.length(),
        ),
    ]
}

/// All statistics, with one set of parameters.
pub fn thorough(suite: &mut Suite, subject: &Subject, v: &Variant, stages: Stages) -> Outcome<()> {
    let instance = subject.make(&v.params).map_err(input)?;
    let failures = Failures::default();
    let medium = RawMedium::new(&instance, &failures);
    let info = medium.info();
    if info.traits & medium_traits::EMPTY != 0 || info.bounds.is_empty() {
        if v.params != subject.base {
            // Some values leave nothing, and that is what they are for.
            return Ok(());
        }
        return Err(input(format!(
            "{} is empty with {}: there is nothing to check; give other parameters with --params",
            subject.plugin.title(),
            v.name
        )));
    }
    stages(property::EDGES, &v.name);
    edges(suite, &v.name, &medium);
    stages(property::MAJORANT, &v.name);
    majorant(suite, &v.name, &medium);
    for (i, s) in segments(&medium).iter().enumerate() {
        stages(property::TRANSMITTANCE, &v.name);
        along(suite, &format!("{}, segment {i}", v.name), &medium, s, None);
    }
    failures.file(suite, &v.name);
    Ok(())
}

/// Possible answers.
pub fn brief(suite: &mut Suite, name: &str, instance: &Instance) {
    let failures = Failures::default();
    let medium = RawMedium::new(instance, &failures);
    if medium.info().traits & medium_traits::EMPTY == 0 && !medium.info().bounds.is_empty() {
        edges(suite, name, &medium);
        majorant(suite, name, &medium);
    }
    failures.file(suite, name);
}
