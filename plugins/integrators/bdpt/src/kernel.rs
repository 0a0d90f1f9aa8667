//! All strategies of a sample.

use resolvent_api::abi::{PixelSample, Tile, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::params::Host;
use resolvent_api::{Output, SceneView};
use resolvent_pathspace::bidirectional::{Bidirectional, NetDraws, Pairs};
use resolvent_pathspace::mis::{Heuristic, MediaDensities};
use resolvent_pathspace::orders::Tally;
use resolvent_pathspace::samples;

/// What paths are made with.
pub struct Kernel<'a> {
    /// The scene.
    pub scene: &'a SceneView<'a>,
    /// Most scattering events of a path.
    pub max_depth: u32,
    /// Mean number of vertices of the light's walk that each of the sensor's is joined to.
    pub connections: f32,
    /// How weights are made.
    pub heuristic: Heuristic,
    /// What they take for media.
    pub media: MediaDensities,
    /// Recompute all paths.
    pub verify: bool,
    /// Where a difference is reported.
    pub host: Host,
    /// Only strategies with this many vertices from the light, and from the sensor.
    pub only: [Option<usize>; 2],
}

impl Kernel<'_> {
    /// Renders a piece of work.
    pub fn tile<const CHROMATIC: bool, T: Tally>(
        &self,
        tile: &Tile,
        out: &mut Output<'_>,
        tally: T,
    ) -> Outcome<()> {
        let [x0, y0, x1, y1] = tile.window;
        let walks = f64::from(x1 - x0) * f64::from(y1 - y0);
        // Without lights worth connecting to (a constant sky around a cloud), scattering finds them.
        let heuristic = if self.connects() {
            self.heuristic
        } else {
            Heuristic::Alone
        };
        let mut paths = Bidirectional::new(walks, heuristic, self.media).verify(self.verify);
        let done = samples::each(tile, out, tally, |out, tally, p| {
            let mut draws = NetDraws::new(tile.seed, p.index, p.sample, self.scene.lanes());
            let wanted = tile.features != 0;
            self.sample::<CHROMATIC, T>(&mut paths, p.pixel, &mut draws, wanted, tally, out)
        });
        if let Some(difference) = paths.difference() {
            self.host.fail(difference);
        }
        done
    }

    fn sample<const CHROMATIC: bool, T: Tally>(
        &self,
        paths: &mut Bidirectional,
        pixel: [u32; 2],
        draws: &mut NetDraws,
        wanted: bool,
        tally: &mut T,
        out: &mut Output<'_>,
    ) -> Outcome<PixelSample> {
        let scene = self.scene;
        // A path of k scattering events has k + 2 vertices.
        let limit = (self.max_depth as usize).saturating_add(2);
        let mut sample = paths.look::<CHROMATIC, _>(scene, pixel, draws, limit, wanted)?;
        if self.connects() {
            // The light's own vertex, and at least one that scatters.
            let limit = limit.saturating_sub(1);
            paths
                .light
                .from_light::<CHROMATIC, _>(scene, draws, limit)?;
        } else {
            paths.light.clear();
        }
        let pairs = Pairs {
            limit,
            connections: self.connections,
            only: self.only,
        };
        paths.every(scene, draws, &pairs, self.connects(), |found| {
            if let Some(film) = found.film {
                return tally.splat(out, film, found.radiance, found.order());
            }
            let light = found.radiance * (1.0 / found.share);
            sample.radiance += light;
            tally.add(found.order(), light);
            Ok(())
        })?;
        Ok(sample)
    }

    fn connects(&self) -> bool {
        self.scene.has(scene_traits::LIGHTS)
    }
}
