//! `meshray study`: benefit of each knob on a model, and recommended settings.

use super::args::StudyArgs;
use super::exit::Exit;
use super::job::UsageError;
use super::message::Messages;
use super::viewed::{self, ViewedModel};
use super::writable::{self, Sources};
use super::{interrupt, meter, panics, picture, sampling};
use crate::accel::{AccelParams, auto};
use crate::bench::study::report::{Format, text};
use crate::bench::study::{Plan, Study, Subject, measure, reference, settings};
use crate::image::Output;
use crate::load::Diagnostic;
use crate::render::texture::TextureStore;
use crate::render::{Job, Settings};
use crate::scene::framing::robust_bounds;
use crate::threads;
use std::path::PathBuf;

/// Loads the model, renders it with every setting, and prints and writes rows as they are measured.
pub(super) fn run(args: &StudyArgs) -> Exit {
    let messages = Messages::new(args.model.messages.into(), args.quiet);
    let typed = |path: &PathBuf| Ok((path.clone(), Format::from_path(path).map_err(UsageError)?));
    let files: Vec<(PathBuf, Format)> = match args.report.iter().map(typed).collect() {
        Ok(files) => files,
        Err(wrong) => return messages.wrong(wrong),
    };
    if let Err(fault) = writable::check_reports(&args.report, &Sources::of([&args.model.input])) {
        return messages.fail(&fault, Exit::Failed);
    }
    let name = args.model.input.display().to_string();
    panics::guard(&name, &messages, || match threads::pool(args.threads.map_or(0, usize::from)) {
        Ok(pool) => pool.install(|| study(args, &files, &name, &messages).unwrap_or_else(|exit| exit)),
        Err(e) => {
            messages.error("threads", format!("no threads can be started: {e}"), "ask for fewer (--threads)");
            Exit::Failed
        }
    })
}

fn study(args: &StudyArgs, files: &[(PathBuf, Format)], name: &str, messages: &Messages) -> Result<Exit, Exit> {
    let ViewedModel { loaded, world, view, phrase } = viewed::model(&args.model, &args.eye, args.size, messages)?;
    let sources = Sources::of(&loaded.facts.files);
    args.report
        .iter()
        .try_for_each(|path| sources.spared_by(path, "--report"))
        .map_err(|fault| messages.fail(&fault, Exit::Failed))?;
    let scene = &loaded.scene;
    let base = Settings { seed: args.seed, ..viewed::settings(args.size, None, &scene.hints) };
    let tone_map = picture::tone_map(args.tone_map, scene).map_err(|why| {
        messages.fail(&Diagnostic::new("scene-value", args.model.input.as_path(), "", why), Exit::Input)
    })?;
    let (accel, _) = auto::build(args.accel, &world.shapes, &AccelParams::DEFAULT);
    let textures = TextureStore::new(scene);
    let given = args.exposure.or(scene.hints.exposure);
    let job = Job { scene, world: &world, accel: &accel, textures: &textures, view: &view, settings: &base };
    let metered = (given.is_none() && meter::is_due(scene)).then(|| meter::exposure(&job)).flatten();
    let output = Output { tone_map, exposure: given.or(metered).unwrap_or(0.0), ..Output::default() };
    let output = picture::before(scene.background, output);
    let phrase = metered.map_or(phrase.clone(), |stops| format!("{phrase}, {}", meter::phrase(stops)));
    let wide = |narrowest: f64| {
        let pixels = picture::wide_in_pixels(narrowest, 2.0 * robust_bounds(scene).radius(), &base);
        sampling::fewest_of_wires(pixels)
    };
    let subject = Subject {
        scene,
        world: &world,
        accel: &accel,
        textures: &textures,
        view: &view,
        base: &base,
        samples: scene.hints.samples,
        fewest: loaded.facts.wires.narrowest().map_or(1, wide),
        output: &output,
    };
    let plan = Plan { passes: args.passes, reference_samples: args.reference_samples, seed: args.seed };
    let mut going = |done: u32, of: u32| {
        messages.info("progress", format!("{name}: the reference, part {} of {of}", done + 1));
        !interrupt::raised()
    };
    let reference = reference(&subject, &plan, &mut going).ok_or(Exit::Interrupted)?;
    let mut study = Study {
        name: name.to_owned(),
        hash: loaded.facts.hash,
        view: phrase,
        size: args.size,
        threads: rayon::current_num_threads(),
        plan,
        reference,
        rows: Vec::new(),
        complete: false,
    };
    let told = RowSinks { files, messages };
    messages.print(&text::head(&study))?;
    for setting in settings(&subject) {
        if interrupt::raised() {
            break;
        }
        let row = measure(&subject, &plan, &study.reference, setting);
        messages.print(&text::row(&row))?;
        study.rows.push(row);
        told.write(&study)?;
    }
    study.complete = !interrupt::raised();
    messages.print(&text::conclusion(&study))?;
    told.write(&study)?;
    Ok(if study.complete { Exit::Done } else { Exit::Interrupted })
}

/// Sinks of the rows.
struct RowSinks<'a> {
    files: &'a [(PathBuf, Format)],
    messages: &'a Messages,
}

impl RowSinks<'_> {
    /// Writes every report with the rows so far, so that a crash costs only one row.
    fn write(&self, study: &Study) -> Result<(), Exit> {
        self.files.iter().try_for_each(|(path, format)| {
            let bytes = format.write(study).into_bytes();
            interrupt::write_atomic(path, &bytes).map_err(|e| self.messages.unwritable(path, &e))
        })
    }
}
