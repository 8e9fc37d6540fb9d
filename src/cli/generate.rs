//! `meshray generate`: scenes of any size, for studying how cost grows.

use super::args::GenerateArgs;
use super::exit::Exit;
use super::interrupt;
use super::message::{Messages, Severity};
use super::writable::{self, Sources};
use crate::generate::{Family, triangles};
use crate::load::Diagnostic;
use crate::number::grouped;
use crate::save::{glb, obj};
use crate::scene::Scene;
use std::path::PathBuf;

/// Generates the scene and writes it.
pub(super) fn run(args: &GenerateArgs) -> Exit {
    let messages = Messages::new(args.messages.into(), args.quiet);
    let path = match &args.output {
        Some(path) => path.clone(),
        None => PathBuf::from(format!("{}-{}.glb", args.family, args.size)),
    };
    if args.output.is_none() && path.exists() {
        let text = format!("{} exists and is not replaced", path.display());
        messages.error("output-exists", text, format!("name it to replace it: -o {}", path.display()));
        return Exit::Failed;
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let write = match extension.as_str() {
        "glb" => as_glb,
        "obj" => as_obj,
        _ => {
            let fault = Diagnostic::new("usage", path, "", "a scene is written as .glb or .obj");
            return messages.fail(&fault.remedy("give the output one of these endings"), Exit::Usage);
        }
    };
    if let Err(fault) = writable::check(&path, "-o", &Sources::default()) {
        return messages.fail(&fault, Exit::Failed);
    }
    let scene = args.family.scene(args.size);
    let written = write(&scene).and_then(|bytes| interrupt::write_atomic(&path, &bytes).map_err(|e| e.to_string()));
    match written {
        Ok(()) => {
            let summary = summary(args.family, &scene);
            messages.say(Severity::Info, &Diagnostic::new("generated", path, "", summary));
            Exit::Done
        }
        Err(text) => messages.unwritable(&path, &text),
    }
}

fn as_glb(scene: &Scene) -> Result<Vec<u8>, String> {
    glb::bytes(scene).map_err(|e| e.to_string())
}

fn as_obj(scene: &Scene) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    obj::write(scene, &mut bytes).map_err(|e| e.to_string())?;
    Ok(bytes)
}

fn summary(family: Family, scene: &Scene) -> String {
    let (count, instances) = (grouped(triangles(scene) as u64), scene.instances.len());
    format!("{family}, {count} triangles in {instances} {}", if instances == 1 { "object" } else { "objects" })
}
