//! One chain.

use resolvent_api::abi::{Tile, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::rng::{Stream, derive, mix};
use resolvent_api::{Output, SceneView, Spectrum};
use resolvent_pathspace::bidirectional::{Bidirectional, Draws, End, NetDraws};
use resolvent_pathspace::chain::{Chain, Sizes};
use resolvent_pathspace::mis::{Heuristic, MediaDensities};
use resolvent_pathspace::orders::Tally;
use resolvent_pathspace::sampler::Purpose;
use resolvent_pathspace::samples;

/// Parameters.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Most scattering events of a path.
    pub max_depth: u32,
    /// Share of large steps.
    pub large_steps: f32,
    /// Standard deviations of small steps.
    pub sizes: Sizes,
    /// Each number of scattering events is proposed this much less often than the one before.
    pub ratio: f64,
    /// Independent paths for each step.
    pub seeds: f64,
    /// Recompute all paths.
    pub verify: bool,
}

/// What a state of the chain carries to the film.
#[derive(Clone, Copy, Debug)]
struct Sample {
    film: [f32; 2],
    radiance: Spectrum,
    /// How often it was scattered.
    order: usize,
    /// The scalar that the chain follows.
    importance: f64,
}

/// A chain and its storage.
pub struct Kernel<'a> {
    scene: &'a SceneView<'a>,
    settings: Settings,
    paths: Bidirectional,
    chain: Chain,
    /// First film position and extent, margin included.
    corner: [f32; 2],
    extent: [f32; 2],
}

impl<'a> Kernel<'a> {
    /// A chain for a piece of work.
    pub fn new(scene: &'a SceneView<'a>, settings: Settings, tile: &Tile) -> Self {
        let [x0, y0, x1, y1] = tile.window.map(|v| v as f32);
        let m = tile.margin;
        let extent = [x1 - x0 + 2.0 * m, y1 - y0 + 2.0 * m];
        let area = f64::from(extent[0]) * f64::from(extent[1]);
        // Of all strategies of a length, one is tried: that which finds all pixels alike counts `area` times as much.
        let heuristic = if scene.has(scene_traits::LIGHTS) {
            Heuristic::Balance
        } else {
            Heuristic::Alone
        };
        let paths = Bidirectional::new(area, heuristic, MediaDensities::Exact);
        let paths = paths.verify(settings.verify);
        Self {
            scene,
            settings,
            paths,
            chain: Chain::new(settings.sizes, scene.lanes()),
            corner: [x0 - m, y0 - m],
            extent,
        }
    }

    /// What was found to differ when it was recomputed.
    pub fn difference(&self) -> Option<&str> {
        self.paths.difference()
    }

    /// Renders a piece of work: as many steps as it has samples.
    pub fn piece<const CHROMATIC: bool, T: Tally>(
        &mut self,
        tile: &Tile,
        out: &mut Output<'_>,
        tally: T,
    ) -> Outcome<()> {
        let samples = tile.sample_end - tile.sample_begin;
        let pixels = (tile.max[0] - tile.min[0]) * (tile.max[1] - tile.min[1]);
        let steps = u64::from(samples) * u64::from(pixels);
        let place = (u64::from(tile.min[1]) << 32) | u64::from(tile.min[0]);
        let key = derive(
            derive(mix(tile.seed ^ 0x6d6c_7400), place),
            u64::from(tile.sample_begin),
        );
        self.chain::<CHROMATIC, T>(key, steps, out, &tally)?;
        self.cover::<CHROMATIC, T>(tile, out, tally)
    }

    fn chain<const CHROMATIC: bool, T: Tally>(
        &mut self,
        key: u64,
        steps: u64,
        out: &mut Output<'_>,
        tally: &T,
    ) -> Outcome<()> {
        let seeds = ((steps as f64 * self.settings.seeds) as u64).max(1);
        let mut weights = Vec::with_capacity(seeds as usize);
        let mut sum = 0.0;
        for i in 0..seeds {
            self.chain.start(derive(key, i));
            let s = self.evaluate::<CHROMATIC>()?;
            sum += s.map_or(0.0, |s| s.importance);
            weights.push(sum);
        }
        if !(sum > 0.0) {
            return Ok(());
        }
        let mean = sum / seeds as f64;
        let mut choice = Stream::new(derive(key, u64::MAX));
        let mark = f64::from(choice.uniform()) * sum;
        let chosen = weights
            .partition_point(|w| *w <= mark)
            .min(weights.len() - 1);
        self.chain.start(derive(key, chosen as u64));
        let Some(mut current) = self.evaluate::<CHROMATIC>()? else {
            return Ok(());
        };
        // Both states of a step are recorded with their expected weight (Veach & Guibas 1997, §5.3).
        let mut kept = 0.0;
        for _ in 0..steps {
            let large = self.chain.uniform() < self.settings.large_steps;
            self.chain.propose(large);
            let proposed = self.evaluate::<CHROMATIC>()?;
            let accept = proposed.map_or(0.0, |p| (p.importance / current.importance).min(1.0));
            kept += 1.0 - accept;
            if let Some(p) = proposed
                && f64::from(self.chain.uniform()) < accept
            {
                record(out, tally, &current, mean * kept)?;
                self.chain.accept();
                current = p;
                kept = accept;
            } else {
                if let Some(p) = proposed {
                    record(out, tally, &p, mean * accept)?;
                }
                self.chain.reject();
            }
        }
        record(out, tally, &current, mean * kept)
    }

    /// The path of the chain's state; `None` if it carries nothing.
    fn evaluate<const CHROMATIC: bool>(&mut self) -> Outcome<Option<Sample>> {
        let chain = &mut self.chain;
        let [length, strategy, ..] = chain.four(End::Sensor, 0, Purpose::Branch);
        let r = self.settings.ratio;
        let steps = (f64::from(1.0 - length).ln() / r.ln()).floor();
        // Light that was not scattered is left to the camera's rays.
        let depth = 1.0 + steps;
        if depth > f64::from(self.settings.max_depth) || depth > 1e6 {
            return Ok(None);
        }
        let probability = (1.0 - r) * r.powf(steps);
        let vertices = depth as usize + 2;
        // Where scattering alone finds lights, there is one strategy; else all with t ≥ 1.
        let strategies = if self.paths.heuristic == Heuristic::Alone {
            1
        } else {
            vertices
        };
        let s = ((strategy * strategies as f32) as usize).min(strategies - 1);
        let found = self.strategy::<CHROMATIC>(s, vertices - s)?;
        let scale = (strategies as f64 / probability) as f32;
        Ok(found.and_then(|(film, radiance)| {
            let radiance = radiance * scale;
            let importance = f64::from(radiance.mean(self.scene.lanes()));
            (importance > 0.0 && importance.is_finite()).then_some(Sample {
                film,
                radiance,
                order: vertices - 2,
                importance,
            })
        }))
    }

    /// A path with `s` vertices from the light and `t` from the sensor.
    fn strategy<const CHROMATIC: bool>(
        &mut self,
        s: usize,
        t: usize,
    ) -> Outcome<Option<([f32; 2], Spectrum)>> {
        let (scene, chain, paths) = (self.scene, &mut self.chain, &mut self.paths);
        if s > 1 {
            paths.light.from_light::<CHROMATIC, _>(scene, chain, s)?;
            if paths.light.len() < s {
                return Ok(None);
            }
        }
        if t == 1 {
            return Ok(paths
                .project(scene, s, chain)?
                .map(|splat| (splat.film, splat.radiance)));
        }
        let [a, b, c, d] = chain.four(End::Sensor, 0, Purpose::Camera);
        let film = [
            self.corner[0] + a * self.extent[0],
            self.corner[1] + b * self.extent[1],
        ];
        let Some(ray) = scene.film_ray(film, [c, d])? else {
            return Ok(None);
        };
        paths
            .sensor
            .from_sensor::<CHROMATIC, _>(scene, &ray, chain, t)?;
        let mut radiance = Spectrum::ZERO;
        if s == 0
            && let Some(emitted) = paths.sensor.emitted.get(t - 2)
        {
            radiance += *emitted;
        }
        if paths.sensor.len() == t {
            radiance += match s {
                0 => paths.hit(scene, t)?,
                1 => paths.next_event(scene, t, chain)?,
                _ => paths.join(scene, s, t, chain)?,
            };
        }
        // The film is covered with density 1/area.
        let area = self.extent[0] * self.extent[1];
        Ok(Some((film, radiance * area)))
    }

    /// The samples of the piece's own pixels: light that was not scattered, which chains are bad at (it is bright and found at
    /// once), and the features of the picture.
    fn cover<const CHROMATIC: bool, T: Tally>(
        &mut self,
        tile: &Tile,
        out: &mut Output<'_>,
        tally: T,
    ) -> Outcome<()> {
        let (scene, paths) = (self.scene, &mut self.paths);
        samples::each(tile, out, tally, |_, tally, p| {
            let mut draws = NetDraws::new(tile.seed, p.index, p.sample, scene.lanes());
            let wanted = tile.features != 0;
            let mut sample = paths.look::<CHROMATIC, _>(scene, p.pixel, &mut draws, 2, wanted)?;
            sample.radiance = paths
                .sensor
                .emitted
                .iter()
                .fold(Spectrum::ZERO, |a, e| a + *e);
            if paths.sensor.len() > 1 {
                sample.radiance += paths.hit(scene, 2)?;
            }
            tally.add(0, sample.radiance);
            Ok(sample)
        })
    }
}

/// Adds a state to the film with its share of the steps, `weight` in units of the chain's mean.
fn record<T: Tally>(out: &mut Output<'_>, tally: &T, s: &Sample, weight: f64) -> Outcome<()> {
    if weight > 0.0 {
        let scale = (weight / s.importance) as f32;
        tally.splat(out, s.film, s.radiance * scale, s.order)?;
    }
    Ok(())
}
