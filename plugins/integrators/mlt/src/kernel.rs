//! Samples of bidirectional path tracing, and the chains that start from them.

use crate::starts::Starts;
use resolvent_api::abi::{PixelSample, Tile, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::rng::{derive, mix};
use resolvent_api::{Output, SceneView, Spectrum};
use resolvent_pathspace::bidirectional::{Bidirectional, Draws, End, NetDraws, Pairs, Subpath};
use resolvent_pathspace::chain::{Chain, Origin, Sizes};
use resolvent_pathspace::mis::{Heuristic, MediaDensities};
use resolvent_pathspace::orders::Tally;
use resolvent_pathspace::sampler::Purpose;
use resolvent_pathspace::samples;

/// Samples that estimate how much light there is, which decides how it is divided among chains.
const PILOT: u32 = 4096;

/// Which walks are made anew: from the sensor, from the light.
const BOTH: [bool; 2] = [true, true];
const SENSOR: [bool; 2] = [true, false];
const LIGHT: [bool; 2] = [false, true];

/// Parameters.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Most scattering events of a path.
    pub max_depth: u32,
    /// Mean number of steps of chains for each sample.
    pub mutations: f64,
    /// Steps of a chain.
    pub length: u32,
    /// Share of large steps.
    pub large_steps: f32,
    /// Standard deviations of small steps.
    pub sizes: Sizes,
    /// Each number of scattering events is proposed by large steps this much less often than the one before.
    pub ratio: f64,
    /// Mean number of vertices of the light's walk that each of the sensor's is joined to, in samples.
    pub connections: f32,
    /// Recompute all paths.
    pub verify: bool,
}

/// A path of one strategy, and what it carries to the film.
#[derive(Clone, Copy, Debug)]
struct State {
    /// Vertices from the light, and from the sensor.
    pair: [usize; 2],
    film: [f32; 2],
    radiance: Spectrum,
    /// The scalar that chains follow.
    importance: f64,
}

impl State {
    fn order(&self) -> usize {
        self.pair[0] + self.pair[1] - 2
    }
}

/// A state found by a sample.
#[derive(Clone, Copy, Debug)]
struct Seed {
    state: State,
    /// How many it stands for, of which the others were not tried.
    weight: f64,
}

impl Seed {
    fn importance(&self) -> f64 {
        self.state.importance * self.weight
    }
}

/// What makes paths, and its storage.
pub struct Kernel<'a> {
    scene: &'a SceneView<'a>,
    settings: Settings,
    paths: Bidirectional,
    chain: Chain,
    /// Walks of the chain's state while others are tried.
    kept: [Subpath; 2],
    /// What the strategies of the sample in progress have found.
    seeds: Vec<Seed>,
    /// First column and row of the window, and its size.
    window: [[f32; 2]; 2],
    seen: Seen,
}

/// The film that pixels of the window see.
#[derive(Clone, Copy)]
struct Seen {
    corner: [f32; 2],
    extent: [f32; 2],
}

impl Seen {
    /// The point that two numbers from 0 to 1 stand for, pixels.
    fn at(&self, u: f32, v: f32) -> [f32; 2] {
        [
            self.corner[0] + u * self.extent[0],
            self.corner[1] + v * self.extent[1],
        ]
    }

    /// In pixels.
    fn area(&self) -> f32 {
        self.extent[0] * self.extent[1]
    }
}

impl<'a> Kernel<'a> {
    /// For a piece of work.
    pub fn new(scene: &'a SceneView<'a>, settings: Settings, tile: &Tile) -> Self {
        let [x0, y0, x1, y1] = tile.window.map(|v| v as f32);
        let m = tile.margin;
        let extent = [x1 - x0 + 2.0 * m, y1 - y0 + 2.0 * m];
        let area = f64::from(extent[0]) * f64::from(extent[1]);
        let heuristic = if scene.has(scene_traits::LIGHTS) {
            Heuristic::Balance
        } else {
            Heuristic::Alone
        };
        let paths = Bidirectional::new(area, heuristic, MediaDensities::Exact);
        Self {
            scene,
            settings,
            paths: paths.verify(settings.verify),
            chain: Chain::new(settings.sizes, scene.lanes()),
            kept: [
                Subpath::new(MediaDensities::Exact),
                Subpath::new(MediaDensities::Exact),
            ],
            seeds: Vec::new(),
            window: [[x0, y0], [x1 - x0, y1 - y0]],
            seen: Seen {
                corner: [x0 - m, y0 - m],
                extent,
            },
        }
    }

    /// What was found to differ when it was recomputed.
    pub fn difference(&self) -> Option<&str> {
        self.paths.difference()
    }

    /// An estimate of what a sample finds, the same for all pieces of work.
    pub fn brightness<const CHROMATIC: bool>(&mut self) -> Outcome<f64> {
        let mut sum = 0.0;
        for i in 0..PILOT {
            let mut draws = NetDraws::new(0x7069_6c6f_7400, 0, i, self.scene.lanes());
            let camera = draws.four(End::Sensor, 0, Purpose::Camera);
            self.sample::<CHROMATIC>(&mut Origin { draws, camera })?;
            sum += self.seeds.iter().map(Seed::importance).sum::<f64>();
        }
        Ok(sum / f64::from(PILOT))
    }

    /// Renders a piece of work: its samples, each followed by the chains that start from it. `brightness` is what chains divide.
    pub fn piece<const CHROMATIC: bool, T: Tally>(
        &mut self,
        tile: &Tile,
        brightness: f64,
        out: &mut Output<'_>,
        tally: T,
    ) -> Outcome<()> {
        let Settings {
            mutations, length, ..
        } = self.settings;
        let place = (u64::from(tile.min[1]) << 32) | u64::from(tile.min[0]);
        let key = derive(
            derive(mix(tile.seed ^ 0x6d6c_7400), place),
            u64::from(tile.sample_begin),
        );
        let pixels = (tile.max[0] - tile.min[0]) * (tile.max[1] - tile.min[1]);
        let samples = f64::from(tile.sample_end - tile.sample_begin) * f64::from(pixels);
        let expected = samples * mutations / f64::from(length);
        let quantum = brightness * f64::from(length) / mutations;
        let mut starts = Starts::new(key, quantum, expected);
        // Chains visit a state `density · importance` times as often as samples.
        let density = if brightness > 0.0 {
            mutations / brightness
        } else {
            0.0
        };
        samples::each(tile, out, tally, |out, tally, p| {
            let mut draws = NetDraws::new(tile.seed, p.index, p.sample, self.scene.lanes());
            let found = self.seen::<CHROMATIC, T>(tile, p.pixel, &mut draws, tally)?;
            let [a, b, c, d] = draws.four(End::Sensor, 0, Purpose::Camera);
            let [min, size] = self.window;
            let across = |k: usize, u: f32| {
                let place = (p.pixel[k] as f32 - min[k] + u) / size[k];
                place.min(1.0 - f32::EPSILON)
            };
            let camera = [across(0, a), across(1, b), c, d];
            let mut origin = Origin { draws, camera };
            self.sample::<CHROMATIC>(&mut origin)?;
            for Seed { state, weight } in &self.seeds {
                let own = 1.0 / (1.0 + density * state.importance);
                record(out, tally, state, weight * own)?;
            }
            for k in 0..self.seeds.len() {
                let seed = self.seeds[k];
                let (number, energy) = starts.from(seed.importance());
                for _ in 0..number {
                    self.chain.start(starts.key(), Some(origin));
                    self.run::<CHROMATIC, T>(seed.state, energy, density, out, tally)?;
                }
            }
            Ok(found)
        })
    }

    /// A sample of bidirectional path tracing: fills the seeds.
    fn sample<const CHROMATIC: bool>(&mut self, origin: &mut Origin) -> Outcome<()> {
        let (scene, paths) = (self.scene, &mut self.paths);
        let limit = (self.settings.max_depth as usize).saturating_add(2);
        self.seeds.clear();
        let connects = paths.heuristic != Heuristic::Alone;
        paths.sensor.clear();
        paths.light.clear();
        let [a, b, c, d] = origin.camera;
        let film = self.seen.at(a, b);
        if let Some(ray) = scene.film_ray(film, [c, d])? {
            paths
                .sensor
                .from_sensor::<CHROMATIC, _>(scene, &ray, &mut origin.draws, limit)?;
        }
        if connects {
            let limit = limit.saturating_sub(1);
            paths
                .light
                .from_light::<CHROMATIC, _>(scene, &mut origin.draws, limit)?;
        }
        let pairs = Pairs {
            limit,
            connections: self.settings.connections,
            only: [None; 2],
        };
        let area = self.seen.area();
        let (seeds, lanes) = (&mut self.seeds, scene.lanes());
        paths.every(scene, &mut origin.draws, &pairs, connects, |found| {
            if found.order() > 0 {
                let radiance = match found.film {
                    Some(_) => found.radiance,
                    // The film is covered with density 1/area.
                    None => found.radiance * area,
                };
                let pair = [found.s, found.t];
                // Light of media that the walk passed and of what it met is one strategy's.
                let same = seeds
                    .iter()
                    .position(|s| found.s == 0 && s.state.pair == pair);
                let passed = same.map_or(Spectrum::ZERO, |k| seeds.swap_remove(k).state.radiance);
                let film = found.film.unwrap_or(film);
                let weight = f64::from(1.0 / found.share);
                let state = state(pair, film, radiance + passed, lanes);
                seeds.extend(state.map(|state| Seed { state, weight }));
            }
            Ok(())
        })
    }

    /// A chain from a seed, which leaves `energy` along its steps, but for the share of it that samples have.
    fn run<const CHROMATIC: bool, T: Tally>(
        &mut self,
        seed: State,
        energy: f64,
        density: f64,
        out: &mut Output<'_>,
        tally: &T,
    ) -> Outcome<()> {
        let share = energy / f64::from(self.settings.length);
        let leave = |out: &mut Output<'_>, s: &State, steps: f64| {
            let shared = density * s.importance;
            let scale = steps * share / s.importance * (shared / (1.0 + shared));
            record(out, tally, s, scale)
        };
        let mut current = seed;
        self.strategy::<CHROMATIC>(seed.pair, BOTH)?;
        // Both states of a step are recorded with their expected weight (Veach & Guibas 1997, §5.3).
        let mut kept = 0.0;
        for _ in 0..self.settings.length {
            let large = self.chain.uniform() < self.settings.large_steps;
            let (pair, odds, walked) = if large {
                self.chain.leap();
                let pair = self.choose();
                let odds = pair.map_or(0.0, |p| self.odds(current.pair, p));
                (pair, odds, BOTH)
            } else {
                let walked = self.nudge(current.pair);
                (Some(current.pair), 1.0, walked)
            };
            self.swap(walked);
            let proposed = match pair {
                Some(pair) => self.strategy::<CHROMATIC>(pair, walked)?,
                None => None,
            };
            let accept =
                proposed.map_or(0.0, |p| (odds * p.importance / current.importance).min(1.0));
            kept += 1.0 - accept;
            if let Some(p) = proposed
                && f64::from(self.chain.uniform()) < accept
            {
                leave(out, &current, kept)?;
                self.chain.accept();
                current = p;
                kept = accept;
            } else {
                if let Some(p) = proposed {
                    leave(out, &p, accept)?;
                }
                self.chain.reject();
                self.swap(walked);
            }
        }
        leave(out, &current, kept)
    }

    /// Proposes a small step in the numbers of both walks, or of one: that costs half as much, and fails less often.
    fn nudge(&mut self, pair: [usize; 2]) -> [bool; 2] {
        let choice = 3.0 * self.chain.uniform();
        let walked = match pair {
            [0 | 1, _] => SENSOR,
            [_, 1] => LIGHT,
            _ if choice < 1.0 => SENSOR,
            _ if choice < 2.0 => LIGHT,
            _ => BOTH,
        };
        self.chain.nudge(walked);
        walked
    }

    /// Exchanges walks with those kept aside: before they are walked anew, and back if that was for nothing.
    fn swap(&mut self, walked: [bool; 2]) {
        if walked[0] {
            std::mem::swap(&mut self.paths.sensor, &mut self.kept[0]);
        }
        if walked[1] {
            std::mem::swap(&mut self.paths.light, &mut self.kept[1]);
        }
    }

    /// The strategy that a large step proposes; `None` for a path that is too long.
    fn choose(&mut self) -> Option<[usize; 2]> {
        let (length, strategy) = (self.chain.uniform(), self.chain.uniform());
        let steps = (f64::from(1.0 - length).ln() / self.settings.ratio.ln()).floor();
        let depth = 1.0 + steps;
        if depth > f64::from(self.settings.max_depth) || depth > 1e6 {
            return None;
        }
        let vertices = depth as usize + 2;
        let n = self.strategies(vertices);
        let s = ((strategy * n as f32) as usize).min(n - 1);
        Some([s, vertices - s])
    }

    /// How much more often large steps propose the one strategy than the other.
    fn odds(&self, one: [usize; 2], other: [usize; 2]) -> f64 {
        let [a, b] = [one, other].map(|[s, t]| s + t);
        let lengths = self.settings.ratio.powi(a as i32 - b as i32);
        lengths * self.strategies(b) as f64 / self.strategies(a) as f64
    }

    /// Strategies of paths with so many vertices. Where scattering alone finds lights, there is one; else all with t ≥ 1.
    fn strategies(&self, vertices: usize) -> usize {
        match self.paths.heuristic {
            Heuristic::Alone => 1,
            _ => vertices,
        }
    }

    /// The path of the chain's state by one strategy, of which these walks (from the sensor, from the light) are not those of
    /// the state before; `None` if it carries nothing.
    fn strategy<const CHROMATIC: bool>(
        &mut self,
        [s, t]: [usize; 2],
        walked: [bool; 2],
    ) -> Outcome<Option<State>> {
        let (scene, chain, paths) = (self.scene, &mut self.chain, &mut self.paths);
        if s > 1 {
            if walked[1] {
                paths.light.from_light::<CHROMATIC, _>(scene, chain, s)?;
            }
            if paths.light.len() < s {
                return Ok(None);
            }
        }
        if t == 1 {
            return Ok(paths
                .project(scene, s, chain)?
                .and_then(|splat| state([s, t], splat.film, splat.radiance, scene.lanes())));
        }
        let [a, b, c, d] = chain.four(End::Sensor, 0, Purpose::Camera);
        let film = self.seen.at(a, b);
        if walked[0] {
            paths.sensor.clear();
            let Some(ray) = scene.film_ray(film, [c, d])? else {
                return Ok(None);
            };
            paths
                .sensor
                .from_sensor::<CHROMATIC, _>(scene, &ray, chain, t)?;
        }
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
        let area = self.seen.area();
        Ok(state([s, t], film, radiance * area, scene.lanes()))
    }

    /// What a pixel's sample sees: light that was not scattered, which chains are bad at (it is bright and found at once), and the
    /// features of the picture.
    fn seen<const CHROMATIC: bool, T: Tally>(
        &mut self,
        tile: &Tile,
        pixel: [u32; 2],
        draws: &mut NetDraws,
        tally: &mut T,
    ) -> Outcome<PixelSample> {
        let (scene, paths) = (self.scene, &mut self.paths);
        let wanted = tile.features != 0;
        let mut sample = paths.look::<CHROMATIC, _>(scene, pixel, draws, 2, wanted)?;
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
    }
}

fn state(pair: [usize; 2], film: [f32; 2], radiance: Spectrum, lanes: u32) -> Option<State> {
    let importance = f64::from(radiance.mean(lanes));
    (importance > 0.0 && importance.is_finite()).then_some(State {
        pair,
        film,
        radiance,
        importance,
    })
}

/// Adds a share of what a state carries to the film.
fn record<T: Tally>(out: &mut Output<'_>, tally: &T, s: &State, share: f64) -> Outcome<()> {
    if share > 0.0 {
        tally.splat(out, s.film, s.radiance * share as f32, s.order())?;
    }
    Ok(())
}
