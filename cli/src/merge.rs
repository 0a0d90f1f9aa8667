//! `resolvent merge`.

use crate::args::Merge;
use crate::checkpoint;
use crate::console;
use crate::failure::{Code, Outcome, input};
use crate::output::{self, Written};
use crate::roles::Roles;
use crate::stats::{self, About};
use resolvent_engine::Rendered;
use resolvent_engine::checkpoint::Checkpoint;
use resolvent_scene::Scene;
use std::path::Path;

/// Runs the command.
pub fn run(a: &Merge) -> Outcome {
    console::set_quiet(a.quiet);
    let targets = output::targets(&a.output, None)?;
    let mut roles = Roles::default();
    for file in &a.checkpoints {
        roles.read("a checkpoint to merge", file)?;
    }
    for t in &targets {
        roles.write("-o", t.path())?;
    }
    if let Some(file) = &a.checkpoint {
        roles.write("--checkpoint", file)?;
        output::check_writable(file)?;
    }
    let mut files = a.checkpoints.iter();
    let Some(first) = files.next() else {
        return Err(input("nothing to merge"));
    };
    let mut all = read(first)?;
    for file in files {
        let part = read(file)?;
        all.join(&part).map_err(|why| {
            let (first, file) = (first.display(), file.display());
            input(format!("{file} cannot be merged with {first}: {why}"))
        })?;
    }
    let about = |name: &str| all.about[name].as_str().unwrap_or_default().to_owned();
    let scene = Scene::parse(about("scene").as_bytes(), about("source"))
        .map_err(|e| input(format!("{}: the scene in it: {e}", first.display())))?;
    let about = About {
        input: about("input"),
        integrator: about("integrator"),
    };
    let mut written = Written::default();
    if let Some(file) = &a.checkpoint {
        let bytes = all.state.to_bytes(&all.identity, &all.about);
        written.note(file, checkpoint::write(file, &bytes));
    }
    if scene.film.window() != all.state.film.window() {
        let file = first.display();
        return Err(input(format!("{file}: the scene in it has another window")));
    }
    let rendered = Rendered::from(all.state);
    let uneven = (0..rendered.film.tiles().len())
        .any(|i| rendered.film.coverage(i) != rendered.film.coverage(0));
    if uneven {
        console::warning("some pixels have more samples than others: a part is not finished");
    }
    let (mut image, missing) = output::image(&scene, &rendered);
    output::tell_missing(&missing);
    let certainty = stats::Certainty::of(&rendered.film);
    certainty.tell();
    image.metadata = stats::metadata(&about, &scene, &rendered, &certainty);
    written.image(&a.tone, &image, &targets);
    let summary = format!("{} ({})", written.names(), certainty.summary(&rendered));
    written.whole(&summary)?;
    console::info(format!("wrote {summary}"));
    Ok(Code::Done)
}

fn read(file: &Path) -> Outcome<Checkpoint> {
    // A picture is what everybody tries first.
    if crate::input::is_exr(file) {
        return Err(input(format!(
            "{}: is a picture, whose values are rounded; merge takes checkpoints, which hold the exact sums: render the parts with --checkpoint FILE",
            file.display()
        )));
    }
    Checkpoint::read(file).map_err(input)
}
