//! A switch for integrators: everything that a path has cached is recomputed from scratch, and held against it.
//!
//! For every path that a strategy gives light, its contribution over the densities of all strategies, each density at which a vertex
//! is found from a neighbour, and the weights of all strategies, which must sum to 1, are computed anew in double precision
//! ([`Path`]): closures are asked again, in both directions, directions come from positions. Only what a delta lobe was sampled with
//! is taken as it was. It costs several times the render; it is for who writes integrators, BSDFs and media.

use super::Bidirectional;
use super::path::{Joint, Path};
use crate::mis::{Heuristic, MediaDensities, Strategies};
use resolvent_api::integrator::{Outcome, Stopped};
use resolvent_api::{SceneView, Spectrum, VertexKind};
use std::fmt::Write;

/// Relative difference that a contribution or a density may have: single precision along some dozen factors, and closures whose
/// forward and reverse agree to three digits.
pub const TOLERANCE: f64 = 2e-3;
/// Difference from 1 that the sum of a path's weights may have.
pub const SUM_TOLERANCE: f64 = 1e-4;
/// How much steeper than a cosine a closure may be: what the rounding of directions is multiplied by.
const STEEPNESS: f64 = 300.0;

/// What was recomputed so far.
#[derive(Clone, Debug, Default)]
pub struct Verified {
    /// Paths.
    pub paths: u64,
    /// Sums of weights that are off by more than 1e-6.
    pub loose: u64,
    /// Largest differences of contributions, of densities, and of a sum of weights from 1, as shares of what was allowed there.
    pub worst: [f64; 3],
    /// The first difference beyond the tolerance.
    pub mismatch: Option<String>,
}

impl Bidirectional {
    /// From now on, every path is recomputed; a difference beyond [`TOLERANCE`] stops the render and is described in
    /// [`Verified::mismatch`]. The heuristic must weigh strategies.
    pub fn verify(mut self, wanted: bool) -> Self {
        if wanted && self.heuristic != Heuristic::Alone {
            self.verified = Some(Verified::default());
        }
        self
    }

    /// The first difference found, in words.
    pub fn difference(&self) -> Option<&str> {
        self.verified.as_ref()?.mismatch.as_deref()
    }

    /// Recomputes the path of strategy (s, t), which gave `value`; `survival` is what the connection's roulette multiplied that by.
    #[cold]
    pub(super) fn check(
        &mut self,
        scene: &SceneView<'_>,
        [s, t]: [usize; 2],
        joint: Joint,
        value: Spectrum,
        survival: f64,
    ) -> Outcome<()> {
        let mut verified = self.verified.take().unwrap_or_default();
        let mut survival = survival;
        if s > 1 {
            survival *= self.light.nodes()[s - 1].survival;
        }
        if t > 1 {
            let nodes = self.sensor.nodes();
            survival *= nodes[t - 1].survival * f64::from(nodes[0].beta.f[0]);
        }
        let path = Path::of(self, s, t, &joint);
        let found = self.compare(scene, [s, t], &path, value, survival, &mut verified)?;
        verified.paths += 1;
        if let Some(what) = found {
            let text = format!(
                "verify: strategy (s {s}, t {t}) of the path {}: {what}",
                describe(&path)
            );
            verified.mismatch.get_or_insert(text);
        }
        let broken = verified.mismatch.is_some();
        self.verified = Some(verified);
        if broken { Err(Stopped) } else { Ok(()) }
    }

    /// What differs, if anything.
    fn compare(
        &self,
        scene: &SceneView<'_>,
        [s, t]: [usize; 2],
        path: &Path,
        value: Spectrum,
        survival: f64,
        verified: &mut Verified,
    ) -> Outcome<Option<String>> {
        let (n, lanes) = (s + t - 1, scene.lanes());
        let walks = self.strategies.light_walks;
        let slack = STEEPNESS * path.rounding();
        // The densities as cached.
        let own = path.densities(scene, s, walks, self.media)?;
        let (mut worst, mut which) = (0.0, String::new());
        let mut hold = |what: &str, i: usize, cached: f64, exact: f64| {
            // Strategies that cannot be need no densities.
            let size = cached.abs().max(exact.abs());
            let off = (cached - exact).abs() / size.max(f64::MIN_POSITIVE);
            if size > 0.0 && off > worst {
                worst = off;
                which = format!(
                    "the density of x{i} as found from {what} is {cached:e}, recomputed {exact:e}"
                );
            }
        };
        let cached = &self.strategies;
        for i in 0..n {
            // What the light's vertex is found with by a walk from there counts once there is such a walk.
            hold(
                "the light's side",
                i,
                cached.from_light[i],
                own.from_light[i],
            );
            hold(
                "the sensor's side",
                i,
                cached.from_sensor[i],
                own.from_sensor[i],
            );
        }
        if n > 1 {
            hold(
                "the next vertex, as light chosen,",
                0,
                cached.chosen,
                own.chosen,
            );
        }
        verified.worst[1] = f64::max(verified.worst[1], worst / (TOLERANCE + slack));
        if worst > TOLERANCE + slack {
            return Ok(Some(format!(
                "{which}: {}",
                apart(worst, TOLERANCE + slack)
            )));
        }

        // What the path carries.
        let f = path.contribution(scene)?;
        let (divisor, log) = self.divisor(scene, [s, t], path, &own)?;
        let scale = (f.log - log).exp() / divisor;
        for lane in 0..lanes as usize {
            let (cached, exact) = (f64::from(value[lane]) / survival, f.lanes[lane] * scale);
            let off = (cached - exact).abs() / cached.abs().max(exact.abs()).max(f64::MIN_POSITIVE);
            verified.worst[0] = f64::max(verified.worst[0], off / (TOLERANCE + slack));
            if off > TOLERANCE + slack {
                return Ok(Some(format!(
                    "its weighted contribution in lane {lane} is {cached:e}, recomputed {exact:e}: {}",
                    apart(off, TOLERANCE + slack)
                )));
            }
        }

        // The weights of all strategies, each with densities asked for along its own walks.
        let relative = path.track(scene, self.media)?.spectrum();
        let mut sum = 0.0;
        for k in 0..=n {
            let d = if k == s {
                own.clone()
            } else {
                path.densities(scene, k, walks, self.media)?
            };
            if d.can(k) {
                sum += d.weight(k, relative, lanes, self.heuristic);
            }
        }
        let off = (sum - 1.0).abs();
        verified.loose += u64::from(off > 1e-6);
        verified.worst[2] = f64::max(verified.worst[2], off / (SUM_TOLERANCE + slack));
        Ok((off > SUM_TOLERANCE + slack).then(|| {
            format!(
                "the weights of all strategies sum to {sum}: {}",
                apart(off, SUM_TOLERANCE + slack)
            )
        }))
    }

    /// What strategy (s, t) divides the contribution by, and the logarithm of a further factor.
    fn divisor(
        &self,
        scene: &SceneView<'_>,
        [s, t]: [usize; 2],
        path: &Path,
        own: &Strategies,
    ) -> Outcome<(f64, f64)> {
        let (n, lanes) = (s + t - 1, scene.lanes());
        let start = if s == 1 { own.chosen } else { 1.0 };
        let walked = if s > 1 { &own.from_light[..s] } else { &[] };
        let found = walked.iter().chain(&own.from_sensor[s..n]);
        let grey = start.ln() + found.map(|p| p.ln()).sum::<f64>();
        let track = path.track(scene, MediaDensities::Exact)?;
        let exact = match self.media {
            MediaDensities::Exact => own.divisor(s, track.spectrum(), lanes, self.heuristic),
            MediaDensities::Depth => {
                let plain = path.densities(scene, s, own.light_walks, MediaDensities::Exact)?;
                let smooth = path.track(scene, MediaDensities::Depth)?.spectrum();
                plain.divisor(s, track.spectrum(), lanes, Heuristic::Alone)
                    / own.weight(s, smooth, lanes, self.heuristic)
            }
        };
        Ok((exact, track.log + grey))
    }
}

fn apart(off: f64, allowed: f64) -> String {
    format!("they differ by {off:.1e}, {allowed:.1e} are allowed")
}

/// Most vertices at either end of a path that are described.
const DESCRIBED: usize = 6;

/// The vertices, for people.
fn describe(path: &Path) -> String {
    let mut out = String::new();
    let n = path.vertices.len();
    for (i, v) in path.vertices.iter().enumerate() {
        if (DESCRIBED..n.saturating_sub(DESCRIBED)).contains(&i) {
            if i == DESCRIBED {
                let _ = write!(out, " - ({} more)", n - 2 * DESCRIBED);
            }
            continue;
        }
        let kind = if v.is(VertexKind::Sensor) {
            "sensor"
        } else if v.is(VertexKind::Emitter) {
            "light"
        } else if v.is(VertexKind::Medium) {
            "medium"
        } else if path.is_delta(i) {
            "specular surface"
        } else {
            "surface"
        };
        let [x, y, z] = v.p;
        let place = if v.is_infinite() { "towards" } else { "at" };
        let gap = if i == 0 { "" } else { " - " };
        let _ = write!(out, "{gap}x{i} {kind} {place} ({x}, {y}, {z})");
    }
    out
}
