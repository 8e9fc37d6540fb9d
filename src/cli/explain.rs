//! `meshray explain`: why a mesh costs what it costs, and what would help.
//!
//! # Schema `meshray-explain/1`
//! One JSON object: `version`, `file`, `hash`, `view`, `width`, `height`, `accel`, `prims` (N); `usual` by ray class
//! (`primary`, `shadow`, `reflected`, `refracted`) and `all`, each with `rays`, `tests` (ray/prim), `steps` (nodes and cells
//! visited) and `cost` (tests and steps); `causes`, the greatest saving first, each with `cause`, `evidence`, `remedy`,
//! `saving` (a share of the cost; negative where it grows), `keeps_the_picture` and `without` (as `usual`). Keys are only
//! ever added.

use super::args::ExplainArgs;
use super::exit::Exit;
use super::job;
use super::message::Messages;
use super::seen::{self, Seen};
use super::{accident, interrupt};
use crate::accel::{AccelParams, auto};
use crate::bench::explain::{Bill, Case, Finding, Work, explain};
use crate::number::{grouped, short};
use crate::render::{CLASS_NAMES, Settings};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// A saving below this is not worth a change.
const WORTH: f64 = 0.02;

/// Loads the model, tries every cause and prints what was found.
pub(super) fn run(args: &ExplainArgs) -> Exit {
    let messages = Messages::new(args.model.messages.into(), args.quiet);
    let params = match job::params(&args.params, args.accel.kinds()) {
        Ok(params) => params,
        Err(wrong) => return messages.wrong(wrong),
    };
    let name = args.model.input.display().to_string();
    accident::guard(&name, &messages, || judge(args, params, &name, &messages).unwrap_or_else(|exit| exit))
}

/// What is printed.
struct Told<'a> {
    name: &'a str,
    hash: u128,
    view: &'a str,
    prims: usize,
    case: &'a Case,
    usual: &'a Bill,
    findings: &'a [Finding],
}

fn judge(args: &ExplainArgs, params: AccelParams, name: &str, messages: &Messages) -> Result<Exit, Exit> {
    let Seen { loaded, world, view, phrase } = seen::model(&args.model, &args.eye, args.size, messages)?;
    let settings = Settings { samples: 1, ..seen::settings(args.size, args.depth, &loaded.scene.hints) };
    let (accel, _) = auto::build(args.accel, &world.shapes, &params);
    let kind = accel.kind();
    let case = Case { scene: loaded.scene, view, settings, accel: kind, params };
    let going = |cause| {
        messages.info("progress", format!("{name}: without {cause}"));
        !interrupt::raised()
    };
    let (usual, findings) = explain(&case, going).ok_or(Exit::Interrupted)?;
    let told = Told {
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

impl Told<'_> {
    fn text(&self) -> String {
        let Settings { width, height, .. } = self.case.settings;
        let pixels = f64::from(width) * f64::from(height);
        let all = self.usual.sum();
        let mut out = format!(
            "{}: {} prims in {}; {width}×{height}, {}\na pixel takes {} ray/prim tests and visits {} nodes and cells:\n",
            self.name,
            grouped(self.prims as u64),
            self.case.accel,
            self.view,
            short(all.tests as f64 / pixels),
            short(all.steps as f64 / pixels),
        );
        for (name, work) in CLASS_NAMES.iter().zip(&self.usual.0).filter(|(_, work)| work.rays > 0) {
            let share = 100.0 * work.cost() as f64 / all.cost().max(1) as f64;
            let _ = writeln!(out, "  {share:3.0} % for {} {name} rays", grouped(work.rays));
        }
        let worth: Vec<&Finding> = self.findings.iter().filter(|f| f.saving >= WORTH).collect();
        if worth.is_empty() {
            out += "\nnothing that was tried would save 2 % of this\n";
        }
        for (number, finding) in (1..).zip(&worth) {
            let but = if finding.cause.keeps_the_picture() { "" } else { "; changes the picture" };
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
            self.findings.iter().filter(|f| f.saving < WORTH).map(|f| f.cause.to_string()).collect();
        if !idle.is_empty() && !worth.is_empty() {
            let _ = writeln!(out, "\nno use to change: {}", idle.join(", "));
        }
        out
    }

    fn json(&self) -> String {
        let cause = |f: &Finding| {
            json!({
                "cause": f.cause.name(), "evidence": f.evidence, "remedy": f.remedy, "saving": f.saving,
                "keeps_the_picture": f.cause.keeps_the_picture(), "without": bill(&f.without),
            })
        };
        let value = json!({
            "schema": "meshray-explain/1",
            "version": super::version::SHORT,
            "file": self.name,
            "hash": format!("{:032x}", self.hash),
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
    let work = |w: &Work| json!({"rays": w.rays, "tests": w.tests, "steps": w.steps, "cost": w.cost()});
    let mut classes: Map<String, Value> =
        CLASS_NAMES.iter().zip(&bill.0).map(|(name, w)| ((*name).to_owned(), work(w))).collect();
    classes.insert("all".into(), work(&bill.sum()));
    Value::Object(classes)
}
