//! `meshray explain`: why a mesh costs what it does, and what would help.
//!
//! # Schema `meshray-explain/1`
//! One JSON object: `version`, `file`, `hash`, `view`, `width`, `height`, `accel`, `prims` (N); `usual` by ray class (`primary`,
//! `shadow`, `reflected`, `refracted`) and `all`, each with `rays`, `tests` (ray/prim), `steps` (nodes and cells visited),
//! `transforms` (points) and `cost` (sum of these three); `causes`, by descending saving, each with `cause`, `evidence`,
//! `remedy`, `saving` (share of the cost; negative where it grows), `keeps_the_picture`, `drawn_anew` (whether part of the saving
//! is chance: rough surfaces scatter other rays) and `without` (as `usual`). Keys are only ever added.

use super::args::ExplainArgs;
use super::exit::Exit;
use super::job;
use super::message::Messages;
use super::viewed::{self, ViewedModel};
use super::{interrupt, panics};
use crate::accel::{AccelParams, auto};
use crate::bench::explain::{Bill, Case, Finding, WORTH, Work, explain};
use crate::number::{grouped, hash, short};
use crate::render::{CLASS_NAMES, Settings};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Loads the model, tries every suspected cause and prints the findings.
pub(super) fn run(args: &ExplainArgs) -> Exit {
    let messages = Messages::new(args.model.messages.into(), args.quiet);
    let params = match job::params(&args.params, args.accel.kinds()) {
        Ok(params) => params,
        Err(wrong) => return messages.wrong(wrong),
    };
    let name = args.model.input.display().to_string();
    panics::guard(&name, &messages, || judge(args, params, &name, &messages).unwrap_or_else(|exit| exit))
}

/// Contents of the report.
struct ExplainReport<'a> {
    name: &'a str,
    hash: u128,
    view: &'a str,
    prims: usize,
    case: &'a Case,
    usual: &'a Bill,
    findings: &'a [Finding],
}

fn judge(args: &ExplainArgs, params: AccelParams, name: &str, messages: &Messages) -> Result<Exit, Exit> {
    let ViewedModel { loaded, world, view, phrase } = viewed::model(&args.model, &args.eye, args.size, messages)?;
    let settings = Settings { samples: 1, ..viewed::settings(args.size, args.depth, &loaded.scene.hints) };
    let (accel, _) = auto::build(args.accel, &world.shapes, &params);
    let kind = accel.kind();
    let case = Case { scene: loaded.scene, view, settings, accel: kind, params };
    let going = |cause| {
        messages.info("progress", format!("{name}: without {cause}"));
        !interrupt::raised()
    };
    let (usual, findings) = explain(&case, going).ok_or(Exit::Interrupted)?;
    let told = ExplainReport {
        name,
        hash: loaded.facts.hash,
        view: &phrase,
        prims: world.shapes.len(),
        case: &case,
        usual: &usual,
        findings: &findings,
    };
    messages.print(&if args.json { told.json() } else { told.text() })?;
    Ok(Exit::Done)
}

impl ExplainReport<'_> {
    fn text(&self) -> String {
        let Settings { width, height, .. } = self.case.settings;
        let pixels = f64::from(width) * f64::from(height);
        let all = self.usual.sum();
        let transforms = match all.transforms {
            0 => String::new(),
            n => format!(", for which {} points are transformed", short(n as f64 / pixels)),
        };
        let mut out = format!(
            "{}: {} prims in {}; {width}×{height}, {}\na pixel takes {} ray/prim tests and visits {} nodes and cells{}:\n",
            self.name,
            grouped(self.prims as u64),
            self.case.accel,
            self.view,
            short(all.tests as f64 / pixels),
            short(all.steps as f64 / pixels),
            transforms,
        );
        for (name, work) in CLASS_NAMES.iter().zip(&self.usual.0).filter(|(_, work)| work.rays > 0) {
            let share = 100.0 * work.cost() as f64 / all.cost().max(1) as f64;
            let _ = writeln!(out, "  {share:3.0} % for {} {name} rays", grouped(work.rays));
        }
        let worth: Vec<&Finding> = self.findings.iter().filter(|f| f.is_worth_it()).collect();
        if worth.is_empty() {
            let least = short(100.0 * WORTH);
            let _ = writeln!(out, "\nnothing that was tried would save {least} % of this");
        }
        for (number, finding) in (1..).zip(&worth) {
            let but = match (finding.cause.keeps_the_picture(), finding.is_drawn_anew) {
                (false, _) => "; changes the picture",
                (true, false) => "",
                (true, true) => {
                    "; what rough surfaces scatter is drawn anew without it, so that some of this is chance"
                }
            };
            let _ = writeln!(
                out,
                "\n{number}. {}: {:.0} % of the cost, counted without it\n   {}\n   remedy: {}{but}",
                finding.cause,
                100.0 * finding.saving,
                finding.evidence,
                finding.remedy
            );
        }
        let idle: Vec<String> =
            self.findings.iter().filter(|f| !f.is_worth_it()).map(|f| f.cause.to_string()).collect();
        if !idle.is_empty() && !worth.is_empty() {
            let _ = writeln!(out, "\nno use to change: {}", idle.join(", "));
        }
        out
    }

    fn json(&self) -> String {
        let cause = |f: &Finding| {
            json!({
                "cause": f.cause.name(), "evidence": f.evidence, "remedy": f.remedy, "saving": f.saving,
                "keeps_the_picture": f.cause.keeps_the_picture(), "drawn_anew": f.is_drawn_anew, "without": bill(&f.without),
            })
        };
        let value = json!({
            "schema": "meshray-explain/1",
            "version": super::version::SHORT,
            "file": self.name,
            "hash": hash(self.hash),
            "view": self.view,
            "width": self.case.settings.width,
            "height": self.case.settings.height,
            "accel": self.case.accel.name(),
            "prims": self.prims,
            "usual": bill(self.usual),
            "causes": self.findings.iter().map(cause).collect::<Vec<_>>(),
        });
        format!("{value:#}\n")
    }
}

fn bill(bill: &Bill) -> Value {
    let work = |w: &Work| {
        let Work { rays, tests, steps, transforms } = w;
        json!({"rays": rays, "tests": tests, "steps": steps, "transforms": transforms, "cost": w.cost()})
    };
    let mut classes: Map<String, Value> =
        CLASS_NAMES.iter().zip(&bill.0).map(|(name, w)| ((*name).to_owned(), work(w))).collect();
    classes.insert("all".into(), work(&bill.sum()));
    Value::Object(classes)
}
