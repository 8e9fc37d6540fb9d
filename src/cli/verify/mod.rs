//! `meshray verify`: how far a mesh's hits can be trusted, as text or as JSON.
//!
//! # Schema `meshray-verify/1`
//! One JSON object: `version`, `file`, `hash`, `triangles`, `others` (prims not verified), `rays` (per kind and variation),
//! `seed`; `variations`, each with `what`, `amount`, `collapsed` (triangles of whose three corners rounding made some coincide),
//! `disagreements` (rays on which two structures differ), `spawned` (`rays`, `self_hits`, `slips`, `leaks`, `false_shadows`) and
//! `rows`; a row has `intersector`, `accel` and, for `all` rays and for each kind of `aims`, `rays`, `hits`, `missed`,
//! `false_hits`, `wrong_order` (numbers of rays) and `t_ulps_max`, `t_ulps_rms`; `costs` (`intersector`, `ns_per_ray`, the median
//! of passes, `ns_per_ray_min`, `ns_per_ray_max`); `choose` (an intersector), `trusted`; `unjudged_instances` (further instances
//! of meshes, if all of them would exceed the memory limit). Keys are only ever added.

mod args;
mod report;

use super::exit::Exit;
use super::job::UsageError;
use super::message::Messages;
use super::progress::Progress;
use super::writable::{self, Sources};
use super::{interrupt, panics, read};
use crate::bench::report::Format;
use crate::bench::verify::{Findings, Plan, kernels, verify};
use crate::load::{Diagnostic, Loaded};
use crate::scene::Scene;
pub(super) use args::VerifyArgs;
use std::path::Path;

/// Loads the file, verifies it and prints the findings.
pub(super) fn run(args: &VerifyArgs) -> Exit {
    let messages = Messages::new(args.model.messages.into(), args.quiet);
    panics::guard(&args.model.input.display().to_string(), &messages, || {
        judge(args, &messages).unwrap_or_else(|exit| exit)
    })
}

fn judge(args: &VerifyArgs, messages: &Messages) -> Result<Exit, Exit> {
    let fail = |fault: Diagnostic| messages.fail(&fault, Exit::Failed);
    if let Some(path) = &args.plot {
        if Format::from_path(path) != Ok(Format::Html) {
            let text = format!("--plot {}: a page for a browser ends in .html", path.display());
            return Err(messages.wrong(UsageError(text)));
        }
        writable::check(path, "--plot", &Sources::of([&args.model.input])).map_err(fail)?;
    }
    let limit = args.model.load.limits().memory;
    check_rays(args.rays, limit).map_err(fail)?;
    let mut loaded = read::model_as_stored(&args.model.input, &args.model.load, messages)?;
    if let Some(path) = &args.plot {
        Sources::of(&loaded.facts.files).spared_by(path, "--plot").map_err(fail)?;
    }
    let unjudged = reduce(&mut loaded, limit, &args.model.input).map_err(fail)?;
    let name = args.model.input.display().to_string();
    let plan = Plan { rays: args.rays, seed: args.seed, ..Plan::DEFAULT };
    let findings = findings(&loaded.scene, &plan, &Progress::new(&name, messages, args.quiet, false));
    let findings = findings.ok_or_else(|| {
        let fault = Diagnostic::new("nothing-to-verify", &args.model.input, "", "no triangles to aim at");
        messages.fail(&fault.remedy("give a file with a mesh"), Exit::Input)
    })?;
    if let Some(path) = &args.plot {
        let page = kernels::html(&name, &report::rays(&plan), &kernels::of(&findings));
        let written = interrupt::write_atomic(path, page.as_bytes());
        written.map_err(|e| messages.unwritable(path, &e))?;
    }
    let report = report::Report { name: &name, hash: loaded.facts.hash, unjudged, plan: &plan, findings: &findings };
    let text = if args.json { report.json() } else { report.text() };
    messages.print(&text)?;
    if findings.trusted() {
        return Ok(Exit::Done);
    }
    let text = "the exact test or a structure gave a wrong hit";
    let fault = Diagnostic::new("hits-not-exact", &args.model.input, "", text);
    Err(fail(fault.remedy("please report it with the file")))
}

/// Refuses more rays per kind than fit into the allowed memory.
fn check_rays(rays: usize, limit: u64) -> Result<(), Diagnostic> {
    /// A ray, its exact hit, and the answers of tests.
    const OF_RAY: u64 = 256;
    let need = (rays as u64).saturating_mul(OF_RAY);
    if need <= limit {
        return Ok(());
    }
    let text = format!("{rays} rays of each kind need {need} bytes where {limit} are allowed");
    Err(Diagnostic::new("too-many-rays", "", "", text).remedy("ask for fewer --rays or raise --max-memory"))
}

/// Runs the verification; `None` without triangles.
fn findings(scene: &Scene, plan: &Plan, progress: &Progress) -> Option<Findings> {
    progress.begin("judging");
    let go_on = |done: usize, of: usize| {
        progress.advance(done, of);
        true
    };
    let findings = verify(scene, plan, go_on);
    progress.finish();
    findings
}

/// Drops all but the first instance of each mesh if all together would exceed the memory limit; returns how many were dropped.
fn reduce(loaded: &mut Loaded, limit: u64, file: &Path) -> Result<usize, Diagnostic> {
    let all = loaded.scene.instances.len();
    if read::check_flattened(loaded, limit, file).is_ok() {
        return Ok(0);
    }
    let mut stands = vec![false; loaded.scene.meshes.len()];
    loaded.scene.instances.retain(|instance| !std::mem::replace(&mut stands[instance.mesh as usize], true));
    read::check_flattened(loaded, limit, file)?;
    Ok(all - loaded.scene.instances.len())
}
