//! `resolvent render`.

use crate::args::Render;
use crate::checkpoint::{self, Keeper};
use crate::console;
use crate::failure::{Code, Failure, Outcome, failed, input};
use crate::input::Kind;
use crate::interrupt::{self, On, Phase};
use crate::output::{self, Target, Written};
use crate::overrides::{self, Plan};
use crate::progress::Display;
use crate::roles::Roles;
use crate::sequence;
use crate::stats::{self, About, Certainty, Seconds};
use crate::watch;
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::plugin::{ForeignIntegrator, Message, Registry, set_log};
use resolvent_engine::scene::Scene;
use resolvent_engine::{Keep, Rendered, Settings, go_on, with_threads};
use resolvent_scene as describe;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Runs the command.
pub fn run(a: &Render) -> Outcome {
    if a.watch && !a.watched {
        return watch::run(a);
    }
    console::set_quiet(a.quiet);
    if a.watched {
        watch::begin();
        watch::reads([&a.input]);
    }
    interrupt::install(if a.watched { On::Discard } else { On::Save });
    set_log(|message| match message {
        Message::Warning(text) => console::warning(text),
        Message::Info(text) => console::info(text),
    });
    let kind = crate::input::of(a)?;
    match &a.stage.frames {
        Some(frames) => sequence::run(a, frames, |a| one(a, kind)),
        None => one(a, kind),
    }
}

/// Renders one picture.
fn one(a: &Render, kind: Kind) -> Outcome {
    // Whoever keeps the sums needs no picture.
    let default = a.aim.checkpoint.is_none().then_some(a.input.as_path());
    let targets = output::targets(&a.output, default)?;
    let roles = Roles::of_render(a, &targets)?;
    let others = a.stats.iter().chain(&a.save_scene).chain(&a.stage.report);
    for file in others {
        output::check_writable(file)?;
    }
    checkpoint::check(&a.aim)?;
    with_threads(a.threads.into(), || work(a, kind, &targets, roles)).map_err(input)?
}

/// Everything that uses threads.
fn work(a: &Render, kind: Kind, targets: &[Target], mut roles: Roles) -> Outcome {
    let start = Instant::now();
    let mut seconds = Seconds::default();
    let mut described = describe(a, kind)?;
    let plan = overrides::apply(a, &mut described)?;
    seconds.parse = start.elapsed().as_secs_f64();
    let mut registry = a.plugins.registry()?;
    if a.watched {
        registry = registry.copying();
        watch::reads(watch::of_scene(&described, &registry));
    }
    roles.read_scene(&described, &registry)?;

    let built = Scene::build(&described, &registry).map_err(|e| named(a, kind, &e))?;
    let instance = registry
        .instantiate(
            PluginKind::Integrator,
            &described.integrator,
            &described,
            &Affine::IDENTITY,
            built.lanes,
        )
        .map_err(input)?;
    let integrator = ForeignIntegrator::new(instance).map_err(input)?;
    tell_hidden(&registry);
    if let Some(file) = &a.save_scene {
        save_scene(&described, &registry, file)?;
    }
    seconds.build(&built.preparation);
    let keeper = Keeper::new(a, &described, &registry, &integrator)?;
    let settings = settings(&described, &plan);
    let memory = output::memory(&described, &settings, keeper.is_some());
    output::check_memory(settings.window, memory)?;

    let cpu = crate::system::cpu_seconds().unwrap_or(0.0);
    let rendered = render(&built, &integrator, &settings, keeper.as_ref(), a.aim.every)?;
    seconds.render_cpu = crate::system::cpu_seconds().unwrap_or(0.0) - cpu;
    interrupt::enter(Phase::Writing);
    let (rendered, broken) = match rendered {
        Ok(rendered) => (rendered, None),
        Err(broken) => {
            // A plugin is the user's input as much as a scene is.
            let resolvent_engine::Broken { error, rendered } = *broken;
            let error = input(error);
            match rendered {
                // Who watches keeps the last whole picture.
                Some(rendered) if !a.watched => (*rendered, Some(error)),
                _ => return Err(error),
            }
        }
    };
    seconds.render = rendered.seconds;
    warn_about(&rendered, &built);
    let interrupted = rendered.interrupted;
    if stats::total_samples(&rendered) == 0 {
        return Err(failed(if interrupted {
            "interrupted before any pixel was finished; nothing is saved"
        } else {
            "the time was over before any pixel was finished; nothing is saved: give more time, or set `max_depth`"
        }));
    }
    let write_start = Instant::now();
    let mut written = Written::default();
    if let (Some(keeper), Some(file)) = (&keeper, &a.aim.checkpoint) {
        written.note(file, keeper.finish(&rendered));
    }
    let (mut image, missing) = output::image(&described, &rendered);
    output::tell_missing(&missing);
    let certainty = Certainty::of(&rendered.film);
    // Whatever broke has told its own reason.
    if broken.is_none() {
        certainty.tell();
    }
    let about = About {
        input: a.input.display().to_string(),
        integrator: integrator.title(),
    };
    image.metadata = stats::metadata(&about, &described, &rendered, &certainty);
    written.image(&a.tone, &image, targets);
    let summary = format!("{} ({})", written.names(), certainty.summary(&rendered));
    seconds.write = write_start.elapsed().as_secs_f64();
    seconds.total = start.elapsed().as_secs_f64();
    if let Some(file) = &a.stats {
        let run = stats::Run {
            args: a,
            described: &described,
            registry: &registry,
            scene: &built,
            rendered: &rendered,
            plan: &plan,
            memory,
            seconds,
            certainty: &certainty,
        };
        written.note(file, stats::write(&run, file));
    }
    let whole = written.whole(&summary);
    if let Some(Failure { code, message }) = broken {
        if let Err(e) = whole {
            let message = format!("{message}; {}", e.message);
            return Err(Failure { code, message });
        }
        return Err(Failure {
            code,
            message: format!("{message}; what was finished before is saved in {summary}"),
        });
    }
    if let Err(e) = whole {
        let how = if interrupted { "interrupted; " } else { "" };
        return Err(failed(format!("{how}{}", e.message)));
    }
    if interrupted {
        // Said even if quiet: the picture is not the one that was asked for.
        console::line(&format!(
            "interrupted; what was finished is saved in {summary}"
        ));
        return Ok(Code::Interrupted);
    }
    console::info(format!("wrote {summary}"));
    Ok(Code::Done)
}

/// An error of the scene that was guessed for a volume or a model has no place in a file: then it names that.
fn named(a: &Render, kind: Kind, error: &resolvent_engine::Error) -> Failure {
    let (text, path) = (error.to_string(), a.input.display().to_string());
    if matches!(kind, Kind::Vdb | Kind::Gltf | Kind::Usd) && !text.contains(&path) {
        return input(format!("{path}: {text}"));
    }
    input(text)
}

/// The description of what to render.
fn describe(a: &Render, kind: Kind) -> Outcome<describe::Scene> {
    match kind {
        Kind::Scene => describe::Scene::read(&a.input).map_err(input),
        Kind::Usd => {
            let scene = crate::usd::scene(&a.input, &a.stage)?;
            describe::Scene::read(scene).map_err(input)
        }
        Kind::Vdb => crate::guess::scene(&a.input, a),
        Kind::Gltf => crate::guess::model(&a.input, a),
        Kind::Exr => Err(input(format!(
            "{}: is an image; render takes a scene (.json), an OpenVDB file (.vdb), a glTF model (.gltf, .glb) or a USD stage (.usd, .usda, .usdc, .usdz)",
            a.input.display()
        ))),
    }
}

fn save_scene(scene: &describe::Scene, registry: &Registry, file: &std::path::Path) -> Outcome<()> {
    let decls: Vec<_> = registry.loaded().iter().map(|p| p.decl.clone()).collect();
    let mut scene = scene.clone();
    scene.rebase(file, &decls).map_err(failed)?;
    let text = scene.to_text().map_err(input)?;
    resolvent_image::write_atomically(file, |out| {
        use std::io::Write;
        out.write_all(text.as_bytes())
            .map_err(|source| resolvent_image::Error::Io {
                file: file.to_path_buf(),
                what: "cannot write: ",
                source,
            })
    })
    .map_err(failed)?;
    console::info(format!("wrote the scene to {}", file.display()));
    Ok(())
}

fn settings(described: &describe::Scene, plan: &Plan) -> Settings {
    Settings {
        resolution: described.film.resolution,
        window: described.film.window(),
        samples: plan.samples.clone(),
        goal: plan.goal,
        seed: described.sampling.seed,
        features: output::wants_features(described),
        orders: described.film.order_layers(),
    }
}

fn render(
    scene: &Scene,
    integrator: &ForeignIntegrator,
    settings: &Settings,
    keeper: Option<&Keeper>,
    every: f64,
) -> Outcome<Result<Rendered, Box<resolvent_engine::Broken>>> {
    let from = keeper.map_or(Ok(None), Keeper::load)?;
    let save = |bytes: &[u8]| {
        if let Some(keeper) = keeper {
            keeper.save(bytes);
        }
    };
    let keep = keeper.map(|k| Keep {
        every: Duration::from_secs_f64(every.min(1e9)),
        identity: &k.identity,
        about: &k.about,
        save: &save,
    });
    let display = Display::new(settings.goal, settings.samples.len() as u32);
    interrupt::enter(Phase::Rendering);
    let stop = &interrupt::STOP;
    let report = |p| display.report(p);
    let going_on = keeper.filter(|_| from.is_some());
    let mut rendered = go_on(from, scene, integrator, settings, keep, stop, &report);
    display.finish();
    if let (Some(keeper), Err(broken)) = (going_on, &mut rendered)
        && broken.rendered.is_none()
    {
        broken.error = resolvent_engine::Error::Input(keeper.refused(&broken.error));
    }
    Ok(rendered)
}

/// Says which of several plugins of one name is in use.
fn tell_hidden(registry: &Registry) {
    for plugin in registry.loaded() {
        for hidden in registry.hidden_by(&plugin) {
            console::info(format!(
                "there are two of the {}: {} is not used",
                plugin.title(),
                hidden.display()
            ));
        }
    }
}

/// The media whose majorants were violated, for messages.
fn violated(scene: &Scene) -> String {
    let media = scene.media.iter();
    let media = media.filter(|m| m.violated.load(Ordering::Relaxed));
    let names: Vec<_> = media
        .map(|m| format!("'{}' ({})", m.name, m.medium.instance.plugin.title()))
        .collect();
    if names.is_empty() {
        return String::new();
    }
    format!(" of the medium {}", names.join(", "))
}

/// What may make the picture wrong.
fn warn_about(rendered: &Rendered, scene: &Scene) {
    let c = &rendered.counters;
    if c.violations > 0 {
        console::warning(format!(
            "the extinction was above its majorant at {} points{}: a fault of the plugin. Ratio tracking allows for it, free flights cannot: the picture may be wrong",
            c.violations,
            violated(scene)
        ));
    }
}
